//! Recorded and given trajectories: both formats, what is put right and what is refused, gaps, control poses, hard cases by name.

#![allow(clippy::unwrap_used)] // Helpers of tests fail by panicking, as tests do.

use std::fmt::Write as _;

use glam::{DQuat, DVec3};
use sensel::pose::{Pose, TimedPose, parse_tum};
use sensel::scene::motion::recording::{Recording, parse};
use sensel::scene::motion::{
    GAP_S_MAX, KNOT_S, MotionError, Spline, TURN_DEG_MAX, from_first_sample, gaps_within, without_gaps,
};
use sensel::so3;
use sensel::units::Span;

const ROOM1: &str = include_str!("../scenes/bathroom/tum_vi_room1.txt");

fn room1() -> Vec<TimedPose> {
    from_first_sample(&parse_tum(ROOM1).unwrap())
}

/// A EuRoC table of a path, from an epoch's nanoseconds on.
fn euroc(start_ns: u64, step_ns: u64, count: u64, pose: impl Fn(f64) -> Pose) -> String {
    let mut text = "#timestamp, p_RS_R_x [m], p_RS_R_y [m], p_RS_R_z [m], q_RS_w []\n".to_owned();
    for k in 0..count {
        let pose = pose(f64::from(u32::try_from(k * step_ns).unwrap()) * 1e-9);
        let (p, q) = (pose.translation_m, pose.rotation);
        let ns = start_ns + k * step_ns;
        writeln!(text, "{ns},{},{},{},{},{},{},{},0,0,0,0,0,0,0,0,0", p.x, p.y, p.z, q.w, q.x, q.y, q.z).unwrap();
    }
    text
}

fn drift(t_s: f64) -> Pose {
    Pose::new(so3::exp(DVec3::new(0.1, 0.7, -0.2) * t_s), DVec3::new(1.0, -0.5, 0.25) * t_s)
}

#[test]
fn formats_are_told_apart_by_content() {
    let pose = "1.0,2.0,3.0,0.0,0.0,0.0,1.0";
    let p = DVec3::new(1.0, 2.0, 3.0);
    let turned = DQuat::from_xyzw(0.0, 0.0, 1.0, 0.0);
    let cases = [
        // Eight columns: TUM's seconds, unless the header or the length of the numbers says nanoseconds.
        (format!("5,{pose}\n"), DQuat::IDENTITY),
        (format!("5.0 {}\n", pose.replace(',', " ")), DQuat::IDENTITY),
        (format!("#timestamp [ns], p, q\n5,{pose}\n"), turned),
        (format!("1520530308189680000,{pose}\n"), turned),
        (format!("\n# a comment\n  1403636580838555648, {}\r\n", pose.replace(',', " , ")), turned),
        (format!("5,{pose},0,0,0\n"), turned),
    ];
    let mut tried = 0;
    for (text, rotation) in cases {
        let Recording { samples, notes } = parse(&text).unwrap();
        assert_eq!(samples, [TimedPose { t_s: 0.0, world_from_body: Pose::new(rotation, p) }], "{text}");
        assert!(notes.is_empty());
        tried += 1;
    }
    assert_eq!(tried, 6);
    assert!(parse("").unwrap().samples.is_empty() && parse("# only words\n").unwrap().samples.is_empty());
}

#[test]
fn an_epoch_of_nanoseconds_keeps_every_one_of_them() {
    // 1.5e18 ns: a double counts them in steps of 256.
    let text = euroc(1_520_530_308_189_680_001, 8_333_333, 100, drift);
    let samples = parse(&text).unwrap().samples;
    for (k, sample) in (0_u32..).zip(&samples) {
        assert_eq!(sample.t_s, f64::from(k * 8_333_333) / 1e9);
    }
    // The same path from 0 on is the same to the last bit, and so is its spline.
    let early = parse(&euroc(0, 8_333_333, 100, drift)).unwrap().samples;
    assert_eq!(samples, early);
    assert_eq!(Spline::fit(&samples, KNOT_S), Spline::fit(&early, KNOT_S));
}

