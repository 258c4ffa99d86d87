//! Light from beyond all surfaces, by direction. Computes the radiance along any direction, and the directions that a bake samples, from an
//! equirectangular picture or a sky made by `sky`.
//!
//! The middle column of the picture lies towards -z, columns go to the right as seen from inside (the right edge of the middle's half
//! is +x), the top row is +y. For the bake the light is split at a few times its mean: what is brighter (the sun, lamps, windows) is
//! aimed at, with the same directions from every sample and the same power in each, so one bright texel makes no bright speck;
//! the rest is bounded, and is sampled by random rays.

use std::f32::consts::PI;

use super::chance;
use super::hashing::hash_floats;
use super::light::{BANDS, Bands, luminance, with_infrared};
use super::vectors::{dot, sub, unit};
use crate::error::Error;
use crate::num::{f32_from_u32, f32_nearest, f64_from_usize, i32_truncated_f32, index, u32_from};

/// Light is aimed at where it is brighter than this many times the mean over all directions.
const AIMED_OVER_MEAN: f64 = 4.0;

/// Columns and rows of the picture that bounced rays look up: 5.6 degrees, about the distance between such rays.
const SOFT_SIZE: [u32; 2] = [64, 32];

/// What lies within this angle of the brightest texel is one source, in radians: 2 degrees, more than a sun's glare in a picture of
/// moderate size.
const COMPACT_RAD: f32 = 0.035;

/// Angular radius of the sun in radians: 0.265 degrees.
pub const SUN_RADIUS: f64 = 0.265 * std::f64::consts::PI / 180.0;

/// Points of a picture, the top row first.
#[derive(Clone, Debug, PartialEq)]
struct PointMap {
    width: u32,
    height: u32,
    texels: Vec<Bands>,
}

/// The sun's disc.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Sun {
    /// Unit vector towards it.
    pub direction: [f32; 3],
    /// Irradiance of a surface that faces it.
    pub normal_irradiance: Bands,
}

/// Light that arrives from one direction: radiance times solid angle.
#[derive(Clone, Copy, Debug)]
pub struct DistantLight {
    /// Unit vector towards it.
    pub direction: [f32; 3],
    /// Irradiance of a surface that faces it.
    pub normal_irradiance: Bands,
}

/// Radiance by direction, in the scene's own units.
#[derive(Clone, Debug, PartialEq)]
pub struct Environment {
    map: PointMap,
    soft: PointMap,
    /// Power of what is aimed at: sums over whole rows, then within each row.
    row_sums: Vec<f64>,
    within_rows: Vec<f64>,
    aimed_over: f64,
    sun: Option<Sun>,
    yaw: f32,
}

impl Environment {
    /// Takes linear sRGB texels, the top row first, turned by `yaw_deg` to the right. Texels below zero, which resampling leaves beside
    /// bright lights, become black. Fails on a picture that is not twice as wide as high, a texel that is not finite, or no light at all.
    pub fn from_texels(name: &str, width: u32, texels: &[[f32; 3]], yaw_deg: f64) -> Result<Self, Error> {
        let refuse = |reason: String| Error::Content { file: name.to_owned(), reason };
        let height = width / 2;
        if width < 4 || !width.is_multiple_of(2) || texels.len() != index(width) * index(height) {
            let rows = texels.len() / index(width.max(1));
            let reason = format!("{width} x {rows} px; use an equirectangular picture, twice as wide as high");
            return Err(refuse(reason));
        }
        if let Some(bad) = texels.iter().position(|texel| !texel.iter().all(|band| band.is_finite() && *band < 1e30)) {
            let (row, column) = (bad / index(width), bad % index(width));
            let reason = format!("row {row}, column {column} is {:?}; use finite numbers", texels[bad]);
            return Err(refuse(reason));
        }
        let texels: Vec<Bands> = texels.iter().map(|texel| with_infrared(texel.map(|band| band.max(0.0)))).collect();
        if !texels.iter().any(|texel| luminance(texel.map(f64::from)) > 0.0) {
            return Err(refuse("it is black; use a picture with light".to_owned()));
        }
        Ok(Self::of(PointMap { width, height, texels }, None, yaw_deg))
    }

    /// A sky by code.
    pub(super) fn from_sky(size: [u32; 2], texels: Vec<Bands>, sun: Option<Sun>) -> Self {
        Self::of(PointMap { width: size[0], height: size[1], texels }, sun, 0.0)
    }

