//! Photons. Enters: a lit scene, a camera, its motion, an exposure span for each row. Leaves: mean photons of every pixel.
//!
//! Every ray has its own place in the pixel and its own instant. Sample s of a pixel lies in the s-th stratum of the exposure and at
//! the s-th point of a plane low-discrepancy sequence, both shifted by the pixel's own draw, so time and place are stratified together and
//! neighbours err apart. The pixels of a small square take the same stratum at the same time, which keeps their rays close together.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::camera::Camera;
use super::motion::{Parabola, Parabolas};
use crate::draw::DrawKey;
use crate::num::{f32_from_u32, f32_nearest, f64_from_usize, index, low_u32, u64_from};
use crate::plane::Plane;
use crate::pose::Pose;
use crate::scene::LitScene;
use crate::scene::lanes::{Floats, LANES, Vectors};
use crate::scene::light::{BANDS, Bands};
use crate::scene::tracer::{MISS, Packet, Stack, closest_inline_through};
use crate::simd::{Kernel, dispatch};
use crate::units::Span;

/// What a camera saw in one exposure.
#[derive(Clone, Debug)]
pub struct Exposure {
    /// Mean photons of each pixel, all bands by their weights.
    pub photons: Plane<f32>,
    /// Mean over lit pixels below saturation of (estimated variance of the pixel's mean) / (its photons): render noise over photon
    /// noise. The estimate is the variance between a pixel's samples over their number, which stratification only lowers.
    /// Infinite for one sample, which says nothing about its own error; 0 without such a pixel.
    pub render_variance_ratio: f64,
    /// Rays that were traced.
    pub rays: u64,
}

/// How a render is sampled.
#[derive(Clone, Copy, Debug)]
pub struct Sampling {
    /// Rays of each pixel; at least 1.
    pub samples_per_pixel: u32,
    /// Photons beyond which a pixel shows no difference, so that its render noise does not count. They are rendered all the same.
    pub saturation_photons: f32,
    /// Names the pattern of samples.
    pub key: DrawKey,
}

/// Columns of the square of pixels that a packet covers.
const COLUMNS: usize = 4;
/// Rows of it, and of a unit of parallel work.
const ROWS: usize = LANES / COLUMNS;

/// Steps of the R2 sequence (powers of the inverse of the plastic number).
const R2: [f32; 2] = [0.754_877_7, 0.569_840_3];

/// The prefilter of textures takes the pixel's width over this root of the samples: with more samples each stands for less.
const FILTER_SHARE_MIN: f32 = 0.25;

/// Neighbouring rows. Lanes beyond the last row of the picture repeat it; their results are not written.
struct Rows<'a> {
    scene: &'a LitScene,
    camera: &'a Camera,
    /// One for each stratum of time.
    motion: &'a [Parabolas],
    /// Photons of each band per lux-equivalent behind a pixel's filter, on the axis, over each row's exposure; by row, then by column
    /// of the filters' pattern.
    photons_per_lux: [[Bands; COLUMNS]; ROWS],
    /// Columns after which the filters repeat.
    pattern_px: usize,
    /// The first row, and how many there are.
    first: usize,
    count: usize,
    /// Key of each row.
    keys: [DrawKey; ROWS],
    saturation_photons: f32,
    /// Their pixels, row by row.
    photons: &'a mut [f32],
}

