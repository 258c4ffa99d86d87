//! A run in progress: each step senses one frame with every camera, sends it, and lets the host track it.

use super::assets::Stopwatch;
use super::expose::expose;
use super::hashes::StageHashes;
use super::sensor::FrameOnLink;
use super::setup::Setup;
use crate::compute::{self, Feature};
use crate::effects::chain::{Capture, Chain, RowSamples, RowTimes};
use crate::energy::{EnergyAccount, RunLength};
use crate::error::Error;
use crate::events::Events;
use crate::link::{self, FrameMetadata, FrameOut};
use crate::num::{f64_from_u64, f64_from_usize, index, u32_from, u64_from, u64_half_even};
use crate::optics::Exposure;
use crate::plane::Plane;
use crate::pose::{Pose, TimedPose};
use crate::readout::{ClockSpan, HdrMerge, Schedule, Shutter};
use crate::tracker::{FrameInput, RowClock, Status, TrackedFrame, Tracker};
use crate::units::{CameraIndex, FrameIndex, RowIndex, Span};

/// Stages whose time is measured, in the data's order.
pub const STAGES: [&str; 6] = ["render", "sensor", "compute", "link", "host_link", "tracker"];

/// What one camera made of one frame.
pub struct CameraFrame {
    /// Mean photons of each pixel over its exposure.
    pub photons: Plane<f32>,
    /// Electrons of each pixel before conversion, of its longest exposure, where `Session::keep_electrons` asked for them.
    pub electrons: Option<Plane<f32>>,
    /// Codes as they leave the readout.
    pub codes: Plane<u16>,
    /// Features as they leave the extractor.
    pub features: Vec<Feature>,
    /// Packets as they leave the link.
    pub packets: Vec<u8>,
    /// Which features the tracker's pose rests on, by index.
    pub tracked: Vec<bool>,
}

/// One frame of the rig.
pub struct Frame {
    /// Counted from 0.
    pub frame: FrameIndex,
    /// Middle between the first row's start and the last row's end of exposure, on the nanosecond.
    pub t_s: f64,
    /// True pose of the body at that time, in the scene's world.
    pub truth: Pose,
    /// One entry a camera.
    pub cameras: Vec<CameraFrame>,
    /// What the host found; none without two cameras or without features on the link.
    pub tracked: Option<TrackedFrame>,
}

/// Figures of one frame that the report needs at the end.
#[derive(Clone, Debug)]
pub(super) struct FrameNotes {
    pub truth: TimedPose,
    pub estimate: Option<Pose>,
    pub predicted: Option<TimedPose>,
    pub mean_code_dn: f64,
    pub exposure_us: f64,
    pub gain: f64,
    pub found: Vec<u32>,
    pub tracked: u32,
    pub innovation_px: Option<f64>,
    pub position_bound_m: Option<f64>,
    pub status: Option<Status>,
    pub loop_closed: bool,
}

/// Sums over the run.
#[derive(Default)]
pub(super) struct Totals {
    pub events: Events,
    pub hashes: StageHashes,
    pub counts: link::LinkCounts,
    pub rays: u64,
    pub render_variance_ratio: f64,
    pub feature_count: u64,
    pub link_bytes: u64,
    pub stage_s: [f64; STAGES.len()],
}

/// A run in progress.
pub struct Session {
    pub(super) setup: Setup,
    tracker: Option<Tracker>,
    /// Photons to codes, at the gain in effect.
    chain: Chain,
    gain: f64,
    /// Electrons that each camera's frame before left in its array, where an effect leaves some.
    charge_before_e: Vec<Option<Plane<f32>>>,
    watched: Option<Watched>,
    /// Whether frames carry electrons, and those of the frame in progress, one entry a camera.
    electrons_kept: bool,
    electrons: Vec<Option<Plane<f32>>>,
    pub(super) notes: Vec<FrameNotes>,
    pub(super) totals: Totals,
}

/// Rows of the first camera whose samples are kept when their frame is sensed.
struct Watched {
    frame: FrameIndex,
    rows: Vec<RowIndex>,
    samples: Vec<RowSamples>,
}

