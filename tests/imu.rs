//! The IMU through its front door: derivatives against the path, the emitted stream against the path, noise against Kalibr's
//! model.

#![allow(clippy::unwrap_used)] // Helpers of tests fail by panicking, as tests do.

use glam::{DQuat, DVec3};
use sensel::draw::DrawKey;
use sensel::num::{f64_from_u64, f64_from_usize, u32_truncated, u64_half_even};
use sensel::pose::{Pose, TimedPose, parse_tum};
use sensel::scene::motion::gait::{GENERATED_KNOT_S, Gait, RUN, WALK, generated, spin};
use sensel::scene::motion::imu::{
    ADIS16448, GRAVITY_IN_WORLD_M_PER_S2, GRAVITY_M_PER_S2, IDEAL, Imu, ImuNoise, ImuSample, MEMS_PHONE, samples, truth,
};
use sensel::scene::motion::path::PathShape;
use sensel::scene::motion::{KNOT_S, Motion, PlacedSpline, Spline, Y_UP_FROM_Z_UP, from_first_sample};
use sensel::so3;
use sensel::units::Span;

const ROOM1: &str = include_str!("../scenes/bathroom/tum_vi_room1.txt");

/// A position of the IMU that makes its lever arm felt.
const LEVER: Pose =
    Pose { rotation: DQuat::from_xyzw(0.6, 0.0, 0.0, 0.8), translation_m: DVec3::new(0.08, -0.05, 0.03) };

fn room1() -> Vec<TimedPose> {
    from_first_sample(&parse_tum(ROOM1).unwrap())
}

/// The sixteen seconds of motion capture forwards, backwards, forwards, backwards: over a minute of a hand's real accelerations.
fn room1_for_a_minute() -> Spline {
    let once = room1();
    let length_s = once[once.len() - 1].t_s;
    let mut samples = once.clone();
    for turn in 1..4_u32 {
        let start_s = f64::from(turn) * length_s;
        let next = |sample: &TimedPose, t_s: f64| TimedPose { t_s: start_s + t_s, ..*sample };
        if turn % 2 == 1 {
            samples.extend(once.iter().rev().skip(1).map(|sample| next(sample, length_s - sample.t_s)));
        } else {
            samples.extend(once.iter().skip(1).map(|sample| next(sample, sample.t_s)));
        }
    }
    Spline::fit(&samples, KNOT_S).unwrap()
}

fn gait(figures: sensel::scene::motion::gait::GaitFigures, path: PathShape, end_s: f64) -> Spline {
    let gait = Gait::new(figures, path, DrawKey::root(5));
    generated(|t_s| gait.pose(t_s), GENERATED_KNOT_S, end_s)
}

fn motion(spline: Spline, turn: DQuat) -> Motion {
    Motion::Spline(PlacedSpline::new(spline, 0.0, 1.0, DVec3::ZERO, turn).unwrap())
}

/// Position, velocity, rotation and angular velocity after `intervals` knots from the third on, from the start's and from
/// accelerations, angular velocities and angular accelerations alone, in `parts` steps a knot.
fn integrated(spline: &Spline, intervals: u32, parts: u32) -> (DVec3, DVec3, DQuat, DVec3) {
    let start_s = spline.span().start_s + 2.0 * spline.knot_s();
    let step_s = spline.knot_s() / f64::from(parts);
    let at = |steps: f64| spline.state(start_s + steps * step_s).unwrap();
    let first = at(0.0);
    let (mut p, mut v) = (first.world_from_body.translation_m, first.velocity_m_per_s);
    let (mut rotation, mut rate) = (first.world_from_body.rotation, first.angular_velocity_rad_per_s);
    let root3 = 3.0_f64.sqrt();
    for step in 0..intervals * parts {
        let step = f64::from(step);
        let [a0, a1, a2] = [0.0, 0.5, 1.0].map(|part| at(step + part).acceleration_m_per_s2);
        p += v * step_s + (a0 + a1 * 2.0) * (step_s * step_s / 6.0);
        v += (a0 + a1 * 4.0 + a2) * (step_s / 6.0);
        // Magnus' series to the fourth order, on the two points of Gauss.
        let gauss = [0.5 - root3 / 6.0, 0.5 + root3 / 6.0].map(|part| at(step + part));
        let [w1, w2] = [gauss[0].angular_velocity_rad_per_s, gauss[1].angular_velocity_rad_per_s];
        rotation *= so3::exp((w1 + w2) * (0.5 * step_s) + w1.cross(w2) * (root3 / 12.0 * step_s * step_s));
        let [b1, b2] = [gauss[0].angular_acceleration_rad_per_s2, gauss[1].angular_acceleration_rad_per_s2];
        rate += (b1 + b2) * (0.5 * step_s);
    }
    (p, v, rotation.normalize(), rate)
}

