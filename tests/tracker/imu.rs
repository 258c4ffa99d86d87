//! An IMU beside the cameras: readings of the synthetic motions by differences, with keyed noise and biases.

use glam::DVec3;
use sensel::draw::DrawKey;
use sensel::num::{f64_from_i64, f64_from_u64};
use sensel::pose::Pose;
use sensel::so3;
use sensel::tracker::preintegrate::Bias;
use sensel::tracker::preintegrate::chain::WindowKeyframe;
use sensel::tracker::{
    ImuCalibration, ImuFilter, ImuMeasurement, LossReason, Noise, Status, TrackedFrame, Tracker, TrackerParams,
};

use super::synthetic::{Hardship, RATE_HZ, World, lively, mono_rig, normal, score};

const IMU_HZ: f64 = 200.0;
/// A phone's unit (Kalibr's example).
const PHONE: Noise = Noise {
    gyroscope_noise_density: 1.86e-4,
    accelerometer_noise_density: 1.86e-3,
    gyroscope_random_walk: 2.66e-5,
    accelerometer_random_walk: 4.33e-4,
};
/// What the IMU's readings are off by.
const BIAS: Bias =
    Bias { gyroscope_rad_per_s: DVec3::new(0.02, -0.015, 0.01), accelerometer_m_per_s2: DVec3::new(0.06, -0.04, 0.05) };
/// Gravity in the room, whose y points down.
const GRAVITY: DVec3 = DVec3::new(0.0, 9.806_65, 0.0);

/// Turned and 5 cm away from the body.
fn mounting() -> Pose {
    Pose::new(so3::exp(DVec3::new(0.3, -1.1, 0.4)), DVec3::new(0.03, -0.02, 0.04))
}

/// Readings at `k / 200 Hz` over some seconds. Third differences of the motions are below 100 m/s^3: a step of 1 ms leaves 1e-5 m/s^2.
fn readings(motion: fn(f64) -> Pose, seconds: f64, seed: u64) -> Vec<ImuMeasurement> {
    let imu = |t_s: f64| motion(t_s).then(&mounting());
    let h = 1e-3;
    let of = |k: i64| {
        let t_s = f64_from_i64(k) / IMU_HZ;
        let key = DrawKey::root(seed).with(77).with(k.cast_unsigned());
        let noise = |field: u64, density: f64| {
            let axis = |axis: u64| normal(key.with(field).with(axis));
            DVec3::new(axis(0), axis(1), axis(2)) * density * IMU_HZ.sqrt()
        };
        let (before, now, after) = (imu(t_s - h), imu(t_s), imu(t_s + h));
        let acceleration = (after.translation_m - 2.0 * now.translation_m + before.translation_m) / (h * h);
        let turn = so3::log((before.rotation.conjugate() * after.rotation).normalize()) / (2.0 * h);
        ImuMeasurement {
            t_s,
            angular_velocity_rad_per_s: turn + BIAS.gyroscope_rad_per_s + noise(0, PHONE.gyroscope_noise_density),
            acceleration_m_per_s2: now.rotation.conjugate() * (acceleration - GRAVITY)
                + BIAS.accelerometer_m_per_s2
                + noise(1, PHONE.accelerometer_noise_density),
        }
    };
    (-20..=sensel::num::i64_half_even(seconds * IMU_HZ) + 5).map(of).collect()
}

struct Carried {
    motion: fn(f64) -> Pose,
    frames: u64,
    has_imu: bool,
    /// Frames in which every picture is black.
    dark: std::ops::Range<u64>,
    row_time_s: f64,
}

const CARRIED: Carried = Carried { motion: lively, frames: 150, has_imu: true, dark: 0..0, row_time_s: 0.0 };

