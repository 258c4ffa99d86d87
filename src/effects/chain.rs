//! Runs the chosen effects over a frame: one pass an effect over a row buffer that stays in L1, no question asked in a pixel loop.
//!
//! Rows are independent but for the effects of `Domain::ArrayElectrons`: only where one of these is chosen, the electrons of the
//! whole array are held between two sweeps over the rows.

mod black;
mod reading;

pub use black::BlackRows;
use reading::Reading;

use super::Parameters;
use crate::draw::RowPlace;
use crate::effect::{ArrayPass, Domain, Effect, RowPass};
use crate::events::Events;
use crate::num::u32_from;
use crate::pixel::{self, Samples};
use crate::plane::Plane;
use crate::readout::HdrMerge;
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

/// Which row, and when.
#[derive(Clone, Copy)]
struct RowAt {
    place: RowPlace,
    times: RowTimes,
}

/// Everything between photons and codes of one sensor.
pub struct Chain {
    /// What pixel and converters are set to, at the higher gain.
    parameters: Parameters,
    /// Chosen effects up to the charge of the array, in physical order.
    gathering: Vec<Box<dyn Effect>>,
    /// One a conversion gain, the most sensitive first.
    readings: Vec<Reading>,
    /// How the codes of several readings become one.
    merge: Option<HdrMerge>,
    black: BlackRows,
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
    /// What the black clamp added to the codes of the first reading.
    pub black_shift_dn: i32,
}

/// The samples of one row in microvolts at the converters' inputs.
pub struct RowSamples {
    /// Signal, above the dark level.
    pub signal_uv: Vec<f32>,
    /// Reset, about 0; empty where it is not converted apart.
    pub reset_uv: Vec<f32>,
}

impl Chain {
    /// A sensor with these effects, which must stand in physical order. `seed` names the run's draws, `die_seed` the die's patterns.
    pub fn new(parameters: Parameters, mut effects: Vec<Box<dyn Effect>>, seed: u64, die_seed: u64) -> Self {
        assert!(effects.is_sorted_by_key(|effect| effect.domain()), "effects stand in physical order");
        let sensed = effects.partition_point(|effect| effect.domain() < Domain::SensedElectrons);
        let readings = vec![Reading::new(parameters.clone(), effects.split_off(sensed), 0)];
        let black = BlackRows::default();
        Self { parameters, gathering: effects, readings, merge: None, black, seed, die_seed }
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
        self.readings.push(Reading::new(parameters, effects, 1));
        self.merge = Some(merge);
        self
    }

    /// The same sensor with optical-black rows, which are read before the picture.
    #[must_use]
    pub fn with_black_rows(mut self, black: BlackRows) -> Self {
        self.black = black;
        self
    }

    /// Depth of the codes that leave.
    pub fn bits(&self) -> u32 {
        self.merge.as_ref().map_or(self.parameters.adc.bits, HdrMerge::bits)
    }

    /// Codes of one exposure from its mean photons, and the events of its conversion. `times` holds one entry a row.
    pub fn capture(&self, photons: &Plane<f32>, capture: Capture<'_>, times: &[RowTimes]) -> Captured {
        assert!(times.len() == photons.height_px(), "every row has its times");
        let charge_e = self.has_array_effects().then(|| self.array_electrons(photons, capture, times));
        let mut events = Events::default();
        let shifts_dn = self.black_shifts_dn(capture, photons, times[0], &mut events);
        let mut codes = Plane::filled(photons.size(), 0_u16);
        let width = photons.width_px();
        let chunk = |(index, rows): (usize, &mut [u16])| {
            let mut buffers = RowBuffers::new(width, self.samples(), self.readings.len());
            let mut events = Events::default();
            for (offset, row_codes) in rows.chunks_exact_mut(width).enumerate() {
                let row = index * ROWS_PER_CHUNK + offset;
                match &charge_e {
                    Some(charge_e) => buffers.values.copy_from_slice(charge_e.row(row)),
                    None => self.gather(photons.row(row), capture, row, times[row], &mut buffers),
                }
                self.read(self.at(capture, row, times[row]), &shifts_dn, &mut buffers, row_codes, &mut events);
            }
            events
        };
        for part in &map_chunks(codes.values_mut(), width * ROWS_PER_CHUNK, chunk) {
            events.merge(part);
        }
        let charge_e = charge_e.filter(|_| self.gathering.iter().any(|effect| effect.needs_frame_before()));
        Captured { codes, events, charge_e, black_shift_dn: shifts_dn[0] }
    }

