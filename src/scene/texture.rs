//! Colour pictures on surfaces. Enters: 8-bit sRGB texels. Leaves: linear reflectance, prefiltered to a footprint.
//!
//! Texels are kept as linear 16-bit numbers, so that averaging for the mip chain is done in light, not in code values.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::light::{BANDS, Bands};
use crate::num::{f32_from_u32, f32_nearest, i32_truncated_f32, index, u32_from, u32_truncated};

/// What lies beyond the edge of a picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub enum Wrap {
    /// The picture again.
    #[default]
    Repeat,
    /// The picture again, turned over every other time.
    Mirror,
    /// The texel at the edge.
    Clamp,
}

#[derive(Clone, Debug, PartialEq)]
struct Level {
    width: u32,
    height: u32,
    /// Linear red, green, blue and near infrared, row-major, the top row first; 65,535 is 1.
    texels: Vec<[u16; 4]>,
}

/// A picture with its mip chain.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    levels: Vec<Level>,
    wrap: [Wrap; 2],
    /// One over the finest level's width and height.
    per_size: [f32; 2],
}

const ONE: f32 = 65_535.0;

/// Look-ups along the longer axis of a footprint at most.
pub const TAPS_MAX: u32 = 8;

/// What a look-up averages over: an ellipse, as places in a row and a level of the mip chain. Lengths are texels of the finest level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// From the point that is asked for to the ellipse's middle.
    pub shift_texels: [f32; 2],
    /// From place to place.
    pub step_texels: [f32; 2],
    /// Places, 1 to `TAPS_MAX`.
    pub taps: u32,
    /// Area of the level's texels: 1 for the finest level, 4 for the next.
    pub area_texels2: f32,
    /// Weights of the second of two levels that are so near to 0 or 1, or nearer, are taken as that: 0 to 1/2, where one level serves.
    pub snap: f32,
}

impl Footprint {
    /// A point.
    pub const POINT: Self =
        Self { shift_texels: [0.0; 2], step_texels: [0.0; 2], taps: 1, area_texels2: 1.0, snap: 0.0 };

    /// A round one with the variance of a square of a width.
    #[inline(always)]
    pub fn round(width_texels: f32) -> Self {
        Self { area_texels2: 1.0 + width_texels * width_texels * (1.0 / 3.0), ..Self::POINT }
    }
}

/// IEC 61966-2-1: the linear light of an 8-bit sRGB code, from 0 to 1.
pub fn linear_from_srgb(code: u8) -> f64 {
    linear_from_srgb_share(f64::from(code) / 255.0)
}

/// IEC 61966-2-1: the linear light of an sRGB value, both from 0 to 1.
pub fn linear_from_srgb_share(value: f64) -> f64 {
    if value <= 0.04045 { value / 12.92 } else { libm::pow((value + 0.055) / 1.055, 2.4) }
}

impl Texture {
    /// Takes row-major sRGB codes, the top row first. Panics unless there are width times height of them, at least one.
    pub fn from_srgb(width: u32, height: u32, codes: &[[u8; 3]], wrap: [Wrap; 2]) -> Self {
        assert!(!codes.is_empty() && codes.len() == index(width) * index(height), "a picture needs its texels");
        let linear: Vec<u16> = (0..=u8::MAX).map(|code| quantised(linear_from_srgb(code) * f64::from(ONE))).collect();
        let texels = codes
            .iter()
            .map(|texel| texel.map(|code| linear[usize::from(code)]))
            .map(|[r, g, b]| [r, g, b, r])
            .collect();
        let mut levels = vec![Level { width, height, texels }];
        while let Some(next) = levels.last().and_then(halved) {
            levels.push(next);
        }
        let per_size = [1.0 / f32_from_u32(width), 1.0 / f32_from_u32(height)];
        Self { levels, wrap, per_size }
    }

    /// Width and height of the finest level in texels.
    pub fn size(&self) -> [f32; 2] {
        [f32_from_u32(self.levels[0].width), f32_from_u32(self.levels[0].height)]
    }

