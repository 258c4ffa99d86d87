//! Items of a power budget.

use super::constant::Constant;
use super::params::EnergyParams;
use super::technology::Technology;
use crate::adc::AdcParams;
use crate::events::{Block, Event};
use crate::link::LinkParams;
use crate::pixel::PixelParams;
use crate::readout::Shutter;
use crate::text::named;

named! {
    /// A supply rail.
    pub enum Rail {
        /// Pixels, columns, converters, references.
        Analog = "analog",
        /// Logic and memories.
        Digital = "digital",
        /// The port.
        Io = "io",
    }
}

/// How often an item happens.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Amount {
    /// As often as an event; the constant is in attojoules.
    Event(Event),
    /// Events in every frame of a sensor; the constant is in attojoules.
    PerFrame(u64),
    /// Nanoseconds of every frame of a sensor; the constant is in nanowatts.
    Nanoseconds(u64),
    /// As many nanoseconds as the data lanes together are in high-speed mode; the constant is in nanowatts.
    LaneNanoseconds,
}

/// A part of a sensor's power.
#[derive(Clone, Debug, PartialEq)]
pub struct Item {
    /// The constant's name.
    pub name: &'static str,
    /// Who pays.
    pub block: Block,
    /// From which supply.
    pub rail: Rail,
    /// How often.
    pub amount: Amount,
    /// Attojoules a time, or nanowatts.
    pub constant: u64,
    /// The technology's constant that it rests on, for uncertainty and source.
    pub of: Constant,
}

/// What of a sensor decides its power.
#[derive(Clone, Debug, PartialEq)]
pub struct PoweredSensor {
    /// Keys of `[energy]`.
    pub params: EnergyParams,
    /// Photodiode to column.
    pub pixel: PixelParams,
    /// Column converters.
    pub adc: AdcParams,
    /// The link.
    pub link: LinkParams,
    /// Analog supply in V.
    pub supply_v: f64,
    /// Whether an extractor is on the sensor.
    pub has_extractor: bool,
    /// Which of a row's lines are driven.
    pub shutter: Shutter,
    /// Columns of the array: the length of a row line.
    pub row_px: u32,
    /// Columns that are read: each has its current source.
    pub columns: u32,
    /// Pixels that are read.
    pub pixels: u64,
    /// Codes of an output row.
    pub depth_bits: u32,
    /// Exposures of a frame.
    pub exposures: u64,
    /// Codes of a pixel that leave the columns in a frame: exposures times conversions.
    pub readings: u64,
    /// Depth of the one code that they are merged to, before companding; that of the converter where there is one reading.
    pub merged_bits: u32,
    /// Lines of a frame in which columns are converted, all exposures and black rows included.
    pub active_lines: u64,
    /// Settling, ramps and pulses of such a line, in seconds; at most the line.
    pub conversion_s: f64,
    /// A line in seconds.
    pub line_s: f64,
    /// From frame to frame in seconds.
    pub frame_s: f64,
    /// A frame in seconds without the wait for a trigger.
    pub readout_s: f64,
    /// A frame in `pix_clk`.
    pub frame_clk: u64,
}

/// The items while they are made.
pub(super) struct ItemBuilder<'a> {
    pub sensor: &'a PoweredSensor,
    pub technology: &'a Technology,
    /// Nanoseconds of a frame.
    pub frame_ns: u64,
    /// Nanoseconds that waking up takes before each; 0 where the sensor streams.
    pub wake_ns: u64,
    pub(super) items: Vec<Item>,
}
