//! Runs the chosen effects over rows: one pass an effect over a row buffer that stays in L1, no question asked in a pixel loop.

use super::Parameters;
use crate::adc::{self, Converter};
use crate::draw::RowPlace;
use crate::effect::{Domain, Effect, RowPass};
use crate::events::Events;
use crate::num::u32_from;
use crate::pixel;
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
}

/// Everything between photons and codes of one sensor.
pub struct Chain {
    /// Chosen effects in physical order.
    effects: Vec<Box<dyn Effect>>,
    /// What pixel and converters are set to.
    parameters: Parameters,
    /// Closed form of the column converters.
    converter: Converter,
    /// Seed of the run.
    seed: u64,
    /// Seed of the die.
    die_seed: u64,
}

/// Which frame is captured.
#[derive(Clone, Copy, Debug)]
pub struct Capture {
    /// Camera of the rig.
    pub camera: CameraIndex,
    /// Frame of the run.
    pub frame: FrameIndex,
}

impl Chain {
    /// A sensor with these effects, which must stand in physical order. `seed` names the run's draws, `die_seed` the die's patterns.
    pub fn new(parameters: Parameters, effects: Vec<Box<dyn Effect>>, seed: u64, die_seed: u64) -> Self {
        assert!(effects.is_sorted_by_key(|effect| effect.domain()), "effects stand in physical order");
        Self { effects, converter: Converter::new(&parameters.adc), parameters, seed, die_seed }
    }

    /// Codes of one frame from its mean photons, and the events of its conversion. `times` holds one entry a row.
    pub fn capture(&self, photons: &Plane<f32>, capture: Capture, times: &[RowTimes]) -> (Plane<u16>, Events) {
        assert!(times.len() == photons.height_px(), "every row has its times");
        let mut codes = Plane::filled(photons.size(), 0_u16);
        let width = photons.width_px();
        let chunk = |(index, rows): (usize, &mut [u16])| {
            let mut buffers = RowBuffers::new(width);
            let mut events = Events::default();
            for (offset, row_codes) in rows.chunks_exact_mut(width).enumerate() {
                let row = index * ROWS_PER_CHUNK + offset;
                self.capture_row(photons.row(row), capture, row, times[row], &mut buffers, row_codes);
                adc::count_row(&self.parameters.adc, self.parameters.pixel.pixel_type, row_codes, &mut events);
            }
            events
        };
        let chunks: Vec<Events> = map_chunks(codes.values_mut(), width * ROWS_PER_CHUNK, chunk);
        let mut events = Events::default();
        for part in &chunks {
            events.merge(part);
        }
        (codes, events)
    }

    fn capture_row(
        &self,
        photons: &[f32],
        capture: Capture,
        row: usize,
        times: RowTimes,
        buffers: &mut RowBuffers,
        codes: &mut [u16],
    ) {
        self.sense_row(photons, capture, row, times, buffers);
        self.converter.convert_row(&buffers.values, codes);
    }

    /// Microvolts at the converters' inputs of one row, before quantisation: where the plan's bounds hold.
    pub fn row_microvolts(&self, photons: &[f32], capture: Capture, row: RowIndex, times: RowTimes) -> Vec<f32> {
        let mut buffers = RowBuffers::new(photons.len());
        self.sense_row(photons, capture, crate::num::index(row.0), times, &mut buffers);
        buffers.values
    }

    fn sense_row(&self, photons: &[f32], capture: Capture, row: usize, times: RowTimes, buffers: &mut RowBuffers) {
        buffers.values.copy_from_slice(photons);
        pixel::photons_to_mean_electrons(&self.parameters.pixel, &mut buffers.values);
        let mut pass = RowPass {
            place: RowPlace {
                seed: self.seed,
                camera: capture.camera,
                frame: capture.frame,
                slot: 0,
                row: RowIndex(u32_from(row)),
            },
            die_seed: self.die_seed,
            exposure_s: times.exposure_s,
            storage_s: times.storage_s,
            values: &mut buffers.values,
            uniforms: &mut buffers.uniforms,
            draws: &mut buffers.draws,
        };
        let charge_effects = self.effects.partition_point(|effect| effect.domain() < Domain::Microvolts);
        for effect in &self.effects[..charge_effects] {
            effect.apply(&mut pass);
        }
        pixel::electrons_to_microvolts(&self.parameters.pixel, pass.values);
        for effect in &self.effects[charge_effects..] {
            effect.apply(&mut pass);
        }
    }
}

struct RowBuffers {
    values: Vec<f32>,
    uniforms: Vec<u32>,
    draws: Vec<f32>,
}

impl RowBuffers {
    fn new(width: usize) -> Self {
        Self { values: vec![0.0; width], uniforms: vec![0; width], draws: vec![0.0; width] }
    }
}

#[cfg(feature = "parallel")]
fn map_chunks<F>(values: &mut [u16], size: usize, chunk: F) -> Vec<Events>
where
    F: Fn((usize, &mut [u16])) -> Events + Sync + Send,
{
    use rayon::prelude::*;
    values.par_chunks_mut(size).enumerate().map(chunk).collect()
}

#[cfg(not(feature = "parallel"))]
fn map_chunks<F>(values: &mut [u16], size: usize, chunk: F) -> Vec<Events>
where
    F: Fn((usize, &mut [u16])) -> Events,
{
    values.chunks_mut(size).enumerate().map(chunk).collect()
}
