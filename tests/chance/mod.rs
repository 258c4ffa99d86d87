//! Random cases of tests: a stream keyed by a test's seed and the number of its case, with the choices that cases are made of.

#![allow(dead_code)] // Each test file uses its own part.

use rand::RngExt;
use rand::seq::IndexedRandom;
use rand_xoshiro::Xoshiro256PlusPlus;
use sensel::draw::DrawKey;

/// Choices of one case, one after the other.
pub struct Chance(Xoshiro256PlusPlus);

impl Chance {
    /// The case of this number under a seed.
    pub fn new(seed: u64, case: u64) -> Self {
        Self(DrawKey::root(seed).with(case).stream())
    }

    /// From 0 to below 1.
    pub fn unit(&mut self) -> f64 {
        self.0.random()
    }

    /// Equally likely between the two.
    pub fn between(&mut self, low: f64, high: f64) -> f64 {
        low + (high - low) * self.unit()
    }

    /// Equally likely in ratio between the two.
    pub fn ratio(&mut self, low: f64, high: f64) -> f64 {
        low * libm::pow(high / low, self.unit())
    }

    /// From 0 to `bound` - 1.
    pub fn below(&mut self, bound: u32) -> u32 {
        self.0.random_range(0..bound)
    }

    /// From `least` to `most`.
    pub fn within(&mut self, least: u32, most: u32) -> u32 {
        self.0.random_range(least..=most)
    }

    /// One of a list.
    pub fn one<T: Copy>(&mut self, of: &[T]) -> T {
        *of.choose(&mut self.0).expect("lists of choices are not empty")
    }
}
