//! Rotated BRIEF-256. Enters: the smoothed picture, a corner and its angle. Leaves: 256 comparisons.
//!
//! Bit i is 1 where the first point of pair i is darker than the second (Calonder 2010). The pairs follow from an integer
//! rule written below, and are turned by the corner's angle in 256 steps, rounded to whole pixels, from a table of sines
//! with 14 bits of fraction. In hardware the table is 256 pairs and one rotator; here all 256 turns are kept.

use std::sync::OnceLock;

use crate::compute::fast::Corner;
use crate::draw::mix;
use crate::num::{index, low_u32};
use crate::plane::Plane;

/// Bytes of a descriptor.
pub(crate) const BYTES: usize = 32;
const PAIRS: usize = 8 * BYTES;
/// Farthest point of the pattern.
pub(crate) const RADIUS_PX: usize = 13;
/// Least length of a pair: below it the smoothing kernel makes both points nearly the same.
const LENGTH_PX_MIN: i32 = 4;
/// The published constant from which the pairs are drawn.
const PATTERN_SEED: u64 = 0x5E4E_5E1B;
/// Side of the patch that is copied from the picture, a power of two to keep places cheap.
const STRIDE: usize = 32;
const PATCH: usize = STRIDE * STRIDE;

/// `round(2^14 sin(2 pi k / 256))` of the first quarter turn.
const SINES_Q14: [i32; 65] = [
    0, 402, 804, 1205, 1606, 2006, 2404, 2801, 3196, 3590, 3981, 4370, 4756, 5139, 5520, 5897, 6270, 6639, 7005, 7366,
    7723, 8076, 8423, 8765, 9102, 9434, 9760, 10080, 10394, 10702, 11003, 11297, 11585, 11866, 12140, 12406, 12665,
    12916, 13160, 13395, 13623, 13842, 14053, 14256, 14449, 14635, 14811, 14978, 15137, 15286, 15426, 15557, 15679,
    15791, 15893, 15986, 16069, 16143, 16207, 16261, 16305, 16340, 16364, 16379, 16384,
];

/// A point of the pattern relative to the corner, in pixels.
type Point = (i32, i32);

/// The pairs of the pattern before rotation, as (first, second) points of (x, y) pixels.
///
/// Coordinates are the sum of four draws from -5 to 5 (nearly Gaussian, standard deviation 6.3 px); a pair is taken
/// if both points are within 13 px, at least 4 px apart, and the pair is new in either order. Draw n is
/// `mix(PATTERN_SEED + n) mod 11 - 5`.
pub fn pattern() -> Vec<((i32, i32), (i32, i32))> {
    let mut drawn = 0;
    let mut coordinate = || {
        (0..4).fold(0, |sum, _| {
            drawn += 1;
            sum + i32::try_from(mix(PATTERN_SEED + drawn) % 11).expect("below 11") - 5
        })
    };
    let radius = i32::try_from(RADIUS_PX).expect("a small constant");
    let mut pairs: Vec<(Point, Point)> = Vec::with_capacity(PAIRS);
    while pairs.len() < PAIRS {
        let (a, b) = ((coordinate(), coordinate()), (coordinate(), coordinate()));
        let near = |(x, y): Point| x * x + y * y <= radius * radius;
        let (dx, dy) = (a.0 - b.0, a.1 - b.1);
        let long = dx * dx + dy * dy >= LENGTH_PX_MIN * LENGTH_PX_MIN;
        if near(a) && near(b) && long && !pairs.contains(&(a, b)) && !pairs.contains(&(b, a)) {
            pairs.push((a, b));
        }
    }
    pairs
}

/// Sine of k/256 of a turn in 2^-14.
fn sine_q14(k: usize) -> i32 {
    let k = k % 256;
    let quarter = |k: usize| if k <= 64 { SINES_Q14[k] } else { SINES_Q14[128 - k] };
    if k < 128 { quarter(k) } else { -quarter(k - 128) }
}

/// A point turned by k/256 of a turn from +x towards +y, rounded half up.
fn turned((x, y): Point, k: usize) -> Point {
    let (sine, cosine) = (sine_q14(k), sine_q14(k + 64));
    let rounded = |value: i32| (value + (1 << 13)) >> 14;
    (rounded(x * cosine - y * sine), rounded(x * sine + y * cosine))
}

/// The pattern under all 256 rotations, as places in a patch.
pub(crate) struct RotatedPattern {
    turns: Vec<[(u16, u16); PAIRS]>,
}

