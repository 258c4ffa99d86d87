//! Photons. Enters: a lit scene, a camera, its motion, an exposure span for each row. Leaves: mean photons of every pixel.
//!
//! Every ray has its own place in the pixel and its own instant. Place and time are stratified together (`pattern`), a look-up averages
//! over what its sample stands for (`filter`), and tiles of sixteen pixels are sampled in doubling batches until their render variance is
//! below what the caller asks for (`tiles`). The pixels of a tile share the leading bits of their samples' times, which keeps their rays
//! close together.

mod filter;
mod pattern;
mod reflect;
mod rows;
mod tiles;

use super::camera::Camera;
use super::motion::Timeline;
use crate::draw::DrawKey;
use crate::num::{f32_from_u32, f32_nearest, index, u64_from};
use crate::plane::Plane;
use crate::pose::Pose;
use crate::scene::LitScene;
use crate::scene::light::{BANDS, Bands};
use crate::scene::lit::BOUNCES_MAX;
use crate::simd::dispatch;
use crate::units::Span;
use rows::{COLUMNS, Pass, ROWS, Rows};
use tiles::{Tile, Watch};

/// What a camera saw in one exposure.
#[derive(Clone, Debug)]
pub struct Exposure {
    /// Mean photons of each pixel, all bands by their weights.
    pub photons: Plane<f32>,
    /// Mean over lit pixels below saturation of (estimated variance of the pixel's mean) / (its photon variance), both in electrons: render
    /// noise over photon noise. It comes from what halves of the samples differ by. Infinite for one sample, which says nothing about
    /// its own error; 0 without such a pixel.
    pub render_variance_ratio: f64,
    /// Rays that were traced from the camera.
    pub rays: u64,
}

/// How a render is sampled.
#[derive(Clone, Copy, Debug)]
pub struct Sampling {
    /// Rays of each pixel; at least 1. Where tiles stop by themselves, those of the first batch, a power of two of at least 2; with
    /// sub-frames, those of each.
    pub samples_per_pixel: u32,
    /// Rays of a pixel at most, where tiles stop by themselves.
    pub samples_max: u32,
    /// A tile stops when its render variance is below so many times its photon variance, both in electrons; 0: it never does.
    pub tolerance: f64,
    /// Still pictures that are averaged, at the middles of equal parts of the exposure: how others merge sub-frames, and a reference; 0 for
    /// rays that each have their own instant.
    pub subframes: u32,
    /// Reflections that a ray follows, up to `BOUNCES_MAX`; 0: every surface is dull.
    pub reflections: u32,
    /// Whether it follows them at gloss and glaze too, and not only at mirrors. Highlights of bright lamps in rough gloss are found by
    /// chance alone, so they cost far more samples than anything else.
    pub follows_gloss: bool,
    /// Electrons of a photon: photon variance in electrons is this times the photons, render variance its square.
    pub electrons_per_photon: f64,
    /// Photons beyond which a pixel shows no difference, so that its render noise does not count. They are rendered all the same.
    pub saturation_photons: f32,
    /// Names the pattern of samples.
    pub key: DrawKey,
}

impl Sampling {
    /// The same number of rays for every pixel.
    pub fn fixed(samples_per_pixel: u32, key: DrawKey) -> Self {
        Self {
            samples_per_pixel,
            samples_max: samples_per_pixel,
            tolerance: 0.0,
            subframes: 0,
            reflections: BOUNCES_MAX,
            follows_gloss: true,
            electrons_per_photon: 1.0,
            saturation_photons: f32::INFINITY,
            key,
        }
    }

    /// Rays of the first batch.
    fn first_batch(&self) -> u32 {
        self.samples_per_pixel * self.subframes.max(1)
    }

    fn is_adaptive(&self) -> bool {
        self.tolerance > 0.0 && self.subframes == 0
    }
}

