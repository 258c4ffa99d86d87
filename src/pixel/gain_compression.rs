//! Compression of the conversion gain. Reduces the microvolts of the charge as the floating diffusion does.
//!
//! Model: the capacitance of a junction grows as its voltage falls, to first order v = g N (1 - c N / full well), with c the share of the
//! gain that is lost at full well (Janesick, "Photon Transfer": nonlinearity of V/e-). Beyond the full well the share stays c; below 0 it
//! is 0. It acts before any noise of the column.

use super::dark_rates::DarkRates;
use super::params::PixelParams;
use crate::draw::EffectNumber;
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;
use crate::num::{f32_nearest, lesser};
use crate::simd::kernel;

/// A gain that falls with the charge.
pub struct GainCompression {
    compression: f64,
    capacity_e: f64,
    conversion_gain_uv_per_e: f64,
    prnu: f64,
    rates: DarkRates,
    hot_share: f64,
}

impl GainCompression {
    /// `None` where the gain is constant.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        let effect = Self {
            compression: params.gain_compression,
            capacity_e: params.full_well_e,
            conversion_gain_uv_per_e: params.conversion_gain_uv_per_e,
            prnu: params.prnu,
            rates: DarkRates::of(params),
            hot_share: 1e-6 * params.hot_ppm,
        };
        (params.gain_compression > 0.0).then(|| Box::new(effect) as Box<dyn Effect>)
    }

    /// Mean square of dark charge that has a long tail over pixels; an exponential of mean h has 2 h^2.
    fn tail_e2(&self, facts: &Facts) -> f64 {
        let hot_e = self.rates.hot_mean_e(facts.exposure_s, facts.storage_s_max, facts.dies);
        let spread_e = self.rates.dcnu * self.rates.mean_e(facts.exposure_s, facts.storage_s_max, facts.dies);
        spread_e * spread_e + self.hot_share * (2.0 * hot_e * hot_e + hot_e)
    }
}

/// Least slope of the compressed curve up to this charge: what the pixel's own noise is scaled by.
pub fn compressed_slope_min(params: &PixelParams, most_e: f64) -> f64 {
    1.0 - 2.0 * params.gain_compression * lesser(most_e / params.full_well_e, 1.0)
}

impl Effect for GainCompression {
    fn identity(&self) -> Identity {
        Identity { name: "gain_compression", number: EffectNumber(112), domain: Domain::Microvolts }
    }

    /// The change is c N^2 / full well, at most. With mean m and variance s^2 of N, Poisson (third and fourth cumulant m) with normal
    /// patterns, E N^2 = m^2 + s^2 and var N^2 = 4 m^2 s^2 + 4 m m + m + 2 s^4. Dark charge with a long tail (DCNU, hot pixels) is no such
    /// law; but the change's slope is 2 c at most, so it adds at most 4 c^2 of its mean square, and (a + b)^2 <= 2 a^2 + 2 b^2.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let (charge_e, mean_e) = (facts.signal_e_max + facts.dark_rms_e, facts.signal_e_max + facts.dark_mean_e);
        let (gain_e, dark_e) = (self.prnu * facts.signal_e_max, facts.dark_rms_e);
        let variance_e2 = charge_e + gain_e * gain_e + dark_e * dark_e;
        let factor = self.compression / self.capacity_e;
        let square = 4.0 * charge_e * charge_e * (variance_e2 + 1.0) + charge_e + 2.0 * variance_e2 * variance_e2;
        let regular_e2 = factor * factor * square;
        let tail_e2 = 4.0 * self.compression * self.compression * self.tail_e2(facts);
        let all_e2 = if tail_e2 > 0.0 { 2.0 * (regular_e2 + tail_e2) } else { regular_e2 };
        Some(Omission { bias_e: factor * (mean_e * mean_e + variance_e2), variance_e2: all_e2 })
    }

    fn reason(&self, facts: &Facts) -> String {
        let lost_e = self.compression * facts.signal_e_max * facts.signal_e_max / self.capacity_e;
        format!("{lost_e:.3e} e- at {}, full well {} e-", facts.signal_words(), self.capacity_e)
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let per_uv = f32_nearest(1.0 / (self.conversion_gain_uv_per_e * self.capacity_e));
        compress(row.values, per_uv, f32_nearest(self.compression));
    }
}

kernel! {
    /// values *= 1 - compression * filled, where `filled` is the share of the well, 0 to 1.
    fn compress<'a>(values: &'a mut [f32], per_uv: f32, compression: f32) {
        for value in values {
            let filled = *value * per_uv;
            let filled = if filled > 0.0 { filled } else { 0.0 };
            let filled = if filled < 1.0 { filled } else { 1.0 };
            *value *= 1.0 - compression * filled;
        }
    }
}
