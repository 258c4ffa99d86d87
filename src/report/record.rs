//! `report.json`: everything a run found out, as plain data. Units stand in the names.
//!
//! A figure that could not be measured is `null`, and `not_measurable` says why under the figure's path. Nothing else
//! is null.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};

use super::measurable::{Figure, NotMeasurable};
use crate::report::alternatives_record::Alternatives;
use crate::report::bootstrap::Statistic;
use crate::report::cameras_alone::CamerasAlone;
use crate::report::energy_record::EnergyRecord;
use crate::report::figures::TrajectoryFigures;
use crate::report::gates_record::Gates;
use crate::report::ladder_record::LadderRecord;
pub use crate::report::latency_record::ExtractorClocks;
use crate::report::latency_record::Waterfall;
pub use crate::report::link_record::LinkRecord;
use crate::report::ordered::Ordered;
pub use crate::report::plan_record::{FactRecord, OmittedEffect, PlanRecord, TileRecord};
use crate::report::pose_series::PoseSeries;
use crate::report::spread::{interval_of_rms, second_difference_squares, spectrum};
pub use crate::report::tracking_record::{Tracking, TrackingEvent};

/// Counted up when a key changes its name or meaning; new keys leave it.
pub const SCHEMA_VERSION: u32 = 2;

/// The report of one run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Report {
    /// Of this structure.
    pub schema_version: u32,
    /// Of the program.
    pub version: String,
    /// Of all draws.
    pub seed: u64,
    /// Hash of the effective configuration, hexadecimal.
    pub config_hash: String,
    /// What was simulated.
    pub scenario: Scenario,
    /// Effects kept and left out.
    pub plan: PlanRecord,
    /// Clocks and times of the sensor.
    pub timing: Timing,
    /// Bits that leave the sensor.
    pub bandwidth: Bandwidth,
    /// Joules of the sensor.
    pub energy: EnergyRecord,
    /// Raw pictures, features and both side by side.
    #[serde(default)]
    pub alternatives: Alternatives,
    /// Gates and area of one sensor's digital half.
    #[serde(default)]
    pub gates: Gates,
    /// What the extractor and the tracker found.
    pub features: FeatureFigures,
    /// Errors of the pose.
    pub tracking: Tracking,
    /// Errors of the same packets tracked without the IMU; none where the rig has none, or the tracker does not use it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cameras_alone: Option<CamerasAlone>,
    /// What the host's packet decoder saw.
    pub link: LinkRecord,
    /// Of the bytes of each stage, hexadecimal.
    pub hashes: Hashes,
    /// Time of the simulation itself by stage.
    pub cost: Ordered<StageCost>,
    /// One entry a frame of the rig.
    pub frames: Vec<FrameRecord>,
    /// Path of every null figure (`tracking.rpe_m`, `frames.error_m`) and the reason.
    pub not_measurable: BTreeMap<String, String>,
    /// What a user should know although the run went on, each once, in the order of arrival.
    #[serde(default)]
    pub warnings: Vec<String>,
    /// The effective configuration, an object a section. Its `run.threads` is 0 whatever was used: threads decide no byte.
    pub config: toml::Table,
    /// Where this report holds what this machine measured; all else is the same on every run of this configuration, seed and version.
    pub measured: Measured,
    /// What accuracy costs in time, where `sensel ladder` has measured this scenario.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ladder: Option<LadderRecord>,
}

/// What differs from machine to machine and from run to run.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Measured {
    /// Dotted paths of everything that was measured: leave these out to compare two reports byte by byte.
    pub keys: Vec<String>,
    /// Threads of the run.
    pub threads: u32,
}

impl Default for Measured {
    fn default() -> Self {
        let keys = ["cost", "tracking.ms_per_frame", "timing.waterfall.measured_host_us", "ladder", "measured"];
        Self { keys: keys.map(str::to_owned).to_vec(), threads: 1 }
    }
}