fn tracked(world: &World, carried: &Carried) -> (Vec<(Pose, TrackedFrame)>, Tracker) {
    let made = Tracker::new(world.cameras.clone(), TrackerParams::room(world.seed)).expect("a valid rig");
    let calibration = ImuCalibration { body_from_imu: mounting(), noise: PHONE };
    let mut tracker = if carried.has_imu { made.with_imu(calibration) } else { made };
    let all = readings(carried.motion, f64_from_u64(carried.frames) / RATE_HZ, world.seed);
    let mut next = 0;
    let mut answers = Vec::new();
    for number in 0..carried.frames {
        let t_s = f64_from_u64(number) / RATE_HZ;
        let truth = (carried.motion)(t_s);
        let mut input = if carried.row_time_s > 0.0 {
            world.rolling_frame(number, carried.motion, carried.row_time_s)
        } else {
            world.frame(number, &truth)
        };
        if carried.dark.contains(&number) {
            input.features.iter_mut().for_each(Vec::clear);
        }
        let to = (all.partition_point(|reading| reading.t_s <= t_s) + 1).min(all.len());
        tracker.add_imu_readings(&all[next..to]);
        next = to;
        answers.push((truth, tracker.track(&input)));
    }
    (answers, tracker)
}

/// Per-axis standard deviation of white noise with the same second differences, over frames that follow each other.
fn jitter_m(answers: &[(Pose, TrackedFrame)]) -> f64 {
    let Some((first, _)) = answers.iter().find(|(_, answer)| answer.world_from_body.is_some()) else { return f64::NAN };
    let error = |(truth, answer): &(Pose, TrackedFrame)| {
        Some(answer.world_from_body?.translation_m - first.inverse().then(truth).translation_m)
    };
    let errors: Vec<Option<DVec3>> = answers.iter().map(error).collect();
    let (mut sum, mut count) = (0.0, 0.0);
    for three in errors.windows(3).skip(30) {
        if let [Some(a), Some(b), Some(c)] = three {
            sum += (*a - 2.0 * *b + *c).length_squared();
            count += 1.0;
        }
    }
    (sum / (18.0 * count)).sqrt()
}

fn few(seed: u64) -> World {
    World { features_max: 200, ..World::usual(seed) }
}

/// A unit says the second difference of the path to 0.5 * 1.9e-3 m/s^2/sqrt(Hz) * (1/30 s)^1.5 = 6e-6 m, where a picture says it to
/// sqrt(6) * 0.7 mm: what is left is how fast the map's own errors change, measured as a fifth.
#[test]
fn a_unit_takes_the_jitter_away_and_its_biases_and_gravity_are_found() {
    let world = few(1);
    let (with, tracker) = tracked(&world, &CARRIED);
    let (without, _) = tracked(&world, &Carried { has_imu: false, ..CARRIED });
    let (score_with, score_without) = (score(&with), score(&without));
    println!("with {:.3e} {score_with:?}\nwithout {:.3e} {score_without:?}", jitter_m(&with), jitter_m(&without));
    assert_eq!((score_with.tracked, score_with.relocalised), (150, 0));
    assert!(jitter_m(&with) < 0.4 * jitter_m(&without), "{} {}", jitter_m(&with), jitter_m(&without));
    assert!(score_with.ate_m < 0.01 && score_with.innovation_px < score_without.innovation_px);
    let imu_filter = tracker.imu_filter().expect("a unit");
    let bias = imu_filter.bias().expect("a state");
    // Turns of pictures, 1 mrad each, over 5 s: some 1e-3 / 5 rad/s; gravity and the accelerometer's bias part as the body tilts.
    assert!((bias.gyroscope_rad_per_s - BIAS.gyroscope_rad_per_s).length() < 3e-3, "{bias:?}");
    let (gravity, _) = imu_filter.gravity().expect("a state");
    let truth = with[0].0.rotation.conjugate() * GRAVITY;
    assert!(gravity.angle_between(truth) < 0.015 && (gravity.length() - 9.806_65).abs() < 0.1, "{gravity} for {truth}");
}

