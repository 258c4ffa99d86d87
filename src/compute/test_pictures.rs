//! Pictures that several tests of the extractor share.

use crate::draw::mix;
use crate::num::{index, low_u8, low_u32, u64_from};
use crate::plane::Plane;
use crate::units::Size;

/// Independent values below `levels`, stretched over 0 to 255.
pub(crate) fn noise(width_px: u32, height_px: u32, levels: u64, seed: u64) -> Plane<u8> {
    let size = Size { width_px, height_px };
    let value = |i: usize| low_u8(low_u32(mix(mix(seed) ^ u64_from(i)) % levels * (255 / (levels - 1))));
    Plane::from_values(size, (0..index(width_px) * index(height_px)).map(value).collect())
}

/// The sum of the seven by seven values around a pixel under these weights both ways. Beyond an edge the outermost values are repeated.
pub(crate) fn weighted_sum(picture: &Plane<u8>, weights: [u32; 7], x: usize, y: usize) -> u32 {
    let at = |coordinate: usize, offset: usize, side: usize| (coordinate + offset).saturating_sub(3).min(side - 1);
    let mut sum = 0;
    for (dy, wy) in weights.iter().enumerate() {
        for (dx, wx) in weights.iter().enumerate() {
            let (column, row) = (at(x, dx, picture.width_px()), at(y, dy, picture.height_px()));
            sum += wx * wy * u32::from(picture.at(column, row));
        }
    }
    sum
}
