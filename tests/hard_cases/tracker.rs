//! Hard cases of the tracker's algebra with known answers: flat triangles, close roots, nearly singular systems, far points.

use glam::{DQuat, DVec3};
use sensel::num::{f64_from_usize, greater, lesser};
use sensel::pose::Pose;
use sensel::so3;
use sensel::tracker::dense::solve_cholesky;
use sensel::tracker::initial::{BearingPair, triangulated};
use sensel::tracker::p3p;
use sensel::tracker::polynomial::{positive_roots, real_roots};

use super::double_double::{cross, dd, dot, minus, times, vector, whole};
use super::table::{Chance, Stage};

const ROUND: f64 = 0.5 * f64::EPSILON;

pub fn run(stage: &mut Stage) {
    systems(stage);
    roots(stage);
    flat_triangles(stage);
    far_points(stage);
}

/// Least common multiple of 1 .. 2 n - 1: makes a Hilbert matrix whole.
fn multiple(n: i128) -> i128 {
    fn gcd(a: i128, b: i128) -> i128 {
        if b == 0 { a } else { gcd(b, a % b) }
    }
    (1..2 * n).fold(1, |all, k| all / gcd(all, k) * k)
}

fn f64_of(value: i128) -> f64 {
    whole(value).f64()
}

/// Hilbert's matrix times the multiple, and whole solutions: right-hand sides are whole as well and below 2^53, so nothing is rounded
/// before the solver. Condition numbers are known (Todd 1961). Cholesky's error is below 4 n^2 * 2^-53 of the condition (Higham, "Accuracy
/// and Stability of Numerical Algorithms", theorem 10.4: n (3 n + 1) and a little). A last unknown that is a mean w of two others, or one
/// of them, leaves a pivot of 0; roundings leave (n + 1) 2^-53 (1 + sum |w|)^2 of what was there, at most 4e-15 for n = 8 and a sum of 1,
/// under the 1e-14 that refuse. A Hilbert matrix whose condition is beyond f64 must be refused as well.
fn systems(stage: &mut Stage) {
    const CONDITIONS: [f64; 9] = [1.0, 19.3, 525.0, 1.56e4, 4.77e5, 1.5e7, 4.76e8, 1.53e10, 4.94e11];
    let sides = &["condition up to 5e11", "singular", "condition beyond 1e17"];
    let case = stage.case("Cholesky of nearly singular systems", "whole solutions", "relative", sides);
    let mut chance = Chance::new(1001);
    for (n, condition) in (1_usize..).zip(CONDITIONS) {
        for _ in 0..20 {
            let scale = multiple(i128::try_from(n).unwrap());
            let entry = |i: usize, j: usize| scale / i128::try_from(i + j + 1).unwrap();
            let truth: Vec<i128> = (0..n).map(|_| i128::from(chance.below(17)) - 8).collect();
            let mut right: Vec<f64> = (0..n).map(|i| f64_of((0..n).map(|j| entry(i, j) * truth[j]).sum())).collect();
            let mut matrix: Vec<f64> = (0..n * n).map(|k| f64_of(entry(k / n, k % n))).collect();
            let solved = solve_cholesky(&mut matrix, &mut right);
            case.hold(0, solved, || format!("n {n} is refused"));
            let size = truth.iter().fold(1.0, |most, &x| greater(most, f64_of(x).abs()));
            let error =
                truth.iter().zip(&right).fold(0.0, |most, (&x, found)| greater(most, (found - f64_of(x)).abs()));
            let bound = 4.0 * f64_from_usize(n * n) * ROUND * condition * f64_from_usize(n).sqrt();
            case.see(0, error / size, bound, || format!("n {n}: {right:?} for {truth:?}"));
        }
    }
    for number in 0..200_usize {
        let n = 2 + number % 7;
        let mut pick = || usize::try_from(chance.below(u64::try_from(n - 1).unwrap())).unwrap();
        let (one, other) = (pick(), pick());
        let rows: Vec<Vec<i64>> = (0..n - 1)
            .map(|row| {
                let noise = |chance: &mut Chance| 2 * (i64::try_from(chance.below(3)).unwrap() - 1);
                let mut values: Vec<i64> = (0..n - 1).map(|k| if k == row { 20 } else { noise(&mut chance) }).collect();
                values.push((values[one] + values[other]) / 2);
                values
            })
            .collect();
        let at = |i: usize, j: usize| rows.iter().map(|row| row[i] * row[j]).sum::<i64>();
        let mut matrix: Vec<f64> = (0..n * n).map(|k| sensel::num::f64_from_i64(at(k / n, k % n))).collect();
        let mut right = vec![1.0; n];
        case.hold(1, !solve_cholesky(&mut matrix, &mut right), || format!("{rows:?} is solved"));
    }
    let n = 14;
    let mut matrix: Vec<f64> = (0..n * n).map(|k| 1.0 / f64_from_usize(k / n + k % n + 1)).collect();
    case.hold(2, !solve_cholesky(&mut matrix, &mut vec![1.0; n]), || "Hilbert's of 14 is solved".to_owned());
}

