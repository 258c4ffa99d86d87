//! Column converters. Convert microvolts to codes in LSB and count the events that the conversions take.
//!
//! The conversion itself always runs (`Converter`): ramp, comparators with their delays and kickback, counters. Offsets, gains,
//! noises and settling of the columns are effects. docs/adc.md has the details.

mod clocked;
mod column_delay;
mod column_gain;
mod column_offset;
mod column_settling;
mod columns;
mod comparator_noise;
mod convert;
mod crossings;
pub mod density;
mod derived;
mod event_counts;
mod expected;
mod fast;
mod kickback;
mod linear;
mod params;
mod ramp;
mod ramp_jitter;
mod sample;
mod shared_noise;
mod span;
mod supply_ripple;

pub use clocked::{ClockView, Comparators, Counters};
pub use column_delay::NUMBER as COLUMN_DELAY;
pub use column_gain::ColumnGain;
pub use column_offset::ColumnOffset;
pub use column_settling::ColumnSettling;
pub use columns::{Columns, Converter};
pub use comparator_noise::comparator_noise;
pub use convert::Crossings;
pub use event_counts::{count_conversion, count_row};
pub use expected::{CodeMoments, NoisyLevel, clipped};
pub use params::{AdcParams, Cds, Counter, Counting, Ramp};
pub use ramp::RampLevels;
pub use ramp_jitter::RampJitter;
pub use sample::{RowWork, Sample};
pub use shared_noise::{column_noise, ramp_noise, row_noise, row_offset};
pub use supply_ripple::SupplyRipple;

#[cfg(test)]
pub(crate) use params::tests as params_tests;
