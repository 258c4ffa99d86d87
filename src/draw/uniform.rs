//! Uniforms of a row. Enters: the row's key. Leaves: one 32-bit word a column, a pure function of key and column.
//!
//! Eight Xoshiro256++ generators run side by side, seeded by SplitMix64 words that no two lanes share. One step of all
//! lanes gives sixteen columns. `fill_uniforms` is the fast path; `uniform_at` is its slow twin, built on the crate
//! `rand_xoshiro`.

use rand_xoshiro::Xoshiro256PlusPlus;
use rand_xoshiro::rand_core::{Rng, SeedableRng};

use super::{DrawKey, mix};
use crate::num::{low_u32, u64_from};
use crate::simd::{Kernel, dispatch};

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
    let place = u64_from(LANES * word + lane + 1);
    mix(key.0.wrapping_add(GOLDEN.wrapping_mul(place)))
}

/// Fills a row with uniforms in 0..2^32: column c takes lane (c mod 16) / 2 after c / 16 steps, its low half where c is
/// even. A longer row begins with the values of a shorter one.
pub fn fill_uniforms(key: DrawKey, out: &mut [u32]) {
    dispatch(Fill { key, out });
}

struct Fill<'a> {
    key: DrawKey,
    out: &'a mut [u32],
}

impl Kernel for Fill<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let mut state = [[0_u64; LANES]; 4];
        for (word, lanes) in state.iter_mut().enumerate() {
            for (lane, value) in lanes.iter_mut().enumerate() {
                *value = seed_word(self.key, lane, word);
            }
        }
        let mut words = [[0; LANES]; STEPS_PER_BLOCK];
        let (blocks, rest) = self.out.as_chunks_mut::<COLUMNS_PER_BLOCK>();
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

/// The next number of a stream in [0, 1), a multiple of 2^-53.
pub fn uniform_f64(stream: &mut Xoshiro256PlusPlus) -> f64 {
    const UNIT: f64 = 1.0 / 9_007_199_254_740_992.0;
    crate::num::f64_from_u64(stream.next_u64() >> 11) * UNIT
}

#[cfg(test)]
mod tests {
    use super::*;

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
    fn uniform_f64_stays_in_the_half_open_unit_interval_and_has_mean_one_half() {
        let mut stream = DrawKey::root(11).stream();
        let values: Vec<f64> = (0..100_000).map(|_| uniform_f64(&mut stream)).collect();
        assert!(values.iter().all(|&value| (0.0..1.0).contains(&value)));
        // Standard error of the mean is sqrt(1/12/n) = 9.1e-4; 4.5 of them are a false alarm in 1.5e5.
        let mean = values.iter().sum::<f64>() / 1e5;
        assert!((mean - 0.5).abs() < 4.5 * 9.13e-4, "mean {mean}");
    }
}
