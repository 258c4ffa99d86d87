//! What a pixel can receive, without rendering: bounds from the scene's light and the lens alone.

use super::camera::Camera;
use crate::num::{greater, lesser};
use crate::scene::light::BANDS;
use crate::scene::object::DynamicScene;
use crate::scene::{ExitanceBounds, Illuminant};

/// Least and greatest mean photons of a pixel over an exposure. Lamps and sky count as seen, because they may be.
pub fn photon_bounds<'a>(scene: impl Into<DynamicScene<'a>>, camera: &Camera, exposure_s: f64) -> [f64; 2] {
    let scene = scene.into();
    of_exitance(scene.fixed.illuminant(), &scene.exitance_bounds(), camera, exposure_s)
}

/// The same for light within these bounds.
pub(super) fn of_exitance(
    illuminant: Illuminant,
    exitance: &ExitanceBounds,
    camera: &Camera,
    exposure_s: f64,
) -> [f64; 2] {
    let per_lux_s = camera.photons_per_lux_s(illuminant);
    let [shade_min, shade_max] = camera.roll_off_bounds();
    let [blur_min, blur_max] = camera.blur_bounds();
    let (mut least, mut greatest) = (f64::INFINITY, 0.0);
    for letter in camera.mosaic.letters() {
        let passed = camera.mosaic.transmission(letter).expect("a mosaic knows its own letters");
        let (mut low, mut high) = (0.0, 0.0);
        for band in 0..BANDS {
            low += per_lux_s[band] * passed[band] * exitance.least[band];
            high += per_lux_s[band] * passed[band] * greater(exitance.greatest[band], exitance.emitted[band]);
        }
        (least, greatest) = (lesser(least, low), greater(greatest, high));
    }
    [lesser(least, greatest) * exposure_s * shade_min * blur_min, greatest * exposure_s * shade_max * blur_max]
}
