//! The render of one exposure, from what reaches it and nothing else: world, camera, motion, row exposures, render settings.

use crate::draw::DrawKey;
use crate::error::Error;
use crate::fidelity::RenderSettings;
use crate::num::{f32_nearest, u64_from};
use crate::optics::{Camera, Exposure, Rounding, Sampling};
use crate::scene::motion::Motion;
use crate::units::{FrameIndex, Span};

use super::world::World;

/// Published number of the renderer's sample pattern in keys.
const RENDER_NUMBER: u64 = 1;

/// All that decides the photons of an exposure. It holds no sensor: two designs with equal inputs have the same photons, in every bit.
pub struct RenderInputs<'a> {
    /// Scene under its light, or pictures.
    pub world: &'a World,
    /// The camera with the pixels that are read: lens, filters, and geometry of the array.
    pub camera: &'a Camera,
    /// How the body moves.
    pub motion: &'a Motion,
    /// When each row gathers light, in the run's time.
    pub row_exposures: &'a [Span],
    /// Which exposure of the run.
    pub exposure_id: ExposureId,
    /// Settings of the render.
    pub settings: RenderSettings,
}

/// Which picture of a run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PictureId {
    /// Frame of the run.
    pub frame: FrameIndex,
    /// Camera of the rig, by its index.
    pub camera: usize,
}

/// Which exposure of a picture: names the samples of its rays.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExposureId {
    /// The picture that it belongs to.
    pub picture: PictureId,
    /// Exposure of the frame.
    pub slot: usize,
}

impl RenderInputs<'_> {
    /// What the camera's window sees. Its render noise is counted with the settings' quantum efficiency. Fails on a picture that cannot
    /// be read any more.
    pub fn render(&self) -> Result<Exposure, Error> {
        // The motion was checked to cover the whole run before the first frame.
        let pose = |t_s: f64| self.motion.world_from_body(t_s).expect("the motion covers the run");
        let settings = &self.settings;
        let sampling = Sampling {
            samples_per_pixel: settings.samples_per_pixel,
            samples_max: settings.samples_max,
            tolerance: settings.tolerance,
            subframes: settings.subframes,
            reflections: settings.reflections,
            follows_gloss: settings.follows_gloss,
            electrons_per_photon: settings.quantum_efficiency,
            saturation_photons: f32_nearest(settings.saturation_photons()),
            key: self.key(),
        };
        let of_still = self.world.has_still_view(self.motion).then(|| self.key_of(FrameIndex(0)));
        let camera = (self.exposure_id.picture.camera, self.camera);
        let mut exposure = self.world.render(camera, self.row_exposures, &pose, sampling, of_still)?;
        if let Some(rounding) = Rounding::new(settings.rounding_sigma) {
            rounding.round(&mut exposure, settings.quantum_efficiency);
        }
        Ok(exposure)
    }

    fn key(&self) -> DrawKey {
        // Nothing distinguishes the frames of a still picture, so its samples are those of frame 0 at every time.
        self.key_of(if self.world.is_still(self.motion) { FrameIndex(0) } else { self.exposure_id.picture.frame })
    }

    fn key_of(&self, named: FrameIndex) -> DrawKey {
        let ExposureId { picture, slot } = self.exposure_id;
        let key = DrawKey::root(self.settings.seed).with(RENDER_NUMBER);
        let key = key.with(u64_from(picture.camera)).with(named.0.into());
        repeated(if slot == 0 { key } else { key.with(u64_from(slot)) }, self.settings.repeat)
    }
}

/// Published number of repetitions in keys.
const REPEAT_NUMBER: u64 = 0x7265_7065_6174;

/// The key of a render that is made once more with chance of its own; the run's own is number 0.
fn repeated(key: DrawKey, number: u32) -> DrawKey {
    if number == 0 { key } else { key.with(REPEAT_NUMBER).with(number.into()) }
}
