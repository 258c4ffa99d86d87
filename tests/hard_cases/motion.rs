//! Hard cases of rotations and of the trajectory's spline, against quaternions in double-double.

use glam::{DMat3, DQuat, DVec3};
use sensel::num::{f64_from_usize, greater};
use sensel::pose::Pose;
use sensel::scene::motion::Spline;
use sensel::so3::{self, EXP_SERIES_ANGLE_RAD_MAX};
use sensel::tracker::lie::{SERIES_ANGLE_RAD_MAX, so3_left_jacobian, so3_left_jacobian_inverse};

use super::double_double::{Dd, Vector, dd, dot, times, vector};
use super::table::{Chance, Stage};

/// x, y, z, w.
type Quaternion = [Dd; 4];

/// 2^-53: one rounding.
const ROUND: f64 = 0.5 * f64::EPSILON;

fn exact_exp(v: Vector) -> Quaternion {
    let angle = dot(v, v).sqrt();
    if angle.high == 0.0 {
        return [dd(0.0), dd(0.0), dd(0.0), dd(1.0)];
    }
    let (sine, cosine) = (angle * dd(0.5)).sin_cos();
    let [x, y, z] = times(v, sine / angle);
    [x, y, z, cosine]
}

fn exact_log([x, y, z, w]: Quaternion) -> Vector {
    let sign = if w.high < 0.0 { dd(-1.0) } else { dd(1.0) };
    let v = times([x, y, z], sign);
    let length = dot(v, v).sqrt();
    if length.high == 0.0 {
        return v;
    }
    times(v, dd(2.0) * Dd::atan2(length, w * sign) / length)
}

fn product(a: Quaternion, b: Quaternion) -> Quaternion {
    let [ax, ay, az, aw] = a;
    let [bx, by, bz, bw] = b;
    [
        aw * bx + ax * bw + ay * bz - az * by,
        aw * by - ax * bz + ay * bw + az * bx,
        aw * bz + ax * by - ay * bx + az * bw,
        aw * bw - ax * bx - ay * by - az * bz,
    ]
}

fn exact(q: DQuat) -> Quaternion {
    q.to_array().map(dd)
}

fn conjugate([x, y, z, w]: Quaternion) -> Quaternion {
    [-x, -y, -z, w]
}

/// Greatest distance of the components from a quaternion or its opposite.
fn apart(found: DQuat, exact: Quaternion) -> f64 {
    let dot = exact.iter().zip(found.to_array()).map(|(a, b)| a.high * b).sum::<f64>();
    let sign = if dot < 0.0 { -1.0 } else { 1.0 };
    exact.iter().zip(found.to_array()).fold(0.0, |most, (exact, found)| greater(most, exact.miss(sign * found)))
}

fn distance(found: DVec3, exact: Vector) -> f64 {
    exact.iter().zip(found.to_array()).fold(0.0, |most, (exact, found)| greater(most, exact.miss(found)))
}

pub fn scene(stage: &mut Stage) {
    exponentials(stage);
    spline(stage);
}

pub fn tracker(stage: &mut Stage) {
    jacobians(stage);
}

/// Angles around a seam, of every size, and up to pi within an ulp.
fn angle(chance: &mut Chance, kind: u64, seam_rad: f64) -> f64 {
    match kind {
        0 => seam_rad * (1.0 - chance.decade(1e-15, 0.5)),
        1 => seam_rad * (1.0 + chance.decade(1e-15, 0.5)),
        2 => std::f64::consts::PI - chance.decade(1e-16, 1e-3),
        3 => chance.decade(1e-200, 1e-6),
        _ => chance.between(0.0, std::f64::consts::PI),
    }
}

