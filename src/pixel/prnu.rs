//! Photo-response non-uniformity. Enters: mean photoelectrons. Leaves: the same, scaled by each pixel's own response.
//!
//! Model: a normal gain of mean 1 and sigma `prnu` for each pixel of the die (EMVA 1288 release 4.0, PRNU without its
//! structured part).

use super::{Pattern, PixelParams, scale_by_pattern};
use crate::draw::EffectNumber;
use crate::effect::{Domain, Effect, Omission, RowPass};
use crate::facts::Facts;
use crate::num::f32_nearest;

/// Photo-response non-uniformity of the die.
pub struct Prnu {
    sigma: f64,
    pattern: Pattern,
}

impl Prnu {
    /// Published number.
    pub const NUMBER: EffectNumber = EffectNumber(101);

    /// `None` where all pixels respond alike.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        (params.prnu > 0.0)
            .then(|| Box::new(Self { sigma: params.prnu, pattern: Pattern::default() }) as Box<dyn Effect>)
    }
}

impl Effect for Prnu {
    fn name(&self) -> &'static str {
        "prnu"
    }

    fn number(&self) -> EffectNumber {
        Self::NUMBER
    }

    fn domain(&self) -> Domain {
        Domain::MeanElectrons
    }

    fn cost_ns_per_px(&self) -> f64 {
        0.3
    }

    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let sigma_e = self.sigma * facts.signal_e_max;
        Some(Omission { bias_e: 0.0, variance_e2: sigma_e * sigma_e })
    }

    fn reason(&self, facts: &Facts) -> String {
        let sigma_e = self.sigma * facts.signal_e_max;
        format!("{:.2} % of {:.0} e- is {sigma_e:.3} e- between pixels", 100.0 * self.sigma, facts.signal_e_max)
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let pattern = self.pattern.normals(row.pattern_key(Self::NUMBER), row.uniforms);
        scale_by_pattern(row.values, &pattern, f32_nearest(self.sigma));
    }
}
