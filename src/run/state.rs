//! State of a run between two frames, and what a frame gives.

use super::code_sums::CodeSums;
use super::extractor::ExtractorTotals;
use super::hashes::StageHashes;
use super::host::Host;
use super::imu::ImuReadings;
use super::row_check::RowCheck;
use super::setup::Setup;
use super::shared_exposure::StillExposures;
use super::totals::{Alone, FrameNotes, LinkTotals};
use super::warnings::Warnings;
use super::waterfall::PacketTime;
use crate::compute::{Extractor, Feature};
use crate::effects::chain::{Chain, RowSamples};
use crate::events::Events;
use crate::plane::Plane;
use crate::pose::Pose;
use crate::tracker::{TrackedFrame, Tracker};
use crate::units::{FrameIndex, RowIndex};
use std::sync::Arc;

/// What one camera made of one frame.
pub struct CameraFrame {
    /// Mean photons of each pixel over its exposure; frames of a still scene share them.
    pub photons: Arc<Plane<f32>>,
    /// Electrons of each pixel before conversion, of its longest exposure, where `Session::keep_electrons` asked for them.
    pub electrons: Option<Plane<f32>>,
    /// Codes as they leave the readout.
    pub codes: Plane<u16>,
    /// Features that the sensor sends: those of its extractor less those that the link had no time for. Where the link carries no
    /// features, those of the host's extractor.
    pub features: Vec<Feature>,
    /// The clock in which each of them leaves it, from the frame's first pixel; empty where the host extracts.
    pub features_clk: Vec<u64>,
    /// Threshold of the sensor's extractor; none where the host extracts.
    pub threshold: Option<u16>,
    /// Packets as they arrive at the host.
    pub packets: Vec<u8>,
    /// When each of them was on the lanes.
    pub packet_times: Vec<PacketTime>,
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
    /// The tracker's answer.
    pub tracked: TrackedFrame,
}

/// Sums over the run.
#[derive(Default)]
pub(super) struct Totals {
    pub events: Events,
    pub hashes: StageHashes,
    pub extractor: ExtractorTotals,
    pub link: LinkTotals,
    pub rays: u64,
    pub render_variance_ratio: f64,
    pub feature_count: u64,
    pub codes: CodeSums,
    /// Energy and link bytes up to the frame before, so that each frame has its own.
    pub energy_before_aj: u128,
    pub link_bytes_before: u64,
    pub stage_s: [f64; STAGES.len()],
}

/// A run in progress.
pub struct Session {
    pub(super) setup: Setup,
    pub(super) tracker: Tracker,
    pub(super) alone: Option<Alone>,
    pub(super) imu_readings: ImuReadings,
    /// Each camera's extractor, on the sensor or, where pictures alone are sent, on the host.
    pub(super) extractors: Vec<Extractor>,
    /// Photons to codes, at the gain in effect.
    pub(super) chain: Chain,
    pub(super) gain: f64,
    /// How much later than scheduled each row of the window is read in a frame that carries rows; empty where none waits for the link.
    pub(super) delays_s: Vec<f64>,
    pub(super) host: Host,
    /// Electrons that each camera's frame before left in its array, where an effect leaves some.
    pub(super) charge_before_e: Vec<Option<Plane<f32>>>,
    pub(super) still: StillExposures,
    pub(super) probe: Option<RowProbe>,
    pub(super) row_check: Option<RowCheck>,
    /// Whether frames carry electrons, and those of the frame in progress, one entry a camera.
    pub(super) electrons_kept: bool,
    pub(super) electrons: Vec<Option<Plane<f32>>>,
    pub(super) hashes_pictures: bool,
    pub(super) notes: Vec<FrameNotes>,
    pub(super) totals: Totals,
    pub(super) warnings: Warnings,
}

/// Rows of the first camera whose samples are kept when their frame is sensed.
pub(super) struct RowProbe {
    pub(super) frame: FrameIndex,
    pub(super) rows: Vec<RowIndex>,
    pub(super) samples: Vec<RowSamples>,
}

impl Session {
    /// What a user should know of the frames so far: the setup's warnings, then the run's, each once.
    pub fn warnings(&self) -> Vec<String> {
        let mut warnings = self.warnings.clone();
        self.totals.extractor.warn(&self.setup.sensor, &mut warnings);
        self.totals.link.warn(&mut warnings);
        warnings.texts().to_vec()
    }
}

/// Stages whose time is measured, in the data's order.
pub const STAGES: [&str; 6] = ["render", "sensor", "compute", "link", "host_link", "tracker"];