/// Renders one exposure. `shutter` has one span a row (all equal for a global shutter). Panics if it does not, or without
/// samples.
pub fn render(
    scene: &LitScene,
    camera: &Camera,
    shutter: &[Span],
    world_from_body: &(dyn Fn(f64) -> Pose + Sync),
    sampling: Sampling,
) -> Exposure {
    let samples_per_pixel = sampling.samples_per_pixel;
    let mut photons = Plane::filled(camera.size, 0.0_f32);
    let (width, height) = (photons.width_px(), photons.height_px());
    assert!(shutter.len() == height, "a render needs one span for each row");
    assert!(samples_per_pixel > 0, "a render needs a sample");
    let per_lux_s = camera.photons_per_lux_s(scene.illuminant());
    let work = |first: usize, values: &mut [f32]| {
        let count = values.len() / width;
        let row_of: [usize; ROWS] = std::array::from_fn(|row| first + row.min(count - 1));
        let motion = strata(row_of.map(|row| shutter[row]), samples_per_pixel, camera, world_from_body);
        let per_lux = |row: usize| -> [Bands; COLUMNS] {
            let of_band = |passed: [f64; BANDS], band: usize| {
                f32_nearest(per_lux_s[band] * passed[band] * shutter[row].length_s())
            };
            let filter = |column: usize| camera.mosaic.transmission_at(column, row);
            std::array::from_fn(|column| std::array::from_fn(|band| of_band(filter(column), band)))
        };
        dispatch(Rows {
            scene,
            camera,
            motion: &motion,
            photons_per_lux: row_of.map(per_lux),
            pattern_px: camera.mosaic.width_px(),
            first,
            count,
            keys: row_of.map(|row| sampling.key.with(u64_from(row))),
            saturation_photons: sampling.saturation_photons,
            photons: values,
        })
    };
    let ratios = over_rows(photons.values_mut(), width, &work);
    let mut all = Ratios::default();
    for part in ratios {
        all.add(part);
    }
    let render_variance_ratio = if samples_per_pixel > 1 { all.mean() } else { f64::INFINITY };
    let rays = u64_from(camera.size.pixel_count()) * u64::from(samples_per_pixel);
    Exposure { photons, render_variance_ratio, rays }
}

/// Sum of variance over photons, and over how many pixels.
#[derive(Clone, Copy, Debug, Default)]
struct Ratios {
    sum: f64,
    pixels: u32,
}

impl Ratios {
    #[inline(always)]
    fn add(&mut self, other: Self) {
        self.sum += other.sum;
        self.pixels += other.pixels;
    }

    fn mean(self) -> f64 {
        if self.pixels == 0 { 0.0 } else { self.sum / f64::from(self.pixels) }
    }
}

/// Groups of rows on all cores where the feature is on; results in order.
fn over_rows(values: &mut [f32], width: usize, work: &(dyn Fn(usize, &mut [f32]) -> Ratios + Sync)) -> Vec<Ratios> {
    #[cfg(feature = "parallel")]
    {
        use rayon::prelude::*;
        let groups = values.par_chunks_mut(width * ROWS).enumerate();
        groups.map(|(group, values)| work(group * ROWS, values)).collect()
    }
    #[cfg(not(feature = "parallel"))]
    {
        let groups = values.chunks_mut(width * ROWS).enumerate();
        groups.map(|(group, values)| work(group * ROWS, values)).collect()
    }
}

/// Motion over each stratum, by lane. Rows that are exposed together are asked for once.
fn strata(
    spans: [Span; ROWS],
    samples: u32,
    camera: &Camera,
    world_from_body: &(dyn Fn(f64) -> Pose + Sync),
) -> Vec<Parabolas> {
    let world_from_camera = |t_s: f64| world_from_body(t_s).then(&camera.body_from_camera);
    let stratum = |span: Span, number: u32| {
        let edge_s = |number: u32| span.start_s + span.length_s() * (f64::from(number) / f64::from(samples));
        Parabola::through(Span { start_s: edge_s(number), end_s: edge_s(number + 1) }, &world_from_camera)
    };
    let lanes = |number: u32| {
        let mut known = [stratum(spans[0], number); ROWS];
        for row in 1..ROWS {
            known[row] = if spans[row] == spans[row - 1] { known[row - 1] } else { stratum(spans[row], number) };
        }
        Parabolas::of(&std::array::from_fn(|lane| known[lane / COLUMNS]))
    };
    (0..samples).map(lanes).collect()
}

/// A square of pixels, row by row.
struct Pixels {
    corners: [Vectors; 4],
    spread: Floats,
    /// The pixel's own shift in x, y and time, each in 0..1.
    shift: [Floats; 3],
    /// Photons of each band per lux-equivalent.
    photons_per_lux: [Floats; BANDS],
    /// How far rays go; below zero where the lens has no bearing.
    t_max: Floats,
    /// The lanes that have a bearing, and how many there are.
    seen: ([usize; LANES], usize),
}