    /// Samples of one row at the converters' inputs in the first reading, before quantisation: where the plan's bounds hold. Effects
    /// of the whole array see this row alone.
    pub fn row_samples(&self, photons: &[f32], capture: Capture<'_>, row: RowIndex, times: RowTimes) -> RowSamples {
        let mut buffers = RowBuffers::new(photons.len(), self.samples(), 1);
        let row = crate::num::index(row.0);
        self.gather(photons, capture, row, times, &mut buffers);
        if self.has_array_effects() {
            let size = crate::units::Size { width_px: u32_from(photons.len()), height_px: 1 };
            let mut charge_e = Plane::from_values(size, std::mem::take(&mut buffers.values));
            self.act_on_array(&mut charge_e, capture);
            buffers.values = charge_e.values().to_vec();
        }
        let at = self.at(capture, row, times);
        self.readings[0].sense(at, self.die_seed, &mut buffers);
        self.readings[0].sample(at, self.die_seed, &mut buffers);
        RowSamples { signal_uv: buffers.values, reset_uv: buffers.reset }
    }

    fn samples(&self) -> Samples {
        self.parameters.adc.cds.samples()
    }

    fn array_effects(&self) -> &[Box<dyn Effect>] {
        let start = self.gathering.partition_point(|effect| effect.domain() < Domain::ArrayElectrons);
        &self.gathering[start..]
    }

    fn has_array_effects(&self) -> bool {
        !self.array_effects().is_empty()
    }

    /// Electrons of all rows, after the effects of the whole array.
    fn array_electrons(&self, photons: &Plane<f32>, capture: Capture<'_>, times: &[RowTimes]) -> Plane<f32> {
        let mut charge_e = Plane::filled(photons.size(), 0.0_f32);
        let width = photons.width_px();
        let chunk = |(index, rows): (usize, &mut [f32])| {
            let mut buffers = RowBuffers::new(width, Samples::Signal, 1);
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
        for effect in self.array_effects() {
            effect.apply_to_array(&mut pass);
        }
    }

    fn place(&self, capture: Capture<'_>, row: usize) -> RowPlace {
        let Capture { camera, frame, slot, .. } = capture;
        RowPlace { seed: self.seed, camera, frame, slot, row: RowIndex(u32_from(row)) }
    }

    fn at(&self, capture: Capture<'_>, row: usize, times: RowTimes) -> RowAt {
        RowAt { place: self.place(capture, row), times }
    }

    /// From photons to the electrons that a row's pixels gather.
    fn gather(&self, photons: &[f32], capture: Capture<'_>, row: usize, times: RowTimes, buffers: &mut RowBuffers) {
        buffers.values.copy_from_slice(photons);
        pixel::photons_to_mean_electrons(&self.parameters.pixel, &mut buffers.values);
        let mut pass = buffers.pass(self.at(capture, row, times), self.die_seed);
        for effect in self.gathering.iter().filter(|effect| effect.domain() < Domain::ArrayElectrons) {
            effect.apply(&mut pass);
        }
    }

    /// From gathered electrons to the row's codes: every reading, clamped, and merged where there are several.
    fn read(&self, at: RowAt, shifts_dn: &[i32], buffers: &mut RowBuffers, codes: &mut [u16], events: &mut Events) {
        let Some(merge) = &self.merge else {
            self.read_once(0, at, shifts_dn, buffers, codes, events);
            return;
        };
        let charge_e = buffers.values.clone();
        let mut read = std::mem::take(&mut buffers.codes);
        for (number, codes) in read.iter_mut().enumerate() {
            buffers.values.copy_from_slice(&charge_e);
            self.read_once(number, at, shifts_dn, buffers, codes, events);
        }
        let rows: Vec<&[u16]> = read.iter().map(Vec::as_slice).collect();
        merge.merge_row(&rows, codes);
        buffers.codes = read;
    }

    fn read_once(
        &self,
        number: usize,
        at: RowAt,
        shifts_dn: &[i32],
        buffers: &mut RowBuffers,
        codes: &mut [u16],
        events: &mut Events,
    ) {
        let reading = &self.readings[number];
        reading.sense(at, self.die_seed, buffers);
        reading.sample(at, self.die_seed, buffers);
        reading.convert(buffers, codes, events);
        black::shift_row(codes, shifts_dn[number], reading.parameters.adc.code_max());
    }
}

struct RowBuffers {
    values: Vec<f32>,
    reset: Vec<f32>,
    uniforms: Vec<u32>,
    draws: Vec<f32>,
    /// Codes of each reading, where there are several.
    codes: Vec<Vec<u16>>,
}

impl RowBuffers {
    fn new(width: usize, samples: Samples, readings: usize) -> Self {
        let reset = if samples == Samples::Both { width } else { 0 };
        Self {
            values: vec![0.0; width],
            reset: vec![0.0; reset],
            uniforms: vec![0; width],
            draws: vec![0.0; width],
            codes: if readings > 1 { vec![vec![0; width]; readings] } else { Vec::new() },
        }
    }

    fn pass(&mut self, at: RowAt, die_seed: u64) -> RowPass<'_> {
        let RowAt { place, times } = at;
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
