//! The row sequencer. Enters: array size, line and frame length, exposure. Leaves: when each row is exposed and read.

mod hdr;
mod params;
mod schedule;

pub use hdr::{HdrMerge, MERGED_BITS_MAX};
pub use params::{ReadoutParams, Shutter};
pub use schedule::Schedule;