#[test]
fn an_epoch_of_seconds_costs_a_quarter_of_a_microsecond() {
    let text = |epoch: &str| {
        let mut text = String::new();
        for k in 0..300_u32 {
            let pose = drift(f64::from(k) * 0.01);
            let (p, q) = (pose.translation_m, pose.rotation);
            let (seconds, hundredths) = (k / 100, k % 100);
            writeln!(text, "{epoch}{seconds}.{hundredths:02} {} {} {} {} {} {} {}", p.x, p.y, p.z, q.x, q.y, q.z, q.w)
                .unwrap();
        }
        text
    };
    let [late, early] = ["152053030", ""].map(|epoch| parse(&text(epoch)).unwrap().samples);
    let [late, early] = [late, early].map(|samples| Spline::fit(&samples, KNOT_S).unwrap());
    let mut tried = 0;
    for k in 0..298_u32 {
        let t_s = 0.01 * f64::from(k);
        let [a, b] = [&late, &early].map(|spline| spline.state(t_s).unwrap());
        // Times are rounded to 2^-22 s = 2.4e-7; at 1.2 m/s half of that, twice, is 3e-7 m, at most.
        assert!((a.world_from_body.translation_m - b.world_from_body.translation_m).length() < 3e-7, "{t_s}");
        assert!(a.world_from_body.inverse().then(&b.world_from_body).angle_rad() < 3e-7, "{t_s}");
        // Bends of the spline turn 3e-7 m into accelerations of some 6 e / knot^2 = 7e-4, less by averaging.
        assert!((a.acceleration_m_per_s2 - b.acceleration_m_per_s2).length() < 7e-4, "{t_s}");
        tried += 1;
    }
    assert_eq!(tried, 298);
}

#[test]
fn real_files_blemishes_are_put_right_and_noted() {
    let four_decimals =
        "1.00 0 0 0 0.5774 0.5774 0.5774 0.0000\n1.00 9 0 0 0 0 0 1\n1.01 0 0 0 0.5774 0.5773 0.5774 0.0001\n";
    let Recording { samples, notes } = parse(four_decimals).unwrap();
    assert_eq!(samples.len(), 2);
    assert!(samples.iter().all(|sample| (sample.world_from_body.rotation.length() - 1.0).abs() < 1e-15));
    assert_eq!(notes.len(), 2, "{notes:?}");
    assert!(notes[0].contains("1 line(s) repeat a time stamp"), "{notes:?}");
    // Three times 0.5774^2 is 1.00017: half of it.
    assert!(notes[1].contains("8.6e-5 off unit length"), "{notes:?}");
    let table = "#timestamp [ns]\n5,0,0,0,1.0005,0,0,0,0\n5,0,0,0,1,0,0,0,0\n7,0,0,0,1,0,0,0,0\n";
    let Recording { samples, notes } = parse(table).unwrap();
    assert!(samples.len() == 2 && notes.len() == 2 && notes[1].contains("5.0e-4"), "{notes:?}");
    assert!(parse(ROOM1).unwrap().notes.is_empty(), "six decimals are nothing of note");
}

