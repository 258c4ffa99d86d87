//! Two-view models with squared residuals in rad^2 and refinement: general motion (essential matrix), a plane (homography), and pure
//! rotation.

use glam::{DMat3, DQuat, DVec3};

use super::homography;
use super::linear::tangents;
use crate::num::greater;
use crate::pose::Pose;
use crate::so3;
use crate::tracker::dense::solve_cholesky;
use crate::tracker::lie::skew;

/// A pair of bearings of one point.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct BearingPair {
    /// Unit vector in the first camera.
    pub first: DVec3,
    /// Unit vector in the second camera.
    pub second: DVec3,
}

/// Squared distance of a pair from an essential matrix, by Sampson's approximation on the sphere; one direction in four
/// is measured.
pub fn from_essential(e: &DMat3, pair: &BearingPair) -> f64 {
    let (miss, steep2) = sampson(e, pair);
    // At an epipole both gradients vanish, and any pair fits.
    if steep2 > 1e-300 { miss * miss / steep2 } else { 0.0 }
}

/// How far a pair is off its epipolar plane, algebraically, and the squared slope of that by both bearings.
fn sampson(e: &DMat3, pair: &BearingPair) -> (f64, f64) {
    let (by_second, by_first) = (*e * pair.first, e.transpose() * pair.second);
    let aside = |gradient: DVec3, bearing: DVec3| gradient.length_squared() - square(gradient.dot(bearing));
    (pair.second.dot(by_second), aside(by_second, pair.second) + aside(by_first, pair.first))
}

/// The same from a homography; two directions in four are measured.
pub fn from_homography(h: &DMat3, pair: &BearingPair) -> f64 {
    let image = *h * pair.first;
    let length = image.length();
    let (unit, (u, v)) = (image / length, tangents(pair.second));
    if !(unit.dot(pair.second) > 0.0) {
        return std::f64::consts::PI * std::f64::consts::PI;
    }
    let (s, t) = tangents(pair.first);
    let derivative = |tangent: DVec3| (*h * tangent - unit * unit.dot(*h * tangent)) / length;
    let (by_s, by_t) = (derivative(s), derivative(t));
    // Covariance of the miss along u and v for unit noise on both bearings.
    let spread = |a: DVec3, b: DVec3| by_s.dot(a) * by_s.dot(b) + by_t.dot(a) * by_t.dot(b);
    let (uu, uv, vv) = (1.0 + spread(u, u), spread(u, v), 1.0 + spread(v, v));
    let (x, y) = (unit.dot(u), unit.dot(v));
    (vv * x * x - 2.0 * uv * x * y + uu * y * y) / (uu * vv - uv * uv)
}

/// The same from a rotation; two directions in four are measured.
pub fn from_rotation(rotation: &DMat3, pair: &BearingPair) -> f64 {
    let miss = pair.second - *rotation * pair.first;
    // Both bearings share the miss. Beyond a right angle the chord understates it, which no gate minds.
    0.5 * miss.length_squared()
}

fn square(x: f64) -> f64 {
    x * x
}

/// The rotation through two pairs; `None` where they coincide.
pub fn rotation_through(pairs: &[BearingPair; 2]) -> Option<DMat3> {
    let frame = |a: DVec3, b: DVec3| {
        let middle = (a + b).normalize_or_zero();
        let normal = a.cross(b);
        (normal.length() > 1e-4).then(|| DMat3::from_cols(middle, normal.normalize(), middle.cross(normal.normalize())))
    };
    let (from, to) = (frame(pairs[0].first, pairs[1].first)?, frame(pairs[0].second, pairs[1].second)?);
    Some(to * from.transpose())
}

/// Least squares of the rotation over weighted pairs.
pub fn refined_rotation(start: DMat3, pairs: &[BearingPair], weight: impl Fn(f64) -> f64) -> DMat3 {
    let mut rotation = DQuat::from_mat3(&start).normalize();
    for _ in 0..10 {
        let matrix = DMat3::from_quat(rotation);
        let (mut hessian, mut gradient) = (DMat3::ZERO, DVec3::ZERO);
        for pair in pairs {
            let turned = matrix * pair.first;
            let weight = weight(from_rotation(&matrix, pair));
            let turn = skew(turned);
            hessian += turn.transpose() * turn * weight;
            gradient += turned.cross(pair.second) * weight;
        }
        let step = hessian.inverse() * gradient;
        if !step.is_finite() {
            break;
        }
        rotation = (so3::exp(step) * rotation).normalize();
        if step.length_squared() < 1e-24 {
            break;
        }
    }
    DMat3::from_quat(rotation)
}

/// Least squares of a homography over weighted pairs: the algebraic fit, each pair weighted by its kernel. `None` where
/// none fits.
pub fn refined_homography(start: DMat3, pairs: &[BearingPair], weight: impl Fn(f64) -> f64) -> Option<DMat3> {
    let mut h = start;
    for _ in 0..4 {
        let weighted = pairs.iter().map(|pair| {
            // The algebraic miss is the angular one times |H first|.
            let length2 = (h * pair.first).length_squared();
            (pair.first, pair.second, weight(from_homography(&h, pair)) / greater(length2, 1e-12))
        });
        h = homography::fitted(weighted)?;
    }
    Some(h)
}

/// Essential matrix of a motion `second_from_first`, its translation taken as a direction.
pub fn essential(second_from_first: &Pose) -> DMat3 {
    skew(second_from_first.translation_m.normalize_or_zero()) * DMat3::from_quat(second_from_first.rotation)
}

/// Least squares of a motion (rotation, and direction of translation) over pairs under a kernel that gives cost and
/// weight of a squared distance: Gauss-Newton of Sampson's distance, its divisor held within a step.
pub fn refined_motion(start: &Pose, pairs: &[BearingPair], kernel: impl Fn(f64) -> (f64, f64)) -> Pose {
    let mut motion = Pose::new(start.rotation, start.translation_m.normalize_or_zero());
    let (mut best, mut worse) = ((motion, f64::INFINITY), 0);
    for _ in 0..30 {
        let e = essential(&motion);
        let rotation = DMat3::from_quat(motion.rotation);
        let t = motion.translation_m;
        let (along, across) = tangents(t);
        let (mut hessian, mut gradient, mut cost_now) = ([0.0; 25], [0.0; 5], 0.0);
        for pair in pairs {
            let turned = rotation * pair.first;
            let (miss, steep2) = sampson(&e, pair);
            if !(steep2 > 1e-300) {
                continue;
            }
            let (cost, weight) = kernel(miss * miss / steep2);
            cost_now += cost;
            let scale = weight / steep2;
            let (by_turn, by_t) = (turned.cross(pair.second.cross(t)), turned.cross(pair.second));
            let row = [by_turn.x, by_turn.y, by_turn.z, by_t.dot(along), by_t.dot(across)];
            for i in 0..5 {
                gradient[i] -= scale * row[i] * miss;
                for j in 0..=i {
                    hessian[5 * i + j] += scale * row[i] * row[j];
                }
            }
        }
        for k in 0..5 {
            hessian[6 * k] += 1e-9 * hessian[6 * k] + 1e-300;
        }
        if cost_now < best.1 {
            best = (motion, cost_now);
        } else if worse > 2 {
            break;
        } else {
            worse += 1;
        }
        if !solve_cholesky(&mut hessian, &mut gradient) {
            break;
        }
        let [x, y, z, a, b] = gradient;
        let turn = so3::exp(DVec3::new(x, y, z));
        motion = Pose::new((turn * motion.rotation).normalize(), (t + along * a + across * b).normalize());
    }
    best.0
}
