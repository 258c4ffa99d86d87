//! The folder of a run: report, EuRoC folder, trajectories, features, effective configuration, kept stages. It is built beside
//! its target and renamed; a run that fails leaves nothing.

use std::fs::File;
use std::io::{BufWriter, Write as _};
use std::path::{Path, PathBuf};
use std::time::Instant;

use sensel::error::Error;
use sensel::files::euroc::{EurocCamera, EurocImu, EurocWriter, GroundTruth, ImuReading};
use sensel::files::finished::CAMERAS_ALONE;
use sensel::files::folder::OutputFolder;
use sensel::files::map::ply;
use sensel::files::truth::{Keep, KeptOutput, TruthWriter};
use sensel::files::{io_error, write};
use sensel::num::{u32_from, u64_half_even};
use sensel::pose::format_tum;
use sensel::report::html::{FramePicture, FramePictures, Mark, html};
use sensel::report::{Report, display_curve};
use sensel::run::{Frame, Session, Setup};
use sensel::units::CameraIndex;

use super::{features, paths};

/// Frames of the first camera that the report shows, evenly over the run.
const STRIP: u32 = 6;

pub struct Output {
    folder: OutputFolder,
    keep: Keep,
    kept: TruthWriter,
    euroc: EurocWriter,
    packets: Vec<BufWriter<File>>,
    /// When each packet was on the lanes, a line a packet.
    packet_times: Vec<BufWriter<File>>,
    pictures: FramePictures,
    frames: u32,
    seconds: f64,
}

impl Output {
    /// Starts the folder. Fails on a folder there that is not ours, or as the disk says.
    pub fn create(target: &Path, setup: &Setup, keep: Keep) -> Result<Self, Error> {
        keep.check(setup.cameras.len())?;
        let folder = OutputFolder::create(target)?;
        let cameras: Vec<EurocCamera> = setup
            .cameras
            .iter()
            .map(|camera| EurocCamera {
                body_from_camera: camera.body_from_camera,
                rate_hz: setup.sensor.schedule.fps(),
                size: camera.size,
                lens: camera.lens,
            })
            .collect();
        let unit = setup.imu.map(|imu| EurocImu { body_from_imu: imu.body_from_imu, noise: imu.noise });
        let euroc = EurocWriter::create(folder.path(), &cameras, unit.as_ref())?;
        let (mut packets, mut packet_times) = (Vec::new(), Vec::new());
        for camera in 0..cameras.len() {
            if keep.has(KeptOutput::Packets) {
                packets.push(create(&folder.path().join(format!("cam{camera}.csi2")))?);
                let path = folder.path().join(format!("cam{camera}.packets.csv"));
                let mut times = create(&path)?;
                writeln!(times, "frame,bytes,start_ns,last_bit_ns").map_err(io_error(&path))?;
                packet_times.push(times);
            }
        }
        let kept = TruthWriter::create(folder.path(), &keep, setup)?;
        Ok(Self {
            folder,
            keep,
            kept,
            euroc,
            packets,
            packet_times,
            pictures: FramePictures::default(),
            frames: setup.frames,
            seconds: 0.0,
        })
    }

    pub fn path(&self) -> &Path {
        self.folder.path()
    }

    /// Spent on writing so far.
    pub fn seconds(&self) -> f64 {
        self.seconds
    }

    pub fn frame(&mut self, session: &Session, frame: &Frame) -> Result<(), Error> {
        let started = Instant::now();
        let bits = session.setup().sensor.bits();
        let timestamp_ns = u64_half_even(frame.t_s * 1e9);
        for (index, camera) in frame.cameras.iter().enumerate() {
            self.euroc.add_frame(CameraIndex(u32_from(index)), timestamp_ns, &camera.codes, bits)?;
            if let Some(file) = self.packets.get_mut(index) {
                let path = PathBuf::from(format!("cam{index}.csi2"));
                file.write_all(&camera.packets).map_err(io_error(&path))?;
            }
            if let Some(file) = self.packet_times.get_mut(index) {
                let path = PathBuf::from(format!("cam{index}.packets.csv"));
                for packet in &camera.packet_times {
                    let [start_ns, last_bit_ns] =
                        [packet.start_s, packet.last_bit_s].map(|time_s| u64_half_even(time_s * 1e9));
                    writeln!(file, "{},{},{start_ns},{last_bit_ns}", frame.frame.0, packet.bytes)
                        .map_err(io_error(&path))?;
                }
            }
            if self.keep.has(KeptOutput::Features) {
                let path = self.folder.path().join(format!("features/cam{index}/{timestamp_ns}.csv"));
                write(&path, features::csv(&camera.features))?;
            }
        }
        self.kept.add_frame(session, frame)?;
        let every = self.frames.div_ceil(STRIP).max(1);
        if frame.frame.0.is_multiple_of(every) {
            let black_level_dn = session.setup().sensor.parameters.adc.black_level_dn;
            self.pictures.strip.push(shown(frame, bits, black_level_dn));
        }
        self.seconds += started.elapsed().as_secs_f64();
        Ok(())
    }