#[test]
fn what_cannot_be_a_trajectory_is_refused_by_line_with_what_would_do() {
    let mut tried = 0;
    for (text, words) in [
        ("0 0 0 0 0 0 0 1\n1 0 0 0 0 0 0 0.5\n", "line 2: a quaternion of norm 0.5000; use 1 to within 0.005"),
        ("0 0 0 0 0 0 0 0\n", "line 1: a quaternion of norm 0.0000"),
        ("1 0 0 0 0 0 0 1\n\n0.5 0 0 0 0 0 0 1\n", "line 3: time goes back from 1 to 0.5; use rising times"),
        ("0 nan 0 0 0 0 0 1\n", "line 1: 'nan' is not finite"),
        ("0 0 0 0 0 0 inf 1\n", "line 1: 'inf' is not finite"),
        ("0 0 0 0 0 0 0 1e999\n", "line 1: '1e999' is not finite"),
        ("0 0 0 one 0 0 0 1\n", "line 1: 'one' is not a number"),
        ("0 0 0 0\n", "line 1: 4 fields; a pose is t tx ty tz qx qy qz qw"),
        ("#timestamp [ns]\n9,0,0,0,1,0,0,0\n8,0,0,0,1,0,0,0\n", "line 3: time goes back from 9 to 8; use rising times"),
        ("9,0,0,0,0.9,0,0,0,1\n", "line 1: a quaternion of norm 0.9000; use 1 to within 0.005"),
        ("9,0,NaN,0,1,0,0,0,1\n", "line 1: 'NaN' is no finite number"),
        ("9,0,0,0,1,0,0,0,1\n9.5,0,0,0,1,0,0,0,1\n", "line 2: '9.5' is no time stamp in whole nanoseconds"),
        ("9,0,0,0,1,0,0,0,1\n10,0,0\n", "line 2: 3 fields; a pose is timestamp, p x y z, q w x y z"),
        ("99999999999999999999,0,0,0,1,0,0,0,1\n", "is no time stamp in whole nanoseconds"),
    ] {
        let error = parse(text).unwrap_err().to_string();
        assert!(error.contains(words), "{text}: {error}");
        tried += 1;
    }
    assert_eq!(tried, 14);
}

/// The mocap without what lies within a gap that starts at `at_s`.
fn with_gap(at_s: f64, length_s: f64) -> Vec<TimedPose> {
    let mut samples = room1();
    samples.retain(|sample| !(sample.t_s > at_s && sample.t_s < at_s + length_s));
    samples
}

#[test]
fn gaps_are_bridged_on_request_only_and_up_to_their_length() {
    let asked = Span { start_s: 1.0, end_s: 15.0 };
    for length_s in [0.30, 0.87] {
        let samples = with_gap(6.0, length_s);
        let gap = without_gaps(&samples, asked, GAP_S_MAX).unwrap_err();
        assert!(gap.to_string().contains("raise motion.bridge_gaps_s"), "{gap}");
        assert!(without_gaps(&samples, asked, length_s - 0.05).is_err(), "too short a bridge");
        assert!(matches!(Spline::fit(&samples, KNOT_S), Err(MotionError::Gap { .. })));
        assert_eq!(without_gaps(&samples, asked, 1.0).unwrap(), samples);
        let found = gaps_within(&samples, asked);
        // The pause starts at the last sample before it and ends at the first after it, one of 120 Hz each way.
        assert!(
            found.len() == 1 && (found[0].0 - 6.0).abs() < 9e-3 && (found[0].1 - length_s).abs() < 2e-2,
            "{found:?}"
        );
        assert!(gaps_within(&samples, Span { start_s: 0.0, end_s: 5.9 }).is_empty());
    }
    let whole = room1();
    assert_eq!(Spline::fit_over_gaps(&whole, KNOT_S, 1.0), Spline::fit(&whole, KNOT_S), "no gap, no difference");
}