/// The one table, built on first use (a few milliseconds) from integers only.
pub(crate) fn rotated_pattern() -> &'static RotatedPattern {
    static TABLE: OnceLock<RotatedPattern> = OnceLock::new();
    TABLE.get_or_init(|| {
        let pairs = pattern();
        let turn = |k| {
            let mut places = [(0, 0); PAIRS];
            for (place, &(a, b)) in places.iter_mut().zip(&pairs) {
                *place = (patch_place(turned(a, k)), patch_place(turned(b, k)));
            }
            places
        };
        RotatedPattern { turns: (0..256).map(turn).collect() }
    })
}

fn patch_place((x, y): Point) -> u16 {
    let centre = i32::try_from(RADIUS_PX).expect("a small constant");
    let stride = i32::try_from(STRIDE).expect("a small constant");
    assert!(x.abs() <= centre && y.abs() <= centre, "rotation keeps the radius");
    u16::try_from((y + centre) * stride + x + centre).expect("inside the patch")
}

impl RotatedPattern {
    /// The descriptor of a corner whose patch lies in the picture. Panics where it does not.
    pub(crate) fn describe(&self, smoothed: &Plane<u8>, corner: &Corner, angle: u8) -> [u8; BYTES] {
        let mut patch = [0_u8; PATCH];
        let (x, y) = (index(corner.x_px) - RADIUS_PX, index(corner.y_px) - RADIUS_PX);
        for (row, place) in patch.chunks_exact_mut(STRIDE).take(2 * RADIUS_PX + 1).enumerate() {
            let side = 2 * RADIUS_PX + 1;
            place[..side].copy_from_slice(&smoothed.row(y + row)[x..x + side]);
        }
        let at = |place: u16| patch[usize::from(place) % PATCH];
        let mut descriptor = [0; BYTES];
        for (byte, pairs) in descriptor.iter_mut().zip(self.turns[usize::from(angle)].chunks_exact(8)) {
            for (bit, &(a, b)) in pairs.iter().enumerate() {
                *byte |= u8::from(at(a) < at(b)) << bit;
            }
        }
        descriptor
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::f64_from_usize;

    #[test]
    fn the_sines_are_rounded_to_fourteen_bits() {
        for k in 0..=256 {
            let exact = 16_384.0 * libm::sin(f64_from_usize(k) * std::f64::consts::TAU / 256.0);
            assert_eq!(f64::from(sine_q14(k)), libm::round(exact), "sine {k}");
        }
    }

    #[test]
    fn the_pattern_is_balanced_within_its_radius_and_without_repeats() {
        let pairs = pattern();
        let points: Vec<Point> = pairs.iter().flat_map(|&(a, b)| [a, b]).collect();
        let mean = |of: fn(&Point) -> i32| f64::from(points.iter().map(of).sum::<i32>()) / 512.0;
        let (x_mean, y_mean) = (mean(|p| p.0), mean(|p| p.1));
        let (xx, yy, xy) = (mean(|p| p.0 * p.0), mean(|p| p.1 * p.1), mean(|p| p.0 * p.1));
        // A point's coordinate has a standard deviation near 5.6 px, its mean over 512 one of 0.25 px: four of them.
        assert!(x_mean.abs() < 1.0 && y_mean.abs() < 1.0, "means {x_mean}, {y_mean}");
        // Isotropic: a variance near 31 px^2 has a standard error of 31 sqrt(2 / 512) = 1.9 px^2 at most; four of the difference.
        assert!((xx - yy).abs() < 11.0 && xy.abs() < 8.0, "second moments {xx}, {yy}, {xy}");
        assert!(points.iter().all(|(x, y)| x * x + y * y <= 169));
        let unique: std::collections::BTreeSet<_> = pairs.iter().collect();
        assert_eq!(unique.len(), 256);
    }

    #[test]
    fn the_published_pattern_stays_as_it_is() {
        // Descriptors of different versions are compared with each other, so the pattern is part of the format.
        let sum = pattern().iter().fold(0_u64, |sum, &((ax, ay), (bx, by))| {
            [ax, ay, bx, by].iter().fold(sum, |sum, &v| mix(sum ^ u64::from(low_u32(u64::from(v.cast_unsigned())))))
        });
        assert_eq!(sum, 0, "the pattern's fingerprint is {sum:#x}");
    }

    #[test]
    fn a_turn_by_a_quarter_swaps_the_axes() {
        for (a, _) in pattern() {
            assert_eq!(turned(a, 0), a);
            assert_eq!(turned(a, 64), (-a.1, a.0));
            assert_eq!(turned(a, 128), (-a.0, -a.1));
        }
    }
}
