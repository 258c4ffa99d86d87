//! Orientation of a corner by the intensity centroid of a disc (Rosin 1999). Enters: picture and corner. Leaves: 1/256 turns.

use crate::compute::fast::Corner;
use crate::num::{index, low_u8, u32_from};
use crate::plane::Plane;
use crate::simd::{Kernel, dispatch};

/// Radius of the disc.
pub(crate) const RADIUS_PX: usize = 15;
const SIDE: usize = 2 * RADIUS_PX + 1;
/// A row of the patch with one unused column, so that it fills whole registers.
const STRIDE: usize = SIDE + 1;

/// `round(2^16 tan((2k + 1) pi / 256))`: the slopes half-way between neighbouring angles of the first octant.
const SLOPES_Q16: [u32; 32] = [
    804, 2414, 4026, 5644, 7268, 8901, 10545, 12202, 13874, 15564, 17273, 19005, 20762, 22546, 24360, 26208, 28093,
    30018, 31986, 34002, 36071, 38196, 40382, 42636, 44963, 47369, 49863, 52451, 55144, 57950, 60880, 63947,
];

/// The direction of (x, y) in 1/256 of a turn, from +x towards +y, rounded to the nearest; (0, 0) points to 0.
///
/// A first octant's slope is compared with 32 constants. The error is half a step (1/512 turn) plus the rounding of a
/// constant, under 2e-6 of a turn; on a seam the higher step within the octant is taken.
pub fn angle_of(x: i32, y: i32) -> u8 {
    let (x_size, y_size) = (x.unsigned_abs(), y.unsigned_abs());
    let (long, short) = (x_size.max(y_size), x_size.min(y_size));
    if long == 0 {
        return 0;
    }
    let above = |slope: u32| u64::from(short) << 16 >= u64::from(long) * u64::from(slope);
    let steps = u32_from(SLOPES_Q16.partition_point(|&slope| above(slope)));
    let quarter = if y_size > x_size { 64 - steps } else { steps };
    let turn = match (x < 0, y < 0) {
        (false, false) => quarter,
        (true, false) => 128 - quarter,
        (true, true) => 128 + quarter,
        (false, true) => 256 - quarter,
    };
    low_u8(turn)
}

/// Orientation at a corner whose disc lies in the picture. Panics where it does not.
pub(crate) fn orientation(picture: &Plane<u8>, corner: &Corner) -> u8 {
    let (x, y) = (index(corner.x_px) - RADIUS_PX, index(corner.y_px) - RADIUS_PX);
    let rows = std::array::from_fn(|row| picture.row(y + row)[x..x + STRIDE].try_into().expect("cut to this length"));
    let (x_moment, y_moment) = dispatch(Moments { rows });
    angle_of(x_moment, y_moment)
}

/// First moments of the disc: at most 15 x 709 x 255 in size, so 32 bits hold them.
struct Moments<'a> {
    rows: [&'a [u8; STRIDE]; SIDE],
}

impl Kernel for Moments<'_> {
    type Output = (i32, i32);

    #[inline(always)]
    fn run(self) -> (i32, i32) {
        let (mut x_moment, mut y_moment) = (0, 0);
        for (y_offset, (values, disc)) in (-15..=15).zip(self.rows.iter().zip(&DISC)) {
            let mut across = 0_i32;
            let mut sum = 0_i32;
            for i in 0..STRIDE {
                across += i32::from(values[i]) * i32::from(disc.x_weights[i]);
                sum += i32::from(values[i]) * i32::from(disc.inside[i]);
            }
            x_moment += across;
            y_moment += sum * y_offset;
        }
        (x_moment, y_moment)
    }
}

/// Pixels of the disc.
pub(crate) fn disc_pixels() -> u64 {
    DISC.iter().flat_map(|row| row.inside).map(|inside| u64::from(inside != 0)).sum()
}

/// One row of the disc: 1 inside and 0 outside, and the same times the column's offset.
struct DiscRow {
    inside: [i16; STRIDE],
    x_weights: [i16; STRIDE],
}

static DISC: [DiscRow; SIDE] = disc();

#[allow(clippy::cast_possible_truncation, clippy::cast_possible_wrap)] // Constants under 32.
const fn disc() -> [DiscRow; SIDE] {
    let mut rows = [const { DiscRow { inside: [0; STRIDE], x_weights: [0; STRIDE] } }; SIDE];
    let mut y = 0;
    while y < SIDE {
        let mut x = 0;
        while x < SIDE {
            let (dx, dy) = (x as i32 - RADIUS_PX as i32, y as i32 - RADIUS_PX as i32);
            if dx * dx + dy * dy <= (RADIUS_PX * RADIUS_PX) as i32 {
                rows[y].inside[x] = 1;
                rows[y].x_weights[x] = dx as i16;
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
                let error = (f64::from(angle_of(x, y)) / 256.0 - exact).rem_euclid(1.0);
                let error = if error > 0.5 { 1.0 - error } else { error };
                worst_turns = if error > worst_turns { error } else { worst_turns };
                tried += 1;
            }
        }
        assert!(tried > 10_000, "tried {tried}");
        // Half a step is 1/512; a constant is off by half of 2^-16 in slope, over 2 pi: 1.2e-6 of a turn.
        assert!(worst_turns <= 1.0 / 512.0 + 2e-6, "worst error {worst_turns} turns");
        assert_eq!(
            [(1, 0), (1, 1), (0, 1), (-1, 0), (0, -1), (1, -1)].map(|(x, y)| angle_of(x, y)),
            [0, 32, 64, 128, 192, 224]
        );
    }

    #[test]
    fn the_slopes_are_the_rounded_tangents() {
        for (k, &slope) in SLOPES_Q16.iter().enumerate() {
            let exact = 65_536.0 * libm::tan((2.0 * k as f64 + 1.0) * std::f64::consts::PI / 256.0);
            assert_eq!(f64::from(slope), libm::round(exact), "slope {k}");
        }
    }

    #[test]
    fn a_ramp_points_where_it_rises() {
        let size = crate::units::Size { width_px: 40, height_px: 40 };
        let centre = Corner { x_px: 20, y_px: 20, score: 0 };
        let mut tried = 0;
        for step in 0..256_u32 {
            let (sine, cosine) = libm::sincos(f64::from(step) * std::f64::consts::TAU / 256.0);
            let value = |i: usize| {
                let (x, y) = ((i % 40) as f64 - 20.0, (i / 40) as f64 - 20.0);
                libm::round(128.0 + 4.0 * (x * cosine + y * sine)) as u8
            };
            let picture = Plane::from_values(size, (0..1600).map(value).collect());
            let found = orientation(&picture, &centre);
            let off = (u32::from(found) + 256 - step) % 256;
            // Rounded values move the centroid's direction by far less than a step, so one step either way is enough.
            assert!(off <= 1 || off == 255, "direction {step}, found {found}");
            tried += 1;
        }
        assert_eq!(tried, 256);
    }
}
