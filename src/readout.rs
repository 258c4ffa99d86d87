//! The row sequencer. Enters: array size, line and frame length, exposure. Leaves: when each row is exposed and read.

mod params;
mod schedule;

pub use params::{ReadoutParams, Shutter};
pub use schedule::Schedule;
