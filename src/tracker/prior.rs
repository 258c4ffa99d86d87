//! A prior of a pose.

use super::lie::se3_log;
use crate::pose::Pose;
use nalgebra::{Matrix6, Vector6};

/// What is known of a pose before its picture is asked: a normal law.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PosePrior {
    /// Its middle, `body_from_world`.
    pub mean: Pose,
    /// Inverse covariance of the left twist from the middle, linear part first: 1/m^2, 1/(m rad), 1/rad^2.
    pub information: Matrix6<f64>,
}

impl PosePrior {
    /// Equal along all axes.
    pub fn isotropic(mean: Pose, (sigma_m, sigma_rad): (f64, f64)) -> Self {
        let inverse2 = |k: usize| if k < 3 { 1.0 / (sigma_m * sigma_m) } else { 1.0 / (sigma_rad * sigma_rad) };
        Self { mean, information: Matrix6::from_fn(|i, j| if i == j { inverse2(i) } else { 0.0 }) }
    }

    /// Left twist from the middle to a pose.
    pub fn deviation(&self, body_from_world: &Pose) -> Vector6<f64> {
        Vector6::from(se3_log(&body_from_world.then(&self.mean.inverse())).to_array())
    }

    /// The same, less sure: these standard deviations per axis on top.
    #[must_use]
    pub fn loosened(&self, sigma_m: f64, sigma_rad: f64) -> Self {
        let mut more = Matrix6::zeros();
        (0..6).for_each(|k| more[(k, k)] = if k < 3 { sigma_m * sigma_m } else { sigma_rad * sigma_rad });
        let loose = self.information.try_inverse().and_then(|covariance| (covariance + more).try_inverse());
        Self { information: loose.unwrap_or_else(Matrix6::zeros), ..*self }
    }

    /// Squared deviation in sigmas.
    pub fn deviation2(&self, body_from_world: &Pose) -> f64 {
        let deviation = self.deviation(body_from_world);
        deviation.dot(&(self.information * deviation))
    }
}
