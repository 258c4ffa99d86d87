//! From photons to pose, bit by bit: a machine-perception image sensor, end to end.
//!
//! The modules stand in the order in which light becomes a pose; a stage uses only the ones before it.

pub mod draw;
pub mod effect;
pub mod error;
pub mod events;
pub mod facts;
pub mod fidelity;
pub mod num;
pub mod plane;
pub mod pose;
pub mod simd;
pub mod units;

pub mod adc;
pub mod compute;
pub mod energy;
#[cfg(feature = "cli")]
pub mod files;
pub mod link;
pub mod optics;
pub mod pixel;
pub mod readout;
pub mod report;
pub mod scene;
pub mod tracker;