#[test]
fn derivatives_integrated_over_a_minute_return_the_trajectory() {
    let cases = [
        ("motion capture", room1_for_a_minute(), 61.0),
        ("walk", gait(WALK, PathShape::eight(2.0), 62.0), 60.0),
        ("run", gait(RUN, PathShape::Circle(5.0), 62.0), 60.0),
    ];
    let mut tried = 0;
    for (name, spline, length_s) in cases {
        let intervals = u32_truncated(length_s / spline.knot_s());
        let (coarse, fine) = (integrated(&spline, intervals, 16), integrated(&spline, intervals, 32));
        let end_s = spline.span().start_s + spline.knot_s() * (2.0 + f64::from(intervals));
        let end = spline.state(end_s).unwrap();
        let apart_m = (fine.0 - end.world_from_body.translation_m).length();
        let apart_rad = so3::log(end.world_from_body.rotation.conjugate() * fine.2).length();
        let step_m = (fine.0 - coarse.0).length();
        let step_rad = so3::log(coarse.2.conjugate() * fine.2).length();
        println!(
            "{name}: {length_s} s, {apart_m:.1e} m, {:.1e} deg; {step_m:.1e} m, {step_rad:.1e} rad by halving the step",
            apart_rad.to_degrees()
        );
        // The quadrature is good to 1e-10: halving its step changes no more. (Accelerations are linear between knots, where
        // the position's rule is exact; Magnus' error is of the fourth order.)
        assert!(step_m < 1e-10 && step_rad < 1e-10, "{name}");
        // What is asked is 1 mm and 1e-5 degrees. What is left are roundings: 40,000 steps of 1e-16 in a speed, for 60 s, are
        // 2e-10 m at worst; a sixteenth of the angle's last step stands for the rest.
        assert!(apart_m < 1e-9 && apart_rad.to_degrees() < 1e-8, "{name}");
        assert!((fine.1 - end.velocity_m_per_s).length() < 1e-10, "{name}");
        assert!(
            (fine.3 - end.angular_velocity_rad_per_s).length() < 1e-7,
            "{name}: {}",
            (fine.3 - end.angular_velocity_rad_per_s).length()
        );
        tried += 1;
    }
    assert_eq!(tried, 3);
}

/// A reading as a file carries it: its time on the nanosecond.
fn emitted(reading: &ImuSample) -> ImuSample {
    ImuSample { t_s: f64_from_u64(u64_half_even(reading.t_s * 1e9)) * 1e-9, ..*reading }
}

/// Where the trapezoidal rule on a stream leads from a true start: the IMU's position at the end.
fn dead_reckoned(stream: &[ImuSample], world_from_imu: Pose, velocity_m_per_s: DVec3) -> DVec3 {
    let (mut p, mut v, mut rotation) = (world_from_imu.translation_m, velocity_m_per_s, world_from_imu.rotation);
    for pair in stream.windows(2).map(|pair| [emitted(&pair[0]), emitted(&pair[1])]) {
        let dt_s = pair[1].t_s - pair[0].t_s;
        let [w0, w1] = pair.map(|reading| reading.angular_velocity_rad_per_s);
        let a0 = rotation * pair[0].acceleration_m_per_s2 + GRAVITY_IN_WORLD_M_PER_S2;
        rotation = (rotation * so3::exp((w0 + w1) * (0.5 * dt_s))).normalize();
        let a1 = rotation * pair[1].acceleration_m_per_s2 + GRAVITY_IN_WORLD_M_PER_S2;
        p += v * dt_s + (a0 + a1) * (0.25 * dt_s * dt_s);
        v += (a0 + a1) * (0.5 * dt_s);
    }
    p
}

