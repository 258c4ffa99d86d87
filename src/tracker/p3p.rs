//! Pose of a camera from three bearings to known points (Grunert's equations as Haralick et al. 1994 write them).
//!
//! Bearings are unit vectors of the camera's frame, points metres of the world. Up to four poses leave.

use glam::{DMat3, DQuat, DVec3};

use crate::num::greater;
use crate::pose::Pose;
use crate::tracker::polynomial::positive_roots;

/// Poses `camera_from_world` that put each point on its bearing, in front of the camera. Empty for points on a line and for
/// bearings that coincide.
pub fn solve(bearings: &[DVec3; 3], points_m: &[DVec3; 3]) -> Vec<Pose> {
    let [p1, p2, p3] = *points_m;
    let (a2, b2, c2) = ((p2 - p3).length_squared(), (p1 - p3).length_squared(), (p1 - p2).length_squared());
    let area2 = (p2 - p1).cross(p3 - p1).length_squared();
    // Doubled area against the longest side: a triangle flatter than 1 % has no stable pose.
    let longest2 = greater(a2, greater(b2, c2));
    if !(longest2 > 0.0 && area2 > 1e-4 * longest2 * longest2) {
        return Vec::new();
    }
    let [f1, f2, f3] = *bearings;
    let cosines = [f2.dot(f3), f1.dot(f3), f1.dot(f2)];
    if cosines.iter().any(|&cosine| cosine > 1.0 - 1e-9) {
        return Vec::new();
    }
    let mut poses: Vec<Pose> = Vec::new();
    for (u, v) in ratios([a2, b2, c2], cosines) {
        let s1 = (c2 / greater(1.0 + u * u - 2.0 * u * cosines[2], 1e-300)).sqrt();
        let Some(ranges) = polish([s1, u * s1, v * s1], cosines, [a2, b2, c2]) else { continue };
        let in_camera = [f1 * ranges[0], f2 * ranges[1], f3 * ranges[2]];
        let pose = align(points_m, &in_camera);
        let known = |other: &Pose| {
            (other.translation_m - pose.translation_m).length_squared() < 1e-16 * longest2
                && other.rotation.dot(pose.rotation).abs() > 1.0 - 1e-14
        };
        if !poses.iter().any(known) {
            poses.push(pose);
        }
    }
    poses
}

/// Ratios u = s2 / s1 and v = s3 / s1 of the ranges.
fn ratios([a2, b2, c2]: [f64; 3], [cos_a, cos_b, cos_c]: [f64; 3]) -> Vec<(f64, f64)> {
    let (d, s, e) = ((a2 - c2) / b2, (a2 + c2) / b2, c2 / b2);
    let (f, g, h) = ((b2 - c2) / b2, (b2 - a2) / b2, a2 / b2);
    let quartic = [
        (1.0 + d) * (1.0 + d) - 4.0 * h * cos_c * cos_c,
        4.0 * (-d * (1.0 + d) * cos_b + 2.0 * h * cos_c * cos_c * cos_b - (1.0 - s) * cos_a * cos_c),
        2.0 * (d * d - 1.0 + 2.0 * d * d * cos_b * cos_b + 2.0 * f * cos_a * cos_a - 4.0 * s * cos_a * cos_b * cos_c
            + 2.0 * g * cos_c * cos_c),
        4.0 * (d * (1.0 - d) * cos_b - (1.0 - s) * cos_a * cos_c + 2.0 * e * cos_a * cos_a * cos_b),
        (d - 1.0) * (d - 1.0) - 4.0 * e * cos_a * cos_a,
    ];
    let mut ratios = Vec::new();
    for v in positive_roots(quartic) {
        let divisor = 2.0 * (cos_c - v * cos_a);
        let numerator = (d - 1.0) * v * v - 2.0 * d * cos_b * v + 1.0 + d;
        if divisor.abs() > 1e-7 {
            ratios.push((numerator / divisor, v));
            continue;
        }
        // The quotient is 0/0 (isosceles views): u follows from the side c instead, u^2 - 2 u cos_c + 1 = w.
        let w = e * (1.0 + v * v - 2.0 * v * cos_b);
        let root = greater(cos_c * cos_c - 1.0 + w, 0.0).sqrt();
        ratios.extend([(cos_c + root, v), (cos_c - root, v)]);
    }
    ratios.retain(|&(u, _)| u > 0.0 && u.is_finite());
    ratios
}

