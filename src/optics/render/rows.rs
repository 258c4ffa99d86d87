//! The kernel of a render: neighbouring rows, tile by tile, in packets of one sample of each pixel. Enters: a pass's samples and the mean
//! of those before. Leaves: the mean of all, and how far its parts are apart.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::filter::{Steps, Surfaces, ellipses};
use super::pattern::{self, Place, Seeds};
use super::tiles::{Parts, Tile};
use crate::draw::{DrawKey, mix};
use crate::num::{f32_from_u32, index, low_u32, u64_from};
use crate::optics::camera::Camera;
use crate::optics::motion::Timeline;
use crate::scene::LitScene;
use crate::scene::lanes::{Floats, LANES, Vectors, add3};
use crate::scene::light::{BANDS, Bands};
use crate::scene::lit::{Met, by_band};
use crate::scene::texture::Footprints;
use crate::scene::tracer::{Hits, MISS, Packet, Stack, closest_inline_through};
use crate::simd::Kernel;

/// Columns of the square of pixels that a packet covers: a tile.
pub const COLUMNS: usize = 4;
/// Rows of it, and of a unit of parallel work.
pub const ROWS: usize = LANES / COLUMNS;

/// What all rows of a pass share.
#[derive(Clone, Copy, Debug)]
pub struct Pass {
    /// Number of its first sample.
    pub first: u32,
    /// Its samples.
    pub count: u32,
    /// Share of the pixel, and of the motion over the exposure, that a sample stands for.
    pub shares: [f32; 2],
    /// Still pictures that the samples are dealt to in turn, all of a picture at its instant; 0 for samples at all times.
    pub subframes: u32,
    /// Samples of one still picture.
    pub each: u32,
    /// Logarithm to base 2 of the strata of time that the level of flickering lamps is known for.
    pub strata_log2: u32,
    /// Reflections that a ray follows.
    pub reflections: u32,
    /// Whether it follows those of gloss, or of mirrors only.
    pub follows_gloss: bool,
    /// Brighter pixels show no noise.
    pub saturation_photons: f32,
}

impl Pass {
    /// The stratum of time of a sample among those that the lamps' level is known for.
    #[inline(always)]
    fn stratum(&self, number: u32, place: &Place) -> usize {
        if self.subframes > 0 { index(number / self.each) } else { pattern::stratum(place.shared, self.strata_log2) }
    }
}

/// Neighbouring rows. Lanes beyond the last row of the picture repeat it; their results are not written.
pub struct Rows<'a> {
    /// What is seen.
    pub scene: &'a LitScene,
    /// By what.
    pub camera: &'a Camera,
    /// How it moves over the rows' exposures.
    pub timeline: &'a Timeline,
    /// Level of the flickering lamps in each stratum of time, row by row.
    pub lamp_levels: &'a [[f32; ROWS]],
    /// Photons of each band per lux-equivalent behind a pixel's filter, on the axis, over each row's exposure; by row, then by column
    /// of the filters' pattern.
    pub photons_per_lux: [[Bands; COLUMNS]; ROWS],
    /// Columns after which the filters repeat.
    pub pattern_px: usize,
    /// The first row, and how many there are.
    pub first: usize,
    /// Rows within the picture.
    pub count: usize,
    /// Key of each row.
    pub keys: [DrawKey; ROWS],
    /// Which samples.
    pub pass: &'a Pass,
    /// Mean photons of their pixels over the samples so far, row by row.
    pub photons: &'a mut [f32],
    /// Their tiles.
    pub tiles: &'a mut [Tile],
}

/// A square of pixels, row by row.
pub(super) struct Pixels {
    corners: [Vectors; 4],
    pub(super) spread: Floats,
    pub(super) seeds: Seeds,
    /// Photons of each band per lux-equivalent.
    photons_per_lux: [Floats; BANDS],
    /// How far rays go; below zero where the lens has no bearing.
    t_max: Floats,
    /// The lanes that have a bearing, and how many there are.
    pub(super) seen: ([usize; LANES], usize),
}

impl Kernel for Rows<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let width = index(self.camera.size.width_px);
        let mut stack = Stack::new();
        let has_gloss = self.pass.reflections > 0 && self.scene.has_gloss(self.pass.follows_gloss);
        for (number, first) in (0..width).step_by(COLUMNS).enumerate() {
            if !self.tiles[number].is_active {
                continue;
            }
            let pixels = self.pixels(first, width);
            let parts = self.gather(&pixels, has_gloss, &mut stack);
            let mut before = [0.0; LANES];
            let mut inside = [false; LANES];
            for lane in 0..LANES {
                let (row, column) = (lane / COLUMNS, first + lane % COLUMNS);
                inside[lane] = row < self.count && column < width;
                before[lane] = if inside[lane] { self.photons[row * width + column] } else { 0.0 };
            }
            let means = self.tiles[number].take(&parts, &before, &inside, self.pass.saturation_photons);
            for lane in 0..LANES {
                if inside[lane] {
                    self.photons[lane / COLUMNS * width + first + lane % COLUMNS] = means[lane];
                }
            }
        }
    }
}

