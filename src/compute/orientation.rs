//! Orientation of a corner, in turns, by the intensity centroid of a disc of its smoothed patch (Rosin 1999).

use super::patch::{Patch, RADIUS_PX, SIDE, STRIDE};
use super::word::Word;
use crate::num::{low_u8, u32_from};
use crate::words::{Slope, SlopeSide, Turns};

/// Bits of `tan((2k + 1) pi / 256)`, rounded: the slopes half-way between neighbouring angles of the first octant.
const SLOPE_BITS: [u32; 32] = [
    804, 2414, 4026, 5644, 7268, 8901, 10545, 12202, 13874, 15564, 17273, 19005, 20762, 22546, 24360, 26208, 28093,
    30018, 31986, 34002, 36071, 38196, 40382, 42636, 44963, 47369, 49863, 52451, 55144, 57950, 60880, 63947,
];

/// The direction of (x, y), from +x towards +y, rounded to the nearest; (0, 0) points to 0.
///
/// A first octant's slope is compared with 32 constants. The error is half a step (1/512 turn) plus the rounding of a
/// constant, under 2e-6 of a turn; on a boundary the higher step within the octant is taken.
pub fn angle_of(x: i32, y: i32) -> Turns {
    let (x_size, y_size) = (x.unsigned_abs(), y.unsigned_abs());
    let (long, short) = (x_size.max(y_size), x_size.min(y_size));
    if long == 0 {
        return Turns::ZERO;
    }
    let above = |slope: Slope| SlopeSide::from(short) >= SlopeSide::from(slope).wrapping_mul_int(long.into());
    let steps = u32_from(SLOPE_BITS.partition_point(|&bits| above(Slope::from_bits(bits))));
    let quarter = if y_size > x_size { 64 - steps } else { steps };
    let turn = match (x < 0, y < 0) {
        (false, false) => quarter,
        (true, false) => 128 - quarter,
        (true, true) => 128 + quarter,
        (false, true) => 256 - quarter,
    };
    Turns::from_bits(low_u8(turn))
}

/// An angle rounded to the given number of bits (half a step up, and round again at a whole turn). 1 to 8 bits.
pub fn rounded_angle(angle: Turns, bits: u32) -> Turns {
    let cut = 8 - bits.min(8);
    let half = (1_u32 << cut) >> 1;
    Turns::from_bits(low_u8((u32::from(angle.to_bits()) + half) >> cut << cut))
}

/// First moments of the disc about its middle, to the right and down: at most 13 x 529 x 65,535 in size, so 32 bits hold them.
///
/// Columns and weighted columns are summed first, so every row is a few vector operations; a column's moment is at most 91
/// words of either sign, which a lane of two words' width holds.
#[inline(always)]
pub fn moments<W: Word>(patch: &Patch<W>) -> (i32, i32) {
    let (mut sums, mut weighted) = ([W::Moment::default(); STRIDE], [W::Moment::default(); STRIDE]);
    for ((values, inside), y_offset) in patch.rows().iter().zip(&DISC).zip(-13_i8..) {
        let weight = W::Moment::from(y_offset);
        for i in 0..STRIDE {
            let value = values[i].moment() * W::Moment::from(inside[i]);
            sums[i] = sums[i] + value;
            weighted[i] = weighted[i] + value * weight;
        }
    }
    let (mut x_moment, mut y_moment) = (0_i32, 0_i32);
    for ((&sum, &weighted), x_offset) in sums.iter().zip(&weighted).zip(-13_i32..) {
        let (sum, weighted): (i32, i32) = (sum.into(), weighted.into());
        x_moment += sum * x_offset;
        y_moment += weighted;
    }
    (x_moment, y_moment)
}

pub(crate) fn disc_pixels() -> u64 {
    DISC.iter().flatten().map(|&inside| u64::from(inside != 0)).sum()
}

/// 1 inside the disc and 0 outside, by rows.
static DISC: [[i8; STRIDE]; SIDE] = disc();

#[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap)] // Constants under 32.
const fn disc() -> [[i8; STRIDE]; SIDE] {
    let mut rows = [[0; STRIDE]; SIDE];
    let mut y = 0;
    while y < SIDE {
        let mut x = 0;
        while x < SIDE {
            let (dx, dy) = (x as i32 - RADIUS_PX as i32, y as i32 - RADIUS_PX as i32);
            if dx * dx + dy * dy <= (RADIUS_PX * RADIUS_PX) as i32 {
                rows[y][x] = 1;
            }
            x += 1;
        }
        y += 1;
    }
    rows
}