    /// Reads an OpenEXR picture with channels R, G and B, or Y.
    #[cfg(feature = "exr")]
    pub fn from_exr(name: &str, bytes: &[u8], yaw_deg: f64) -> Result<Self, Error> {
        let channels = crate::picture::from_exr(name, bytes)?;
        let plane = |wanted: &str| channels.iter().find(|channel| channel.name == wanted).map(|channel| &channel.plane);
        let grey = plane("Y");
        let (Some(red), Some(green), Some(blue)) = (plane("R").or(grey), plane("G").or(grey), plane("B").or(grey))
        else {
            let names: Vec<&str> = channels.iter().map(|channel| channel.name.as_str()).collect();
            let reason = format!("it has channels {}; use R, G and B, or Y", names.join(", "));
            return Err(Error::Content { file: name.to_owned(), reason });
        };
        let bands = red.values().iter().zip(green.values()).zip(blue.values());
        let texels: Vec<[f32; 3]> = bands.map(|((&red, &green), &blue)| [red, green, blue]).collect();
        Self::from_texels(name, red.size().width_px, &texels, yaw_deg)
    }

    fn of(map: PointMap, sun: Option<Sun>, yaw_deg: f64) -> Self {
        let mean = map.mean_luminance();
        let aimed_over = AIMED_OVER_MEAN * mean;
        let soft = map.softened(aimed_over);
        let (width, height) = (index(map.width), index(map.height));
        let (mut row_sums, mut within_rows) = (Vec::with_capacity(height), Vec::with_capacity(width * height));
        let mut total = 0.0;
        for row in 0..height {
            let (solid, mut sum) = (map.solid_angle(row), 0.0);
            for texel in &map.texels[row * width..(row + 1) * width] {
                let bright = luminance(texel.map(f64::from));
                sum += crate::num::greater(bright - aimed_over, 0.0) * solid;
                within_rows.push(sum);
            }
            total += sum;
            row_sums.push(total);
        }
        let yaw = f32_nearest(yaw_deg.to_radians());
        Self { map, soft, row_sums, within_rows, aimed_over, sun, yaw }
    }

    /// Radiance along a direction of unit length, the sun's disc included: bilinear between texels.
    pub fn radiance(&self, direction: [f32; 3]) -> Bands {
        let mut radiance = self.map.at(self.turned(direction));
        if let Some(sun) = self.sun.filter(|sun| sun.covers(direction)) {
            for band in 0..BANDS {
                radiance[band] += sun.normal_irradiance[band] / f32_nearest(sun_solid_angle());
            }
        }
        radiance
    }

    /// The part of the radiance that is not aimed at, averaged over a few degrees.
    pub fn soft_radiance(&self, direction: [f32; 3]) -> Bands {
        self.soft.at(self.turned(direction))
    }

    /// Greatest radiance of each band.
    pub fn greatest(&self) -> Bands {
        let greatest = self.extreme(0.0, f32::max);
        let disc =
            self.sun.map_or([0.0; BANDS], |sun| sun.normal_irradiance.map(|e| e / f32_nearest(sun_solid_angle())));
        std::array::from_fn(|band| greatest[band] + disc[band])
    }

    /// Least radiance of each band.
    pub fn least(&self) -> Bands {
        self.extreme(f32::MAX, f32::min)
    }

    /// What a choice between two values leaves of all texels in each band.
    fn extreme(&self, start: f32, choose: fn(f32, f32) -> f32) -> Bands {
        let chosen = |so_far: Bands, texel: &Bands| std::array::from_fn(|band| choose(so_far[band], texel[band]));
        self.map.texels.iter().fold([start; BANDS], chosen)
    }

    /// Directions that a bake sends shadow rays to, source by source: a share of `count` for the sun's disc, and `count` for the bright
    /// parts of the picture, each with the same power, of which those around the brightest are one source. None where nothing stands out.
    pub fn distant_lights(&self, count: usize) -> Vec<Vec<DistantLight>> {
        let mut sources = Vec::new();
        if let Some(sun) = self.sun {
            sources.push(sun.points(count / 4).collect());
        }
        let total = self.row_sums.last().copied().unwrap_or(0.0);
        if total > 0.0 {
            let brightest = self.brightest();
            let (around, others) =
                (0..count).map(|number| self.distant_light(number, count, total)).partition(|light| {
                    let apart = sub(light.direction, brightest);
                    dot(apart, apart) <= COMPACT_RAD * COMPACT_RAD
                });
            sources.extend([around, others]);
        }
        sources
    }

