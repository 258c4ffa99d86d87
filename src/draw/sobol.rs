//! Sample points: position in the pixel and instant in the exposure, each in 0..1, from a sample's number and a pixel's seeds.
//!
//! Sobol' points (direction numbers of Joe and Kuo, 2008) with nested uniform scrambling (Owen 1995, by the hash of Laine and Karras 2011
//! with the constants of Vegdahl 2021). Every aligned block of a power of two is stratified: x with y as a (0, m, 2)-net, x, y and t
//! together as a (1, m, 3)-net in base 2. So batches that double their number keep what earlier ones have.

use crate::num::{f32_from_u32, index};

/// Dimensions of a sample: x, y, t, and two for a rough reflection.
const DIMENSIONS: usize = 5;

/// The leading bits of a time that the pixels of a packet share, so that their rays stay together.
pub const SHARED_BITS: u32 = 4;

/// Directions of the first five dimensions: of degree 0 (van der Corput), then of primitive polynomials 1, 3, 7 in binary and so on.
/// Their bits stand in reverse: the highest lowest, as scrambling wants it.
const DIRECTIONS: [[u32; 32]; DIMENSIONS] = [
    van_der_corput(),
    directions(1, 0, [1, 0, 0]),
    directions(2, 1, [1, 3, 0]),
    directions(3, 1, [1, 3, 1]),
    directions(3, 2, [1, 1, 1]),
];

const fn van_der_corput() -> [u32; 32] {
    let mut all = [0; 32];
    let mut bit = 0;
    while bit < 32 {
        all[bit] = 1 << bit;
        bit += 1;
    }
    all
}

/// Bratley and Fox's recurrence for a polynomial of a degree with inner coefficients `a` and first numbers `m`.
const fn directions(degree: usize, a: u32, m: [u32; 3]) -> [u32; 32] {
    let mut all = [0; 32];
    let mut bit = 0;
    while bit < 32 {
        all[bit] = if bit < degree {
            m[bit] << (31 - bit)
        } else {
            let mut next = all[bit - degree] ^ (all[bit - degree] >> degree);
            let mut k = 1;
            while k < degree {
                if a >> (degree - 1 - k) & 1 == 1 {
                    next ^= all[bit - k];
                }
                k += 1;
            }
            next
        };
        bit += 1;
    }
    let mut bit = 0;
    while bit < 32 {
        all[bit] = all[bit].reverse_bits();
        bit += 1;
    }
    all
}

/// A Sobol' number with its bits in reverse.
#[inline(always)]
fn sobol_reversed(dimension: usize, number: u32) -> u32 {
    let (mut bits, mut left, mut bit) = (0, number, 0);
    while left != 0 {
        if left & 1 == 1 {
            bits ^= DIRECTIONS[dimension][bit];
        }
        left >>= 1;
        bit += 1;
    }
    bits
}

/// The first three dimensions of the points of some numbers, scrambled by a seed each, side by side.
#[inline(always)]
pub fn points<const LANES: usize>(numbers: &[u32; LANES], seeds: [u32; 3]) -> [[f32; LANES]; 3] {
    let mut all = 0;
    for lane in 0..LANES {
        all |= numbers[lane];
    }
    let mut points = [[0.0; LANES]; 3];
    for axis in 0..3 {
        let mut reversed = [0_u32; LANES];
        for bit in 0..index(u32::BITS - all.leading_zeros()) {
            let direction = DIRECTIONS[axis][bit];
            for lane in 0..LANES {
                reversed[lane] ^= direction & 0_u32.wrapping_sub(numbers[lane] >> bit & 1);
            }
        }
        for lane in 0..LANES {
            points[axis][lane] = unit(scrambled(reversed[lane], seeds[axis]));
        }
    }
    points
}

/// Nested uniform scrambling of a number given in reverse; the result stands the right way round.
#[inline(always)]
fn scrambled(reversed: u32, seed: u32) -> u32 {
    let mut x = reversed;
    x ^= x.wrapping_mul(0x3d20_adea);
    x = x.wrapping_add(seed);
    x = x.wrapping_mul((seed >> 16) | 1);
    x ^= x.wrapping_mul(0x0552_6c56);
    x ^= x.wrapping_mul(0x53a2_2864);
    x.reverse_bits()
}

/// The top 24 bits as a number of 0..1.
#[inline(always)]
fn unit(bits: u32) -> f32 {
    f32_from_u32(bits >> 8) * (1.0 / 16_777_216.0)
}

/// Seeds of the pixels of a packet, one a lane.
#[derive(Clone, Copy, Debug)]
pub struct Seeds<const LANES: usize> {
    /// Of x, y and t, by lane.
    pub lanes: [[u32; LANES]; 3],
    /// Of the leading bits of time.
    pub packet: u32,
}

/// Samples of one number, by lane.
#[derive(Clone, Copy, Debug)]
pub struct SamplePoint<const LANES: usize> {
    /// Shares of the way to the right and downwards through the pixel, and of the exposure.
    pub coordinates: [[f32; LANES]; 3],
    /// The leading bits of every lane's time, at the top of the word.
    pub shared: u32,
}

