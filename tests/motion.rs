//! The motion of the rig through its front door: the spline against its own derivatives and against real motion capture.

#![allow(clippy::unwrap_used)] // Helpers of tests fail by panicking, as tests do.

use glam::DVec3;
use sensel::pose::{Pose, TimedPose, parse_tum};
use sensel::scene::motion::{
    self, GAP_S_MAX, KNOT_S, Motion, MotionError, PlacedSpline, Spline, Y_UP_FROM_Z_UP, without_gaps,
};
use sensel::so3;
use sensel::units::Span;

const ROOM1: &str = include_str!("../scenes/bathroom/tum_vi_room1.txt");

fn room1() -> Vec<TimedPose> {
    motion::from_first_sample(&parse_tum(ROOM1).unwrap())
}

fn room1_spline() -> Spline {
    Spline::fit(&room1(), KNOT_S).unwrap()
}

fn room1_placed(start_s: f64) -> Result<PlacedSpline, MotionError> {
    PlacedSpline::new(room1_spline(), start_s, 1.0, DVec3::ZERO, Y_UP_FROM_Z_UP)
}

/// A body that swings and turns through more than one full turn.
fn swing(t_s: f64) -> Pose {
    let position_m = DVec3::new(libm::sin(2.0 * t_s), 0.5 * t_s, libm::cos(3.0 * t_s));
    let turn = so3::exp(DVec3::Z * (2.5 * t_s)) * so3::exp(DVec3::X * (0.6 * libm::sin(4.0 * t_s)));
    Pose::new(turn, position_m)
}

fn sampled(pose: impl Fn(f64) -> Pose, seconds: u32, rate: u32) -> Vec<TimedPose> {
    let times = (0..=seconds * rate).map(|k| f64::from(k) / f64::from(rate));
    times.map(|t_s| TimedPose { t_s, world_from_body: pose(t_s) }).collect()
}

fn sorted(mut values: Vec<f64>) -> Vec<f64> {
    values.sort_by(f64::total_cmp);
    values
}

#[test]
fn the_spline_leaves_of_real_motion_capture_only_its_noise() {
    let (samples, spline) = (room1(), room1_spline());
    let (mut position_m, mut turn_deg) = (Vec::new(), Vec::new());
    for sample in &samples {
        let pose = spline.world_from_body(sample.t_s).unwrap();
        position_m.push(sample.world_from_body.translation_m - pose.translation_m);
        turn_deg.push(so3::log(pose.rotation.conjugate() * sample.world_from_body.rotation) * 1.0_f64.to_degrees());
    }
    let lengths = |residuals: &[DVec3]| sorted(residuals.iter().map(|residual| residual.length()).collect());
    let (lengths_m, angles_deg) = (lengths(&position_m), lengths(&turn_deg));
    let (middle, last) = (samples.len() / 2, samples.len() - 1);
    println!("median {:.4} mm {:.4} deg", lengths_m[middle] * 1e3, angles_deg[middle]);
    println!("worst {:.3} mm {:.3} deg", lengths_m[last] * 1e3, angles_deg[last]);
    assert!(samples.len() > 1_900);
    // A millimetre is asked for. Orientations of a marker body of some 10 cm jitter by 0.1 mm / 10 cm = 0.06 degrees an axis.
    assert!(lengths_m[middle] < 2e-4 && angles_deg[middle] < 0.07);
    assert!(lengths_m[last] < 2e-3 && angles_deg[last] < 0.7);
    // And it is noise: neighbours 8 ms apart are not alike (slow motion that was missed would be: 0.9 and more). A fit
    // with one unknown for six samples makes white noise slightly opposed, by about the unknowns' share of 1/6.
    for residuals in [position_m, turn_deg] {
        let products: f64 = residuals.windows(2).map(|pair| pair[0].dot(pair[1])).sum();
        let squares: f64 = residuals.iter().map(|residual| residual.length_squared()).sum();
        // Standard error 1/sqrt(3 * 1921) = 0.013; jitter of real cameras is not quite white.
        assert!((products / squares + 1.0 / 6.0).abs() < 0.1, "neighbours correlate by {}", products / squares);
    }
}