/// Products of known factors in double-double, rounded to f64 coefficients: the polynomial that is asked about. A root is good when the
/// polynomial there is within its own rounding: 4 n + 4 roundings of the sum of its terms' sizes (2 n of Horner's rule, the rest of the
/// last step, an ulp of the root), evaluated in double-double. Separated roots must all be found.
fn roots(stage: &mut Stage) {
    let sides = &["separated", "1e-3 to 1e-7 apart", "1e-9 and closer", "positive roots of quartics"];
    let case =
        stage.case("real roots of close and separated factors", "polynomial in double-double", "of its terms", sides);
    let mut chance = Chance::new(1003);
    for number in 0..3000_usize {
        let side = number % 4;
        let mut expected: Vec<f64> = (0..4).map(|k| chance.between(0.1, 1.0) * [1.0, 2.0, 8.0, 30.0][k]).collect();
        match side {
            1 => expected[1] = expected[0] * (1.0 + chance.decade(1e-7, 1e-3)),
            2 => expected[1] = expected[0] * (1.0 + chance.decade(1e-16, 1e-9)),
            _ => {}
        }
        if side != 3 {
            expected[3] = -expected[3];
        }
        let mut product = vec![dd(1.0)];
        for &root in &expected {
            let mut next = vec![dd(0.0); product.len() + 1];
            for (k, &c) in product.iter().enumerate() {
                next[k] = next[k] - c * dd(root);
                next[k + 1] = next[k + 1] + c;
            }
            product = next;
        }
        let coefficients: Vec<f64> = product.iter().map(|c| c.f64()).collect();
        let found = if side == 3 {
            positive_roots([0, 1, 2, 3, 4].map(|k| coefficients[k]))
        } else {
            real_roots(&coefficients)
        };
        expected.sort_by(f64::total_cmp);
        let gap = expected.windows(2).map(|two| (two[1] - two[0]) / two[1].abs()).fold(1.0, lesser);
        if gap > 0.01 {
            case.hold(side, found.len() == 4, || format!("{expected:?}: {found:?}"));
        }
        for &root in &found {
            let x = dd(root);
            let value = coefficients.iter().rev().fold(dd(0.0), |sum, &c| sum * x + dd(c)).abs().f64();
            let size = coefficients.iter().rev().fold(0.0, |sum, c| sum * root.abs() + c.abs());
            case.see(side, value / size, 20.0 * ROUND, || format!("{expected:?}: {root}"));
        }
    }
}