/// Renders one exposure. `shutter` has one span a row (all equal for a global shutter). Panics if it does not, without samples, and for a
/// first batch of a tolerance that is no power of two from 2.
pub fn render(
    scene: &LitScene,
    camera: &Camera,
    shutter: &[Span],
    world_from_body: &(dyn Fn(f64) -> Pose + Sync),
    sampling: Sampling,
) -> Exposure {
    let mut photons = Plane::filled(camera.size, 0.0_f32);
    let (width, height) = (photons.width_px(), photons.height_px());
    let first_batch = sampling.first_batch();
    assert!(shutter.len() == height, "a render needs one span for each row");
    assert!(first_batch > 0, "a render needs a sample");
    let doubles = first_batch.is_power_of_two() && first_batch > 1;
    assert!(!sampling.is_adaptive() || doubles, "a batch that doubles is a power of two");
    let (across, groups) = (width.div_ceil(COLUMNS), height.div_ceil(ROWS));
    let mut tiles = vec![Tile::NEW; across * groups];
    let groups = Groups { scene, camera, shutter, sampling, timelines: timelines(shutter, camera, world_from_body) };
    let mut watch = Watch::default();
    let mut pass = groups.pass(0, first_batch);
    let mut rays = 0;
    loop {
        groups.run(&pass, photons.values_mut(), &mut tiles);
        watch.note(&tiles);
        rays += u64::from(pass.count) * pixels_of(&tiles, width, height);
        let samples = pass.first + pass.count;
        if !sampling.is_adaptive() || 2 * samples > sampling.samples_max {
            break;
        }
        let in_photons = f32_nearest(sampling.tolerance / sampling.electrons_per_photon);
        let hidden = groups.hidden(&tiles, &photons);
        if tiles::choose(&mut tiles, across, in_photons, &hidden) == 0 {
            break;
        }
        pass = groups.pass(samples, samples);
    }
    let in_electrons = watch.variance_ratio(&tiles) * sampling.electrons_per_photon;
    Exposure { photons, render_variance_ratio: if first_batch > 1 { in_electrons } else { f64::INFINITY }, rays }
}

/// Pixels of the tiles that a pass sampled.
fn pixels_of(tiles: &[Tile], width: usize, height: usize) -> u64 {
    let across = width.div_ceil(COLUMNS);
    let edge = |from: usize, step: usize, most: usize| step.min(most - from * step);
    let of = |(number, _): (usize, &Tile)| {
        u64_from(edge(number % across, COLUMNS, width) * edge(number / across, ROWS, height))
    };
    tiles.iter().enumerate().filter(|(_, tile)| tile.is_active).map(of).sum()
}

/// Rows of each group; those beyond the last repeat it.
fn rows_of(group: usize, height: usize) -> [usize; ROWS] {
    std::array::from_fn(|row| (group * ROWS + row).min(height - 1))
}

fn timelines(shutter: &[Span], camera: &Camera, world_from_body: &(dyn Fn(f64) -> Pose + Sync)) -> Vec<Timeline> {
    let world_from_camera = |t_s: f64| world_from_body(t_s).then(&camera.body_from_camera);
    let of = |group: usize| Timeline::of(rows_of(group, shutter.len()).map(|row| shutter[row]), &world_from_camera);
    let groups = shutter.len().div_ceil(ROWS);
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        (0..groups).into_par_iter().map(of).collect()
    }
    #[cfg(not(feature = "parallel"))]
    {
        (0..groups).map(of).collect()
    }
}

/// Everything that the passes of a render share.
struct Groups<'a> {
    scene: &'a LitScene,
    camera: &'a Camera,
    shutter: &'a [Span],
    sampling: Sampling,
    timelines: Vec<Timeline>,
}