#[test]
fn a_smooth_known_motion_is_followed_with_its_derivatives() {
    let spline = Spline::fit(&sampled(swing, 3, 200), KNOT_S).unwrap();
    let mut tried = 0;
    // The ends are left out: there the fit has samples on one side only.
    for k in 20..280_u32 {
        let t_s = 0.01 * f64::from(k) + 0.0037;
        let state = spline.state(t_s).unwrap();
        let truth = swing(t_s);
        // A cubic spline misses x by about h^4 x''''/384 = 0.05^4 * 81 / 384 = 1.3e-6 m, least squares within a few of it;
        // its slope by h^3 x''''/24 = 4e-4 m/s, its bend by h^2 x''''/12 = 1.7e-2 m/s^2, doubled for least squares.
        assert!((state.world_from_body.translation_m - truth.translation_m).length() < 5e-6, "{t_s}");
        let velocity = DVec3::new(2.0 * libm::cos(2.0 * t_s), 0.5, -3.0 * libm::sin(3.0 * t_s));
        assert!((state.velocity_m_per_s - velocity).length() < 4e-4, "{t_s}");
        let acceleration = DVec3::new(-4.0 * libm::sin(2.0 * t_s), 0.0, -9.0 * libm::cos(3.0 * t_s));
        assert!((state.acceleration_m_per_s2 - acceleration).length() < 3.4e-2, "{t_s}");
        // The swing's fourth derivative is 0.6 * 256 = 154 rad/s^4, and turns in a frame of 2.5 rad/s: 4e-6 rad, a few of it.
        assert!(state.world_from_body.inverse().then(&truth).angle_rad() < 2e-5, "{t_s}");
        tried += 1;
    }
    assert_eq!(tried, 260);
}

#[test]
fn derivatives_agree_with_differences() {
    let spline = room1_spline();
    let step_s = 1e-5;
    let mut tried = 0;
    for k in 0..400_u32 {
        let t_s = 1.0 + 0.0317 * f64::from(k);
        let state = spline.state(t_s).unwrap();
        let (before, after) = (spline.state(t_s - step_s).unwrap(), spline.state(t_s + step_s).unwrap());
        let moved_m = after.world_from_body.translation_m - before.world_from_body.translation_m;
        // h^2 jerk / 6 with jerk below 2,000 m/s^3: 4e-8; roundings 4e-16 / 2e-5 = 2e-11.
        assert!((moved_m / (2.0 * step_s) - state.velocity_m_per_s).length() < 1e-7, "{t_s}: velocity");
        // The acceleration is linear between knots; a knot within the step adds the jerk's step times h / 4.
        let sped = (after.velocity_m_per_s - before.velocity_m_per_s) / (2.0 * step_s);
        assert!((sped - state.acceleration_m_per_s2).length() < 5e-3, "{t_s}: acceleration");
        let turned = so3::log(before.world_from_body.rotation.conjugate() * after.world_from_body.rotation);
        // The same with angles: h^2 / 6 of 5,000 rad/s^3.
        assert!(
            (turned / (2.0 * step_s) - state.angular_velocity_rad_per_s).length() < 1e-6,
            "{t_s}: angular velocity"
        );
        tried += 1;
    }
    assert_eq!(tried, 400);
}

#[test]
fn velocities_integrate_back_to_the_pose() {
    let spline = room1_spline();
    let (from_s, step_s, steps) = (2.0, 2e-4, 20_000_u32);
    let start = spline.world_from_body(from_s).unwrap();
    let (mut position_m, mut rotation) = (start.translation_m, start.rotation);
    for k in 0..steps {
        let state = spline.state(from_s + step_s * (f64::from(k) + 0.5)).unwrap();
        position_m += state.velocity_m_per_s * step_s;
        rotation *= so3::exp(state.angular_velocity_rad_per_s * step_s);
    }
    let end = spline.world_from_body(from_s + 4.0).unwrap();
    // The midpoint rule errs by at most T h^2 f'' / 24 = 4 * 4e-8 / 24 * 300 m/s^3 (rad/s^3: ten times that) = 2e-6.
    assert!((end.translation_m - position_m).length() < 2e-6, "{} {position_m}", end.translation_m);
    assert!(so3::log(end.rotation.conjugate() * rotation).length() < 2e-5);
    // And it did go somewhere.
    assert!((end.translation_m - start.translation_m).length() > 0.02);
}

