//! The enhanced unified camera model (Khomutenko, Garcia and Martinet, "An Enhanced Unified Camera Model", RA-L 2016): a pinhole behind an
//! ellipsoid. beta = 1 is the unified model of a sphere. Closed form both ways.

use glam::{DVec2, DVec3};

use super::projection::{Projected, RIM, denominator, depth_of, over, rim_depth_ratio};
use crate::num::greater;

/// Its two parameters beside the intrinsics.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eucm {
    /// Share of the ellipsoid's distance in the denominator, 0 (pinhole) to 1.
    pub alpha: f64,
    /// Squared ratio of the ellipsoid's axes, above 0.
    pub beta: f64,
}

impl Eucm {
    /// Whether alpha and beta make a lens.
    fn is_sound(&self) -> bool {
        (0.0..=1.0).contains(&self.alpha) && self.beta > 0.0 && self.beta.is_finite()
    }

    pub(super) fn angle_max_rad(&self) -> f64 {
        if !self.is_sound() {
            return 0.0;
        }
        let w = rim_depth_ratio(self.alpha);
        libm::atan2(greater(1.0 - w * w, 0.0).sqrt(), -w * self.beta.sqrt())
    }

    pub(super) fn project(&self, point: DVec3, scale: [f64; 2]) -> Option<Projected> {
        let scaled_rho2 = self.beta * (point.x * point.x + point.y * point.y);
        let distance = (scaled_rho2 + point.z * point.z).sqrt();
        let denominator = denominator(self.alpha, distance, point.z, scaled_rho2);
        // False for NaN.
        let is_inside = point.z > -(rim_depth_ratio(self.alpha) + RIM) * distance && denominator > 0.0;
        if !(distance.is_normal() && self.is_sound() && is_inside) {
            return None;
        }
        let gradient = DVec3::new(self.beta * point.x, self.beta * point.y, point.z) * (self.alpha / distance);
        over(point, denominator, gradient + DVec3::Z * (1.0 - self.alpha), scale)
    }

    pub(super) fn unproject(&self, point: DVec2) -> Option<DVec3> {
        let (alpha, r2) = (self.alpha, self.beta * point.length_squared());
        let root2 = 1.0 - (2.0 * alpha - 1.0) * r2;
        if !(self.is_sound() && root2 >= -RIM && r2.is_finite()) {
            return None;
        }
        let z = depth_of(alpha, r2, root2);
        let bearing = point.extend(z);
        bearing.is_finite().then(|| bearing.normalize())
    }
}