/// What was simulated, in the words of the configuration.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scenario {
    /// Name of the scenario.
    pub name: String,
    /// Scene file, generator or folders of pictures.
    pub scene: String,
    /// What a person should know of the scene: what of a glTF file is not read, what moving objects leave out, where pictures from
    /// elsewhere are black, coarse or cut off.
    pub scene_notes: Vec<String>,
    /// On a horizontal plane at the camera's start, at the lamps' mean.
    pub illuminance_lux: f64,
    /// Name of the light.
    pub illuminant: String,
    /// How far light was followed, and how lamps flicker.
    pub light: String,
    /// Trajectory file or kind of motion.
    pub motion: String,
    /// What was put right or bridged in the motion's file.
    pub motion_notes: Vec<String>,
    /// Factor on the translation of the motion file, so that it fits the scene.
    pub motion_scale: f64,
    /// Length of the true path.
    pub path_m: f64,
    /// Time from the first frame's middle to the last one's.
    pub duration_s: f64,
    /// Frames of the rig.
    pub frames: u32,
    /// Cameras of the rig.
    pub cameras: u32,
    /// Distance between the first two cameras; 0 with one camera.
    pub baseline_mm: f64,
    /// Sensor preset, with what was changed.
    pub sensor: String,
    /// Columns.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
    /// Depth of the ADC.
    pub bits: u32,
    /// `global` or `rolling`.
    pub shutter: String,
    /// Effective exposure, whole lines.
    pub exposure_us: f64,
    /// Lens preset, with what was changed, and f-number.
    pub optics: String,
    /// Of the ladder.
    pub rung: String,
    /// Rays per pixel, mean over the run.
    pub samples_per_pixel: f64,
    /// Variance of the render over photon variance, mean over pixels and frames.
    pub render_variance_ratio: Option<f64>,
}

/// Clocks and times of one sensor.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Timing {
    /// Between the starts of two rows.
    pub line_time_us: f64,
    /// Between the starts of two frames.
    pub frame_time_us: f64,
    /// Frames a second.
    pub fps: f64,
    /// From the middle of the exposure to the last bit of the frame's last packet on the lanes, the extractor included: the longest of the
    /// run, or of a frame with the expected number of features spread evenly where nothing has run.
    pub latency_us: f64,
    /// From the reading of the last row to the last feature byte, the extractor included, with the features of a mean frame spread evenly
    /// over the picture.
    pub feature_latency_us: Option<f64>,
    /// From the reading of the first row, when it reaches the extractor, to the extractor's first feature, the longest of the run; none
    /// without features.
    pub first_feature_us: Option<f64>,
    /// From the reading of the last row, when it reaches the extractor, to the extractor's last feature, the longest of the run; none
    /// without features.
    pub last_feature_us: Option<f64>,
    /// From the middle of the exposure to the pose, step by step.
    #[serde(default)]
    pub waterfall: Waterfall,
    /// Clocks of the extractor; none where the sensor extracts nothing.
    pub extractor: Option<ExtractorClocks>,
    /// Of `pix_clk`.
    pub clocks_per_frame: u64,
    /// What happens within one line.
    pub line: Vec<Phase>,
    /// What happens within one frame.
    pub frame: Vec<Phase>,
}

/// A span of a timing diagram.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Phase {
    /// What is busy: "row n", "row n-1", "sensor", "link", ... Phases of one lane share a line of the diagram.
    pub lane: String,
    /// What it does: "reset", "settle", "ramp", "shift out", "exposure", ...
    pub name: String,
    /// From the start of the line or frame.
    pub start_us: f64,
    /// From the start of the line or frame; not before `start_us`.
    pub end_us: f64,
}

/// Bits that leave the sensors, all cameras of the rig together.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Bandwidth {
    /// Pixels times depth.
    pub raw_bits_per_frame: f64,
    /// In the RAW container that holds the depth.
    pub container_bits_per_frame: f64,
    /// Payload of the feature packets, mean over frames.
    pub feature_bits_per_frame: f64,
    /// Everything that was sent, headers and checks with it, as a rate.
    pub link_bits_per_s: f64,
    /// Raw over feature bits.
    pub reduction: Option<f64>,
    /// Share of the link's time in use, mean over a frame.
    pub link_utilisation: f64,
    /// Share of a line's time in use while a line is sent.
    pub link_utilisation_burst: f64,
}

/// What the extractor and the tracker found, over frames.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FeatureFigures {
    /// Found per frame and camera, median.
    pub median_found: Option<f64>,
    /// Tracked per frame, median.
    pub median_tracked: Option<f64>,
    /// Fewest tracked in a frame.
    pub min_tracked: Option<u32>,
    /// Corners with a whole patch per frame and camera, mean.
    pub corners: f64,
    /// Corners within 16 pixels of an edge, which have no whole patch and are not among `corners`, mean.
    #[serde(default)]
    pub without_patch: f64,
    /// Of the corners, those that their cells did not keep, mean.
    pub unselected: f64,
    /// Lost between cell and engine, mean: the sum of `dropped` and `late`.
    pub lost: f64,
    /// Of the lost, those that a full queue dropped, mean.
    #[serde(default)]
    pub dropped: f64,
    /// Of the lost, those whose rows were overwritten before an engine had loaded them, mean.
    #[serde(default)]
    pub late: f64,
    /// Clocks per frame and camera in which rows waited for candidates, mean.
    pub stalled_clk: f64,
    /// Clocks per frame and camera in which the extractor could not take a pixel, mean.
    #[serde(default)]
    pub not_ready_clk: f64,
    /// Threshold of the run's last frame in DN of the extractor's words; none where the sensor extracts nothing.
    pub threshold: Option<u16>,
}