impl Session {
    /// Ready for the first frame.
    ///
    /// # Errors
    /// A calibration that the tracker refuses.
    pub fn new(setup: Setup) -> Result<Self, Error> {
        // A single camera has no scale of its own: its packets are made and decoded, and nothing is tracked.
        let tracker = if setup.cameras.len() == 2 {
            let made = Tracker::new(setup.calibration(), setup.tracker);
            Some(made.map_err(|error| setup.resolved.tree.locate(error))?)
        } else {
            None
        };
        let charge_before_e = setup.cameras.iter().map(|_| None).collect();
        let gain = setup.exposure.gain(FrameIndex(0));
        let chain = setup.chain(gain);
        Ok(Self {
            setup,
            tracker,
            chain,
            gain,
            charge_before_e,
            watched: None,
            electrons_kept: false,
            electrons: Vec::new(),
            notes: Vec::new(),
            totals: Totals::default(),
        })
    }

    /// What the run is made of.
    pub fn setup(&self) -> &Setup {
        &self.setup
    }

    /// Keeps the first camera's samples of these rows when their frame comes, of its first exposure. They change nothing.
    pub fn watch(&mut self, frame: FrameIndex, rows: &[RowIndex]) {
        self.watched = Some(Watched { frame, rows: rows.to_vec(), samples: Vec::new() });
    }

    /// Gives every frame from here on its electrons. They change nothing.
    pub fn keep_electrons(&mut self) {
        self.electrons_kept = true;
    }

    /// Samples of the watched rows at the converters' inputs; empty before their frame.
    pub fn watched(&self) -> &[RowSamples] {
        self.watched.as_ref().map_or(&[], |watched| &watched.samples)
    }

    /// Simulates the next frame of the rig.
    ///
    /// # Errors
    /// A motion that ends before this frame, a frame that its link cannot carry.
    pub fn step(&mut self, watch: &dyn Stopwatch) -> Result<Frame, Error> {
        let frame = FrameIndex(u32_from(self.notes.len()));
        let mut lap = Lap::start(watch);
        let schedules = self.setup.exposure.schedules(frame);
        let exposures = self.render(frame, &schedules)?;
        self.totals.stage_s[0] += lap.next_s();
        let codes = self.capture(frame, &schedules, &exposures);
        self.totals.stage_s[1] += lap.next_s();
        let on_sensor = self.setup.sensor.link.mode.sends_features();
        let features = if on_sensor { self.extract(&codes) } else { vec![Vec::new(); codes.len()] };
        self.totals.stage_s[2] += lap.next_s();
        let packets = self.send(frame, &schedules, &codes, &features)?;
        self.totals.stage_s[3] += lap.next_s();
        let input = self.receive(&packets)?;
        // Without features on the link, those of the host's own extractor stand in their place.
        let features = if on_sensor { features } else { input.features.clone() };
        self.totals.stage_s[4] += lap.next_s();
        let tracked = self.tracker.as_mut().map(|tracker| tracker.track(&input));
        self.totals.stage_s[5] += lap.next_s();

        let t_s = input.t_s;
        let truth = self.pose(t_s)?;
        let cameras: Vec<CameraFrame> = exposures
            .into_iter()
            .zip(codes)
            .zip(features)
            .zip(packets)
            .enumerate()
            .map(|(camera, (((mut exposures, codes), features), packets))| {
                let tracked = marks(tracked.as_ref(), camera, features.len());
                let photons = exposures.swap_remove(0).photons;
                let electrons = self.electrons.get_mut(camera).and_then(Option::take);
                CameraFrame { photons, electrons, codes, features, packets, tracked }
            })
            .collect();
        let done = Frame { frame, t_s, truth, cameras, tracked };
        self.note(&done, &schedules[0]);
        Ok(done)
    }

    fn pose(&self, t_s: f64) -> Result<Pose, Error> {
        self.setup.motion.world_from_body(t_s).map_err(|error| Error::Run(error.to_string()))
    }