#[test]
fn pose_velocity_and_acceleration_are_continuous_over_knots() {
    let spline = room1_spline();
    let start_s = spline.span().start_s;
    let mut tried = 0;
    for knot in 1..300_u32 {
        let knot_s = start_s + f64::from(knot) * spline.knot_s();
        let before = spline.state(knot_s - 1e-9).unwrap();
        let after = spline.state(knot_s + 1e-9).unwrap();
        // 2 ns of a speed below 5 m/s, of an acceleration below 50 m/s^2, of a jerk below 5,000 m/s^3, and their turning twins.
        let moved_m = after.world_from_body.translation_m - before.world_from_body.translation_m;
        assert!(moved_m.length() < 1e-8, "knot {knot}");
        assert!((after.velocity_m_per_s - before.velocity_m_per_s).length() < 1e-7, "knot {knot}");
        assert!((after.acceleration_m_per_s2 - before.acceleration_m_per_s2).length() < 1e-5, "knot {knot}");
        let turned = so3::log(before.world_from_body.rotation.conjugate() * after.world_from_body.rotation);
        assert!(turned.length() < 1e-8, "knot {knot}");
        let spun = after.angular_velocity_rad_per_s - before.angular_velocity_rad_per_s;
        assert!(spun.length() < 1e-6, "knot {knot}");
        tried += 1;
    }
    assert_eq!(tried, 299);
}

#[test]
fn a_run_that_leaves_the_trajectory_is_told_its_range() {
    let motion = Motion::Spline(room1_placed(10.0).unwrap());
    assert!(motion.covers(Span { start_s: 0.0, end_s: 5.9 }).is_ok());
    let error = motion.covers(Span { start_s: 0.0, end_s: 10.0 }).unwrap_err();
    let MotionError::OutsideSpan { t_s, start_s, end_s } = error else { panic!("{error}") };
    assert!(t_s == 10.0 && start_s == -10.0 && (end_s - 6.0).abs() < 0.01, "{error}");
    assert!(error.to_string().contains("covers -10.000000 s to 6.0"), "{error}");
    assert!(motion.world_from_body(f64::NAN).is_err());
    assert!(matches!(room1_placed(17.0), Err(MotionError::OutsideSpan { .. })));
}

#[test]
fn gaps_are_refused_inside_the_asked_span_and_passed_by_outside() {
    let mut samples = sampled(swing, 4, 100);
    samples.retain(|sample| !(sample.t_s > 2.0 && sample.t_s < 2.5));
    let asked = |start_s, end_s| without_gaps(&samples, Span { start_s, end_s }, GAP_S_MAX);
    let gap = asked(1.0, 3.0).unwrap_err();
    let MotionError::Gap { at_s, length_s } = gap else { panic!("{gap}") };
    assert!(at_s == 2.0 && (length_s - 0.5).abs() < 1e-9 && length_s > GAP_S_MAX);
    assert_eq!(Spline::fit(&samples, KNOT_S), Err(gap));
    let before = asked(0.5, 2.0).unwrap();
    assert!(before[0].t_s == 0.0 && before[before.len() - 1].t_s == 2.0);
    let after = asked(2.5, 3.0).unwrap();
    assert!(after[0].t_s == 2.5 && after[after.len() - 1].t_s == 4.0);
    assert!(matches!(asked(2.2, 3.0), Err(MotionError::Gap { .. })), "asked from within the gap");
    assert!(matches!(asked(2.1, 2.2), Err(MotionError::Gap { .. })), "asked wholly within the gap");
    assert!(matches!(asked(3.0, 5.0), Err(MotionError::OutsideSpan { .. })));
}

#[test]
fn a_pause_below_the_threshold_is_bridged_whatever_the_knots() {
    let mut samples = sampled(swing, 4, 100);
    samples.retain(|sample| !(sample.t_s > 2.0 && sample.t_s < 2.09));
    for knot_s in [0.02, 0.05, 0.1] {
        let pose = Spline::fit(&samples, knot_s).unwrap().world_from_body(2.045).unwrap();
        // An acceleration of 10 m/s^2 that a straight bridge would miss moves 10 * 0.045^2 / 2 = 10 mm: half of that.
        let missed_m = (pose.translation_m - swing(2.045).translation_m).length();
        assert!(missed_m < 5e-3, "knots of {knot_s} s miss by {missed_m} m");
    }
}

#[test]
fn refused_samples_name_what_is_wrong() {
    let good = sampled(swing, 1, 100);
    assert_eq!(Spline::fit(&good[..3], KNOT_S), Err(MotionError::TooFewSamples { count: 3 }));
    assert_eq!(Spline::fit(&good, 0.0), Err(MotionError::KnotSpacing { knot_s: 0.0 }));
    assert!(matches!(Spline::fit(&good, f64::NAN), Err(MotionError::KnotSpacing { .. })));
    let mut twice = good.clone();
    twice[5].t_s = twice[4].t_s;
    assert!(matches!(Spline::fit(&twice, KNOT_S), Err(MotionError::TimeStandsStill { .. })));
    let mut broken = good;
    broken[5].world_from_body.translation_m.x = f64::NAN;
    assert!(matches!(Spline::fit(&broken, KNOT_S), Err(MotionError::NotFinite { .. })));
}
