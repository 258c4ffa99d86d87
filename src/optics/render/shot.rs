//! Sixteen rays: the part that all kernels of a render share. Enters: where in their pixels and when they lie. Leaves: photons a ray, and
//! how far it went.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::filter::{Look, Ray, Shares, Steps, Surfaces, ellipse_of_one, ellipses};
use crate::optics::camera::Camera;
use crate::optics::motion::{Parabolas, Turn, Turns};
use crate::scene::LitScene;
use crate::scene::lanes::{Floats, LANES, Vectors, add3, sub3};
use crate::scene::light::{BANDS, Bands};
use crate::scene::lit::{Met, by_band, by_lane};
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

impl Pixels {
    /// One pixel in all lanes, of which the first `lanes` count.
    #[inline(always)]
    pub fn of_one(camera: &Camera, at: [usize; 2], photons_per_lux: &Bands, lanes: usize) -> Self {
        let mut one = Self::NONE;
        one.set(0, camera, at, photons_per_lux);
        let mut all = Self::NONE;
        for corner in 0..4 {
            for axis in 0..3 {
                all.corners[corner][axis] = Floats::splat(one.corners[corner][axis].0[0]);
            }
        }
        all.spread = Floats::splat(one.spread.0[0]);
        for band in 0..BANDS {
            all.photons_per_lux[band] = Floats::splat(one.photons_per_lux[band].0[0]);
        }
        if one.seen.1 > 0 {
            all.seen = (std::array::from_fn(|lane| lane), lanes);
            for lane in 0..lanes {
                all.t_max.0[lane] = f32::MAX;
            }
        }
        all
    }

    /// The same of which fewer lanes count.
    pub fn shortened(&self, lanes: usize) -> Self {
        let mut short = *self;
        short.t_max.0[lanes..].fill(-1.0);
        short.seen.1 = short.seen.1.min(lanes);
        short
    }

    /// From the first corner of the middle lane's pixel to another, at a distance.
    #[inline(always)]
    fn step_m(&self, corner: usize, pose: &Turn, t_m: f32) -> [f32; 3] {
        let (from, to) = (lane3(&self.corners[0], MIDDLE), lane3(&self.corners[corner], MIDDLE));
        let step = pose.turned([to[0] - from[0], to[1] - from[1], to[2] - from[2]]);
        [step[0] * t_m, step[1] * t_m, step[2] * t_m]
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
    /// How far each look-up of a texture is moved, in pixels to the right and down; none: towards the middle, as shares say.
    pub moves: Option<&'a [Floats; 2]>,
    /// The samples' numbers.
    pub numbers: &'a [u32; LANES],
}

impl Aim<'_> {
    /// Bearings, poses and rays.
    #[inline(always)]
    fn rays(&self, pixels: &Pixels) -> (Vectors, Turns, Packet) {
        let bearing = bilinear(&pixels.corners, self.place[0], self.place[1]);
        let pose = self.motion.at(self.share);
        let (origin_m, direction) = (pose.place_m(), pose.turned(bearing));
        (bearing, pose, Packet { origin_m, direction, t_min: Floats::splat(0.0), t_max: pixels.t_max })
    }
}