/// Positions and times of a packet's sample of one number.
#[inline(always)]
pub fn sample_point<const LANES: usize>(number: u32, seeds: &Seeds<LANES>) -> SamplePoint<LANES> {
    let [x, y, t] = [0, 1, 2].map(|dimension| sobol_reversed(dimension, number));
    let shared = scrambled(t, seeds.packet) & !(u32::MAX >> SHARED_BITS);
    let mut coordinates = [[0.0; LANES]; 3];
    for lane in 0..LANES {
        coordinates[0][lane] = unit(scrambled(x, seeds.lanes[0][lane]));
        coordinates[1][lane] = unit(scrambled(y, seeds.lanes[1][lane]));
        // Which way a lower bit is turned may depend on any higher one, so lanes may part below the shared bits.
        coordinates[2][lane] = unit(shared | (scrambled(t, seeds.lanes[2][lane]) & (u32::MAX >> SHARED_BITS)));
    }
    SamplePoint { coordinates, shared }
}

/// The fourth coordinate of a sample, for what is chosen at a bounce: the microfacet of a rough reflection, or a point on a source.
#[inline(always)]
pub fn fourth(number: u32, seed: u32, bounce: u32) -> f32 {
    unit(scrambled(sobol_reversed(3, number), of_bounce(seed, bounce)))
}

/// The fifth coordinate of a sample, as `fourth`.
#[inline(always)]
pub fn fifth(number: u32, seed: u32, bounce: u32) -> f32 {
    unit(scrambled(sobol_reversed(4, number), of_bounce(seed, bounce).rotate_left(16) ^ 0x85eb_ca6b))
}

/// The seed of a bounce. Bounces after the first are rare: their seeds only have to differ.
#[inline(always)]
fn of_bounce(seed: u32, bounce: u32) -> u32 {
    seed ^ bounce.wrapping_mul(0x9e37_79b9)
}

/// The stratum, of a power of two of them up to 2^`SHARED_BITS`, that a shared time lies in.
#[inline(always)]
pub fn stratum(shared: u32, strata_log2: u32) -> usize {
    index(shared.checked_shr(32 - strata_log2).unwrap_or(0))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::DrawKey;
    use crate::num::{low_u32, u32_truncated_f32, u64_from};

    const LANES: usize = 16;

    fn seeds(case: u64) -> Seeds<LANES> {
        let key = DrawKey::root(case);
        let lane = |dimension: u64, lane: usize| low_u32(key.with(dimension).with(u64_from(lane)).0);
        Seeds { lanes: [0, 1, 2].map(|d| std::array::from_fn(|l| lane(d, l))), packet: low_u32(key.with(9).0) }
    }

    /// Points of one lane in units of 2^-24.
    fn points(first: u32, count: u32, seeds: &Seeds<LANES>, lane: usize) -> Vec<[u32; 3]> {
        let whole = |shares: [f32; LANES]| u32_truncated_f32(shares[lane] * 16_777_216.0);
        (first..first + count).map(|number| sample_point(number, seeds).coordinates.map(whole)).collect()
    }

    /// How many points lie in each box of 2^-a by 2^-b by 2^-c.
    fn boxes(points: &[[u32; 3]], [a, b, c]: [u32; 3]) -> Vec<u32> {
        let mut counts = vec![0; 1 << (a + b + c)];
        for [x, y, t] in points {
            let at = |value: u32, bits: u32| index(value) >> (24 - bits);
            counts[(at(*x, a) << (b + c)) | (at(*y, b) << c) | at(*t, c)] += 1;
        }
        counts
    }

    #[test]
    fn every_elementary_interval_is_hit_as_often_as_the_nets_promise() {
        let mut tried = 0;
        for (case, lane) in [(1, 0), (2, 5), (3, 15)] {
            let seeds = seeds(case);
            for log2 in 0..=8_u32 {
                // A prefix, and the block of the same length after it, which is the next batch of an adaptive render.
                for first in [0, 1 << log2] {
                    let points = points(first, 1 << log2, &seeds, lane);
                    for a in 0..=log2 {
                        let net = boxes(&points, [a, log2 - a, 0]);
                        assert!(net.iter().all(|&count| count == 1), "case {case}, 2^{log2} from {first}: x, y {a}");
                        let time = boxes(&points, [0, 0, log2]);
                        assert!(time.iter().all(|&count| count == 1), "case {case}, 2^{log2} from {first}: t");
                        for b in 0..=(log2 - a) {
                            if let Some(c) = (log2 - a - b).checked_sub(1) {
                                let net = boxes(&points, [a, b, c]);
                                assert!(net.iter().all(|&count| count == 2), "2^{log2} from {first}: {a} {b} {c}");
                                tried += 1;
                            }
                        }
                    }
                }
            }
        }
        assert!(tried > 700, "{tried}");
    }

    #[test]
    fn lanes_share_the_leading_bits_of_time_and_part_below_them() {
        let seeds = seeds(4);
        let mut parted = 0;
        for number in 0..64 {
            let SamplePoint { coordinates: [_, _, t], shared } = sample_point(number, &seeds);
            let sixteenth = stratum(shared, SHARED_BITS);
            for lane in 0..LANES {
                assert_eq!(index(u32_truncated_f32(t[lane] * 16.0)), sixteenth);
                parted += u32::from(t[lane].to_bits() != t[0].to_bits());
            }
        }
        assert!(parted > 900, "{parted}");
        assert_eq!(stratum(u32::MAX, 0), 0);
    }
}
