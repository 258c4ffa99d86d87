//! Smoothing before the descriptor's comparisons: a 7x7 triangle kernel.

use fixed::traits::Fixed;

use super::word::Word;
use crate::plane::Plane;
use crate::simd::kernel;

/// Pixels at each edge that the kernel does not reach; they stay as they are.
pub(crate) const BORDER_PX: usize = 3;

/// The picture weighted by (1 2 3 4 3 2 1) in both directions over 256, rounded half up; standard deviation 1.58 px.
///
/// Weights need shifts and adds only, and sums are means with eight fraction bits: 255 + 1/2 < 2^8. It is an integer kernel of a box
/// of four with itself, strong enough for the noise of 2-bit pictures.
pub fn smooth<W: Word>(picture: &Plane<W>) -> Plane<W> {
    let mut smoothed = picture.clone();
    if picture.width_px() > 2 * BORDER_PX && picture.height_px() > 2 * BORDER_PX {
        smooth_inside(picture, &mut smoothed);
    }
    smoothed
}

kernel! {
    /// All but the border.
    fn smooth_inside<'a, W: Word>(picture: &'a Plane<W>, smoothed: &'a mut Plane<W>) {
        let (width, height) = (picture.width_px(), picture.height_px());
        let mut column = vec![W::Mean::default(); width];
        for y in BORDER_PX..height - BORDER_PX {
            let row = |offset: usize| &picture.row(y + offset - BORDER_PX)[..width];
            weigh_rows([row(0), row(1), row(2), row(3), row(4), row(5), row(6)], &mut column);
            weigh_columns(&column, &mut smoothed.row_mut(y)[BORDER_PX..width - BORDER_PX]);
        }
    }
}

/// Sums of seven rows; up to 16/256 of a word. Slices of one length and no calls in the loop, so that it becomes vectors.
#[inline(always)]
fn weigh_rows<W: Word>([a, b, c, d, e, f, g]: [&[W]; 7], sums: &mut [W::Mean]) {
    let n = sums.len();
    let (a, b, c, d, e, f, g) = (&a[..n], &b[..n], &c[..n], &d[..n], &e[..n], &f[..n], &g[..n]);
    for x in 0..n {
        let outer = a[x].share(1).wrapping_add(g[x].share(1)).wrapping_add(b[x].share(2)).wrapping_add(f[x].share(2));
        sums[x] = outer.wrapping_add(c[x].share(3)).wrapping_add(e[x].share(3)).wrapping_add(d[x].share(4));
    }
}

/// Sums of seven columns, rounded half up.
#[inline(always)]
fn weigh_columns<W: Word>(sums: &[W::Mean], out: &mut [W]) {
    let n = out.len();
    let (a, b, c, d) = (&sums[..n], &sums[1..n + 1], &sums[2..n + 2], &sums[3..n + 3]);
    let (e, f, g) = (&sums[4..n + 4], &sums[5..n + 5], &sums[6..n + 6]);
    let pair = |a: W::Mean, b: W::Mean, weight: u8| W::times(a.wrapping_add(b), weight);
    for x in 0..n {
        let outer = pair(a[x], g[x], 1).wrapping_add(pair(b[x], f[x], 2));
        let mean = outer.wrapping_add(pair(c[x], e[x], 3)).wrapping_add(W::times(d[x], 4));
        out[x] = W::rounded(mean);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compute::test_pictures::{noise, weighted_sum};

    #[test]
    fn it_is_the_weighted_mean_of_the_definition() {
        let mut tried = 0;
        for (seed, width_px, height_px) in [(1, 37, 21), (2, 64, 9), (3, 7, 7), (4, 101, 8)] {
            let picture = noise(width_px, height_px, 256, seed);
            let smoothed = smooth(&picture);
            for y in 3..picture.height_px() - 3 {
                for x in 3..picture.width_px() - 3 {
                    let mean = (weighted_sum(&picture, [1, 2, 3, 4, 3, 2, 1], x, y) + 128) / 256;
                    assert_eq!(u32::from(smoothed.at(x, y)), mean, "seed {seed}, ({x}, {y})");
                    tried += 1;
                }
            }
        }
        assert!(tried > 800, "tried {tried}");
    }
}
