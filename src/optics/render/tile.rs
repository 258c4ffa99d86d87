//! The first batch: traces tiles of four by four pixels of neighbouring rows, one sample of each pixel to a packet.

use super::first_batch::{FirstBatch, Nearest, Quarters};
use super::frame::{FrameRender, lamp_level, rows_of, share};
use super::objects::{Instants, Objects};
use super::rays::Sample;
use super::settings::{COLUMNS, ROWS, Sampling};
use super::view::{PacketPixels, PacketSamples};
use crate::draw::sobol::{self, SHARED_BITS, SamplePoint, Seeds};
use crate::draw::{DrawKey, mix};
use crate::num::{f32_from_u32, index, low_u32, u32_from, u32_truncated_f32, u64_from};
use crate::optics::motion::PacketMotion;
use crate::parallel::over_chunks;
use crate::scene::lanes::{Floats, LANES};
use crate::scene::light::Bands;
use crate::scene::texture::footprint::{Look, SampleShare};
use crate::scene::tracer::Stack;
use crate::simd::{Kernel, dispatch};

impl FrameRender<'_> {
    /// The first batch of every pixel, of `count` samples.
    pub fn render_first_batch(&self, count: u32) -> Vec<FirstBatch> {
        let Sampling { subframes, samples_per_pixel, key, .. } = self.sampling;
        // A still picture is filtered for itself, and not along the motion.
        let [of_pixel, of_exposure] = if subframes > 0 { [share(samples_per_pixel), 0.0] } else { [share(count); 2] };
        let shares = SampleShare::new(of_pixel, of_exposure);
        let strata_log2 = count.ilog2().min(SHARED_BITS);
        let strata = if subframes > 0 { index(subframes) } else { 1 << strata_log2 };
        let mut first_batches = vec![FirstBatch::NONE; self.width() * self.shutter.len()];
        over_chunks(&mut first_batches, self.width() * ROWS, |group, first_batches| {
            let row_of = rows_of(group, self.shutter.len());
            let levels = |stratum: usize| {
                let of_row = row_of.map(|row| lamp_level(&self.view, self.shutter[row], stratum, strata));
                std::array::from_fn(|lane| of_row[lane / COLUMNS])
            };
            let lamp_levels: Vec<[f32; LANES]> = (0..strata).map(levels).collect();
            dispatch(Rows {
                frame: self,
                group,
                lamp_levels: &lamp_levels,
                photons_per_lux: row_of.map(|row| std::array::from_fn(|column| self.photons_per_lux(column, row))),
                keys: row_of.map(|row| key.with(u64_from(row))),
                count,
                shares: &shares,
                strata_log2,
                first_batches,
            });
        });
        if let Some(kept) = &self.kept {
            let photons = kept.photons.values().iter().enumerate().filter(|(pixel, _)| !self.is_rendered(*pixel));
            photons.for_each(|(pixel, photons)| first_batches[pixel].photons = *photons);
        }
        first_batches
    }
}

/// A group of neighbouring rows. Lanes beyond the last row of the picture repeat it; their results are not written.
struct Rows<'a> {
    frame: &'a FrameRender<'a>,
    group: usize,
    /// Level of the flickering lamps in each stratum of time, lane by lane.
    lamp_levels: &'a [[f32; LANES]],
    /// Photons of each band per lux-equivalent behind a pixel's filter, on the axis, over each row's exposure; by row, then by column
    /// of the filters' pattern.
    photons_per_lux: [[Bands; COLUMNS]; ROWS],
    keys: [DrawKey; ROWS],
    /// Samples of each pixel.
    count: u32,
    /// What each sample stands for.
    shares: &'a SampleShare,
    /// Logarithm to base 2 of the strata of time that the level of flickering lamps is known for; without sub-frames.
    strata_log2: u32,
    /// Results, row by row.
    first_batches: &'a mut [FirstBatch],
}