    /// Links a picture of waveforms, by its path in the folder, from the report; other waveform files have no viewer in a browser.
    pub fn link_waves(&mut self, path: &Path) {
        if path.extension().is_some_and(|ending| ending.eq_ignore_ascii_case("svg")) {
            self.pictures.waves = Some(path.display().to_string());
        }
    }

    /// Writes what is known only at the end, and moves the folder to its target.
    pub fn finish(mut self, session: &Session, report: &Report) -> Result<(), Error> {
        self.write_motion(session)?;
        for file in self.packets.iter_mut().chain(&mut self.packet_times) {
            file.flush().map_err(io_error(self.folder.path()))?;
        }
        let folder = self.folder.path();
        write(&folder.join("report.json"), report.to_json()?)?;
        write(&folder.join("report.html"), html(report, &self.pictures))?;
        write(&folder.join("config.toml"), session.setup().resolved.recorded_text())?;
        write(&folder.join("trajectory_gt.tum"), format_tum(&session.truth()))?;
        write(&folder.join("trajectory_est.tum"), format_tum(&session.estimate()))?;
        if let Some(alone) = session.estimate_of_cameras_alone() {
            write(&folder.join(CAMERAS_ALONE), format_tum(&alone))?;
        }
        if self.keep.has(KeptOutput::Map) {
            write(&folder.join("map.ply"), ply(session.tracker().landmarks()))?;
            write(&folder.join("keyframes.tum"), format_tum(&session.tracker().keyframes()))?;
        }
        self.euroc.finish()?;
        self.kept.finish(session.setup())?;
        paths::put(self.folder)
    }

    fn write_motion(&mut self, session: &Session) -> Result<(), Error> {
        let motion = &session.setup().motion;
        let readings = session.setup().imu_samples(session.setup().end_s())?;
        for reading in &readings {
            self.euroc.add_imu(&ImuReading {
                timestamp_ns: u64_half_even(reading.t_s * 1e9),
                angular_velocity_rad_per_s: reading.angular_velocity_rad_per_s,
                acceleration_m_per_s2: reading.acceleration_m_per_s2,
            })?;
        }
        self.kept.add_readings(&readings)?;
        for pose in session.truth() {
            let state = motion.state(pose.t_s).map_err(|error| Error::Run(error.to_string()))?;
            let nearest = readings.partition_point(|reading| reading.t_s <= pose.t_s).saturating_sub(1);
            let bias = readings.get(nearest);
            self.euroc.add_ground_truth(&GroundTruth {
                timestamp_ns: u64_half_even(pose.t_s * 1e9),
                world_from_body: pose.world_from_body,
                velocity_m_per_s: state.velocity_m_per_s,
                gyroscope_bias_rad_per_s: bias.map(|bias| bias.gyroscope_bias_rad_per_s).unwrap_or_default(),
                accelerometer_bias_m_per_s2: bias.map(|bias| bias.accelerometer_bias_m_per_s2).unwrap_or_default(),
            })?;
        }
        Ok(())
    }
}

fn shown(frame: &Frame, bits: u32, black_level_dn: u32) -> FramePicture {
    let camera = &frame.cameras[0];
    let marks = camera.features.iter().zip(&camera.tracked);
    FramePicture {
        values: display_curve(&camera.codes, bits, black_level_dn),
        caption: format!("camera 0, frame {}, {:.3} s", frame.frame.0, frame.t_s),
        marks: marks.map(|(f, &tracked)| Mark { x_px: f.x_px(), y_px: f.y_px(), tracked }).collect(),
    }
}

fn create(path: &Path) -> Result<BufWriter<File>, Error> {
    Ok(BufWriter::new(File::create(path).map_err(io_error(path))?))
}
