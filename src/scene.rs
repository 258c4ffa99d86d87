//! A moving scene: geometry, materials, light, and the motion of the rig. Computes radiance along rays in photons per second and band, and
//! ground-truth poses and depth. It knows no lens and no pixel, and touches no disk.
//!
//! A `Scene` is geometry with materials in its own light units; a `Bake` is its irradiance; a `LitScene` is both, scaled so that a
//! horizontal plane at a given point has a given illuminance, or taken as lamps and sky state it. Light is baked over diffuse surfaces, and
//! over glossy metals as over mirrors. Glass that the file marks as such is left out.

pub mod bake;
pub mod box_room;
#[cfg(feature = "pictures")]
pub mod build;
pub mod bulb;
pub mod bvh;
mod chance;
pub mod cut_out;
pub mod environment;
pub mod file_units;
pub mod flicker;
pub mod generated;
#[cfg(feature = "gltf")]
pub mod gltf;
#[cfg(feature = "pictures")]
pub mod hall;
#[cfg(feature = "pictures")]
pub mod images;
pub mod lamps;
pub mod lanes;
pub mod light;
pub mod lit;
pub mod mesh;
pub mod motion;
pub mod nearest;
#[cfg(feature = "pictures")]
pub mod pattern;
#[cfg(feature = "pictures")]
pub mod photo_box;
pub mod samples;
pub mod sky;
#[cfg(feature = "pictures")]
pub mod street;
pub mod surroundings;
pub mod target;
pub mod texture;
pub mod tracer;
pub mod views;

pub use bake::{Bake, BakeCost, BakeSettings};
pub use environment::Environment;
pub use flicker::Flicker;
#[cfg(feature = "pictures")]
pub use images::{ImageSequence, ImageStream};
pub use lamps::fixture::Lamp;
pub use light::Illuminant;
pub use lit::{ExitanceBounds, LitScene};
pub use surroundings::{Panel, Surroundings};

use crate::error::Error;
use crate::pose::Pose;
use bvh::Bvh;
use lamps::Lamps;
use light::Bands;
use mesh::Mesh;
use samples::Layout;

/// Reads a file by a path within the scene's folder.
pub type Read<'a> = &'a dyn Fn(&str) -> Result<Vec<u8>, Error>;

/// Where files are read from while a run goes on.
pub trait PictureBytes: Send + Sync {
    /// The bytes of a file of the scenario.
    ///
    /// # Errors
    /// The file is not there any more, or the disk says no.
    fn read(&self, name: &str) -> Result<Vec<u8>, Error>;
}

/// Geometry and materials, ready for rays.
#[derive(Clone, Debug)]
pub struct Scene {
    /// As the user calls it.
    pub name: String,
    /// Triangles, materials and textures.
    pub mesh: Mesh,
    /// Tree over the triangles.
    pub bvh: Bvh,
    /// Where irradiance is known.
    pub layout: Layout,
    /// Emissive surfaces.
    pub lamps: Lamps,
    /// Radiance of the environment beyond all surfaces, in the scene's own units, the same in every direction.
    pub sky: Bands,
    /// Radiance by direction, instead of `sky`.
    pub environment: Option<Environment>,
    /// Which materials' own light flickers; empty: none.
    pub flickering: Vec<bool>,
    /// Cameras that the scene's file holds.
    pub viewpoints: Vec<Viewpoint>,
    /// What of the file was left out, changed or repaired, in sentences for its user.
    pub notes: Vec<String>,
}

/// Where a scene's author put a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Viewpoint {
    /// As the file calls it.
    pub name: String,
    /// Looking along +z, y down.
    pub world_from_camera: Pose,
}

impl Scene {
    /// Makes a mesh ready for rays.
    ///
    /// # Errors
    /// A mesh without triangles.
    pub fn new(name: &str, mut mesh: Mesh, sky: Bands) -> Result<Self, Error> {
        if mesh.triangles.is_empty() {
            let reason = "it has no triangle with an area; a scene needs at least one".to_owned();
            return Err(Error::Content { file: name.to_owned(), reason });
        }
        for material in &mut mesh.materials {
            material.base_colour = material.base_colour.map(|band| band.clamp(0.0, 1.0));
        }
        let corners_m: Vec<_> = (0..mesh.triangles.len()).map(|triangle| mesh.corners_m(triangle)).collect();
        let bvh = Bvh::build_with_cut_outs(&corners_m, &|triangle| mesh.cut_out_of(triangle).is_some());
        let (layout, lamps) = (Layout::of(&mesh), Lamps::of(&mesh, &bvh));
        let (environment, flickering, viewpoints) = (None, Vec::new(), Vec::new());
        let (name, notes) = (name.to_owned(), Vec::new());
        Ok(Self { name, mesh, bvh, layout, lamps, sky, environment, flickering, viewpoints, notes })
    }

