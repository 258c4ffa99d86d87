//! Errors of a trajectory, each equal to evo's figure of the same name, in metres, seconds and shares. A figure that
//! cannot be measured has a named reason instead.

use glam::DVec3;

pub use super::measurable::{Figure, NotMeasurable};
use crate::num::{f64_from_usize, i64_half_even};
use crate::pose::TimedPose;
use crate::report::align::{AlignmentScale, Similarity, mean, umeyama};
use crate::report::associate::{ASSOCIATION_S, PosePair, associate};

/// Errors after one way of alignment.
#[derive(Clone, Debug, PartialEq)]
pub struct AlignedFigures {
    /// How the estimate was brought to the truth.
    pub alignment: Similarity,
    /// Root mean square distance (evo: `ape.*.trans.rmse`).
    pub ate_m: f64,
    /// Relative error over one second, all pairs (evo: `rpe.*.sec_1.trans.rmse`).
    pub rpe_m: Figure,
    /// Relative error over one frame (evo: `rpe.*.frames_1.trans.rmse`).
    pub jitter_frame_m: f64,
    /// Second-difference sigma of the error, per axis for white noise (evo_check: `jitter.*.d2_sigma_m`).
    pub jitter_d2_m: Figure,
}

/// Errors of a rig that stands still: no rotation, mean position subtracted.
#[derive(Clone, Debug, PartialEq)]
pub struct StillFigures {
    /// Root mean square distance from the mean.
    pub spread_m: f64,
    /// Second-difference sigma, per axis for white noise (evo_check: `jitter.origin.d2_sigma_m`).
    pub jitter_d2_m: Figure,
    /// Share of steps of at most one micrometre: 1 is a frozen answer (evo_check: `still_steps_under_1um`).
    pub steps_under_1um: f64,
}

/// Distance of one estimated pose from the truth, after rigid alignment.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PoseError {
    /// Time stamp of the estimate in seconds.
    pub t_s: f64,
    /// True position in metres.
    pub truth_m: DVec3,
    /// Estimated position in the truth's frame, in metres.
    pub estimate_m: DVec3,
    /// Distance between the two in metres.
    pub error_m: f64,
}

/// All figures of one trajectory.
#[derive(Clone, Debug, PartialEq)]
pub struct TrajectoryFigures {
    /// Poses of truth and estimate that agree in time.
    pub associated: usize,
    /// Pairs a second: the inverse of the median step.
    pub rate_hz: f64,
    /// Share of the truth's time span that the pairs span.
    pub covered: f64,
    /// Length of the whole true path in metres.
    pub path_m: f64,
    /// After rigid alignment.
    pub se3: Result<AlignedFigures, NotMeasurable>,
    /// After alignment with scale: what a single camera can be held to.
    pub sim3: Result<AlignedFigures, NotMeasurable>,
    /// Without alignment. Equal to those after rigid alignment, which a relative error cannot see.
    pub unaligned: AlignedFigures,
    /// For a rig that stands still.
    pub still: StillFigures,
    /// Error of every pair; empty where rigid alignment is not determined.
    pub errors: Vec<PoseError>,
}

/// Computes every figure of an estimated trajectory against the truth. Fails on fewer than three poses that agree in time, or time stamps
/// of which most repeat.
pub fn trajectory_figures(truth: &[TimedPose], estimate: &[TimedPose]) -> Result<TrajectoryFigures, NotMeasurable> {
    let pairs = associate(truth, estimate, ASSOCIATION_S);
    if pairs.len() < 3 {
        return Err(NotMeasurable::TooFewPoses { associated: pairs.len(), needed: 3 });
    }
    let step_s = median(&steps(&pairs).collect::<Vec<_>>()).unwrap_or(0.0);
    if step_s <= 0.0 {
        return Err(NotMeasurable::Absent("most time stamps of the associated estimate repeat".to_owned()));
    }
    let rate_hz = 1.0 / step_s;
    let delta = usize::try_from(i64_half_even(rate_hz).max(1)).unwrap_or(usize::MAX);
    let aligned = |scale| {
        umeyama(&truths_m(&pairs), &estimates_m(&pairs), scale)
            .map(|alignment| aligned_figures(&pairs, alignment, delta, step_s))
    };
    let se3 = aligned(AlignmentScale::Kept);
    let errors = se3.as_ref().map(|figures| pose_errors(&pairs, &figures.alignment)).unwrap_or_default();
    let span_s = |first: f64, last: f64| last - first;
    let truth_span_s = span_s(truth[0].t_s, truth[truth.len() - 1].t_s);
    let pairs_span_s = span_s(pairs[0].estimate.t_s, pairs[pairs.len() - 1].estimate.t_s);
    Ok(TrajectoryFigures {
        associated: pairs.len(),
        rate_hz,
        covered: if truth_span_s > 0.0 { pairs_span_s / truth_span_s } else { 0.0 },
        path_m: path_m(truth),
        sim3: aligned(AlignmentScale::Estimated),
        unaligned: aligned_figures(&pairs, Similarity::IDENTITY, delta, step_s),
        still: still_figures(&pairs, step_s),
        se3,
        errors,
    })
}

