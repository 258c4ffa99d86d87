//! Generated motions against the figures that they are made from, measured on the spline's own derivatives.

#![allow(clippy::unwrap_used)] // Helpers of tests fail by panicking, as tests do.

use glam::DVec3;
use sensel::draw::DrawKey;
use sensel::num::{f64_from_usize, u32_truncated};
use sensel::scene::motion::gait::{GENERATED_KNOT_S, Gait, GaitFigures, RUN, WALK, generated, oscillation, spin};
use sensel::scene::motion::imu::GRAVITY_M_PER_S2;
use sensel::scene::motion::path::PathShape;
use sensel::scene::motion::{BodyState, Spline};

const SECONDS: f64 = 120.0;
const STEP_S: f64 = 1e-3;

fn spline(figures: GaitFigures, path: PathShape, seed: u64) -> Spline {
    let gait = Gait::new(figures, path, DrawKey::root(seed));
    generated(|t_s| gait.pose(t_s), GENERATED_KNOT_S, SECONDS)
}

fn states(spline: &Spline) -> Vec<BodyState> {
    (0..u32_truncated(SECONDS / STEP_S)).map(|k| spline.state(f64::from(k) * STEP_S).unwrap()).collect()
}

/// Indices and values of the peaks of a signal that rise above 0.
fn peaks(signal: &[f64]) -> Vec<(usize, f64)> {
    let is_peak = |k: &usize| signal[*k] > 0.0 && signal[k - 1] < signal[*k] && signal[*k] >= signal[k + 1];
    (1..signal.len() - 1).filter(is_peak).map(|k| (k, signal[k])).collect()
}

fn median(values: impl Iterator<Item = f64>) -> f64 {
    let mut values: Vec<f64> = values.collect();
    values.sort_by(f64::total_cmp);
    values[values.len() / 2]
}

fn share_within(found: &[(usize, f64)], low: f64, high: f64) -> f64 {
    f64_from_usize(found.iter().filter(|(_, value)| (low..=high).contains(value)).count()) / f64_from_usize(found.len())
}

/// What is measured of a gait on a straight path.
struct Measured {
    upwards_g: Vec<(usize, f64)>,
    downwards_g: Vec<(usize, f64)>,
    pitch_deg_per_s: Vec<(usize, f64)>,
    sways: usize,
    bob_m: f64,
    speed_m_per_s: f64,
    rates_hz: Vec<f64>,
}

fn measured(figures: GaitFigures, seed: u64) -> Measured {
    let states = states(&spline(figures, PathShape::Line, seed));
    let signal = |of: &dyn Fn(&BodyState) -> f64| states.iter().map(of).collect::<Vec<f64>>();
    let upwards_g = peaks(&signal(&|state| state.acceleration_m_per_s2.y / GRAVITY_M_PER_S2));
    // On a straight path the body's x axis keeps its direction: the rate about it is the rate of pitch.
    let pitch_deg_per_s = peaks(&signal(&|state| state.angular_velocity_rad_per_s.x.to_degrees()));
    let rates_hz = upwards_g.windows(2).map(|pair| 1.0 / (f64_from_usize(pair[1].0 - pair[0].0) * STEP_S)).collect();
    let heights_m = signal(&|state| state.world_from_body.translation_m.y);
    let (low_m, high_m) = heights_m.iter().fold((f64::MAX, f64::MIN), |(low, high), &y| (low.min(y), high.max(y)));
    let ahead_m = |state: &BodyState| -state.world_from_body.translation_m.z;
    Measured {
        downwards_g: peaks(&signal(&|state| -state.acceleration_m_per_s2.y / GRAVITY_M_PER_S2)),
        pitch_deg_per_s,
        sways: peaks(&signal(&|state| state.world_from_body.translation_m.x)).len(),
        bob_m: 0.5 * (high_m - low_m),
        speed_m_per_s: (ahead_m(&states[states.len() - 1]) - ahead_m(&states[0])) / (SECONDS - STEP_S),
        rates_hz,
        upwards_g,
    }
}

fn mean_and_deviation(values: &[f64]) -> (f64, f64) {
    let count = f64_from_usize(values.len());
    let mean = values.iter().sum::<f64>() / count;
    let square = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / count;
    (mean, square.sqrt())
}