    /// Least and greatest linear value of each band over all texels. No filtered value lies outside.
    pub fn range(&self) -> [Bands; 2] {
        let mut range = [[u16::MAX; BANDS], [0; BANDS]];
        for texel in &self.levels[0].texels {
            for band in 0..BANDS {
                range[0][band] = range[0][band].min(texel[band]);
                range[1][band] = range[1][band].max(texel[band]);
            }
        }
        range.map(|corner| corner.map(|value| f32::from(value) / ONE))
    }

    /// Linear colour at texture coordinates (glTF: origin top left, v downwards), averaged over about `texels` texels of
    /// the finest level in each direction: bilinear within a level, linear between the two levels around the footprint.
    #[inline(always)]
    pub fn colour(&self, uv: [f32; 2], texels: f32) -> Bands {
        let level = log2_of_footprint(texels);
        let last = self.levels.len() - 1;
        let whole = i32_truncated_f32(level);
        let fine = usize::try_from(whole).unwrap_or(0);
        if fine >= last {
            return scaled(self.bilinear(last, uv));
        }
        let a = self.bilinear(fine, uv);
        let share = level - crate::num::f32_from_i32(whole);
        if share <= 0.0 {
            return scaled(a);
        }
        let b = self.bilinear(fine + 1, uv);
        let mut mixed = a;
        for band in 0..4 {
            mixed[band] = a[band] + (b[band] - a[band]) * share;
        }
        scaled(mixed)
    }

    /// Linear colour averaged over a footprint around texture coordinates.
    #[inline(always)]
    pub fn over(&self, uv: [f32; 2], footprint: &Footprint) -> Bands {
        let [per_width, per_height] = self.per_size;
        let step = [footprint.step_texels[0] * per_width, footprint.step_texels[1] * per_height];
        let back = 0.5 * (f32_from_u32(footprint.taps) - 1.0);
        let mut at = [
            uv[0] + footprint.shift_texels[0] * per_width - back * step[0],
            uv[1] + footprint.shift_texels[1] * per_height - back * step[1],
        ];
        let (fine, share) = match self.level_of(footprint.area_texels2) {
            (fine, share) if share <= footprint.snap => (fine, 0.0),
            (fine, share) if share >= 1.0 - footprint.snap => (fine + 1, 0.0),
            mixed => mixed,
        };
        let mut sum = [0.0; 4];
        for _ in 0..footprint.taps {
            let mut value = self.bilinear(fine, at);
            if share > 0.0 {
                let coarse = self.bilinear(fine + 1, at);
                for band in 0..4 {
                    value[band] += (coarse[band] - value[band]) * share;
                }
            }
            for band in 0..4 {
                sum[band] += value[band];
            }
            at = [at[0] + step[0], at[1] + step[1]];
        }
        let scale = 1.0 / (ONE * f32_from_u32(footprint.taps));
        sum.map(|value| value * scale)
    }

    /// The level whose texels have at most this area, and the weight of the next: variances of mixed levels mix as their weights do,
    /// and go as the texels' area.
    #[inline(always)]
    fn level_of(&self, area_texels2: f32) -> (usize, f32) {
        let exponent = ((area_texels2.to_bits() >> 23) & 0xFF).saturating_sub(127);
        let level = exponent / 2;
        let last = self.levels.len() - 1;
        if index(level) >= last {
            return (last, 0.0);
        }
        let own = f32_from_u32(1 << (2 * level));
        (index(level), ((area_texels2 / own - 1.0) * (1.0 / 3.0)).clamp(0.0, 1.0))
    }

    /// Four bands are one register.
    #[inline(always)]
    fn bilinear(&self, level: usize, uv: [f32; 2]) -> Bands {
        let level = &self.levels[level];
        let (x0, x1, fx) = place(uv[0], level.width, self.wrap[0]);
        let (y0, y1, fy) = place(uv[1], level.height, self.wrap[1]);
        let width = index(level.width);
        let (top, bottom) = (y0 * width, y1 * width);
        let a = floats(&level.texels[top + x0]);
        let b = floats(&level.texels[top + x1]);
        let c = floats(&level.texels[bottom + x0]);
        let d = floats(&level.texels[bottom + x1]);
        let mut out = [0.0; 4];
        for band in 0..4 {
            let above = a[band] + (b[band] - a[band]) * fx;
            let below = c[band] + (d[band] - c[band]) * fx;
            out[band] = above + (below - above) * fy;
        }
        out
    }
}

