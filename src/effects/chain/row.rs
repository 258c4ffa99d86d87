//! One output row: loads the array rows that it is made of, reads them, and merges their codes.

use super::layout::{WindowLayout, means};
use super::state::{Capture, Chain, ExposureInput, RowSamples, RowTimes};
use crate::draw::RowId;
use crate::effect::{Effect, KeptKeys, RowPass};
use crate::events::{Event, Events};
use crate::num::{index, low_u16, u64_from};
use crate::pixel::SampledLevels;
use crate::plane::Plane;
use crate::readout::BinningMode;
use crate::units::RowIndex;

/// Which row, and when.
#[derive(Clone, Copy)]
pub(super) struct TimedRow {
    pub row_id: RowId,
    pub times: RowTimes,
}

/// Room for one row.
pub(super) struct RowBuffers {
    pub values: Vec<f32>,
    pub reset: Vec<f32>,
    uniforms: Vec<u32>,
    draws: Vec<f32>,
    /// Charge that is read more than once, or added up.
    charge_e: Vec<f32>,
    /// Codes of each reading at the array's columns.
    codes: Vec<Vec<u16>>,
    keys: KeptKeys,
    /// Pixels over which each effect ran: one counter for each effect of each reading.
    pub hits: Vec<u64>,
}

impl RowBuffers {
    pub fn new(width: usize, samples: SampledLevels, readings: usize, counters: usize) -> Self {
        let reset = if samples == SampledLevels::Both { width } else { 0 };
        Self {
            values: vec![0.0; width],
            reset: vec![0.0; reset],
            uniforms: vec![0; width],
            draws: vec![0.0; width],
            charge_e: Vec::new(),
            codes: vec![Vec::new(); readings],
            keys: KeptKeys::default(),
            hits: vec![0; counters],
        }
    }

    pub fn pass(&mut self, timed_row: TimedRow, die_seed: u64) -> RowPass<'_> {
        let TimedRow { row_id, times } = timed_row;
        RowPass {
            row_id,
            die_seed,
            exposure_s: times.exposure_s,
            storage_s: times.storage_s,
            readout_s: times.readout_s,
            values: &mut self.values,
            reset: &mut self.reset,
            uniforms: &mut self.uniforms,
            draws: &mut self.draws,
            keys: &self.keys,
            saturated_from_e: f32::INFINITY,
            idle_px: 0,
        }
    }

    /// Runs effects over a row in their order, and counts the pixels of each into its entry of `hits`, from `first_counter` on.
    pub fn apply_all(
        &mut self,
        effects: &[Box<dyn Effect>],
        (timed_row, die_seed): (TimedRow, u64),
        saturated_from_e: f32,
        first_counter: usize,
    ) {
        let mut hits = std::mem::take(&mut self.hits);
        let mut pass = self.pass(timed_row, die_seed);
        pass.saturated_from_e = saturated_from_e;
        for (effect, hits) in effects.iter().zip(&mut hits[first_counter..]) {
            pass.idle_px = 0;
            effect.apply(&mut pass);
            *hits += u64_from(pass.values.len() - pass.idle_px);
        }
        self.hits = hits;
    }
}

impl Chain {
    /// Codes of one row of the picture.
    pub(super) fn output_row(
        &self,
        input: &ExposureInput<'_>,
        row: usize,
        buffers: &mut RowBuffers,
        codes: &mut [u16],
        events: &mut Events,
    ) {
        let Some(layout) = &self.layout else {
            self.read_array_rows(input, &[row], buffers, codes, events);
            return;
        };
        let mut full = vec![0; layout.buffer_width()];
        if layout.mode() == Some(BinningMode::Average) {
            let mut sums_dn = vec![0; codes.len()];
            for array_row in layout.rows(row) {
                self.read_array_rows(input, &[array_row], buffers, &mut full, events);
                layout.add_codes(&full, &mut sums_dn);
            }
            means(&sums_dn, layout.pixels_of_one(), codes);
        } else {
            self.read_array_rows(input, &layout.charge_rows(row), buffers, &mut full, events);
            layout.pick(&full, codes);
        }
    }

    /// Samples of some rows of the picture at the converters' inputs in the first reading, one a column that is read, as `capture`
    /// converts them.
    pub fn samples_of_rows(
        &self,
        photons: &Plane<f32>,
        capture: Capture<'_>,
        times: &[RowTimes],
        rows: &[RowIndex],
    ) -> Vec<RowSamples> {
        let input = self.input_without_converters(photons, capture, times);
        let read = self.layout.as_ref().map(WindowLayout::read_columns);
        let picked = |row: Vec<f32>| match &read {
            Some(read) => read.iter().filter_map(|&column| row.get(column).copied()).collect(),
            None => row,
        };
        let samples = |&row: &RowIndex| {
            let array_rows = self.layout.as_ref().map_or(vec![index(row.0)], |layout| layout.charge_rows(index(row.0)));
            let mut buffers = self.buffers(photons.width_px());
            self.load_together(0, &input, &array_rows, &mut buffers);
            self.readings[0].sample(self.timed_row_of(&input, array_rows[0]), self.die_seed, &mut buffers);
            RowSamples { signal_uv: picked(buffers.values), reset_uv: picked(buffers.reset) }
        };
        rows.iter().map(samples).collect()
    }

