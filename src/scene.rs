//! A moving scene: geometry, materials, light, and the motion of the rig. Enters: bytes of scene files. Leaves: radiance along
//! rays in photons per second, per band; ground-truth poses, depth. It knows no lens and no pixel, and touches no disk.
//!
//! A `Scene` is geometry with materials in its own light units; a `Bake` is its irradiance; a `LitScene` is both, scaled so that a
//! horizontal plane at a given point has a given illuminance. All reflection is Lambertian: metals and glossy plastics
//! reflect as dull surfaces of their base colour, and glass that the file marks as such is left out.

pub mod bake;
pub mod box_room;
pub mod bvh;
pub mod build;
mod chance;
pub mod cut_out;
pub mod generated;
pub mod gltf;
pub mod hall;
pub mod lamps;
pub mod lanes;
pub mod light;
pub mod lit;
pub mod mesh;
pub mod motion;
pub mod pattern;
pub mod photo_box;
pub mod samples;
pub mod street;
pub mod surroundings;
pub mod target;
pub mod texture;
pub mod tracer;

pub use bake::{Bake, BakeSettings};
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
    /// Radiance of what lies beyond all surfaces, in the scene's own units, the same in every direction.
    pub sky: Bands,
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
            material.base_colour = material.base_colour.map(|band| band.clamp(0.0, mesh::ALBEDO_MAX));
        }
        let corners_m: Vec<_> = (0..mesh.triangles.len()).map(|triangle| mesh.corners_m(triangle)).collect();
        let bvh = Bvh::build_with_cut_outs(&corners_m, &|triangle| mesh.cut_out_of(triangle).is_some());
        let (layout, lamps) = (Layout::of(&mesh), Lamps::of(&mesh, &bvh));
        Ok(Self { name: name.to_owned(), mesh, bvh, layout, lamps, sky, viewpoints: Vec::new(), notes: Vec::new() })
    }

    /// Gives the scene a sky of this radiance (in its own light units) beyond all surfaces.
    #[must_use]
    pub fn with_sky(mut self, sky: Bands) -> Self {
        self.sky = sky;
        self
    }

    /// Bakes the irradiance of all surfaces. `progress` is told the share done, from 0 to 1, from any thread.
    pub fn bake(&self, settings: &BakeSettings, progress: &(dyn Fn(f64) + Sync)) -> Bake {
        Bake::of(self, settings, progress)
    }

    /// What a bake of this scene depends on: geometry, materials, textures, sky, settings and the method's version.
    pub fn bake_key(&self, settings: &BakeSettings) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&bake::BAKE_VERSION.to_le_bytes());
        for rays in [settings.grid_rays, settings.vertex_rays, settings.grid_lamp_rays, settings.vertex_lamp_rays] {
            hasher.update(&crate::num::u64_from(rays).to_le_bytes());
        }
        hash_floats(&mut hasher, &self.sky);
        let vertices = self.mesh.vertices.iter();
        let numbers: Vec<f32> = vertices.flat_map(|v| v.position_m.into_iter().chain(v.normal).chain(v.uv)).collect();
        hash_floats(&mut hasher, &numbers);
        let numbers = self.mesh.triangles.iter().flatten().chain(&self.mesh.material_of);
        let bytes: Vec<u8> = numbers.flat_map(|number| number.to_le_bytes()).collect();
        hasher.update(&bytes);
        for material in &self.mesh.materials {
            hash_floats(&mut hasher, &material.base_colour);
            hash_floats(&mut hasher, &material.emission);
            hasher.update(&[u8::from(material.double_sided)]);
            hasher.update(&material.texture.unwrap_or(u32::MAX).to_le_bytes());
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
