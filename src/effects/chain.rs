//! Runs the chosen effects over a frame: one pass per effect over a row buffer that stays in L1; no branches in pixel loops.
//!
//! Rows are independent but for the effects of `Domain::ArrayElectrons`: only where one of these is chosen, the electrons of the
//! whole window are held between two sweeps over the rows.

mod black;
mod electrons;
mod expected;
mod layout;
mod reading;
mod row;
mod state;

pub use expected::Expected;
use layout::WindowLayout;
use row::{RowBuffers, TimedRow};
pub use state::{BlackRows, Capture, Captured, Chain, RowSamples, RowTimes};
use state::{ExposureInput, ROWS_PER_CHUNK, Reading, add};

use super::Parameters;
use crate::adc::{self, Columns};
use crate::draw::{DrawKey, RowId};
use crate::effect::{ArrayPass, Domain, Effect};
use crate::events::Events;
use crate::fidelity::Rung;
use crate::num::{u32_from, u64_from};
use crate::parallel::chunks_collected;
use crate::pixel::{self, SampledLevels};
use crate::plane::Plane;
use crate::readout::{Geometry, HdrMerge};
use crate::rtl_simulator::SharedRtlSimulator;
use crate::units::{CameraIndex, FrameIndex, RowIndex, Size};

impl Chain {
    /// A sensor with these effects, which must be in physical order. `seed` names the run's draws, `die_seed` the die's patterns.
    pub fn new(parameters: Parameters, mut effects: Vec<Box<dyn Effect>>, seed: u64, die_seed: u64) -> Self {
        assert!(effects.is_sorted_by_key(|effect| effect.domain()), "effects are in physical order");
        let sensed = effects.partition_point(|effect| effect.domain() < Domain::SensedElectrons);
        let readings = vec![Reading::new(parameters.clone(), effects.split_off(sensed), 0, effects.len())];
        let (black, saturated_from_e) = (BlackRows::default(), f32::INFINITY);
        let (charge_effects, merge, layout) = (effects, None, None);
        Self { parameters, charge_effects, readings, merge, black, layout, seed, die_seed, saturated_from_e }
            .with_saturated_from()
    }

    /// The same sensor, which draws for every pixel even where the draw cannot change the result: the slow twin, equal in every bit.
    #[must_use]
    pub fn drawing_for_all(self) -> Self {
        Self { saturated_from_e: f32::INFINITY, ..self }
    }

    /// Finds from which charge on draws cannot show: where every reading clips, and nothing moves what is beyond the well to other
    /// pixels.
    fn with_saturated_from(mut self) -> Self {
        let clips =
            self.readings.iter().all(|reading| reading.effects.iter().any(|effect| effect.name() == "full_well"));
        let spills = self.charge_effects.iter().any(|effect| effect.spills());
        let of = |reading: &Reading| pixel::saturated_from_e(&reading.parameters.pixel);
        self.saturated_from_e = if clips && !spills {
            self.readings.iter().map(of).fold(0.0, |most, from_e| if from_e > most { from_e } else { most })
        } else {
            f32::INFINITY
        };
        self
    }

    /// The same sensor that reads every charge a second time at another conversion gain. Effects of the charge itself, which both
    /// readings share, are the first's.
    #[must_use]
    pub fn with_second_reading(
        mut self,
        parameters: Parameters,
        mut effects: Vec<Box<dyn Effect>>,
        merge: HdrMerge,
    ) -> Self {
        assert!(merge.readings() == 2 && self.readings.len() == 1, "two readings become one code");
        effects.retain(|effect| effect.domain() >= Domain::SensedElectrons);
        let first_counter = self.counters();
        self.readings.push(Reading::new(parameters, effects, 1, first_counter));
        self.merge = Some(merge);
        self.with_saturated_from()
    }

    /// The same sensor with optical-black rows, which are read before the picture.
    #[must_use]
    pub fn with_black_rows(mut self, black: BlackRows) -> Self {
        self.black = black;
        self
    }

    /// The same sensor that reads a window, or several pixels as one.
    #[must_use]
    pub fn with_geometry(mut self, geometry: Geometry) -> Self {
        self.layout = Some(WindowLayout::new(geometry));
        self
    }

    /// The same sensor with its converters on another rung: clock by clock, or in closed form.
    #[must_use]
    pub fn on_rung(mut self, rung: Rung) -> Self {
        let on_rung = |reading: Reading| Reading { converter: reading.converter.at(rung), ..reading };
        self.readings = self.readings.into_iter().map(on_rung).collect();
        self
    }

    /// The same sensor with its columns' counters in Verilog where they go clock by clock.
    #[must_use]
    pub fn in_verilog(mut self, verilog: Option<&SharedRtlSimulator>) -> Self {
        let in_verilog =
            |reading: Reading| Reading { converter: reading.converter.in_verilog(verilog.cloned()), ..reading };
        self.readings = self.readings.into_iter().map(in_verilog).collect();
        self
    }