    /// The direction of the brightest texel, the first of equals.
    fn brightest(&self) -> [f32; 3] {
        let bright = |texel: &Bands| luminance(texel.map(f64::from));
        let (mut brightest, mut most) = (0, -1.0);
        for (number, texel) in self.map.texels.iter().enumerate() {
            if bright(texel) > most {
                (brightest, most) = (number, bright(texel));
            }
        }
        let width = index(self.map.width);
        let middle = |at: usize| f64_from_usize(at) + 0.5;
        let (u, v) =
            (middle(brightest % width) / f64_from_usize(width), middle(brightest / width) / f64::from(self.map.height));
        self.direction(u, v)
    }

    /// The direction of a number: its row by strata of power, its column by a sequence of the golden ratio.
    fn distant_light(&self, number: usize, count: usize, total: f64) -> DistantLight {
        let width = index(self.map.width);
        let share = (f64_from_usize(number) + 0.5) / f64_from_usize(count) * total;
        let row = self.row_sums.partition_point(|&sum| sum <= share).min(self.row_sums.len() - 1);
        let before = if row == 0 { 0.0 } else { self.row_sums[row - 1] };
        let sums = &self.within_rows[row * width..(row + 1) * width];
        let in_row = sums[width - 1];
        let across = f64_from_usize(number) * 0.618_033_988_749_895;
        let wanted = (across - across.floor()) * in_row;
        let column = sums.partition_point(|&sum| sum <= wanted).min(width - 1);
        let left = if column == 0 { 0.0 } else { sums[column - 1] };
        // The points within a texel are as even as the strata that led to it.
        let part = |of: f64, whole: f64| if whole > 0.0 { (of / whole).clamp(0.0, 1.0) } else { 0.5 };
        let x = f64_from_usize(column) + part(wanted - left, sums[column] - left);
        let y = f64_from_usize(row) + part(share - before, in_row);
        let texel = self.map.texels[row * width + column].map(f64::from);
        let power = total / f64_from_usize(count) / luminance(texel);
        let direction = self.direction(x / f64_from_usize(width), y / f64::from(self.map.height));
        DistantLight { direction, normal_irradiance: texel.map(|band| f32_nearest(band * power)) }
    }

    /// The direction at shares u of the width and v of the height.
    fn direction(&self, u: f64, v: f64) -> [f32; 3] {
        let azimuth = 2.0 * std::f64::consts::PI * (u - 0.5) + f64::from(self.yaw);
        let (sin, cos) = libm::sincos(std::f64::consts::PI * v);
        let (sin_azimuth, cos_azimuth) = libm::sincos(azimuth);
        [sin * sin_azimuth, cos, -sin * cos_azimuth].map(f32_nearest)
    }

    /// Shares of width and height at a direction.
    fn turned(&self, [x, y, z]: [f32; 3]) -> [f32; 2] {
        let azimuth = libm::atan2f(x, -z) - self.yaw;
        let u = 0.5 + azimuth / (2.0 * PI);
        [u - u.floor(), libm::acosf(y.clamp(-1.0, 1.0)) / PI]
    }

    /// Adds all that a bake depends on.
    pub(super) fn hash_into(&self, hasher: &mut blake3::Hasher) {
        hasher.update(&self.map.width.to_le_bytes());
        let sun = self.sun.map_or([0.0; 7], |sun| {
            let ([x, y, z], [r, g, b, n]) = (sun.direction, sun.normal_irradiance);
            [x, y, z, r, g, b, n]
        });
        hash_floats(hasher, &sun);
        hash_floats(hasher, &[self.yaw]);
        let numbers: Vec<f32> = self.map.texels.iter().flatten().copied().collect();
        hash_floats(hasher, &numbers);
    }
}

/// The sun's disc has at least this many points, which are as many steps in a penumbra, each 6 % of it.
const SUN_POINTS_MIN: usize = 16;

fn sun_solid_angle() -> f64 {
    // 2 pi (1 - cos r) without cancellation.
    let half = libm::sin(0.5 * SUN_RADIUS);
    4.0 * std::f64::consts::PI * half * half
}

impl Sun {
    fn covers(&self, direction: [f32; 3]) -> bool {
        // The chord, because cosines near 1 have too few digits in f32.
        let apart = sub(direction, self.direction);
        let chord = 2.0 * libm::sin(0.5 * SUN_RADIUS);
        dot(apart, apart) <= f32_nearest(chord * chord)
    }