    /// The electrons of an array row into the buffer: as the effects of the array left them, or gathered now.
    pub(super) fn load(&self, input: &ExposureInput<'_>, array_row: usize, buffers: &mut RowBuffers) {
        let (first_row, first_column) = self.window_origin();
        let row = array_row - first_row;
        let (outside, inside) = buffers.values.split_at_mut(first_column);
        outside.fill(0.0);
        if let Some(charge_e) = &input.charge_e {
            inside.copy_from_slice(charge_e.row(row));
        } else {
            inside.copy_from_slice(input.photons.row(row));
            self.gather(self.timed_row(input.capture, array_row, input.times[row]), buffers);
        }
    }

    /// Codes, at the array's columns, of array rows that are converted together: every reading, clamped, and merged where there are
    /// several.
    fn read_array_rows(
        &self,
        input: &ExposureInput<'_>,
        array_rows: &[usize],
        buffers: &mut RowBuffers,
        codes: &mut [u16],
        events: &mut Events,
    ) {
        let Some(merge) = &self.merge else {
            self.load_together(0, input, array_rows, buffers);
            self.read_once(0, self.timed_row_of(input, array_rows[0]), input, buffers, codes, events);
            return;
        };
        let mut read = std::mem::take(&mut buffers.codes);
        for (number, codes) in read.iter_mut().enumerate() {
            codes.resize(buffers.values.len(), 0);
            self.load_together(number, input, array_rows, buffers);
            self.read_once(number, self.timed_row_of(input, array_rows[0]), input, buffers, codes, events);
        }
        let rows: Vec<&[u16]> = read.iter().map(Vec::as_slice).collect();
        merge.merge_row(&rows, codes);
        buffers.codes = read;
    }

    pub(super) fn timed_row_of(&self, input: &ExposureInput<'_>, array_row: usize) -> TimedRow {
        self.timed_row(input.capture, array_row, input.times[array_row - self.window_origin().0])
    }

    /// Electrons at the sense node into the buffer: of one array row, or of several whose charges meet there.
    fn load_together(&self, number: usize, input: &ExposureInput<'_>, array_rows: &[usize], buffers: &mut RowBuffers) {
        let reading = &self.readings[number];
        let Some(layout) = self.charge_binning() else {
            self.load(input, array_rows[0], buffers);
            reading.sense(self.timed_row_of(input, array_rows[0]), self.die_seed, buffers);
            return;
        };
        let mut sums_e = std::mem::take(&mut buffers.charge_e);
        sums_e.clear();
        sums_e.resize(buffers.values.len(), 0.0);
        for &array_row in array_rows {
            self.load(input, array_row, buffers);
            reading.sense(self.timed_row_of(input, array_row), self.die_seed, buffers);
            layout.add_charges(&buffers.values, &mut sums_e);
        }
        buffers.values.copy_from_slice(&sums_e);
        buffers.charge_e = sums_e;
    }

    /// From electrons at the sense node to clamped codes of one reading.
    pub(super) fn read_once(
        &self,
        number: usize,
        timed_row: TimedRow,
        input: &ExposureInput<'_>,
        buffers: &mut RowBuffers,
        codes: &mut [u16],
        events: &mut Events,
    ) {
        let (reading, columns) = (&self.readings[number], &input.columns[number]);
        reading.sample(timed_row, self.die_seed, buffers);
        reading.convert(columns, buffers, codes, events);
        if number == 0 {
            self.count_others(events);
        }
        shift_row(codes, input.shifts_dn[number], reading.parameters.adc.code_max());
    }

    /// The layout where charges of several pixels become one.
    pub(super) fn charge_binning(&self) -> Option<&WindowLayout> {
        self.layout.as_ref().filter(|layout| layout.mode() == Some(BinningMode::Charge))
    }

    /// Counts what charge binning does besides a row's conversions: every pixel is reset and transferred; one of the group is
    /// counted with its conversion.
    fn count_others(&self, events: &mut Events) {
        let Some(layout) = self.charge_binning() else { return };
        let others = u64::from(layout.output_size().width_px) * u64::from(layout.pixels_of_one() - 1);
        events.add(Event::PixelReset, others);
        events.add(Event::ChargeTransfer, others * self.parameters.pixel.pixel_type.transfers());
    }
}

/// Adds a whole number to codes, clipped at both ends.
pub(super) fn shift_row(codes: &mut [u16], shift_dn: i32, code_max: u32) {
    if shift_dn == 0 {
        return;
    }
    let most = i32::try_from(code_max).expect("a code has at most 16 bits");
    for code in codes {
        *code = low_u16((i32::from(*code) + shift_dn).clamp(0, most).cast_unsigned());
    }
}
