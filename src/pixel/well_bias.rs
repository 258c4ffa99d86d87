//! Bounds the shift of the mean, in electrons, that the curvature after the charge makes of a spread of mean 0: the well clips shot noise
//! and patterns, and the gain bends.
//!
//! With X the charge, C the full well: without a spread of X the mean of min(X, C) grows, by no more than the mean of (X - C)+ with it
//! (Jensen), and by no more than that of (C - X)+. Effects are removed one after the other, shot noise last, so that patterns
//! are judged under a Poisson charge.

use super::dark_rates::DarkRates;
use super::full_well::well_excess;
use super::params::PixelParams;
use crate::facts::Facts;
use crate::num::{greater, lesser};

/// The curves of a pixel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct WellBias {
    capacity_e: f64,
    rates: DarkRates,
    prnu: f64,
    dsnu_e: f64,
    blooms: bool,
    compression: f64,
}

impl WellBias {
    pub(super) fn of(params: &PixelParams) -> Self {
        Self {
            capacity_e: params.full_well_e,
            rates: DarkRates::of(params),
            prnu: params.prnu,
            dsnu_e: params.dsnu_e,
            blooms: params.blooming > 0.0,
            compression: params.gain_compression,
        }
    }

    /// Of shot noise: half the mean distance from the mean is at most sigma / 2.
    pub(super) fn of_shot_e(&self, facts: &Facts) -> f64 {
        let own_e = 0.5 * self.light_e(facts).sqrt();
        lesser(own_e, self.rare_e(facts)) + self.bent_e(facts, facts.signal_e_max)
    }

    /// Of a pattern of that sigma a unit of light, or of no light. Under a Poisson charge the slope of the clipped mean changes by at most
    /// p, the greatest probability of one count, over each electron: p (sigma^2 / 2 + E |d|), with one count more for where they stand.
    pub(super) fn of_pattern_e(&self, facts: &Facts, per_light: f64, fixed_e: f64) -> f64 {
        let sigma_of = |light_e: f64| per_light * light_e + fixed_e;
        let sigma_e = sigma_of(self.light_e(facts));
        // The mode k holds k^k exp(-k) / k! <= 1 / sqrt(2 pi k), and a pattern takes a pixel below half its mean in no draw that counts.
        let count = greater(0.5 * facts.signal_e_min - 1.0, 0.0);
        let most = lesser(1.0, 1.0 / (core::f64::consts::TAU * count).sqrt());
        let smooth_e = most * (0.5 * sigma_e * sigma_e + 0.8 * sigma_e);
        let own_e = sigma_of(facts.signal_e_max);
        lesser(lesser(0.5 * sigma_e, smooth_e), self.rare_e(facts)) + self.bent_e(facts, own_e * own_e)
    }

    /// Light of the pixel, or of those whose charge may reach it.
    fn light_e(&self, facts: &Facts) -> f64 {
        if self.blooms { facts.frame_e_max } else { facts.signal_e_max }
    }

    /// Where the charge hardly ever comes to the well, or hardly ever below it.
    fn rare_e(&self, facts: &Facts) -> f64 {
        let light_e = self.light_e(facts);
        let pattern_e2 = |light_e: f64| self.prnu * self.prnu * light_e * light_e + self.dsnu_e * self.dsnu_e;
        let dark_e = self.rates.most_e(facts.exposure_s, facts.storage_s_max, facts.dies);
        let above_e = well_excess(light_e + dark_e, pattern_e2(light_e), self.capacity_e)
            .map_or(f64::INFINITY, |excess| excess.bias_e);
        lesser(above_e, self.below_e(facts, pattern_e2(light_e)))
    }

    /// Mean of (C - X)+: with d the least mean's distance beyond the well, (C - X)+ <= exp(t (C - X) - 1) / t for any t > 0, and below its
    /// mean a Poisson charge falls off at least as a normal of its variance; t = d / v.
    fn below_e(&self, facts: &Facts, pattern_e2: f64) -> f64 {
        let (beyond_e, variance_e2) = (facts.signal_e_min - self.capacity_e, facts.signal_e_max + pattern_e2);
        if self.blooms || beyond_e <= 0.0 {
            return f64::INFINITY; // Neighbours may be at the well.
        }
        libm::exp(-0.5 * beyond_e * beyond_e / variance_e2 - 1.0) * variance_e2 / beyond_e
    }

