//! Is run B better than run A: differences of every figure with their 95 % intervals, and a verdict where the interval excludes zero.
//!
//! Draws are keyed, so two runs of one scenario share their noise, and frames of equal time belong together. Frames are paired where the
//! two frame times agree; otherwise each run is resampled by itself.

mod config;
mod figures;
mod finished;
mod replicates;

use serde::{Deserialize, Serialize};

use crate::error::Error;
use crate::num::{f64_from_usize, u32_from};
use crate::pose::TimedPose;
pub use config::KeyDifference;
pub use figures::{FigureDifference, Verdict};
pub use finished::FinishedRun;
pub use replicates::PAIRS_MIN;

/// Version of `compare.json`; it counts up when a key changes its name or meaning.
pub const SCHEMA_VERSION: u32 = 1;
/// Most that two frame times may differ, as a share, for their frames to be paired.
const FRAME_TIME_TOLERANCE: f64 = 0.01;

/// Runs beside their base.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Comparison {
    /// Of this structure.
    pub schema_version: u32,
    /// Of the program.
    pub version: String,
    /// The run that the others are compared with.
    pub base: RunHead,
    /// Each other run against the base, in the order of the command.
    pub others: Vec<Against>,
}

/// What names a run.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct RunHead {
    /// As the user named it.
    pub folder: String,
    /// Name of the scenario.
    pub scenario: String,
    /// Of all draws.
    pub seed: u64,
    /// Hash of the effective configuration.
    pub config_hash: String,
    /// Frames of the rig.
    pub frames: u32,
}

/// One run against the base.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Against {
    /// The run.
    pub run: RunHead,
    /// Frames that belong together; 0 where the runs are compared unpaired.
    pub paired_frames: u32,
    /// Pairs of runs that the intervals are drawn from; 1: they are drawn from the frames of one pair.
    #[serde(default)]
    pub paired_runs: u32,
    /// How the frames were brought together, in words.
    pub pairing: String,
    /// Keys of the effective configuration with other values.
    pub config: Vec<KeyDifference>,
    /// Every figure that one of the runs has.
    pub figures: Vec<FigureDifference>,
}

/// Compares every run after the first with the first. Fails on fewer than two runs, or runs of different scenes or motions.
pub fn compare(runs: &[FinishedRun]) -> Result<Comparison, Error> {
    let (Some((base, others)), true) = (runs.split_first(), runs.len() > 1) else {
        return Err(Error::key("compare", "one run", "name two or more folders of 'sensel run'"));
    };
    Ok(comparison(base, others.iter().map(|other| against(base, other)).collect::<Result<_, _>>()?))
}

fn comparison(base: &FinishedRun, others: Vec<Against>) -> Comparison {
    Comparison {
        schema_version: SCHEMA_VERSION,
        version: env!("CARGO_PKG_VERSION").to_owned(),
        base: head(base),
        others,
    }
}

/// Compares two designs of which each has several runs, pair by pair in the order of the lists. Head, keys and pictures are those of the
/// first pair. Fails on lists of different lengths or of fewer than `PAIRS_MIN` runs, a run that is no replicate of its first, different
/// scenes or motions.
pub fn compare_replicates(a: &[FinishedRun], b: &[FinishedRun]) -> Result<Comparison, Error> {
    replicates::check(a, b)?;
    let pairs: Vec<Against> = a.iter().zip(b).map(|(a, b)| against(a, b)).collect::<Result<_, _>>()?;
    let shared = a.iter().zip(b).filter(|(a, b)| a.report.seed == b.report.seed).count();
    let pairing = format!(
        "{} pairs of runs, of which {shared} share their seed; intervals by how the difference varies between pairs",
        pairs.len()
    );
    let figures: Vec<Vec<FigureDifference>> = pairs.iter().map(|pair| pair.figures.clone()).collect();
    let all = Against {
        paired_frames: pairs.iter().map(|pair| pair.paired_frames).sum(),
        paired_runs: u32_from(pairs.len()),
        pairing,
        figures: figures::over_pairs(&figures),
        ..pairs[0].clone()
    };
    Ok(comparison(&a[0], vec![all]))
}

fn head(run: &FinishedRun) -> RunHead {
    RunHead {
        folder: run.folder.clone(),
        scenario: run.report.scenario.name.clone(),
        seed: run.report.seed,
        config_hash: run.report.config_hash.clone(),
        frames: u32_from(run.report.frames.len()),
    }
}

fn against(base: &FinishedRun, other: &FinishedRun) -> Result<Against, Error> {
    config::check_same_scene(base, other)?;
    let pairs = pairs(base, other);
    let same_seed = base.report.seed == other.report.seed;
    let pairing = match (pairs.len(), same_seed) {
        (0, _) => format!(
            "frames are not paired: {:.3} and {:.3} frames a second; each run is resampled by itself",
            base.report.timing.fps, other.report.timing.fps
        ),
        (count, true) => format!("{count} frames are paired by time and share their noise (seed {})", base.report.seed),
        (count, false) => format!(
            "{count} frames are paired by time; seeds {} and {} differ, so the noise does too",
            base.report.seed, other.report.seed
        ),
    };
    Ok(Against {
        run: head(other),
        paired_frames: u32_from(pairs.len()),
        paired_runs: 1,
        pairing,
        config: config::differences(&base.report.config, &other.report.config),
        figures: figures::differences(base, other, &pairs),
    })
}

/// Frames of equal time, by index; none where the frame times differ.
fn pairs(a: &FinishedRun, b: &FinishedRun) -> Vec<(usize, usize)> {
    let frame_s = |run: &FinishedRun| run.report.timing.frame_time_us * 1e-6;
    let (a_s, b_s) = (frame_s(a), frame_s(b));
    if !((a_s - b_s).abs() <= FRAME_TIME_TOLERANCE * a_s) {
        return Vec::new();
    }
    // Exposures of other lengths have other middles, but the same frame number.
    let drift_s = f64_from_usize(a.truth.len().min(b.truth.len())) * (a_s - b_s).abs();
    let near = |(a_pose, b_pose): (&TimedPose, &TimedPose)| (a_pose.t_s - b_pose.t_s).abs() < 0.5 * a_s;
    if drift_s >= 0.5 * a_s || !a.truth.iter().zip(&b.truth).all(near) {
        return Vec::new();
    }
    (0..a.truth.len().min(b.truth.len())).map(|frame| (frame, frame)).collect()
}

#[cfg(test)]
mod tests;