/// Root mean square distance of predicted positions from the truth in the frame that `alignment` brought the estimate
/// to.
pub fn prediction_error_m(truth: &[TimedPose], predicted: &[TimedPose], alignment: &Similarity) -> Figure {
    let pairs = associate(truth, predicted, ASSOCIATION_S);
    if pairs.is_empty() {
        return Err(NotMeasurable::Absent("the tracker predicted no pose".to_owned()));
    }
    Ok(rms(pose_errors(&pairs, alignment).iter().map(|error| error.error_m)))
}

/// Brings the path of one camera, which has no metre of its own, to metres by the alignment with scale. Gives the metres in its unit; 1
/// where the map has metres, or where nothing can be aligned.
pub fn bring_to_metres(truth: &[TimedPose], estimate: &mut [TimedPose], cameras: usize) -> f64 {
    let scale = || trajectory_figures(truth, estimate).ok()?.sim3.ok().map(|aligned| aligned.alignment.scale);
    let unit_m = if cameras == 1 { scale().unwrap_or(1.0) } else { 1.0 };
    for pose in estimate {
        pose.world_from_body.translation_m *= unit_m;
    }
    unit_m
}

/// Median; the mean of the middle two of an even number. None of an empty list.
pub fn median(values: &[f64]) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let upper = *sorted.get(sorted.len() / 2)?;
    Some(if sorted.len() % 2 == 1 { upper } else { 0.5 * (sorted[sorted.len() / 2 - 1] + upper) })
}

fn truths_m(pairs: &[PosePair]) -> Vec<DVec3> {
    pairs.iter().map(|pair| pair.truth.world_from_body.translation_m).collect()
}

fn estimates_m(pairs: &[PosePair]) -> Vec<DVec3> {
    pairs.iter().map(|pair| pair.estimate.world_from_body.translation_m).collect()
}

fn steps(pairs: &[PosePair]) -> impl Iterator<Item = f64> + '_ {
    pairs.windows(2).map(|two| two[1].estimate.t_s - two[0].estimate.t_s)
}

fn path_m(poses: &[TimedPose]) -> f64 {
    let step_m =
        |two: &[TimedPose]| (two[1].world_from_body.translation_m - two[0].world_from_body.translation_m).length();
    poses.windows(2).map(step_m).fold(0.0, |sum, step| sum + step)
}

fn aligned_figures(pairs: &[PosePair], alignment: Similarity, delta: usize, step_s: f64) -> AlignedFigures {
    let errors = pose_errors(pairs, &alignment);
    let error_m: Vec<_> = errors.iter().map(|error| error.estimate_m - error.truth_m).collect();
    AlignedFigures {
        alignment,
        ate_m: rms(errors.iter().map(|error| error.error_m)),
        rpe_m: relative_m(pairs, alignment.scale, delta),
        jitter_frame_m: relative_m(pairs, alignment.scale, 1).expect("three pairs have steps of one frame"),
        jitter_d2_m: second_difference_m(pairs, &error_m, step_s),
    }
}

fn pose_errors(pairs: &[PosePair], alignment: &Similarity) -> Vec<PoseError> {
    let of_pair = |pair: &PosePair| {
        let truth_m = pair.truth.world_from_body.translation_m;
        let estimate_m = alignment.point(pair.estimate.world_from_body.translation_m);
        PoseError { t_s: pair.estimate.t_s, truth_m, estimate_m, error_m: (estimate_m - truth_m).length() }
    };
    pairs.iter().map(of_pair).collect()
}

/// RMS over i of `|trans((Q_i^-1 Q_j)^-1 (P_i^-1 P_j))|`, j = i + delta. The outer rotation keeps lengths, so the
/// translation is the difference of the two motions, each seen from its own body at i.
fn relative_m(pairs: &[PosePair], scale: f64, delta: usize) -> Figure {
    let last = pairs.len().checked_sub(delta).filter(|&last| last > 0);
    let last = last.ok_or(NotMeasurable::TooShort { poses: pairs.len(), delta })?;
    let motion_m = |from: &TimedPose, to: &TimedPose, scale: f64| {
        let step_m = (to.world_from_body.translation_m - from.world_from_body.translation_m) * scale;
        from.world_from_body.rotation.conjugate() * step_m
    };
    let error_m = |(from, to): (&PosePair, &PosePair)| {
        (motion_m(&from.estimate, &to.estimate, scale) - motion_m(&from.truth, &to.truth, 1.0)).length()
    };
    Ok(rms(pairs[..last].iter().zip(&pairs[delta..]).map(error_m)))
}

