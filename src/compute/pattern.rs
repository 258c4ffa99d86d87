//! The pairs of points that descriptors compare: 256 pairs by a rule of integers, and their rotations.
//!
//! The plain pattern is turned by any of 256 angles, by a rotator with rounded sines. The symmetric pattern is
//! eight pairs under 32 turns: turning it moves bits round by whole bytes, so hardware needs neither rotator nor sines.

use crate::draw::mix;
use crate::words::{Sine, TurnedPx};

use super::patch::RADIUS_PX;

/// Bytes of the longest descriptor.
pub(crate) const BYTES: usize = 32;
/// Pairs of the longest descriptor.
pub(crate) const PAIRS: usize = 8 * BYTES;
/// Least length of a pair: below it the smoothing kernel makes both points nearly the same.
const LENGTH_PX_MIN: i32 = 4;
/// The published constant from which the pairs are drawn.
const PATTERN_SEED: u64 = 0x5E4E_5E1B;
/// Steps of a whole turn in the symmetric pattern.
const TURNS: usize = 32;

/// Bits of `sin(2 pi k / 256)` of the first quarter turn, rounded.
const SINE_BITS: [i16; 65] = [
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

/// Sine of k/256 of a turn.
pub fn sine_of(k: usize) -> Sine {
    let k = k % 256;
    let quarter = |k: usize| Sine::from_bits(if k <= 64 { SINE_BITS[k] } else { SINE_BITS[128 - k] });
    if k < 128 { quarter(k) } else { quarter(k - 128).wrapping_neg() }
}

/// A point turned by k/256 of a turn from +x towards +y, rounded half up.
pub fn turned((x, y): (i32, i32), k: usize) -> (i32, i32) {
    const HALF: TurnedPx = TurnedPx::lit("0.5");
    let times = |k: usize, px: i32| TurnedPx::from(sine_of(k)).wrapping_mul_int(px);
    let rounded = |coordinate: TurnedPx| coordinate.wrapping_add(HALF).wrapping_to_num();
    (rounded(times(k + 64, x).wrapping_sub(times(k, y))), rounded(times(k, x).wrapping_add(times(k + 64, y))))
}

/// The eight pairs of the symmetric pattern before rotation.
///
/// The rule: the first eight pairs of the plain pattern whose two points are both five pixels or more from the middle, since points
/// near the middle hardly move under a turn and compare the same pixels again.
pub fn symmetric_pairs() -> [((i32, i32), (i32, i32)); 8] {
    let far = |(x, y): Point| x * x + y * y >= 25;
    let mut pairs = pattern().into_iter().filter(|&(a, b)| far(a) && far(b));
    std::array::from_fn(|_| pairs.next().expect("most pairs of the pattern are far"))
}

/// All 256 pairs of the symmetric pattern turned by k/32 of a turn: bit 8 j + i is pair i under turn k + j.
pub fn symmetric_pattern(k: usize) -> Vec<((i32, i32), (i32, i32))> {
    let base = symmetric_pairs();
    let of = |turn: usize| base.map(|(a, b)| (turned(a, 256 / TURNS * turn), turned(b, 256 / TURNS * turn)));
    (0..BYTES).flat_map(|byte| of((k + byte) % TURNS)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::f64_from_usize;

    #[test]
    fn the_sines_are_rounded_to_fourteen_bits() {
        for k in 0..=256 {
            let exact = 16_384.0 * libm::sin(f64_from_usize(k) * std::f64::consts::TAU / 256.0);
            assert_eq!(f64::from(sine_of(k).to_bits()), libm::round(exact), "sine {k}");
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
            [ax, ay, bx, by].iter().fold(sum, |sum, &v| mix(sum ^ u64::from(v.cast_unsigned())))
        });
        assert_eq!(sum, 0xEC25_457A_7284_82E2, "the pattern's fingerprint is {sum:#x}");
    }

    #[test]
    fn a_turn_by_a_quarter_swaps_the_axes() {
        for (a, _) in pattern() {
            assert_eq!(turned(a, 0), a);
            assert_eq!(turned(a, 64), (-a.1, a.0));
            assert_eq!(turned(a, 128), (-a.0, -a.1));
        }
    }

    #[test]
    fn the_symmetric_pattern_turned_is_itself_with_bytes_moved_round() {
        let unturned = symmetric_pattern(0);
        for k in 0..32 {
            let turned = symmetric_pattern(k);
            for (byte, pairs) in turned.as_chunks::<8>().0.iter().enumerate() {
                assert_eq!(pairs[..], unturned[8 * ((byte + k) % 32)..][..8], "turn {k}, byte {byte}");
            }
        }
        let unique: std::collections::BTreeSet<_> = unturned.iter().collect();
        assert_eq!(unique.len(), 256);
    }
}
