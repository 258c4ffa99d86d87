//! Column gain errors. Scales the microvolts of each column by that column's gain.
//!
//! Model: a normal gain of mean 1 and sigma `column_gain_sigma` for each column of the die (column amplifier and ramp tap
//! mismatch), equal in all rows and frames.

use super::params::AdcParams;
use crate::draw::EffectNumber;
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;
use crate::num::f32_nearest;
use crate::pixel::{Pattern, scale_by_pattern};

/// Mismatch of the columns' gains.
pub struct ColumnGain {
    sigma: f64,
    pattern: Pattern,
}

impl ColumnGain {
    const NUMBER: EffectNumber = EffectNumber(201);

    /// `None` where all columns have one gain.
    pub fn from_params(params: &AdcParams) -> Option<Box<dyn Effect>> {
        let sigma = params.column_gain_sigma;
        (sigma > 0.0).then(|| Box::new(Self { sigma, pattern: Pattern::default() }) as Box<dyn Effect>)
    }
}

impl Effect for ColumnGain {
    fn identity(&self) -> Identity {
        Identity { name: "column_gain", number: Self::NUMBER, domain: Domain::Microvolts }
    }

    /// The gain acts on all that reaches the column: on the drawn charge, whose second moment is its mean squared plus its shot
    /// noise, and on what is there in the dark, noise too.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let most_e = facts.signal_e_max + facts.dark_rms_e;
        let second_e2 = most_e * most_e + facts.signal_e_max;
        Some(Omission { bias_e: 0.0, variance_e2: self.sigma * self.sigma * second_e2 })
    }

    fn reason(&self, facts: &Facts) -> String {
        let sigma_e = self.sigma * facts.signal_e_max;
        format!("{:.3} % of {} is {sigma_e:.3} e- between columns", 100.0 * self.sigma, facts.signal_words())
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let pattern = self.pattern.normals(row.column_pattern_key(Self::NUMBER), row.uniforms);
        scale_by_pattern(row.values, &pattern, f32_nearest(self.sigma));
        if !row.reset.is_empty() {
            scale_by_pattern(row.reset, &pattern, f32_nearest(self.sigma));
        }
    }
}