impl Rows<'_> {
    #[inline(always)]
    fn pixels(&self, first: usize, width: usize) -> Pixels {
        let zero = Floats::splat(0.0);
        let mut pixels = Pixels {
            corners: [[zero; 3]; 4],
            spread: zero,
            seeds: Seeds { lanes: [[0; LANES]; 4], packet: low_u32(self.keys[0].with(u64_from(first) | 1 << 40).0) },
            photons_per_lux: [zero; BANDS],
            t_max: Floats::splat(-1.0),
            seen: ([0; LANES], 0),
        };
        for lane in 0..LANES {
            // Lanes beyond the last column or row repeat it.
            let x = (first + lane % COLUMNS).min(width - 1);
            let y = self.first + (lane / COLUMNS).min(self.count - 1);
            let Some(corners) = self.camera.corners(x, y) else { continue };
            pixels.t_max.0[lane] = f32::MAX;
            let per_lux = self.photons_per_lux[lane / COLUMNS][x % self.pattern_px];
            for band in 0..BANDS {
                pixels.photons_per_lux[band].0[lane] = per_lux[band];
            }
            pixels.seen.0[pixels.seen.1] = lane;
            pixels.seen.1 += 1;
            for (corner, bearing) in corners.iter().enumerate() {
                for axis in 0..3 {
                    pixels.corners[corner][axis].0[lane] = bearing[axis];
                }
            }
            pixels.spread.0[lane] = self.camera.spread(x, y);
            let bits = self.keys[lane / COLUMNS].with(u64_from(x)).0;
            let more = mix(bits);
            for (number, word) in [bits, bits >> 32, more, more >> 32].into_iter().enumerate() {
                pixels.seeds.lanes[number][lane] = low_u32(word);
            }
        }
        pixels
    }

    /// Mean photons of the pass's samples, by quarters of the pass.
    #[inline(always)]
    fn gather(&self, pixels: &Pixels, has_gloss: bool, stack: &mut Stack) -> Parts {
        let mut parts = Parts::new(self.pass.count);
        for step in 0..self.pass.count {
            let number = self.pass.first + step;
            let mut place = pattern::place(number, &pixels.seeds);
            let stratum = self.pass.stratum(number, &place);
            let mut piece = 0;
            if self.pass.subframes > 0 {
                let t = (f32_from_u32(number / self.pass.each) + 0.5) / f32_from_u32(self.pass.subframes);
                place.t = Floats::splat(t);
                piece = index(crate::num::u32_truncated_f32(
                    t * f32_from_u32(crate::num::u32_from(self.timeline.pieces.len())),
                ));
            } else if !self.timeline.is_still {
                piece = pattern::stratum(place.shared, self.timeline.pieces.len().trailing_zeros());
            }
            let photons = self.sample(number, stratum, piece, &place, pixels, has_gloss, stack);
            parts.add(step, photons);
        }
        parts
    }

    /// Photons of one sample of each pixel.
    #[inline(always)]
    #[allow(clippy::too_many_arguments, reason = "a kernel's parts are functions of its locals")]
    fn sample(
        &self,
        number: u32,
        stratum: usize,
        piece: usize,
        place: &Place,
        pixels: &Pixels,
        has_gloss: bool,
        stack: &mut Stack,
    ) -> Floats {
        let bearing = bilinear(&pixels.corners, place.x, place.y);
        let pieces = f32_from_u32(crate::num::u32_from(self.timeline.pieces.len()));
        let share = place.t * Floats::splat(pieces) - Floats::splat(f32_from_u32(crate::num::u32_from(piece)));
        let motion = &self.timeline.pieces[piece];
        let pose = motion.at(share);
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
            if !self.timeline.is_still {
                let change = motion.change_at(share, pieces);
                travel_m = add3(change.place_m(), scaled(change.turned(bearing), hits.t));
            }
            let half = Floats::splat(0.5);
            let steps = Steps {
                direction,
                steps_m: [scaled(right, hits.t), scaled(down, hits.t), travel_m],
                pixel_m: pixels.spread * hits.t,
                off_centre: [place.x - half, place.y - half, place.t - half],
            };
            footprints =
                Some(ellipses(&Surfaces { normal: met.normal(), slopes: met.slopes() }, &steps, self.pass.shares));
        }
        let levels = &self.lamp_levels[stratum];
        let mut lux = self.shade(&hits, &met, &packet, footprints.as_ref(), pixels, levels);
        if has_gloss && met.has_gloss(self.pass.follows_gloss) {
            self.reflect(number, &hits, &packet, pixels, levels, &mut lux);
        }
        let [r, g, b, n] = by_band(&lux);
        let [per_r, per_g, per_b, per_n] = pixels.photons_per_lux;
        let mut left = Floats::splat(0.0);
        for lane in 0..LANES {
            left.0[lane] = self.camera.roll_off_at(bearing[2].0[lane]);
        }
        (r * per_r + g * per_g + b * per_b + n * per_n) * left
    }

    #[inline(always)]
    fn shade(
        &self,
        hits: &Hits,
        met: &Met,
        packet: &Packet,
        footprints: Option<&Footprints>,
        pixels: &Pixels,
        lamp_levels: &[f32; ROWS],
    ) -> [Bands; LANES] {
        let mut levels = [0.0; LANES];
        for lane in 0..LANES {
            levels[lane] = lamp_levels[lane / COLUMNS];
        }
        let mut lux = self.scene.exitances_lux(hits, met, &packet.direction, footprints, &levels);
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