#[test]
fn a_bridge_of_real_motion_stays_near_it_and_bends_no_more() {
    let truth = Spline::fit(&room1(), KNOT_S).unwrap();
    let mut tried = 0;
    for length_s in [0.30, 0.87] {
        let (mut worst_m, mut worst_deg) = (0.0_f64, 0.0_f64);
        let (mut bend2, mut true_bend2, mut turn2, mut true_turn2) = (0.0, 0.0, 0.0, 0.0);
        for start in 1..14_u32 {
            let at_s = f64::from(start);
            let bridged = Spline::fit_over_gaps(&with_gap(at_s, length_s), KNOT_S, 1.0).unwrap();
            for k in 0..=100_u32 {
                let t_s = at_s - 0.1 + f64::from(k) * 0.01 * (length_s + 0.2);
                let [found, expected] = [&bridged, &truth].map(|spline| spline.state(t_s).unwrap());
                let apart = found.world_from_body.inverse().then(&expected.world_from_body);
                worst_m = worst_m.max(apart.translation_m.length());
                worst_deg = worst_deg.max(apart.angle_rad().to_degrees());
                bend2 += found.acceleration_m_per_s2.length_squared();
                true_bend2 += expected.acceleration_m_per_s2.length_squared();
                turn2 += found.angular_acceleration_rad_per_s2.length_squared();
                true_turn2 += expected.angular_acceleration_rad_per_s2.length_squared();
            }
            tried += 1;
        }
        let [bends, turns] = [bend2 / true_bend2, turn2 / true_turn2];
        println!(
            "gaps of {length_s} s: up to {:.1} mm and {worst_deg:.2} deg; {bends:.2} and {turns:.2} of the bend",
            1e3 * worst_m
        );
        // Least acceleration: about as much of it as the hand had over a short gap, whose end slopes carry the samples' noise (0.1 mm
        // and 1 mrad over a knot are 40 mm/s^2 and 0.4 rad/s^2 a sample), and less over a long one.
        assert!(bends < 1.4 && turns < 1.4, "{bends} {turns}");
        assert!(length_s < 0.5 || bends < 1.0 && turns < 1.0, "{bends} {turns}");
        // What a cubic between the ends misses: T^4 / 384 of the fourth derivative. A hand's swing of 50 mm and 8 degrees at 1 Hz
        // (78 m/s^4, 218 rad/s^4) and its tremble of 3 mm and 1.5 degrees at 3 Hz (379 m/s^4, 3305 rad/s^4): 10 mm and 4.3 degrees
        // for 0.30 s; for 0.87 s 117 mm and 19 degrees, and all of the tremble.
        let [most_m, most_deg] = if length_s < 0.5 { [0.010, 4.3] } else { [0.120, 20.5] };
        assert!(worst_m < most_m && worst_deg < most_deg, "{worst_m} {worst_deg}");
    }
    assert_eq!(tried, 26);
}

#[test]
fn a_bridge_continues_steady_motion_exactly() {
    // Constant velocity and constant turning have no acceleration: the least path is the true one, over half a turn and more.
    let steady = |t_s: f64| Pose::new(so3::exp(DVec3::Y * (2.8 * t_s)), DVec3::new(1.5, -0.2, 0.3) * t_s);
    let mut samples: Vec<TimedPose> = (0..=500_u32)
        .map(|k| TimedPose { t_s: 0.01 * f64::from(k), world_from_body: steady(0.01 * f64::from(k)) })
        .collect();
    samples.retain(|sample| !(sample.t_s > 2.0 && sample.t_s < 2.9));
    let spline = Spline::fit_over_gaps(&samples, KNOT_S, 1.0).unwrap();
    for k in 0..=500_u32 {
        let t_s = 0.01 * f64::from(k);
        let apart = spline.world_from_body(t_s).unwrap().inverse().then(&steady(t_s));
        // The solver's roundings, raised by the stiffness' ratio of 1e6: 1e-10.
        assert!(apart.translation_m.length() < 1e-9 && apart.angle_rad() < 1e-9, "{t_s}: {apart:?}");
    }
}

