//! What an effect is: one physical imperfection between photons and codes that a scene may or may not call for.

use std::cell::RefCell;
use std::ops::Range;

use crate::draw::{DrawKey, EffectNumber, RowId};
use crate::facts::Facts;
use crate::plane::Plane;
use crate::units::{FrameIndex, RowIndex};

/// What leaving an effect out can change in one pixel, referred to its input in electrons.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Omission {
    /// Bound of the systematic part, absolute.
    pub bias_e: f64,
    /// Variance of the random part.
    pub variance_e2: f64,
}

impl Omission {
    /// Nothing is lost.
    pub const NONE: Self = Self { bias_e: 0.0, variance_e2: 0.0 };

    /// Systematic parts add absolutely; variances of independent effects add.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self { bias_e: self.bias_e + other.bias_e, variance_e2: self.variance_e2 + other.variance_e2 }
    }

    /// Mean square error in electrons squared.
    pub fn error_e2(self) -> f64 {
        self.bias_e * self.bias_e + self.variance_e2
    }
}

/// What an effect meets; effects run in this order.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Domain {
    /// A row of mean photoelectrons, before any draw.
    MeanElectrons,
    /// A row of electrons in the pixel.
    Electrons,
    /// The electrons of the whole array at the end of the exposure: where neighbours or the frame before matter.
    ArrayElectrons,
    /// A row of electrons as they reach the sense node.
    SensedElectrons,
    /// A row of microvolts at the ADC's input; a brighter pixel is a greater value.
    Microvolts,
}

/// One row between light and codes.
pub struct RowPass<'a> {
    /// Which row of which exposure; its seed is the run's.
    pub row_id: RowId,
    /// Seed of the die: patterns that stay from frame to frame draw from it.
    pub die_seed: u64,
    /// Exposure of this row in seconds.
    pub exposure_s: f64,
    /// Wait between the end of the exposure and this row's readout, in seconds.
    pub storage_s: f64,
    /// When the row's samples are converted, in seconds of run time.
    pub readout_s: f64,
    /// The row's values in the unit of the effect's domain, one a column: in microvolts, the signal sample.
    pub values: &'a mut [f32],
    /// The reset sample in microvolts, one a column, where it is converted separately (digital CDS); empty otherwise. Touched in the
    /// domain of microvolts only.
    pub reset: &'a mut [f32],
    /// Room for uniforms, as long as the row.
    pub uniforms: &'a mut [u32],
    /// Room for draws, as long as the row.
    pub draws: &'a mut [f32],
    /// Keys that earlier rows asked for.
    pub keys: &'a KeptKeys,
    /// Electrons from which on a pixel ends at its full well whatever any effect of the charge draws; infinite where that is not
    /// known.
    pub saturated_from_e: f32,
    /// Columns that the effect had nothing to do for, counted by the effect.
    pub idle_px: usize,
}

impl RowPass<'_> {
    /// Key of an effect's draws that differ from frame to frame.
    pub fn temporal_key(&self, effect: EffectNumber) -> DrawKey {
        self.keys.of_row(effect, self.row_id)
    }

    /// Key of an effect's draws in the reset sample, apart from those in the signal sample.
    pub fn reset_key(&self, effect: EffectNumber) -> DrawKey {
        self.temporal_key(effect).with(RESET_SAMPLE)
    }

    /// Key of an effect's pattern in this row: part of the die, equal in all frames.
    pub fn pattern_key(&self, effect: EffectNumber) -> DrawKey {
        let frame = FrameIndex(0);
        self.keys.of_row(effect, RowId { seed: self.die_seed, frame, slot: 0, ..self.row_id })
    }

    /// Key of an effect's column pattern: part of the die, equal in all rows and frames.
    pub fn column_pattern_key(&self, effect: EffectNumber) -> DrawKey {
        let (frame, row) = (FrameIndex(0), RowIndex(0));
        self.keys.of_row(effect, RowId { seed: self.die_seed, frame, slot: 0, row, ..self.row_id })
    }
}

/// Columns that are judged together: a block of the vector kernels of draws.
const JUDGED_PX: usize = 64;

impl RowPass<'_> {
    /// Runs of columns for which some draw can show, from left to right; `is_idle` judges the values of up to 64 neighbours. The others
    /// are counted as idle.
    pub fn in_need(&mut self, is_idle: impl Fn(&[f32]) -> bool) -> Vec<Range<usize>> {
        let mut runs: Vec<Range<usize>> = Vec::new();
        for (number, part) in self.values.chunks(JUDGED_PX).enumerate() {
            let start = number * JUDGED_PX;
            if is_idle(part) {
                self.idle_px += part.len();
                continue;
            }
            match runs.last_mut() {
                Some(run) if run.end == start => run.end = start + part.len(),
                _ => runs.push(start..start + part.len()),
            }
        }
        runs
    }

    /// Counts all columns as idle but so many.
    pub fn only(&mut self, acted_px: usize) {
        self.idle_px += self.values.len() - acted_px;
    }
}

