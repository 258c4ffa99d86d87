//! Noise of the samples. Adds a normal draw to each sample, in microvolts.
//!
//! One type for every noise that is a normal draw per pixel, frame and sample. Where reset and signal are converted separately (digital
//! CDS) each sample has its draw; else one draw represents the difference.

use super::row::add_scaled;
use crate::draw::{EffectNumber, fill_uniforms, normals};
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;
use crate::num::f32_nearest;

/// How the reset level is taken off the signal, as far as noise is concerned.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum SampledLevels {
    /// The signal alone is sampled and converted.
    Signal,
    /// Both are sampled, their difference is converted.
    Difference,
    /// Both are sampled and converted, and their codes subtracted.
    Both,
}

impl SampledLevels {
    /// Whether reset and signal are both sampled.
    pub fn is_double(self) -> bool {
        self != Self::Signal
    }
}

/// The samples with the time between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleTiming {
    /// What is sampled and what is converted.
    pub samples: SampledLevels,
    /// From the reset sample to the signal sample in seconds; 0 where there is no reset sample.
    pub interval_s: f64,
}

/// Sigma of the draws in the two samples.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SampleSigmas {
    /// Of the signal sample (or of the difference), in uV.
    pub signal_uv: f64,
    /// Of the reset sample in uV; 0 where it is not converted separately.
    pub reset_uv: f64,
}

impl SampleSigmas {
    /// Splits a sigma that holds for the difference evenly over the samples that are converted.
    pub fn of_difference(sigma_uv: f64, samples: SampledLevels) -> Self {
        match samples {
            SampledLevels::Signal | SampledLevels::Difference => Self { signal_uv: sigma_uv, reset_uv: 0.0 },
            SampledLevels::Both => {
                let each_uv = sigma_uv * core::f64::consts::FRAC_1_SQRT_2;
                Self { signal_uv: each_uv, reset_uv: each_uv }
            }
        }
    }

    /// For a sigma that each sample has on its own.
    pub fn of_each(sigma_uv: f64, samples: SampledLevels) -> Self {
        match samples {
            SampledLevels::Signal => Self { signal_uv: sigma_uv, reset_uv: 0.0 },
            SampledLevels::Difference => Self { signal_uv: sigma_uv * core::f64::consts::SQRT_2, reset_uv: 0.0 },
            SampledLevels::Both => Self { signal_uv: sigma_uv, reset_uv: sigma_uv },
        }
    }

    /// Variance of the difference in uV^2.
    pub fn variance_uv2(self) -> f64 {
        self.signal_uv * self.signal_uv + self.reset_uv * self.reset_uv
    }

    /// What leaving the draws out changes in a pixel.
    pub fn omission(self, facts: &Facts) -> Omission {
        let gain = facts.conversion_gain_uv_per_e;
        Omission { bias_e: 0.0, variance_e2: self.variance_uv2() / (gain * gain) }
    }
}

/// A normal draw per pixel, frame and sample.
pub struct SampleNoise {
    name: &'static str,
    number: EffectNumber,
    sigmas: SampleSigmas,
}

impl SampleNoise {
    /// Under a published number; `None` where both sigmas are 0.
    pub fn boxed(name: &'static str, number: u64, sigmas: SampleSigmas) -> Option<Box<dyn Effect>> {
        let effect = Self { name, number: EffectNumber(number), sigmas };
        (sigmas.variance_uv2() > 0.0).then(|| Box::new(effect) as Box<dyn Effect>)
    }
}

impl Effect for SampleNoise {
    fn identity(&self) -> Identity {
        Identity { name: self.name, number: self.number, domain: Domain::Microvolts }
    }

    fn cost_case(&self) -> &'static str {
        if self.sigmas.reset_uv > 0.0 { "both" } else { "" }
    }

    fn omission(&self, facts: &Facts) -> Option<Omission> {
        Some(self.sigmas.omission(facts))
    }

    fn reason(&self, facts: &Facts) -> String {
        let sigma_uv = self.sigmas.variance_uv2().sqrt();
        format!("{sigma_uv:.1} uV is {:.2} e- after sampling", sigma_uv / facts.conversion_gain_uv_per_e)
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        if self.sigmas.signal_uv > 0.0 {
            fill_uniforms(row.temporal_key(self.number), row.uniforms);
            normals(row.uniforms, row.draws);
            add_scaled(row.values, row.draws, f32_nearest(self.sigmas.signal_uv));
        }
        if self.sigmas.reset_uv > 0.0 && !row.reset.is_empty() {
            fill_uniforms(row.reset_key(self.number), row.uniforms);
            normals(row.uniforms, row.draws);
            add_scaled(row.reset, row.draws, f32_nearest(self.sigmas.reset_uv));
        }
    }
}
