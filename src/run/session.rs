//! A run in progress: each step senses one frame with every camera, sends it, and lets the host track it.

use super::assets::{Assets, Stopwatch};
use super::code_sums::{CodeSums, saturated_dn};
use super::extractor::extract_all;
use super::host::Host;
use super::imu::ImuReadings;
use super::row_check::RowCheck;
use super::row_times::{merge_planes, row_times};
use super::send::{frame_time_s, marks};
use super::setup::Setup;
use super::shared_exposure::{SharedExposure, StillExposures};
use super::state::RowProbe;
pub(super) use super::state::Totals;
pub use super::state::{CameraFrame, Frame, STAGES, Session};
use super::totals::FrameNotes;
use crate::compute::{Extracted, Extractor};
use crate::effects::chain::{Capture, RowSamples};
use crate::energy::EnergyAccount;
use crate::error::Error;
use crate::fidelity::Rung;
use crate::num::{f64_from_u64, f64_from_u128, f64_from_usize, u32_from, u64_from};
use crate::parallel::collected;
use crate::plane::Plane;
use crate::pose::{Pose, TimedPose};
use crate::readout::Schedule;
use crate::rtl_simulator::SharedRtlSimulator;
use crate::tracker::Tracker;
use crate::units::{CameraIndex, FrameIndex, RowIndex};

impl Session {
    /// Ready for the first frame. Fails on a calibration that the tracker refuses; the rung `expected`, which ends at the image.
    pub fn new(setup: Setup) -> Result<Self, Error> {
        if setup.fidelity.rung == Rung::Expected {
            let reason = "ends at the image: it has no features, packets or poses; use sampled";
            return Err(setup.resolved.tree.locate(Error::key("run.rung", "expected", reason)));
        }
        let mut tracker = setup.camera_tracker()?;
        if let Some(calibration) = setup.imu_calibration() {
            tracker = tracker.with_imu(calibration);
        }
        let imu_readings = ImuReadings::of(&setup)?;
        let charge_before_e = setup.cameras.iter().map(|_| None).collect();
        let gain = setup.exposure.gain(FrameIndex(0));
        let chain = setup.chain(gain);
        // Where pictures alone are sent the host extracts, in software.
        let on_sensor = setup.sensor.link.mode.sends_features();
        let rung = if on_sensor { setup.fidelity.rung } else { Rung::Sampled };
        let extractor = Extractor::new(&setup.sensor.extractor).on_rung(rung).in_verilog(setup.verilog().cloned());
        let extractors = vec![extractor; setup.cameras.len()];
        let warnings = setup.warnings.clone();
        let delays_s = setup.sensor.row_delays_s().map_err(|error| setup.resolved.tree.locate(error))?;
        Ok(Self {
            setup,
            tracker,
            alone: None,
            imu_readings,
            extractors,
            chain,
            gain,
            delays_s,
            host: Host::default(),
            charge_before_e,
            still: StillExposures::default(),
            probe: None,
            row_check: None,
            electrons_kept: false,
            electrons: Vec::new(),
            hashes_pictures: true,
            notes: Vec::new(),
            totals: Totals::default(),
            warnings,
        })
    }

    /// Seconds that a stage has taken so far, by the stopwatch that `step` was given. Panics at a name that is not in `STAGES`.
    pub fn stage_s(&self, stage: &str) -> f64 {
        let at = STAGES.iter().position(|name| *name == stage).expect("a stage of STAGES");
        self.totals.stage_s[at]
    }

    /// What the run is made of.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// What the run was made of, for another run beside it.
    pub fn into_setup(self) -> Setup {
        self.setup
    }

    /// Keeps the first camera's samples of these rows when their frame comes, of its first exposure. They change nothing.
    pub fn probe_rows(&mut self, frame: FrameIndex, rows: &[RowIndex]) {
        self.probe = Some(RowProbe { frame, rows: rows.to_vec(), samples: Vec::new() });
    }

    /// Converts every `every`-th row of all frames from here on once more on the rung above, which it names: clock by clock for a run on
    /// `sampled`, in Verilog from these assets for one on `clocked`. The first code that differs ends the run.
    /// Fails on a run on another rung, 0, or no Verilog where it is needed.
    pub fn check_rows(&mut self, every: u32, assets: &dyn Assets) -> Result<Rung, Error> {
        let check = RowCheck::new(&self.setup, every, assets)?;
        let rung = check.rung();
        self.row_check = Some(check);
        Ok(rung)
    }

