//! Lens and aperture: keys of `[optics]`.

use serde::{Deserialize, Serialize};

sections! {
    /// Lens and aperture.
    Optics {
        /// Name of a lens preset.
        preset: String,
        /// Across the width of the array, before distortion, 1 to 170.
        horizontal_fov_deg: f64,
        /// Radial distortion, r^2.
        k1: f64,
        /// Radial distortion, r^4.
        k2: f64,
        /// Tangential distortion.
        p1: f64,
        /// Tangential distortion.
        p2: f64,
        /// Aperture, 0.5 to 64.
        f_number: f64,
        /// Of the lens, 0 to 1.
        transmission: f64,
        /// Share of 700 to 1000 nm that passes as well, 0 (a cut filter) to 1 (none).
        infrared_transmission: f64,
        /// "thin_lens" (1 + 4 N^2) or "aplanatic" (4 N^2).
        pupil: String,
        /// "cos4" or "none".
        roll_off: String,
    }
}
