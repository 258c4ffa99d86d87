//! Hard cases of the figures: undetermined alignments, offsets that swallow digits, moments of nearly constant values.

use glam::{DQuat, DVec3};
use sensel::num::{f64_from_usize, greater};
use sensel::pose::{Pose, TimedPose};
use sensel::report::align::{AlignmentScale, umeyama};
use sensel::report::spread::interval_of_rms;
use sensel::report::trajectory_figures;

use super::double_double::{dd, dot, minus, vector};
use super::table::{Chance, Stage};

const ROUND: f64 = 0.5 * f64::EPSILON;

pub fn run(stage: &mut Stage) {
    alignments(stage);
    identical(stage);
    still(stage);
    equal_errors(stage);
}

/// Errors that are all equal have an interval without width. Running sums of n squares round n times by 2^-53 of n squares at most, a
/// block of them is the difference of two, and the root halves: n^2 2^-53 / block, relative. Squares of 0 stay 0.
fn equal_errors(stage: &mut Stage) {
    let sides = &["1e-12 to 1e12", "zero"];
    let case = stage.case("bootstrap interval of equal errors", "the error itself", "relative", sides);
    let mut chance = Chance::new(1104);
    for number in 0..20_usize {
        let (count, block) = (300 + 10 * number, 30);
        let square = if number % 4 == 0 { 0.0 } else { chance.decade(1e-24, 1e24) };
        let interval = interval_of_rms(&vec![square; count], block, 3).unwrap();
        let bound = ROUND * f64_from_usize(count * count / block);
        for end in interval {
            let exact = dd(square).sqrt();
            let error = if square == 0.0 { end.abs() } else { exact.miss(end) / exact.high };
            case.see(usize::from(square == 0.0), error, bound, || format!("{count} squares of {square}: {interval:?}"));
        }
    }
}

/// Points along a line of spread s = 1.16 m with a wiggle w across it. The covariance rounds by 3 (n + 4) 2^-53 s^2 (nine entries of n
/// terms), and the rotation about the line stands in its singular values of w^2 / 2: an angle of up to twice that over w^2 / 2. That is
/// what alignment by a covariance costs, evo's as well; it moves a point by no more than the angle times w, so what is left of the
/// distances, twice 3 (n + 4) 2^-53 s^2 / (w / 2) and the coordinates' own roundings (64 * 2^-53 of 8 m), is what a figure sees. Two
/// points, one line and equal points have no alignment. A proper rotation's determinant is 1 to 40 roundings.
fn alignments(stage: &mut Stage) {
    let sides =
        &["wiggle of 1e-1 to 1e-6 m", "on a line", "two points", "equal points", "mirrored", "distances left, m"];
    let case =
        stage.case("alignment of trajectories that are almost a line", "known rigid motion", "rad or yes/no", sides);
    let mut chance = Chance::new(1101);
    for number in 0..500_usize {
        let (along, other) = (chance.direction(), chance.direction());
        let across = along.cross(other).normalize();
        let up = along.cross(across);
        let wiggle_m = match number % 5 {
            1 => 0.0,
            _ => chance.decade(1e-6, 1e-1),
        };
        let start = 3.0 * chance.direction();
        let count = if number % 5 == 2 { 2 } else { 40 };
        let estimate: Vec<DVec3> = (0..count)
            .map(|k| {
                let t = f64_from_usize(k);
                let offset = wiggle_m * (libm::sin(1.7 * t) * across + libm::cos(2.9 * t) * up);
                if number % 5 == 3 { start } else { start + 0.1 * t * along + offset }
            })
            .collect();
        let motion = Pose::new(sensel::so3::exp(chance.direction() * chance.between(0.0, 3.0)), chance.direction());
        let truth: Vec<DVec3> = estimate.iter().map(|&point| motion.point(point)).collect();
        let found = umeyama(&truth, &estimate, AlignmentScale::Kept);
        match number % 5 {
            side @ 1..=3 => case.hold(side, found.is_err(), || format!("{found:?}")),
            side => {
                // Mirrored points have a best rotation as well: a proper one, never the mirror.
                let mirrored: Vec<DVec3> = truth.iter().map(|p| DVec3::new(-p.x, p.y, p.z)).collect();
                let flipped = umeyama(&mirrored, &estimate, AlignmentScale::Kept).unwrap();
                let rows = flipped.rotation.map(DVec3::from_array);
                let error = (rows[0].dot(rows[1].cross(rows[2])) - 1.0).abs();
                case.see(4, error, 40.0 * ROUND, || format!("determinant {}", 1.0 - error));
                let found = found.unwrap();
                let exact = glam::DMat3::from_quat(motion.rotation);
                let apart = (0..3).flat_map(|i| (0..3).map(move |j| (i, j)));
                let error =
                    apart.fold(0.0, |most, (i, j)| greater(most, (found.rotation[i][j] - exact.col(j)[i]).abs()));
                let rounding_m2 = 2.0 * 3.0 * 44.0 * ROUND * 1.34;
                let bound = 2.0 * rounding_m2 / (wiggle_m * wiggle_m);
                let left = truth.iter().zip(&estimate).map(|(&y, &x)| (found.point(x) - y).length());
                let left_m = left.fold(0.0, greater);
                let left_bound_m = 2.0 * rounding_m2 / wiggle_m + 64.0 * ROUND * 8.0;
                case.see(5, left_m, left_bound_m, || format!("wiggle {wiggle_m} m"));
                case.see(if side == 4 { 0 } else { side }, error, bound, || format!("wiggle {wiggle_m} m"));
            }
        }
    }
}

