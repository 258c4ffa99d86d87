//! Offset of the die. Shifts the microvolts of the signal sample by this die's deviation from the mean black level of all dies.
//!
//! Model: one normal deviate of sigma `die_offset_uv` a die and camera, equal in all pixels and frames, which double sampling does not
//! remove: what the references of ramp and black level differ by. It acts after the columns' gains.

use super::die::Die;
use super::params::PixelParams;
use super::row::add_to_all;
use crate::draw::EffectNumber;
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;
use crate::num::f32_nearest;

/// Die-to-die spread of the black level.
pub struct DieOffset {
    sigma_uv: f64,
}

impl DieOffset {
    pub(super) const NUMBER: EffectNumber = EffectNumber(118);

    /// `None` where dies do not differ.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        let sigma_uv = params.die_offset_uv;
        (sigma_uv > 0.0).then(|| Box::new(Self { sigma_uv }) as Box<dyn Effect>)
    }
}

impl Effect for DieOffset {
    fn identity(&self) -> Identity {
        Identity { name: "die_offset", number: Self::NUMBER, domain: Domain::Microvolts }
    }

    /// For the die of the rig that lies farthest out.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let bias_e = facts.dies.offset_sigmas * self.sigma_uv / facts.conversion_gain_uv_per_e;
        Some(Omission { bias_e, variance_e2: 0.0 })
    }

    fn reason(&self, facts: &Facts) -> String {
        let sigma_e = self.sigma_uv / facts.conversion_gain_uv_per_e;
        format!("{:.1} uV is {sigma_e:.2} e- between dies", self.sigma_uv)
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let offset_uv = self.sigma_uv * Die::of(row).deviation(Self::NUMBER);
        add_to_all(row.values, f32_nearest(offset_uv));
    }
}
