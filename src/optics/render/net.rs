//! What a pixel's samples say. Enters: samples as they come. Leaves: their mean, and about the variance of that.

use super::halves::LEFT_TYPICAL;
use crate::num::{f32_from_u32, f32_nearest, greater};

/// What a pixel's own samples say.
#[derive(Clone, Copy, Debug)]
pub struct Net {
    /// Mean photons.
    pub photons: f32,
    /// Samples.
    pub samples: u32,
    /// Of its samples, for what follows.
    pub powers: Powers,
    /// Variance of its samples about their mean.
    pub spread: f32,
    /// Root of the fourth power's mean about it: the spread of an edge that halves the pixel, and more the smaller a part differs.
    pub tail: f32,
    /// About the variance that the last doubling took away, from this one and those before.
    pub taken: f32,
    /// What one sample may miss of the pixel, as a variance: it falls as the cube of the samples.
    pub hidden: f32,
    /// Rays beside the samples.
    pub extra: u32,
}

/// An edge of contrast c leaves c^2 / 600 (slanting) to c^2 / 1,600 (upright) after sixteen samples, of samples whose spread is c^2 /
/// 6 in the mean over where it lies: 0.64 to 0.24 of the spread over n^1.5.
///
/// A part p of the pixel that differs by c has a rim of some 4 sqrt(p n) of the n cells, each of which leaves some c^2 / n^2, so that
/// c^2 sqrt(p) / n^1.5 is left where samples resolve it, and c^2 p / n where few or none meet it, which is the same at one. A spread of
/// c^2 p says too little of it by sqrt(p): a lamp in a chrome tap that one sample of a thousand met left thirty times what was claimed.
/// The fourth power's mean is c^4 p, and its root over n^1.5 is that law.
const LEFT_OF_TAIL: f32 = 0.5;
/// What may lie beside the samples that met a part (Jeffreys' prior of a rate).
const OF_ONE: f32 = 0.5;

/// What the doublings before the last one count for, as far as they reach: half, falling as 1 / n^1.5.
pub const OF_BEFORE: f32 = 0.5 * 0.353_553_4;

impl Net {
    /// Before any sample, with what one may miss.
    pub const fn new(hidden: f32) -> Self {
        Self { photons: 0.0, samples: 0, powers: Powers::NONE, spread: 0.0, tail: 0.0, taken: 0.0, hidden, extra: 0 }
    }

    /// Takes what its samples sum to.
    pub fn set_powers(&mut self, powers: Powers) {
        let [spread, tail] = powers.spread_and_tail();
        (self.powers, self.spread, self.tail) = (powers, f32_nearest(spread), f32_nearest(tail));
    }

    /// Square of what the part that differs most differs by: the mean fourth power over the mean square.
    pub fn tail_contrast2(&self) -> f32 {
        let contrast = if self.spread > 0.0 { self.tail / self.spread.sqrt() } else { 0.0 };
        contrast * contrast
    }

    /// About the variance of the mean. Halves of a net agree in the number of samples on either side of an edge more often than not,
    /// and then say nothing: so they are half of the judgement, with the halves before them, and what the tail of the samples
    /// leaves of an edge is the other half. What k samples met may as well be worth k + 1/2, another c^2 / 2 n^2 (the variance of a
    /// rate of which k were counted). What none of the samples met comes on top: slits of the sky are tens of times as bright as what is
    /// beside them, and a thirtieth of a pixel of it is more than all photon noise.
    pub fn variance(&self) -> f32 {
        let n = f32_from_u32(self.samples.max(1));
        let resolved = LEFT_OF_TAIL * self.tail / (n * n.sqrt());
        0.5 * (resolved + LEFT_TYPICAL * self.taken)
            + OF_ONE * self.tail_contrast2() / (n * n)
            + self.hidden / (n * n * n)
    }
}

/// Sums of the first four powers of samples about the first of them.
#[derive(Clone, Copy, Debug)]
pub struct Powers {
    count: f64,
    about: f64,
    sums: [f64; 4],
}

impl Powers {
    /// Of no sample.
    pub const NONE: Self = Self { count: 0.0, about: 0.0, sums: [0.0; 4] };

    /// Adds a sample.
    pub fn add(&mut self, photons: f32) {
        let photons = f64::from(photons);
        self.about = if self.count > 0.0 { self.about } else { photons };
        self.count += 1.0;
        let mut power = 1.0;
        for sum in &mut self.sums {
            power *= photons - self.about;
            *sum += power;
        }
    }

    /// The samples' mean.
    pub fn mean(&self) -> f64 {
        self.about + self.sums[0] / self.count
    }

    /// The mean square and the root of the mean fourth power of what the samples differ from their mean by.
    pub fn spread_and_tail(&self) -> [f64; 2] {
        let [mean, second, third, fourth] = self.sums.map(|sum| sum / self.count);
        let mean2 = mean * mean;
        let about_mean = fourth - 4.0 * mean * third + 6.0 * mean2 * second - 3.0 * mean2 * mean2;
        [greater(second - mean2, 0.0), greater(about_mean, 0.0).sqrt()]
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_that_agree_do_not_make_a_pixel_with_an_edge_exact() {
        let net = Net { photons: 20.0, samples: 64, tail: 400.0, ..Net::new(0.0) };
        // A quarter of the tail / n^1.5, and no spread to tell one sample's worth; exact in these numbers.
        assert_eq!(net.variance(), 0.25 * 400.0 / 512.0);
        let even = Net { tail: 0.0, ..net };
        assert_eq!(even.variance(), 0.0);
        assert!(Net { hidden: 64.0, ..even }.variance() > 0.0);
    }

    #[test]
    fn a_lamp_that_one_sample_met_leaves_its_square_over_theirs() {
        let mut tried = 0;
        for lit in [1, 2, 32, 512] {
            for from in [0, 500] {
                let mut net = Net { samples: 1_024, ..Net::new(0.0) };
                let mut powers = Powers::NONE;
                for number in 0..1_024 {
                    powers.add(if (from..from + lit).contains(&number) { 1_024_100.0 } else { 100.0 });
                }
                net.set_powers(powers);
                // A part p = k / n: fourth powers c^4 r (1 - 3 r) of a spread of c^2 r, r = p (1 - p). For one sample 0.75 c^2 / n^2.
                let p = f64::from(lit) / 1_024.0;
                let r = p * (1.0 - p);
                let (c2, fourth) = (1_024_000.0 * 1_024_000.0, 1.0 - 3.0 * r);
                let law = c2 * (0.25 * (r * fourth).sqrt() / 32_768.0 + 0.5 * fourth / 1_048_576.0);
                // Sums of 1,024 powers in 53 bits, of which at most 1,024 times themselves cancel: 1e-10; floats 1e-7.
                assert!((f64::from(net.variance()) / law - 1.0).abs() < 1e-6, "{lit}: {} for {law}", net.variance());
                tried += 1;
            }
        }
        assert_eq!(tried, 8);
    }
}
