//! Harris and Stephens' corner measure (1988) as a rank: a 16-bit code that orders corners.
//!
//! Gradients are 3x3 Sobel's at the 25 inner pixels of the corner's 7x7 window, their products are summed, and k is 1/16. The
//! measure spans 50 bits, so it is coded like a float: 6 bits of exponent and 10 of fraction. The rank only chooses; corners
//! are FAST's.

use super::word::Word;
use crate::num::{index, low_u16, low_u32};
use crate::plane::Plane;
use crate::words::{Significand, TraceShare};

/// Upper bits of a pixel that gradients are made of.
const BITS: u32 = 8;

/// The rank of a corner at least three pixels from the edge, of a pipeline of `bits`. Panics nearer to the edge.
///
/// Gradients are of the upper 8 bits of a pixel: they reach 1020, so sums of 25 squares have 25 bits, the measure 50, and
/// wide pipelines rank by the same multipliers.
pub fn harris_rank<W: Word>(picture: &Plane<W>, x_px: u32, y_px: u32, bits: u32) -> u16 {
    let (left, top) = (index(x_px) - 3, index(y_px) - 3);
    let rows: [&[W; 7]; 7] =
        std::array::from_fn(|row| picture.row(top + row)[left..left + 7].try_into().expect("cut to this length"));
    let at = |x: usize, y: usize| i64::from(rows[y][x].number() >> (bits - BITS));
    let (mut xx, mut yy, mut xy) = (0_i64, 0_i64, 0_i64);
    for y in 1..6 {
        for x in 1..6 {
            let column = |x: usize| at(x, y - 1) + 2 * at(x, y) + at(x, y + 1);
            let row = |y: usize| at(x - 1, y) + 2 * at(x, y) + at(x + 1, y);
            let (gx, gy) = (column(x + 1) - column(x - 1), row(y + 1) - row(y - 1));
            xx += gx * gx;
            yy += gy * gy;
            xy += gx * gy;
        }
    }
    let trace = xx + yy;
    code(xx * yy - xy * xy - TraceShare::from_bits(trace * trace).wrapping_to_num::<i64>())
}

/// Exponent and the ten bits below the leading one; 0 for what is not positive.
fn code(measure: i64) -> u16 {
    let Ok(measure) = u64::try_from(measure) else { return 0 };
    if measure == 0 {
        return 0;
    }
    let exponent = measure.ilog2();
    let aligned = if exponent >= 10 { measure >> (exponent - 10) } else { measure << (10 - exponent) };
    let significand = Significand::from_bits(low_u16(low_u32(aligned)));
    low_u16(exponent << Significand::FRAC_NBITS) | significand.frac().to_bits()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compute::test_pictures::noise;
    use crate::units::Size;

    #[test]
    fn codes_rise_with_the_measure_and_hold_eleven_of_its_bits() {
        assert_eq!([-5, 0, 1, 2, 3].map(code), [0, 0, 0, 1 << 10, 1 << 10 | 512]);
        let mut before = 0;
        for exponent in 0..50 {
            for part in 0..7_i64 {
                let measure = (1_i64 << exponent) + (1_i64 << exponent) * part / 7;
                assert!(code(measure) >= before, "{measure}");
                before = code(measure);
            }
        }
        assert_eq!(before >> 10, 49);
    }

    #[test]
    fn a_corner_ranks_above_an_edge_and_a_flat_area_has_no_rank() {
        let size = Size { width_px: 16, height_px: 16 };
        let picture = |inside: fn(usize, usize) -> bool| {
            Plane::from_values(size, (0..256).map(|i| if inside(i % 16, i / 16) { 200_u8 } else { 50 }).collect())
        };
        let (corner, edge) = (picture(|x, y| x > 7 && y > 7), picture(|x, _| x > 7));
        assert!(harris_rank(&corner, 8, 8, 8) > 10 << 10);
        assert_eq!((harris_rank(&edge, 8, 8, 8), harris_rank(&picture(|_, _| false), 8, 8, 8)), (0, 0));
    }

    #[test]
    fn the_deepest_pixels_rank_as_their_upper_eight_bits() {
        let mut most = 0;
        for seed in 0..500 {
            let picture = noise(7, 7, 2, seed);
            let rank = harris_rank(&picture, 3, 3, 8);
            assert_eq!(harris_rank(&picture.map(|value| u16::from(value) * 257), 3, 3, 16), rank, "seed {seed}");
            most = most.max(rank);
        }
        assert!(most >> 10 > 40 && most >> 10 < 50, "exponent {}", most >> 10);
    }
}
