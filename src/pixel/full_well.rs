//! Saturation. Clips electrons to the full well.
//!
//! Model: a hard clip at the saturation capacity (EMVA 1288 release 4.0); charge beyond it is lost.

use super::dark_rates::DarkRates;
use super::die::NORMAL_MAX;
use super::params::PixelParams;
use super::row::clip_above;
use crate::draw::EffectNumber;
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;
use crate::num::{f32_nearest, greater};

/// The pixel's limit of charge. Called for only where some pixel can come near it.
pub struct FullWell {
    capacity_e: f64,
    rates: DarkRates,
    prnu: f64,
    dsnu_e: f64,
    /// Whether other pixels or the frame before can add to a pixel's charge.
    is_shared: bool,
}

impl FullWell {
    /// Every pixel has it.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        Some(Box::new(Self {
            capacity_e: params.full_well_e,
            rates: DarkRates::of(params),
            prnu: params.prnu,
            dsnu_e: params.dsnu_e,
            is_shared: params.blooming > 0.0 || params.image_lag > 0.0,
        }))
    }

    /// Greatest mean charge and the variance of patterns between pixels.
    fn mean_and_pattern(&self, facts: &Facts) -> (f64, f64) {
        let light_e = if self.is_shared { facts.frame_e_max } else { facts.signal_e_max };
        let mean_e = light_e + self.rates.most_e(facts.exposure_s, facts.storage_s_max, facts.dies);
        let gain_e = self.prnu * light_e;
        (mean_e, gain_e * gain_e + self.dsnu_e * self.dsnu_e)
    }
}

/// Bound of the charge over the well, where it is rare: where both moments fall below what the charge itself spreads.
///
/// With x the charge over the full well and any theta > 0: x <= exp(theta x - 1) / theta and
/// x^2 <= 4 exp(theta x - 2) / theta^2, so both moments follow from the generating function of the charge, Poisson plus
/// normal patterns (Chernoff).
pub(super) fn well_excess(mean_e: f64, pattern_e2: f64, capacity_e: f64) -> Option<Omission> {
    let variance_e2 = mean_e + pattern_e2;
    let room_e = capacity_e - mean_e;
    if variance_e2 <= 0.0 {
        return Some(Omission::NONE);
    }
    if room_e <= 0.0 {
        return None;
    }
    let theta = libm::log1p(room_e / variance_e2);
    let exponent = mean_e * libm::expm1(theta) + 0.5 * theta * theta * pattern_e2 - theta * capacity_e;
    let (first, second) = (libm::exp(exponent - 1.0) / theta, 4.0 * libm::exp(exponent - 2.0) / (theta * theta));
    (second < variance_e2).then_some(Omission { bias_e: first, variance_e2: second })
}

/// Mean electrons, or electrons, from which on a pixel ends at its full well whatever shot noise, dark charge and dark offset draw.
///
/// No uniform of 32 bits lies more than `NORMAL_MAX` sigma out, and the Poisson quantile at z lies above m + z sqrt(m) for z below
/// -1 (its Cornish-Fisher expansion adds (z^2 - 1) / 6). So m - 7 sqrt(m) - 10 is below every count of the mean m, dark charge only
/// adds, and a dark offset takes away 7 sigma at most. A millionth covers the roundings of f32 on the way (each 6e-8).
pub fn saturated_from_e(params: &PixelParams) -> f32 {
    const { assert!(NORMAL_MAX < 7.0) };
    let needed_e = params.full_well_e * (1.0 + 1e-6) + 10.0 + 7.0 * params.dsnu_e;
    let root = 0.5 * (7.0 + (49.0 + 4.0 * needed_e).sqrt());
    f32_nearest(root * root * (1.0 + 1e-6))
}

impl Effect for FullWell {
    fn identity(&self) -> Identity {
        Identity { name: "full_well", number: EffectNumber(105), domain: Domain::SensedElectrons }
    }

    /// Near the full well and above it the excess itself is the bias, with the charge's own spread.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let (mean_e, pattern_e2) = self.mean_and_pattern(facts);
        let rare = well_excess(mean_e, pattern_e2, self.capacity_e);
        rare.or_else(|| {
            let variance_e2 = mean_e + pattern_e2;
            Some(Omission { bias_e: greater(0.0, mean_e - self.capacity_e) + variance_e2.sqrt(), variance_e2 })
        })
    }

    fn reason(&self, facts: &Facts) -> String {
        let (mean_e, pattern_e2) = self.mean_and_pattern(facts);
        let sigmas = (self.capacity_e - mean_e) / greater(1.0, mean_e + pattern_e2).sqrt();
        format!("{mean_e:.0} e- at most, {sigmas:.1} sigma from the full well of {} e-", self.capacity_e)
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        clip_above(row.values, f32_nearest(self.capacity_e));
    }
}