/// One load and one conversion, if it is asked for at once.
#[inline(always)]
fn floats(texel: &[u16; 4]) -> [f32; 4] {
    [f32::from(texel[0]), f32::from(texel[1]), f32::from(texel[2]), f32::from(texel[3])]
}

#[inline(always)]
fn scaled(texel: Bands) -> Bands {
    texel.map(|value| value / ONE)
}

/// Rounds to the nearest 16-bit number, ties to even.
fn quantised(value: f64) -> u16 {
    crate::num::low_u16(u32_truncated(value.round_ties_even().clamp(0.0, f64::from(u16::MAX))))
}

/// The next coarser level: each texel is the mean of the texels whose area it covers (odd sizes keep their last column or row
/// by weight), or none below one texel.
fn halved(fine: &Level) -> Option<Level> {
    if fine.width == 1 && fine.height == 1 {
        return None;
    }
    let (width, height) = (fine.width.div_ceil(2), fine.height.div_ceil(2));
    let mut texels = Vec::with_capacity(index(width) * index(height));
    for y in 0..height {
        for x in 0..width {
            let mut sum = [0_u32; 4];
            for (dx, dy) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
                let from = (2 * x + dx).min(fine.width - 1);
                let row = (2 * y + dy).min(fine.height - 1);
                let texel = fine.texels[index(row) * index(fine.width) + index(from)];
                for band in 0..4 {
                    sum[band] += u32::from(texel[band]);
                }
            }
            texels.push(sum.map(|sum| crate::num::low_u16((sum + 2) / 4)));
        }
    }
    Some(Level { width, height, texels })
}

/// Two neighbouring texel indices along one axis and the weight of the second.
#[inline(always)]
fn place(coordinate: f32, count: u32, wrap: Wrap) -> (usize, usize, f32) {
    let size = f32_from_u32(count);
    let folded = match wrap {
        Wrap::Repeat => coordinate - coordinate.floor(),
        Wrap::Mirror => {
            let period = coordinate - 2.0 * (coordinate * 0.5).floor();
            if period > 1.0 { 2.0 - period } else { period }
        }
        Wrap::Clamp => coordinate.clamp(0.0, 1.0),
    };
    let x = folded * size - 0.5;
    let base = x.floor();
    let share = x - base;
    let last = i32::try_from(count).unwrap_or(i32::MAX) - 1;
    let first = i32_truncated_f32(base);
    let second = first + 1;
    let wrapped = |at: i32| match (at < 0, at > last) {
        (false, false) => at,
        (true, _) if wrap == Wrap::Repeat => last,
        (_, true) if wrap == Wrap::Repeat => 0,
        _ => at.clamp(0, last),
    };
    let as_index = |at: i32| usize::try_from(wrapped(at)).unwrap_or(0).min(index(count) - 1);
    (as_index(first), as_index(second), share)
}

/// Level of the mip chain for a footprint in texels: the base-2 logarithm, linear between powers of two (at most 0.086 above
/// the true one's chord: a smooth blend of levels, no promise of one). 0 for a texel or less.
#[inline(always)]
fn log2_of_footprint(texels: f32) -> f32 {
    if texels > 1.0 {
        let bits = texels.to_bits();
        let exponent = f32_from_u32((bits >> 23) & 0xFF) - 127.0;
        let mantissa = f32::from_bits((bits & 0x007F_FFFF) | 0x3F80_0000);
        exponent + (mantissa - 1.0)
    } else {
        0.0
    }
}

/// Mean linear colour of a whole picture, as its coarsest level holds it.
impl Texture {
    /// The coarsest level's one texel.
    pub fn mean(&self) -> Bands {
        self.colour([0.5, 0.5], f32_nearest(1e9))
    }

