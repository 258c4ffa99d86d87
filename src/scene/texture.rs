//! Colour pictures on surfaces. Converts 8-bit sRGB texels to linear reflectance, prefiltered to a footprint.
//!
//! Texels are kept as linear 16-bit numbers, so that averaging for the mip chain is done in light, not in code values.

mod alike;
pub mod footprint;
#[cfg(feature = "pictures")]
pub(crate) mod jpeg;
mod mip;
#[cfg(feature = "pictures")]
pub mod picture;

pub use mip::Wrap;
use mip::{COLOURS, MipLevel, Plain, chain};

use super::light::{Bands, INFRARED, with_infrared};
use crate::num::{f32_from_u32, f32_nearest, i32_truncated_f32, index, u32_from, u32_truncated};

/// A picture with its mip chain.
#[derive(Clone, Debug, PartialEq)]
pub struct Texture {
    levels: Vec<MipLevel>,
    wrap: [Wrap; 2],
    /// Width and height of the finest level, and one over them.
    size: [f32; 2],
    per_size: [f32; 2],
}

const ONE: f32 = 65_535.0;

/// Look-ups along the longer axis of a footprint at most.
pub const TAPS_MAX: u32 = 8;

/// What a look-up averages over: an ellipse, as taps in a row and a level of the mip chain. Lengths are texels of the finest level.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Footprint {
    /// From the point of the look-up to the ellipse's middle.
    pub shift_texels: [f32; 2],
    /// From tap to tap.
    pub step_texels: [f32; 2],
    /// Taps, 1 to `TAPS_MAX`.
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
        Self::from_codes(width, height, codes, wrap, |code| quantised(linear_from_srgb(code) * f64::from(ONE)))
    }

    /// As `from_srgb`, but codes are values: 255 is 1.
    pub fn from_linear(width: u32, height: u32, codes: &[[u8; 3]], wrap: [Wrap; 2]) -> Self {
        Self::from_codes(width, height, codes, wrap, |code| 257 * u16::from(code))
    }

    /// Takes the value of each code. Plain loops, because adapters of iterators and arrays are calls in the tests' build, and a
    /// scene has ten million texels.
    fn from_codes(width: u32, height: u32, codes: &[[u8; 3]], wrap: [Wrap; 2], value: impl Fn(u8) -> u16) -> Self {
        assert!(!codes.is_empty() && codes.len() == index(width) * index(height), "a picture needs its texels");
        let mut values = [0; 256];
        for code in 0..=u8::MAX {
            values[usize::from(code)] = value(code);
        }
        let mut texels = Vec::with_capacity(codes.len());
        for &[r, g, b] in codes {
            texels.push([values[usize::from(r)], values[usize::from(g)], values[usize::from(b)]]);
        }
        let levels = chain(Plain { width, height, texels }, wrap);
        Self::of_levels([width, height], levels, wrap)
    }

    fn of_levels(size: [u32; 2], levels: Vec<MipLevel>, wrap: [Wrap; 2]) -> Self {
        let size = size.map(f32_from_u32);
        Self { levels, wrap, size, per_size: size.map(|edge| 1.0 / edge) }
    }

    /// A white picture of a size that takes no memory: what footprints are found on where a material has maps without a base colour.
    pub fn white(width: u32, height: u32) -> Self {
        let white = Plain { width: 1, height: 1, texels: vec![[u16::MAX; COLOURS]] };
        let wrap = [Wrap::Repeat; 2];
        Self::of_levels([width, height], vec![white.with_rim(wrap)], wrap)
    }

    /// Width and height of the finest level in texels.
    pub fn size(&self) -> [f32; 2] {
        self.size
    }

    /// Least and greatest linear value of each band over all texels. No filtered value lies outside.
    pub fn range(&self) -> [Bands; 2] {
        let mut range = [[u16::MAX; COLOURS], [0; COLOURS]];
        // A rim repeats what is within it.
        for texel in self.levels[0].colours() {
            for colour in 0..COLOURS {
                range[0][colour] = range[0][colour].min(texel[colour]);
                range[1][colour] = range[1][colour].max(texel[colour]);
            }
        }
        range.map(|corner| with_infrared(corner.map(|value| f32::from(value) / ONE)))
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
        let (fine, share) = self.levels_of(footprint);
        let mut sum = self.taps(fine, uv, footprint);
        if share > 0.0 {
            let coarse = self.taps(fine + 1, uv, footprint);
            for band in 0..4 {
                sum[band] += (coarse[band] - sum[band]) * share;
            }
        }
        let scale = 1.0 / (ONE * f32_from_u32(footprint.taps));
        let mut mean = sum.map(|value| value * scale);
        mean[INFRARED] = mean[0];
        mean
    }

    /// Sum of one level over the taps of a footprint, without the infrared. All taps are found at once, whether asked for or not.
    #[inline(always)]
    fn taps(&self, level: usize, uv: [f32; 2], footprint: &Footprint) -> Bands {
        let level = &self.levels[level];
        let back = 0.5 * (f32_from_u32(footprint.taps) - 1.0);
        let mut first_texels = [[0; TAPS]; 2];
        let mut shares = [[0.0; TAPS]; 2];
        for axis in 0..2 {
            let step = footprint.step_texels[axis] * self.per_size[axis];
            let first = uv[axis] + footprint.shift_texels[axis] * self.per_size[axis] - back * step;
            (first_texels[axis], shares[axis]) = first_texels_of(first, step, level.size[axis], self.wrap[axis]);
        }
        let stride = level.width + 2;
        let mut from = [0; TAPS];
        for tap in 0..TAPS {
            from[tap] = first_texels[1][tap] * stride + first_texels[0][tap];
        }
        let mut sum = [0.0; 4];
        for tap in 0..index(footprint.taps).min(TAPS) {
            let value = between(&level.texels, from[tap], stride, [shares[0][tap], shares[1][tap]]);
            for band in 0..4 {
                sum[band] += value[band];
            }
        }
        sum
    }

    /// The finer level of a footprint, and the weight of the next; none where one serves.
    #[inline(always)]
    fn levels_of(&self, footprint: &Footprint) -> (usize, f32) {
        match self.level_of(footprint.area_texels2) {
            (fine, share) if share <= footprint.snap => (fine, 0.0),
            (fine, share) if share >= 1.0 - footprint.snap => (fine + 1, 0.0),
            mixed => mixed,
        }
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
        let (x0, x1, fx) = texel_pair(uv[0], level.width, self.wrap[0]);
        let (y0, y1, fy) = texel_pair(uv[1], level.height, self.wrap[1]);
        let stride = index(level.width) + 2;
        let (top, bottom) = ((y0 + 1) * stride + 1, (y1 + 1) * stride + 1);
        let [a, b, c, d] = [top + x0, top + x1, bottom + x0, bottom + x1].map(|at| level.texel(at));
        let mut out = [0.0; 4];
        for band in 0..4 {
            let above = a[band] + (b[band] - a[band]) * fx;
            let below = c[band] + (d[band] - c[band]) * fx;
            out[band] = above + (below - above) * fy;
        }
        out
    }
}

