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
            let row = |offset: usize| &self.picture.row(y + offset - BORDER_PX)[..width];
            weigh_rows([row(0), row(1), row(2), row(3), row(4), row(5), row(6)], &mut column);
            weigh_columns(&column, &mut self.smoothed.row_mut(y)[BORDER_PX..width - BORDER_PX]);
        }
    }
}

/// Sums of seven rows; up to 16 * 255. Slices of one length and no calls in the loop, so that it becomes vectors.
#[inline(always)]
fn weigh_rows([a, b, c, d, e, f, g]: [&[u8]; 7], sums: &mut [u16]) {
    let n = sums.len();
    let (a, b, c, d, e, f, g) = (&a[..n], &b[..n], &c[..n], &d[..n], &e[..n], &f[..n], &g[..n]);
    for x in 0..n {
        let outer = u16::from(a[x]) + u16::from(g[x]) + 2 * (u16::from(b[x]) + u16::from(f[x]));
        sums[x] = outer + 3 * (u16::from(c[x]) + u16::from(e[x])) + 4 * u16::from(d[x]);
    }
}

/// Sums of seven columns over 256, rounded half up.
#[inline(always)]
fn weigh_columns(sums: &[u16], out: &mut [u8]) {
    let n = out.len();
    let (a, b, c, d) = (&sums[..n], &sums[1..n + 1], &sums[2..n + 2], &sums[3..n + 3]);
    let (e, f, g) = (&sums[4..n + 4], &sums[5..n + 5], &sums[6..n + 6]);
    for x in 0..n {
        let sum = (a[x] + g[x]) + 2 * (b[x] + f[x]) + 3 * (c[x] + e[x]) + 4 * d[x];
        out[x] = low_u8(u32::from((sum + 128) >> 8));
    }
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
