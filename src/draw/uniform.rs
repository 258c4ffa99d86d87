//! Uniforms of a row: one 32-bit word per column, a pure function of the row's key and the column.
//!
//! Eight Xoshiro256++ generators run side by side, seeded by SplitMix64 words that no two lanes share. One step of all
//! lanes gives sixteen columns. `fill_uniforms` is the fast path; `uniform_at` is its slow twin, built on the crate
//! `rand_xoshiro`.

use rand::{Rng, SeedableRng};
use rand_xoshiro::Xoshiro256PlusPlus;

use super::key::{DrawKey, mix};
use crate::num::{low_u32, u64_from};
use crate::simd::kernel;

/// Generators side by side.
const LANES: usize = 8;
/// Columns served by one step of all lanes: two 32-bit halves of each 64-bit word.
const COLUMNS_PER_STEP: usize = 2 * LANES;
/// Steps that the kernel takes at a time.
const STEPS_PER_BLOCK: usize = 4;
const COLUMNS_PER_BLOCK: usize = STEPS_PER_BLOCK * COLUMNS_PER_STEP;
/// SplitMix64's increment, 2^64 over the golden ratio, made odd.
const GOLDEN: u64 = 0x9E37_79B9_7F4A_7C15;

// The halves of a word become neighbouring columns by reinterpretation, low half first.
const _: () = assert!(cfg!(target_endian = "little"), "supported targets are little-endian");

/// Word `word` (0..4) of a lane's first state.
#[inline(always)]
fn seed_word(key: DrawKey, lane: usize, word: usize) -> u64 {
    let number = u64_from(LANES * word + lane + 1);
    mix(key.0.wrapping_add(GOLDEN.wrapping_mul(number)))
}

kernel! {
    /// Fills a row with uniforms in 0..2^32: column c takes lane (c mod 16) / 2 after c / 16 steps, its low half where c is
    /// even. A longer row begins with the values of a shorter one.
    pub fn fill_uniforms<'a>(key: DrawKey, out: &'a mut [u32]) {
        let mut state = [[0_u64; LANES]; 4];
        for (word, lanes) in state.iter_mut().enumerate() {
            for (lane, value) in lanes.iter_mut().enumerate() {
                *value = seed_word(key, lane, word);
            }
        }
        let mut words = [[0; LANES]; STEPS_PER_BLOCK];
        let (blocks, rest) = out.as_chunks_mut::<COLUMNS_PER_BLOCK>();
        for block in blocks {
            next(&mut state, &mut words);
            *block = bytemuck::cast(words);
        }
        if !rest.is_empty() {
            next(&mut state, &mut words);
            let columns: [u32; COLUMNS_PER_BLOCK] = bytemuck::cast(words);
            rest.copy_from_slice(&columns[..rest.len()]);
        }
    }
}

/// The next steps of Xoshiro256++ (Blackman and Vigna, 2019) in all lanes. Lanes are the outer loop, because the compiler
/// turns that one into vectors; a single step of all lanes it half leaves to scalar rotations.
#[inline(always)]
fn next(state: &mut [[u64; LANES]; 4], words: &mut [[u64; LANES]; STEPS_PER_BLOCK]) {
    let [first, second, third, fourth] = state;
    for lane in 0..LANES {
        let (mut s0, mut s1, mut s2, mut s3) = (first[lane], second[lane], third[lane], fourth[lane]);
        for step in words.iter_mut() {
            step[lane] = s0.wrapping_add(s3).rotate_left(23).wrapping_add(s0);
            let shifted = s1 << 17;
            s2 ^= s0;
            s3 ^= s1;
            s1 ^= s2;
            s0 ^= s3;
            s2 ^= shifted;
            s3 = s3.rotate_left(45);
        }
        (first[lane], second[lane], third[lane], fourth[lane]) = (s0, s1, s2, s3);
    }
}

/// The uniform of one column: the slow twin of `fill_uniforms`.
pub fn uniform_at(key: DrawKey, column: usize) -> u32 {
    let lane = column % COLUMNS_PER_STEP / 2;
    let mut generator = generator(std::array::from_fn(|word| seed_word(key, lane, word)));
    for _ in 0..column / COLUMNS_PER_STEP {
        generator.next_u64();
    }
    let word = generator.next_u64();
    if column.is_multiple_of(2) { low_u32(word) } else { low_u32(word >> 32) }
}

impl DrawKey {
    /// A sequential generator for users who draw one by one (RANSAC, scene generators, tests). Seeded by the key's
    /// SplitMix64 words 33 to 36, so it shares no state with the lanes of `fill_uniforms`.
    ///
    /// Numbers, choices, samples and shuffles come from `rand`'s traits over it. They are equal on 32-bit and 64-bit targets as long
    /// as lists and ranges of `usize` stay below 2^32.
    pub fn stream(self) -> Xoshiro256PlusPlus {
        generator(std::array::from_fn(|word| seed_word(self, word, 4)))
    }
}