/// The angle rounds by 2.5 * 2^-53 of itself (three products under a root), its half's sine by 2, the quotient and the product by one
/// each: a vector part by (2.5 + 2 + 2) * 2^-53, relative; the cosine by 2 * 2^-53 and by pi / 2 of the angle's 2.5: 6 * 2^-53. 7 * 2^-53
/// of the vector part or of one holds for both. Logarithms: the length rounds by 2.5, the arctangent by 2 and passes on no more than the
/// relative error of its first part, quotient and products by 3: 8 * 2^-53 of the angle.
fn exponentials(stage: &mut Stage) {
    let sides = &["below the seam", "above", "near pi", "tiny", "any", "at pi or zero"];
    let mut chance = Chance::new(901);
    let mut samples = Vec::new();
    for kind in (0..5).cycle().take(4000) {
        let angle_rad = angle(&mut chance, kind, EXP_SERIES_ANGLE_RAD_MAX);
        samples.push((usize::try_from(kind).unwrap(), chance.direction() * angle_rad));
    }
    samples.extend([DVec3::ZERO, DVec3::X * std::f64::consts::PI, DVec3::NEG_Y * std::f64::consts::PI].map(|v| (5, v)));
    let reference = "quaternion in double-double";
    let case = stage.case("exponential of rotations", reference, "relative", sides);
    for &(side, v) in &samples {
        let (found, exact) = (so3::exp(v), exact_exp(vector(v.to_array())));
        let size = dot([exact[0], exact[1], exact[2]], [exact[0], exact[1], exact[2]]).sqrt().high;
        let of_vector = distance(found.xyz(), [exact[0], exact[1], exact[2]]);
        let error = greater(exact[3].miss(found.w), if size > 0.0 { of_vector / size } else { of_vector });
        case.see(side, error, 7.0 * ROUND, || format!("{v}: {found}"));
    }
    let case = stage.case("logarithm of rotations", reference, "relative", sides);
    for &(side, v) in &samples {
        // The rotation itself, rounded to f64 once, so that only the logarithm is judged; at pi of either sign of w.
        let q = exact_exp(vector(v.to_array())).map(Dd::f64);
        let q = DQuat::from_xyzw(q[0], q[1], q[2], if side == 5 { q[3].round() } else { q[3] });
        let exact = exact_log(exact(q));
        let found = so3::log(q);
        let size = dot(exact, exact).sqrt().high;
        let error = distance(found, exact) / if size > 0.0 { size } else { 1.0 };
        case.see(side, error, 8.0 * ROUND, || format!("{q}: {found}"));
        if side < 5 {
            let same = so3::log(-q) == found;
            case.hold(side, same, || format!("{q} and its opposite"));
        }
    }
}

/// 1 + (1 - cos a) / a^2 K + (a - sin a) / a^3 K^2, and its inverse 1 - K / 2 + (1 - a / 2 cot(a / 2)) / a^2 K^2, entry by entry. Entries
/// are below 1 but for K / 2 (pi / 2); the closed forms just above the seam at 1 rad lose 13 roundings to cancellation (1 + 2 / 0.158 of
/// the value, and less than that for the cotangent, 0.5 of 0.085 of 12 K^2), series 3, products and sums 6: 20 * 2^-53.
fn jacobians(stage: &mut Stage) {
    let sides = &["series", "closed form", "near pi", "tiny", "any"];
    let name = "left Jacobian of rotations and its inverse";
    let case = stage.case(name, "closed form in double-double", "absolute", sides);
    let mut chance = Chance::new(902);
    for kind in (0..5).cycle().take(3000) {
        let v = chance.direction() * angle(&mut chance, kind, SERIES_ANGLE_RAD_MAX);
        let w = vector(v.to_array());
        let a2 = dot(w, w);
        let a = a2.sqrt();
        // Angles below 1e-6 leave 1e-13 / 12 of these, of which double-double keeps 20 digits; below 1e-8 the first term is all.
        let (versine, lag, cotangent) = if a.high < 1e-7 {
            (dd(0.5), dd(1.0) / dd(6.0), dd(1.0) / dd(12.0))
        } else {
            let (sine, cosine) = a.sin_cos();
            let (half_sine, half_cosine) = (a * dd(0.5)).sin_cos();
            let rest = dd(1.0) - a * dd(0.5) * half_cosine / half_sine;
            ((dd(1.0) - cosine) / a2, (a - sine) / (a2 * a), rest / a2)
        };
        let zero = dd(0.0);
        let once = [[zero, -w[2], w[1]], [w[2], zero, -w[0]], [-w[1], w[0], zero]];
        let twice = |i: usize, j: usize| once[i][0] * once[0][j] + once[i][1] * once[1][j] + once[i][2] * once[2][j];
        let (forward, backward) = (so3_left_jacobian(v), so3_left_jacobian_inverse(v));
        let mut worst = 0.0;
        for i in 0..3 {
            for j in 0..3 {
                let one = if i == j { dd(1.0) } else { zero };
                let at = |m: &DMat3| m.col(j)[i];
                let exact = one + once[i][j] * versine + twice(i, j) * lag;
                worst = greater(worst, exact.miss(at(&forward)));
                let exact = one - once[i][j] * dd(0.5) + twice(i, j) * cotangent;
                worst = greater(worst, exact.miss(at(&backward)));
            }
        }
        let side =
            if kind < 2 { usize::from(v.length() >= SERIES_ANGLE_RAD_MAX) } else { usize::try_from(kind).unwrap() };
        case.see(side, worst, 20.0 * ROUND, || format!("{v}"));
    }
}

