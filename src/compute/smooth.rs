//! Smoothing before the descriptor's comparisons. Enters: a picture. Leaves: the picture under a 7x7 triangle kernel.

use crate::num::low_u8;
use crate::plane::Plane;
use crate::simd::{Kernel, dispatch};

/// Pixels at each edge that the kernel does not reach; they stay as they are.
pub(crate) const BORDER_PX: usize = 3;

/// The picture weighted by (1 2 3 4 3 2 1) in both directions over 256, rounded half up; standard deviation 1.58 px.
///
/// Weights need shifts and adds only, and all sums fit 16 bits: 255 * 256 + 128 < 2^16. It is an integer kernel of a box
/// of four with itself, strong enough for the noise of 2-bit pictures.
pub(crate) fn smooth(picture: &Plane<u8>) -> Plane<u8> {
    let mut smoothed = picture.clone();
    if picture.width_px() > 2 * BORDER_PX && picture.height_px() > 2 * BORDER_PX {
        dispatch(Smooth { picture, smoothed: &mut smoothed });
    }
    smoothed
}

struct Smooth<'a> {
    picture: &'a Plane<u8>,
    smoothed: &'a mut Plane<u8>,
}

impl Kernel for Smooth<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let (width, height) = (self.picture.width_px(), self.picture.height_px());
        let mut column = vec![0_u16; width];
        for y in BORDER_PX..height - BORDER_PX {
            let rows: [&[u8]; 7] = std::array::from_fn(|row| &self.picture.row(y + row - BORDER_PX)[..width]);
            let column = &mut column[..width];
            for x in 0..width {
                column[x] = triangle(std::array::from_fn(|row| u16::from(rows[row][x])));
            }
            let inner = width - 2 * BORDER_PX;
            let taps: [&[u16]; 7] = std::array::from_fn(|tap| &column[tap..tap + inner]);
            let out = &mut self.smoothed.row_mut(y)[BORDER_PX..BORDER_PX + inner];
            for x in 0..inner {
                let sum = triangle(std::array::from_fn(|tap| taps[tap][x]));
                out[x] = low_u8(u32::from((sum + 128) >> 8));
            }
        }
    }
}

#[inline(always)]
fn triangle(v: [u16; 7]) -> u16 {
    (v[0] + v[6]) + 2 * (v[1] + v[5]) + 3 * (v[2] + v[4]) + 4 * v[3]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compute::test_pictures::noise;

    #[test]
    fn it_is_the_weighted_mean_of_the_definition() {
        const WEIGHTS: [u32; 7] = [1, 2, 3, 4, 3, 2, 1];
        let mut tried = 0;
        for (seed, width_px, height_px) in [(1, 37, 21), (2, 64, 9), (3, 7, 7), (4, 101, 8)] {
            let picture = noise(width_px, height_px, 256, seed);
            let smoothed = smooth(&picture);
            for y in 3..picture.height_px() - 3 {
                for x in 3..picture.width_px() - 3 {
                    let mut sum = 128;
                    for (dy, wy) in WEIGHTS.iter().enumerate() {
                        for (dx, wx) in WEIGHTS.iter().enumerate() {
                            sum += wx * wy * u32::from(picture.at(x + dx - 3, y + dy - 3));
                        }
                    }
                    assert_eq!(u32::from(smoothed.at(x, y)), sum / 256, "seed {seed}, ({x}, {y})");
                    tried += 1;
                }
            }
        }
        assert!(tried > 800, "tried {tried}");
    }
}
