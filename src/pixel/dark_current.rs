//! Dark current. Adds the dark charge of exposure and storage, in electrons.
//!
//! Model: a separate Poisson draw with mean rate(T) exposure + storage rate(T) wait; rates are given at 300 K and double every
//! `dark_doubling_k` (EMVA 1288 release 4.0, section on dark current). Over the pixels of a die each rate has a lognormal factor
//! of mean 1 and sigma `dcnu` (DCNU; lognormal as measured tails of dark current are: Widenhorn et al., "Temperature dependence of
//! dark current in a CCD", SPIE 4669, 2002, show spreads that are skewed like it), photodiode and storage node apart. Over dies
//! all rates share a factor exp(sigma z).

use std::borrow::Cow;

use super::dark_rates::DarkRates;
use super::die::{Die, dark_factor};
use super::params::PixelParams;
use super::row::add_scaled;
use super::row_memory::RowMemory;
use crate::draw::{DrawKey, EffectNumber, fill_uniforms, normals, poisson, poisson_of_one_mean};
use crate::effect::{Domain, Effect, Identity, Omission, RowPass, all_full};
use crate::facts::{Facts, readable};
use crate::num::f32_nearest;

/// Charge that gathers without light.
pub struct DarkCurrent {
    rates: DarkRates,
    factors: RowMemory<f32>,
}

/// Fields of the keys of the patterns of photodiode and storage node.
const PHOTODIODE: u64 = 2;
const STORAGE: u64 = 3;

impl DarkCurrent {
    const NUMBER: EffectNumber = EffectNumber(103);

    /// `None` where no dark charge gathers.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        let rates = DarkRates::of(params);
        let effect = Self { rates, factors: RowMemory::default() };
        (rates.photodiode_e_per_s > 0.0 || rates.storage_e_per_s > 0.0).then(|| Box::new(effect) as Box<dyn Effect>)
    }

    fn most_e(&self, facts: &Facts) -> f64 {
        self.rates.mean_e(facts.exposure_s, facts.storage_s_max, facts.dies)
    }

    /// The lognormal factors of a row's pixels.
    fn factors(&self, key: DrawKey, uniforms: &mut [u32]) -> Cow<'_, [f32]> {
        let s = self.rates.log_sigma();
        self.factors.row(key, uniforms.len(), || {
            fill_uniforms(key, uniforms);
            let mut factors = vec![0.0; uniforms.len()];
            normals(uniforms, &mut factors);
            for factor in &mut factors {
                *factor = f32_nearest(libm::exp(s * f64::from(*factor) - 0.5 * s * s));
            }
            factors
        })
    }
}

impl Effect for DarkCurrent {
    fn identity(&self) -> Identity {
        Identity { name: "dark_current", number: Self::NUMBER, domain: Domain::Electrons }
    }

    fn cost_case(&self) -> &'static str {
        if self.rates.dcnu > 0.0 { "dcnu" } else { "" }
    }

    /// The mean over pixels is the bias; over pixels the charge has its Poisson variance and that of its rate.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let most_e = self.most_e(facts);
        let spread_e = self.rates.dcnu * most_e;
        Some(Omission { bias_e: most_e, variance_e2: most_e + spread_e * spread_e })
    }

    fn reason(&self, facts: &Facts) -> String {
        let (most_e, time_us) = (self.most_e(facts), 1e6 * (facts.exposure_s + facts.storage_s_max));
        format!("{} e- at {} us and {} K", readable(most_e), readable(time_us), facts.temperature_k)
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let saturated_from_e = row.saturated_from_e;
        let runs = row.in_need(|part| all_full(part, saturated_from_e));
        if runs.is_empty() {
            return;
        }
        let factor = dark_factor(self.rates.die_sigma, Die::of(row));
        let exposure_e = factor * self.rates.photodiode_e_per_s * row.exposure_s;
        let storage_e = factor * self.rates.storage_e_per_s * row.storage_s;
        if self.rates.dcnu > 0.0 {
            let key = row.pattern_key(Self::NUMBER);
            row.draws.fill(0.0);
            for (mean_e, field) in [(exposure_e, PHOTODIODE), (storage_e, STORAGE)] {
                if mean_e > 0.0 {
                    let factors = self.factors(key.with(field), row.uniforms);
                    add_scaled(row.draws, &factors, f32_nearest(mean_e));
                }
            }
            fill_uniforms(row.temporal_key(Self::NUMBER), row.uniforms);
            for run in runs.iter().cloned() {
                poisson(&row.uniforms[run.clone()], &mut row.draws[run]);
            }
        } else {
            fill_uniforms(row.temporal_key(Self::NUMBER), row.uniforms);
            let mean_e = f32_nearest(exposure_e + storage_e);
            for run in runs.iter().cloned() {
                poisson_of_one_mean(&row.uniforms[run.clone()], mean_e, &mut row.draws[run]);
            }
        }
        for run in runs {
            add_scaled(&mut row.values[run.clone()], &row.draws[run], 1.0);
        }
    }
}