impl Kernel for Rows<'_> {
    type Output = Ratios;

    #[inline(always)]
    fn run(self) -> Ratios {
        let width = index(self.camera.size.width_px);
        let mut ratios = Ratios::default();
        let mut stack = Stack::new();
        let samples = f32_nearest(f64_from_usize(self.motion.len()));
        for first in (0..width).step_by(COLUMNS) {
            let pixels = self.pixels(first, width);
            let (sum, squares) = self.gather(&pixels, &mut stack);
            for lane in 0..LANES {
                let (row, column) = (lane / COLUMNS, first + lane % COLUMNS);
                if row >= self.count || column >= width {
                    continue;
                }
                let mean = sum.0[lane] / samples;
                self.photons[row * width + column] = mean;
                if mean > 0.0 && mean < self.saturation_photons && samples > 1.0 {
                    let sum = f64::from(squares.0[lane] / (samples * (samples - 1.0)) / mean);
                    ratios.add(Ratios { sum, pixels: 1 });
                }
            }
        }
        ratios
    }
}

impl Rows<'_> {
    #[inline(always)]
    fn pixels(&self, first: usize, width: usize) -> Pixels {
        let zero = Floats::splat(0.0);
        let mut pixels = Pixels {
            corners: [[zero; 3]; 4],
            spread: zero,
            shift: [zero; 3],
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
            for (number, shift) in pixels.shift.iter_mut().enumerate() {
                let word = low_u32(bits >> (21 * number)) & 0x001F_FFFF;
                shift.0[lane] = f32_from_u32(word) / 2_097_152.0;
            }
        }
        pixels
    }

    /// Sum of the samples' photons, and the sum of their squared distances from the mean.
    #[inline(always)]
    fn gather(&self, pixels: &Pixels, stack: &mut Stack) -> (Floats, Floats) {
        let (mut sum, mut mean, mut squares) = (Floats::splat(0.0), Floats::splat(0.0), Floats::splat(0.0));
        let samples = f32_nearest(f64_from_usize(self.motion.len()));
        let filter = (1.0 / samples.sqrt()).max(FILTER_SHARE_MIN);
        let mut number = 0.0;
        for motion in self.motion {
            let x = shifted(pixels.shift[0], number * R2[0]);
            let y = shifted(pixels.shift[1], number * R2[1]);
            let bearing = bilinear(&pixels.corners, x, y);
            let (origin_m, direction) = motion.rays(bearing, pixels.shift[2]);
            let photons = self.shade(
                pixels,
                filter,
                bearing,
                Packet { origin_m, direction, t_min: Floats::splat(0.0), t_max: pixels.t_max },
                stack,
            );
            number += 1.0;
            // Welford's update: no cancellation for bright, quiet pixels.
            let apart = photons - mean;
            mean = mean + apart * Floats::splat(1.0 / number);
            squares = squares + apart * (photons - mean);
            sum = sum + photons;
        }
        (sum, squares)
    }

    #[inline(always)]
    fn shade(&self, pixels: &Pixels, filter: f32, bearing: Vectors, packet: Packet, stack: &mut Stack) -> Floats {
        let hits = closest_inline_through(&self.scene.scene().bvh, &self.scene.scene().mesh, &packet, stack);
        let mut photons = Floats::splat(0.0);
        // A list whose length only the run knows: unrolled sixteen times, shading outgrows the instruction cache.
        for &lane in &pixels.seen.0[..pixels.seen.1] {
            let exitance = if hits.triangle[lane] == MISS {
                self.scene.sky_lux()
            } else {
                let [x, y, z] = packet.direction;
                let direction = [x.0[lane], y.0[lane], z.0[lane]];
                let footprint_m = hits.t.0[lane] * pixels.spread.0[lane] * filter;
                self.scene.exitance_lux(hits.triangle[lane], [hits.u.0[lane], hits.v.0[lane]], direction, footprint_m)
            };
            let [r, g, b, n] = exitance;
            let [per_r, per_g, per_b, per_n] = pixels.photons_per_lux.map(|per_lux| per_lux.0[lane]);
            photons.0[lane] =
                (r * per_r + g * per_g + b * per_b + n * per_n) * self.camera.roll_off_at(bearing[2].0[lane]);
        }
        photons
    }
}

