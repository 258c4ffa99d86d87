//! Dark current. Enters: electrons. Leaves: electrons with the dark charge of exposure and storage added.
//!
//! Model: a Poisson draw of its own with mean rate(T) (exposure + storage); the rate is given at 300 K and doubles every
//! `dark_doubling_k` (EMVA 1288 release 4.0, section on dark current).

use super::{PixelParams, add_scaled};
use crate::draw::{EffectNumber, fill_uniforms, poisson_of_one_mean};
use crate::effect::{Domain, Effect, Omission, RowPass};
use crate::facts::Facts;
use crate::num::f32_nearest;

/// Charge that gathers without light.
pub struct DarkCurrent {
    rate_e_per_s: f64,
}

impl DarkCurrent {
    /// Published number.
    pub const NUMBER: EffectNumber = EffectNumber(103);

    /// `None` where no dark charge gathers.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        let rate_e_per_s = params.dark_current_now_e_per_s();
        (rate_e_per_s > 0.0).then(|| Box::new(Self { rate_e_per_s }) as Box<dyn Effect>)
    }

    fn most_e(&self, facts: &Facts) -> f64 {
        self.rate_e_per_s * (facts.exposure_s + facts.storage_s_max)
    }
}

impl Effect for DarkCurrent {
    fn name(&self) -> &'static str {
        "dark_current"
    }

    fn number(&self) -> EffectNumber {
        Self::NUMBER
    }

    fn domain(&self) -> Domain {
        Domain::Electrons
    }

    fn cost_ns_per_px(&self) -> f64 {
        0.6
    }

    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let most_e = self.most_e(facts);
        Some(Omission { bias_e: most_e, variance_e2: most_e })
    }

    fn reason(&self, facts: &Facts) -> String {
        let time_ms = 1e3 * (facts.exposure_s + facts.storage_s_max);
        format!("at most {:.3e} e- in {time_ms:.3} ms at {} K", self.most_e(facts), facts.temperature_k)
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let mean_e = f32_nearest(self.rate_e_per_s * (row.exposure_s + row.storage_s));
        fill_uniforms(row.temporal_key(Self::NUMBER), row.uniforms);
        poisson_of_one_mean(row.uniforms, mean_e, row.draws);
        add_scaled(row.values, row.draws, 1.0);
    }
}
