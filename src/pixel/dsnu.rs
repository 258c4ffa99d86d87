//! Dark-signal non-uniformity. Enters: electrons. Leaves: electrons with each pixel's own dark offset added.
//!
//! Model: a normal offset of sigma `dsnu_e` for each pixel of the die, independent of exposure (EMVA 1288 release 4.0, DSNU
//! without its structured part).

use super::{Pattern, PixelParams, add_scaled};
use crate::draw::EffectNumber;
use crate::effect::{Domain, Effect, Omission, RowPass};
use crate::facts::Facts;
use crate::num::f32_nearest;

/// Dark offsets of the die.
pub struct Dsnu {
    sigma_e: f64,
    pattern: Pattern,
}

impl Dsnu {
    /// Published number.
    pub const NUMBER: EffectNumber = EffectNumber(104);

    /// `None` where all pixels are dark alike.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        let sigma_e = params.dsnu_e;
        (sigma_e > 0.0).then(|| Box::new(Self { sigma_e, pattern: Pattern::default() }) as Box<dyn Effect>)
    }
}

impl Effect for Dsnu {
    fn name(&self) -> &'static str {
        "dsnu"
    }

    fn number(&self) -> EffectNumber {
        Self::NUMBER
    }

    fn domain(&self) -> Domain {
        Domain::Electrons
    }

    fn omission(&self, _facts: &Facts) -> Option<Omission> {
        Some(Omission { bias_e: 0.0, variance_e2: self.sigma_e * self.sigma_e })
    }

    fn reason(&self, _facts: &Facts) -> String {
        format!("{} e- between pixels in the dark", self.sigma_e)
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let pattern = self.pattern.normals(row.pattern_key(Self::NUMBER), row.uniforms);
        add_scaled(row.values, &pattern, f32_nearest(self.sigma_e));
    }
}
