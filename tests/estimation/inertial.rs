//! Preintegration against the spline whose IMU was read, its derivatives and covariance.

use glam::{DQuat, DVec3};
use nalgebra::SMatrix;
use sensel::draw::DrawKey;
use sensel::num::{f64_from_usize, u64_from};
use sensel::pose::Pose;
use sensel::scene::motion::imu::{self, GRAVITY_IN_WORLD_M_PER_S2, IDEAL, Imu, ImuNoise, MEMS_PHONE};
use sensel::scene::motion::{BodyState, Motion, PlacedSpline, Spline};
use sensel::so3;
use sensel::tracker::lie::{Twist, se3_exp};
use sensel::tracker::preintegrate::{Bias, ImuError, ImuMeasurement, ImuState, Noise, Preintegrated};
use sensel::units::Span;

const GRAVITY: DVec3 = GRAVITY_IN_WORLD_M_PER_S2;

/// A hand that swings by decimetres and tens of degrees at about 1 Hz.
fn hand(t_s: f64) -> Pose {
    let wave = |hz: f64, phase: f64| libm::sin(std::f64::consts::TAU * hz * t_s + phase);
    let position_m = DVec3::new(0.3 * wave(0.7, 0.0), 0.15 * wave(1.1, 1.0), 0.25 * wave(0.9, 2.0));
    let turn = DVec3::new(0.3 * wave(0.8, 0.5), 0.5 * wave(0.5, 1.5), 0.2 * wave(1.2, 2.5));
    Pose::new(so3::exp(turn), position_m)
}

fn motion() -> Motion {
    let spline = Spline::following(hand, 0.0, 0.05, 200);
    Motion::Spline(PlacedSpline::new(spline, 0.0, 1.0, DVec3::ZERO, DQuat::IDENTITY).unwrap())
}

fn noise(of: &ImuNoise) -> Noise {
    Noise {
        gyroscope_noise_density: of.gyroscope_noise_density,
        accelerometer_noise_density: of.accelerometer_noise_density,
        gyroscope_random_walk: of.gyroscope_random_walk,
        accelerometer_random_walk: of.accelerometer_random_walk,
    }
}

fn readings(motion: &Motion, of: ImuNoise, key: DrawKey) -> Vec<ImuMeasurement> {
    let unit = Imu { noise: of, body_from_imu: Pose::IDENTITY };
    let samples = imu::samples(motion, Span { start_s: 0.0, end_s: 9.0 }, &unit, GRAVITY, key).unwrap();
    let reading = |s: &imu::ImuSample| ImuMeasurement {
        t_s: s.t_s,
        angular_velocity_rad_per_s: s.angular_velocity_rad_per_s,
        acceleration_m_per_s2: s.acceleration_m_per_s2,
    };
    samples.iter().map(reading).collect()
}

fn state(of: &BodyState) -> ImuState {
    ImuState { world_from_imu: of.world_from_body, velocity_m_per_s: of.velocity_m_per_s, bias: Bias::default() }
}

/// Worst rotation (rad), velocity and position errors over spans of a second that start and end between readings.
fn worst(rate_hz: f64) -> [f64; 3] {
    let motion = motion();
    let readings = readings(&motion, ImuNoise { rate_hz, ..IDEAL }, DrawKey::root(1));
    let mut worst = [0.0_f64; 3];
    for start in 0..30 {
        let from_s = 0.501 + 0.2 * f64::from(start);
        let step = Preintegrated::new(&readings, (from_s, from_s + 1.0), Bias::default(), &noise(&IDEAL)).unwrap();
        let (from, to) = (state(&motion.state(from_s).unwrap()), state(&motion.state(from_s + 1.0).unwrap()));
        let residual = step.residual((&from, &to), GRAVITY);
        for part in 0..3 {
            worst[part] = worst[part].max(residual.fixed_rows::<3>(3 * part).norm());
        }
    }
    worst
}

#[test]
fn a_second_of_readings_gives_the_splines_step_with_an_error_that_falls_with_the_square_of_the_interval() {
    let (coarse, fine, finest) = (worst(200.0), worst(400.0), worst(800.0));
    // Trapezoids of 5 ms: dt^2 / 12 times the change of the rate's slope (15 rad/s^2 at each end) is 6e-5 rad, and rate
    // times slope over the second adds 4e-5; gravity turned by that for a second is 1e-3 m/s, and half of it in metres;
    // the force's own trapezoids add 1e-4.
    for (part, bound) in [1e-4, 1.1e-3, 6e-4].into_iter().enumerate() {
        assert!(coarse[part] < bound, "part {part} at 200 Hz: {:e}", coarse[part]);
        assert!(fine[part] < 0.26 * coarse[part] && finest[part] < 0.26 * fine[part], "{coarse:?} {fine:?} {finest:?}");
    }
}