/// Taps of a row at most, as a number of lanes.
const TAPS: usize = 8;

const _: () = assert!(index(TAPS_MAX) == TAPS);

/// Bilinear between the four texels from one on, by the weights of the second column and row. The infrared is left to its caller.
#[inline(always)]
fn between(texels: &[u16], from: u32, stride: u32, [fx, fy]: [f32; 2]) -> Bands {
    let (from, stride) = (COLOURS * index(from), COLOURS * index(stride));
    // Taps are never beyond the rim; a square that ended there would be black.
    let Some(square) = texels.get(from..from + stride + 8) else { return [0.0; 4] };
    let (above, below) = (floats_of_pair(square), floats_of_pair(&square[stride..]));
    let mut pair = [0.0; 8];
    for component in 0..8 {
        pair[component] = above[component] + (below[component] - above[component]) * fy;
    }
    let mut out = [0.0; 4];
    for band in 0..4 {
        out[band] = pair[band] + (pair[COLOURS + band] - pair[band]) * fx;
    }
    out
}

/// The first two texels, and two numbers beyond.
#[inline(always)]
fn floats_of_pair(texels: &[u16]) -> [f32; 8] {
    let Some(pair) = texels.first_chunk::<8>() else { return [0.0; 8] };
    let mut out = [0.0; 8];
    for component in 0..8 {
        out[component] = f32::from(pair[component]);
    }
    out
}

