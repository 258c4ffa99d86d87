//! The analog side of a row's conversions, clock by clock. Enters: samples of all columns. Leaves: what stands at the converters' inputs,
//! the ramp, and a comparator bit a column.

use crate::adc::{AdcParams, Converter};
use crate::effects::chain::RowSamples;
use crate::num::{f64_from_i64, i64_half_even};

/// Which of a row's conversions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sample {
    /// Of the reset level.
    Reset,
    /// Of the signal.
    Signal,
}

/// The comparators of a row during its conversions.
#[derive(Debug)]
pub struct Comparators<'a> {
    converter: &'a Converter,
    pedestal_nv: i64,
    levels_nv: Vec<i64>,
    step: u32,
    high: Vec<bool>,
}

impl<'a> Comparators<'a> {
    /// Comparators of so many columns at rest.
    pub fn new(converter: &'a Converter, params: &AdcParams, columns: usize) -> Self {
        let pedestal_nv = converter.edge_nv(params.pedestal_lsb());
        Self { converter, pedestal_nv, levels_nv: vec![0; columns], step: 0, high: vec![false; columns] }
    }

    /// The row's sample is held at the comparators' inputs.
    pub fn hold(&mut self, input: &RowSamples, sample: Sample) {
        let samples_uv = match sample {
            Sample::Reset => &input.reset_uv,
            Sample::Signal => &input.signal_uv,
        };
        for (level_nv, &sample_uv) in self.levels_nv.iter_mut().zip(samples_uv) {
            *level_nv = i64_half_even(f64::from(sample_uv) * 1000.0) + self.pedestal_nv;
        }
    }

    /// The ramp goes back to its bottom, and all comparators are reset.
    pub fn start(&mut self) {
        self.step = 0;
        self.high.fill(false);
    }

    /// One clock: the ramp makes a step, and the comparators see it.
    pub fn tick(&mut self) {
        self.step += 1;
        let ramp_nv = self.converter.edge_nv(self.step);
        for (high, &level_nv) in self.high.iter_mut().zip(&self.levels_nv) {
            *high |= ramp_nv > level_nv;
        }
    }

    /// Where the ramp stands, in uV above its bottom.
    pub fn ramp_uv(&self) -> f64 {
        f64_from_i64(self.converter.edge_nv(self.step)) / 1000.0
    }

    /// What a column's comparator compares with the ramp, in uV above the ramp's bottom.
    pub fn input_uv(&self, column: usize) -> f64 {
        f64_from_i64(self.levels_nv[column]) / 1000.0
    }

    /// A column's comparator.
    pub fn is_high(&self, column: usize) -> bool {
        self.high[column]
    }
}
