//! Kernel of refinement: traces one pixel at a time, in packets of sixteen of its samples.
//!
//! The samples are prefixes of one scrambled Sobol' sequence over the points of the surface that the pixel passes (`shear`), so a
//! doubling keeps what is there. Their variance at an edge falls as 1 / n^1.5, and as 1 / n^2 where the edge is upright or level.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

pub use super::allocation::{INITIAL_SAMPLES, STRATA};
use super::allocation::{may_count, ratio};
use super::first_batch::Nearest;
use super::objects::{Instants, ObjectInView, Objects};
use super::pixel_samples::{OF_BEFORE, PixelSamples};
use super::settings::{COLUMNS, ROWS};
use super::shear::sheared_lanes;
use super::view::{Aim, PacketPixels, View};
use crate::draw::sobol::points;
use crate::draw::{DrawKey, mix};
use crate::num::{f32_from_u32, f32_nearest, index, low_u32, u32_from, u32_truncated_f32};
use crate::optics::motion::{PacketMotion, Timeline};
use crate::scene::lanes::{Floats, LANES};
use crate::scene::light::Bands;
use crate::scene::texture::footprint::SampleShare;
use crate::scene::tracer::Stack;
use crate::simd::{Kernel, dispatch};

/// When a pixel has enough samples.
#[derive(Clone, Copy, Debug)]
pub struct StoppingRule {
    /// Samples at most.
    pub samples: u32,
    /// It stops when its variance over its photons and samples is below this; none: it never does.
    pub least_gain: Option<f32>,
    /// Brighter pixels show no noise.
    pub saturation_photons: f32,
    /// Share of the pixel's width that each sample stands for, where it is known beforehand; else that of the samples so far.
    pub share: Option<f32>,
}

impl StoppingRule {
    /// Whether a pixel needs no more samples.
    pub fn is_enough(&self, pixel_samples: &PixelSamples) -> bool {
        let Some(least) = self.least_gain else { return false };
        let variance = pixel_samples.variance();
        let counts = may_count(pixel_samples.photons, variance, self.saturation_photons);
        !counts || ratio(pixel_samples.photons, variance) < least * f32_from_u32(pixel_samples.samples)
    }
}

/// What all samples of a pixel share.
pub struct Pixel<'a> {
    /// Scene and camera.
    pub view: View<'a>,
    /// How the camera moves over the exposure of the row and its neighbours.
    pub timeline: &'a Timeline,
    /// What moves beside the camera.
    pub objects: &'a [ObjectInView],
    /// Level of the flickering lamps in each stratum of the row's exposure.
    pub lamp_levels: &'a [f32; STRATA],
    /// Photons of each band per lux-equivalent behind the filter.
    pub photons_per_lux: Bands,
    /// Column and row.
    pub at: [usize; 2],
    /// Key of its samples.
    pub key: DrawKey,
}

impl Pixel<'_> {
    /// Doubles a pixel's samples until a rule has enough. Its edges belong to the nearest surface.
    pub fn refine(&self, pixel_samples: &mut PixelSamples, nearest: Nearest, rule: &StoppingRule, stack: &mut Stack) {
        dispatch(Refinement { pixel: self, pixel_samples, nearest, rule, stack });
    }

    /// The pixel in all lanes.
    #[inline(always)]
    pub fn pixels(&self) -> PacketPixels {
        let facet_seed = low_u32(mix(self.key.0) >> 32);
        PacketPixels::of_one(self.view.camera, self.at, &self.photons_per_lux, facet_seed)
    }

    /// How far the pixel goes over a surface, in its own widths and heights over the exposure, about its middle.
    fn velocity_px(&self, pixels: &PacketPixels, Nearest { distance_m, object }: Nearest) -> [f32; 2] {
        let timeline = match object.checked_sub(1) {
            None => self.timeline,
            Some(number) => &self.objects[index(number)].timelines[self.at[1] / ROWS],
        };
        if timeline.is_still || pixels.t_max.0[0] < 0.0 {
            return [0.0; 2];
        }
        // Beyond any scene; what is infinitely far goes with the turn alone.
        let distance_m = if distance_m < 1e6 { distance_m } else { 1e6 };
        let lane = self.at[1] % ROWS * COLUMNS;
        let (pose, change) = (timeline.turn_at(lane, 0.5), timeline.change_at(lane, 0.5));
        let corner = |number: usize| pixels.corners[number].each_ref().map(|axis| axis.0[0]);
        let [first, right, down, last] = [corner(0), corner(1), corner(2), corner(3)];
        let bearing = [0, 1, 2].map(|axis| 0.25 * (first[axis] + right[axis] + down[axis] + last[axis]));
        let to = |corner: [f32; 3]| pose.turned([0, 1, 2].map(|axis| corner[axis] - first[axis]));
        let direction = pose.turned(bearing);
        let (right, down) = (across(to(right), direction), across(to(down), direction));
        let (turn, place) = (change.turned(bearing), change.place_m());
        let travel = across([0, 1, 2].map(|axis| turn[axis] + place[axis] / distance_m), direction);
        let (rr, rd, dd) = (dot(right, right), dot(right, down), dot(down, down));
        let (tr, td) = (dot(travel, right), dot(travel, down));
        let determinant = rr * dd - rd * rd;
        if !(determinant > 0.0) {
            return [0.0; 2];
        }
        [(tr * dd - td * rd) / determinant, (td * rr - tr * rd) / determinant]
    }

    /// Photons of samples at places and instants in the first lanes.
    #[inline(always)]
    fn trace(&self, pixels: &PacketPixels, samples: &Samples, stack: &mut Stack) -> Floats {
        let [_, _, t] = samples.place;
        let mut lamp_levels = [1.0; LANES];
        if !self.view.scene.is_steady() {
            for lane in 0..LANES {
                lamp_levels[lane] = self.lamp_levels[index(u32_truncated_f32(t.0[lane] * 16.0))];
            }
        }
        let pieces = f32_from_u32(u32_from(self.timeline.pieces.len()));
        let group = self.at[1] / ROWS;
        let mut aim = Aim {
            place: samples.place,
            motion: PacketMotion::Shared(self.timeline.first_of_row(self.at[1] % ROWS)),
            share: t,
            pieces: if self.timeline.is_still { 0.0 } else { pieces },
            lamp_levels: &lamp_levels,
            lanes: samples.lanes,
            shares: samples.shares,
            moves: samples.moves,
            numbers: samples.numbers,
            objects: Objects { all: self.objects, group, instants: Instants::Row(self.at[1] % ROWS) },
        };
        if self.timeline.pieces.len() == 1 {
            return self.view.sample(pixels, &aim, stack).photons;
        }
        let mut piece_of = [0; LANES];
        for lane in 0..LANES {
            let time = t.0[lane] * pieces;
            let piece = u32_truncated_f32(time);
            piece_of[lane] = index(piece);
            aim.share.0[lane] = time - f32_from_u32(piece);
        }
        let lane = self.at[1] % ROWS * COLUMNS;
        let motion = self.timeline.gathered(lane, &piece_of);
        aim.motion = PacketMotion::ByLane(&motion);
        aim.objects.instants = Instants::Pieces(lane, &piece_of);
        self.view.sample(pixels, &aim, stack).photons
    }
}