#[test]
fn the_sign_of_a_quaternion_says_nothing_and_half_turns_are_no_edge() {
    // An orientation that swings through half a turn: w changes sign, and the file's writer flips signs at will.
    let swing = |t_s: f64| so3::exp(DVec3::new(0.6, 0.0, 0.8) * (core::f64::consts::PI + 0.4 * libm::sin(3.0 * t_s)));
    let samples = |flip: bool| -> Vec<TimedPose> {
        (0..=300_u32)
            .map(|k| {
                let t_s = 0.01 * f64::from(k);
                let sign = if flip && k % 3 == 1 { -1.0 } else { 1.0 };
                TimedPose { t_s, world_from_body: Pose::new(swing(t_s) * sign, DVec3::ZERO) }
            })
            .collect()
    };
    let [plain, flipped] = [false, true].map(|flip| Spline::fit(&samples(flip), KNOT_S).unwrap());
    for k in 10..290_u32 {
        let t_s = 0.01 * f64::from(k) + 0.003;
        let [a, b] = [&plain, &flipped].map(|spline| spline.state(t_s).unwrap());
        assert!(a.world_from_body.inverse().then(&b.world_from_body).angle_rad() < 1e-12, "{t_s}");
        // Rates of 1.2 cos(3 t); the fit's h^3 x'''' / 24 = 0.4 * 81 * 1.25e-4 / 24 = 1.7e-4, doubled for least squares.
        let rate = DVec3::new(0.6, 0.0, 0.8) * (1.2 * libm::cos(3.0 * t_s));
        assert!((a.angular_velocity_rad_per_s - rate).length() < 3.4e-4, "{t_s}");
        // Bends: h^2 x'''' / 12 = 7e-3 rad/s^2, doubled.
        let bend = DVec3::new(0.6, 0.0, 0.8) * (-3.6 * libm::sin(3.0 * t_s));
        assert!((a.angular_acceleration_rad_per_s2 - bend).length() < 1.4e-2, "{t_s}");
    }
}

#[test]
fn control_poses_are_met_at_the_ends_and_bound_the_rest() {
    let corners_m = [0.0, 1.0, 3.0, 2.5, -1.0, 0.5].map(|x| DVec3::new(x, 1.0 - x * 0.5, x * x));
    let poses: Vec<Pose> = (0_u32..)
        .zip(corners_m)
        .map(|(k, position_m)| Pose::new(so3::exp(DVec3::new(0.0, 1.2, 0.3) * f64::from(k)), position_m))
        .collect();
    let spline = Spline::on_control_poses(0.0, 0.5, &poses).unwrap();
    assert_eq!((spline.span().start_s, spline.span().end_s), (0.0, 2.5));
    for (t_s, pose) in [(0.0, &poses[0]), (2.5, &poses[5])] {
        let apart = spline.world_from_body(t_s).unwrap().inverse().then(pose);
        assert!(apart.translation_m.length() < 1e-14 && apart.angle_rad() < 1e-14, "{t_s}");
        assert!(spline.acceleration_m_per_s2(t_s).unwrap().length() < 1e-12, "straight at the ends");
    }
    for k in 0..=250_u32 {
        let state = spline.state(0.01 * f64::from(k)).unwrap();
        let x_m = state.world_from_body.translation_m.x;
        assert!((-1.0..=3.0).contains(&x_m), "{x_m}");
        // Even turns of 1.24 rad every half second are kept.
        let rate = DVec3::new(0.0, 2.4, 0.6);
        assert!((state.angular_velocity_rad_per_s - rate).length() < 1e-12);
        assert!(state.angular_acceleration_rad_per_s2.length() < 1e-11);
    }
    let refused = |poses: &[Pose]| Spline::on_control_poses(0.0, 0.5, poses).unwrap_err();
    assert_eq!(refused(&poses[..3]), MotionError::TooFewSamples { count: 3 });
    for (turn_deg, is_refused) in [(TURN_DEG_MAX - 0.01, false), (TURN_DEG_MAX + 0.01, true), (180.0, true)] {
        let turn = |k: u32| Pose::new(so3::exp(DVec3::Y * (f64::from(k) * f64::to_radians(turn_deg))), DVec3::ZERO);
        let made = Spline::on_control_poses(0.0, 0.5, &[0, 1, 2, 3].map(turn));
        assert_eq!(matches!(made, Err(MotionError::HalfTurn { .. })), is_refused, "{turn_deg}");
        if let Ok(spline) = made {
            let rate = spline.angular_velocity_rad_per_s(0.7).unwrap();
            assert!((rate - DVec3::Y * (2.0 * turn_deg.to_radians())).length() < 1e-11, "near half a turn: {rate}");
        }
    }
}