fn generator(words: [u64; 4]) -> Xoshiro256PlusPlus {
    let mut seed = [0; 32];
    for (bytes, word) in seed.chunks_exact_mut(8).zip(words) {
        bytes.copy_from_slice(&word.to_le_bytes());
    }
    Xoshiro256PlusPlus::from_seed(seed)
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::RngExt;
    use rand::seq::{IndexedRandom, SliceRandom};

    #[test]
    fn filled_rows_equal_the_slow_twin_at_every_length() {
        let mut tried = 0;
        for (seed, length) in [(0, 0), (1, 1), (2, 15), (3, 16), (4, 17), (5, 640), (6, 1283)] {
            let key = DrawKey::root(seed);
            let mut row = vec![0; length];
            fill_uniforms(key, &mut row);
            for (column, &word) in row.iter().enumerate() {
                assert_eq!(word, uniform_at(key, column), "seed {seed}, length {length}, column {column}");
                tried += 1;
            }
        }
        assert_eq!(tried, 1 + 15 + 16 + 17 + 640 + 1283);
    }

    #[test]
    fn a_stream_shares_no_word_with_the_row_of_its_key() {
        let key = DrawKey::root(7);
        let mut row = vec![0; 4096];
        fill_uniforms(key, &mut row);
        let mut stream = key.stream();
        let words: Vec<u64> = (0..512).map(|_| stream.next_u64()).collect();
        let lanes: Vec<u64> = row.chunks_exact(2).map(|half| u64::from(half[0]) | u64::from(half[1]) << 32).collect();
        assert!(words.iter().all(|word| !lanes.contains(word)));
    }

    #[test]
    fn a_streams_f64_is_its_words_upper_53_bits_and_has_mean_one_half() {
        let (mut stream, mut words) = (DrawKey::root(11).stream(), DrawKey::root(11).stream());
        let values: Vec<f64> = (0..100_000).map(|_| stream.random()).collect();
        let unit = 1.0 / 9_007_199_254_740_992.0;
        assert!(values.iter().all(|&value| value == crate::num::f64_from_u64(words.next_u64() >> 11) * unit));
        // Standard error of the mean is sqrt(1/12/n) = 9.1e-4; 4.5 of them are a false alarm in 1.5e5.
        let mean = values.iter().sum::<f64>() / 1e5;
        assert!((mean - 0.5).abs() < 4.5 * 9.13e-4, "mean {mean}");
    }

    /// A number below `range` as a 32-bit target draws it (Canon's method, 32 bits more where they decide): the upper half of a word
    /// times the range, and one more where the lower half carries.
    fn below(words: &mut Xoshiro256PlusPlus, range: u32) -> u32 {
        let mut times_range = || (words.next_u64() >> 32) * u64::from(range);
        let product = times_range();
        let (number, rest) = (low_u32(product >> 32), low_u32(product));
        let carries = rest > range.wrapping_neg() && rest.checked_add(low_u32(times_range() >> 32)).is_none();
        number + u32::from(carries)
    }

    /// Three different numbers below `range` by Floyd's algorithm.
    fn three_below(words: &mut Xoshiro256PlusPlus, range: u32) -> [u32; 3] {
        let mut drawn = [u32::MAX; 3];
        for (at, most) in (range - 3..range).enumerate() {
            let number = below(words, most + 1);
            if let Some(same) = drawn[..at].iter().position(|&other| other == number) {
                drawn[same] = most;
            }
            drawn[at] = number;
        }
        drawn
    }

    #[test]
    fn samples_and_ranges_of_usize_are_those_of_32_bit_words() {
        let seed = 21;
        let mut tried = 0;
        for case in 0..2_000_u32 {
            let key = DrawKey::root(seed).with(case.into());
            // Small ranges repeat often; great ones often need a second word.
            let range = if case % 2 == 0 { 3 + case % 40 } else { u32::MAX / 3 * 2 + case };
            let (mut stream, mut words) = (key.stream(), key.stream());
            let one: usize = stream.random_range(0..crate::num::index(range));
            assert_eq!(u64_from(one), u64::from(below(&mut words, range)), "seed {seed}, case {case}");
            if case % 2 == 0 {
                let list: Vec<u32> = (0..range).collect();
                let three: [u32; 3] = list.sample_array(&mut stream).unwrap();
                assert_eq!(three, three_below(&mut words, range), "seed {seed}, case {case}");
            }
            assert_eq!(stream.next_u64(), words.next_u64(), "seed {seed}, case {case}");
            tried += 1;
        }
        assert_eq!(tried, 2_000);
    }

    #[test]
    fn samples_and_shuffles_of_a_key_stay_as_they_are() {
        // Poses follow from them: other numbers are other bytes of a run, so an update of `rand` that moves them is a breaking change.
        let list: Vec<u32> = (0..1_000).collect();
        let mut stream = DrawKey::root(3).with(4).stream();
        let sample: [u32; 5] = list.sample_array(&mut stream).unwrap();
        let mut shuffled: [u32; 8] = std::array::from_fn(|at| list[at]);
        shuffled.shuffle(&mut stream);
        let rest = (stream.random_range(0..1_000_u32), stream.random_range(0..1_000_usize), stream.random_ratio(1, 3));
        assert_eq!((sample, shuffled, rest), ([915, 194, 177, 834, 673], [2, 0, 5, 7, 4, 3, 1, 6], (731, 599, true)));
    }
}
