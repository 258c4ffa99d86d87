//! Runs the chosen effects over a frame: one pass an effect over a row buffer that stays in L1, no question asked in a pixel loop.
//!
//! Rows are independent but for the effects of `Domain::ArrayElectrons`: only where one of these is chosen, the electrons of the
//! whole array are held between two sweeps over the rows.

use super::Parameters;
use crate::adc::{self, Converter};
use crate::draw::{DrawKey, RowPlace};
use crate::effect::{ArrayPass, Domain, Effect, RowPass};
use crate::events::Events;
use crate::fidelity::Rung;
use crate::num::u32_from;
use crate::pixel::{self, Samples};
use crate::plane::Plane;
use crate::units::{CameraIndex, FrameIndex, RowIndex};

/// Rows that one task takes. Fixed, so that work is cut the same way on any number of threads.
const ROWS_PER_CHUNK: usize = 16;

/// Exposure and wait of one row.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowTimes {
    /// Exposure in seconds.
    pub exposure_s: f64,
    /// From the exposure's end to the row's readout, in seconds.
    pub storage_s: f64,
    /// When the row's samples are converted, in seconds of run time.
    pub readout_s: f64,
}

/// Everything between photons and codes of one sensor.
pub struct Chain {
    /// Chosen effects in physical order.
    effects: Vec<Box<dyn Effect>>,
    /// What pixel and converters are set to.
    parameters: Parameters,
    /// The column converters.
    converter: Converter,
    /// Seed of the run.
    seed: u64,
    /// Seed of the die.
    die_seed: u64,
}

/// Which exposure is captured.
#[derive(Clone, Copy, Debug)]
pub struct Capture<'a> {
    /// Camera of the rig.
    pub camera: CameraIndex,
    /// Frame of the run.
    pub frame: FrameIndex,
    /// Exposure within the frame; 0 for single exposures.
    pub slot: u32,
    /// Electrons of the array in the frame before, as `Captured::charge_e` gave them; none in the first frame.
    pub before_e: Option<&'a Plane<f32>>,
}

impl Capture<'static> {
    /// The only exposure of a frame that nothing stands before.
    pub fn single(camera: CameraIndex, frame: FrameIndex) -> Self {
        Self { camera, frame, slot: 0, before_e: None }
    }
}

/// What a capture gives.
pub struct Captured {
    /// Codes in LSB.
    pub codes: Plane<u16>,
    /// Events of reset, transfer, conversion and readout.
    pub events: Events,
    /// Electrons of the array at the end of the exposure, where the next frame needs them.
    pub charge_e: Option<Plane<f32>>,
}

/// The samples of one row in microvolts at the converters' inputs.
#[derive(Clone, Debug, PartialEq)]
pub struct RowSamples {
    /// Signal, above the dark level.
    pub signal_uv: Vec<f32>,
    /// Reset, about 0; empty where it is not converted apart.
    pub reset_uv: Vec<f32>,
}

impl Chain {
    /// A sensor with these effects, which must stand in physical order. `seed` names the run's draws, `die_seed` the die's patterns.
    pub fn new(parameters: Parameters, effects: Vec<Box<dyn Effect>>, seed: u64, die_seed: u64) -> Self {
        assert!(effects.is_sorted_by_key(|effect| effect.domain()), "effects stand in physical order");
        Self { effects, converter: Converter::new(&parameters.adc), parameters, seed, die_seed }
    }

    /// The same with its converters on another rung: clock by clock, or in closed form.
    #[must_use]
    pub fn at(self, rung: Rung) -> Self {
        Self { converter: self.converter.at(rung), ..self }
    }