/// Newton on the three cosine laws: the quartic loses digits that the ranges need. `None` where a range is not positive or the
/// laws do not hold.
fn polish(mut s: [f64; 3], cosines: [f64; 3], sides2: [f64; 3]) -> Option<[f64; 3]> {
    // Side k joins the two vertices other than k.
    let miss = |s: &[f64; 3]| {
        let law = |k: usize, i: usize, j: usize| s[i] * s[i] + s[j] * s[j] - 2.0 * s[i] * s[j] * cosines[k] - sides2[k];
        DVec3::new(law(0, 1, 2), law(1, 0, 2), law(2, 0, 1))
    };
    for _ in 0..5 {
        let by = |k: usize, i: usize, j: usize| 2.0 * (s[i] - s[j] * cosines[k]);
        let columns = DMat3::from_cols(
            DVec3::new(0.0, by(1, 0, 2), by(2, 0, 1)),
            DVec3::new(by(0, 1, 2), 0.0, by(2, 1, 0)),
            DVec3::new(by(0, 2, 1), by(1, 2, 0), 0.0),
        );
        let step = columns.inverse() * miss(&s);
        if !step.is_finite() {
            break;
        }
        s = [s[0] - step.x, s[1] - step.y, s[2] - step.z];
    }
    let scale = greater(sides2[0], greater(sides2[1], sides2[2]));
    let holds = miss(&s).length() <= 1e-6 * scale;
    (holds && s.iter().all(|&range| range > 0.0 && range.is_finite())).then_some(s)
}

/// The rigid motion that maps the first triangle onto the congruent second.
fn align(from: &[DVec3; 3], to: &[DVec3; 3]) -> Pose {
    let frame = |p: &[DVec3; 3]| {
        let x = (p[1] - p[0]).normalize();
        let z = x.cross(p[2] - p[0]).normalize();
        DMat3::from_cols(x, z.cross(x), z)
    };
    let rotation = DQuat::from_mat3(&(frame(to) * frame(from).transpose())).normalize();
    let centre = |p: &[DVec3; 3]| (p[0] + p[1] + p[2]) / 3.0;
    Pose::new(rotation, centre(to) - rotation * centre(from))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::DrawKey;
    use crate::so3;

    /// A number in -1..1 of a case.
    fn number(seed: u64, case: u64, field: u64) -> f64 {
        2.0 * DrawKey::root(seed).with(case).with(field).uniform() - 1.0
    }

    #[test]
    fn one_of_the_poses_is_the_known_one() {
        let seed = 11;
        let (mut tried, mut missed, mut many) = (0, 0, 0);
        for case in 0..3_000 {
            let triple = |start: u64| {
                DVec3::new(number(seed, case, start), number(seed, case, start + 1), number(seed, case, start + 2))
            };
            let truth = Pose::new(so3::exp(triple(0) * 1.8), triple(3) * 3.0);
            let in_camera = [6, 9, 12].map(|start| triple(start) + DVec3::new(0.0, 0.0, 2.5));
            let points_m = in_camera.map(|point| truth.inverse().point(point));
            let side = (points_m[1] - points_m[0]).cross(points_m[2] - points_m[0]).length();
            if side < 0.1 {
                continue;
            }
            tried += 1;
            let poses = solve(&in_camera.map(DVec3::normalize), &points_m);
            for pose in &poses {
                for (point_m, expected) in points_m.iter().zip(&in_camera) {
                    let bearing = pose.point(*point_m).normalize();
                    // The cosine laws hold to 1e-6 of the longest side, some 3 m at a range of 1.5 m and more.
                    assert!((bearing - expected.normalize()).length() < 1e-4, "seed {seed} case {case}: bearing off");
                }
            }
            many += usize::from(poses.len() > 1);
            // Newton converges to 1e-15 / condition; triangles this large keep the condition below 1e7.
            let hit = poses.iter().any(|pose| (pose.translation_m - truth.translation_m).length() < 1e-6);
            missed += usize::from(!hit);
        }
        // Cases within 1e-7 of a double root are lost or blurred; they are rare.
        assert!(
            tried > 2_000 && missed * 500 <= tried && many > 200,
            "seed {seed}: {missed} of {tried} missed, {many}"
        );
    }

    #[test]
    fn a_frontal_isosceles_triangle_is_solved_where_the_quotient_for_u_is_zero_over_zero() {
        let points_m = [DVec3::new(0.0, -0.5, 2.0), DVec3::new(-0.5, 0.5, 2.0), DVec3::new(0.5, 0.5, 2.0)];
        let poses = solve(&points_m.map(DVec3::normalize), &points_m);
        assert!(poses.iter().any(|pose| pose.translation_m.length() < 1e-6 && pose.angle_rad() < 1e-6), "{poses:?}");
    }

    #[test]
    fn points_on_a_line_equal_points_and_equal_bearings_give_no_pose() {
        let line = [DVec3::new(0.0, 0.0, 2.0), DVec3::new(1.0, 0.0, 2.0), DVec3::new(2.0, 0.0, 2.0)];
        assert!(solve(&line.map(DVec3::normalize), &line).is_empty());
        let equal = [DVec3::Z; 3];
        assert!(solve(&equal, &equal).is_empty());
        let triangle = [DVec3::new(0.0, 0.0, 2.0), DVec3::new(1.0, 0.0, 2.0), DVec3::new(0.0, 1.0, 2.0)];
        assert!(solve(&equal, &triangle).is_empty());
    }
}
