//! From photons to pose, bit by bit: a machine-perception image sensor, end to end.
//!
//! The modules stand in the order in which light becomes a pose; a stage uses only the ones before it.

pub mod units;
pub mod num;
pub mod plane;
pub mod pose;
pub mod error;
pub mod simd;
pub mod draw;
pub mod events;
pub mod facts;
pub mod fidelity;
pub mod effect;

pub mod scene;
pub mod optics;
pub mod pixel;
pub mod adc;
pub mod readout;
pub mod compute;
pub mod link;
pub mod energy;
pub mod tracker;
pub mod report;

pub mod effects;
pub mod config;
pub mod run;
#[cfg(feature = "cli")]
pub mod files;
