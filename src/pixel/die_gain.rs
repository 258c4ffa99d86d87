//! Gain of the die. Scales the microvolts of the charge by this die's deviation from the mean conversion gain of all dies.
//!
//! Model: one normal deviate of relative sigma `die_gain_sigma` a die and camera, equal in all pixels and frames: the floating diffusion's
//! capacitance follows the process.

use super::die::Die;
use super::params::PixelParams;
use super::row::scale_all;
use crate::draw::EffectNumber;
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::{DieSpread, Facts};
use crate::num::f32_nearest;

/// Die-to-die spread of the conversion gain.
pub struct DieGain {
    sigma: f64,
    prnu: f64,
}

impl DieGain {
    pub(super) const NUMBER: EffectNumber = EffectNumber(119);

    /// `None` where dies do not differ.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        let sigma = params.die_gain_sigma;
        (sigma > 0.0).then(|| Box::new(Self { sigma, prnu: params.prnu }) as Box<dyn Effect>)
    }
}

/// The greatest factor of these dies.
pub fn die_gain_max(params: &PixelParams, dies: DieSpread) -> f64 {
    1.0 + dies.gain_sigmas * params.die_gain_sigma
}

impl Effect for DieGain {
    fn identity(&self) -> Identity {
        Identity { name: "die_gain", number: Self::NUMBER, domain: Domain::Microvolts }
    }

    /// For the die of the rig that lies farthest out; the charge's own noise is scaled with it.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let most = facts.dies.gain_sigmas * self.sigma;
        let (charge_e, mean_e) = (facts.signal_e_max + facts.dark_rms_e, facts.signal_e_max + facts.dark_mean_e);
        let pattern_e = self.prnu * facts.signal_e_max;
        let noise_e2 = charge_e + facts.dark_rms_e * facts.dark_rms_e + pattern_e * pattern_e;
        Some(Omission { bias_e: most * mean_e, variance_e2: most * most * noise_e2 })
    }

    fn reason(&self, facts: &Facts) -> String {
        format!("{:.2} % of {} between dies", 100.0 * self.sigma, facts.signal_words())
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let factor = 1.0 + self.sigma * Die::of(row).deviation(Self::NUMBER);
        scale_all(row.values, f32_nearest(factor));
    }
}
