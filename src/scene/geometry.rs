//! Geometry and materials of a scene, ready for rays.

use super::animation::JointChain;
use super::bvh::Bvh;
use super::environment::Environment;
use super::lamps::Lamps;
use super::light::Bands;
use super::mesh::Mesh;
use super::plane_mirrors::PlaneMirrors;
use super::samples::Layout;
use crate::error::Error;
use crate::num::index;
use crate::pose::Pose;

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
    /// What lamps have images in.
    pub mirrors: PlaneMirrors,
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
    /// Parts that the file's animation moves; no part of the geometry above.
    pub moving: Vec<MovingScene>,
}

/// A part of a file that moves rigidly.
#[derive(Clone, Debug)]
pub struct MovingScene {
    /// As the file calls its node.
    pub name: String,
    /// How it moves in the file's frame.
    pub chain: JointChain,
    /// In its own frame.
    pub shape: Scene,
}

/// Where a scene's author put a camera.
#[derive(Clone, Debug, PartialEq)]
pub struct Viewpoint {
    /// As the file calls it.
    pub name: String,
    /// Looking along +z, y down.
    pub world_from_camera: Pose,
    /// Angle that it sees across, if it has a perspective.
    pub horizontal_fov_rad: Option<f64>,
}

impl Scene {
    /// Makes a mesh ready for rays. Fails on a mesh without triangles.
    pub fn new(name: &str, mut mesh: Mesh, sky: Bands) -> Result<Self, Error> {
        if mesh.triangles.is_empty() {
            let reason = "it has no triangle with an area; a scene needs at least one".to_owned();
            return Err(Error::Content { file: name.to_owned(), reason });
        }
        for material in &mut mesh.materials {
            material.base_colour = material.base_colour.map(|band| band.clamp(0.0, 1.0));
        }
        let corners_m: Vec<_> = (0..mesh.triangles.len()).map(|triangle| mesh.corners_m(triangle)).collect();
        let mut bvh = Bvh::build_with_cut_outs(&corners_m, &|triangle| mesh.cut_out_of(triangle).is_some());
        bvh.mark_culled(&|triangle| mesh.materials[index(mesh.material_of[index(triangle)])].culled);
        let (layout, lamps) = (Layout::of(&mesh), Lamps::of(&mesh, &bvh));
        let mirrors = PlaneMirrors::of(&mesh, &layout);
        let (environment, flickering, viewpoints) = (None, Vec::new(), Vec::new());
        let (name, notes, moving) = (name.to_owned(), Vec::new(), Vec::new());
        Ok(Self { name, mesh, bvh, layout, lamps, mirrors, sky, environment, flickering, viewpoints, notes, moving })
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
    pub(super) fn flickers(&self, material: u32) -> bool {
        self.flickering.get(index(material)).copied().unwrap_or(false)
    }

    /// The same without what a bake aims at.
    pub(super) fn soft_sky(&self, direction: [f32; 3]) -> Bands {
        self.environment.as_ref().map_or(self.sky, |environment| environment.soft_radiance(direction))
    }
}
