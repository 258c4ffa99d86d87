//! Pairs two trajectories by time, as evo's nearest-time association does. Time stamps must rise.

use crate::pose::TimedPose;

/// Two poses may be this far apart in time and still be a pair, in seconds.
pub const ASSOCIATION_S: f64 = 0.01;

/// A true pose and its estimate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PosePair {
    /// From the simulator.
    pub truth: TimedPose,
    /// From the tracker.
    pub estimate: TimedPose,
}

/// For each pose of the shorter trajectory the nearest of the longer one within `window_s`; the estimate counts as the
/// shorter one where both are equally long. A pose of the longer one may serve twice, as in evo.
pub fn associate(truth: &[TimedPose], estimate: &[TimedPose], window_s: f64) -> Vec<PosePair> {
    if estimate.len() > truth.len() {
        let pair = |pose: &TimedPose| nearest(estimate, pose.t_s, window_s).map(|other| (*pose, other));
        truth.iter().filter_map(pair).map(|(truth, estimate)| PosePair { truth, estimate }).collect()
    } else {
        let pair = |pose: &TimedPose| nearest(truth, pose.t_s, window_s).map(|other| (other, *pose));
        estimate.iter().filter_map(pair).map(|(truth, estimate)| PosePair { truth, estimate }).collect()
    }
}

/// The pose nearest in time within the window; of two equally near ones the earlier.
fn nearest(poses: &[TimedPose], t_s: f64, window_s: f64) -> Option<TimedPose> {
    let (first, last) = (poses.first()?, poses.last()?);
    if t_s < first.t_s - window_s || t_s > last.t_s + window_s {
        return None;
    }
    // Beyond the last stamp, the last pose is the upper neighbour and its difference is negative, so evo takes it.
    let upper = poses.partition_point(|pose| pose.t_s <= t_s).min(poses.len() - 1);
    let above_s = poses[upper].t_s - t_s;
    let below_s = if upper > 0 { t_s - poses[upper - 1].t_s } else { f64::INFINITY };
    if above_s <= window_s && above_s < below_s {
        Some(poses[upper])
    } else if below_s <= window_s && below_s <= above_s {
        Some(poses[upper - 1])
    } else {
        None
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Pose;

    fn at(stamps_s: &[f64]) -> Vec<TimedPose> {
        stamps_s.iter().map(|&t_s| TimedPose { t_s, world_from_body: Pose::IDENTITY }).collect()
    }

    fn check(truth_s: &[f64], estimate_s: &[f64], expected_s: &[(f64, f64)]) {
        let pairs = associate(&at(truth_s), &at(estimate_s), ASSOCIATION_S);
        let stamps_s: Vec<_> = pairs.iter().map(|pair| (pair.truth.t_s, pair.estimate.t_s)).collect();
        assert_eq!(stamps_s, expected_s);
    }

    #[test]
    fn every_pose_finds_the_nearest_within_the_window() {
        check(&[0.0, 0.1, 0.2], &[0.004, 0.12], &[(0.0, 0.004)]);
        check(&[0.05], &[0.045, 0.052, 0.2], &[(0.05, 0.052)]);
        check(&[0.0, 0.1], &[0.105, 0.109], &[(0.1, 0.105), (0.1, 0.109)]);
    }

    #[test]
    fn equally_near_poses_resolve_to_the_earlier_one() {
        // 1/128 and its neighbours are exact in binary, so the differences are equal to the bit.
        check(&[0.0, 0.015_625], &[0.007_812_5], &[(0.0, 0.007_812_5)]);
    }

    #[test]
    fn nothing_pairs_with_an_empty_or_distant_trajectory() {
        check(&[], &[0.0], &[]);
        check(&[0.0], &[], &[]);
        check(&[0.0, 0.1], &[5.0, 5.1], &[]);
    }
}
