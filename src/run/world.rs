//! The world of a run, a scene with geometry or external pictures: photons, bounds on them, and depth.

mod demand;
#[cfg(feature = "pictures")]
mod pictures;

use super::assets::{Assets, Progress};
use super::light::{check_scene, lit_scene};
use super::objects::{lit_objects, moving_objects};
use crate::config::Scenario;
use crate::draw::DrawKey;
use crate::effects::regions::LightBounds;
use crate::error::Error;
#[cfg(feature = "pictures")]
use crate::num::{greater, lesser};
#[cfg(feature = "pictures")]
use crate::optics::resample;
use crate::optics::{self, Camera, Exposure, Sampling, StaticPictures};
use crate::plane::Plane;
use crate::pose::Pose;
#[cfg(feature = "pictures")]
use crate::scene::ImageSequence;
use crate::scene::motion::Motion;
use crate::scene::object::{DynamicScene, MovingObject};
use crate::scene::{Illuminant, LitScene};
use crate::units::Span;
pub use demand::Demand;

/// A scene and what moves through it.
pub struct SceneWorld {
    fixed: LitScene,
    objects: Vec<MovingObject>,
    /// Of the static scene alone, for still cameras.
    pictures: StaticPictures,
}

impl SceneWorld {
    fn dynamic(&self) -> DynamicScene<'_> {
        DynamicScene { fixed: &self.fixed, objects: &self.objects }
    }
}

/// What is looked at.
pub enum World {
    /// Geometry under light, and what moves through it.
    Scene(Box<SceneWorld>),
    /// Pictures over time, one stream a camera.
    #[cfg(feature = "pictures")]
    Images(ImageSequence),
}

impl World {
    /// The scenario's world, and what a person should know of it. Fails on no scene or more than one named; files that are missing or not
    /// what they should be; pictures that do not last for the run.
    pub fn new(
        scenario: &Scenario,
        demand: &Demand,
        assets: &dyn Assets,
        progress: &dyn Progress,
    ) -> Result<(Self, Vec<String>), Error> {
        match &scenario.scene.images {
            #[cfg(feature = "pictures")]
            Some(folders) => pictures::sequence(scenario, folders, demand, assets, progress)
                .map(|(sequence, notes)| (Self::Images(sequence), notes)),
            #[cfg(not(feature = "pictures"))]
            Some(folders) => Err(no_pictures(folders)),
            None => {
                let lit = lit_scene(scenario, demand.start_m, assets, progress)?;
                let mut notes = lit.scene().notes.clone();
                // Bounds of the light belong to the scene under its light, as its bake does: the planner reads them.
                lit.exitance_bounds();
                let run = (demand.span_of)(demand.frames);
                let objects = moving_objects(scenario, run, assets)?;
                let objects = lit_objects(objects, &lit, run, &mut notes)?;
                let world = SceneWorld { fixed: lit, objects, pictures: StaticPictures::default() };
                Ok((Self::Scene(Box::new(world)), notes))
            }
        }
    }

    /// Refuses what `new` refuses, without baking light.
    pub fn check(scenario: &Scenario, demand: &Demand, assets: &dyn Assets) -> Result<(), Error> {
        match &scenario.scene.images {
            #[cfg(feature = "pictures")]
            Some(folders) => {
                pictures::sequence(scenario, folders, demand, assets, &super::assets::NoProgress).map(|_| ())
            }
            #[cfg(not(feature = "pictures"))]
            Some(folders) => Err(no_pictures(folders)),
            None => {
                moving_objects(scenario, (demand.span_of)(demand.frames), assets)?;
                check_scene(scenario, assets)
            }
        }
    }

    /// The geometry under its light, where there is geometry.
    pub fn scene(&self) -> Option<&LitScene> {
        self.dynamic_scene().map(|scene| scene.fixed)
    }