    /// Rows that were converted once more.
    pub fn rows_checked(&self) -> u64 {
        self.row_check.as_ref().map_or(0, |check| check.rows)
    }

    /// Gives every frame from here on its electrons. They change nothing.
    pub fn keep_electrons(&mut self) {
        self.electrons_kept = true;
    }

    /// Leaves photons and codes out of the run's hashes, for runs whose figures alone are asked for: hashing takes as long as a stage.
    pub fn leave_pictures_unhashed(&mut self) {
        self.hashes_pictures = false;
    }

    /// Samples of the probed rows at the converters' inputs; empty before their frame.
    pub fn probed_rows(&self) -> &[RowSamples] {
        self.probe.as_ref().map_or(&[], |probe| &probe.samples)
    }

    /// Simulates the next frame of the rig. Fails on a motion that ends before this frame, a frame that its link cannot carry.
    pub fn step(&mut self, stopwatch: &dyn Stopwatch) -> Result<Frame, Error> {
        let mut lap = Lap::start(stopwatch);
        let exposures = self.next_exposures()?;
        self.totals.stage_s[0] += lap.next_s();
        self.step_with(exposures, stopwatch)
    }

    /// What each camera sees in the next frame, one exposure a slot. Fails on a picture that cannot be read any more.
    pub fn next_exposures(&self) -> Result<Vec<Vec<SharedExposure>>, Error> {
        let frame = self.next_frame();
        let schedules = self.setup.exposure.schedules(frame);
        let of = |camera: usize| match self.still.again(camera, &schedules[camera], frame) {
            Some(seen) => Ok(seen),
            None => {
                let seen = self.setup.exposures_of(frame, camera, &schedules[camera])?;
                Ok(seen.into_iter().map(SharedExposure::from).collect())
            }
        };
        collected(schedules.len(), of).into_iter().collect()
    }

    /// The next frame from what its cameras saw: runs that differ behind the lens alone may share it.
    pub fn step_with(
        &mut self,
        exposures: Vec<Vec<SharedExposure>>,
        stopwatch: &dyn Stopwatch,
    ) -> Result<Frame, Error> {
        let frame = self.next_frame();
        let mut lap = Lap::start(stopwatch);
        let schedules = self.setup.exposure.schedules(frame);
        self.count_rays(&exposures);
        if self.setup.is_still() {
            self.still.keep(&schedules, frame, &exposures);
        }
        let codes = self.capture(frame, &schedules, &exposures)?;
        self.totals.stage_s[1] += lap.next_s();
        let on_sensor = self.setup.sensor.link.mode.sends_features();
        let mut extracted = if on_sensor { self.extract(&codes)? } else { vec![Extracted::default(); codes.len()] };
        self.totals.stage_s[2] += lap.next_s();
        let (packets, times): (Vec<_>, Vec<_>) =
            self.send(frame, &schedules, &codes, &mut extracted)?.into_iter().unzip();
        self.totals.stage_s[3] += lap.next_s();
        let host = self.receive(&packets)?;
        // Without features on the link, those of the host's own extractor stand in for them.
        if !on_sensor {
            extracted.iter_mut().zip(&host.input.features).for_each(|(one, found)| one.features.clone_from(found));
        }
        self.totals.stage_s[4] += lap.next_s();
        self.tracker.add_imu_readings(self.imu_readings.until(host.input.t_s));
        let tracked = self.tracker.track(&host.input);
        self.totals.stage_s[5] += lap.next_s();
        if let Some(alone) = &mut self.alone {
            alone.track(&host.input);
            alone.seconds += lap.next_s();
        }

        let t_s = frame_time_s(&schedules[0], frame);
        let truth = self.pose(t_s)?;
        let cameras: Vec<CameraFrame> = exposures
            .into_iter()
            .zip(codes)
            .zip(extracted)
            .zip(packets.into_iter().zip(times))
            .enumerate()
            .map(|(camera, (((mut exposures, codes), extracted), (packets, packet_times)))| {
                let Extracted { features, out_clk: features_clk, threshold, .. } = extracted;
                let threshold = on_sensor.then_some(threshold);
                let tracked = marks(&tracked, camera, &host.indices[camera], features.len());
                let photons = exposures.swap_remove(0).photons;
                let electrons = self.electrons.get_mut(camera).and_then(Option::take);
                CameraFrame {
                    photons,
                    electrons,
                    codes,
                    features,
                    features_clk,
                    threshold,
                    packets,
                    packet_times,
                    tracked,
                }
            })
            .collect();
        let done = Frame { frame, t_s, truth, cameras, tracked };
        self.note(&done, &schedules[0]);
        Ok(done)
    }

