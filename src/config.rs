//! Configuration: merges TOML layers and assignments into a `Resolved` scenario. Every value knows its file and line; the whole has a
//! canonical text and a hash. Reads no file.

pub mod check;
mod compute;
mod energy;
pub mod idle;
mod images;
pub mod inherited;
pub mod light;
pub mod motion;
mod optics;
pub mod presets;
mod readout;
mod render;
mod resolved;
mod rig;
pub mod scenario;
mod sensor_file;
pub mod suggest;
mod target;
pub mod tree;

pub use scenario::Scenario;

pub use resolved::Resolved;