/// Whether all of these pixels end at the full well whatever is drawn; false for NaN.
pub fn all_full(values_e: &[f32], saturated_from_e: f32) -> bool {
    values_e.iter().fold(true, |all, &value_e| all & (value_e >= saturated_from_e))
}

/// Whether all of these pixels are empty: the positive zero.
pub fn all_empty(values_e: &[f32]) -> bool {
    values_e.iter().fold(0, |bits, value_e| bits | value_e.to_bits()) == 0
}

/// Field of the key of draws in the reset sample.
const RESET_SAMPLE: u64 = 1;

/// Keys of exposures by effect, kept from row to row: working one out takes ten mixings in series.
#[derive(Default)]
pub struct KeptKeys(RefCell<Vec<(EffectNumber, RowId, DrawKey)>>);

impl KeptKeys {
    /// As `DrawKey::of_row`, its slow twin.
    pub fn of_row(&self, effect: EffectNumber, row_id: RowId) -> DrawKey {
        let exposure = RowId { row: RowIndex(0), ..row_id };
        let mut kept = self.0.borrow_mut();
        let found = kept.iter().find(|entry| entry.0 == effect && entry.1 == exposure).map(|entry| entry.2);
        let key = found.unwrap_or_else(|| {
            let key = DrawKey::of_exposure(effect, exposure);
            kept.push((effect, exposure, key));
            key
        });
        key.with(row_id.row.0.into())
    }
}

/// The whole array at the end of an exposure.
pub struct ArrayPass<'a> {
    /// Which exposure of which camera and frame; its row is 0.
    pub row_id: RowId,
    /// Electrons of each pixel.
    pub charge_e: &'a mut Plane<f32>,
    /// Electrons that the frame before left behind in the array; none in the first frame.
    pub before_e: Option<&'a Plane<f32>>,
    /// Electrons that this frame leaves behind for the next, where an effect leaves some.
    pub left_e: Option<Plane<f32>>,
}

/// What names an effect and says where it acts.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Identity {
    /// The one name of the effect: config, report, log and test mark.
    pub name: &'static str,
    /// Published number, part of the key of its draws; of an effect that draws nothing, kept for it.
    pub number: EffectNumber,
    /// What the row holds when the effect meets it.
    pub domain: Domain,
}

/// An effect with its parameters, ready to run.
pub trait Effect: Send + Sync {
    /// Its name, its number and where it acts.
    fn identity(&self) -> Identity;

    /// The one name of this effect: config, report, log and test mark.
    fn name(&self) -> &'static str {
        self.identity().name
    }

    /// What the row holds when this effect meets it.
    fn domain(&self) -> Domain {
        self.identity().domain
    }

    /// Whether it moves what is beyond the full well to other pixels, so that draws of a full pixel show elsewhere.
    fn spills(&self) -> bool {
        false
    }

    /// Which row of the table of costs holds, where an effect's work depends on its parameters: "both" samples, "dcnu", ...
    fn cost_case(&self) -> &'static str {
        ""
    }

    /// Bound on what its absence changes in any pixel of the region; `None`: it cannot say, so it stays.
    fn omission(&self, facts: &Facts) -> Option<Omission>;

    /// Why it matters or not here, with numbers, for a person ("0.00012 e- at 12 us and 300 K").
    fn reason(&self, facts: &Facts) -> String;

    /// Applies the effect to one row in L1. Called once a row, so dispatch stays out of the pixel loop. Never called for
    /// `Domain::ArrayElectrons`.
    fn apply(&self, row: &mut RowPass<'_>);

    /// Applies an effect of `Domain::ArrayElectrons` to the whole array. Never called for others.
    fn apply_to_array(&self, _array: &mut ArrayPass<'_>) {
        unreachable!("{} acts on rows", self.name())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::CameraIndex;

    #[test]
    fn kept_keys_equal_those_worked_out_anew() {
        let keys = KeptKeys::default();
        let mut tried = 0;
        for case in (0..64).chain(0..64) {
            let bit = |number: u32| case >> number & 1;
            let (camera, frame, row) = (CameraIndex(bit(1)), FrameIndex(bit(2)), RowIndex(bit(4)));
            let row_id = RowId { seed: bit(0).into(), camera, frame, slot: bit(3), row };
            let effect = EffectNumber(u64::from(bit(5)));
            assert_eq!(keys.of_row(effect, row_id), DrawKey::of_row(effect, row_id), "{effect:?} at {row_id:?}");
            tried += 1;
        }
        assert_eq!((tried, keys.0.borrow().len()), (128, 32));
    }
}
