//! The chain's fields, and what it takes and gives for one exposure.

use super::super::Parameters;
use super::layout::WindowLayout;
use crate::adc::{Columns, Converter};
use crate::effect::Effect;
use crate::events::Events;
use crate::plane::Plane;
use crate::readout::HdrMerge;
use crate::units::{CameraIndex, FrameIndex};

/// Rows that one task takes. Fixed, so that work is cut the same way on any number of threads.
pub(super) const ROWS_PER_CHUNK: usize = 16;

/// Exposure, storage and readout times of one row.
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
    /// What pixel and converters are set to, at the higher gain.
    pub(super) parameters: Parameters,
    /// Chosen effects up to the charge of the array, in physical order.
    pub(super) charge_effects: Vec<Box<dyn Effect>>,
    /// One for each conversion gain, the most sensitive first.
    pub(super) readings: Vec<Reading>,
    /// How the codes of several readings become one.
    pub(super) merge: Option<HdrMerge>,
    pub(super) black: BlackRows,
    /// Window and binning; none where the photons' plane is the array, pixel by pixel.
    pub(super) layout: Option<WindowLayout>,
    /// Seed of the run.
    pub(super) seed: u64,
    pub(super) die_seed: u64,
    /// Charge in electrons from which on a pixel clips at its full well whatever is drawn; infinite where no effect clips there.
    pub(super) saturated_from_e: f32,
}

/// Which exposure is captured, and what the frame before left in the array.
#[derive(Clone, Copy, Debug)]
pub struct Capture<'a> {
    /// Camera of the rig.
    pub camera: CameraIndex,
    /// Frame of the run.
    pub frame: FrameIndex,
    /// Exposure within the frame; 0 for single exposures.
    pub slot: u32,
    /// Electrons that the frame before left in the array, as `Captured::charge_e` gave them; none in the first frame.
    pub before_e: Option<&'a Plane<f32>>,
}

impl Capture<'static> {
    /// The only exposure of a frame without a previous one.
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
    /// Electrons that stay in the array for the next frame, where an effect leaves some.
    pub charge_e: Option<Plane<f32>>,
    /// Over how many pixels each effect ran, with optical-black rows and every reading, without blocks of pixels in which no draw can show.
    /// In physical order.
    pub hits: Vec<(&'static str, u64)>,
}

/// The samples of one row in microvolts at the converters' inputs.
#[derive(Clone, Debug, PartialEq)]
pub struct RowSamples {
    /// Signal, above the dark level.
    pub signal_uv: Vec<f32>,
    /// Reset, about 0; empty where it is not converted separately.
    pub reset_uv: Vec<f32>,
}

/// Photons, electrons and times of one exposure, from which its codes are read.
pub(super) struct ExposureInput<'a> {
    /// Mean photons of the window.
    pub(super) photons: &'a Plane<f32>,
    /// Electrons of the window, where effects of the array made them.
    pub(super) charge_e: Option<Plane<f32>>,
    pub(super) capture: Capture<'a>,
    /// One entry a row of the window.
    pub(super) times: &'a [RowTimes],
    /// What the black clamp adds to the codes of each reading.
    pub(super) shifts_dn: Vec<i32>,
    /// The converters of each reading.
    pub(super) columns: Vec<Columns<'a>>,
}

/// Adds counts to counts.
pub(super) fn add(hits: &mut [u64], more: &[u64]) {
    for (hits, more) in hits.iter_mut().zip(more) {
        *hits += more;
    }
}

/// Rows behind metal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BlackRows {
    /// How many.
    pub rows: u32,
    /// Row of the array at which they begin, which names their draws: beyond the picture's rows.
    pub first_row: u32,
    /// Whether their mean is moved to the black level.
    pub clamp: bool,
}

/// A readout of the charge at one conversion gain: its effects and its converter.
pub(super) struct Reading {
    pub parameters: Parameters,
    /// Effects on sensed electrons and on microvolts, in physical order.
    pub effects: Vec<Box<dyn Effect>>,
    /// Effects of the microvolts begin here.
    pub(super) sampled_from: usize,
    /// Index of the hit counter of its first effect.
    pub(super) first_counter: usize,
    pub(super) converter: Converter,
    /// Added to the exposure slot of its draws, so that readings of one exposure have independent errors.
    pub(super) number: u32,
}
