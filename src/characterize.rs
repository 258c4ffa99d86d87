//! An EMVA 1288 (release 4.0) measurement of the simulated sensor. Takes frames of uniform light and computes every figure of the standard
//! with its standard error, and the truth that the configuration implies. Of the scenario, only the sensor is used. It touches no disk;
//! `files::emva` writes the files for external judges.
//!
//! Light falls straight onto the pixels: no lens, no scene, so photons per pixel and exposure are known. Exposure times are set freely
//! in whole nanoseconds under constant light, also beyond the sequencer's longest, as with a lengthened frame. All effects of the
//! sensor act (no plan). The array's first rows and columns are measured, pixel by pixel, whatever window or binning the readout has. One
//! descriptor holds one colour plane. A sensor of several readings a pixel (HDR) is measured in the first alone, the most sensitive.

pub mod analysis;
mod bench;
pub mod channel;
mod defects;
mod dither;
#[cfg(feature = "cli")]
pub mod fit;
#[cfg(feature = "cli")]
pub mod fit_page;
mod fits;
pub mod measure;
mod model;
mod moments;
#[cfg(feature = "cli")]
pub mod page;
#[cfg(feature = "cli")]
mod map;
pub mod record;
pub mod set;
mod shoot;
mod spatial;
mod uncertainty;
mod unmodelled;
pub mod truth;

pub use analysis::{Figures, figures};
pub use measure::ChannelMeasurement;
pub use record::Characterization;
pub use set::{MeasurementSize, PlannedShot, Set};
pub use truth::{ChannelTruth, Want};

pub use bench::SensorBench;