impl Kernel for Rows<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let width = self.frame.width();
        let rows = self.first_batches.len() / width;
        let tiles = self.frame.kept.as_ref().map(|kept| &kept.tiles[self.group]);
        let mut stack = Stack::new();
        for first in (0..width).step_by(COLUMNS) {
            if tiles.is_some_and(|tiles| !tiles[first / COLUMNS]) {
                continue;
            }
            let (pixels, seeds) = self.pixels(first, [width, rows]);
            let (quarters, nearest) = self.gather(&pixels, &seeds, &mut stack);
            for lane in 0..LANES {
                let (row, column) = (lane / COLUMNS, first + lane % COLUMNS);
                if row < rows && column < width {
                    self.first_batches[row * width + column] = quarters.of_lane(lane, nearest[lane]);
                }
            }
        }
    }
}

impl Rows<'_> {
    #[inline(always)]
    fn pixels(&self, first: usize, [width, rows]: [usize; 2]) -> (PacketPixels, Seeds<LANES>) {
        let mut pixels = PacketPixels::NONE;
        let mut seeds =
            Seeds { lanes: [[0; LANES]; 3], packet: low_u32(self.keys[0].with(u64_from(first) | 1 << 40).0) };
        let camera = self.frame.view.camera;
        let pattern_px = camera.mosaic.width_px();
        for lane in 0..LANES {
            // Lanes beyond the last column or row repeat it.
            let x = (first + lane % COLUMNS).min(width - 1);
            let y = self.group * ROWS + (lane / COLUMNS).min(rows - 1);
            pixels.set(lane..lane + 1, camera, [x, y], &self.photons_per_lux[lane / COLUMNS][x % pattern_px]);
            let bits = self.keys[lane / COLUMNS].with(u64_from(x)).0;
            let more = mix(bits);
            for (number, word) in [bits, bits >> 32, more].into_iter().enumerate() {
                seeds.lanes[number][lane] = low_u32(word);
            }
            pixels.facet_seeds[lane] = low_u32(more >> 32);
        }
        (pixels, seeds)
    }

    /// Mean photons of the samples by quarters of the batch, and the nearest surface of each pixel.
    #[inline(always)]
    fn gather(&self, pixels: &PacketPixels, seeds: &Seeds<LANES>, stack: &mut Stack) -> (Quarters, [Nearest; LANES]) {
        let FrameRender { view, sampling, timelines, objects, .. } = self.frame;
        let Sampling { subframes, samples_per_pixel, .. } = *sampling;
        let timeline = &timelines[self.group];
        let pieces = f32_from_u32(u32_from(timeline.pieces.len()));
        let mut quarters = Quarters::new(self.count);
        let mut nearest = [Nearest::NONE; LANES];
        let half = Floats::splat(0.5);
        for number in 0..self.count {
            let SamplePoint { coordinates: [x, y, t], shared } = sobol::sample_point(number, seeds);
            let [x, y, mut t] = [Floats(x), Floats(y), Floats(t)];
            let (mut stratum, mut piece) = (sobol::stratum(shared, self.strata_log2), 0);
            if subframes > 0 {
                let subframe = number / samples_per_pixel;
                let middle = (f32_from_u32(subframe) + 0.5) / f32_from_u32(subframes);
                t = Floats::splat(middle);
                stratum = index(subframe);
                piece = index(u32_truncated_f32(middle * pieces));
            } else if !timeline.is_still {
                piece = sobol::stratum(shared, timeline.pieces.len().trailing_zeros());
            }
            let samples = PacketSamples {
                pixels,
                coordinates: [x, y, t],
                motion: PacketMotion::ByLane(&timeline.pieces[piece]),
                share: t * Floats::splat(pieces) - Floats::splat(f32_from_u32(u32_from(piece))),
                pieces: if timeline.is_still { 0.0 } else { pieces },
                lamp_levels: &self.lamp_levels[stratum],
                lanes: LANES,
                shares: self.shares,
                look: Look::Inwards([x - half, y - half, t - half]),
                numbers: &[number; LANES],
                objects: Objects { all: objects, group: self.group, instants: Instants::Tile(piece) },
            };
            let (photons, met) = dispatch(Sample { view, samples: &samples, stack });
            quarters.add(number, photons);
            for lane in 0..LANES {
                let met = Nearest { distance_m: met.distance_m.0[lane], object: met.object[lane] };
                nearest[lane] = nearest[lane].or(met);
            }
        }
        (quarters, nearest)
    }
}
