//! The double sphere model (Usenko, Demmel and Cremers, "The Double Sphere Camera Model", 3DV 2018): a bearing meets a unit sphere, then
//! a second one shifted by xi along the axis, then a pinhole shifted by alpha / (1 - alpha). Closed form both ways.

use glam::{DVec2, DVec3};

use super::projection::{Projected, RIM, denominator, depth_of, over, rim_depth_ratio};
use crate::num::greater;

/// Its two parameters beside the intrinsics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DoubleSphere {
    /// Distance between the spheres' centres, between -1 and 1.
    pub xi: f64,
    /// Shift of the pinhole, 0 to 1.
    pub alpha: f64,
}

impl DoubleSphere {
    /// Whether xi and alpha make a lens.
    fn is_sound(&self) -> bool {
        self.xi > -1.0 && self.xi < 1.0 && (0.0..=1.0).contains(&self.alpha)
    }

    pub(super) fn axial_slope(&self) -> f64 {
        1.0 / (1.0 + self.xi)
    }

    /// Angle of the bearing whose second direction lies at the limit: l (sin, -w1) - (0, xi) of unit length. The paper's own bound
    /// (its w2) lies a little inside this one, which is exactly where the unprojection ends.
    pub(super) fn angle_max_rad(&self) -> f64 {
        if !self.is_sound() {
            return 0.0;
        }
        let (w, xi) = (rim_depth_ratio(self.alpha), self.xi);
        let sine = greater(1.0 - w * w, 0.0).sqrt();
        let length = (w * w * xi * xi + 1.0 - xi * xi).sqrt() - w * xi;
        libm::atan2(length * sine, -length * w - xi)
    }

    pub(super) fn project(&self, point: DVec3, scale: [f64; 2]) -> Option<Projected> {
        let first = point.length();
        if !(first.is_normal() && self.is_sound()) {
            return None;
        }
        let z = self.xi * first + point.z;
        let second = (point.x * point.x + point.y * point.y + z * z).sqrt();
        // False for NaN.
        let denominator = denominator(self.alpha, second, z, point.x * point.x + point.y * point.y);
        if !(z > -(rim_depth_ratio(self.alpha) + RIM) * second && denominator > 0.0) {
            return None;
        }
        let z_gradient = point * (self.xi / first) + DVec3::Z;
        let second_gradient = (DVec3::new(point.x, point.y, 0.0) + z_gradient * z) / second;
        over(point, denominator, second_gradient * self.alpha + z_gradient * (1.0 - self.alpha), scale)
    }

    pub(super) fn unproject(&self, point: DVec2) -> Option<DVec3> {
        let (alpha, xi) = (self.alpha, self.xi);
        let r2 = point.length_squared();
        let root2 = 1.0 - (2.0 * alpha - 1.0) * r2;
        if !(self.is_sound() && root2 >= -RIM && r2.is_finite()) {
            return None;
        }
        let z = depth_of(alpha, r2, root2);
        let onto_first = (z * xi + (z * z + (1.0 - xi * xi) * r2).sqrt()) / (z * z + r2);
        let bearing = point.extend(z) * onto_first - DVec3::Z * xi;
        bearing.is_finite().then(|| bearing.normalize())
    }
}