/// Hashes of the bytes of each stage, hexadecimal.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Hashes {
    /// Photons of all frames.
    pub photons: String,
    /// Codes of all frames.
    pub codes: String,
    /// Features of all frames.
    pub features: String,
    /// Event counts and energies.
    pub energy: String,
    /// The tracker's answers to all frames.
    pub poses: String,
}

/// What a stage of the simulation cost.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct StageCost {
    /// Wall time per frame of the rig.
    pub ms_per_frame: f64,
}

/// One frame of the rig.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct FrameRecord {
    /// Middle of the exposure.
    pub t_s: f64,
    /// Mean code of all cameras.
    pub mean_code_dn: f64,
    /// Longest exposure in effect, in us.
    pub exposure_us: f64,
    /// Gain of the ramp in effect.
    pub gain: f64,
    /// Features found, all cameras.
    pub found: u32,
    /// Landmarks of the pose.
    pub tracked: u32,
    /// Median innovation.
    pub innovation_px: Option<f64>,
    /// True position.
    pub truth_m: [f64; 3],
    /// Estimated position in the truth's frame.
    pub estimate_m: Option<[f64; 3]>,
    /// Distance between the two.
    pub error_m: Option<f64>,
    /// Angle between true and estimated orientation, after the mean rotation between the two worlds is removed.
    #[serde(default)]
    pub orientation_deg: Option<f64>,
    /// Bits on the links, headers and checks with them, all cameras.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub link_bits: Option<f64>,
    /// Energy of all sensors.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub energy_pj: Option<f64>,
    /// From the middle of the exposure to the last bit on the lanes, of the slowest camera.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub latency_us: Option<f64>,
    /// What became of it in the tracker: "waiting", "initialised", "tracked", "relocalised" or "lost".
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub status: String,
    /// Threshold of each camera's extractor, in DN of the pipeline; empty where the host extracts.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub thresholds: Vec<u16>,
}

impl Report {
    /// A figure for the report; where it cannot be measured, the reason is noted under its path.
    pub fn figure<T>(&mut self, path: &str, figure: Result<T, NotMeasurable>) -> Option<T> {
        figure.map_err(|reason| self.not_measurable.insert(path.to_owned(), reason.to_string())).ok()
    }

    /// Adds what accuracy costs in time. Rows say by themselves why they lack a figure.
    pub fn set_ladder(&mut self, ladder: LadderRecord) {
        let figures =
            ["rms_dn", "max_dn", "photon_noise_ratio", "feature_f1", "ate_m", "jitter_d2_m", "tracked_fraction"];
        for figure in figures.into_iter().chain(["energy_error", "rays_per_pixel", "note"]) {
            let reason =
                if figure == "note" { "nothing is missing from these rows" } else { "the row's note says why" };
            self.not_measurable.insert(format!("ladder.rows.{figure}"), reason.to_owned());
        }
        self.ladder = Some(ladder);
    }

    /// Fills in everything that the two trajectories tell: `tracking`'s errors and each frame's error. Frames must be
    /// set before; they find their error by time stamp. `unit_m` is what brought the estimate to metres.
    pub fn set_trajectory(&mut self, figures: Result<TrajectoryFigures, NotMeasurable>, unit_m: f64) {
        let part = |pick: &dyn Fn(&TrajectoryFigures) -> Figure| figures.as_ref().map_err(Clone::clone).and_then(pick);
        let se3 = |f: &TrajectoryFigures| f.se3.clone();
        let sim3 = |f: &TrajectoryFigures| f.sim3.clone();
        self.tracking.ate_m = self.figure("tracking.ate_m", part(&|f| se3(f).map(|a| a.ate_m)));
        self.tracking.jitter_d2_m = self.figure("tracking.jitter_d2_m", part(&|f| se3(f)?.jitter_d2_m));
        // A relative error does not depend on a rigid alignment, so these two need none.
        self.tracking.rpe_m = self.figure("tracking.rpe_m", part(&|f| f.unaligned.rpe_m.clone()));
        self.tracking.jitter_frame_m =
            self.figure("tracking.jitter_frame_m", part(&|f| Ok(f.unaligned.jitter_frame_m)));
        self.tracking.ate_sim3_m = self.figure("tracking.ate_sim3_m", part(&|f| sim3(f).map(|a| a.ate_m)));
        self.tracking.scale_sim3 =
            self.figure("tracking.scale_sim3", part(&|f| sim3(f).map(|a| a.alignment.scale * unit_m)));
        self.tracking.jitter_still_m = self.figure("tracking.jitter_still_m", part(&|f| f.still.jitter_d2_m.clone()));
        self.tracking.still_steps_under_1um =
            self.figure("tracking.still_steps_under_1um", part(&|f| Ok(f.still.steps_under_1um)));
        self.set_intervals(&figures);
        if let Ok(figures) = figures {
            self.tracking.jitter_spectrum = spectrum(&figures.errors, figures.rate_hz);
            self.tracking.associated_poses = crate::num::u32_from(figures.associated);
            self.set_frame_errors(&figures);
        }
        self.note_frames_without_error();
    }