#[cfg(test)]
mod tests {
    #![allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)] // Test pictures from small numbers.
    use super::*;
    use crate::compute::fast::Corner;
    use crate::plane::Plane;

    #[test]
    fn a_rounded_angle_is_the_nearest_step_and_the_last_half_step_is_a_whole_turn() {
        for bits in 1..=8 {
            let step = 256 >> bits;
            for angle in 0..=255_u8 {
                let found = i32::from(rounded_angle(Turns::from_bits(angle), bits).to_bits());
                let off = (found - i32::from(angle) + 384).rem_euclid(256) - 128;
                assert!(found % step == 0 && 2 * off.abs() <= step, "{angle} to {bits} bits is {found}");
            }
        }
        assert_eq!([252, 251, 4, 3].map(|angle| rounded_angle(Turns::from_bits(angle), 5).to_bits()), [0, 248, 8, 0]);
    }

    #[test]
    fn the_angle_is_the_nearest_of_256_but_for_two_millionths_of_a_turn() {
        let mut tried = 0;
        let mut worst_turns = 0.0_f64;
        for x in (-2_000_000..=2_000_000).step_by(39_989).chain([-3, -1, 0, 1, 2]) {
            for y in (-2_000_000..=2_000_000).step_by(40_009).chain([-2, -1, 0, 1, 3]) {
                if x == 0 && y == 0 {
                    continue;
                }
                let exact = libm::atan2(f64::from(y), f64::from(x)) / std::f64::consts::TAU;
                let error = (f64::from(angle_of(x, y)) - exact).rem_euclid(1.0);
                let error = if error > 0.5 { 1.0 - error } else { error };
                worst_turns = if error > worst_turns { error } else { worst_turns };
                tried += 1;
            }
        }
        assert!(tried > 10_000, "tried {tried}");
        // Half a step is 1/512; a constant is off by half of 2^-16 in slope, over 2 pi: 1.2e-6 of a turn.
        assert!(worst_turns <= 1.0 / 512.0 + 2e-6, "worst error {worst_turns} turns");
        assert_eq!(
            [(1, 0), (1, 1), (0, 1), (-1, 0), (0, -1), (1, -1)].map(|(x, y)| angle_of(x, y).to_bits()),
            [0, 32, 64, 128, 192, 224]
        );
    }

    #[test]
    fn the_slopes_are_the_rounded_tangents() {
        for (k, &slope) in SLOPE_BITS.iter().enumerate() {
            let exact = 65_536.0 * libm::tan((2.0 * k as f64 + 1.0) * std::f64::consts::PI / 256.0);
            assert_eq!(f64::from(slope), libm::round(exact), "slope {k}");
        }
    }

    #[test]
    fn a_ramp_points_where_it_rises() {
        let size = crate::units::Size { width_px: 40, height_px: 40 };
        let centre = Corner { x_px: 20, y_px: 20, score: 0 };
        assert_eq!(disc_pixels(), 529);
        let mut tried = 0;
        for step in 0..256_u32 {
            let (sine, cosine) = libm::sincos(f64::from(step) * std::f64::consts::TAU / 256.0);
            let value = |i: usize| {
                let (x, y) = ((i % 40) as f64 - 20.0, (i / 40) as f64 - 20.0);
                libm::round(128.0 + 4.0 * (x * cosine + y * sine)) as u8
            };
            let picture = Plane::from_values(size, (0..1600).map(value).collect());
            let (x, y) = moments(&Patch::around(&picture, &centre));
            let wide = moments(&Patch::around(&picture.map(|value| u16::from(value) * 257), &centre));
            assert_eq!(wide, (257 * x, 257 * y));
            let found = angle_of(x, y).to_bits();
            let off = (u32::from(found) + 256 - step) % 256;
            // Rounded values move the centroid's direction by far less than a step, so one step either way is enough.
            assert!(off <= 1 || off == 255, "direction {step}, found {found}");
            tried += 1;
        }
        assert_eq!(tried, 256);
    }
}