    /// Converters of one camera in each reading: of the columns that are read.
    fn columns(&self, camera: CameraIndex, width: usize) -> Vec<Columns<'_>> {
        let (frame, row) = (FrameIndex(0), RowIndex(0));
        let row_id = RowId { seed: self.die_seed, camera, frame, slot: 0, row };
        let die = DrawKey::of_row(adc::COLUMN_DELAY, row_id);
        let read = self.layout.as_ref().map(WindowLayout::read_columns);
        self.readings.iter().map(|reading| reading.columns(die, width, read.clone())).collect()
    }

    /// Codes of one exposure from the mean photons of the window, and the events of its conversion. `times` holds one entry a row
    /// of the window.
    pub fn capture(&self, photons: &Plane<f32>, capture: Capture<'_>, times: &[RowTimes]) -> Captured {
        let mut events = Events::default();
        let mut hits = vec![0; self.counters()];
        let (input, left_e) = self.exposure_input(photons, capture, times, &mut events, &mut hits);
        let mut codes = Plane::filled(self.output_size(photons), 0_u16);
        let width = codes.width_px();
        let chunk = |index: usize, rows: &mut [u16]| {
            let mut buffers = self.buffers(photons.width_px());
            let mut events = Events::default();
            for (offset, row_codes) in rows.chunks_exact_mut(width).enumerate() {
                self.output_row(&input, index * ROWS_PER_CHUNK + offset, &mut buffers, row_codes, &mut events);
            }
            (events, buffers.hits)
        };
        for (part, of_chunk) in &chunks_collected(codes.values_mut(), width * ROWS_PER_CHUNK, chunk) {
            events.merge(part);
            add(&mut hits, of_chunk);
        }
        let hits = self.named(&hits);
        Captured { codes, events, charge_e: left_e, hits }
    }

    /// Counters that a capture needs: one for each effect of each reading.
    fn counters(&self) -> usize {
        self.charge_effects.len() + self.readings.iter().map(|reading| reading.effects.len()).sum::<usize>()
    }

    /// Counts by effect, those of all readings together.
    fn named(&self, hits: &[u64]) -> Vec<(&'static str, u64)> {
        let effects = self.charge_effects.iter().chain(self.readings.iter().flat_map(|reading| &reading.effects));
        let mut named: Vec<(&'static str, u64)> = Vec::new();
        for (effect, &count) in effects.zip(hits) {
            match named.iter_mut().find(|(name, _)| *name == effect.name()) {
                Some((_, sum)) => *sum += count,
                None => named.push((effect.name(), count)),
            }
        }
        named
    }

    /// Codes of some rows of an exposure, as `capture` gives them.
    pub fn codes_of_rows(
        &self,
        photons: &Plane<f32>,
        capture: Capture<'_>,
        times: &[RowTimes],
        rows: &[RowIndex],
    ) -> Vec<Vec<u16>> {
        let (input, _) =
            self.exposure_input(photons, capture, times, &mut Events::default(), &mut vec![0; self.counters()]);
        let width = crate::num::index(self.output_size(photons).width_px);
        let mut buffers = self.buffers(photons.width_px());
        let mut codes_of = |row: &RowIndex| {
            let mut codes = vec![0; width];
            self.output_row(&input, crate::num::index(row.0), &mut buffers, &mut codes, &mut Events::default());
            codes
        };
        rows.iter().map(&mut codes_of).collect()
    }

    /// Everything that an exposure's rows share, and the electrons that stay in the array for the next frame.
    fn exposure_input<'a>(
        &'a self,
        photons: &'a Plane<f32>,
        capture: Capture<'a>,
        times: &'a [RowTimes],
        events: &mut Events,
        hits: &mut [u64],
    ) -> (ExposureInput<'a>, Option<Plane<f32>>) {
        assert!(times.len() == photons.height_px(), "every row has its times");
        let shifts_dn = vec![0; self.readings.len()];
        let columns = self.columns(capture.camera, self.buffer_width(photons.width_px()));
        let mut input = ExposureInput { photons, charge_e: None, capture, times, shifts_dn, columns };
        input.shifts_dn = self.black_shifts_dn(&input, events, hits);
        let array = self.has_array_effects().then(|| self.array_electrons(&input, hits));
        let left_e;
        (input.charge_e, left_e) = array.map_or((None, None), |(charge_e, left_e)| (Some(charge_e), left_e));
        (input, left_e)
    }

    /// The same without converters, for the stages before them.
    fn input_without_converters<'a>(
        &'a self,
        photons: &'a Plane<f32>,
        capture: Capture<'a>,
        times: &'a [RowTimes],
    ) -> ExposureInput<'a> {
        assert!(times.len() == photons.height_px(), "every row has its times");
        let mut input =
            ExposureInput { photons, charge_e: None, capture, times, shifts_dn: Vec::new(), columns: Vec::new() };
        input.charge_e =
            self.has_array_effects().then(|| self.array_electrons(&input, &mut vec![0; self.counters()]).0);
        input
    }

    /// Samples of one row at the converters' inputs in the first reading, before quantisation: where the plan's bounds hold. Effects
    /// of the whole array see this row alone. The row begins at the array's first column.
    pub fn row_samples(&self, photons: &[f32], capture: Capture<'_>, row: RowIndex, times: RowTimes) -> RowSamples {
        let mut buffers = RowBuffers::new(photons.len(), self.samples(), 1, self.counters());
        let timed_row = self.timed_row(capture, crate::num::index(row.0), times);
        buffers.values.copy_from_slice(photons);
        self.gather(timed_row, &mut buffers);
        if self.has_array_effects() {
            let size = Size { width_px: u32_from(photons.len()), height_px: 1 };
            let mut charge_e = Plane::from_values(size, std::mem::take(&mut buffers.values));
            self.act_on_array(&mut charge_e, capture, &mut buffers.hits);
            buffers.values = charge_e.values().to_vec();
        }
        self.readings[0].sense(timed_row, self.die_seed, &mut buffers);
        self.readings[0].sample(timed_row, self.die_seed, &mut buffers);
        RowSamples { signal_uv: buffers.values, reset_uv: buffers.reset }
    }

    /// Converters of one camera in the first reading, for the columns that are read; `width_px` counts only without window and binning.
    pub fn first_columns(&self, camera: CameraIndex, width_px: usize) -> Columns<'_> {
        self.columns(camera, self.buffer_width(width_px)).swap_remove(0)
    }

    fn samples(&self) -> SampledLevels {
        self.parameters.adc.cds.samples()
    }

    /// Columns that a row's buffers hold.
    fn buffer_width(&self, window_width: usize) -> usize {
        self.layout.as_ref().map_or(window_width, WindowLayout::buffer_width)
    }

    fn buffers(&self, window_width: usize) -> RowBuffers {
        RowBuffers::new(self.buffer_width(window_width), self.samples(), self.readings.len(), self.counters())
    }

    fn output_size(&self, photons: &Plane<f32>) -> Size {
        self.layout.as_ref().map_or(photons.size(), WindowLayout::output_size)
    }

    /// Array row and column at which the window begins.
    fn window_origin(&self) -> (usize, usize) {
        self.layout.as_ref().map_or((0, 0), |layout| (layout.first_row(), layout.first_column()))
    }

    fn array_effects(&self) -> &[Box<dyn Effect>] {
        let start = self.charge_effects.partition_point(|effect| effect.domain() < Domain::ArrayElectrons);
        &self.charge_effects[start..]
    }

    fn has_array_effects(&self) -> bool {
        !self.array_effects().is_empty()
    }

    /// Electrons of all rows of the window, after the effects of the whole array, and those that stay for the next frame.
    fn array_electrons(&self, input: &ExposureInput<'_>, hits: &mut [u64]) -> (Plane<f32>, Option<Plane<f32>>) {
        let mut charge_e = Plane::filled(input.photons.size(), 0.0_f32);
        let width = input.photons.width_px();
        let (first_row, first_column) = self.window_origin();
        let chunk = |index: usize, rows: &mut [f32]| {
            let mut buffers = self.buffers(width);
            for (offset, row_e) in rows.chunks_exact_mut(width).enumerate() {
                self.load(input, first_row + index * ROWS_PER_CHUNK + offset, &mut buffers);
                row_e.copy_from_slice(&buffers.values[first_column..]);
            }
            buffers.hits
        };
        for of_chunk in &chunks_collected(charge_e.values_mut(), width * ROWS_PER_CHUNK, chunk) {
            add(hits, of_chunk);
        }
        let left_e = self.act_on_array(&mut charge_e, input.capture, hits);
        (charge_e, left_e)
    }

    fn act_on_array(&self, charge_e: &mut Plane<f32>, capture: Capture<'_>, hits: &mut [u64]) -> Option<Plane<f32>> {
        let (row_id, before_e) = (self.row_id(capture, 0), capture.before_e);
        let pixels = u64_from(charge_e.values().len());
        let mut pass = ArrayPass { row_id, charge_e, before_e, left_e: None };
        let first_counter = self.charge_effects.len() - self.array_effects().len();
        for (number, effect) in self.array_effects().iter().enumerate() {
            effect.apply_to_array(&mut pass);
            hits[first_counter + number] += pixels;
        }
        pass.left_e
    }

    fn row_id(&self, capture: Capture<'_>, row: usize) -> RowId {
        let Capture { camera, frame, slot, .. } = capture;
        RowId { seed: self.seed, camera, frame, slot, row: RowIndex(u32_from(row)) }
    }

    fn timed_row(&self, capture: Capture<'_>, row: usize, times: RowTimes) -> TimedRow {
        TimedRow { row_id: self.row_id(capture, row), times }
    }

    /// From the photons in the buffer to the electrons that a row's pixels gather.
    fn gather(&self, timed_row: TimedRow, buffers: &mut RowBuffers) {
        pixel::photons_to_mean_electrons(&self.parameters.pixel, &mut buffers.values);
        let rows = self.charge_effects.len() - self.array_effects().len();
        buffers.apply_all(&self.charge_effects[..rows], (timed_row, self.die_seed), self.saturated_from_e, 0);
    }
}
