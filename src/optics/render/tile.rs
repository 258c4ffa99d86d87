//! Kernel of the first batch: traces tiles of four by four pixels of neighbouring rows, one sample of each pixel to a packet.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::first_batch::{FirstBatch, Nearest, Quarters};
use super::objects::{Instants, ObjectInView, Objects};
use super::settings::{COLUMNS, ROWS};
use super::view::{Aim, PacketPixels, View};
use crate::draw::sobol::{self, SamplePoint, Seeds};
use crate::draw::{DrawKey, mix};
use crate::num::{f32_from_u32, index, low_u32, u32_from, u32_truncated_f32, u64_from};
use crate::optics::motion::{PacketMotion, Timeline};
use crate::scene::lanes::{Floats, LANES};
use crate::scene::light::Bands;
use crate::scene::texture::footprint::SampleShare;
use crate::scene::tracer::Stack;
use crate::simd::Kernel;

/// What all rows of a pass share.
#[derive(Clone, Copy, Debug)]
pub struct Pass {
    /// Samples of each pixel.
    pub count: u32,
    /// Share of the pixel, and of the motion over the exposure, that a sample stands for.
    pub shares: [f32; 2],
    /// Still pictures that the samples are dealt to in turn, all of a picture at its instant; 0 for samples at all times.
    pub subframes: u32,
    /// Samples of one still picture.
    pub each: u32,
    /// Logarithm to base 2 of the strata of time that the level of flickering lamps is known for.
    pub strata_log2: u32,
}

impl Pass {
    /// The stratum of time of a sample among those that the lamps' level is known for.
    #[inline(always)]
    fn stratum(&self, number: u32, shared: u32) -> usize {
        if self.subframes > 0 { index(number / self.each) } else { sobol::stratum(shared, self.strata_log2) }
    }
}

/// Neighbouring rows. Lanes beyond the last row of the picture repeat it; their results are not written.
pub struct Rows<'a> {
    /// Scene and camera.
    pub view: View<'a>,
    /// How the camera moves over the rows' exposures.
    pub timeline: &'a Timeline,
    /// What moves beside the camera.
    pub objects: &'a [ObjectInView],
    /// Level of the flickering lamps in each stratum of time, lane by lane.
    pub lamp_levels: &'a [[f32; LANES]],
    /// Photons of each band per lux-equivalent behind a pixel's filter, on the axis, over each row's exposure; by row, then by column
    /// of the filters' pattern.
    pub photons_per_lux: [[Bands; COLUMNS]; ROWS],
    /// The first row.
    pub first: usize,
    /// Rows within the picture.
    pub count: usize,
    /// Key of each row.
    pub keys: [DrawKey; ROWS],
    /// Which samples.
    pub pass: &'a Pass,
    /// Which tiles are rendered; none: all.
    pub tiles: Option<&'a [bool]>,
    /// Results, row by row.
    pub seen: &'a mut [FirstBatch],
}

impl Kernel for Rows<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let width = index(self.view.camera.size.width_px);
        let mut stack = Stack::new();
        for first in (0..width).step_by(COLUMNS) {
            if self.tiles.is_some_and(|tiles| !tiles[first / COLUMNS]) {
                continue;
            }
            let (pixels, seeds) = self.pixels(first, width);
            let (parts, nearest) = self.gather(&pixels, &seeds, &mut stack);
            for lane in 0..LANES {
                let (row, column) = (lane / COLUMNS, first + lane % COLUMNS);
                if row < self.count && column < width {
                    self.seen[row * width + column] = parts.seen(lane, nearest[lane]);
                }
            }
        }
    }
}

impl Rows<'_> {
    #[inline(always)]
    fn pixels(&self, first: usize, width: usize) -> (PacketPixels, Seeds<LANES>) {
        let mut pixels = PacketPixels::NONE;
        let mut seeds =
            Seeds { lanes: [[0; LANES]; 3], packet: low_u32(self.keys[0].with(u64_from(first) | 1 << 40).0) };
        let pattern_px = self.view.camera.mosaic.width_px();
        for lane in 0..LANES {
            // Lanes beyond the last column or row repeat it.
            let x = (first + lane % COLUMNS).min(width - 1);
            let y = self.first + (lane / COLUMNS).min(self.count - 1);
            pixels.set(lane, self.view.camera, [x, y], &self.photons_per_lux[lane / COLUMNS][x % pattern_px]);
            let bits = self.keys[lane / COLUMNS].with(u64_from(x)).0;
            let more = mix(bits);
            for (number, word) in [bits, bits >> 32, more].into_iter().enumerate() {
                seeds.lanes[number][lane] = low_u32(word);
            }
            pixels.facet_seeds[lane] = low_u32(more >> 32);
        }
        (pixels, seeds)
    }

    /// Mean photons of the pass's samples, by quarters of the pass, and the nearest surface of each pixel.
    #[inline(always)]
    fn gather(&self, pixels: &PacketPixels, seeds: &Seeds<LANES>, stack: &mut Stack) -> (Quarters, [Nearest; LANES]) {
        let mut parts = Quarters::new(self.pass.count);
        let mut nearest = [Nearest::NONE; LANES];
        let shares = SampleShare::new(self.pass.shares[0], self.pass.shares[1]);
        let pieces = f32_from_u32(u32_from(self.timeline.pieces.len()));
        for number in 0..self.pass.count {
            let SamplePoint { place: [x, y, t], shared } = sobol::place(number, seeds);
            let [x, y, mut t] = [Floats(x), Floats(y), Floats(t)];
            let stratum = self.pass.stratum(number, shared);
            let mut piece = 0;
            if self.pass.subframes > 0 {
                let middle = (f32_from_u32(number / self.pass.each) + 0.5) / f32_from_u32(self.pass.subframes);
                t = Floats::splat(middle);
                piece = index(u32_truncated_f32(middle * pieces));
            } else if !self.timeline.is_still {
                piece = sobol::stratum(shared, self.timeline.pieces.len().trailing_zeros());
            }
            let aim = Aim {
                place: [x, y, t],
                motion: PacketMotion::ByLane(&self.timeline.pieces[piece]),
                share: t * Floats::splat(pieces) - Floats::splat(f32_from_u32(u32_from(piece))),
                pieces: if self.timeline.is_still { 0.0 } else { pieces },
                lamp_levels: &self.lamp_levels[stratum],
                lanes: LANES,
                shares: &shares,
                moves: None,
                numbers: &[number; LANES],
                objects: Objects { all: self.objects, group: self.first / ROWS, instants: Instants::Tile(piece) },
            };
            let sampled = self.view.sample(pixels, &aim, stack);
            parts.add(number, sampled.photons);
            for lane in 0..LANES {
                nearest[lane] =
                    nearest[lane].or(Nearest { distance_m: sampled.distance_m.0[lane], object: sampled.object[lane] });
            }
        }
        (parts, nearest)
    }
}
