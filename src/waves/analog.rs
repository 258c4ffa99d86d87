//! Analog side of a row's conversions, clock by clock: converter inputs, the ramp, and one comparator bit per column.
//!
//! Ramp and comparators are those of the clocked rung (`adc::Comparators`); all columns take part, since comparators that flip disturb the
//! ramp that they share. Before a ramp's first step comparators are held low, as their auto-zero does.

use crate::adc::{Columns, Comparators, Converter, Sample};
use crate::effects::chain::RowSamples;
use crate::num::{f64_from_i64, index};

/// A row's converters between two conversions or within one.
#[derive(Debug)]
pub struct Analog<'a> {
    converter: &'a Converter,
    columns: &'a Columns<'a>,
    all: Vec<usize>,
    held_uv: Vec<f32>,
    running: Option<Comparators<'a>>,
}

impl<'a> Analog<'a> {
    pub fn new(converter: &'a Converter, columns: &'a Columns<'a>, width_px: u32) -> Self {
        let all: Vec<usize> = (0..index(width_px)).collect();
        Self { converter, columns, held_uv: vec![0.0; all.len()], all, running: None }
    }

    /// The row's sample is held at the comparators' inputs. A reset level that is not converted separately is not seen.
    pub fn hold(&mut self, row: &RowSamples, sample: Sample) {
        let samples_uv = match sample {
            Sample::Reset => &row.reset_uv,
            Sample::Signal => &row.signal_uv,
        };
        if !samples_uv.is_empty() {
            self.held_uv.copy_from_slice(samples_uv);
        }
    }

    /// The ramp goes back to its bottom, and all comparators are reset.
    pub fn start(&mut self) {
        self.running = Some(self.columns.comparators(&self.all, &self.held_uv));
    }

    /// One clock: the ramp makes a step, and the comparators see it.
    pub fn tick(&mut self) {
        self.running.as_mut().expect("a ramp starts before it steps").tick();
    }

    /// Where the ramp stands as the columns see it, in uV above its bottom.
    pub fn ramp_uv(&self) -> f64 {
        self.running.as_ref().map_or(0.0, |running| f64_from_i64(running.ramp_nv()) / 1000.0)
    }

    /// What a column's comparator compares with the ramp, in uV above the ramp's bottom.
    pub fn input_uv(&self, column: usize) -> f64 {
        f64_from_i64(self.converter.level_nv(self.held_uv[column])) / 1000.0
    }

    pub fn is_high(&self, column: usize) -> bool {
        self.running.as_ref().is_some_and(|running| running.bits()[column])
    }
}