    /// Points of equal light on the disc, at least 16: a spiral of the golden angle (Vogel 1979).
    pub(super) fn points(&self, count: usize) -> impl Iterator<Item = DistantLight> + use<> {
        let count = count.max(SUN_POINTS_MIN);
        let sides = chance::frame(self.direction);
        let light = self.normal_irradiance.map(|band| band / f32_nearest(f64_from_usize(count)));
        let towards = self.direction;
        (0..count).map(move |number| {
            let radius = SUN_RADIUS * ((f64_from_usize(number) + 0.5) / f64_from_usize(count)).sqrt();
            let (sin, cos) = libm::sincos(f64_from_usize(number) * 2.399_963_229_728_653);
            let local = [radius * cos, radius * sin, 1.0].map(f32_nearest);
            let direction = chance::turned(local, &sides, towards);
            let direction = unit(direction).expect("a direction near the sun's has a length");
            DistantLight { direction, normal_irradiance: light }
        })
    }
}

impl PointMap {
    /// Solid angle of a texel of a row.
    fn solid_angle(&self, row: usize) -> f64 {
        let edge = |row: usize| libm::cos(std::f64::consts::PI * f64_from_usize(row) / f64::from(self.height));
        2.0 * std::f64::consts::PI / f64::from(self.width) * (edge(row) - edge(row + 1))
    }

    /// Over all directions.
    fn mean_luminance(&self) -> f64 {
        let width = index(self.width);
        let mut sum = 0.0;
        for (number, texel) in self.texels.iter().enumerate() {
            sum += luminance(texel.map(f64::from)) * self.solid_angle(number / width);
        }
        sum / (4.0 * std::f64::consts::PI)
    }

    /// The part below a luminance, averaged over the texels of a coarser picture.
    fn softened(&self, aimed_over: f64) -> Self {
        let [width, height] = [SOFT_SIZE[0].min(self.width), SOFT_SIZE[1].min(self.height)];
        let mut sums = vec![([0.0_f64; BANDS], 0.0_f64); index(width) * index(height)];
        for row in 0..self.height {
            let solid = self.solid_angle(index(row));
            for column in 0..self.width {
                let texel = self.texels[index(row * self.width + column)].map(f64::from);
                let bright = luminance(texel);
                let kept = if bright > aimed_over { aimed_over / bright } else { 1.0 };
                let soft_texel = (row * height / self.height) * width + column * width / self.width;
                let (sum, weight) = &mut sums[index(soft_texel)];
                for band in 0..BANDS {
                    sum[band] += texel[band] * kept * solid;
                }
                *weight += solid;
            }
        }
        let texels = sums.into_iter().map(|(sum, weight)| sum.map(|band| f32_nearest(band / weight))).collect();
        Self { width, height, texels }
    }

    /// Bilinear at shares of width and height: around the seam, and across the poles to the opposite meridian.
    fn at(&self, [u, v]: [f32; 2]) -> Bands {
        let (x, y) = (u * f32_from_u32(self.width) - 0.5, v * f32_from_u32(self.height) - 0.5);
        let (left, above) = (x.floor(), y.floor());
        let (fx, fy) = (x - left, y - above);
        let (column, row) = (i32_truncated_f32(left), i32_truncated_f32(above));
        let corner = |column: i32, row: i32| &self.texels[self.texel_index(column, row)];
        let (a, b) = (corner(column, row), corner(column + 1, row));
        let (c, d) = (corner(column, row + 1), corner(column + 1, row + 1));
        std::array::from_fn(|band| {
            let over = a[band] + (b[band] - a[band]) * fx;
            let under = c[band] + (d[band] - c[band]) * fx;
            over + (under - over) * fy
        })
    }

    fn texel_index(&self, column: i32, row: i32) -> usize {
        let [width, height] = [self.width, self.height].map(|edge| i32::try_from(edge).unwrap_or(i32::MAX));
        let (row, half) = match row {
            row if row < 0 => (-1 - row, width / 2),
            row if row >= height => (2 * height - 1 - row, width / 2),
            row => (row, 0),
        };
        let column = (column + half).rem_euclid(width);
        usize::try_from(row.clamp(0, height - 1) * width + column).expect("both are at least 0")
    }
}

/// Texels of a picture of this size, from a function of the direction.
pub(super) fn texels_of([width, height]: [u32; 2], radiance: impl Fn([f64; 3]) -> Bands) -> Vec<Bands> {
    let mut texels = Vec::with_capacity(index(width) * index(height));
    for row in 0..height {
        let (sin, cos) = libm::sincos(std::f64::consts::PI * (f64::from(row) + 0.5) / f64::from(height));
        for column in 0..width {
            let turn = (f64::from(column) + 0.5) / f64::from(width) - 0.5;
            let (sin_azimuth, cos_azimuth) = libm::sincos(2.0 * std::f64::consts::PI * turn);
            texels.push(radiance([sin * sin_azimuth, cos, -sin * cos_azimuth]));
        }
    }
    assert!(u32_from(texels.len()) == width * height);
    texels
}

#[cfg(test)]
mod tests;
