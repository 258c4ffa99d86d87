//! What of a camera reaches the photons, as a hash.

use super::{BandGroup, Camera};

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
            // It follows from lens, size and shading.
            bearings: _,
        } = self;
        let own = (lens, size, body_from_camera, aperture, pixel_pitch_um, shading, mosaic);
        let text = format!("{own:?} {infrared_transmission:?} {optical_crosstalk:?} {}", band_groups.len());
        hasher.update(text.as_bytes());
        for group in band_groups {
            let BandGroup { lens, bearings: _, mosaic, bands, kernels, filters_later, electrical_crosstalk } = group;
            let path = (bands, kernels, filters_later, electrical_crosstalk);
            hasher.update(format!("{lens:?} {mosaic:?} {path:?}").as_bytes());
        }
    }
}
