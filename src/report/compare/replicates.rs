//! Two designs of which each has several runs: what varies between runs enters the interval.
//!
//! Frames of one run cannot show how a lost track or an early wrong map varies from run to run. Pairs of runs can, by Student's interval of
//! the mean difference over the pairs.

use crate::error::Error;
use crate::num::{f64_from_usize, greater, lesser};
use crate::report::bootstrap::{mean, student};

use super::config::{check_same_scene, differences, is_among};
use super::finished::FinishedRun;

/// Fewest pairs that an interval is drawn from.
pub const PAIRS_MIN: usize = 3;
/// Keys in which replicates of a design may differ.
const REPLICATED: [&str; 4] = ["seed", "sensor.die", "run.render_seed", "motion"];
/// What lies beyond each end of a 95 % interval.
const TAIL: f64 = 0.025;
/// Differences of shares nearer than this are the same: they are ratios of frames.
const SAME_SHARE: f64 = 1e-9;

/// 95 % interval of the mean of independent differences; none of fewer than `PAIRS_MIN`. A share is bounded by 1, and where most pairs
/// differ by the same, rare events decide it: an event that n pairs did not show may still have the probability 1 - 0.025^(1/n).
pub(super) fn interval(values: &[f64], is_share: bool) -> Option<[f64; 2]> {
    if values.len() < PAIRS_MIN {
        return None;
    }
    let (count, mean) = (f64_from_usize(values.len()), mean(values));
    let squares = values.iter().fold(0.0, |sum, value| sum + (value - mean) * (value - mean));
    let half = student(count - 1.0) * (squares / (count - 1.0) / count).sqrt();
    let like = |value: f64| values.iter().filter(|other| (**other - value).abs() < SAME_SHARE).count();
    let is_rare = is_share && values.iter().any(|value| 2 * like(*value) > values.len());
    let unseen = if is_rare { 1.0 - libm::pow(TAIL, 1.0 / count) } else { 0.0 };
    Some([lesser(mean - half, mean - unseen), greater(mean + half, mean + unseen)])
}

/// Refuses lists that are not pairs of replicates.
pub(super) fn check(a: &[FinishedRun], b: &[FinishedRun]) -> Result<(), Error> {
    if a.len() != b.len() || a.len() < PAIRS_MIN {
        let given = format!("{} and {} folders", a.len(), b.len());
        let reason = "name 3 or more folders of the one design, --against, and as many of the other; the first pairs with the first";
        return Err(Error::key("--against", given, reason));
    }
    for runs in [a, b] {
        for (at, run) in runs.iter().enumerate().skip(1) {
            runs[..at].iter().try_for_each(|earlier| check_replicate(earlier, run))?;
        }
    }
    a.iter().zip(b).try_for_each(|(a, b)| check_same_scene(a, b))
}

/// Refuses a run of another design, and the same run once more: it would count as one more draw and is none.
fn check_replicate(earlier: &FinishedRun, run: &FinishedRun) -> Result<(), Error> {
    let refused = |reason: String| Err(Error::Content { file: run.folder.clone(), reason });
    let differing = differences(&earlier.report.config, &run.report.config);
    if differing.is_empty() && earlier.report.seed == run.report.seed {
        let folder = &earlier.folder;
        return refused(format!(
            "is the run of {folder} once more; replicates differ in seed, sensor.die, run.render_seed or motion"
        ));
    }
    match differing.iter().find(|key| !is_among(&key.key, &REPLICATED)) {
        None => Ok(()),
        Some(key) => refused(format!(
            "is no replicate of {}: {key}; replicates differ in seed, sensor.die, run.render_seed and motion alone",
            earlier.folder
        )),
    }
}