/// Greatest and root mean square drift within a second, over starts every 0.25 s.
fn drift_m(motion: &Motion, body_from_imu: Pose, rate_hz: f64, seconds: u32) -> (f64, f64) {
    let imu = Imu { noise: ImuNoise { rate_hz, ..IDEAL }, body_from_imu };
    let (mut greatest_m, mut sum_m2, mut count) = (0.0_f64, 0.0, 0.0);
    for quarter in 0..seconds * 4 {
        let start_s = 0.25 * f64::from(quarter + 1);
        let span = Span { start_s, end_s: start_s + 1.0 };
        let stream = samples(motion, span, &imu, GRAVITY_IN_WORLD_M_PER_S2, DrawKey::root(1)).unwrap();
        assert_eq!(stream.len(), usize::try_from(u32_truncated(rate_hz)).unwrap() + 1);
        let state = motion.state(start_s).unwrap();
        let lever_m = state.angular_velocity_rad_per_s.cross(body_from_imu.translation_m);
        let velocity = state.velocity_m_per_s + state.world_from_body.rotation * lever_m;
        let found_m = dead_reckoned(&stream, state.world_from_body.then(&body_from_imu), velocity);
        let true_m = motion.world_from_body(span.end_s).unwrap().then(&body_from_imu).translation_m;
        let drift_m = (found_m - true_m).length();
        greatest_m = greatest_m.max(drift_m);
        sum_m2 += drift_m * drift_m;
        count += 1.0;
    }
    (greatest_m, (sum_m2 / count).sqrt())
}

#[test]
fn the_emitted_stream_drifts_little_and_with_the_square_of_its_step() {
    let cases = [
        ("motion capture", motion(Spline::fit(&room1(), KNOT_S).unwrap(), Y_UP_FROM_Z_UP), Pose::IDENTITY),
        ("motion capture, lever arm", motion(Spline::fit(&room1(), KNOT_S).unwrap(), Y_UP_FROM_Z_UP), LEVER),
        ("walk", motion(gait(WALK, PathShape::eight(2.0), 17.0), DQuat::IDENTITY), LEVER),
        ("run", motion(gait(RUN, PathShape::Circle(5.0), 17.0), DQuat::IDENTITY), LEVER),
    ];
    let mut tried = 0;
    for (name, motion, body_from_imu) in cases {
        let drifts = [200.0, 400.0, 800.0].map(|rate_hz| drift_m(&motion, body_from_imu, rate_hz, 14));
        let ratios = [drifts[0].1 / drifts[1].1, drifts[1].1 / drifts[2].1];
        println!(
            "{name}: at 200 Hz {:.3} mm at most, {:.3} mm rms; ratios {ratios:.3?}",
            1e3 * drifts[0].0,
            1e3 * drifts[0].1
        );
        assert!(drifts[0].0 < 5e-3, "{name}");
        // Knots of 0.05 and 0.02 s fall on readings, or almost, and between them the path is smooth: the rule's error is a series in
        // dt^2, whose next term is (w dt)^2 / 20 of the first, 5e-4 for a run's 5.4 Hz.
        for ratio in ratios {
            assert!((ratio - 4.0).abs() < 0.02, "{name}: {ratio}");
            tried += 1;
        }
    }
    assert_eq!(tried, 8);
}