#[test]
fn a_walk_has_the_published_figures() {
    let mut tried = 0;
    for seed in 1..=5 {
        let found = measured(WALK, seed);
        let (rate_hz, rate_sd_hz) = mean_and_deviation(&found.rates_hz);
        let peak_g = median(found.upwards_g.iter().map(|peak| peak.1));
        let pitch = median(found.pitch_deg_per_s.iter().map(|peak| peak.1));
        let (in_g, in_pitch) =
            (share_within(&found.upwards_g, 0.3, 0.5), share_within(&found.pitch_deg_per_s, 15.0, 22.0));
        println!(
            "seed {seed}: {rate_hz:.3} Hz, SD {rate_sd_hz:.3}; {peak_g:.3} g, {:.0} % within; pitch {pitch:.2} deg/s, {:.0} % \
             within; bob {:.1} mm; {} sways for {} steps",
            100.0 * in_g,
            100.0 * in_pitch,
            1e3 * found.bob_m,
            found.sways,
            found.upwards_g.len()
        );
        // Slow waves of 19 s and less: in 120 s a wave of 0.065 Hz height that is cut within a period leaves at most
        // 0.065 / (pi 0.053 120) = 3 mHz, eight of them 0.02 Hz at worst; the deviation loses or gains as much.
        assert!((rate_hz - 2.0).abs() < 0.02, "seed {seed}: {rate_hz}");
        assert!((rate_sd_hz - 0.13).abs() < 0.02, "seed {seed}: {rate_sd_hz}");
        // The peak goes with the square of the rate: the median of a rate within 0.05 Hz of its mean, twice 2.5 %.
        assert!((peak_g - 0.4).abs() < 0.02, "seed {seed}: {peak_g}");
        assert!((pitch - 18.0).abs() < 0.5, "seed {seed}: {pitch}");
        // 0.3 to 0.5 g are rates of 1.73 to 2.24 Hz, about two standard deviations either way: 95 %, and slow waves come in spells.
        // 15 to 22 deg/s are 1.67 to 2.44 Hz.
        assert!(in_g > 0.85 && in_pitch > 0.95, "seed {seed}: {in_g} {in_pitch}");
        assert!((0.019..=0.031).contains(&found.bob_m), "seed {seed}: {}", found.bob_m);
        // Half the step rate, to a count at either end.
        assert!((2 * found.sways).abs_diff(found.upwards_g.len()) <= 2, "seed {seed}");
        // Constant speed, but for the spline's error.
        assert!((found.speed_m_per_s - 1.4).abs() < 1e-6 && (1.2..=1.8).contains(&WALK.speed_m_per_s));
        tried += found.upwards_g.len();
    }
    assert!(tried > 1_100, "{tried} steps");
}

#[test]
fn a_run_has_the_published_figures_and_flies_between_its_steps() {
    let mut tried = 0;
    for seed in 1..=5 {
        let found = measured(RUN, seed);
        let (rate_hz, rate_sd_hz) = mean_and_deviation(&found.rates_hz);
        let up_g = median(found.upwards_g.iter().map(|peak| peak.1));
        let down_g = median(found.downwards_g.iter().map(|peak| peak.1));
        let pitch = median(found.pitch_deg_per_s.iter().map(|peak| peak.1));
        println!(
            "seed {seed}: {rate_hz:.3} Hz, SD {rate_sd_hz:.3}; +{up_g:.3} g -{down_g:.3} g; pitch {pitch:.1} deg/s; bob {:.1} mm",
            1e3 * found.bob_m
        );
        assert!((rate_hz - 2.7).abs() < 0.02 && (rate_sd_hz - 0.13).abs() < 0.02, "seed {seed}");
        // 1.25 + 0.3 g; the spline's bends exceed the waves' by (w h)^2 / 12, 1 % and 4 %, and the median rate is 2 % off at most: 4 %.
        assert!((up_g - 1.55).abs() < 0.08, "seed {seed}: {up_g}");
        assert!((down_g - 0.95).abs() < 0.06, "seed {seed}: {down_g}");
        assert!(share_within(&found.upwards_g, 1.0, 2.0) > 0.95, "seed {seed}");
        assert!((pitch - 45.0).abs() < 1.5 && found.pitch_deg_per_s.iter().all(|peak| peak.1 < 90.0), "seed {seed}");
        assert!((0.03..=0.05).contains(&found.bob_m), "seed {seed}: {}", found.bob_m);
        assert!((found.speed_m_per_s - 3.0).abs() < 1e-6 && (2.5..=3.5).contains(&RUN.speed_m_per_s));
        tried += found.upwards_g.len();
    }
    assert!(tried > 1_500, "{tried} steps");
}

#[test]
fn steps_without_variability_are_all_alike() {
    let found = measured(GaitFigures { step_rate_sd_hz: 0.0, ..WALK }, 1);
    assert_eq!(found.upwards_g.len(), 239, "two steps a second; the first stands at 0 s");
    for (_, peak_g) in &found.upwards_g {
        // At a knot the spline's bend exceeds the wave's by (w h)^2 / 12, with w h = 0.25 by 0.53 %; peaks stand near knots only.
        assert!((peak_g - 0.4).abs() < 0.0022, "{peak_g}");
    }
    assert!(found.pitch_deg_per_s.iter().all(|(_, rate)| (rate - 18.0).abs() < 0.02));
}