    /// Gives the scene a sky of this radiance (in its own light units) beyond all surfaces.
    #[must_use]
    pub fn with_sky(mut self, sky: Bands) -> Self {
        self.sky = sky;
        self
    }

    /// Gives the scene light from beyond all surfaces, by direction.
    #[must_use]
    pub fn with_environment(mut self, environment: Environment) -> Self {
        self.environment = Some(environment);
        self
    }

    /// Lets the light of those emissive materials flicker that `which` accepts by name.
    #[must_use]
    pub fn with_flickering(mut self, which: impl Fn(&str) -> bool) -> Self {
        self.flickering = self.mesh.materials.iter().map(|m| m.is_emissive() && which(&m.name)).collect();
        self
    }

    /// Whether a material's own light flickers.
    fn flickers(&self, material: u32) -> bool {
        self.flickering.get(crate::num::index(material)).copied().unwrap_or(false)
    }

    /// Radiance of the environment beyond all surfaces.
    pub fn sky_radiance(&self, direction: [f32; 3]) -> Bands {
        self.environment.as_ref().map_or(self.sky, |environment| environment.radiance(direction))
    }

    /// The same without what a bake aims at.
    fn soft_sky(&self, direction: [f32; 3]) -> Bands {
        self.environment.as_ref().map_or(self.sky, |environment| environment.soft_radiance(direction))
    }

    /// Bakes the irradiance of all surfaces. `progress` is told the share done, from 0 to 1, from any thread.
    pub fn bake(&self, settings: &BakeSettings, progress: &(dyn Fn(f64) + Sync)) -> Bake {
        self.bake_under(settings, self.bake_key(settings), progress)
    }

    /// The same where the key is known: it takes as long as reading all textures.
    pub(crate) fn bake_under(&self, settings: &BakeSettings, key: [u8; 32], progress: &(dyn Fn(f64) + Sync)) -> Bake {
        Bake::of(self, settings, key, progress)
    }

    /// What a bake of this scene depends on: geometry, materials, textures, sky, what flickers, settings and the method's version.
    pub fn bake_key(&self, settings: &BakeSettings) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&bake::BAKE_VERSION.to_le_bytes());
        for rays in [settings.grid_rays, settings.vertex_rays, settings.grid_lamp_rays, settings.vertex_lamp_rays] {
            hasher.update(&crate::num::u64_from(rays).to_le_bytes());
        }
        hasher.update(&[u8::from(settings.bounces) | u8::from(!settings.interpolates) << 1]);
        hash_floats(&mut hasher, &self.sky);
        hasher.update(&[u8::from(self.environment.is_some())]);
        if let Some(environment) = &self.environment {
            environment.hash_into(&mut hasher);
        }
        hasher.update(&crate::num::u64_from(self.flickering.len()).to_le_bytes());
        hasher.update(&self.flickering.iter().copied().map(u8::from).collect::<Vec<_>>());
        // In pieces: the bytes of a large mesh beside the mesh would take as much again.
        for vertices in self.mesh.vertices.chunks(1024) {
            let numbers = vertices.iter().flat_map(|v| v.position_m.into_iter().chain(v.normal).chain(v.uv));
            hash_floats(&mut hasher, &numbers.collect::<Vec<f32>>());
        }
        for numbers in [self.mesh.triangles.as_flattened(), &self.mesh.material_of].map(|all| all.chunks(1024)) {
            for numbers in numbers {
                hasher.update(&numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>());
            }
        }
        for material in &self.mesh.materials {
            hash_floats(&mut hasher, &material.base_colour);
            hash_floats(&mut hasher, &material.emission);
            hash_floats(&mut hasher, &[material.metallic, material.roughness]);
            hasher.update(&[u8::from(material.double_sided)]);
            hasher.update(&material.texture.unwrap_or(u32::MAX).to_le_bytes());
            if let Some(bulb) = &material.bulb {
                hash_floats(&mut hasher, &bulb.centre_m);
                hash_floats(&mut hasher, &[bulb.radius_m]);
                hash_floats(&mut hasher, &bulb.cone.map_or([0.0; 5], |cone| cone.numbers()));
            }
        }
        for texture in &self.mesh.textures {
            texture.hash_into(&mut hasher);
        }
        for material in &self.mesh.materials {
            if let Some(cut_out) = material.cut_out {
                hasher.update(&cut_out.to_le_bytes());
            }
        }
        for cut_out in &self.mesh.cut_outs {
            cut_out.hash_into(&mut hasher);
        }
        *hasher.finalize().as_bytes()
    }
}

fn hash_floats(hasher: &mut blake3::Hasher, values: &[f32]) {
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    hasher.update(&bytes);
}
