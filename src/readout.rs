//! The row sequencer. Determines which pixels make which picture, and when each row is exposed and read, in clocks and in seconds. Also:
//! registers and automatic exposure.

mod auto_exposure;
mod budget;
mod clock;
mod geometry;
mod limits;
mod hdr;
mod params;
mod registers;
mod schedule;
#[cfg(test)]
mod schedule_tests;
mod slots;

pub use auto_exposure::{AutoExposure, CodeRange, RegisterWrite};
pub use budget::{DemandKind, LineDemand};
pub use clock::{ClockSpan, FrameClock};
pub use geometry::Geometry;
pub use hdr::{HdrMerge, MERGED_BITS_MAX};
pub use params::{
    AutoExposureParams, BinningMode, ExposureSetting, FrameLength, Hdr, LongExposure, Pulses, ReadoutParams, Shutter,
    Trigger, Window,
};
pub use registers::{ExposureSettings, Registers};
pub use schedule::Schedule;
pub use slots::{FrameDemand, Slot};