/// 80 degrees in 0.3 s, 400 degrees a second at most, from one frame to the next and back.
fn jerked(t_s: f64) -> Pose {
    let share = ((t_s - 2.0) / 0.3).clamp(0.0, 1.0);
    let turned = 1.4 * share * share * (3.0 - 2.0 * share);
    let pose = lively(0.5 * t_s);
    Pose::new((pose.rotation * so3::exp(DVec3::Y * turned)).normalize(), pose.translation_m)
}

/// Two corners of five are found and every second one is false; a turn of 13 degrees a frame moves the picture by 70 px and more.
#[test]
fn a_turn_of_400_degrees_a_second_is_foreseen() {
    let hardship = Hardship { noise_px: 0.5, flipped: 0.1, missed: 0.6, spurious: 1.0 };
    let world = World { hardship, ..few(2) };
    let (answers, _) = tracked(&world, &Carried { motion: jerked, frames: 90, ..CARRIED });
    let score = score(&answers);
    println!("{score:?}");
    assert_eq!((score.tracked, score.relocalised), (90, 0));
    assert!(score.ate_m < 0.03, "{score:?}");
}

/// Half a second by feeling alone: 0.05 m/s^2 of what is not yet known of biases makes 6 mm of it.
#[test]
fn in_the_dark_no_pose_is_given_and_afterwards_the_position_is_known() {
    let (answers, _) = tracked(&few(3), &Carried { frames: 120, dark: 80..95, ..CARRIED });
    for (number, (_, answer)) in answers.iter().enumerate() {
        let is_dark = (80..95).contains(&number);
        assert_eq!(answer.world_from_body.is_none(), is_dark, "frame {number}");
        assert_eq!(answer.status == Status::Lost, is_dark, "frame {number}");
        assert!(answer.status != Status::Relocalised, "frame {number}");
        assert_eq!(answer.loss, is_dark.then_some(LossReason::NoPose), "frame {number}");
    }
    let score = score(&answers);
    assert!(score.ate_m < 0.015, "{score:?}");
}

/// A map of one camera has no metre, but the IMU knows it: here the length of the way against the truth's.
#[test]
fn one_camera_learns_the_metre_from_its_unit() {
    let world = World { cameras: mono_rig(), features_max: 250, ..World::usual(4) };
    let (answers, tracker) = tracked(&world, &Carried { frames: 180, ..CARRIED });
    let located: Vec<_> = answers.iter().filter_map(|(truth, a)| Some((truth, a.world_from_body?))).collect();
    let way = |of: &dyn Fn(usize) -> DVec3| {
        (30..located.len()).step_by(10).map(|k| (of(k) - of(k - 30)).length()).sum::<f64>()
    };
    let truth = way(&|k| located[k].0.translation_m);
    let map = way(&|k| located[k].1.translation_m);
    let (unit, sigma) = tracker.imu_filter().and_then(|imu_filter| imu_filter.unit_per_m()).expect("a state");
    println!("{} of {} frames, unit {unit:.4} ({sigma:.4}), truth {:.4}", located.len(), answers.len(), map / truth);
    assert!(located.len() > 120, "{}", located.len());
    // Three of its own sigmas, and what the map's unit drifts over the way.
    assert!((unit / (map / truth) - 1.0).abs() < 3.0 * sigma + 0.02, "{unit} for {}", map / truth);
}

#[test]
fn rows_of_their_own_time_move_as_the_unit_feels() {
    let world = few(5);
    let rolling = Carried { frames: 90, row_time_s: 33e-6, ..CARRIED };
    let (with, without) = (tracked(&world, &rolling).0, tracked(&world, &Carried { has_imu: false, ..rolling }).0);
    let (score_with, score_without) = (score(&with), score(&without));
    println!("with {score_with:?}\nwithout {score_without:?}");
    assert_eq!(score_with.tracked, 90);
    // The same derivation as without a unit, and no worse than that.
    assert!(score_with.ate_m < 0.015 && jitter_m(&with) < jitter_m(&without), "{score_with:?} {score_without:?}");
}

