//! Kernel of refinement: traces one pixel at a time, in packets of sixteen of its samples.
//!
//! The samples are prefixes of one scrambled Sobol' sequence over the points of the surface that the pixel passes (`shear`), so a
//! doubling keeps what is there. Their variance at an edge falls as 1 / n^1.5, and as 1 / n^2 where the edge is upright or level.

use super::allocation::{INITIAL_SAMPLES, missed_variance_n3};
use super::first_batch::{FirstBatch, Nearest};
use super::frame::{FrameRender, share};
use super::objects::{Instants, Objects};
use super::pixel_samples::{OF_BEFORE, PixelSamples};
use super::rays::Sample;
use super::settings::{COLUMNS, ROWS};
use super::shear::{ShearedSamples, sheared_lanes};
use super::view::{PacketPixels, PacketSamples, lane3};
use crate::draw::sobol::points;
use crate::draw::{DrawKey, mix};
use crate::num::{f32_from_u32, f32_nearest, index, low_u32, u32_from, u32_truncated_f32, u64_from};
use crate::optics::motion::{PacketMotion, Timeline};
use crate::parallel::over_chunks;
use crate::scene::lanes::{Floats, LANES};
use crate::scene::mesh::{dot, sub};
use crate::scene::texture::footprint::{Look, SampleShare};
use crate::scene::tracer::Stack;
use crate::simd::{Kernel, dispatch};

/// Marks keys of refined pixels.
pub const OF_REFINED: u64 = 1 << 41;
/// Pixels of a unit of parallel work.
const CHUNK: usize = 64;

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
        let estimate = pixel_samples.estimate(0);
        !estimate.may_count(self.saturation_photons) || estimate.ratio() < least * f32_from_u32(estimate.samples)
    }
}

impl FrameRender<'_> {
    /// Refines pixels until a rule has enough.
    pub fn refine(&self, refined: &mut [PixelSamples], first_batches: &[FirstBatch], rule: &StoppingRule) {
        over_chunks(refined, CHUNK, |_, refined| {
            let mut stack = Stack::new();
            for pixel_samples in refined {
                if pixel_samples.samples == 0 {
                    pixel_samples.missed_variance_n3 =
                        missed_variance_n3(first_batches, self.width(), pixel_samples.pixel);
                } else if pixel_samples.samples >= rule.samples || rule.is_enough(pixel_samples) {
                    continue;
                }
                self.refine_pixel(OF_REFINED, pixel_samples, first_batches, rule, &mut stack);
            }
        });
    }

    /// Doubles a pixel's samples, whose key bears `key_mark`, until a rule has enough. They are sheared along the motion
    /// of the nearest surface that this pixel or one of its four neighbours met.
    pub fn refine_pixel(
        &self,
        key_mark: u64,
        pixel_samples: &mut PixelSamples,
        first_batches: &[FirstBatch],
        rule: &StoppingRule,
        stack: &mut Stack,
    ) {
        let (pixel, width) = (pixel_samples.pixel, self.width());
        let (x, y) = (pixel % width, pixel / width);
        let beside = [
            y * width + x.saturating_sub(1),
            y * width + (x + 1).min(width - 1),
            y.saturating_sub(1) * width + x,
            (y + 1).min(self.shutter.len() - 1) * width + x,
        ];
        let nearest = beside
            .into_iter()
            .fold(first_batches[pixel].nearest, |nearest, other| nearest.or(first_batches[other].nearest));
        let key = self.sampling.key.with(u64_from(y)).with(u64_from(x) | key_mark);
        let shared = Pixel { frame: self, timeline: &self.timelines[y / ROWS], xy: [x, y], key };
        dispatch(Refinement { pixel: shared, pixel_samples, nearest, rule, stack });
    }
}

/// What all samples of a pixel share.
struct Pixel<'a> {
    frame: &'a FrameRender<'a>,
    /// How the camera moves over the exposure of the row and its neighbours.
    timeline: &'a Timeline,
    /// Column and row.
    xy: [usize; 2],
    /// Key of its samples.
    key: DrawKey,
}