    /// The same with what moves through it.
    pub fn dynamic_scene(&self) -> Option<DynamicScene<'_>> {
        match self {
            Self::Scene(scene) => Some(scene.dynamic()),
            #[cfg(feature = "pictures")]
            Self::Images(_) => None,
        }
    }

    /// Whether every exposure of the same length sees the same light under a motion: nothing moves and nothing flickers.
    pub fn is_still(&self, motion: &Motion) -> bool {
        self.has_still_view(motion) && self.dynamic_scene().is_some_and(|scene| scene.objects.is_empty())
    }

    /// Whether a still camera sees the scene under steady light, so that only what moves changes.
    pub fn has_still_view(&self, motion: &Motion) -> bool {
        matches!(motion, Motion::Still(_)) && self.scene().is_some_and(LitScene::is_steady)
    }

    /// Spectrum of its white light.
    pub fn illuminant(&self) -> Illuminant {
        match self {
            Self::Scene(scene) => scene.fixed.illuminant(),
            #[cfg(feature = "pictures")]
            Self::Images(sequence) => sequence.streams[0].params.illuminant,
        }
    }

    /// What a camera of the rig sees in one exposure, a span a row. `of_still` names the samples of the static scene, where a camera stands
    /// still under steady light: only what moves is then rendered anew. Fails on a picture that cannot be read any more.
    #[cfg_attr(not(feature = "pictures"), expect(unused_variables, reason = "only pictures have a stream a camera"))]
    pub fn render(
        &self,
        (number, camera): (usize, &Camera),
        row_exposures: &[Span],
        world_from_body: &(dyn Fn(f64) -> Pose + Sync),
        sampling: Sampling,
        of_still: Option<DrawKey>,
    ) -> Result<Exposure, Error> {
        match self {
            Self::Scene(scene) => Ok(match of_still {
                Some(key) if !scene.objects.is_empty() => {
                    let all = (sampling, key);
                    optics::expose_still_camera(
                        scene.dynamic(),
                        camera,
                        row_exposures,
                        world_from_body,
                        all,
                        &scene.pictures,
                    )
                }
                _ => optics::expose(scene.dynamic(), camera, row_exposures, world_from_body, sampling),
            }),
            #[cfg(feature = "pictures")]
            Self::Images(sequence) => {
                let stream = &sequence.streams[number];
                optics::expose_by(stream.params.illuminant, camera, &|camera| {
                    resample::resample(stream, camera, row_exposures)
                })
            }
        }
    }

    /// Bounds of a pixel's mean photons over all cameras, for exposures between two lengths.
    pub fn photon_bounds(&self, cameras: &[Camera], exposures_s: [f64; 2]) -> LightBounds {
        let of = |exposure_s: f64| match self {
            // The cameras of a rig are alike, and a scene's bounds hold wherever they stand.
            Self::Scene(scene) => optics::photon_bounds(scene.dynamic(), &cameras[0], exposure_s),
            #[cfg(feature = "pictures")]
            Self::Images(sequence) => {
                let mut bounds = [f64::INFINITY, 0.0];
                for (stream, camera) in sequence.streams.iter().zip(cameras) {
                    let outside = resample::outside_share(stream, camera) > 0.0;
                    let [least, greatest] = resample::photon_bounds(stream, camera, exposure_s, outside);
                    bounds = [lesser(bounds[0], least), greater(bounds[1], greatest)];
                }
                bounds
            }
        };
        let ([photons_min, _], [_, photons_max]) = (of(exposures_s[0]), of(exposures_s[1]));
        LightBounds { photons_min, photons_max }
    }

    /// Depth along the axis of a camera of the rig at a time of the run, as pictures hold it; none where they hold none, and of scenes,
    /// whose surfaces `optics::truth` asks.
    #[cfg_attr(not(feature = "pictures"), expect(unused_variables, reason = "only pictures have a stream a camera"))]
    pub fn depth(&self, (number, camera): (usize, &Camera), t_s: f64) -> Result<Option<Plane<f32>>, Error> {
        match self {
            Self::Scene(_) => Ok(None),
            #[cfg(feature = "pictures")]
            Self::Images(sequence) => resample::depth(&sequence.streams[number], camera, t_s),
        }
    }

    /// Whether depth is known.
    pub fn has_depth(&self) -> bool {
        match self {
            Self::Scene(_) => true,
            #[cfg(feature = "pictures")]
            Self::Images(sequence) => sequence.streams.iter().all(crate::scene::ImageStream::has_depth),
        }
    }
}

#[cfg(not(feature = "pictures"))]
fn no_pictures(folders: &crate::config::scenario::Folders) -> Error {
    let reason = "this build reads no pictures; use scene.generator, or a build with the feature pictures";
    Error::key("scene.images", format!("{:?}", folders.list()), reason)
}