/// `sqrt(mean |e[i+1] - 2 e[i] + e[i-1]|^2 / 18)` over triples without a dropped frame: both steps within half of the
/// median.
fn second_difference_m(pairs: &[PosePair], error_m: &[DVec3], step_s: f64) -> Figure {
    let even: Vec<_> = steps(pairs).map(|step| (step - step_s).abs() < 0.5 * step_s).collect();
    let mut squares = Vec::new();
    for (e, even) in error_m.windows(3).zip(even.windows(2)) {
        if even[0] && even[1] {
            squares.push(((e[2] - e[1]) - (e[1] - e[0])).length());
        }
    }
    if squares.is_empty() {
        return Err(NotMeasurable::Uneven);
    }
    // Three axes times 1 + 4 + 1 from the differences make 18 times the variance of one axis.
    Ok(rms(squares.into_iter()) / 18.0_f64.sqrt())
}

fn still_figures(pairs: &[PosePair], step_s: f64) -> StillFigures {
    let (truth_m, estimate_m) = (truths_m(pairs), estimates_m(pairs));
    let shift_m = mean(&truth_m) - mean(&estimate_m);
    let error_m: Vec<_> =
        truth_m.iter().zip(&estimate_m).map(|(&truth, &estimate)| estimate + shift_m - truth).collect();
    let still = estimate_m.windows(2).filter(|two| (two[1] - two[0]).length() <= 1e-6).count();
    StillFigures {
        spread_m: rms(error_m.iter().map(|error| error.length())),
        jitter_d2_m: second_difference_m(pairs, &error_m, step_s),
        steps_under_1um: f64_from_usize(still) / f64_from_usize(pairs.len() - 1),
    }
}

/// Root mean square. The sequence must not be empty.
fn rms(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, count) = values.fold((0.0, 0_usize), |(sum, count), value| (sum + value * value, count + 1));
    assert!(count > 0, "a mean needs a value");
    (sum / f64_from_usize(count)).sqrt()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::pose::Pose;
    use glam::DQuat;

    fn poses(count: usize, position_m: impl Fn(f64) -> DVec3) -> Vec<TimedPose> {
        let pose = |i: usize| {
            let t_s = f64_from_usize(i) / 32.0;
            TimedPose { t_s, world_from_body: Pose::new(DQuat::IDENTITY, position_m(t_s)) }
        };
        (0..count).map(pose).collect()
    }

    fn curve(t_s: f64) -> DVec3 {
        DVec3::new(libm::cos(t_s), libm::sin(2.0 * t_s), 0.2 * t_s)
    }

    #[test]
    fn a_perfect_estimate_has_no_error() {
        let truth = poses(64, curve);
        let figures = trajectory_figures(&truth, &truth).unwrap();
        let se3 = figures.se3.unwrap();
        // Two dozen roundings of numbers of size one.
        assert!(se3.ate_m < 1e-14 && se3.jitter_frame_m < 1e-14 && se3.rpe_m.unwrap() < 1e-14);
        assert_eq!((figures.associated, figures.rate_hz, figures.covered), (64, 32.0, 1.0));
    }

    #[test]
    fn a_still_rig_has_still_figures_and_names_why_it_has_no_others() {
        let truth = poses(50, |_| DVec3::new(1.0, 2.0, 3.0));
        let shaken = poses(50, |t_s| DVec3::new(0.001 * libm::sin(900.0 * t_s), 0.0, 0.0));
        let figures = trajectory_figures(&truth, &shaken).unwrap();
        assert_eq!(figures.se3.unwrap_err(), NotMeasurable::Degenerate);
        assert!(figures.still.jitter_d2_m.unwrap() > 1e-4);
        assert!(figures.still.steps_under_1um < 0.1);
        let frozen = trajectory_figures(&truth, &poses(50, |_| DVec3::ZERO)).unwrap();
        assert_eq!(frozen.still.steps_under_1um, 1.0);
    }

    #[test]
    fn a_run_shorter_than_a_second_has_no_relative_error_over_a_second() {
        let truth = poses(32, curve);
        let figures = trajectory_figures(&truth, &truth).unwrap();
        assert_eq!(figures.se3.unwrap().rpe_m, Err(NotMeasurable::TooShort { poses: 32, delta: 32 }));
        assert!(trajectory_figures(&truth[..2], &truth[..2]).is_err());
    }

    #[test]
    fn a_prediction_one_centimetre_off_is_one_centimetre_off() {
        let truth = poses(40, curve);
        let predicted = poses(40, |t_s| curve(t_s) + DVec3::new(0.0, 0.006, 0.008));
        let error_m = prediction_error_m(&truth, &predicted, &Similarity::IDENTITY).unwrap();
        assert!((error_m - 0.01).abs() < 1e-15, "{error_m}");
        assert!(prediction_error_m(&truth, &[], &Similarity::IDENTITY).is_err());
    }

    #[test]
    fn the_median_of_an_even_number_is_the_mean_of_the_middle_two() {
        assert_eq!(median(&[4.0, 1.0, 3.0, 2.0]), Some(2.5));
        assert_eq!(median(&[4.0, 1.0, 3.0]), Some(3.0));
        assert_eq!(median(&[]), None);
    }
}