#[test]
fn the_stream_drifts_with_the_square_of_its_step_wherever_the_knots_fall() {
    let rates_hz = [200.0, 400.0, 800.0];
    let (mut sums_m2, mut greatest_m) = ([0.0; 3], 0.0_f64);
    let spacings = 16_u32;
    for spacing in 0..spacings {
        let knot_s = 0.0403 + 0.00097 * f64::from(spacing);
        let motion = motion(Spline::fit(&room1(), knot_s).unwrap(), Y_UP_FROM_Z_UP);
        for (sum_m2, rate_hz) in sums_m2.iter_mut().zip(rates_hz) {
            let (most_m, rms_m) = drift_m(&motion, Pose::IDENTITY, rate_hz, 14);
            *sum_m2 += rms_m * rms_m;
            greatest_m = greatest_m.max(if rate_hz == 200.0 { most_m } else { 0.0 });
        }
    }
    let rms_m = sums_m2.map(|sum_m2| (sum_m2 / f64::from(spacings)).sqrt());
    let order = 0.5 * libm::log2(rms_m[0] / rms_m[2]);
    println!("at most {:.3} mm, rms {rms_m:?}, order {order:.3}", 1e3 * greatest_m);
    assert!(greatest_m < 5e-3);
    // A knot at part f of a step adds f (1 - f) dt^2 / 2 of its bend. Neighbouring bends and neighbouring f both alternate at some
    // spacings, so that one spacing's drift squared scatters by its own size; sixteen, at two rates: 35 %, 0.13 of the order, twice it.
    assert!((order - 2.0).abs() < 0.26, "{order}");
}

#[test]
fn a_lever_arm_feels_what_its_own_position_does() {
    // Constant turning: centripetal alone, w^2 r towards the axis.
    let rate_deg_per_s = 200.0;
    let turning = motion(generated(|t_s| spin(rate_deg_per_s, t_s), GENERATED_KNOT_S, 3.0), DQuat::IDENTITY);
    let position_m = DVec3::new(0.1, 0.0, 0.0);
    let at = Pose::new(DQuat::IDENTITY, position_m);
    let rate = rate_deg_per_s.to_radians();
    let (w, force) = truth(&turning.state(1.234).unwrap(), &at, GRAVITY_IN_WORLD_M_PER_S2);
    // The body's y is down: a turn to the right is about +y; at rest it feels gravity's opposite along -y. Roundings of 12 m/s^2.
    assert!((w - DVec3::Y * rate).length() < 1e-11, "{w}");
    assert!((force - DVec3::new(-rate * rate * 0.1, -GRAVITY_M_PER_S2, 0.0)).length() < 1e-9, "{force}");

    // Any motion: second differences of the IMU's own path.
    let moving = motion(Spline::fit(&room1(), KNOT_S).unwrap(), Y_UP_FROM_Z_UP);
    let step_s = 1e-4;
    let (mut tried, mut lever_m_per_s2) = (0, 0.0_f64);
    for k in 0..200_u32 {
        let t_s = 1.0 + 0.0617 * f64::from(k);
        let [before, here, after] =
            [-1.0, 0.0, 1.0].map(|side| moving.world_from_body(t_s + side * step_s).unwrap().then(&LEVER));
        let bend = (before.translation_m - 2.0 * here.translation_m + after.translation_m) / (step_s * step_s);
        let expected = here.rotation.conjugate() * (bend - GRAVITY_IN_WORLD_M_PER_S2);
        let (_, force) = truth(&moving.state(t_s).unwrap(), &LEVER, GRAVITY_IN_WORLD_M_PER_S2);
        let (_, at_origin) =
            truth(&moving.state(t_s).unwrap(), &Pose::new(LEVER.rotation, DVec3::ZERO), GRAVITY_IN_WORLD_M_PER_S2);
        lever_m_per_s2 = lever_m_per_s2.max((force - at_origin).length());
        // Roundings of 1 m: 4 * 1e-16 / 1e-8 = 4e-8; between knots h^2 / 12 of the fourth derivative 1e4 m/s^4 = 1e-5; over a knot
        // h / 6 of the jerk's jump below 2,000 m/s^3 = 3e-2.
        assert!((force - expected).length() < 3e-2, "{t_s}: {force} {expected}");
        tried += 1;
    }
    assert_eq!(tried, 200);
    // The arm of 10 cm did matter: rates of 2 rad/s and accelerations of 20 rad/s^2.
    assert!(lever_m_per_s2 > 0.5, "{lever_m_per_s2}");
}

