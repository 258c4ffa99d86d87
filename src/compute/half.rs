//! Halves the width and height of a picture: the next octave.

use super::word::Word;
use crate::num::index;
use crate::plane::Plane;
use crate::simd::kernel;
use crate::units::Size;
use crate::words::{HalfScaleMean, rounded};

/// Sides of the next octave: halves, rounded down.
pub(crate) fn half_size(size: Size) -> Size {
    Size { width_px: size.width_px / 2, height_px: size.height_px / 2 }
}

/// Means of two by two pixels, rounded half up; an odd last row or column is left out.
pub fn half_scale<W: Word>(picture: &Plane<W>) -> Plane<W> {
    let mut half = Plane::filled(half_size(picture.size()), W::default());
    if half.size().pixel_count() > 0 {
        halve(picture, &mut half);
    }
    half
}

kernel! {
    fn halve<'a, W: Word>(picture: &'a Plane<W>, half: &'a mut Plane<W>) {
        let columns = index(half.size().width_px);
        for y in 0..half.height_px() {
            let (upper, lower) = (&picture.row(2 * y)[..2 * columns], &picture.row(2 * y + 1)[..2 * columns]);
            let pairs = upper.as_chunks::<2>().0.iter().zip(lower.as_chunks::<2>().0);
            for (out, (&[a, b], &[c, d])) in half.row_mut(y).iter_mut().zip(pairs) {
                let mean = HalfScaleMean::from_bits(a.number() + b.number() + c.number() + d.number());
                *out = W::low(rounded(mean));
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_odd_last_row_and_column_are_left_out_and_means_round_half_up() {
        let picture = Plane::from_values(
            Size { width_px: 5, height_px: 3 },
            vec![0, 1, 255, 255, 9, 1, 0, 255, 255, 9, 7, 7, 7, 7, 7],
        );
        let half = half_scale::<u8>(&picture);
        assert_eq!(half, Plane::from_values(Size { width_px: 2, height_px: 1 }, vec![1, 255]));
        assert_eq!(half_scale::<u16>(&Plane::filled(Size { width_px: 4, height_px: 2 }, 65_535)).values(), [65_535; 2]);
        assert_eq!(half_scale::<u8>(&Plane::filled(Size { width_px: 1, height_px: 9 }, 3)).values(), [0_u8; 0]);
    }
}
