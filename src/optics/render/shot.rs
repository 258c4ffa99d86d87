//! Sixteen rays: the part that all kernels of a render share. Enters: where in their pixels and when they lie. Leaves: photons a ray, and
//! how far it went.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::filter::{Shares, Steps, Surfaces, ellipses};
use crate::optics::camera::Camera;
use crate::optics::motion::Parabolas;
use crate::scene::LitScene;
use crate::scene::lanes::{Floats, LANES, Vectors, add3};
use crate::scene::light::{BANDS, Bands};
use crate::scene::lit::{Met, by_band};
use crate::scene::texture::Footprints;
use crate::scene::tracer::{Hits, MISS, Packet, Stack, closest_inline_through};

/// What all rays of a render share.
#[derive(Clone, Copy)]
pub struct View<'a> {
    /// What is seen.
    pub scene: &'a LitScene,
    /// By what.
    pub camera: &'a Camera,
    /// Reflections that a ray follows.
    pub reflections: u32,
    /// Whether it follows those of gloss, or of mirrors only.
    pub follows_gloss: bool,
}

/// The pixels that the lanes look through.
#[derive(Clone, Copy)]
pub struct Pixels {
    /// Bearings of their corners.
    pub corners: [Vectors; 4],
    /// Their widths, as angles.
    pub spread: Floats,
    /// Photons of each band per lux-equivalent.
    pub photons_per_lux: [Floats; BANDS],
    /// How far rays go; below zero where the lens has no bearing.
    pub t_max: Floats,
    /// The lanes that have a bearing, and how many there are.
    pub seen: ([usize; LANES], usize),
    /// Seeds of rough reflections.
    pub facet_seeds: [u32; LANES],
}

impl Pixels {
    /// None yet.
    pub const NONE: Self = {
        let zero = Floats([0.0; LANES]);
        Self {
            corners: [[zero; 3]; 4],
            spread: zero,
            photons_per_lux: [zero; BANDS],
            t_max: Floats([-1.0; LANES]),
            seen: ([0; LANES], 0),
            facet_seeds: [0; LANES],
        }
    };

    /// Lets a lane look through a pixel. A pixel without a bearing stays dark.
    #[inline(always)]
    pub fn set(&mut self, lane: usize, camera: &Camera, [x, y]: [usize; 2], photons_per_lux: &Bands) {
        let Some(corners) = camera.corners(x, y) else { return };
        self.t_max.0[lane] = f32::MAX;
        for band in 0..BANDS {
            self.photons_per_lux[band].0[lane] = photons_per_lux[band];
        }
        self.seen.0[self.seen.1] = lane;
        self.seen.1 += 1;
        for (corner, bearing) in corners.iter().enumerate() {
            for axis in 0..3 {
                self.corners[corner][axis].0[lane] = bearing[axis];
            }
        }
        self.spread.0[lane] = camera.spread(x, y);
    }
}

/// Where, when and for how much of its pixel each lane's ray stands.
pub struct Aim<'a> {
    /// Shares of the pixel from its left edge, from its upper edge, and of the exposure that is over.
    pub place: [Floats; 3],
    /// The camera's motion over the lanes' pieces of time.
    pub motion: &'a Parabolas,
    /// Share of that piece that is over.
    pub share: Floats,
    /// Pieces of an exposure; 0 where nothing moves.
    pub pieces: f32,
    /// Level of the flickering lamps.
    pub lamp_levels: &'a [f32; LANES],
    /// What of its pixel and of the exposure a sample stands for.
    pub shares: &'a Shares,
    /// The samples' numbers.
    pub numbers: &'a [u32; LANES],
}

impl View<'_> {
    /// Photons of a sample in each lane, and how far it went.
    #[inline(always)]
    pub fn sample(&self, pixels: &Pixels, aim: &Aim, has_gloss: bool, stack: &mut Stack) -> [Floats; 2] {
        let bearing = bilinear(&pixels.corners, aim.place[0], aim.place[1]);
        let pose = aim.motion.at(aim.share);
        let (origin_m, direction) = (pose.place_m(), pose.turned(bearing));
        let packet = Packet { origin_m, direction, t_min: Floats::splat(0.0), t_max: pixels.t_max };
        let hits = closest_inline_through(&self.scene.scene().bvh, &self.scene.scene().mesh, &packet, stack);
        // No closure: it would not be compiled for the kernel's own level.
        let met = self.scene.met(&hits);
        let mut footprints = None;
        if self.scene.has_textures() {
            let right = pose.turned(sub(&pixels.corners[1], &pixels.corners[0]));
            let down = pose.turned(sub(&pixels.corners[2], &pixels.corners[0]));
            let mut travel_m = [Floats::splat(0.0); 3];
            if aim.pieces > 0.0 {
                let change = aim.motion.change_at(aim.share, aim.pieces);
                travel_m = add3(change.place_m(), scaled(change.turned(bearing), hits.t));
            }
            let half = Floats::splat(0.5);
            let steps = Steps {
                direction,
                steps_m: [scaled(right, hits.t), scaled(down, hits.t), travel_m],
                pixel_m: pixels.spread * hits.t,
                off_centre: [aim.place[0] - half, aim.place[1] - half, aim.place[2] - half],
            };
            footprints = Some(ellipses(&Surfaces { normal: met.normal(), slopes: met.slopes() }, &steps, aim.shares));
        }
        let mut lux = self.shade(&hits, &met, &packet, footprints.as_ref(), pixels, aim.lamp_levels);
        if has_gloss && met.has_gloss(self.follows_gloss) {
            self.reflect(&hits, &packet, pixels, aim, &mut lux);
        }
        let [r, g, b, n] = by_band(&lux);
        let [per_r, per_g, per_b, per_n] = pixels.photons_per_lux;
        let mut left = Floats::splat(0.0);
        for lane in 0..LANES {
            left.0[lane] = self.camera.roll_off_at(bearing[2].0[lane]);
        }
        let photons = (r * per_r + g * per_g + b * per_b + n * per_n) * left;
        [photons, hits.t]
    }

    #[inline(always)]
    fn shade(
        &self,
        hits: &Hits,
        met: &Met,
        packet: &Packet,
        footprints: Option<&Footprints>,
        pixels: &Pixels,
        lamp_levels: &[f32; LANES],
    ) -> [Bands; LANES] {
        let mut lux = self.scene.exitances_lux(hits, met, &packet.direction, footprints, lamp_levels);
        for &lane in &pixels.seen.0[..pixels.seen.1] {
            if hits.triangle[lane] == MISS {
                let [x, y, z] = packet.direction;
                lux[lane] = self.scene.sky_lux([x.0[lane], y.0[lane], z.0[lane]]);
            }
        }
        lux
    }
}

/// Difference. (A function, because closures are not inlined into dispatched kernels.)
#[inline(always)]
fn sub(a: &Vectors, b: &Vectors) -> Vectors {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn scaled(a: Vectors, by: Floats) -> Vectors {
    [a[0] * by, a[1] * by, a[2] * by]
}

/// Bearings at shares x (to the right) and y (downwards) of pixels.
#[inline(always)]
pub(in crate::optics) fn bilinear(corners: &[Vectors; 4], x: Floats, y: Floats) -> Vectors {
    let mut bearing = corners[0];
    for axis in 0..3 {
        let above = corners[0][axis] + (corners[1][axis] - corners[0][axis]) * x;
        let below = corners[2][axis] + (corners[3][axis] - corners[2][axis]) * x;
        bearing[axis] = above + (below - above) * y;
    }
    bearing
}