impl Pixel<'_> {
    /// How far the pixel goes over a surface, in its own widths and heights over the exposure, about its middle.
    fn velocity_px(&self, pixels: &PacketPixels, Nearest { distance_m, object }: Nearest) -> [f32; 2] {
        let timeline = match object.checked_sub(1) {
            None => self.timeline,
            Some(number) => &self.frame.objects[index(number)].timelines[self.xy[1] / ROWS],
        };
        if timeline.is_still || pixels.t_max.0[0] < 0.0 {
            return [0.0; 2];
        }
        // Beyond any scene; what is infinitely far goes with the turn alone.
        let distance_m = if distance_m < 1e6 { distance_m } else { 1e6 };
        let lane = self.xy[1] % ROWS * COLUMNS;
        let (pose, change) = (timeline.pose_at(lane, 0.5), timeline.change_at(lane, 0.5));
        let [first, right, down, last] = pixels.corners.each_ref().map(|corners| lane3(corners, 0));
        let bearing = [0, 1, 2].map(|axis| 0.25 * (first[axis] + right[axis] + down[axis] + last[axis]));
        let to = |corner: [f32; 3]| pose.turned(sub(corner, first));
        let direction = pose.turned(bearing);
        let (right, down) = (across(to(right), direction), across(to(down), direction));
        let (turn, shift_m) = (change.turned(bearing), change.translation_m());
        let travel = across([0, 1, 2].map(|axis| turn[axis] + shift_m[axis] / distance_m), direction);
        let (rr, rd, dd) = (dot(right, right), dot(right, down), dot(down, down));
        let (tr, td) = (dot(travel, right), dot(travel, down));
        let determinant = rr * dd - rd * rd;
        if !(determinant > 0.0) {
            return [0.0; 2];
        }
        [(tr * dd - td * rd) / determinant, (td * rr - tr * rd) / determinant]
    }

    /// Photons of samples in the first lanes, by their coordinates and numbers.
    #[inline(always)]
    fn trace(
        &self,
        pixels: &PacketPixels,
        sheared: &ShearedSamples,
        (numbers, lanes): (&[u32; LANES], usize),
        shares: &SampleShare,
        stack: &mut Stack,
    ) -> Floats {
        let Self { frame: FrameRender { view, objects, lamp_levels, .. }, timeline, xy, .. } = self;
        let [_, _, t] = sheared.coordinates;
        let mut levels = [1.0; LANES];
        if !view.scene.is_steady() {
            for lane in 0..LANES {
                levels[lane] = lamp_levels[xy[1]][index(u32_truncated_f32(t.0[lane] * 16.0))];
            }
        }
        let pieces = f32_from_u32(u32_from(timeline.pieces.len()));
        let (group, row) = (xy[1] / ROWS, xy[1] % ROWS);
        let mut samples = PacketSamples {
            pixels,
            coordinates: sheared.coordinates,
            motion: PacketMotion::Shared(timeline.first_of_row(row)),
            share: t,
            pieces: if timeline.is_still { 0.0 } else { pieces },
            lamp_levels: &levels,
            lanes,
            shares,
            look: Look::By(sheared.inwards),
            numbers,
            objects: Objects { all: objects, group, instants: Instants::Row(row) },
        };
        let (lane, mut piece_of) = (row * COLUMNS, [0; LANES]);
        let gathered;
        if timeline.pieces.len() > 1 {
            for lane in 0..LANES {
                let time = t.0[lane] * pieces;
                let piece = u32_truncated_f32(time);
                piece_of[lane] = index(piece);
                samples.share.0[lane] = time - f32_from_u32(piece);
            }
            gathered = timeline.gathered(lane, &piece_of);
            samples.motion = PacketMotion::ByLane(&gathered);
            samples.objects.instants = Instants::Pieces(lane, &piece_of);
        }
        dispatch(Sample { view, samples: &samples, stack }).0
    }
}

const LANE_NUMBERS: [u32; LANES] = [0, 1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15];

/// Doubles a pixel's samples.
struct Refinement<'a> {
    pixel: Pixel<'a>,
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
        let Pixel { frame, xy: [x, y], key, .. } = pixel;
        let mut pixels = PacketPixels { facet_seeds: [low_u32(mix(key.0) >> 32); LANES], ..PacketPixels::NONE };
        pixels.set(0..LANES, frame.view.camera, [x, y], &frame.photons_per_lux(x, y));
        let velocity_px = pixel.velocity_px(&pixels, nearest);
        let seeds = [key.0, key.0 >> 32, mix(key.0)].map(low_u32);
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
                let photons = pixel.trace(&pixels, &sheared, (&numbers, lanes), &shares, stack);
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

/// The part of a vector across a direction of about unit length.
fn across(vector: [f32; 3], direction: [f32; 3]) -> [f32; 3] {
    let along = dot(vector, direction) / dot(direction, direction);
    [0, 1, 2].map(|axis| vector[axis] - along * direction[axis])
}
