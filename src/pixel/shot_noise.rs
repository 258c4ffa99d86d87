//! Shot noise. Converts mean photoelectrons to whole electrons.
//!
//! Model: each pixel's charge is an exact Poisson draw of its mean (photodetection as a Poisson process; Saleh and Teich,
//! "Fundamentals of Photonics"), the quantile of the column's uniform.

use super::params::PixelParams;
use super::well_bias::WellBias;
use crate::draw::{EffectNumber, fill_uniforms, poisson};
use crate::effect::{Domain, Effect, Identity, Omission, RowPass, all_empty, all_full};
use crate::facts::Facts;

/// The Poisson nature of light.
pub struct ShotNoise {
    curves: WellBias,
}

impl ShotNoise {
    const NUMBER: EffectNumber = EffectNumber(102);

    /// Every pixel has it.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        Some(Box::new(Self { curves: WellBias::of(params) }))
    }
}

impl Effect for ShotNoise {
    fn identity(&self) -> Identity {
        Identity { name: "shot_noise", number: Self::NUMBER, domain: Domain::MeanElectrons }
    }

    /// The draws have the mean of the light; the well clips what is above it.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        Some(Omission { bias_e: self.curves.of_shot_e(facts), variance_e2: facts.signal_e_max })
    }

    fn reason(&self, facts: &Facts) -> String {
        format!("{:.2} e- at {}", facts.signal_e_max.sqrt(), facts.signal_words())
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        // A mean of 0 counts 0, and a pixel far beyond its well ends at the well for every draw.
        let saturated_from_e = row.saturated_from_e;
        let runs = row.in_need(|part| all_empty(part) || all_full(part, saturated_from_e));
        if runs.is_empty() {
            return;
        }
        fill_uniforms(row.temporal_key(Self::NUMBER), row.uniforms);
        for run in runs {
            poisson(&row.uniforms[run.clone()], &mut row.values[run]);
        }
    }
}