    /// Converters of one camera.
    pub fn columns(&self, camera: CameraIndex, width: usize) -> adc::Columns<'_> {
        let capture = Capture::single(camera, FrameIndex(0));
        let place = RowPlace { seed: self.die_seed, ..self.place(capture, 0) };
        self.converter.columns(DrawKey::of_row(adc::COLUMN_DELAY, place), width)
    }

    /// Codes of one exposure from its mean photons, and the events of its conversion. `times` holds one entry a row.
    pub fn capture(&self, photons: &Plane<f32>, capture: Capture<'_>, times: &[RowTimes]) -> Captured {
        assert!(times.len() == photons.height_px(), "every row has its times");
        let charge_e = self.has_array_effects().then(|| self.array_electrons(photons, capture, times));
        let mut codes = Plane::filled(photons.size(), 0_u16);
        let width = photons.width_px();
        let columns = self.columns(capture.camera, width);
        let chunk = |(index, rows): (usize, &mut [u16])| {
            let mut buffers = RowBuffers::new(width, self.samples());
            let mut events = Events::default();
            for (offset, row_codes) in rows.chunks_exact_mut(width).enumerate() {
                let row = index * ROWS_PER_CHUNK + offset;
                match &charge_e {
                    Some(charge_e) => buffers.values.copy_from_slice(charge_e.row(row)),
                    None => self.gather(photons.row(row), capture, row, times[row], &mut buffers),
                }
                self.sense(capture, row, times[row], &mut buffers);
                let work = columns.convert_row(&buffers.values, &buffers.reset, row_codes);
                adc::count_row(&self.parameters.adc, self.parameters.pixel.pixel_type, width, work, &mut events);
            }
            events
        };
        let chunks: Vec<Events> = map_chunks(codes.values_mut(), width * ROWS_PER_CHUNK, chunk);
        let mut events = Events::default();
        for part in &chunks {
            events.merge(part);
        }
        let charge_e = charge_e.filter(|_| self.effects.iter().any(|effect| effect.needs_frame_before()));
        Captured { codes, events, charge_e }
    }

    /// Samples of one row at the converters' inputs, before quantisation: where the plan's bounds hold. Effects of the whole
    /// array see this row alone, as if all rows were like it.
    pub fn row_samples(&self, photons: &[f32], capture: Capture<'_>, row: RowIndex, times: RowTimes) -> RowSamples {
        let mut buffers = RowBuffers::new(photons.len(), self.samples());
        let row = crate::num::index(row.0);
        self.gather(photons, capture, row, times, &mut buffers);
        if self.has_array_effects() {
            let size = crate::units::Size { width_px: u32_from(photons.len()), height_px: 1 };
            let mut charge_e = Plane::from_values(size, buffers.values);
            self.act_on_array(&mut charge_e, capture);
            buffers.values = charge_e.values().to_vec();
        }
        self.sense(capture, row, times, &mut buffers);
        RowSamples { signal_uv: buffers.values, reset_uv: buffers.reset }
    }

    /// Samples of some rows of an exposure at the converters' inputs, as `capture` converts them.
    pub fn samples_of_rows(
        &self,
        photons: &Plane<f32>,
        capture: Capture<'_>,
        times: &[RowTimes],
        rows: &[RowIndex],
    ) -> Vec<RowSamples> {
        assert!(times.len() == photons.height_px(), "every row has its times");
        let charge_e = self.has_array_effects().then(|| self.array_electrons(photons, capture, times));
        let samples = |&row: &RowIndex| {
            let row = crate::num::index(row.0);
            let mut buffers = RowBuffers::new(photons.width_px(), self.samples());
            match &charge_e {
                Some(charge_e) => buffers.values.copy_from_slice(charge_e.row(row)),
                None => self.gather(photons.row(row), capture, row, times[row], &mut buffers),
            }
            self.sense(capture, row, times[row], &mut buffers);
            RowSamples { signal_uv: buffers.values, reset_uv: buffers.reset }
        };
        rows.iter().map(samples).collect()
    }

    fn samples(&self) -> Samples {
        self.parameters.adc.cds.samples()
    }

    fn effects_of(&self, domains: std::ops::RangeInclusive<Domain>) -> &[Box<dyn Effect>] {
        let start = self.effects.partition_point(|effect| effect.domain() < *domains.start());
        let end = self.effects.partition_point(|effect| effect.domain() <= *domains.end());
        &self.effects[start..end]
    }

    fn has_array_effects(&self) -> bool {
        !self.effects_of(Domain::ArrayElectrons..=Domain::ArrayElectrons).is_empty()
    }

    /// Electrons of all rows, after the effects of the whole array.
    fn array_electrons(&self, photons: &Plane<f32>, capture: Capture<'_>, times: &[RowTimes]) -> Plane<f32> {
        let mut charge_e = Plane::filled(photons.size(), 0.0_f32);
        let width = photons.width_px();
        let chunk = |(index, rows): (usize, &mut [f32])| {
            let mut buffers = RowBuffers::new(width, Samples::Signal);
            for (offset, row_e) in rows.chunks_exact_mut(width).enumerate() {
                let row = index * ROWS_PER_CHUNK + offset;
                self.gather(photons.row(row), capture, row, times[row], &mut buffers);
                row_e.copy_from_slice(&buffers.values);
            }
        };
        map_chunks(charge_e.values_mut(), width * ROWS_PER_CHUNK, chunk);
        self.act_on_array(&mut charge_e, capture);
        charge_e
    }

    fn act_on_array(&self, charge_e: &mut Plane<f32>, capture: Capture<'_>) {
        let place = self.place(capture, 0);
        let mut pass = ArrayPass { place, die_seed: self.die_seed, charge_e, before_e: capture.before_e };
        for effect in self.effects_of(Domain::ArrayElectrons..=Domain::ArrayElectrons) {
            effect.apply_to_array(&mut pass);
        }
    }

    fn place(&self, capture: Capture<'_>, row: usize) -> RowPlace {
        let Capture { camera, frame, slot, .. } = capture;
        RowPlace { seed: self.seed, camera, frame, slot, row: RowIndex(u32_from(row)) }
    }

    /// From photons to the electrons that a row's pixels gather.
    fn gather(&self, photons: &[f32], capture: Capture<'_>, row: usize, times: RowTimes, buffers: &mut RowBuffers) {
        buffers.values.copy_from_slice(photons);
        pixel::photons_to_mean_electrons(&self.parameters.pixel, &mut buffers.values);
        let mut pass = buffers.pass(self.place(capture, row), self.die_seed, times);
        for effect in self.effects_of(Domain::MeanElectrons..=Domain::Electrons) {
            effect.apply(&mut pass);
        }
    }

    /// From gathered electrons to the samples at the converters' inputs.
    fn sense(&self, capture: Capture<'_>, row: usize, times: RowTimes, buffers: &mut RowBuffers) {
        buffers.reset.fill(0.0);
        let mut pass = buffers.pass(self.place(capture, row), self.die_seed, times);
        for effect in self.effects_of(Domain::SensedElectrons..=Domain::SensedElectrons) {
            effect.apply(&mut pass);
        }
        pixel::electrons_to_microvolts(&self.parameters.pixel, pass.values);
        for effect in self.effects_of(Domain::Microvolts..=Domain::Microvolts) {
            effect.apply(&mut pass);
        }
    }
}