#[test]
fn the_camera_looks_along_its_path_and_stays_inside_it() {
    let mut tried = 0;
    let radius_m = 2.0;
    let PathShape::Loop(eight) = PathShape::eight(radius_m) else { unreachable!() };
    for (path, middle_m) in
        [(PathShape::Circle(radius_m), DVec3::new(-radius_m, 0.0, 0.0)), (PathShape::Loop(eight), eight.middle_m())]
    {
        let spline = spline(WALK, path, 3);
        for k in 0..u32_truncated(SECONDS / 0.05) {
            let state = spline.state(0.05 * f64::from(k)).unwrap();
            let position_m = state.world_from_body.translation_m - middle_m;
            let level = |v: DVec3| DVec3::new(v.x, 0.0, v.z);
            // The radius, and a sway of 2 cm across the path; the spline cuts curves by a millionth.
            assert!(level(position_m).length() < radius_m + 0.021, "{position_m}");
            let ahead = level(state.world_from_body.rotation * DVec3::Z).normalize();
            let moving = level(state.velocity_m_per_s).normalize();
            // The sway moves across at 0.02 * 2 pi * 1.13 Hz = 0.14 m/s at most, and turns with the path: 0.1 rad of 1.4 m/s.
            assert!(ahead.dot(moving) > 0.99, "{ahead} {moving}");
            assert!((state.world_from_body.rotation * DVec3::Y).y < -0.99, "upright");
            tried += 1;
        }
    }
    assert!(tried > 4_700);
}

#[test]
fn a_spin_turns_at_its_constant_rate_about_the_vertical() {
    let mut tried = 0;
    for rate_deg_per_s in [60.0, 200.0, -200.0, 1_800.0, -1_800.0, 0.0] {
        let spline = generated(|t_s| spin(rate_deg_per_s, t_s), GENERATED_KNOT_S, 30.0);
        for k in 0..300_u32 {
            let state = spline.state(0.1003 * f64::from(k)).unwrap();
            let rate = state.angular_velocity_rad_per_s;
            // To the right: about the body's y, which is down. Angles of 900 rad round to 1e-13; over a knot of 0.02 s, 1e-11 rad/s.
            assert!((rate - DVec3::Y * rate_deg_per_s.to_radians()).length() < 1e-10, "{rate_deg_per_s}: {rate}");
            assert!(state.angular_acceleration_rad_per_s2.length() < 1e-7 && state.velocity_m_per_s == DVec3::ZERO);
            let right = state.world_from_body.rotation * DVec3::X;
            assert!(right.y.abs() < 1e-12, "level");
            tried += 1;
        }
    }
    let early = spin(60.0, 0.5).rotation * DVec3::Z;
    assert!(early.x > 0.4 && early.z < -0.8, "from -z to the right, which is +x: {early}");
    assert_eq!(tried, 1_800);
}

#[test]
fn a_trembling_rig_moves_by_its_millimetre() {
    let spline = generated(|t_s| oscillation(1e-3, 1.0, DVec3::X, t_s), GENERATED_KNOT_S, 10.0);
    let (mut greatest_m, mut worst_m) = (0.0_f64, 0.0_f64);
    for k in 0..10_000_u32 {
        let t_s = 1e-3 * f64::from(k);
        let position_m = spline.world_from_body(t_s).unwrap().translation_m;
        greatest_m = greatest_m.max(position_m.x);
        worst_m = worst_m.max((position_m - DVec3::X * (1e-3 * libm::sin(core::f64::consts::TAU * t_s))).length());
    }
    // (w h)^4 / 30 with w h = 0.126: 8e-6 of a millimetre.
    assert!(worst_m < 9e-9 && (greatest_m - 1e-3).abs() < 1e-8, "{worst_m} {greatest_m}");
}

#[test]
fn a_generated_motion_is_a_function_of_seed_and_time_alone() {
    let gait = Gait::new(WALK, PathShape::eight(1.5), DrawKey::root(9));
    let other = Gait::new(WALK, PathShape::eight(1.5), DrawKey::root(10));
    let made = |gait: &Gait, end_s: f64| generated(|t_s| gait.pose(t_s), GENERATED_KNOT_S, end_s);
    let (short, long, elsewhere) = (made(&gait, 3.0), made(&gait, 30.0), made(&other, 3.0));
    let mut tried = 0;
    for k in 0..300_u32 {
        let t_s = 0.01 * f64::from(k);
        assert_eq!(short.state(t_s), long.state(t_s), "the same however long the run is");
        tried += usize::from(short.state(t_s) != elsewhere.state(t_s));
    }
    assert!(tried > 290, "another seed, other steps: {tried}");
    // The rate's integral is the phase: peaks of the bob come where the rate says.
    let mean: f64 = (0..12_000_u32).map(|k| gait.step_rate_hz(0.01 * f64::from(k))).sum::<f64>() / 12_000.0;
    assert!((mean - 2.0).abs() < 0.02, "{mean}");
}
