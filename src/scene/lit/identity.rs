//! What of a scene under light reaches the photons, as a hash.

use super::super::geometry::Scene;
use super::super::hashing::hash_floats;
use super::data::LitScene;
use crate::scene::BakeSettings;

impl LitScene {
    /// Hash of all that decides its radiance: the scene's geometry, materials and pictures, its baked light as it was scaled, and how that
    /// flickers. Found once. Every field is named, so that a new one is decided on here before it compiles.
    pub fn content_hash(&self) -> [u8; 32] {
        *self.content.get_or_init(|| self.hash_content())
    }

    fn hash_content(&self) -> [u8; 32] {
        let Self {
            scene,
            illuminant,
            irradiance_lux,
            flickering_lux,
            flicker,
            lux_per_radiance,
            sky_lux,
            bounces,
            shadows,
            // These follow from the scene.
            paints: _,
            cones: _,
            faces: _,
            has_textures: _,
            gloss: _,
            // These are figures about it.
            illuminance_lux: _,
            bounds: _,
            content: _,
        } = self;
        // Of the scene, the bake's key holds all that can be seen; its name, notes and viewpoints cannot.
        let Scene {
            name: _,
            mesh: _,
            bvh: _,
            layout: _,
            lamps: _,
            mirrors: _,
            sky: _,
            environment: _,
            flickering: _,
            viewpoints: _,
            notes: _,
            // An exposure's key holds what it sees of these.
            moving: _,
        } = &**scene;
        let mut hasher = blake3::Hasher::new();
        hasher.update(&scene.bake_key(&BakeSettings::ROOM));
        hasher.update(format!("{illuminant:?} {flicker:?} {lux_per_radiance:?} {sky_lux:?} {bounces}").as_bytes());
        for lux in [irradiance_lux, flickering_lux] {
            hasher.update(&crate::num::u64_from(lux.len()).to_le_bytes());
            lux.chunks(1024).for_each(|lux| hash_floats(&mut hasher, lux.as_flattened()));
        }
        if let Some(shadows) = shadows {
            shadows.hash_into(&mut hasher);
        }
        *hasher.finalize().as_bytes()
    }
}