#[test]
fn derivatives_by_both_states_agree_with_central_differences() {
    let motion = motion();
    let readings = readings(&motion, MEMS_PHONE, DrawKey::root(3));
    let start_bias =
        Bias { gyroscope_rad_per_s: DVec3::new(0.01, -0.02, 0.005), accelerometer_m_per_s2: DVec3::splat(0.05) };
    let step = Preintegrated::new(&readings, (1.0, 1.4), start_bias, &noise(&MEMS_PHONE)).unwrap();
    let mut from = state(&motion.state(1.0).unwrap());
    let mut to = state(&motion.state(1.4).unwrap());
    from.bias =
        Bias { gyroscope_rad_per_s: DVec3::new(0.03, 0.01, -0.02), accelerometer_m_per_s2: DVec3::new(0.1, -0.1, 0.2) };
    to.world_from_imu = to.world_from_imu.then(&se3_exp(Twist::from_array([0.1, 0.2, -0.1, 0.3, -0.2, 0.4])));
    let (by_from, by_to) = step.jacobians((&from, &to), GRAVITY);
    let moved = |state: &ImuState, k: usize, h: f64| {
        let mut numbers = [0.0; 15];
        numbers[k] = h;
        let part = |first: usize| DVec3::new(numbers[first], numbers[first + 1], numbers[first + 2]);
        ImuState {
            world_from_imu: state.world_from_imu.then(&se3_exp(Twist { linear_m: part(0), angular_rad: part(3) })),
            velocity_m_per_s: state.velocity_m_per_s + part(6),
            bias: Bias {
                gyroscope_rad_per_s: state.bias.gyroscope_rad_per_s + part(9),
                accelerometer_m_per_s2: state.bias.accelerometer_m_per_s2 + part(12),
            },
        }
    };
    let h = 1e-5;
    for k in 0..15 {
        let of_from = (step.residual((&moved(&from, k, h), &to), GRAVITY)
            - step.residual((&moved(&from, k, -h), &to), GRAVITY))
            / (2.0 * h);
        let of_to = (step.residual((&from, &moved(&to, k, h)), GRAVITY)
            - step.residual((&from, &moved(&to, k, -h)), GRAVITY))
            / (2.0 * h);
        // Third derivatives below 10 times h^2 / 6, and rounding of 4 * 2^-53 / h.
        assert!((of_from - by_from.column(k)).amax() < 1e-9, "from {k}: {of_from} for {}", by_from.column(k));
        assert!((of_to - by_to.column(k)).amax() < 1e-9, "to {k}");
    }
}

#[test]
fn the_first_order_in_the_bias_is_that_of_integrating_again() {
    let readings = readings(&motion(), IDEAL, DrawKey::root(3));
    let at = |bias: Bias| Preintegrated::new(&readings, (1.0, 1.5), bias, &noise(&IDEAL)).unwrap();
    let base = at(Bias::default());
    let mut tried = 0;
    for axis in 0..6 {
        let h = 1e-3;
        let mut numbers = [0.0; 6];
        numbers[axis] = h;
        let [a, b, c, d, e, f] = numbers;
        let bias = Bias { gyroscope_rad_per_s: DVec3::new(a, b, c), accelerometer_m_per_s2: DVec3::new(d, e, f) };
        let (again, (rotation, velocity, position)) = (at(bias), base.corrected(&bias));
        // Second order: (h * 0.5 s)^2 times a force of 10 m/s^2.
        assert!(so3::log(rotation.conjugate() * again.rotation).length() < 1e-6, "axis {axis}");
        assert!((velocity - again.velocity_m_per_s).length() < 3e-6 && (position - again.position_m).length() < 3e-6);
        let moved = (again.velocity_m_per_s - base.velocity_m_per_s).length()
            + so3::log(base.rotation.conjugate() * again.rotation).length();
        assert!(moved > 1e-4, "axis {axis} must matter: {moved:e}");
        tried += 1;
    }
    assert_eq!(tried, 6);
}

#[test]
fn the_covariance_is_what_noisy_readings_scatter_by() {
    let motion = motion();
    let quiet = ImuNoise { gyroscope_random_walk: 0.0, accelerometer_random_walk: 0.0, ..MEMS_PHONE };
    let clean = readings(&motion, IDEAL, DrawKey::root(1));
    let span = (1.0, 1.5);
    let exact = Preintegrated::new(&clean, span, Bias::default(), &noise(&quiet)).unwrap();
    let inverse = exact.covariance.try_inverse().expect("both sensors are noisy");
    let (mut sum, trials) = (0.0, 400);
    for trial in 0..trials {
        let noisy = readings(&motion, quiet, DrawKey::root(1_000 + u64_from(trial)));
        let step = Preintegrated::new(&noisy, span, Bias::default(), &noise(&quiet)).unwrap();
        let parts = [
            so3::log(exact.rotation.conjugate() * step.rotation),
            step.velocity_m_per_s - exact.velocity_m_per_s,
            step.position_m - exact.position_m,
        ];
        let miss = SMatrix::<f64, 9, 1>::from_fn(|k, _| parts[k / 3][k % 3]);
        sum += miss.dot(&(inverse * miss));
    }
    let mean = sum / f64_from_usize(trials);
    // Mean 9, variance 18 over 400 trials: 0.21, four of that. Means of neighbours take the ends' readings half: 1 % of
    // 100 intervals.
    assert!((mean - 9.0).abs() < 0.95, "{mean}");
}

#[test]
fn readings_that_do_not_do_are_refused() {
    let good = readings(&motion(), IDEAL, DrawKey::root(1));
    let with = |readings: &[ImuMeasurement], span| Preintegrated::new(readings, span, Bias::default(), &noise(&IDEAL));
    assert!(matches!(with(&good, (8.5, 9.5)), Err(ImuError::Uncovered { .. })));
    assert!(matches!(with(&[], (1.0, 2.0)), Err(ImuError::Uncovered { .. })));
    assert!(matches!(with(&good, (2.0, 2.0)), Err(ImuError::Uncovered { .. })));
    let mut repeated = good.clone();
    repeated[300].t_s = repeated[299].t_s;
    assert!(matches!(with(&repeated, (1.0, 2.0)), Err(ImuError::TimeStandsStill { .. })));
    let mut broken = good.clone();
    broken[300].acceleration_m_per_s2.x = f64::NAN;
    assert!(matches!(with(&broken, (1.0, 2.0)), Err(ImuError::NotFinite { .. })));
}
