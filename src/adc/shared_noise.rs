//! Noise that many pixels share. Adds one draw in microvolts to all pixels of a row or column.
//!
//! Models, each a normal draw: `row_noise` (reference and supply noise sampled once a row), `row_offset` (a pattern of the die),
//! `column_noise` (a column's bias and reference, low-frequency, once a frame) act on the difference and so on the signal sample.
//! `ramp_noise` is the noise of the ramp's start in each conversion: all columns that are converted together share it, reset and signal
//! each have their own (EMVA 1288 release 4.0 splits row, column and pixel variances in the same way).

use super::params::AdcParams;
use crate::draw::{DrawKey, EffectNumber, RowId, fill_uniforms, normals};
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;
use crate::num::{f32_nearest, index};
use crate::pixel::{SampleSigmas, add_scaled};
use crate::units::RowIndex;

/// Who shares a draw.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Shared {
    /// The columns of a row that are converted together, in one frame.
    Conversion,
    /// All columns of a row, in one frame.
    Row,
    /// All columns of a row, in all frames.
    RowOfDie,
    /// All rows of a column, in one frame.
    Column,
}

/// A normal draw that many pixels share.
pub struct SharedNoise {
    name: &'static str,
    number: EffectNumber,
    shared: Shared,
    sigmas: SampleSigmas,
    /// Conversions of a row: shared converters make one after the other.
    passes: usize,
}

/// Noise of a row in one frame, 203; `None` where it is 0.
pub fn row_noise(params: &AdcParams) -> Option<Box<dyn Effect>> {
    of_difference("row_noise", 203, Shared::Row, params.row_noise_uv)
}

/// Offset of a row of the die, 204; `None` where it is 0.
pub fn row_offset(params: &AdcParams) -> Option<Box<dyn Effect>> {
    of_difference("row_offset", 204, Shared::RowOfDie, params.row_offset_uv)
}

/// Noise of a column in one frame, 205; `None` where it is 0.
pub fn column_noise(params: &AdcParams) -> Option<Box<dyn Effect>> {
    of_difference("column_noise", 205, Shared::Column, params.column_noise_uv)
}

/// Noise of the ramp in one conversion, 207; `None` where it is 0.
pub fn ramp_noise(params: &AdcParams) -> Option<Box<dyn Effect>> {
    let sigmas = params.sigmas_of_conversions(params.ramp_noise_uv);
    boxed("ramp_noise", 207, Shared::Conversion, sigmas, index(params.columns_per_adc))
}

fn of_difference(name: &'static str, number: u64, shared: Shared, sigma_uv: f64) -> Option<Box<dyn Effect>> {
    boxed(name, number, shared, SampleSigmas { signal_uv: sigma_uv, reset_uv: 0.0 }, 1)
}

fn boxed(
    name: &'static str,
    number: u64,
    shared: Shared,
    sigmas: SampleSigmas,
    passes: usize,
) -> Option<Box<dyn Effect>> {
    let effect = SharedNoise { name, number: EffectNumber(number), shared, sigmas, passes };
    (sigmas.variance_uv2() > 0.0).then(|| Box::new(effect) as Box<dyn Effect>)
}

impl SharedNoise {
    fn signal_key(&self, row: &RowPass<'_>) -> DrawKey {
        match self.shared {
            Shared::Conversion | Shared::Row => row.temporal_key(self.number),
            Shared::RowOfDie => row.pattern_key(self.number),
            Shared::Column => DrawKey::of_row(self.number, RowId { row: RowIndex(0), ..row.row_id }),
        }
    }

    /// One normal a column of the row, in `draws`.
    fn draw(&self, key: DrawKey, uniforms: &mut [u32], draws: &mut [f32]) {
        let drawn = if self.shared == Shared::Column { draws.len() } else { self.passes.min(draws.len()) };
        fill_uniforms(key, &mut uniforms[..drawn]);
        normals(&uniforms[..drawn], &mut draws[..drawn]);
        if drawn == 1 {
            // A plain fill: each copy of the one before would wait for it.
            let shared = draws[0];
            draws.fill(shared);
            return;
        }
        for column in drawn..draws.len() {
            draws[column] = draws[column - drawn];
        }
    }
}

impl Effect for SharedNoise {
    fn identity(&self) -> Identity {
        Identity { name: self.name, number: self.number, domain: Domain::Microvolts }
    }

    fn cost_case(&self) -> &'static str {
        if self.sigmas.reset_uv > 0.0 { "both" } else { "" }
    }

    /// The variance of a pixel. It is shared, so an eye or a tracker sees it in stripes long before a pixel's own noise of the same
    /// size; the plan bounds pixels only.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        Some(self.sigmas.omission(facts))
    }

    fn reason(&self, facts: &Facts) -> String {
        let sigma_uv = self.sigmas.variance_uv2().sqrt();
        format!("{sigma_uv:.1} uV is {:.2} e- shared by many pixels", sigma_uv / facts.conversion_gain_uv_per_e)
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        if self.sigmas.signal_uv > 0.0 {
            self.draw(self.signal_key(row), row.uniforms, row.draws);
            add_scaled(row.values, row.draws, f32_nearest(self.sigmas.signal_uv));
        }
        if self.sigmas.reset_uv > 0.0 && !row.reset.is_empty() {
            self.draw(row.reset_key(self.number), row.uniforms, row.draws);
            add_scaled(row.reset, row.draws, f32_nearest(self.sigmas.reset_uv));
        }
    }
}
