//! What a pixel sums over samples. Enters: their weights and photons, and how fast their points go through. Leaves: its mean, what halves
//! tell of that, and whether it may share samples at all.

use super::halves::Seen;

/// Sums of a pixel over all samples whose points go through it.
#[derive(Clone, Copy, Debug)]
pub struct Sum {
    /// Weights of each half of the samples.
    weights: [f32; 2],
    /// Of their photons.
    photons: [f32; 2],
    /// Of all photons' squares.
    squares: f32,
    /// Of all weights' squares.
    weights2: f32,
    /// Least and greatest velocity along each axis in pixels an exposure.
    velocities_px: [[f32; 2]; 2],
    /// Distance of the nearest point in metres.
    nearest_m: f32,
}

impl Sum {
    /// Of nothing.
    pub const NONE: Self = Self {
        weights: [0.0; 2],
        photons: [0.0; 2],
        squares: 0.0,
        weights2: 0.0,
        velocities_px: [[f32::MAX, f32::MIN]; 2],
        nearest_m: f32::MAX,
    };

    /// Adds a sample of the first or the second half, whose point goes through so fast and is so far.
    #[inline(always)]
    pub fn add(&mut self, weight: f32, photons: f32, velocity_px: [f32; 2], is_second: bool, distance_m: f32) {
        let half = usize::from(is_second);
        let weighted = weight * photons;
        self.weights[half] += weight;
        self.photons[half] += weighted;
        self.squares += weighted * photons;
        self.weights2 += weight * weight;
        for ([least, most], speed) in self.velocities_px.iter_mut().zip(velocity_px) {
            (*least, *most) = (lesser(speed, *least), greater(speed, *most));
        }
        self.nearest_m = lesser(distance_m, self.nearest_m);
    }

    /// Of both halves' weights.
    pub fn weight(&self) -> f32 {
        self.weights[0] + self.weights[1]
    }

    /// What its samples say; none unless both halves have some.
    pub fn seen(&self) -> Option<Seen> {
        let ([a, b], [of_a, of_b], all) = (self.weights, self.photons, self.weight());
        if !(a > 0.0 && b > 0.0) {
            return None;
        }
        let photons = (of_a + of_b) / all;
        let apart = of_a / a - of_b / b;
        Some(Seen {
            photons,
            taken: apart * apart * (a * b / (all * all)),
            taken_before: 0.0,
            spread: greater(self.squares / all - photons * photons, 0.0),
            nearest_m: self.nearest_m,
            shared: Some(all * all / self.weights2),
        })
    }

    /// What the velocities of its points lie amid, and how far they are apart, in pixels an exposure.
    pub fn velocity_px(&self) -> [[f32; 2]; 2] {
        let of = |at: fn([f32; 2]) -> f32| self.velocities_px.map(at);
        [of(|[least, most]| 0.5 * (least + most)), of(|[least, most]| most - least)]
    }
}

/// The lesser of two numbers.
#[inline(always)]
pub fn lesser(a: f32, b: f32) -> f32 {
    if a < b { a } else { b }
}

/// The greater of two numbers.
#[inline(always)]
pub fn greater(a: f32, b: f32) -> f32 {
    if a > b { a } else { b }
}
