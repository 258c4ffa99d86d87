//! Leakage of the storage node. Removes the electrons that leave the node before the row is read.
//!
//! Model: each electron leaves at a constant rate, so a wait t loses 1 - exp(-rate t) of them: first-order decay, the linear part of
//! junction and sub-threshold leakage (their dependence on the charge that is left is not modelled). Electrons go one by one, a
//! binomial draw: what is left of a Poisson count is Poisson.

use super::params::PixelParams;
use super::row::add_scaled;
use super::thinning::binomial;
use crate::draw::{EffectNumber, fill_uniforms};
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;

/// Charge lost while a row waits.
pub struct StorageLeakage {
    rate_per_s: f64,
    prnu: f64,
}

impl StorageLeakage {
    const NUMBER: EffectNumber = EffectNumber(109);

    /// `None` where the storage node is tight.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        let effect = Self { rate_per_s: params.storage_leakage_per_s, prnu: params.prnu };
        (effect.rate_per_s > 0.0).then(|| Box::new(effect) as Box<dyn Effect>)
    }

    fn share(&self, storage_s: f64) -> f64 {
        -libm::expm1(-self.rate_per_s * storage_s)
    }
}

impl Effect for StorageLeakage {
    fn identity(&self) -> Identity {
        Identity { name: "storage_leakage", number: Self::NUMBER, domain: Domain::SensedElectrons }
    }

    /// What is lost of a Poisson charge is Poisson, so its variance is its mean; of a pattern it is the share.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let share = self.share(facts.storage_s_max);
        let bias_e = share * (facts.signal_e_max + facts.dark_mean_e);
        let most_e = share * (facts.signal_e_max + facts.dark_rms_e);
        let (gain_e, dark_e) = (share * self.prnu * facts.signal_e_max, share * facts.dark_rms_e);
        Some(Omission { bias_e, variance_e2: most_e + gain_e * gain_e + dark_e * dark_e })
    }

    fn reason(&self, facts: &Facts) -> String {
        let share = self.share(facts.storage_s_max);
        format!("{:.3e} of {} in {:.3} ms", share, facts.signal_words(), 1e3 * facts.storage_s_max)
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let share = self.share(row.storage_s);
        if share > 0.0 {
            fill_uniforms(row.temporal_key(Self::NUMBER), row.uniforms);
            binomial(row.values, share, row.uniforms, row.draws);
            add_scaled(row.values, row.draws, -1.0);
        }
    }
}
