//! Lens and aperture. Enters: rays of a scene. Leaves: mean photons at each pixel over its own exposure window.
pub mod lens;