/// Numbers of 0..1 moved along, around the end.
#[inline(always)]
fn shifted(mut share: Floats, by: f32) -> Floats {
    for lane in 0..LANES {
        let moved = share.0[lane] + by;
        share.0[lane] = moved - moved.floor();
    }
    share
}

/// Bearings at shares x (to the right) and y (downwards) of pixels.
#[inline(always)]
pub(super) fn bilinear(corners: &[Vectors; 4], x: Floats, y: Floats) -> Vectors {
    let mut bearing = corners[0];
    for axis in 0..3 {
        let above = corners[0][axis] + (corners[1][axis] - corners[0][axis]) * x;
        let below = corners[2][axis] + (corners[3][axis] - corners[2][axis]) * x;
        bearing[axis] = above + (below - above) * y;
    }
    bearing
}

#[cfg(test)]
mod tests {
    use super::super::camera::{Aperture, Pupil, RollOff};
    use super::super::lens::Lens;
    use super::*;
    use crate::scene::{BakeSettings, Illuminant, box_room, target};
    use crate::simd::{Level, limit};
    use crate::units::Size;
    use glam::{DQuat, DVec3};

    fn sampling(samples_per_pixel: u32, key: DrawKey) -> Sampling {
        Sampling { samples_per_pixel, saturation_photons: f32::INFINITY, key }
    }

    const SIZE: Size = Size { width_px: 45, height_px: 31 };

    fn camera(pupil: Pupil, roll_off: RollOff) -> Camera {
        let aperture = Aperture { f_number: 2.0, transmission: 1.0, pupil };
        Camera::new(Lens::pinhole(SIZE, 1.2), SIZE, Pose::IDENTITY, aperture, 3.0, roll_off).unwrap()
    }

    fn global(exposure_s: f64) -> Vec<Span> {
        vec![Span { start_s: 0.0, end_s: exposure_s }; 31]
    }

    fn lit_box() -> LitScene {
        let scene = box_room::box_room(1);
        scene.baked_and_lit(&BakeSettings::DRAFT, DVec3::new(0.0, 1.5, 0.0), 300.0, Illuminant::D65).unwrap()
    }

    fn turning(t_s: f64) -> Pose {
        Pose::new(DQuat::from_rotation_y(20.0 * t_s), DVec3::new(0.3 * t_s, 1.5, 0.0))
    }

    #[test]
    fn one_lux_on_white_gives_the_photons_of_the_design_at_the_centre() {
        // DESIGN states three digits; 0.5 % is asked for, and the arithmetic itself is good to f32 (1e-6).
        for (pupil, expected) in [(Pupil::ThinLens, 57.6), (Pupil::Aplanatic, 61.2)] {
            let scene = target::flat(1.0).unwrap().evenly_lit(1.0, Illuminant::D65);
            let camera = camera(pupil, RollOff::Cos4);
            let seen = render(&scene, &camera, &global(0.010), &|_| Pose::IDENTITY, sampling(16, DrawKey::root(1)));
            let centre = f64::from(seen.photons.at(22, 15));
            assert!((centre / expected - 1.0).abs() < 0.005, "{pupil:?}: {centre}");
            assert_eq!(seen.rays, 45 * 31 * 16);
        }
    }

    #[test]
    fn roll_off_follows_the_fourth_power_and_can_be_left_out() {
        let scene = target::flat(0.5).unwrap().evenly_lit(10.0, Illuminant::A);
        let seen = |roll_off| {
            let camera = camera(Pupil::ThinLens, roll_off);
            render(&scene, &camera, &global(0.01), &|_| Pose::IDENTITY, sampling(64, DrawKey::root(1))).photons
        };
        let (even, fallen) = (seen(RollOff::None), seen(RollOff::Cos4));
        let bearing = Lens::pinhole(SIZE, 1.2).unproject(glam::DVec2::new(0.0, 0.0)).unwrap();
        let expected = bearing.z * bearing.z * bearing.z * bearing.z;
        // Even light has the same sum in every pixel. The mean of cos^4 over a pixel differs from that at its centre by the second
        // derivative times 1/24 px^2, and 64 samples from their mean: together under 0.5 % at 33 px of focal length.
        assert!(even.values().iter().all(|&value| (value / even.at(0, 0) - 1.0).abs() < 1e-5));
        let ratio = f64::from(fallen.at(0, 0) / even.at(0, 0));
        assert!((ratio / expected - 1.0).abs() < 0.005, "{ratio} {expected}");
    }