/// Samples of one pixel.
pub struct Samples<'a> {
    /// Place in the pixel from its left and from its upper edge, and in the exposure, each 0..1.
    pub place: [Floats; 3],
    /// The first lanes that count.
    pub lanes: usize,
    /// What each stands for.
    pub shares: &'a SampleShare,
    /// How far look-ups of textures are moved; none: by `shares`.
    pub moves: Option<&'a [Floats; 2]>,
    /// Their numbers.
    pub numbers: &'a [u32; LANES],
}

const LANE_NUMBERS: [u32; LANES] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// Doubles a pixel's samples.
struct Refinement<'a> {
    pixel: &'a Pixel<'a>,
    pixel_samples: &'a mut PixelSamples,
    nearest: Nearest,
    rule: &'a StoppingRule,
    stack: &'a mut Stack,
}

impl Kernel for Refinement<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let Self { pixel, pixel_samples, nearest, rule, stack } = self;
        let pixels = pixel.pixels();
        let velocity_px = pixel.velocity_px(&pixels, nearest);
        let seeds = seeds(pixel.key);
        while pixel_samples.samples < rule.samples && !(pixel_samples.samples > 0 && rule.is_enough(pixel_samples)) {
            let samples_before = pixel_samples.samples;
            let count =
                if samples_before == 0 { INITIAL_SAMPLES } else { samples_before.min(rule.samples - samples_before) };
            let shares = SampleShare::over_motion(rule.share.unwrap_or(share(count)));
            let (mut moments, mut sum, mut halves) = (pixel_samples.moments, 0.0, [0.0; 2]);
            for from in (0..count).step_by(LANES) {
                let lanes = LANES.min(index(count - from));
                let mut numbers = [samples_before + from; LANES];
                for lane in 0..LANES {
                    numbers[lane] += LANE_NUMBERS[lane];
                }
                let [p, q, w] = points(&numbers, seeds);
                let sheared = sheared_lanes([Floats(p), Floats(q), Floats(w)], velocity_px, count);
                let samples = Samples {
                    place: sheared.place,
                    lanes,
                    shares: &shares,
                    moves: Some(&sheared.inwards),
                    numbers: &numbers,
                };
                let photons = pixel.trace(&pixels, &samples, stack);
                moments.add(&photons, lanes);
                let [early, late] = halves_of(&photons, lanes);
                sum += early + late;
                halves = [halves[0] + early, halves[1] + late];
            }
            let mean = f32_nearest(sum / f64::from(count));
            if samples_before == 0 {
                let difference = f32_nearest((halves[1] - halves[0]) * (2.0 / f64::from(INITIAL_SAMPLES)));
                (pixel_samples.photons, pixel_samples.removed_variance) = (mean, 0.25 * difference * difference);
            } else {
                let difference = mean - pixel_samples.photons;
                let weight = f32_from_u32(count) / f32_from_u32(samples_before + count);
                pixel_samples.removed_variance = 0.5 * weight * (1.0 - weight) * difference * difference
                    + OF_BEFORE * pixel_samples.removed_variance;
                pixel_samples.photons += difference * weight;
            }
            pixel_samples.samples += count;
            pixel_samples.set_moments(moments);
        }
    }
}

/// Sums of the first and the last eight lanes, of those that count.
#[inline(always)]
fn halves_of(photons: &Floats, lanes: usize) -> [f64; 2] {
    let mut sums = [0.0; 2];
    for lane in 0..LANES {
        let photons = if lane < lanes { f64::from(photons.0[lane]) } else { 0.0 };
        sums[lane * 2 / LANES] += photons;
    }
    sums
}

/// Seeds of x, y and t.
fn seeds(key: DrawKey) -> [u32; 3] {
    [key.0, key.0 >> 32, mix(key.0)].map(low_u32)
}

/// The share of the width that each of `samples` samples stands for.
pub fn share(samples: u32) -> f32 {
    1.0 / f32_from_u32(samples).sqrt()
}

fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// The part of a vector across a direction of about unit length.
fn across(vector: [f32; 3], direction: [f32; 3]) -> [f32; 3] {
    let along = dot(vector, direction) / dot(direction, direction);
    [0, 1, 2].map(|axis| vector[axis] - along * direction[axis])
}