/// The cumulative basis, exactly.
fn cumulative(u: Dd) -> [Dd; 3] {
    let (square, cube) = (u * u, u * u * u);
    let sixth = dd(1.0) / dd(6.0);
    [
        (dd(5.0) + dd(3.0) * u - dd(3.0) * square + cube) * sixth,
        (dd(1.0) + dd(3.0) * u + dd(3.0) * square - dd(2.0) * cube) * sixth,
        cube * sixth,
    ]
}

/// 600 knots over 60 s, neighbours up to 174.9 degrees apart. The position within an interval is a difference of numbers up to 600 that
/// rounded twice: 2 * 600 * 2^-53, which the rate of turn (3.06 rad a knot and less, times 2/3 and three factors) multiplies by at most
/// 3.06; positions (up to 10 m, slopes up to 20 m a knot) the same way. Quaternions: three logarithms, exponentials and products of 30
/// roundings each.
fn spline(stage: &mut Stage) {
    let sides = &["turns up to 174.9 degrees", "small turns", "at knots"];
    let name = "spline of 60 s between knots, at knots, near half turns";
    let case = stage.case(name, "quaternions in double-double", "components", sides);
    let mut chance = Chance::new(903);
    let (start_s, knot_s, count) = (0.3, 0.1, 601_usize);
    for kind in 0..2_usize {
        let mut rotation = DQuat::IDENTITY;
        let poses: Vec<Pose> = (0..count)
            .map(|_| {
                let angle_rad: f64 = if kind == 0 { chance.between(170.0, 174.9) } else { chance.between(0.0, 1.0) };
                rotation = (rotation * so3::exp(chance.direction() * angle_rad.to_radians())).normalize();
                Pose::new(rotation, 10.0 * chance.direction())
            })
            .collect();
        let spline = Spline::on_control_poses(start_s, knot_s, &poses).unwrap();
        for number in 0..500_usize {
            let interval = 1 + usize::try_from(chance.below(597)).unwrap();
            let near = [0.0, 1e-15, 1e-9][number % 3];
            let u = if number % 2 == 0 { near } else { chance.unit() };
            let t_s = start_s + (f64_from_usize(interval) + u) * knot_s;
            let found = spline.world_from_body(t_s).unwrap();
            // The interval that t itself lies in, exactly; either does at a knot.
            let knots = (dd(t_s) - dd(start_s)) / dd(knot_s);
            let u = knots - dd(f64_from_usize(interval));
            let parts = cumulative(u);
            let four: Vec<&Pose> = (0..4).map(|k| &poses[interval + k - 1]).collect();
            let mut exact_rotation = exact(four[0].rotation);
            for k in 0..3 {
                let step = exact_log(product(conjugate(exact(four[k].rotation)), exact(four[k + 1].rotation)));
                exact_rotation = product(exact_rotation, exact_exp(times(step, parts[k])));
            }
            let weights = [dd(1.0) - parts[0], parts[0] - parts[1], parts[1] - parts[2], parts[2]];
            let exact_position = [0, 1, 2].map(|axis| {
                (0..4).fold(dd(0.0), |sum, k| sum + weights[k] * dd(four[k].translation_m.to_array()[axis]))
            });
            let error =
                greater(apart(found.rotation, exact_rotation), distance(found.translation_m, exact_position) / 20.0);
            let bound = ROUND * (2.0 * 600.0 * if kind == 0 { 3.06 } else { 1.0 } + 90.0);
            let side = if number % 2 == 0 { 2 } else { kind };
            case.see(side, error, bound, || format!("{t_s} s, knot {interval}"));
        }
    }
}
