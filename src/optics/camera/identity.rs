//! What of a camera reaches the photons, as a hash.

use super::Camera;

impl Camera {
    /// Adds all that decides its photons. Every field is named, so that a new one is decided on here before it compiles. Numbers enter
    /// by their shortest exact decimal form.
    pub fn hash_into(&self, hasher: &mut blake3::Hasher) {
        let Self {
            lens,
            size,
            body_from_camera,
            aperture,
            pixel_pitch_um,
            shading,
            mosaic,
            infrared_transmission,
            band_groups,
            optical_crosstalk,
            // Both follow from lens, size and shading.
            bearings: _,
            spreads: _,
        } = self;
        let own = (lens, size, body_from_camera, aperture, pixel_pitch_um, shading, mosaic);
        let text = format!("{own:?} {infrared_transmission:?} {optical_crosstalk:?} {}", band_groups.len());
        hasher.update(text.as_bytes());
        for group in band_groups {
            let (camera, rest) = group.parts();
            hasher.update(rest.as_bytes());
            camera.hash_into(hasher);
        }
    }
}
