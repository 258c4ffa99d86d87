//! Mean photons rounded to steps in proportion to their photon noise, so that a store of them takes a fraction of the disk.
//!
//! Levels are equal steps of the square root of the photons: the variance-stabilising transform of a Poisson variable (Bartlett 1936,
//! doi:10.2307/2983678). A step of s photon sigmas adds a uniform error of variance s^2 / 12 times that of the photons.

use super::render::Exposure;
use crate::num::f32_nearest;

/// Steps of the mean photons, in photon sigmas.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rounding {
    step_sigma: f64,
}

impl Rounding {
    /// Smallest step. Below it levels could exceed what an f32 tells apart.
    pub const STEP_SIGMA_MIN: f64 = 0.01;
    /// Largest step: an error of 0.29 photon sigmas.
    pub const STEP_SIGMA_MAX: f64 = 1.0;

    /// Step in photon sigmas; none for 0, where photons stay as they are.
    ///
    /// # Panics
    /// A step that is neither 0 nor within `STEP_SIGMA_MIN` to `STEP_SIGMA_MAX`.
    pub fn new(step_sigma: f64) -> Option<Self> {
        let is_within = (Self::STEP_SIGMA_MIN..=Self::STEP_SIGMA_MAX).contains(&step_sigma);
        assert!(is_within || step_sigma == 0.0, "a step of {step_sigma} sigma");
        is_within.then_some(Self { step_sigma })
    }

    /// The step in photon sigmas.
    pub fn step_sigma(self) -> f64 {
        self.step_sigma
    }

    /// Variance of the rounding error over that of the photons.
    pub fn variance_ratio(self) -> f64 {
        self.step_sigma * self.step_sigma / 12.0
    }

    /// The level nearest to a number of photons.
    pub fn level(self, photons: f32) -> u32 {
        let level = (2.0 * f64::from(photons).sqrt() / self.step_sigma).round();
        crate::num::u32_truncated(level)
    }

    /// The photons of a level.
    pub fn photons(self, level: u32) -> f32 {
        let root = f64::from(level) * self.step_sigma / 2.0;
        f32_nearest(root * root)
    }

    /// Rounds an exposure. `electrons_per_photon` states the rounding error beside the render's, which is counted in electrons.
    pub fn round(self, exposure: &mut Exposure, electrons_per_photon: f64) {
        for value in exposure.photons.values_mut() {
            *value = self.photons(self.level(*value));
        }
        exposure.render_variance_ratio += self.variance_ratio() * electrons_per_photon;
    }

    /// Bounds that hold after rounding where these hold before.
    pub fn widened(self, [least, greatest]: [f64; 2]) -> [f64; 2] {
        // Half a step of the root, and the f32 of the result.
        let half = self.step_sigma / 4.0;
        let (low, high) = (crate::num::greater(least.sqrt() - half, 0.0), greatest.sqrt() + half);
        [low * low * (1.0 - f64::from(f32::EPSILON)), high * high * (1.0 + f64::from(f32::EPSILON))]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_level_comes_back_and_no_photon_moves_by_more_than_half_a_step() {
        for step_sigma in [Rounding::STEP_SIGMA_MIN, 0.1, 0.37, Rounding::STEP_SIGMA_MAX] {
            let rounding = Rounding::new(step_sigma).unwrap();
            let mut photons = 1e-3_f32;
            while photons < 2e9 {
                let level = rounding.level(photons);
                let rounded = rounding.photons(level);
                assert_eq!(rounding.level(rounded), level, "{photons} photons in steps of {step_sigma}");
                let roots = [f64::from(photons).sqrt(), f64::from(rounded).sqrt()];
                // Half a step of 2 sqrt(n) is step / 4 of the root; f32 moves the root by 2^-24 of it at most.
                let most = step_sigma / 4.0 + roots[0] * f64::from(f32::EPSILON);
                assert!((roots[1] - roots[0]).abs() <= most, "{photons} photons became {rounded}");
                let [low, high] = rounding.widened([photons.into(), photons.into()]);
                assert!((low..=high).contains(&f64::from(rounded)), "{rounded} leaves {low} to {high}");
                photons *= 1.003;
            }
        }
    }

    #[test]
    fn the_error_has_the_stated_share_of_the_photon_variance() {
        let rounding = Rounding::new(0.5).unwrap();
        let mut sum = 0.0;
        let count = 20_000_u16;
        for number in 0..count {
            let photons = 800.0 + f32::from(number) * 0.01;
            let error = f64::from(rounding.photons(rounding.level(photons)) - photons);
            sum += error * error / f64::from(photons);
        }
        // The mean of a uniform error's square over some 28 whole steps: ends that are no whole step count for 1 in 28.
        assert!((sum / f64::from(count) / rounding.variance_ratio() - 1.0).abs() < 0.04);
    }

    #[test]
    fn a_step_of_zero_rounds_nothing() {
        assert_eq!(Rounding::new(0.0), None);
    }
}
