//! One reading of a pixel's charge: converts the electrons of a row to samples, codes and events.
//!
//! A pixel is read once, or with dual conversion gain twice: the same charge at two gains, each conversion with independent noise.

use super::super::Parameters;
use super::row::{RowBuffers, TimedRow};
pub(super) use super::state::Reading;
use crate::adc::{self, Columns, Converter, RowWork};
use crate::draw::{DrawKey, RowId};
use crate::effect::{Domain, Effect};
use crate::events::Events;
use crate::pixel;

impl Reading {
    /// The reading of that number; effects of earlier domains are left to the caller.
    pub fn new(parameters: Parameters, effects: Vec<Box<dyn Effect>>, number: u32, first_counter: usize) -> Self {
        assert!(
            effects.iter().all(|effect| effect.domain() >= Domain::SensedElectrons),
            "a reading begins at the sense node"
        );
        let sampled_from = effects.partition_point(|effect| effect.domain() < Domain::Microvolts);
        Self { converter: Converter::new(&parameters.adc), parameters, effects, sampled_from, first_counter, number }
    }

    /// From gathered electrons to electrons at the sense node, in place. What happens to the charge happens once, so its draws are the
    /// same in every reading.
    pub fn sense(&self, timed_row: TimedRow, die_seed: u64, buffers: &mut RowBuffers) {
        let effects = &self.effects[..self.sampled_from];
        buffers.apply_all(effects, (timed_row, die_seed), f32::INFINITY, self.first_counter);
    }

    /// From electrons at the sense node to the samples at the converters' inputs, in place.
    pub fn sample(&self, timed_row: TimedRow, die_seed: u64, buffers: &mut RowBuffers) {
        buffers.reset.fill(0.0);
        pixel::electrons_to_microvolts(&self.parameters.pixel, &mut buffers.values);
        let (from, row_and_die) = (self.sampled_from, (self.numbered(timed_row), die_seed));
        buffers.apply_all(&self.effects[from..], row_and_die, f32::INFINITY, self.first_counter + from);
    }

    /// Effects on sensed electrons and on microvolts, in physical order.
    pub fn effects(&self) -> impl Iterator<Item = &dyn Effect> {
        self.effects.iter().map(AsRef::as_ref)
    }

    /// The converters of a die, of the columns that are read; none named: all.
    pub fn columns(&self, die: DrawKey, width: usize, read: Option<Vec<usize>>) -> Columns<'_> {
        let columns = self.converter.columns(die, width);
        match read {
            Some(read) => columns.of(read),
            None => columns,
        }
    }

    /// Codes of a row of samples at the array's columns; those that are not read stay as they are. Counts the conversions.
    pub fn convert(&self, columns: &Columns<'_>, buffers: &RowBuffers, codes: &mut [u16], events: &mut Events) {
        let Some(read) = columns.array_columns() else {
            let work = columns.convert_row(&buffers.values, &buffers.reset, codes);
            self.count(codes.len(), work, events);
            return;
        };
        let picked = |row: &[f32]| -> Vec<f32> { read.iter().filter_map(|&column| row.get(column).copied()).collect() };
        let mut read_codes = vec![0; read.len()];
        let work = columns.convert_row(&picked(&buffers.values), &picked(&buffers.reset), &mut read_codes);
        for (&column, code) in read.iter().zip(read_codes) {
            codes[column] = code;
        }
        self.count(read.len(), work, events);
    }

    /// A pixel is reset and transferred once, for its first reading.
    fn count(&self, columns: usize, work: RowWork, events: &mut Events) {
        let (adc, pixel_type) = (&self.parameters.adc, self.parameters.pixel.pixel_type);
        if self.number == 0 {
            adc::count_row(adc, pixel_type, columns, work, events);
        } else {
            adc::count_conversion(adc, columns, work, events);
        }
    }

    fn numbered(&self, timed_row: TimedRow) -> TimedRow {
        TimedRow { row_id: RowId { slot: timed_row.row_id.slot + self.number, ..timed_row.row_id }, ..timed_row }
    }
}