    #[test]
    fn every_level_and_any_number_of_threads_give_the_same_photons() {
        let (scene, camera) = (lit_box(), camera(Pupil::ThinLens, RollOff::Cos4));
        let shutter: Vec<Span> = (0..31).map(|row| Span { start_s: 1e-3 * f64::from(row), end_s: 0.04 }).collect();
        let seen = || render(&scene, &camera, &shutter, &turning, sampling(3, DrawKey::root(7)));
        let first = seen();
        assert!(first.photons.values().iter().all(|&value| value > 0.0 && value.is_finite()));
        for level in [Level::Baseline, Level::Avx2, Level::Avx512] {
            limit(level);
            assert_eq!(seen().photons, first.photons, "{level:?}");
        }
        #[cfg(feature = "parallel")]
        {
            let one = rayon::ThreadPoolBuilder::new().num_threads(1).build().unwrap();
            let other = one.install(seen);
            assert_eq!(other.photons, first.photons);
            assert_eq!(other.render_variance_ratio.to_bits(), first.render_variance_ratio.to_bits());
        }
    }

    #[test]
    fn no_pixel_leaves_the_bounds_that_the_planner_is_told() {
        let (scene, camera) = (lit_box(), camera(Pupil::ThinLens, RollOff::None));
        let bounds = scene.exitance_bounds();
        let per_lux = camera.photons_per_lux_s(scene.illuminant());
        let photons = |lux: [f64; BANDS]| 0.01 * lux.iter().zip(per_lux).map(|(lux, per)| lux * per).sum::<f64>();
        let most = photons(std::array::from_fn(|band| bounds.greatest[band].max(bounds.emitted[band])));
        let mut tried = 0;
        for turn in 0..4 {
            let pose = Pose::new(DQuat::from_rotation_y(1.5 * f64::from(turn)), DVec3::new(0.0, 1.5, 0.0));
            let seen =
                render(&scene, &camera, &global(0.01), &|_| pose, sampling(4, DrawKey::root(turn.try_into().unwrap())));
            for &value in seen.photons.values() {
                // Some twenty roundings of f32 between the bound and the pixel.
                let value = f64::from(value);
                assert!(
                    value <= most * (1.0 + 2e-6) && value >= photons(bounds.least) * (1.0 - 2e-6),
                    "{value} of {most}"
                );
                tried += 1;
            }
        }
        assert_eq!(tried, 4 * 45 * 31);
    }

    #[test]
    fn the_stated_render_variance_is_no_less_than_what_two_renders_differ_by() {
        let (scene, camera) = (lit_box(), camera(Pupil::ThinLens, RollOff::None));
        let seen = |seed| render(&scene, &camera, &global(0.02), &turning, sampling(8, DrawKey::root(seed)));
        let (a, b) = (seen(1), seen(2));
        let mut ratio = 0.0;
        for (x, y) in a.photons.values().iter().zip(b.photons.values()) {
            ratio += f64::from((x - y) * (x - y) / (x + y));
        }
        ratio /= 45.0 * 31.0;
        // Half the squared difference is one estimate of the variance, and half the sum one of the mean. Between 1,395 pixels its relative
        // standard error is about sqrt(2 / 1395) = 4 % times the spread of their variances (some 2): 4 SE are 0.3.
        assert!(ratio < 1.3 * a.render_variance_ratio, "{ratio} against {}", a.render_variance_ratio);
        assert!(ratio > 0.02 * a.render_variance_ratio, "{ratio} against {}", a.render_variance_ratio);
    }
}