/// Flatter than 1 % (doubled area over the longest side's square) a triangle is refused. Above, the cosine laws are polished to a miss of
/// at most 1e-6 of the longest side's square, so ranges are off by up to that over the flatness (the laws' least singular value, in
/// ranges of about one side), and bearings by as much over the range.
fn flat_triangles(stage: &mut Stage) {
    let sides = &["1 to 10 % flat", "1 % and flatter", "plain"];
    let case = stage.case("pose of three points nearly on a line", "bearings that were asked for", "rad", sides);
    let mut chance = Chance::new(1004);
    let mut solved = 0;
    for number in 0..1500_usize {
        let side = number % 3;
        let flatness = [chance.between(0.0101, 0.1), chance.decade(1e-12, 0.0099), chance.between(0.2, 0.8)][side];
        let (along, other) = (chance.direction(), chance.direction());
        let across = along.cross(other).normalize();
        let middle = DVec3::new(0.0, 0.0, 3.0) + chance.direction();
        let share = chance.between(0.3, 0.7);
        let in_camera =
            [middle - 0.5 * along, middle + 0.5 * along, middle + (share - 0.5) * along + flatness * across];
        let truth = Pose::new(so3::exp(chance.direction() * chance.between(0.0, 3.1)), 5.0 * chance.direction());
        let points_m = in_camera.map(|point| truth.inverse().point(point));
        let poses = p3p::solve(&in_camera.map(DVec3::normalize), &points_m);
        if side == 1 {
            case.hold(1, poses.is_empty(), || format!("flatness {flatness}"));
            continue;
        }
        for pose in &poses {
            let error = points_m.iter().zip(&in_camera).fold(0.0, |most, (&point_m, expected)| {
                let found = pose.point(point_m);
                greater(most, libm::atan2(found.cross(*expected).length(), found.dot(*expected)))
            });
            let nearest = in_camera.iter().map(|point| point.length()).fold(f64::INFINITY, lesser);
            solved += 1;
            case.see(side, error, 1e-6 / (flatness * nearest), || format!("flatness {flatness}: {pose:?}"));
        }
    }
    assert!(solved > 500, "only {solved} poses were found");
}

/// Two rays of rounded bearings at depths of 1 to 1e9 baselines, against their own nearest point along the first ray in double-double.
/// The normal of both bearings is as short as the parallax, so its direction and length round by 4 * 2^-53 over the parallax, twice in
/// the quotient, and the turn of the bearing by as much: 16 * 2^-53 over the parallax, relative. Beyond infinity and behind, nothing.
fn far_points(stage: &mut Stage) {
    let sides = &["up to 1e3 baselines", "up to 1e9", "behind", "parallel"];
    let case = stage.case("triangulation far out and behind", "nearest point in double-double", "relative", sides);
    let mut chance = Chance::new(1005);
    for number in 0..2000_usize {
        let side = number % 4;
        let depth = if side == 1 { chance.decade(1e3, 1e9) } else { chance.decade(1.5, 1e3) };
        let point = depth * DVec3::new(chance.between(-0.5, 0.5), chance.between(-0.5, 0.5), 1.0).normalize();
        let turn = so3::exp(chance.direction() * chance.between(0.0, 0.5));
        let motion = Pose::new(turn, DVec3::new(chance.between(0.5, 1.0), chance.between(-0.5, 0.5), 0.1).normalize());
        let sign = if side == 2 { -1.0 } else { 1.0 };
        let pair = if side == 3 {
            BearingPair { first: point.normalize(), second: turn * point.normalize() }
        } else {
            BearingPair { first: sign * point.normalize(), second: sign * motion.point(point).normalize() }
        };
        let found = triangulated(&motion, &pair);
        if side >= 2 {
            // Of parallel rays roundings decide; what they leave must be a number, and far.
            let holds = found.is_none_or(|point| side == 3 && point.is_finite() && point.length() > 1e9);
            case.hold(side, holds, || format!("{pair:?}: {found:?}"));
            continue;
        }
        let Some(found) = found else {
            case.hold(side, false, || format!("depth {depth}: nothing"));
            continue;
        };
        // The rotation by the quaternion, exactly: v + 2 w (q x v) + 2 q x (q x v).
        let q: DQuat = motion.rotation;
        let (axis, first) = (vector([q.x, q.y, q.z]), vector(pair.first.to_array()));
        let once = cross(axis, first);
        let twice = cross(axis, once);
        let turned = [0, 1, 2].map(|k| first[k] + dd(2.0) * (dd(q.w) * once[k] + twice[k]));
        let (second, t) = (vector(pair.second.to_array()), vector(motion.translation_m.to_array()));
        let normal = cross(second, turned);
        let range = -(dot(cross(second, t), normal) / dot(normal, normal));
        let exact = times(first, range);
        let error = minus(vector(found.to_array()), exact);
        let error = dot(error, error).sqrt().high / range.abs().high;
        let parallax = dot(normal, normal).sqrt().high;
        case.see(side, error, 16.0 * ROUND / parallax, || format!("depth {depth}: {found}"));
    }
}
