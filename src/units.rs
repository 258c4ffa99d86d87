//! Units and indices that every stage shares.
//!
//! Floats carry their unit at the end of their name; integers that must never be mixed are newtypes.

use crate::num::{greater, lesser};

/// A count of clocks of one named domain (`pix_clk`, `adc_clk` or `byte_clk`; the name of the variable says which).
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct Clocks(pub u64);

/// A row of the pixel array, counted from 0 at the top.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct RowIndex(pub u32);

/// A frame of a run, counted from 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct FrameIndex(pub u32);

/// A camera of a rig, counted from 0.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub struct CameraIndex(pub u32);

/// Width and height of a picture or pixel array.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct Size {
    /// Columns.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
}

impl Size {
    /// Number of pixels.
    pub fn pixel_count(self) -> usize {
        crate::num::index(self.width_px) * crate::num::index(self.height_px)
    }
}

/// A span of run time in seconds: an exposure, or the readout of a row. `end_s >= start_s`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Span {
    /// First instant.
    pub start_s: f64,
    /// Last instant.
    pub end_s: f64,
}

impl Span {
    /// Length in seconds.
    pub fn length_s(self) -> f64 {
        self.end_s - self.start_s
    }

    /// From the first start to the last end of some spans.
    pub fn around(spans: &[Self]) -> Self {
        Self {
            start_s: spans.iter().fold(f64::INFINITY, |least, span| lesser(least, span.start_s)),
            end_s: spans.iter().fold(f64::NEG_INFINITY, |most, span| greater(most, span.end_s)),
        }
    }

    /// Instant half-way between start and end.
    pub fn middle_s(self) -> f64 {
        self.start_s + 0.5 * (self.end_s - self.start_s)
    }
}

/// Boltzmann's constant in J/K (CODATA 2018, exact).
pub const BOLTZMANN_J_PER_K: f64 = 1.380_649e-23;

/// Elementary charge in C (CODATA 2018, exact).
pub const ELEMENTARY_CHARGE_C: f64 = 1.602_176_634e-19;
