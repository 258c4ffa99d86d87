//! Errors of the pose frame by frame, as squares, so that a figure is the root of their mean.

use glam::{DQuat, DVec3};

use crate::num::{f64_from_usize, i64_half_even};
use crate::pose::{Pose, TimedPose};
use crate::report::align::{AlignmentScale, Similarity, umeyama};
use crate::report::figures::bring_to_metres;

/// Time stamps of files have nanoseconds.
const SAME_TIME_S: f64 = 1e-6;

/// One value a frame of the rig; none where the tracker has no pose there.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct PoseSeries {
    /// Whether the frame has a pose.
    pub is_tracked: Vec<bool>,
    /// Position error in the truth's axes after alignment.
    pub error_m: Vec<Option<DVec3>>,
    /// Squared orientation error about the mean offset, in square degrees.
    pub orientation_deg2: Vec<Option<f64>>,
    /// Squared relative error over one frame, at its later frame.
    pub step_m2: Vec<Option<f64>>,
    /// Squared relative error over one second, at its later frame.
    pub second_m2: Vec<Option<f64>>,
    /// Squared second difference over 18, at its middle frame.
    pub d2_m2: Vec<Option<f64>>,
}

impl PoseSeries {
    /// Squared position error.
    pub fn error_m2(&self) -> Vec<Option<f64>> {
        self.error_m.iter().map(|error| error.map(DVec3::length_squared)).collect()
    }
}

/// Errors of an estimate. The path of one camera, which has no metre, is brought to metres first. A rig whose positions determine no
/// rotation (it stands still) is aligned by its mean position.
pub fn pose_series(truth: &[TimedPose], estimate: &[TimedPose], cameras: u32, fps: f64) -> PoseSeries {
    let mut estimate = estimate.to_vec();
    bring_to_metres(truth, &mut estimate, usize::try_from(cameras).unwrap_or(usize::MAX));
    let of_frame = |pose: &TimedPose| {
        let at = estimate.partition_point(|found| found.t_s < pose.t_s - SAME_TIME_S);
        estimate.get(at).filter(|found| found.t_s <= pose.t_s + SAME_TIME_S).map(|found| found.world_from_body)
    };
    let frames: Vec<(Pose, Option<Pose>)> = truth.iter().map(|pose| (pose.world_from_body, of_frame(pose))).collect();
    let (true_m, found_m): (Vec<DVec3>, Vec<DVec3>) =
        frames.iter().filter_map(|(true_pose, found)| Some((true_pose.translation_m, (*found)?.translation_m))).unzip();
    let alignment = umeyama(&true_m, &found_m, AlignmentScale::Kept).unwrap_or_else(|_| shift(&true_m, &found_m));
    let second = usize::try_from(i64_half_even(fps)).unwrap_or(1).max(1);
    let error_m: Vec<Option<DVec3>> = frames
        .iter()
        .map(|(true_pose, found)| found.map(|found| alignment.point(found.translation_m) - true_pose.translation_m))
        .collect();
    PoseSeries {
        is_tracked: frames.iter().map(|(_, found)| found.is_some()).collect(),
        orientation_deg2: orientation_deg2(&frames),
        step_m2: relative_m2(&frames, 1),
        second_m2: relative_m2(&frames, second),
        d2_m2: second_differences_m2(&error_m),
        error_m,
    }
}

fn shift(true_m: &[DVec3], found_m: &[DVec3]) -> Similarity {
    let mean = |points: &[DVec3]| match points.len() {
        0 => DVec3::ZERO,
        count => points.iter().fold(DVec3::ZERO, |sum, point| sum + *point) / f64_from_usize(count),
    };
    Similarity { translation_m: mean(true_m) - mean(found_m), ..Similarity::IDENTITY }
}

/// Angles between true and found orientation, after the mean rotation between the two worlds is removed.
fn orientation_deg2(frames: &[(Pose, Option<Pose>)]) -> Vec<Option<f64>> {
    // true = offset * found * error
    let offset = |true_pose: &Pose, found: &Pose| true_pose.rotation * found.rotation.conjugate();
    let mut offsets = frames.iter().filter_map(|(true_pose, found)| Some(offset(true_pose, found.as_ref()?)));
    let Some(first) = offsets.next() else { return vec![None; frames.len()] };
    // Quaternions of one sign; their sum points along the mean of rotations that are close to each other.
    let sum = offsets.fold(first, |sum, next| if first.dot(next) < 0.0 { sum + -next } else { sum + next });
    let mean = sum.normalize();
    let of_frame = |(true_pose, found): &(Pose, Option<Pose>)| {
        let error: DQuat = true_pose.rotation.conjugate() * mean * found.as_ref()?.rotation;
        let sine = DVec3::new(error.x, error.y, error.z).length();
        let angle_deg = (2.0 * libm::atan2(sine, error.w.abs())).to_degrees();
        Some(angle_deg * angle_deg)
    };
    frames.iter().map(of_frame).collect()
}

/// Squares of `|(P_i^-1 P_j) - (Q_i^-1 Q_j)|` at j = i + delta, as in `figures`.
fn relative_m2(frames: &[(Pose, Option<Pose>)], delta: usize) -> Vec<Option<f64>> {
    let motion_m = |from: &Pose, to: &Pose| from.rotation.conjugate() * (to.translation_m - from.translation_m);
    let at = |j: usize| {
        let ((true_from, found_from), (true_to, found_to)) = (&frames[j.checked_sub(delta)?], &frames[j]);
        let error_m = motion_m(found_from.as_ref()?, found_to.as_ref()?) - motion_m(true_from, true_to);
        Some(error_m.length_squared())
    };
    (0..frames.len()).map(at).collect()
}

fn second_differences_m2(error_m: &[Option<DVec3>]) -> Vec<Option<f64>> {
    let at = |middle: usize| {
        let [before, here, after] =
            [middle.checked_sub(1)?, middle, middle + 1].map(|k| error_m.get(k).copied().flatten());
        // Three axes times 1 + 4 + 1 from the differences make 18 times the variance of one axis.
        Some(((after? - here?) - (here? - before?)).length_squared() / 18.0)
    };
    (0..error_m.len()).map(at).collect()
}