    /// What each camera sees, one exposure a slot.
    fn render(&mut self, frame: FrameIndex, schedules: &[Schedule]) -> Result<Vec<Vec<Exposure>>, Error> {
        let setup = &self.setup;
        let mut exposures = Vec::with_capacity(setup.windows.len());
        for (camera_index, (camera, schedule)) in setup.windows.iter().zip(schedules).enumerate() {
            let slot_exposure = |slot: usize| expose(setup, camera, camera_index, schedule, frame, slot);
            exposures.push((0..schedule.slots().len()).map(slot_exposure).collect::<Result<Vec<_>, Error>>()?);
        }
        let slots = f64_from_usize(schedules[0].slots().len());
        for exposure in exposures.iter().flatten() {
            self.totals.rays += exposure.rays;
            self.totals.render_variance_ratio += exposure.render_variance_ratio / slots;
        }
        Ok(exposures)
    }

    /// Codes of each camera: of its exposures, merged where there are several.
    fn capture(&mut self, frame: FrameIndex, schedules: &[Schedule], exposures: &[Vec<Exposure>]) -> Vec<Plane<u16>> {
        let gain = self.setup.exposure.gain(frame);
        if gain.to_bits() != self.gain.to_bits() {
            (self.chain, self.gain) = (self.setup.chain(gain), gain);
        }
        let mut codes = Vec::with_capacity(exposures.len());
        for (camera, (exposures, schedule)) in exposures.iter().zip(schedules).enumerate() {
            let mut read = Vec::with_capacity(exposures.len());
            for (slot, exposure) in exposures.iter().enumerate() {
                let times = row_times(schedule, frame, slot);
                let before_e = self.charge_before_e[camera].as_ref();
                let camera_index = CameraIndex(u32_from(camera));
                let capture = Capture { camera: camera_index, frame, slot: u32_from(slot), before_e };
                if let Some(watched) = self.watched.as_mut().filter(|w| (w.frame, camera, slot) == (frame, 0, 0)) {
                    watched.samples = self.chain.samples_of_rows(&exposure.photons, capture, &times, &watched.rows);
                }
                if self.electrons_kept && slot == 0 {
                    self.electrons.resize(self.setup.cameras.len(), None);
                    self.electrons[camera] = Some(self.chain.electrons(&exposure.photons, capture, &times));
                }
                let captured = self.chain.capture(&exposure.photons, capture, &times);
                self.totals.events.merge(&captured.events);
                read.push(captured.codes);
                self.charge_before_e[camera] = captured.charge_e;
            }
            let merge = self.setup.sensor.merge_of(schedule).filter(|_| read.len() > 1);
            codes.push(merge.map_or_else(|| read[0].clone(), |merge| merge_planes(&merge, &read)));
        }
        codes
    }

    fn extract(&mut self, codes: &[Plane<u16>]) -> Vec<Vec<Feature>> {
        let bits = self.setup.sensor.bits();
        let params = &self.setup.sensor.extractor;
        let pattern_px = self.setup.sensor.pattern_px();
        let one = |plane: &Plane<u16>| {
            let mut events = Events::default();
            let features = compute::extract_from_mosaic(plane, bits, pattern_px, params, &mut events);
            (features, events)
        };
        let mut all = Vec::with_capacity(codes.len());
        for (features, events) in map_cameras(codes, one) {
            self.totals.events.merge(&events);
            all.push(features);
        }
        all
    }

    fn send(
        &mut self,
        frame: FrameIndex,
        schedules: &[Schedule],
        codes: &[Plane<u16>],
        features: &[Vec<Feature>],
    ) -> Result<Vec<Vec<u8>>, Error> {
        let sensor = &self.setup.sensor;
        let nanoseconds = |seconds: f64| u64_half_even(seconds * 1e9);
        let metadata = |schedule: &Schedule| FrameMetadata {
            frame,
            timestamp_ns: nanoseconds(schedule.t_frame(frame)),
            exposure_ns: metadata_ns(schedule.exposure(frame, RowIndex(0)).length_s()),
            row_time_ns: metadata_ns(row_step_s(schedule, frame)),
            temperature_mk: Some(crate::num::low_u32(u64_half_even(sensor.parameters.pixel.temperature_k * 1e3))),
        };
        let mut packets = Vec::with_capacity(codes.len());
        for (camera, ((codes, features), schedule)) in codes.iter().zip(features).zip(schedules).enumerate() {
            let out = FrameOut {
                // Each camera has a link of its own; beyond four of them the channels' numbers come round again.
                virtual_channel: crate::num::low_u8(u32_from(camera % 4)),
                metadata: metadata(schedule),
                codes: Some(codes),
                bits: sensor.bits(),
                features: Some(features),
            };
            // A list without a bound (`top_k = 0`) can outgrow the frame only here.
            let on_link = FrameOnLink { size: sensor.size, bits: out.bits, features: u64_from(features.len()) };
            on_link.check(&sensor.link, schedule)?;
            let bytes = link::pack_frame(&out, &sensor.link, &mut self.totals.events)?;
            self.totals.link_bytes += u64_from(bytes.len());
            packets.push(bytes);
        }
        Ok(packets)
    }