    /// Bytes that tell this picture from any other, for content keys.
    pub fn hash_into(&self, hasher: &mut blake3::Hasher) {
        let level = &self.levels[0];
        hasher.update(&level.width.to_le_bytes());
        hasher.update(&level.height.to_le_bytes());
        hasher.update(&u32_from(self.wrap[0] as usize * 3 + self.wrap[1] as usize).to_le_bytes());
        let bytes: Vec<u8> = level.texels.iter().flatten().flat_map(|value| value.to_le_bytes()).collect();
        hasher.update(&bytes);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn checker(size: u32) -> Texture {
        let codes: Vec<[u8; 3]> =
            (0..size * size).map(|i| if (i % size + i / size).is_multiple_of(2) { [255; 3] } else { [0; 3] }).collect();
        Texture::from_srgb(size, size, &codes, [Wrap::Repeat; 2])
    }

    #[test]
    fn a_checkerboard_averages_in_light_not_in_code_values() {
        // Half of the texels are 65,535: the mean is 32,767.5, off by at most one rounding of 1/65,535 a level (6 levels).
        let mean = checker(64).mean()[0];
        assert!((mean - 0.5).abs() < 7.0 / ONE, "{mean}");
    }

    #[test]
    fn levels_mix_so_that_the_texels_area_is_the_one_asked_for() {
        let texture = checker(64);
        let mut tried = 0;
        for step in 0..60_u32 {
            let area = 1.0 + 0.37 * f32_from_u32(step * step);
            let (level, share) = texture.level_of(area);
            if level == 6 {
                continue;
            }
            let own = f32_from_u32(1 << (2 * level));
            // Two roundings of 2^-24 of the area and the mix.
            assert!((own * (1.0 + 3.0 * share) / area - 1.0).abs() < 3e-7, "{area}: {level} {share}");
            tried += 1;
        }
        assert!(tried > 50, "{tried}");
        assert_eq!(texture.level_of(f32::MAX), (6, 0.0));
    }

    #[test]
    fn a_row_of_taps_averages_along_its_direction_only() {
        // Columns of black and white: along u the taps meet both, along v one.
        let codes: Vec<[u8; 3]> = (0..64).map(|i| if i % 8 < 4 { [255; 3] } else { [0; 3] }).collect();
        let texture = Texture::from_srgb(8, 8, &codes, [Wrap::Repeat; 2]);
        let over = |step_texels| Footprint { step_texels, taps: 8, ..Footprint::POINT };
        let at = [1.5 / 8.0, 0.5];
        // Eight texels a step apart are every column once: their mean is half of white.
        assert!((texture.over(at, &over([1.0, 0.0]))[0] - 0.5).abs() < 1e-6);
        assert!((texture.over(at, &over([0.0, 1.0]))[0] - 1.0).abs() < 1e-6);
        let moved = Footprint { shift_texels: [4.0, 0.0], ..over([0.0, 1.0]) };
        assert!(texture.over(at, &moved)[0].abs() < 1e-6);
    }

    #[test]
    fn texel_centres_return_the_texel_and_v_runs_downwards() {
        let codes = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]];
        let texture = Texture::from_srgb(2, 2, &codes, [Wrap::Clamp; 2]);
        assert_eq!(texture.colour([0.25, 0.25], 0.0), [1.0, 0.0, 0.0, 1.0]);
        assert_eq!(texture.colour([0.75, 0.25], 0.0), [0.0, 1.0, 0.0, 0.0]);
        assert_eq!(texture.colour([0.25, 0.75], 0.0), [0.0, 0.0, 1.0, 0.0]);
    }

    #[test]
    fn every_wrap_stays_within_the_picture_for_wild_coordinates() {
        let mut tried = 0;
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            let texture = Texture::from_srgb(3, 5, &[[128; 3]; 15], [wrap; 2]);
            let grey = texture.colour([0.5, 0.5], 0.0)[0];
            for u in [-1e9, -7.3, -1.0, -0.0, 0.0, 0.999_999_94, 1.0, 2.5, 1e9, f32::MAX] {
                let colour = texture.colour([u, -u], 1.5);
                assert!((colour[0] - grey).abs() < 1e-4, "{wrap:?} at {u}: {colour:?}");
                tried += 1;
            }
        }
        assert_eq!(tried, 30);
    }
}
