//! Rates of dark charge: electrons a second at the die's temperature, and bounds over pixels and dies.

use super::die::NORMAL_MAX;
use super::params::PixelParams;
use crate::facts::DieSpread;

/// What gathers without light.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct DarkRates {
    /// Of the photodiode, during exposure.
    pub(super) photodiode_e_per_s: f64,
    /// Of the storage node, during the wait for readout.
    pub(super) storage_e_per_s: f64,
    /// Mean of hot pixels, during both; 0 where there are none.
    pub(super) hot_e_per_s: f64,
    /// Sigma over pixels relative to the mean.
    pub(super) dcnu: f64,
    /// Sigma of the logarithm over dies.
    pub(super) die_sigma: f64,
}

impl DarkRates {
    pub(super) fn of(params: &PixelParams) -> Self {
        let hot_e_per_s = if params.hot_ppm > 0.0 { params.hot_dark_e_per_s } else { 0.0 };
        Self {
            photodiode_e_per_s: params.at_temperature(params.dark_current_e_per_s),
            storage_e_per_s: params.at_temperature(params.storage_dark_e_per_s.unwrap_or(params.dark_current_e_per_s)),
            hot_e_per_s: params.at_temperature(hot_e_per_s),
            dcnu: params.dcnu,
            die_sigma: params.die_dark_sigma,
        }
    }

    /// Sigma of the logarithm over pixels: a lognormal of mean 1 and relative sigma d has s^2 = ln(1 + d^2).
    pub(super) fn log_sigma(&self) -> f64 {
        libm::log1p(self.dcnu * self.dcnu).sqrt()
    }

    fn die_factor(&self, dies: DieSpread) -> f64 {
        if self.die_sigma > 0.0 { libm::exp(dies.dark_sigmas * self.die_sigma) } else { 1.0 }
    }

    /// Mean dark charge of a sound pixel on that one of these dies that draws the most, in electrons.
    pub(super) fn mean_e(&self, exposure_s: f64, storage_s: f64, dies: DieSpread) -> f64 {
        self.die_factor(dies) * (self.photodiode_e_per_s * exposure_s + self.storage_e_per_s * storage_s)
    }

    /// Mean dark charge of hot pixels beside that of sound ones, on that die, in electrons.
    pub(super) fn hot_mean_e(&self, exposure_s: f64, storage_s: f64, dies: DieSpread) -> f64 {
        self.die_factor(dies) * self.hot_e_per_s * (exposure_s + storage_s)
    }

    /// Greatest mean dark charge of a hot pixel beside that of a sound one, in electrons.
    pub(super) fn hot_e_max(&self, exposure_s: f64, storage_s: f64, dies: DieSpread) -> f64 {
        dies.hottest * self.hot_mean_e(exposure_s, storage_s, dies)
    }

    /// Mean dark charge of the worst pixel of the worst of these dies, in electrons.
    pub(super) fn most_e(&self, exposure_s: f64, storage_s: f64, dies: DieSpread) -> f64 {
        let s = self.log_sigma();
        let pixel_factor = libm::exp(s * NORMAL_MAX - 0.5 * s * s);
        pixel_factor * self.mean_e(exposure_s, storage_s, dies) + self.hot_e_max(exposure_s, storage_s, dies)
    }
}