struct RowBuffers {
    values: Vec<f32>,
    reset: Vec<f32>,
    uniforms: Vec<u32>,
    draws: Vec<f32>,
}

impl RowBuffers {
    fn new(width: usize, samples: Samples) -> Self {
        let reset = if samples == Samples::Both { width } else { 0 };
        Self { values: vec![0.0; width], reset: vec![0.0; reset], uniforms: vec![0; width], draws: vec![0.0; width] }
    }

    fn pass(&mut self, place: RowPlace, die_seed: u64, times: RowTimes) -> RowPass<'_> {
        RowPass {
            place,
            die_seed,
            exposure_s: times.exposure_s,
            storage_s: times.storage_s,
            readout_s: times.readout_s,
            values: &mut self.values,
            reset: &mut self.reset,
            uniforms: &mut self.uniforms,
            draws: &mut self.draws,
        }
    }
}

#[cfg(feature = "parallel")]
fn map_chunks<V: Send, T: Send>(
    values: &mut [V],
    size: usize,
    chunk: impl Fn((usize, &mut [V])) -> T + Sync + Send,
) -> Vec<T> {
    use rayon::prelude::*;
    values.par_chunks_mut(size).enumerate().map(chunk).collect()
}

#[cfg(not(feature = "parallel"))]
fn map_chunks<V, T>(values: &mut [V], size: usize, chunk: impl Fn((usize, &mut [V])) -> T) -> Vec<T> {
    values.chunks_mut(size).enumerate().map(chunk).collect()
}
