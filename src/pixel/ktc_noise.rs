//! Reset noise. Enters: microvolts. Leaves: microvolts with the resets' thermal noise that sampling leaves.
//!
//! Model: sampling a capacitor leaves kT/C; at the ADC's input sqrt(A k T g / q) a reset (DESIGN: sensing). Double sampling
//! removes it where both samples share a reset (4T, 6T), doubles its variance where they do not (3T, 5T).

use super::{PixelParams, add_scaled};
use crate::draw::{EffectNumber, fill_uniforms, normals};
use crate::effect::{Domain, Effect, Omission, RowPass};
use crate::facts::Facts;
use crate::num::f32_nearest;

/// Thermal noise of the reset, as far as sampling leaves it.
pub struct KtcNoise {
    sigma_uv: f64,
}

impl KtcNoise {
    /// Published number.
    pub const NUMBER: EffectNumber = EffectNumber(106);

    /// `None` where double sampling removes it.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        let sigma_uv = params.ktc_of_one_reset_uv() * params.ktc_resets().sqrt();
        (sigma_uv > 0.0).then(|| Box::new(Self { sigma_uv }) as Box<dyn Effect>)
    }
}

impl Effect for KtcNoise {
    fn name(&self) -> &'static str {
        "ktc_noise"
    }

    fn number(&self) -> EffectNumber {
        Self::NUMBER
    }

    fn domain(&self) -> Domain {
        Domain::Microvolts
    }

    fn cost_ns_per_px(&self) -> f64 {
        1.3
    }

    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let sigma_e = self.sigma_uv / facts.conversion_gain_uv_per_e;
        Some(Omission { bias_e: 0.0, variance_e2: sigma_e * sigma_e })
    }

    fn reason(&self, facts: &Facts) -> String {
        let sigma_e = self.sigma_uv / facts.conversion_gain_uv_per_e;
        format!("{:.1} uV is {sigma_e:.2} e- after sampling", self.sigma_uv)
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        fill_uniforms(row.temporal_key(Self::NUMBER), row.uniforms);
        normals(row.uniforms, row.draws);
        add_scaled(row.values, row.draws, f32_nearest(self.sigma_uv));
    }
}