/// Allan variance of a signal at clusters of `length` readings, mean over axes, with the number of differences.
fn allan(signal: &[DVec3], length: usize) -> (f64, f64) {
    let means: Vec<DVec3> = signal
        .chunks_exact(length)
        .map(|chunk| chunk.iter().fold(DVec3::ZERO, |sum, value| sum + *value) / f64_from_usize(length))
        .collect();
    let sum: f64 = means.windows(2).map(|pair| (pair[1] - pair[0]).length_squared()).sum();
    let count = 3.0 * f64_from_usize(means.len() - 1);
    (sum / count / 2.0, count)
}

#[test]
fn the_emitted_noise_has_its_configured_densities_at_every_averaging_time() {
    let seconds = 2_000.0;
    let mut tried = 0;
    for (name, preset, rate_hz) in
        [("mems_phone", MEMS_PHONE, 200.0), ("adis16448", ADIS16448, 200.0), ("mems_phone", MEMS_PHONE, 50.0)]
    {
        let imu = Imu { noise: ImuNoise { rate_hz, ..preset }, body_from_imu: Pose::IDENTITY };
        let still = Motion::Still(Pose::IDENTITY);
        let span = Span { start_s: 0.0, end_s: seconds };
        let stream = samples(&still, span, &imu, GRAVITY_IN_WORLD_M_PER_S2, DrawKey::root(11)).unwrap();
        let gyroscope: Vec<DVec3> = stream.iter().map(|reading| reading.angular_velocity_rad_per_s).collect();
        let accelerometer: Vec<DVec3> =
            stream.iter().map(|reading| reading.acceleration_m_per_s2 + GRAVITY_IN_WORLD_M_PER_S2).collect();
        for (signal, density, walk) in [
            (gyroscope, preset.gyroscope_noise_density, preset.gyroscope_random_walk),
            (accelerometer, preset.accelerometer_noise_density, preset.accelerometer_random_walk),
        ] {
            for tau_s in [1.0 / rate_hz, 0.1, 1.0, 20.0] {
                let length = usize::try_from(u64_half_even(tau_s * rate_hz)).unwrap();
                let (found, count) = allan(&signal, length);
                // White noise N^2 / tau; a walk K^2 tau / 3, and as much as K^2 dt / (6 m) more for steps at m readings.
                let m = f64_from_usize(length);
                let expected = density * density / tau_s + walk * walk * tau_s / 3.0 * (1.0 + 0.5 / (m * m));
                // Neighbouring differences share a mean, so n of them count as some n / 1.5: relative SE sqrt(3 / n); 4.5 of it, seed 11.
                let tolerance = 4.5 * (3.0 / count).sqrt();
                println!(
                    "{name} {rate_hz} Hz, {tau_s} s: {found:.3e} of {expected:.3e}, +- {:.1} %",
                    100.0 * tolerance
                );
                assert!((found / expected - 1.0).abs() < tolerance, "{name}, tau {tau_s} s: {found} {expected}");
                tried += 1;
            }
        }
    }
    assert_eq!(tried, 24);
}

#[test]
fn the_presets_are_their_datasheets_in_other_units() {
    // 0.66 deg/sqrt(h) = 0.66 deg / 60 sqrt(s) = 1.92e-4 rad/s/sqrt(Hz); 0.11 m/s/sqrt(h) = 1.83e-3 m/s^2/sqrt(Hz).
    assert!((ADIS16448.gyroscope_noise_density - 1.919_9e-4).abs() < 1e-8);
    assert!((ADIS16448.accelerometer_noise_density - 1.833_3e-3).abs() < 1e-7);
    assert!((MEMS_PHONE.gyroscope_noise_density - 1.86e-4).abs() < 1e-12 && MEMS_PHONE.rate_hz == 200.0);
}
