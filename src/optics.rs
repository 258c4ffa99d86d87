//! Lens and aperture. Computes the mean photons of each pixel over its exposure, blurred by the lens and shared between neighbours by
//! crosstalk.

pub mod bounds;
pub mod camera;
pub mod crosstalk;
pub mod expose;
pub mod lens;
pub mod mosaic;
mod motion;
pub mod psf;
pub mod render;
#[cfg(feature = "pictures")]
pub mod resample;
pub mod roll_off;
pub mod rounding;
pub mod static_pictures;
pub mod truth;

pub use bounds::photon_bounds;
pub use camera::{Aperture, Camera, Pupil};
pub use expose::{ImagePath, expose, expose_by, expose_still_camera};
pub use mosaic::Mosaic;
pub use psf::Psf;
pub use render::{Exposure, Sampling, render, render_over};
#[cfg(feature = "pictures")]
pub use resample::resample;
pub use roll_off::{RollOff, Shading};
pub use rounding::Rounding;
pub use static_pictures::StaticPictures;
