//! Levels of a picture, each half as fine as the one before it, with a rim around each. Loops are plain ones, because adapters of iterators
//! and arrays are calls in the tests' build, and a scene has ten million texels.

use crate::num::{f32_from_u32, index, low_u16};
use crate::scene::light::{Bands, with_infrared};

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

/// Colours of a texel. In the near infrared it is like in red.
pub(super) const COLOURS: usize = 3;

/// Numbers of a load of two texels.
const PAIR: usize = 8;

#[derive(Clone, Debug, PartialEq)]
pub(super) struct MipLevel {
    pub width: u32,
    pub height: u32,
    /// The two as they are multiplied with.
    pub size: [f32; 2],
    /// Linear red, green and blue, row-major, the top row first; 65,535 is 1. Around the picture stands a rim of one texel, of the texels
    /// beyond its edge: so the four texels around any point are two pairs of neighbours. Flat, and with two numbers after the last texel,
    /// because a compiler turns a pair into one load only where it is eight numbers in a row.
    pub texels: Vec<u16>,
}

impl MipLevel {
    #[inline(always)]
    pub fn texel(&self, at: usize) -> Bands {
        let texel = &self.texels[COLOURS * at..COLOURS * at + COLOURS];
        with_infrared([f32::from(texel[0]), f32::from(texel[1]), f32::from(texel[2])])
    }

    /// All texels, the rim's too.
    pub fn colours(&self) -> &[[u16; COLOURS]] {
        let count = (index(self.width) + 2) * (index(self.height) + 2);
        &self.texels.as_chunks().0[..count]
    }

    /// Rows without the rim.
    #[cfg(test)]
    pub fn rows(&self) -> impl Iterator<Item = &[u16]> {
        let width = index(self.width);
        let rows = self.texels.chunks_exact(COLOURS * (width + 2)).skip(1).take(index(self.height));
        rows.map(move |row| &row[COLOURS..COLOURS * (width + 1)])
    }
}

/// A level without its rim.
pub(super) struct Plain {
    pub width: u32,
    pub height: u32,
    pub texels: Vec<[u16; COLOURS]>,
}

impl Plain {
    pub fn with_rim(&self, wrap: [Wrap; 2]) -> MipLevel {
        let Self { width, height, .. } = *self;
        let count = COLOURS * (index(width) + 2) * (index(height) + 2);
        let mut texels = Vec::with_capacity(count + PAIR - 2 * COLOURS);
        for y in 0..height + 2 {
            let row = index(within_rim(y, height, wrap[1])) * index(width);
            texels.extend(self.texels[row + index(within_rim(0, width, wrap[0]))]);
            texels.extend_from_slice(self.texels[row..row + index(width)].as_flattened());
            texels.extend(self.texels[row + index(within_rim(width + 1, width, wrap[0]))]);
        }
        texels.extend([0; PAIR - 2 * COLOURS]);
        MipLevel { width, height, size: [f32_from_u32(width), f32_from_u32(height)], texels }
    }
}

/// The texel, of `count`, at an index of a row with its rim.
fn within_rim(rimmed_index: u32, count: u32, wrap: Wrap) -> u32 {
    match (wrap, rimmed_index) {
        (Wrap::Repeat, 0) => count - 1,
        (Wrap::Repeat, rimmed_index) => (rimmed_index - 1) % count,
        (Wrap::Mirror | Wrap::Clamp, rimmed_index) => rimmed_index.saturating_sub(1).min(count - 1),
    }
}

/// All levels of a picture, down to one texel.
pub(super) fn chain(finest: Plain, wrap: [Wrap; 2]) -> Vec<MipLevel> {
    let mut levels = Vec::new();
    let mut plain = Some(finest);
    while let Some(level) = plain {
        plain = halved(&level);
        levels.push(level.with_rim(wrap));
    }
    levels
}

/// The next coarser level: each texel is the mean of the texels whose area it covers (odd sizes keep their last column or row
/// by weight), or none below one texel.
fn halved(fine: &Plain) -> Option<Plain> {
    if fine.width == 1 && fine.height == 1 {
        return None;
    }
    let (width, height) = (fine.width.div_ceil(2), fine.height.div_ceil(2));
    let mut texels = Vec::with_capacity(index(width) * index(height));
    let row = |y: u32| &fine.texels[index(y) * index(fine.width)..][..index(fine.width)];
    for y in 0..height {
        let (above, above_last) = row(2 * y).as_chunks::<2>();
        let (below, below_last) = row((2 * y + 1).min(fine.height - 1)).as_chunks::<2>();
        for (above, below) in above.iter().zip(below) {
            texels.push(mean(above, below));
        }
        for (above, below) in above_last.iter().zip(below_last) {
            texels.push(mean(&[*above; 2], &[*below; 2]));
        }
    }
    Some(Plain { width, height, texels })
}

/// Mean of two by two texels.
#[inline(always)]
fn mean(above: &[[u16; COLOURS]; 2], below: &[[u16; COLOURS]; 2]) -> [u16; COLOURS] {
    let mut mean = [0; COLOURS];
    for band in 0..COLOURS {
        let sum = u32::from(above[0][band]) + u32::from(above[1][band]);
        mean[band] = low_u16((sum + u32::from(below[0][band]) + u32::from(below[1][band]) + 2) / 4);
    }
    mean
}