impl View<'_> {
    /// Photons of a sample in each lane, and how far it went.
    #[inline(always)]
    pub fn sample(&self, pixels: &Pixels, aim: &Aim, has_gloss: bool, stack: &mut Stack) -> [Floats; 2] {
        let (bearing, pose, packet) = aim.rays(pixels);
        let hits = closest_inline_through(&self.scene.scene().bvh, &self.scene.scene().mesh, &packet, stack);
        let shot = Shot { pixels, aim, bearing, pose, hits, packet };
        // No closures: they would not be compiled for the kernel's own level.
        let (mut lux, is_glossy) = match self.scene.one_met(&hits) {
            Some(triangle) if are_alike(hits.t) => self.shade_one(triangle, &shot),
            _ => self.shade_mixed(&shot),
        };
        if has_gloss && is_glossy {
            let mut lux_of = by_lane(&lux);
            self.reflect(&shot.hits, &shot.packet, pixels, aim, &mut lux_of);
            lux = by_band(&lux_of);
        }
        let [r, g, b, n] = lux;
        let [per_r, per_g, per_b, per_n] = pixels.photons_per_lux;
        let mut left = Floats::splat(0.0);
        for lane in 0..LANES {
            left.0[lane] = self.camera.roll_off_at(shot.bearing[2].0[lane]);
        }
        [(r * per_r + g * per_g + b * per_b + n * per_n) * left, hits.t]
    }

    /// Light of a packet that met one triangle at about one distance, and whether that keeps an image.
    #[inline(always)]
    fn shade_one(&self, triangle: u32, shot: &Shot) -> ([Floats; BANDS], bool) {
        let colours = self.colours_of_one(triangle, shot);
        let lux = self.scene.exitances_of_one(&shot.hits, &shot.packet.direction, &colours, shot.aim.lamp_levels);
        (lux, self.scene.face(triangle).has_gloss(self.follows_gloss))
    }

    /// Colours of one triangle's texture: one ellipse serves all look-ups.
    #[inline(always)]
    fn colours_of_one(&self, triangle: u32, shot: &Shot) -> [Floats; BANDS] {
        let face = self.scene.face(triangle);
        let hits = &shot.hits;
        let mut colours = [Floats::splat(1.0); BANDS];
        if let Some(texture) = self.scene.texture_of(face) {
            let t_m = hits.t.0[MIDDLE];
            let pose = shot.pose.lane(MIDDLE);
            let mut travel_m = [0.0; 3];
            if shot.aim.pieces > 0.0 {
                let change = shot.aim.motion.change_of(MIDDLE, shot.aim.share.0[MIDDLE], shot.aim.pieces);
                let (place_m, turn) = (change.place_m(), change.turned(lane3(&shot.bearing, MIDDLE)));
                for axis in 0..3 {
                    travel_m[axis] = place_m[axis] + turn[axis] * t_m;
                }
            }
            let [right_m, down_m] = [shot.pixels.step_m(1, &pose, t_m), shot.pixels.step_m(2, &pose, t_m)];
            let ray = Ray {
                normal: face.normal(),
                slopes: face.slopes(),
                direction: lane3(&shot.packet.direction, MIDDLE),
                steps_m: [right_m, down_m, travel_m],
                pixel_m: shot.pixels.spread.0[MIDDLE] * t_m,
            };
            let (footprint, shift_texels) = ellipse_of_one(&ray, &shot.look(), shot.aim.shares);
            colours = by_band(&texture.over_alike(&face.uv(hits.u, hits.v), &shift_texels, &footprint));
        }
        colours
    }

    /// Light of any packet, and whether any lane met what keeps an image.
    #[inline(always)]
    fn shade_mixed(&self, shot: &Shot) -> ([Floats; BANDS], bool) {
        let Shot { pixels, aim, hits, packet, .. } = shot;
        let met = self.scene.met(hits);
        let mut footprints = None;
        if self.scene.has_textures() {
            footprints = Some(shot.footprints(&met));
        }
        let mut lux = self.scene.exitances_lux(hits, &met, &packet.direction, footprints.as_ref(), aim.lamp_levels);
        for &lane in &pixels.seen.0[..pixels.seen.1] {
            if hits.triangle[lane] == MISS {
                lux[lane] = self.scene.sky_lux(lane3(&packet.direction, lane));
            }
        }
        (by_band(&lux), met.has_gloss(self.follows_gloss))
    }
}

/// A packet of rays and what they met.
struct Shot<'a> {
    pixels: &'a Pixels,
    aim: &'a Aim<'a>,
    bearing: Vectors,
    pose: Turns,
    hits: Hits,
    packet: Packet,
}

impl Shot<'_> {
    /// What each lane's ray stands for on its texture.
    #[inline(always)]
    fn footprints(&self, met: &Met) -> Footprints {
        let Shot { pixels, aim, hits, packet, pose, .. } = self;
        let right = pose.turned(sub3(pixels.corners[1], pixels.corners[0]));
        let down = pose.turned(sub3(pixels.corners[2], pixels.corners[0]));
        let mut travel_m = [Floats::splat(0.0); 3];
        if aim.pieces > 0.0 {
            let change = aim.motion.change_at(aim.share, aim.pieces);
            travel_m = add3(change.place_m(), scaled(change.turned(self.bearing), hits.t));
        }
        let steps = Steps {
            direction: packet.direction,
            steps_m: [scaled(right, hits.t), scaled(down, hits.t), travel_m],
            pixel_m: pixels.spread * hits.t,
            look: self.look(),
        };
        ellipses(&Surfaces { normal: met.normal(), slopes: met.slopes() }, &steps, aim.shares)
    }

    /// Where the look-ups of textures go.
    #[inline(always)]
    fn look(&self) -> Look {
        let half = Floats::splat(0.5);
        match self.aim.moves {
            Some(moves) => Look::By(*moves),
            None => Look::Inwards([self.aim.place[0] - half, self.aim.place[1] - half, self.aim.place[2] - half]),
        }
    }
}

/// A lane in the middle of a tile.
const MIDDLE: usize = LANES / 2 + 1;

/// Share of the distance by which the rays of a packet may differ that have one ellipse. Distances to a plane go as one over the cosine to
/// it, so the ellipse's width and length are off by as much and by twice that at the packet's rim: by 3 and 6 % of a sample's share of
/// the pixel where the middle lies amid.
const ALIKE: f32 = 1.0 / 16.0;

#[inline(always)]
fn are_alike(t: Floats) -> bool {
    let least = t.least();
    t.most() - least <= ALIKE * least
}

#[inline(always)]
fn lane3(vectors: &Vectors, lane: usize) -> [f32; 3] {
    [vectors[0].0[lane], vectors[1].0[lane], vectors[2].0[lane]]
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