#[test]
fn readings_that_stop_or_make_no_sense_leave_the_pictures() {
    let world = few(6);
    let made = Tracker::new(world.cameras.clone(), TrackerParams::room(world.seed)).expect("a valid rig");
    let mut tracker = made.with_imu(ImuCalibration { body_from_imu: mounting(), noise: PHONE });
    let all = readings(lively, 2.0, 6);
    let mut located = 0;
    for number in 0..60 {
        let t_s = f64_from_u64(number) / RATE_HZ;
        let share =
            |reading: &&ImuMeasurement| reading.t_s <= t_s + 0.005 && reading.t_s > t_s - 0.03 && reading.t_s < 1.0;
        let mut imu_filter: Vec<ImuMeasurement> = all.iter().filter(share).copied().collect();
        imu_filter.reverse();
        imu_filter.push(ImuMeasurement { t_s: f64::NAN, ..all[0] });
        imu_filter.push(ImuMeasurement { acceleration_m_per_s2: DVec3::NAN, ..all[1] });
        tracker.add_imu_readings(&imu_filter);
        let answer = tracker.track(&world.frame(number, &lively(t_s)));
        located += u32::from(
            answer.world_from_body.is_some_and(|pose| pose.translation_m.is_finite() && pose.rotation.is_finite()),
        );
    }
    assert_eq!(located, 60);
}

/// Ten keyframes a fifth of a second apart: nine steps of nine numbers less ten velocities leave some 50 free, each with a squared error
/// of 1. Over two steps white noise makes 1.9e-3 m/s^2/sqrt(Hz) * (0.4 s)^1.5 / sqrt(12) = 0.14 mm of the middle: 3 mm are 20 sigma.
#[test]
fn steps_between_keyframes_hold_neighbours_together_and_leave_the_window_free() {
    let mut imu_filter = ImuFilter::new(ImuCalibration { body_from_imu: mounting(), noise: PHONE }, true);
    imu_filter.add_imu_readings(&readings(lively, 0.5, 7));
    let picture = nalgebra::Matrix6::from_fn(|i, j| if i == j { if i < 3 { 4e6 } else { 1e7 } } else { 0.0 });
    let all = readings(lively, 4.1, 7);
    let mut nodes: Vec<WindowKeyframe> = Vec::new();
    for number in 0..=120 {
        let t_s = f64_from_u64(number) / RATE_HZ;
        let before = all.partition_point(|reading| reading.t_s <= t_s - 1.0 / RATE_HZ);
        imu_filter.add_imu_readings(&all[before..=all.partition_point(|reading| reading.t_s <= t_s)]);
        let body_from_world = lively(t_s).inverse();
        imu_filter.advance(t_s);
        imu_filter.correct(t_s, &body_from_world, &picture);
        if number >= 66 && number % 6 == 0 {
            let keyframe = u32::try_from(number / 6).expect("small");
            if let Some(last) = nodes.last() {
                imu_filter.link((last.keyframe, f64::from(last.keyframe) * 6.0 / RATE_HZ), (keyframe, t_s));
            }
            nodes.push(WindowKeyframe { keyframe, body_from_world, free: u32::try_from(nodes.len()).ok() });
        }
    }
    assert_eq!(nodes.len(), 10);
    let prior = imu_filter.chain(&nodes).expect("all is known");
    let truth: Vec<Pose> = nodes.iter().map(|node| node.body_from_world).collect();
    let shifted = |of: std::ops::Range<usize>, by_m: f64| {
        let mut poses = truth.clone();
        poses[of].iter_mut().for_each(|pose| *pose = pose.then(&Pose::new(glam::DQuat::IDENTITY, DVec3::X * by_m)));
        prior.cost(&poses)
    };
    let cost = prior.cost(&truth);
    println!("{cost:.1}, one aside {:.1}, all aside {:.1}", shifted(4..5, 0.003), shifted(0..10, 0.1));
    assert!(cost < 110.0, "{cost}");
    assert!(shifted(4..5, 0.003) > cost + 100.0, "{}", shifted(4..5, 0.003));
    assert!((shifted(0..10, 0.1) - cost).abs() < 1.0, "{}", shifted(0..10, 0.1));
}
