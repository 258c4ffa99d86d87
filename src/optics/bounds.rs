//! What a pixel can receive, without rendering: bounds from the scene's light and the lens alone.

use super::camera::Camera;
use crate::num::{greater, lesser};
use crate::scene::LitScene;
use crate::scene::light::BANDS;

/// Least and greatest mean photons of a pixel over an exposure. Lamps and sky count as seen, because they may be.
pub fn photon_bounds(scene: &LitScene, camera: &Camera, exposure_s: f64) -> [f64; 2] {
    let per_lux_s = camera.photons_per_lux_s(scene.illuminant());
    let exitance = scene.exitance_bounds();
    let [shade_min, shade_max] = camera.roll_off_bounds();
    let (mut least, mut greatest) = (0.0, 0.0);
    for band in 0..BANDS {
        least += per_lux_s[band] * exitance.least[band];
        greatest += per_lux_s[band] * greater(exitance.greatest[band], exitance.emitted[band]);
    }
    [lesser(least, greatest) * exposure_s * shade_min, greatest * exposure_s * shade_max]
}