    /// Fills in the single-picture sigma: root mean square of the frames' sigmas, in metres.
    pub fn set_single_picture_sigma(&mut self, sigmas_m: impl Iterator<Item = f64>) {
        let (sum_m2, count) = sigmas_m.fold((0.0, 0_u32), |(sum, count), sigma_m| (sum + sigma_m * sigma_m, count + 1));
        let sigma = match count {
            0 => Err(NotMeasurable::Absent("no frame's pose follows from landmarks".to_owned())),
            _ => Ok((sum_m2 / f64::from(count)).sqrt()),
        };
        self.tracking.single_picture_sigma_m = self.figure("tracking.single_picture_sigma_m", sigma);
    }

    /// Fills in the orientation errors: each frame's, and their root mean square.
    pub fn set_orientation(&mut self, series: &PoseSeries) {
        for (frame, square_deg2) in self.frames.iter_mut().zip(&series.orientation_deg2) {
            frame.orientation_deg = square_deg2.map(f64::sqrt);
        }
        let squares: Vec<f64> = series.orientation_deg2.iter().filter_map(|square| *square).collect();
        let found = Statistic::RootMean.of(&squares);
        let why = || NotMeasurable::Absent("no frame has a pose".to_owned());
        self.tracking.orientation_deg = self.figure("tracking.orientation_deg", found.ok_or_else(why));
        if self.frames.iter().any(|frame| frame.orientation_deg.is_none()) {
            let reason = "the tracker has no pose at this frame".to_owned();
            self.not_measurable.insert("frames.orientation_deg".to_owned(), reason);
        }
    }

    fn set_intervals(&mut self, figures: &Result<TrajectoryFigures, NotMeasurable>) {
        let seed = self.seed;
        let interval = |squares: &dyn Fn(&TrajectoryFigures) -> Vec<f64>| {
            let figures = figures.as_ref().map_err(Clone::clone)?;
            figures.se3.as_ref().map_err(Clone::clone)?;
            let second = usize::try_from(crate::num::i64_half_even(figures.rate_hz)).unwrap_or(0).max(1);
            interval_of_rms(&squares(figures), second, seed)
        };
        let ate = interval(&|f| f.errors.iter().map(|error| error.error_m * error.error_m).collect());
        let jitter = interval(&|f| second_difference_squares(&f.errors, 1.0 / f.rate_hz));
        self.tracking.ate_interval_m = self.figure("tracking.ate_interval_m", ate);
        self.tracking.jitter_d2_interval_m = self.figure("tracking.jitter_d2_interval_m", jitter);
    }

    fn set_frame_errors(&mut self, figures: &TrajectoryFigures) {
        for frame in &mut self.frames {
            let next = figures.errors.partition_point(|error| error.t_s < frame.t_s - 1e-6);
            if let Some(error) = figures.errors.get(next).filter(|error| error.t_s <= frame.t_s + 1e-6) {
                frame.estimate_m = Some(error.estimate_m.to_array());
                frame.error_m = Some(error.error_m);
            }
        }
    }

    fn note_frames_without_error(&mut self) {
        if self.frames.iter().any(|frame| frame.error_m.is_none()) {
            let reason = "the tracker has no pose at this frame, or the trajectories cannot be aligned";
            for path in ["frames.error_m", "frames.estimate_m"] {
                self.not_measurable.insert(path.to_owned(), reason.to_owned());
            }
        }
        if self.frames.iter().any(|frame| frame.innovation_px.is_none()) {
            let reason = "no landmark was predicted into this frame and found again".to_owned();
            self.not_measurable.insert("frames.innovation_px".to_owned(), reason);
        }
    }
}