    /// The host's side of the link: from bytes to what the tracker may know.
    fn receive(&mut self, packets: &[Vec<u8>]) -> Result<FrameInput, Error> {
        let mut input = FrameInput { t_s: 0.0, features: Vec::with_capacity(packets.len()), clocks: Vec::new() };
        for bytes in packets {
            let decoded = link::decode(bytes);
            self.totals.counts.merge(&decoded.counts);
            let received = decoded.frames.into_iter().next();
            let received = received.ok_or_else(|| Error::Run("the host received no frame".to_owned()))?;
            let metadata = received.metadata.ok_or_else(|| Error::Run("the host received no metadata".to_owned()))?;
            // A rig has one time a frame: its first camera's.
            if input.features.is_empty() {
                input.t_s = f64_from_u64(metadata.timestamp_ns) * 1e-9;
            }
            let offset_s = f64_from_u64(metadata.timestamp_ns) * 1e-9 - input.t_s;
            input.clocks.push(RowClock { offset_s, row_time_s: f64::from(metadata.row_time_ns) * 1e-9 });
            let features = if self.setup.sensor.link.mode.sends_features() {
                received.features
            } else {
                // The host runs the same extractor on the picture it received; none of it is the sensor's energy.
                let picture = received.picture.ok_or_else(|| Error::Run("the host received no picture".to_owned()))?;
                let bits = self.setup.sensor.bits();
                let (pattern_px, extractor) = (self.setup.sensor.pattern_px(), &self.setup.sensor.extractor);
                compute::extract_from_mosaic(&picture, bits, pattern_px, extractor, &mut Events::default())
            };
            input.features.push(features);
        }
        Ok(input)
    }