    /// Notes what the report needs to know of a frame at the end.
    fn note(&mut self, frame: &Frame, schedule: &Schedule) {
        let (mut sums, saturated_dn) = (CodeSums::default(), saturated_dn(&self.setup, self.gain));
        for camera in &frame.cameras {
            if self.hashes_pictures {
                self.totals.hashes.add(&camera.photons, &camera.codes);
            }
            self.totals.hashes.add_features(&camera.features);
            self.totals.feature_count += u64_from(camera.features.len());
            sums.add(CodeSums::of(&camera.codes, saturated_dn));
        }
        self.totals.codes.add(sums);
        let tracked = &frame.tracked;
        self.totals.hashes.add_pose(tracked);
        let predicted = tracked.predicted_position_m.map(|translation_m| TimedPose {
            t_s: frame.t_s,
            world_from_body: Pose { translation_m, ..Pose::IDENTITY },
        });
        let mean_code_dn = sums.mean_dn();
        self.setup.exposure.after_frame(frame.frame, mean_code_dn);
        self.notes.push(FrameNotes {
            truth: TimedPose { t_s: frame.t_s, world_from_body: frame.truth },
            estimate: tracked.world_from_body,
            predicted,
            mean_code_dn,
            exposure_us: 1e6 * schedule.exposure_s(),
            gain: self.gain,
            found: frame.cameras.iter().map(|camera| u32_from(camera.features.len())).collect(),
            tracked: tracked.tracked_features,
            innovation_px: tracked.innovation_px,
            single_picture_sigma_m: tracked.single_picture_sigma_m,
            status: tracked.status,
            events: tracked.events(self.notes.last().map(|note| note.status)).collect(),
            thresholds: frame.cameras.iter().filter_map(|camera| camera.threshold).collect(),
            link_bits: 0.0,
            energy_pj: 0.0,
            latency_us: 1e6 * self.totals.link.frame_latency_s,
        });
        self.note_own_costs();
    }

    /// Bits and energy of the last frame alone.
    fn note_own_costs(&mut self) {
        let (energy_aj, link_bytes) = (self.energy().total_aj(), self.totals.link.traffic.link_bytes);
        let spent_aj = energy_aj.saturating_sub(self.totals.energy_before_aj);
        let sent = link_bytes.saturating_sub(self.totals.link_bytes_before);
        (self.totals.energy_before_aj, self.totals.link_bytes_before) = (energy_aj, link_bytes);
        let note = self.notes.last_mut().expect("a frame was noted");
        note.energy_pj = 1e-6 * f64_from_u128(spent_aj);
        note.link_bits = 8.0 * f64_from_u64(sent);
    }

    fn pose(&self, t_s: f64) -> Result<Pose, Error> {
        self.setup.motion.world_from_body(t_s).map_err(|error| Error::Run(error.to_string()))
    }

    pub(super) fn next_frame(&self) -> FrameIndex {
        FrameIndex(u32_from(self.notes.len()))
    }

    fn count_rays(&mut self, exposures: &[Vec<SharedExposure>]) {
        let slots = f64_from_usize(exposures[0].len());
        for exposure in exposures.iter().flatten() {
            self.totals.rays += exposure.rays;
            self.totals.render_variance_ratio += exposure.render_variance_ratio / slots;
        }
    }