/// A number to which a smaller one is added so that its whole part, rounded to the nearest, stands in the lowest bits.
pub(in crate::scene) const TO_WHOLE: f32 = 12_582_912.0;

/// Rounded to the nearest whole number, ties to even, below 2^22.
#[inline(always)]
fn whole(value: f32) -> f32 {
    (value + TO_WHOLE) - TO_WHOLE
}

/// A row of taps along one axis of a level with its rim: the first texel of each pair and the weight of the second, 0 to 1.
#[inline(always)]
fn first_texels_of(first: f32, step: f32, size: f32, wrap: Wrap) -> ([u32; TAPS], [f32; TAPS]) {
    let mut coordinates = [0.0; TAPS];
    for tap in 0..TAPS {
        coordinates[tap] = first + step * TAP_NUMBERS[tap];
    }
    match wrap {
        Wrap::Repeat => {
            for tap in 0..TAPS {
                coordinates[tap] -= whole(coordinates[tap] - 0.5);
            }
        }
        Wrap::Mirror => {
            for tap in 0..TAPS {
                let period = coordinates[tap] - 2.0 * whole(coordinates[tap] * 0.5 - 0.5);
                coordinates[tap] = if period > 1.0 { 2.0 - period } else { period };
            }
        }
        Wrap::Clamp => {}
    }
    let (mut first_texels, mut shares) = ([0; TAPS], [0.0; TAPS]);
    for tap in 0..TAPS {
        let coordinate = if coordinates[tap] > 0.0 { coordinates[tap] } else { 0.0 };
        let coordinate = if coordinate < 1.0 { coordinate } else { 1.0 };
        // Half a texel back to the first one's middle, and one on over the rim.
        let position_texels = coordinate * size + 0.5;
        let base = (position_texels - 0.5) + TO_WHOLE;
        first_texels[tap] = base.to_bits().wrapping_sub(TO_WHOLE.to_bits());
        shares[tap] = position_texels - (base - TO_WHOLE);
    }
    (first_texels, shares)
}

const TAP_NUMBERS: [f32; TAPS] = [0.0, 1.0, 2.0, 3.0, 4.0, 5.0, 6.0, 7.0];

#[inline(always)]
fn scaled(texel: Bands) -> Bands {
    texel.map(|value| value / ONE)
}

/// Rounds to the nearest 16-bit number, ties to even.
fn quantised(value: f64) -> u16 {
    crate::num::low_u16(u32_truncated(value.round_ties_even().clamp(0.0, f64::from(u16::MAX))))
}

/// Two neighbouring texel indices along one axis and the weight of the second.
#[inline(always)]
fn texel_pair(coordinate: f32, count: u32, wrap: Wrap) -> (usize, usize, f32) {
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

    /// Bytes that identify this picture, for content keys.
    pub fn hash_into(&self, hasher: &mut blake3::Hasher) {
        let level = &self.levels[0];
        self.size.iter().for_each(|&edge| {
            hasher.update(&crate::num::u32_truncated_f32(edge).to_le_bytes());
        });
        hasher.update(&u32_from(self.wrap[0] as usize * 3 + self.wrap[1] as usize).to_le_bytes());
        // The rim follows from the rest. In one piece: hashing many blocks at once is several times as fast.
        let texels = level.colours().as_flattened();
        if cfg!(target_endian = "little") {
            hasher.update(bytemuck::cast_slice(texels));
        } else {
            for values in texels.chunks(1024) {
                hasher.update(&values.iter().flat_map(|value| value.to_le_bytes()).collect::<Vec<u8>>());
            }
        }
    }
}

#[cfg(test)]
mod tests;
