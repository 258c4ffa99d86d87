//! `sensel track`: the tracker alone, on the pictures of an EuRoC or TUM folder, real or simulated, of any number of cameras.

use std::path::{Path, PathBuf};

use sensel::compute::{AlwaysReady, AtOnce, Extractor, Feature, Pixels, Records};
use sensel::config::Resolved;
use sensel::error::Error;
use sensel::events::Events;
use sensel::files::euroc::{CameraFolder, EurocReader, FrameEntry, ImuFolder, ImuReading};
use sensel::files::grey::{self, Grey};
use sensel::files::map::ply;
use sensel::files::tum::TumFolder;
use sensel::num::{f64_from_i64, f64_from_u64};
use sensel::plane::Plane;
use sensel::pose::{Pose, TimedPose, format_tum};
use sensel::report::{TrajectoryFigures, trajectory_figures};
use sensel::tracker::{
    CameraCalibration, FrameInput, ImuCalibration, Reading, Status, TrackedFrame, Tracker, TrackerParams,
};
use serde_json::json;

use super::args::{Shared, TrackArguments};
use super::{listing, place, progress};

/// Pictures of two cameras this near in time are one frame of the rig.
const PAIR_NS_MAX: u64 = 1_000_000;

/// A recording, whichever its layout.
struct Recording {
    cameras: Vec<CameraCalibration>,
    /// Pictures of each camera in rising time.
    frames: Vec<Vec<FrameEntry>>,
    ground_truth: Option<Vec<TimedPose>>,
    imu: Option<ImuFolder>,
}

impl Recording {
    fn open(folder: &Path) -> Result<Self, Error> {
        if TumFolder::is_one(folder) {
            let TumFolder { frames, lens, ground_truth } = TumFolder::open(folder)?;
            let Some(first) = frames.first() else {
                let reason = "lists no picture".to_owned();
                return Err(Error::Content { file: folder.display().to_string(), reason });
            };
            let size = grey::read(&first.path)?.codes.size();
            let camera = CameraCalibration { lens, size, body_from_camera: Pose::IDENTITY };
            return Ok(Self { cameras: vec![camera], frames: vec![frames], ground_truth, imu: None });
        }
        let reader = EurocReader::open(folder)?;
        let calibration = |folder: &CameraFolder| CameraCalibration {
            lens: folder.camera.lens,
            size: folder.camera.size,
            body_from_camera: folder.camera.body_from_camera,
        };
        Ok(Self {
            cameras: reader.cameras().iter().map(calibration).collect(),
            frames: reader.cameras().iter().map(|folder| folder.frames.clone()).collect(),
            ground_truth: reader.ground_truth().map(<[TimedPose]>::to_vec),
            imu: reader.imu().cloned(),
        })
    }

    /// The truth of what the tracker reports: the body, or one camera's own place.
    fn reported(&self, truth: &[TimedPose]) -> Vec<TimedPose> {
        let arm = match &self.cameras[..] {
            [only] => Pose { translation_m: only.body_from_camera.translation_m, ..Pose::IDENTITY },
            _ => Pose::IDENTITY,
        };
        truth.iter().map(|pose| TimedPose { world_from_body: pose.world_from_body.then(&arm), ..*pose }).collect()
    }

    /// Indices of pictures that belong together, one a camera, in rising time.
    fn together(&self) -> Vec<Vec<usize>> {
        let mut at = vec![0; self.frames.len()];
        let mut all = Vec::new();
        for (first, frame) in self.frames[0].iter().enumerate() {
            let mut indices = vec![first];
            for (camera, frames) in self.frames.iter().enumerate().skip(1) {
                let next = &mut at[camera];
                while *next < frames.len() && frames[*next].timestamp_ns + PAIR_NS_MAX < frame.timestamp_ns {
                    *next += 1;
                }
                let is_near = |other: &FrameEntry| other.timestamp_ns.abs_diff(frame.timestamp_ns) <= PAIR_NS_MAX;
                indices.extend(frames.get(*next).filter(|other| is_near(other)).map(|_| *next));
            }
            if indices.len() == self.frames.len() {
                all.push(indices);
            }
        }
        all
    }