    /// Codes of each camera: of its exposures, merged where there are several.
    fn capture(
        &mut self,
        frame: FrameIndex,
        schedules: &[Schedule],
        exposures: &[Vec<SharedExposure>],
    ) -> Result<Vec<Plane<u16>>, Error> {
        let gain = self.setup.exposure.gain(frame);
        if gain.to_bits() != self.gain.to_bits() {
            (self.chain, self.gain) = (self.setup.chain(gain), gain);
            self.row_check.iter_mut().for_each(RowCheck::forget_chain);
        }
        let sends_rows = self.setup.sensor.link.sends_codes_in(frame);
        let mut codes = Vec::with_capacity(exposures.len());
        for (camera, (exposures, schedule)) in exposures.iter().zip(schedules).enumerate() {
            let mut read = Vec::with_capacity(exposures.len());
            for (slot, exposure) in exposures.iter().enumerate() {
                let late_s: &[f64] = if sends_rows { &self.delays_s } else { &[] };
                let times = row_times(schedule, frame, slot, late_s);
                let before_e = self.charge_before_e[camera].as_ref();
                let camera_index = CameraIndex(u32_from(camera));
                let capture = Capture { camera: camera_index, frame, slot: u32_from(slot), before_e };
                if let Some(probe) = self.probe.as_mut().filter(|p| (p.frame, camera, slot) == (frame, 0, 0)) {
                    probe.samples = self.chain.samples_of_rows(&exposure.photons, capture, &times, &probe.rows);
                }
                if self.electrons_kept && slot == 0 {
                    self.electrons.resize(self.setup.cameras.len(), None);
                    self.electrons[camera] = Some(self.chain.electrons(&exposure.photons, capture, &times));
                }
                let captured = self.chain.capture(&exposure.photons, capture, &times);
                if let Some(check) = &mut self.row_check {
                    let own = || self.setup.chain(gain);
                    check.check(own, &exposure.photons, capture, &times, &captured.codes)?;
                }
                self.setup.verilog().map_or(Ok(()), SharedRtlSimulator::check)?;
                self.totals.events.merge(&captured.events);
                read.push(captured.codes);
                self.charge_before_e[camera] = captured.charge_e;
            }
            let merge = self.setup.sensor.merge_of(schedule).filter(|_| read.len() > 1);
            codes.push(match merge {
                Some(merge) => merge_planes(&merge, &read),
                None => read.swap_remove(0),
            });
        }
        Ok(codes)
    }

    /// Features of each camera, as its extractor's rows follow those of the readout.
    fn extract(&mut self, codes: &[Plane<u16>]) -> Result<Vec<Extracted>, Error> {
        let mut all = Vec::with_capacity(codes.len());
        for extracted in extract_all(&self.setup.sensor, &mut self.extractors, codes) {
            let (extracted, events) = extracted?;
            self.totals.events.merge(&events);
            self.totals.extractor.add(&extracted);
            all.push(extracted);
        }
        Ok(all)
    }

    /// True poses of the frames so far, in the scene's world.
    pub fn truth(&self) -> Vec<TimedPose> {
        self.notes.iter().map(|note| note.truth).collect()
    }

    /// Estimated poses of the frames so far that have one, in the tracker's world.
    pub fn estimate(&self) -> Vec<TimedPose> {
        let pose = |note: &FrameNotes| Some(TimedPose { t_s: note.truth.t_s, world_from_body: note.estimate? });
        self.notes.iter().filter_map(pose).collect()
    }

    /// The tracker as it stands after the frames so far.
    pub fn tracker(&self) -> &Tracker {
        &self.tracker
    }

    /// Energy of the frames so far.
    pub fn energy(&self) -> EnergyAccount {
        let sensor = &self.setup.sensor;
        let frames = u32_from(self.notes.len());
        let cameras = u32_from(self.setup.cameras.len());
        let pixels = u64_from(sensor.size.pixel_count()) * u64::from(cameras);
        EnergyAccount::of(&self.totals.events, frames, cameras, pixels, &sensor.power)
    }

    /// Hashes of the bytes of all frames so far, hexadecimal: photons, codes, features, energy, poses.
    pub fn hashes(&self) -> [String; 5] {
        let [photons, codes, features, poses] = self.totals.hashes.hex();
        [photons, codes, features, blake3::hash(&self.energy().to_bytes()).to_hex().to_string(), poses]
    }
}

/// Times between calls.
struct Lap<'a> {
    stopwatch: &'a dyn Stopwatch,
    last_s: f64,
}

impl<'a> Lap<'a> {
    fn start(stopwatch: &'a dyn Stopwatch) -> Self {
        Self { stopwatch, last_s: stopwatch.now_s() }
    }

    fn next_s(&mut self) -> f64 {
        let now_s = self.stopwatch.now_s();
        let lap_s = now_s - self.last_s;
        self.last_s = now_s;
        lap_s
    }
}
