//! What a ray's light depends on: the view, the pixels of a packet and the aim of its rays.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::super::camera::Camera;
use super::super::motion::{PacketMotion, Turns};
use super::objects::Objects;
use super::settings::Sampling;
use crate::scene::LitScene;
use crate::scene::lanes::{Floats, LANES, Vectors};
use crate::scene::light::BANDS;
use crate::scene::texture::footprint::SampleShare;
use crate::scene::tracer::{Hits, Packet};

/// What all rays of a render share.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// What is seen.
    pub scene: &'a LitScene,
    /// By what.
    pub camera: &'a Camera,
    /// Reflections that a ray follows; 0 where nothing in the scene keeps an image.
    pub reflections: u32,
    /// Whether it follows those of gloss, or of mirrors only.
    pub follows_gloss: bool,
}

impl<'a> View<'a> {
    /// Of a scene by a camera, with the reflections that it calls for.
    pub fn new(scene: &'a LitScene, camera: &'a Camera, sampling: Sampling) -> Self {
        let follows_gloss = sampling.follows_gloss;
        let reflections = if scene.has_gloss(follows_gloss) { sampling.reflections } else { 0 };
        Self { scene, camera, reflections, follows_gloss }
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

/// Where, when and for how much of its pixel each lane's ray stands.
#[derive(Clone, Copy)]
pub struct Aim<'a> {
    /// Place in the pixel from its left and from its upper edge, and in the exposure, each 0..1.
    pub place: [Floats; 3],
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
    /// How far each look-up of a texture is moved, in pixels to the right and down; none: towards the middle, as shares say.
    pub moves: Option<&'a [Floats; 2]>,
    /// The samples' numbers.
    pub numbers: &'a [u32; LANES],
    /// What moves beside the camera.
    pub objects: Objects<'a>,
}

/// What a look-up of a texture averages over.
pub(super) enum Filter<'a> {
    /// A share of the pixel and of the motion, by ray differentials.
    Primary { pixels: &'a PacketPixels, bearing: &'a Vectors, pose: &'a Turns },
    /// A circle, by the length of the path.
    Reflected { width_m: Floats },
}

/// A packet of rays and what they met.
pub(super) struct Traced {
    pub hits: Hits,
    pub packet: Packet,
}
