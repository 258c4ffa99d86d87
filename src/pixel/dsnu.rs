//! Dark-signal non-uniformity. Adds each pixel's fixed dark offset, in electrons.
//!
//! Model: a normal offset of sigma `dsnu_e` for each pixel of the die, independent of exposure (EMVA 1288 release 4.0, DSNU
//! without its structured part).

use super::params::PixelParams;
use super::pattern::Pattern;
use super::row::add_scaled;
use super::well_bias::WellBias;
use crate::draw::EffectNumber;
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;
use crate::num::f32_nearest;

/// Dark offsets of the die.
pub struct Dsnu {
    sigma_e: f64,
    curves: WellBias,
    pattern: Pattern,
}

impl Dsnu {
    const NUMBER: EffectNumber = EffectNumber(104);

    /// `None` where all pixels are dark alike.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        let (sigma_e, curves) = (params.dsnu_e, WellBias::of(params));
        (sigma_e > 0.0).then(|| Box::new(Self { sigma_e, curves, pattern: Pattern::default() }) as Box<dyn Effect>)
    }
}

impl Effect for Dsnu {
    fn identity(&self) -> Identity {
        Identity { name: "dsnu", number: Self::NUMBER, domain: Domain::Electrons }
    }

    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let bias_e = self.curves.of_pattern_e(facts, 0.0, self.sigma_e);
        Some(Omission { bias_e, variance_e2: self.sigma_e * self.sigma_e })
    }

    fn reason(&self, _facts: &Facts) -> String {
        format!("{} e- between pixels in the dark", self.sigma_e)
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let pattern = self.pattern.normals(row.pattern_key(Self::NUMBER), row.uniforms);
        add_scaled(row.values, &pattern, f32_nearest(self.sigma_e));
    }
}
