//! Column offsets. Adds each column's fixed offset to its microvolts.
//!
//! Model: a normal offset for each column of the die (comparator and amplifier), equal in all rows and frames. A signal alone
//! carries all of `column_offset_uv`; a difference carries `column_offset_residual_uv`. Where both samples are converted, both
//! carry the offset, and the signal also the residual of the difference.

use super::params::AdcParams;
use crate::draw::EffectNumber;
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;
use crate::num::f32_nearest;
use crate::pixel::{Pattern, SampledLevels, add_scaled};

/// Mismatch of the columns' offsets, as far as sampling leaves it.
pub struct ColumnOffset {
    both_uv: f64,
    signal_uv: f64,
    common: Pattern,
    residual: Pattern,
}

impl ColumnOffset {
    const NUMBER: EffectNumber = EffectNumber(202);

    /// `None` where no offset is left.
    pub fn from_params(params: &AdcParams) -> Option<Box<dyn Effect>> {
        let (both_uv, signal_uv) = match params.cds.samples() {
            SampledLevels::Signal => (0.0, params.column_offset_uv),
            SampledLevels::Difference => (0.0, params.column_offset_residual_uv),
            SampledLevels::Both => (params.column_offset_uv, params.column_offset_residual_uv),
        };
        let effect = Self { both_uv, signal_uv, common: Pattern::default(), residual: Pattern::default() };
        (both_uv > 0.0 || signal_uv > 0.0).then(|| Box::new(effect) as Box<dyn Effect>)
    }
}

impl Effect for ColumnOffset {
    fn identity(&self) -> Identity {
        Identity { name: "column_offset", number: Self::NUMBER, domain: Domain::Microvolts }
    }

    fn cost_case(&self) -> &'static str {
        if self.both_uv > 0.0 { "both" } else { "" }
    }

    /// The bound is before quantisation, so what both samples share cancels in it.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let sigma_e = self.signal_uv / facts.conversion_gain_uv_per_e;
        Some(Omission { bias_e: 0.0, variance_e2: sigma_e * sigma_e })
    }

    fn reason(&self, facts: &Facts) -> String {
        let sigma_e = self.signal_uv / facts.conversion_gain_uv_per_e;
        format!("{:.1} uV is {sigma_e:.2} e- between columns", self.signal_uv)
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let key = row.column_pattern_key(Self::NUMBER);
        if self.signal_uv > 0.0 {
            let pattern = self.residual.normals(key, row.uniforms);
            add_scaled(row.values, &pattern, f32_nearest(self.signal_uv));
        }
        if self.both_uv > 0.0 && !row.reset.is_empty() {
            let pattern = self.common.normals(key.with(COMMON), row.uniforms);
            add_scaled(row.values, &pattern, f32_nearest(self.both_uv));
            add_scaled(row.reset, &pattern, f32_nearest(self.both_uv));
        }
    }
}

/// Field of the key of the offset that both samples carry.
const COMMON: u64 = 1;