    /// The compressed gain's curve is c N^2 / C, whose mean moves by c / C times the variance.
    fn bent_e(&self, facts: &Facts, variance_e2: f64) -> f64 {
        if facts.signal_e_max > 0.0 { self.compression * variance_e2 / self.capacity_e } else { 0.0 }
    }
}

#[cfg(test)]
pub(super) mod tests {
    use super::*;
    use crate::pixel::ANY_DIE;
    use crate::pixel::params::tests::paper_pixel;

    const WELL_E: f64 = 1000.0;

    /// One pixel's light without anything dark.
    pub(in super::super) fn facts(light_e: f64) -> Facts {
        Facts {
            is_capped: false,
            signal_e_min: light_e,
            signal_e_max: light_e,
            frame_e_max: light_e,
            dark_mean_e: 0.0,
            dark_rms_e: 0.0,
            exposure_s: 0.0,
            storage_s_max: 0.0,
            temperature_k: 300.0,
            dies: ANY_DIE,
            conversion_gain_uv_per_e: 10.0,
            spill_slope_max: 1.0,
            gain_slope_max: 1.0,
        }
    }

    /// Mean of a Poisson count clipped at the well: 8000 terms, each to 1e-12 of itself.
    fn clipped_mean_e(mean_e: f64) -> f64 {
        let term = |count: u32| {
            let k = f64::from(count);
            libm::exp(k * libm::log(mean_e) - mean_e - libm::lgamma(k + 1.0)) * lesser(k, WELL_E)
        };
        (0..8000).map(term).sum()
    }

    #[test]
    fn shot_noise_moves_the_mean_by_no_more_than_its_bound_on_both_sides_of_the_well() {
        let params = PixelParams { full_well_e: WELL_E, prnu: 0.0, dsnu_e: 0.0, ..paper_pixel() };
        let curves = WellBias::of(&params);
        let mut nearest = 0.0;
        for light_e in [1.0, 500.0, 700.0, 850.0, 950.0, 990.0, 1000.0, 1010.0, 1050.0, 1200.0, 1500.0, 4000.0] {
            let moved_e = lesser(light_e, WELL_E) - clipped_mean_e(light_e);
            let bound_e = curves.of_shot_e(&facts(light_e));
            // 1e-9 of the mean covers the sum's roundings.
            assert!((-1e-6..=bound_e + 1e-6).contains(&moved_e), "{light_e} e-: {moved_e} of {bound_e}");
            if bound_e > 1.0 {
                nearest = greater(nearest, moved_e / bound_e);
            }
            if !(700.0..1500.0).contains(&light_e) {
                assert!(bound_e < 1e-6, "{light_e} e- is far from the well: {bound_e}");
            }
        }
        // sigma / sqrt(2 pi) of sigma / 2 at the well itself.
        assert!((0.75..0.85).contains(&nearest), "{nearest}");
    }

    /// A pattern of 1 % under a Poisson charge: its normal is cut into 100 steps over twelve sigma, good to 1e-4 of what it moves.
    #[test]
    fn a_pattern_moves_the_mean_by_no_more_than_its_bound() {
        let params = PixelParams { full_well_e: WELL_E, prnu: 0.01, dsnu_e: 0.0, ..paper_pixel() };
        let curves = WellBias::of(&params);
        for light_e in [700.0, 900.0, 1000.0, 1100.0, 1500.0] {
            let step = 12.0 / 100.0;
            let of = |number: u32| {
                let z = -6.0 + step * (f64::from(number) + 0.5);
                let weight = step * libm::exp(-0.5 * z * z) / core::f64::consts::TAU.sqrt();
                weight * clipped_mean_e(light_e * (1.0 + 0.01 * z))
            };
            let moved_e = clipped_mean_e(light_e) - (0..100).map(of).sum::<f64>();
            let bound_e = curves.of_pattern_e(&facts(light_e), 0.01, 0.0);
            assert!(moved_e.abs() <= bound_e + 1e-3, "{light_e} e-: {moved_e} of {bound_e}");
        }
    }
}
