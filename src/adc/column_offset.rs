//! Column offsets. Enters: microvolts. Leaves: microvolts with each column's own offset added.
//!
//! Model: a normal offset for each column of the die (comparator and amplifier), equal in all rows and frames; double sampling
//! leaves `column_offset_residual_uv` of it, no double sampling all of `column_offset_uv`.

use super::AdcParams;
use crate::draw::EffectNumber;
use crate::effect::{Domain, Effect, Omission, RowPass};
use crate::facts::Facts;
use crate::num::f32_nearest;
use crate::pixel::{Pattern, add_scaled};

/// Mismatch of the columns' offsets, as far as sampling leaves it.
pub struct ColumnOffset {
    sigma_uv: f64,
    pattern: Pattern,
}

impl ColumnOffset {
    /// Published number.
    pub const NUMBER: EffectNumber = EffectNumber(202);

    /// `None` where no offset is left.
    pub fn from_params(params: &AdcParams) -> Option<Box<dyn Effect>> {
        let sigma_uv = if params.cds.is_double() { params.column_offset_residual_uv } else { params.column_offset_uv };
        (sigma_uv > 0.0).then(|| Box::new(Self { sigma_uv, pattern: Pattern::default() }) as Box<dyn Effect>)
    }
}

impl Effect for ColumnOffset {
    fn name(&self) -> &'static str {
        "column_offset"
    }

    fn number(&self) -> EffectNumber {
        Self::NUMBER
    }

    fn domain(&self) -> Domain {
        Domain::Microvolts
    }

    fn cost_ns_per_px(&self) -> f64 {
        0.2
    }

    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let sigma_e = self.sigma_uv / facts.conversion_gain_uv_per_e;
        Some(Omission { bias_e: 0.0, variance_e2: sigma_e * sigma_e })
    }

    fn reason(&self, facts: &Facts) -> String {
        let sigma_e = self.sigma_uv / facts.conversion_gain_uv_per_e;
        format!("{:.1} uV is {sigma_e:.2} e- between columns", self.sigma_uv)
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        let pattern = self.pattern.normals(row.column_key(Self::NUMBER), row.uniforms);
        add_scaled(row.values, &pattern, f32_nearest(self.sigma_uv));
    }
}
