//! Shot noise. Enters: mean photoelectrons. Leaves: electrons.
//!
//! Model: each pixel's charge is an exact Poisson draw of its mean (photodetection as a Poisson process; Saleh and Teich,
//! "Fundamentals of Photonics"), the quantile of the column's uniform.

use super::PixelParams;
use crate::draw::{EffectNumber, fill_uniforms, poisson};
use crate::effect::{Domain, Effect, Omission, RowPass};
use crate::facts::Facts;

/// The Poisson nature of light.
pub struct ShotNoise;

impl ShotNoise {
    /// Published number.
    pub const NUMBER: EffectNumber = EffectNumber(102);

    /// Every pixel has it.
    pub fn from_params(_params: &PixelParams) -> Option<Box<dyn Effect>> {
        Some(Box::new(Self))
    }
}

impl Effect for ShotNoise {
    fn name(&self) -> &'static str {
        "shot_noise"
    }

    fn number(&self) -> EffectNumber {
        Self::NUMBER
    }

    fn domain(&self) -> Domain {
        Domain::MeanElectrons
    }

    fn cost_ns_per_px(&self) -> f64 {
        1.9
    }

    fn omission(&self, facts: &Facts) -> Option<Omission> {
        Some(Omission { bias_e: 0.0, variance_e2: facts.signal_e_max })
    }

    fn reason(&self, facts: &Facts) -> String {
        format!("{:.2} e- at {:.0} e-", facts.signal_e_max.sqrt(), facts.signal_e_max)
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        fill_uniforms(row.temporal_key(Self::NUMBER), row.uniforms);
        poisson(row.uniforms, row.values);
    }
}