fn timed(positions_m: &[DVec3]) -> Vec<TimedPose> {
    let pose = |(k, &position_m): (usize, &DVec3)| TimedPose {
        t_s: f64_from_usize(k) / 32.0,
        world_from_body: Pose::new(DQuat::IDENTITY, position_m),
    };
    positions_m.iter().enumerate().map(pose).collect()
}

/// An estimate that is the truth has no error but the rotation's rounding times the distance from the origin (9 entries of some 8
/// roundings, and two means of n terms): (72 + 2 n) * 2^-53 of the offset. Unaligned it has none at all.
fn identical(stage: &mut Stage) {
    let sides = &["near the origin", "1e3 to 1e8 m off", "unaligned"];
    let case = stage.case("errors of an estimate that is the truth", "zero", "m", sides);
    let mut chance = Chance::new(1102);
    for number in 0..60_usize {
        let offset_m = if number % 2 == 0 { 0.0 } else { chance.decade(1e3, 1e8) };
        let start = offset_m * chance.direction();
        let path: Vec<DVec3> = (0..200)
            .map(|k| {
                let t = f64_from_usize(k) / 32.0;
                start + DVec3::new(libm::cos(t), libm::sin(2.0 * t), 0.2 * t)
            })
            .collect();
        let figures = trajectory_figures(&timed(&path), &timed(&path)).unwrap();
        let aligned = figures.se3.unwrap();
        let bound = (72.0 + 400.0) * ROUND * (offset_m + 2.0);
        case.see(usize::from(number % 2 == 1), aligned.ate_m, bound, || format!("offset {offset_m} m"));
        case.see(2, figures.unaligned.ate_m, 0.0, || format!("offset {offset_m} m"));
    }
}

/// A rig at rest 1e8 m away, shaken by a millimetre (coordinates there have steps of 1.5e-8 m; the reference sees those same
/// coordinates). The spread is a root mean square about the mean. Means of n terms round by n * 2^-53 of the offset at most, in each of
/// three axes and both trajectories, and adds to the spread in quadrature; differences about it round once.
fn still(stage: &mut Stage) {
    let sides = &["offset of 1 m", "offset of 1e8 m"];
    let case = stage.case("spread of a rig at rest far from the origin", "two passes in double-double", "m", sides);
    let mut chance = Chance::new(1103);
    for number in 0..40_usize {
        let offset_m = [1.0, 1e8][number % 2];
        let start = offset_m * chance.direction();
        let shaken: Vec<DVec3> = (0..1000).map(|_| start + 1e-3 * chance.direction()).collect();
        let figures = trajectory_figures(&timed(&vec![start; 1000]), &timed(&shaken)).unwrap();
        let count = dd(1000.0);
        let mut mean = vector([0.0; 3]);
        for p in &shaken {
            let p = vector(p.to_array());
            mean = [0, 1, 2].map(|k| mean[k] + p[k] / count);
        }
        let mut square = dd(0.0);
        for p in &shaken {
            let off = minus(vector(p.to_array()), mean);
            square = square + dot(off, off) / count;
        }
        let exact_m = square.sqrt();
        let shift_m = 1000.0 * ROUND * offset_m * 2.0 * 3.0_f64.sqrt();
        let spread_m = exact_m.f64();
        let bound = (spread_m * spread_m + shift_m * shift_m).sqrt() - spread_m
            + 2.0 * ROUND * offset_m
            + 1000.0 * ROUND * spread_m;
        let found = figures.still.spread_m;
        case.see(number % 2, exact_m.miss(found), bound, || format!("offset {offset_m} m: {found} of {exact_m:?}"));
    }
}