    fn load(&self, camera: usize, frame: usize) -> Result<(Plane<u16>, u32), Error> {
        let entry = &self.frames[camera][frame];
        let Grey { codes, bits, .. } = grey::read(&entry.path)?;
        let (found, wanted) = (codes.size(), self.cameras[camera].size);
        if found == wanted {
            return Ok((codes, bits));
        }
        let reason = format!(
            "is {}x{}; the camera's pictures are {}x{}",
            found.width_px, found.height_px, wanted.width_px, wanted.height_px
        );
        Err(Error::Content { file: entry.path.display().to_string(), reason })
    }
}

/// What the tracker made of a recording.
#[derive(Default)]
struct Course {
    poses: Vec<TimedPose>,
    frames: usize,
    /// Lost and found again, starts and closed loops, with their times in seconds.
    events: Vec<(f64, &'static str)>,
    last: Option<Status>,
}

impl Course {
    fn add(&mut self, t_s: f64, tracked: &TrackedFrame) {
        self.frames += 1;
        self.poses.extend(tracked.world_from_body.map(|world_from_body| TimedPose { t_s, world_from_body }));
        let event = match (self.last, tracked.status) {
            (_, Status::Initialised) => Some("initialised"),
            (was, Status::Lost) if was != Some(Status::Lost) => Some("lost"),
            (Some(Status::Lost), Status::Tracked | Status::Relocalised) => Some("found again"),
            (_, Status::Relocalised) => Some("relocalised"),
            _ => None,
        };
        self.events.extend(event.map(|event| (t_s, event)));
        self.events.extend(tracked.loop_closed.then_some((t_s, "loop closed")));
        self.last = Some(tracked.status);
    }
}

/// `sensel track`.
pub fn main(arguments: &TrackArguments, shared: &Shared) -> Result<(), Error> {
    let recording = Recording::open(&arguments.folder)?;
    // A folder that a run wrote brings its own configuration; any other takes the defaults.
    let own = arguments.folder.join("config.toml");
    let (layer, text) = match std::fs::read_to_string(&own) {
        Ok(text) => (own.display().to_string(), text),
        Err(_) => ("command line".to_owned(), String::new()),
    };
    let resolved = Resolved::from_layers(&layer, &text, &shared.set)?;
    let out = output_file(shared)?;
    let extractor = resolved.scenario.extractor().map_err(|error| resolved.tree.locate(error))?;
    let mut extractors = vec![Extractor::new(&extractor); recording.cameras.len()];
    let params =
        TrackerParams { seed: shared.seed.unwrap_or(resolved.scenario.seed), ..resolved.scenario.tracker_params()? };
    let mut tracker = Tracker::new(recording.cameras.clone(), params)?;
    let feels =
        resolved.scenario.tracker_feels(recording.imu.is_some()).map_err(|error| resolved.tree.locate(error))?;
    let unit = recording.imu.as_ref().filter(|_| feels);
    if let Some(ImuFolder { imu, .. }) = unit {
        let noise = sensel::run::noise_of(&imu.noise);
        tracker = tracker.with_imu(ImuCalibration { body_from_imu: imu.body_from_imu, noise });
    }
    let mut readings = unit.map_or(&[][..], |unit| &unit.readings);

    let together = recording.together();
    // Some recorders stamp with nanoseconds since 1970; the tracker's own clock starts with the first frame.
    let start_ns = together.first().map_or(0, |indices| recording.frames[0][indices[0]].timestamp_ns);
    let bar = progress::bar("frames", together.len().try_into().unwrap_or(u64::MAX), shared.quiet);
    let mut course = Course::default();
    for indices in &together {
        let mut features: Vec<Vec<Feature>> = Vec::new();
        for (camera, (&frame, extractor)) in indices.iter().zip(&mut extractors).enumerate() {
            let (codes, bits) = recording.load(camera, frame)?;
            let io = (&mut AtOnce as &mut dyn Pixels, &mut AlwaysReady as &mut dyn Records);
            features.push(extractor.frame(&codes, bits, (1, 1), io, &mut Events::default())?.features);
        }
        let timestamp_ns = recording.frames[0][indices[0]].timestamp_ns;
        // Recordings do not say when their rows were exposed.
        let t_s = f64_from_u64(timestamp_ns - start_ns) * 1e-9;
        tracker.feel(&felt(&mut readings, (start_ns, timestamp_ns)));
        let tracked = tracker.track(&FrameInput { t_s, features, clocks: Vec::new() });
        course.add(f64_from_u64(timestamp_ns) * 1e-9, &tracked);
        bar.inc(1);
    }
    bar.finish_and_clear();
    std::fs::write(&out, format_tum(&course.poses)).map_err(|source| place::io(&out, source))?;
    if let Some(map) = &arguments.map {
        std::fs::write(map, ply(tracker.landmarks())).map_err(|source| place::io(map, source))?;
    }
    say(&recording, &course, &out, shared);
    Ok(())
}

/// The readings up to the first one after a frame, on the tracker's clock; the rest stays.
fn felt(readings: &mut &[ImuReading], (start_ns, frame_ns): (u64, u64)) -> Vec<Reading> {
    let to = readings.partition_point(|reading| reading.timestamp_ns <= frame_ns) + 1;
    let (now, later) = readings.split_at(to.min(readings.len()));
    *readings = later;
    let reading = |reading: &ImuReading| Reading {
        // Those from before the first frame have negative times.
        t_s: f64_from_i64(reading.timestamp_ns.wrapping_sub(start_ns).cast_signed()) * 1e-9,
        angular_velocity_rad_per_s: reading.angular_velocity_rad_per_s,
        acceleration_m_per_s2: reading.acceleration_m_per_s2,
    };
    now.iter().map(reading).collect()
}

/// Where the trajectory goes. Without `--out` an existing file is not replaced.
fn output_file(shared: &Shared) -> Result<PathBuf, Error> {
    let default = PathBuf::from("trajectory_est.tum");
    match &shared.out {
        Some(file) => Ok(file.clone()),
        None if default.exists() => {
            let reason = "exists already; --out FILE would do".to_owned();
            Err(Error::Content { file: default.display().to_string(), reason })
        }
        None => Ok(default),
    }
}

fn say(recording: &Recording, course: &Course, out: &Path, shared: &Shared) {
    let truth = recording.ground_truth.as_ref().map(|truth| recording.reported(truth));
    let figures = truth.and_then(|truth| trajectory_figures(&truth, &course.poses).ok());
    let ate_m = |part: fn(&TrajectoryFigures) -> Option<f64>| figures.as_ref().and_then(part);
    let rigid_m = ate_m(|figures| figures.se3.as_ref().ok().map(|aligned| aligned.ate_m));
    let scaled_m = ate_m(|figures| figures.sim3.as_ref().ok().map(|aligned| aligned.ate_m));
    let (tracked, frames) = (course.poses.len(), course.frames);
    if shared.json {
        let events: Vec<_> = course.events.iter().map(|(t_s, event)| json!({"t_s": t_s, "event": event})).collect();
        let json = json!({
            "frames": frames, "tracked": tracked, "trajectory": out.display().to_string(), "ate_m": rigid_m,
            "ate_sim3_m": scaled_m, "events": events,
        });
        listing::print_json(&json);
    } else if !shared.quiet {
        outln!("trajectory: {}", out.display());
        // One camera's path has a unit of its own.
        let (ate_m, how) = if recording.cameras.len() == 1 { (scaled_m, ", scale aligned") } else { (rigid_m, "") };
        if let Some(ate_m) = ate_m {
            outln!("ATE {:.2} mm against the folder's ground truth{how}", 1e3 * ate_m);
        }
        for (t_s, event) in &course.events {
            outln!("{t_s:.3} s: {event}");
        }
        outln!("{frames} frames, {tracked} tracked, {} without a pose", frames - tracked);
    }
}
