//! What accuracy costs in time, as plain data: `ladder.json`, and a section of a run's report. Units stand in the names; the keys are
//! those of `sensel ladder --json`. What was not measured is `null`, and the row's `note` says why.
//!
//! - `photon_noise_ratio`: root mean square error of the picture in units of each pixel's photon noise, over pixels that the reference
//!   sees below saturation. Two parts add in squares. The render's is taken on mean photons, before any draw: with Q electrons a photon,
//!   setting S and the two halves A, B of the reference, each clipped at saturation, mean of Q (S - A)(S - B) / max(P, 1 / Q),
//!   which the reference's own noise does not bias. The effects' is taken on samples before quantisation, from the reference's
//!   photons, under the same draws with and without the effects that are left out. So noise that both have cancels.
//! - `rms_dn`, `max_dn`: of codes against those of the reference under the same draws, over all pixels.
//! - `feature_f1`: twice the matched features over all features of both, matched where each is the other's nearest within 1 px.

use serde::{Deserialize, Serialize};

use crate::report::ordered::Ordered;

/// Counted up when a key changes its name or meaning.
pub const LADDER_VERSION: u32 = 1;

/// One ladder.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LadderRecord {
    /// Of this structure.
    pub ladder_version: u32,
    /// Of the program.
    pub version: String,
    /// Name of the scenario.
    pub scenario: String,
    /// Hash of its configuration, with the ladder's own knobs as they were given.
    pub config_hash: String,
    /// Of all draws.
    pub seed: u64,
    /// Frames whose pictures were judged, those of the first camera.
    pub frames: Vec<u32>,
    /// Frames of each run whose poses were judged; 0: none.
    pub pose_frames: u32,
    /// Cameras of the rig; times are the rig's.
    pub cameras: u32,
    /// Threads that shared the work.
    pub threads: u32,
    /// What everything else is measured against.
    pub reference: ReferenceRecord,
    /// Every rung, every knob alone, and the combinations on the front.
    pub rows: Vec<LadderRow>,
}

/// What everything else is measured against.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReferenceRecord {
    /// Finest accuracy, in photon noise, that it can judge: three times its standard error, rounded up to what was asked for.
    pub finest: f64,
    /// Its own standard error in photon noise, from two independent halves.
    pub standard_error: f64,
    /// Rays per pixel.
    pub rays_per_pixel: f64,
    /// Pixels that were judged, of all frames.
    pub pixels: u64,
    /// Share of pixels that are saturated and were left out.
    pub saturated_share: f64,
}

/// One setting of the simulation.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LadderRow {
    /// Rung of the chain.
    pub rung: String,
    /// What this row changes: "rung", "samples_per_pixel", "render_tolerance", "effects", "reflections", "subframes", "window",
    /// "combination", "reference".
    pub knob: String,
    /// To what.
    pub value: String,
    /// Processor time of all threads per frame of the rig; 0 where this row was not run.
    pub ms_per_frame: f64,
    /// Wall time per frame of the rig.
    pub wall_ms_per_frame: f64,
    /// Processor time by stage.
    pub stages: Ordered<f64>,
    /// Processor time over the reference's.
    pub time_ratio: f64,
    /// Root mean square error of codes.
    pub rms_dn: Option<f64>,
    /// Greatest error of a code.
    pub max_dn: Option<f64>,
    /// Error of the picture in photon noise; none where it is finer than the reference can judge.
    pub photon_noise_ratio: Option<f64>,
    /// Features of the same draws.
    pub feature_f1: Option<f64>,
    /// Position error of a run.
    pub ate_m: Option<f64>,
    /// Second-difference jitter of a run.
    pub jitter_d2_m: Option<f64>,
    /// Share of frames with a pose.
    pub tracked_fraction: Option<f64>,
    /// Energy of sensor and extractor over the reference's, less 1.
    pub energy_error: Option<f64>,
    /// Rays per pixel.
    pub rays_per_pixel: Option<f64>,
    /// No other combination is both faster and at least as good.
    pub on_front: bool,
    /// The keys that make a run like this row.
    pub settings: Vec<String>,
    /// Why something was not measured, and what else a person should know.
    pub note: Option<String>,
}
