//! Parasitic light. Adds the light that falls on the storage node while a row waits, in mean photoelectrons.
//!
//! Model: the storage node responds to light with `parasitic_light` of the photodiode's sensitivity (1/PLS of global-shutter
//! datasheets), so a row that waits gathers an additional signal * parasitic_light * wait / exposure. The light of the exposure is taken to
//! last through the wait; an exposure of 0 s gathers no light. It acts before photoelectrons are counted.

use super::params::PixelParams;
use super::row::scale_all;
use crate::draw::EffectNumber;
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;
use crate::num::{f32_nearest, lesser};

/// Light on the storage node.
pub struct ParasiticLight {
    response: f64,
    prnu: f64,
}

/// Parasitic light relative to the signal.
pub fn parasitic_share(params: &PixelParams, exposure_s: f64, storage_s: f64) -> f64 {
    share(params.parasitic_light, exposure_s, storage_s)
}

fn share(response: f64, exposure_s: f64, storage_s: f64) -> f64 {
    if exposure_s > 0.0 { response * storage_s / exposure_s } else { 0.0 }
}

impl ParasiticLight {
    /// `None` where the storage node is dark.
    pub fn from_params(params: &PixelParams) -> Option<Box<dyn Effect>> {
        let effect = Self { response: params.parasitic_light, prnu: params.prnu };
        (params.parasitic_light > 0.0).then(|| Box::new(effect) as Box<dyn Effect>)
    }

    /// Greatest mean of the parasitic light; the signal of the facts holds it already.
    fn most_e(&self, facts: &Facts) -> f64 {
        let share = share(self.response, facts.exposure_s, facts.storage_s_max);
        facts.signal_e_max * share / (1.0 + share)
    }
}

impl Effect for ParasiticLight {
    fn identity(&self) -> Identity {
        Identity { name: "parasitic_light", number: EffectNumber(108), domain: Domain::MeanElectrons }
    }

    /// Under one uniform, the counts of two means that differ by d differ by d (1 + z / (2 sqrt(mean))) rounded one way or
    /// the other (as in `Prnu::omission`): variance d^2 / (4 mean), with d at most the mean d / 4, and at most d and a quarter for
    /// the rounding; and d has the response's pattern.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let most_e = self.most_e(facts);
        let pattern_e = self.prnu * most_e;
        let share = share(self.response, facts.exposure_s, facts.storage_s_max);
        let counting_e2 = 0.25 * most_e * share + lesser(most_e, 0.25);
        Some(Omission { bias_e: most_e, variance_e2: pattern_e * pattern_e + counting_e2 })
    }

    fn reason(&self, facts: &Facts) -> String {
        let wait_ms = 1e3 * facts.storage_s_max;
        format!("{:.3e} e- in the row that waits {wait_ms:.3} ms", self.most_e(facts))
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let share = share(self.response, row.exposure_s, row.storage_s);
        if share > 0.0 {
            scale_all(row.values, f32_nearest(1.0 + share));
        }
    }
}