impl Groups<'_> {
    fn pass(&self, first: u32, count: u32) -> Pass {
        let Sampling { subframes, samples_per_pixel: each, saturation_photons, reflections, follows_gloss, .. } =
            self.sampling;
        let share = |samples: u32| 1.0 / f32_from_u32(samples).sqrt();
        // A still picture is filtered for itself, and not along the motion.
        let shares = if subframes > 0 { [share(each), 0.0] } else { [share(first + count); 2] };
        let strata_log2 = count.ilog2().min(pattern::SHARED_BITS);
        Pass { first, count, shares, subframes, each, strata_log2, reflections, follows_gloss, saturation_photons }
    }

    /// Takes a pass over all groups of rows, on all cores where the feature is on.
    fn run(&self, pass: &Pass, photons: &mut [f32], tiles: &mut [Tile]) {
        let width = index(self.camera.size.width_px);
        let per_lux_s = self.camera.photons_per_lux_s(self.scene.illuminant());
        let work = |(group, (photons, tiles)): (usize, (&mut [f32], &mut [Tile]))| {
            if tiles.iter().any(|tile| tile.is_active) {
                self.run_group(pass, group, per_lux_s, photons, tiles);
            }
        };
        #[cfg(feature = "parallel")]
        {
            use rayon::prelude::*;
            let tiles = tiles.par_chunks_mut(width.div_ceil(COLUMNS));
            photons.par_chunks_mut(width * ROWS).zip(tiles).enumerate().for_each(work);
        }
        #[cfg(not(feature = "parallel"))]
        {
            let tiles = tiles.chunks_mut(width.div_ceil(COLUMNS));
            photons.chunks_mut(width * ROWS).zip(tiles).enumerate().for_each(work);
        }
    }

    /// What each active tile's samples may have missed, as a variance over photons: in the mean over its pixels below saturation.
    fn hidden(&self, tiles: &[Tile], photons: &Plane<f32>) -> Vec<f32> {
        let across = photons.width_px().div_ceil(COLUMNS);
        let of = |(number, tile): (usize, &Tile)| {
            if !tile.is_active {
                return 0.0;
            }
            let first = [number % across * COLUMNS, number / across * ROWS];
            tiles::hidden(photons, first, tile.samples, self.sampling.saturation_photons)
        };
        #[cfg(feature = "parallel")]
        {
            use rayon::prelude::*;
            tiles.par_iter().enumerate().map(of).collect()
        }
        #[cfg(not(feature = "parallel"))]
        {
            tiles.iter().enumerate().map(of).collect()
        }
    }

    fn run_group(&self, pass: &Pass, group: usize, per_lux_s: [f64; BANDS], photons: &mut [f32], tiles: &mut [Tile]) {
        let camera = self.camera;
        let row_of = rows_of(group, self.shutter.len());
        let per_lux = |row: usize| -> [Bands; COLUMNS] {
            // To the picosecond, so that equal exposures are equal in every bit whenever they begin.
            let length_s = (self.shutter[row].length_s() * 1e12).round_ties_even() * 1e-12;
            let of_band = |passed: [f64; BANDS], band: usize| f32_nearest(per_lux_s[band] * passed[band] * length_s);
            let filter = |column: usize| camera.mosaic.transmission_at(column, row);
            std::array::from_fn(|column| std::array::from_fn(|band| of_band(filter(column), band)))
        };
        let lamp_levels = self.lamp_levels(pass, row_of);
        dispatch(Rows {
            scene: self.scene,
            camera,
            timeline: &self.timelines[group],
            lamp_levels: &lamp_levels,
            photons_per_lux: row_of.map(per_lux),
            pattern_px: camera.mosaic.width_px(),
            first: group * ROWS,
            count: photons.len() / index(camera.size.width_px),
            keys: row_of.map(|row| self.sampling.key.with(u64_from(row))),
            pass,
            photons,
            tiles,
        });
    }

    /// Level of the flickering lamps over each stratum of each row's exposure.
    fn lamp_levels(&self, pass: &Pass, row_of: [usize; ROWS]) -> Vec<[f32; ROWS]> {
        let strata = if pass.subframes > 0 { pass.subframes } else { 1 << pass.strata_log2 };
        let level = |row: usize, stratum: u32| {
            let span = self.shutter[row];
            let at_s = |edge: u32| span.start_s + span.length_s() * (f64::from(edge) / f64::from(strata));
            self.scene.lamp_level(Span { start_s: at_s(stratum), end_s: at_s(stratum + 1) })
        };
        (0..strata).map(|stratum| row_of.map(|row| level(row, stratum))).collect()
    }
}

#[cfg(test)]
mod tests;
