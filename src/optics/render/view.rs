//! What a ray's light depends on: the view, the pixels of a packet and the samples of its rays.

use std::ops::Range;

use super::super::camera::Camera;
use super::super::motion::{LanePose, PacketMotion, PacketPoses};
use super::objects::Objects;
use super::settings::Sampling;
use crate::num::u32_from;
use crate::scene::LitScene;
use crate::scene::lanes::{Floats, LANES, Vectors};
use crate::scene::light::{BANDS, Bands};
use crate::scene::mesh::{BackfaceCulled, sub};
use crate::scene::object::DynamicScene;
use crate::scene::texture::footprint::{Look, SampleShare};
use crate::scene::tracer::{Hits, Packet, Stack, closest_through};

/// What all rays of a render share.
#[derive(Clone, Copy)]
pub struct View<'a> {
    pub scene: &'a LitScene,
    pub camera: &'a Camera,
    /// Reflections that a ray follows; 0 where nothing in the scene keeps an image.
    pub reflections: u32,
    /// Whether it follows those of gloss, or of mirrors only.
    pub follows_gloss: bool,
}

impl<'a> View<'a> {
    /// Of a scene by a camera, with the reflections that it calls for.
    pub fn new(scene: DynamicScene<'a>, camera: &'a Camera, sampling: Sampling) -> Self {
        let follows_gloss = sampling.follows_gloss;
        let reflections = if scene.has_gloss(follows_gloss) { sampling.reflections } else { 0 };
        Self { scene: scene.fixed, camera, reflections, follows_gloss }
    }
}

/// The pixels that the lanes look through.
#[derive(Clone, Copy)]
pub struct PacketPixels {
    /// Bearings of their corners.
    pub corners: [Vectors; 4],
    /// Their widths, as angles.
    pub spread: Floats,
    /// Photons of each band per lux-equivalent.
    pub photons_per_lux: [Floats; BANDS],
    /// How far rays go; below zero where the lens has no bearing.
    pub t_max: Floats,
    /// Seeds of rough reflections.
    pub facet_seeds: [u32; LANES],
}

impl PacketPixels {
    /// None yet.
    pub const NONE: Self = Self {
        corners: [[Floats([0.0; LANES]); 3]; 4],
        spread: Floats([0.0; LANES]),
        photons_per_lux: [Floats([0.0; LANES]); BANDS],
        t_max: Floats([-1.0; LANES]),
        facet_seeds: [0; LANES],
    };

    /// Lets some lanes look through a pixel. A pixel without a bearing stays dark.
    #[inline(always)]
    pub fn set(&mut self, lanes: Range<usize>, camera: &Camera, [x, y]: [usize; 2], photons_per_lux: &Bands) {
        let Some(corners) = camera.corners(x, y) else { return };
        let spread = camera.spread(x, y);
        for lane in lanes {
            self.t_max.0[lane] = f32::MAX;
            self.spread.0[lane] = spread;
            for band in 0..BANDS {
                self.photons_per_lux[band].0[lane] = photons_per_lux[band];
            }
            for corner in 0..4 {
                for axis in 0..3 {
                    self.corners[corner][axis].0[lane] = corners[corner][axis];
                }
            }
        }
    }

    /// From the first corner of a lane's pixel to another, at a distance.
    #[inline(always)]
    pub fn step_m(&self, [lane, corner]: [usize; 2], pose: &LanePose, t_m: f32) -> [f32; 3] {
        let step = pose.turned(sub(lane3(&self.corners[corner], lane), lane3(&self.corners[0], lane)));
        [step[0] * t_m, step[1] * t_m, step[2] * t_m]
    }
}

/// One lane of vectors.
#[inline(always)]
pub fn lane3(vectors: &Vectors, lane: usize) -> [f32; 3] {
    [vectors[0].0[lane], vectors[1].0[lane], vectors[2].0[lane]]
}

/// The samples that the rays of a packet take: where, when and for how much of its pixel each lane's ray stands.
#[derive(Clone, Copy)]
pub struct PacketSamples<'a> {
    pub pixels: &'a PacketPixels,
    /// Position in the pixel from its left and from its upper edge, and in the exposure, each 0..1.
    pub coordinates: [Floats; 3],
    /// The camera's motion over the lanes' pieces of time.
    pub motion: PacketMotion<'a>,
    /// Share of that piece that is over.
    pub share: Floats,
    /// Pieces of an exposure; 0 where nothing moves.
    pub pieces: f32,
    /// Level of the flickering lamps.
    pub lamp_levels: &'a [f32; LANES],
    /// Lanes that count: the first ones.
    pub lanes: usize,
    /// What of its pixel and of the exposure a sample stands for.
    pub shares: &'a SampleShare,
    /// Where look-ups of textures go.
    pub look: Look,
    /// Numbers of the samples.
    pub numbers: &'a [u32; LANES],
    /// What moves beside the camera.
    pub objects: Objects<'a>,
}

/// What a look-up of a texture averages over, with the pose that leads from the camera to the rays' frame.
pub enum Filter<'a> {
    /// A share of the pixel and of the motion, by ray differentials.
    Primary { bearing: &'a Vectors, pose: &'a PacketPoses },
    /// A circle, by the length of the path.
    Reflected { width_m: Floats, pose: &'a PacketPoses },
}

/// A packet of rays and what they met.
pub struct Traced {
    pub hits: Hits,
    pub packet: Packet,
}

impl Traced {
    /// The nearest surfaces of a scene that face the rays.
    pub fn through(scene: &LitScene, packet: Packet, stack: &mut Stack) -> Self {
        let scene = scene.scene();
        let hits = closest_through(&scene.bvh, &BackfaceCulled(&scene.mesh), &packet, stack);
        Self { hits, packet }
    }
}

/// What rays met of a moving object before all else.
pub struct ObjectHits {
    /// Its number among the objects.
    pub object: usize,
    /// In its frame.
    pub traced: Traced,
    /// `object_from_camera` at each ray's instant.
    pub pose: PacketPoses,
}

/// What a packet of rays met.
pub struct Met {
    /// Of the static scene; rays that met an object have ended.
    pub fixed: Traced,
    pub objects: Vec<ObjectHits>,
}

/// The nearest surfaces that the samples of a packet met, by lane.
pub struct NearestHits {
    pub distance_m: Floats,
    /// Number of the moving object from 1; 0 for the static scene.
    pub object: [u32; LANES],
}

impl Met {
    #[inline(always)]
    pub fn nearest(&self) -> NearestHits {
        let mut nearest = NearestHits { distance_m: self.fixed.hits.t, object: [0; LANES] };
        for ObjectHits { object, traced, .. } in &self.objects {
            let lanes = Floats::splat(0.0).below(traced.packet.t_max);
            nearest.distance_m = lanes.select(traced.hits.t, nearest.distance_m);
            nearest.object = lanes.select_u32([u32_from(*object + 1); LANES], nearest.object);
        }
        nearest
    }
}
