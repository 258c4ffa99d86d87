//! Mean photons that are kept from run to run, under a key of exactly what reaches them.
//!
//! The key takes values, not keys of the configuration: the scene under its light, the camera, the body's path during the exposure, the
//! exposure of each row, the render's settings, and the sources of the code. So two designs that differ behind the lens have the same keys.

use std::sync::Arc;

pub use super::assets::PhotonStore;
use super::render_inputs::RenderInputs;
use super::setup::Setup;
use crate::error::Error;
use crate::fidelity::RenderSettings;
use crate::num::{f64_from_usize, greater, index, lesser, u32_truncated, u64_from};
use crate::optics::{Exposure, Rounding};
use crate::pose::Pose;
use crate::scene::object::MovingObject;
use crate::units::{FrameIndex, Span};

/// Fingerprint of the code from scene to photons.
const SOURCES: &str = env!("SENSEL_PHOTON_SOURCES");

/// Fewest and most steps at which the path of the body enters a key.
const POSE_STEPS: [f64; 2] = [256.0, 16_384.0];

/// Longest of these steps. Knots of a path are 5 ms or more apart, and a cubic segment is known by four of its points.
const POSE_STEP_S: f64 = 0.001;

impl RenderInputs<'_> {
    /// The key of this exposure's photons, in lower-case hexadecimal; none for pictures from elsewhere, which are not stored.
    pub fn photon_key(&self) -> Option<String> {
        let scene = self.world.dynamic_scene()?;
        let mut hasher = blake3::Hasher::new();
        hasher.update(b"sensel photons 2");
        hasher.update(SOURCES.as_bytes());
        hasher.update(&scene.fixed.content_hash());
        self.camera.hash_into(&mut hasher);
        self.hash_exposure_id(&mut hasher);
        hash_settings(&self.settings, &mut hasher);
        hasher.update(&u64_from(self.row_exposures.len()).to_le_bytes());
        for row in self.row_exposures {
            hasher.update(&row.start_s.to_le_bytes());
            hasher.update(&row.end_s.to_le_bytes());
        }
        self.hash_path(scene.objects, &mut hasher);
        Some(hasher.finalize().to_hex().to_string())
    }

    fn hash_exposure_id(&self, hasher: &mut blake3::Hasher) {
        // Samples are named by camera, frame and slot; those of a still picture by frame 0.
        let frame = if self.world.is_still(self.motion) { FrameIndex(0) } else { self.exposure_id.picture.frame };
        hasher.update(&u64_from(self.exposure_id.picture.camera).to_le_bytes());
        hasher.update(&frame.0.to_le_bytes());
        hasher.update(&u64_from(self.exposure_id.slot).to_le_bytes());
    }

    /// Paths of body and objects enter by poses at equal steps from the first row's start to the last row's end: what happens before and
    /// after reaches no photon of this exposure.
    fn hash_path(&self, objects: &[MovingObject], hasher: &mut blake3::Hasher) {
        let none = Span { start_s: f64::INFINITY, end_s: f64::NEG_INFINITY };
        let whole = self.row_exposures.iter().fold(none, |all, row| Span {
            start_s: lesser(all.start_s, row.start_s),
            end_s: greater(all.end_s, row.end_s),
        });
        let length_s = whole.end_s - whole.start_s;
        let steps = lesser(greater(length_s / POSE_STEP_S, POSE_STEPS[0]).ceil(), POSE_STEPS[1]);
        let count = index(u32_truncated(steps));
        for step in 0..=count {
            let t_s = if step == count { whole.end_s } else { whole.start_s + length_s * f64_from_usize(step) / steps };
            hash_pose(&self.motion.world_from_body(t_s).expect("the motion covers the run"), hasher);
            for object in objects {
                hash_pose(&object.world_from_object(t_s), hasher);
            }
        }
        for object in objects {
            hasher.update(&object.lit_at(whole.middle_s()).content_hash());
        }
    }

    /// What the camera's window sees: from the store if it is there, else rendered and kept.
    pub fn expose_with(&self, store: Option<&Arc<dyn PhotonStore>>) -> Result<Exposure, Error> {
        let (Some(store), Some(key)) = (store, store.and_then(|_| self.photon_key())) else { return self.render() };
        let stored = store.load(&key).filter(|exposure| exposure.photons.size() == self.camera.size);
        if let Some(exposure) = stored {
            return Ok(exposure);
        }
        let exposure = self.render()?;
        store.keep(&key, &exposure, Rounding::new(self.settings.rounding_sigma));
        Ok(exposure)
    }
}

fn hash_pose(pose: &Pose, hasher: &mut blake3::Hasher) {
    for number in pose.rotation.to_array().into_iter().chain(pose.translation_m.to_array()) {
        hasher.update(&number.to_le_bytes());
    }
}

/// Every field is named, so that a new one is decided on here before it compiles.
fn hash_settings(settings: &RenderSettings, hasher: &mut blake3::Hasher) {
    let RenderSettings {
        seed,
        samples_per_pixel,
        samples_max,
        tolerance,
        subframes,
        reflections,
        follows_gloss,
        quantum_efficiency,
        full_well_e,
        rounding_sigma,
        repeat,
    } = *settings;
    hasher.update(&seed.to_le_bytes());
    for number in [samples_per_pixel, samples_max, subframes, reflections, repeat, u32::from(follows_gloss)] {
        hasher.update(&number.to_le_bytes());
    }
    for number in [tolerance, quantum_efficiency, full_well_e, rounding_sigma] {
        hasher.update(&number.to_le_bytes());
    }
}

impl Setup {
    /// Takes photons from this store where they are in it, and keeps those that it renders there. Changes no byte of the result.
    pub fn keep_photons_in(&mut self, store: Arc<dyn PhotonStore>) {
        self.photon_store = Some(store);
    }
}
