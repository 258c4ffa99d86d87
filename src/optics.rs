//! Lens and aperture. Enters: rays of a scene. Leaves: mean photons at each pixel over its own exposure window.

pub mod bounds;
pub mod camera;
pub mod lens;
pub mod mosaic;
mod motion;
pub mod render;
pub mod truth;

pub use bounds::photon_bounds;
pub use camera::{Aperture, Camera, Pupil, RollOff};
pub use mosaic::Mosaic;
pub use render::{Exposure, Sampling, render};
