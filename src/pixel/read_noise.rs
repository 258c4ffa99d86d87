//! Read noise. Enters: microvolts. Leaves: microvolts with the read chain's noise added.
//!
//! Model: one normal draw of sigma `read_noise_uv` a pixel and frame, after double sampling and at the ADC's input (EMVA 1288
//! release 4.0, temporal dark noise without quantisation).

use super::{PixelParams, add_scaled};
use crate::draw::{EffectNumber, fill_uniforms, normals};
use crate::effect::{Domain, Effect, Omission, RowPass};
use crate::facts::Facts;
use crate::num::f32_nearest;

/// Noise of source follower, column and comparator together.
pub struct ReadNoise {
    sigma_uv: f64,
}

impl ReadNoise {
    /// Published number.
    pub const NUMBER: EffectNumber = EffectNumber(107);

    /// `None` where the chain is silent.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        let sigma_uv = params.read_noise_uv;
        (sigma_uv > 0.0).then(|| Box::new(Self { sigma_uv }) as Box<dyn Effect>)
    }
}

impl Effect for ReadNoise {
    fn name(&self) -> &'static str {
        "read_noise"
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
