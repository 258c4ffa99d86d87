//! Matches 256-bit descriptors within candidate lists. Ties go to the lower index.

use crate::simd::{Kernel, dispatch};

/// A descriptor as four words; bit order is irrelevant to distances.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Descriptor([u64; 4]);

impl Descriptor {
    /// From the bytes on the link.
    pub fn new(bytes: &[u8; 32]) -> Self {
        let mut words = [0; 4];
        for (word, bytes) in words.iter_mut().zip(bytes.chunks_exact(8)) {
            *word = bytes.iter().fold(0, |word, &byte| (word << 8) | u64::from(byte));
        }
        Self(words)
    }

    /// Number of bits that differ, 0..=256.
    #[inline(always)]
    pub fn distance(&self, other: &Self) -> u32 {
        let [a, b, c, d] = self.0;
        let [e, f, g, h] = other.0;
        (a ^ e).count_ones() + (b ^ f).count_ones() + (c ^ g).count_ones() + (d ^ h).count_ones()
    }
}

/// The least distance of each of many descriptors to any of some. One call for many: counting bits is one instruction only where the
/// machine is known to have it.
pub struct Distances<'a, I> {
    /// The few, such as a landmark's views.
    pub own: &'a [Descriptor],
    /// The many.
    pub others: I,
    /// Takes one distance for each of the many, in their order; emptied first.
    pub least: &'a mut Vec<u32>,
}

impl<'a, I: Iterator<Item = &'a Descriptor>> Distances<'a, I> {
    /// Fills `least`; 256 where `own` is empty.
    pub fn fill(self) {
        dispatch(self);
    }
}

impl<'a, I: Iterator<Item = &'a Descriptor>> Kernel for Distances<'a, I> {
    type Output = ();
    #[inline(always)]
    fn run(self) {
        self.least.clear();
        for other in self.others {
            let mut least = 256;
            for own in self.own {
                least = least.min(own.distance(other));
            }
            self.least.push(least);
        }
    }
}

/// What makes a pair of descriptors a match.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MatchRule {
    /// Greatest distance in bits.
    pub distance_max: u32,
    /// The best distance must be at most this share of the second best (1: no demand).
    pub ratio_max: f64,
}

/// The best and second best of a stream of candidates.
#[derive(Clone, Copy, Debug)]
pub struct Best {
    /// Number of the best candidate, meaningless while `distance` is `u32::MAX`.
    pub number: usize,
    /// Its distance in bits.
    pub distance: u32,
    /// Distance of the runner-up.
    pub second: u32,
}

impl Best {
    /// No candidate yet.
    pub const NONE: Self = Self { number: 0, distance: u32::MAX, second: u32::MAX };

    /// Takes a candidate; on equal distance the earlier one stays.
    pub fn offer(&mut self, number: usize, distance: u32) {
        if distance < self.distance {
            self.second = self.distance;
            self.distance = distance;
            self.number = number;
        } else if distance < self.second {
            self.second = distance;
        }
    }

    /// The best candidate where the rule accepts it.
    pub fn accepted(&self, rule: MatchRule) -> Option<usize> {
        let clear = f64::from(self.distance) <= rule.ratio_max * f64::from(self.second);
        (self.distance <= rule.distance_max && clear).then_some(self.number)
    }
}

/// Pairs (first, second) of candidates that are each other's best, from the best partner of each on both sides.
pub fn mutual(forward: &[Best], backward: &[Best], rule: MatchRule) -> Vec<(usize, usize)> {
    let pair = |(a, best): (usize, &Best)| {
        let b = best.accepted(rule)?;
        (backward[b].number == a && backward[b].accepted(rule).is_some()).then_some((a, b))
    };
    forward.iter().enumerate().filter_map(pair).collect()
}

/// Keeps, for each right-hand number, the left-hand pair of least distance (the first on a tie), in left-hand order.
pub fn one_to_one(pairs: &[(usize, usize, u32)], right_count: usize) -> Vec<(usize, usize)> {
    let mut owner: Vec<Option<(usize, u32)>> = vec![None; right_count];
    for &(left, right, distance) in pairs {
        match owner[right] {
            Some((_, held)) if held <= distance => {}
            _ => owner[right] = Some((left, distance)),
        }
    }
    pairs
        .iter()
        .filter(|&&(left, right, _)| owner[right].is_some_and(|(holder, _)| holder == left))
        .map(|&(left, right, _)| (left, right))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_distance_counts_every_bit_once() {
        for bit in 0..256 {
            let mut bytes = [0_u8; 32];
            bytes[bit / 8] = 1 << (bit % 8);
            assert_eq!(Descriptor::new(&bytes).distance(&Descriptor::new(&[0; 32])), 1, "bit {bit}");
        }
        assert_eq!(Descriptor::new(&[0xFF; 32]).distance(&Descriptor::new(&[0; 32])), 256);
    }

    #[test]
    fn many_distances_are_the_least_of_single_ones_at_every_level() {
        let word = |n: u64| n.wrapping_add(1).wrapping_mul(0x9E37_79B9_7F4A_7C15);
        let descriptor = |n: u64| Descriptor([4 * n, 4 * n + 1, 4 * n + 2, 4 * n + 3].map(|n| word(word(n))));
        let all: Vec<Descriptor> = (0..50).map(descriptor).collect();
        let mut least = vec![7; 3];
        for own in [0..0, 3..4, 10..14] {
            Distances { own: &all[own.clone()], others: all.iter(), least: &mut least }.fill();
            let single = |other| all[own.clone()].iter().map(|own| own.distance(other)).min().unwrap_or(256);
            assert_eq!(least, all.iter().map(single).collect::<Vec<u32>>(), "{own:?}");
        }
        assert_eq!(least[12], 0, "a descriptor is at no distance from itself");
    }

    #[test]
    fn a_tie_goes_to_the_earlier_candidate_and_fails_a_strict_ratio() {
        let mut best = Best::NONE;
        for (number, distance) in [(4, 30), (7, 20), (9, 20)] {
            best.offer(number, distance);
        }
        assert_eq!(best.accepted(MatchRule { distance_max: 20, ratio_max: 1.0 }), Some(7));
        assert_eq!(best.accepted(MatchRule { distance_max: 20, ratio_max: 0.9 }), None);
        assert_eq!(best.accepted(MatchRule { distance_max: 19, ratio_max: 1.0 }), None);
        assert_eq!(Best::NONE.accepted(MatchRule { distance_max: 256, ratio_max: 1.0 }), None);
    }

    #[test]
    fn two_claims_on_one_feature_leave_the_nearer_one() {
        let pairs = [(0, 2, 10), (1, 2, 8), (3, 1, 5), (5, 2, 8)];
        assert_eq!(one_to_one(&pairs, 3), [(1, 2), (3, 1)]);
    }
}
