//! Photo-response non-uniformity. Scales the mean photoelectrons by each pixel's response.
//!
//! Model: a normal gain of mean 1 and sigma `prnu` for each pixel of the die (EMVA 1288 release 4.0, PRNU without its
//! structured part).

use super::params::PixelParams;
use super::pattern::Pattern;
use super::row::scale_by_pattern;
use super::well_bias::WellBias;
use crate::draw::EffectNumber;
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;
use crate::num::{f32_nearest, lesser};

/// Photo-response non-uniformity of the die.
pub struct Prnu {
    sigma: f64,
    curves: WellBias,
    pattern: Pattern,
}

impl Prnu {
    const NUMBER: EffectNumber = EffectNumber(101);

    /// `None` where all pixels respond alike.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        let (sigma, curves) = (params.prnu, WellBias::of(params));
        (sigma > 0.0).then(|| Box::new(Self { sigma, curves, pattern: Pattern::default() }) as Box<dyn Effect>)
    }
}

impl Effect for Prnu {
    fn identity(&self) -> Identity {
        Identity { name: "prnu", number: Self::NUMBER, domain: Domain::MeanElectrons }
    }

    /// The response acts before photoelectrons are counted. Under one uniform, the counts of two means that differ by d differ by
    /// d (1 + z / (2 sqrt(mean))) rounded to a whole number one way or the other: variance d^2 (1 + 1 / (4 mean)), and at
    /// most |d|, and at most a quarter, for the rounding. The mean of |d| is sqrt(2 / pi) of its sigma.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let sigma_e = self.sigma * facts.signal_e_max;
        let counting_e2 = 0.25 * self.sigma * sigma_e + lesser(0.8 * sigma_e, 0.25);
        let bias_e = self.curves.of_pattern_e(facts, self.sigma, 0.0);
        Some(Omission { bias_e, variance_e2: sigma_e * sigma_e + counting_e2 })
    }

    fn reason(&self, facts: &Facts) -> String {
        let sigma_e = self.sigma * facts.signal_e_max;
        format!("{:.2} % of {} is {sigma_e:.3} e- between pixels", 100.0 * self.sigma, facts.signal_words())
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let pattern = self.pattern.normals(row.pattern_key(Self::NUMBER), row.uniforms);
        scale_by_pattern(row.values, &pattern, f32_nearest(self.sigma));
    }
}
