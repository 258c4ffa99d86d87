//! Column converters. Enters: microvolts. Leaves: codes in LSB, and the events that making them took.
//!
//! The conversion itself always runs (`Converter`); offsets and gains of the columns are effects.

mod column_gain;
mod column_offset;
mod convert;
mod event_counts;
mod params;

pub use column_gain::ColumnGain;
pub use column_offset::ColumnOffset;
pub use convert::Converter;
pub use event_counts::count_row;
pub use params::{AdcParams, Cds, Counter, Counting, Ramp};

#[cfg(test)]
pub(crate) use params::tests as params_tests;