    fn note(&mut self, frame: &Frame, schedule: &Schedule) {
        let mut code_sum = 0_u64;
        for camera in &frame.cameras {
            self.totals.hashes.add(&camera.photons, &camera.codes, &camera.features);
            self.totals.feature_count += u64_from(camera.features.len());
            code_sum += camera.codes.values().iter().map(|&code| u64::from(code)).sum::<u64>();
        }
        let pixels = f64_from_usize(self.setup.sensor.size.pixel_count() * frame.cameras.len());
        let tracked = frame.tracked.as_ref();
        let predicted = tracked.and_then(|tracked| tracked.predicted_position_m).map(|translation_m| TimedPose {
            t_s: frame.t_s,
            world_from_body: Pose { translation_m, ..Pose::IDENTITY },
        });
        let mean_code_dn = f64_from_u64(code_sum) / pixels;
        self.setup.exposure.after_frame(frame.frame, mean_code_dn);
        self.notes.push(FrameNotes {
            truth: TimedPose { t_s: frame.t_s, world_from_body: frame.truth },
            estimate: tracked.and_then(|tracked| tracked.world_from_body),
            predicted,
            mean_code_dn,
            exposure_us: 1e6 * schedule.exposure_s(),
            gain: self.gain,
            found: frame.cameras.iter().map(|camera| u32_from(camera.features.len())).collect(),
            tracked: tracked.map_or(0, |tracked| tracked.tracked_features),
            innovation_px: tracked.and_then(|tracked| tracked.innovation_px),
            position_bound_m: tracked.and_then(|tracked| tracked.position_bound_m),
            status: tracked.map(|tracked| tracked.status),
            loop_closed: tracked.is_some_and(|tracked| tracked.loop_closed),
        });
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

    /// Energy of the frames so far.
    pub fn energy(&self) -> EnergyAccount {
        let sensor = &self.setup.sensor;
        let frames = u32_from(self.notes.len());
        let cameras = u32_from(self.setup.cameras.len());
        let length = RunLength {
            frames,
            sensors: cameras,
            pixels: u64_from(sensor.size.pixel_count()) * u64::from(cameras),
            run_time_s: f64::from(frames) * sensor.schedule.frame_time_s(),
        };
        EnergyAccount::of(&self.totals.events, length, &sensor.technology)
    }

    /// Hashes of the bytes of all frames so far, hexadecimal: photons, codes, features, energy.
    pub fn hashes(&self) -> [String; 4] {
        let [photons, codes, features] = self.totals.hashes.hex();
        [photons, codes, features, blake3::hash(&self.energy().to_bytes()).to_hex().to_string()]
    }
}

/// A span for every row of the window; rows that are not read take the last one's that is.
pub(super) fn spans(schedule: &Schedule, of_row: impl Fn(RowIndex) -> Option<ClockSpan>) -> Vec<Span> {
    let window = schedule.geometry().window();
    let mut spans: Vec<Span> = Vec::new();
    for row in window.y_px..window.y_px + window.height_px {
        let span = of_row(RowIndex(row)).map(|span| schedule.span(span)).or_else(|| spans.last().copied());
        spans.push(span.expect("the window's first row is read"));
    }
    spans
}

fn row_times(schedule: &Schedule, frame: FrameIndex, slot: usize) -> Vec<RowTimes> {
    let exposures = spans(schedule, |row| schedule.row_exposure_clk(frame, slot, row));
    let readouts = spans(schedule, |row| schedule.row_readout_clk(frame, slot, row));
    let times = |(exposure, readout): (&Span, &Span)| RowTimes {
        exposure_s: exposure.length_s(),
        storage_s: readout.start_s - exposure.end_s,
        readout_s: readout.start_s,
    };
    exposures.iter().zip(&readouts).map(times).collect()
}

/// A time for the embedded line, whose field ends at 4.29 s: longer ones stand at its end.
fn metadata_ns(seconds: f64) -> u32 {
    u32::try_from(u64_half_even(seconds * 1e9)).unwrap_or(u32::MAX)
}

/// From the exposure of one row of the picture to the next one's; 0 where rows are exposed together.
fn row_step_s(schedule: &Schedule, frame: FrameIndex) -> f64 {
    let start_s = |row| schedule.exposure(frame, RowIndex(row)).start_s;
    match schedule.shutter() {
        Shutter::Global => 0.0,
        Shutter::Rolling => (start_s(schedule.last_row().0) - start_s(0)) / f64::from(schedule.last_row().0.max(1)),
    }
}

fn merge_planes(merge: &HdrMerge, read: &[Plane<u16>]) -> Plane<u16> {
    let mut merged = Plane::filled(read[0].size(), 0_u16);
    for row in 0..merged.height_px() {
        let rows: Vec<&[u16]> = read.iter().map(|plane| plane.row(row)).collect();
        merge.merge_row(&rows, merged.row_mut(row));
    }
    merged
}

fn marks(tracked: Option<&TrackedFrame>, camera: usize, features: usize) -> Vec<bool> {
    let mut marks = vec![false; features];
    for inlier in tracked.iter().flat_map(|tracked| &tracked.inliers) {
        if index(inlier.camera.0) == camera && index(inlier.feature) < features {
            marks[index(inlier.feature)] = true;
        }
    }
    marks
}

#[cfg(feature = "parallel")]
fn map_cameras<T: Send>(codes: &[Plane<u16>], one: impl Fn(&Plane<u16>) -> T + Sync + Send) -> Vec<T> {
    use rayon::prelude::*;
    codes.par_iter().map(one).collect()
}

#[cfg(not(feature = "parallel"))]
fn map_cameras<T>(codes: &[Plane<u16>], one: impl Fn(&Plane<u16>) -> T) -> Vec<T> {
    codes.iter().map(one).collect()
}

/// Times between calls.
struct Lap<'a> {
    watch: &'a dyn Stopwatch,
    last_s: f64,
}

impl<'a> Lap<'a> {
    fn start(watch: &'a dyn Stopwatch) -> Self {
        Self { watch, last_s: watch.now_s() }
    }

    fn next_s(&mut self) -> f64 {
        let now_s = self.watch.now_s();
        let lap_s = now_s - self.last_s;
        self.last_s = now_s;
        lap_s
    }
}
