//! Patterns after quantisation with dither. Computes the variance that a pattern has in mean codes.
//!
//! The mean of floor(x + noise) is x - 1/2 + sum over h of sin(2 pi h x) exp(-2 pi^2 h^2 noise) / (pi h) (Widrow and Kollar,
//! "Quantization Noise", 2008, chapter 4). Three harmonics are kept: at the least noise of a conversion that is measurable, 0.3 DN over
//! sqrt 2, the fourth is 3e-8 DN.

use std::f64::consts::PI;

/// A conversion's level and the amplitudes of its harmonics.
#[derive(Clone, Copy, Debug)]
pub struct Dither {
    level_dn: f64,
    amplitudes: [f64; 3],
}

/// exp(-2 pi^2 h^2 variance): what an average over normals of that variance leaves of harmonic h.
fn blur(harmonic: f64, variance: f64) -> f64 {
    libm::exp(-2.0 * PI * PI * harmonic * harmonic * variance)
}

/// Harmonics by number, from 1.
fn harmonics(amplitudes: [f64; 3]) -> [(f64, f64); 3] {
    let [first, second, third] = amplitudes;
    [(1.0, first), (2.0, second), (3.0, third)]
}

impl Dither {
    /// A conversion at a level with noise of that variance in DN^2.
    pub fn new(level_dn: f64, noise_dn2: f64) -> Self {
        Self { level_dn, amplitudes: [1.0, 2.0, 3.0].map(|harmonic| blur(harmonic, noise_dn2) / (PI * harmonic)) }
    }

    /// No conversion.
    pub fn none() -> Self {
        Self { level_dn: 0.0, amplitudes: [0.0; 3] }
    }

    /// The same averaged over levels that spread by that variance.
    #[must_use]
    pub fn averaged(self, variance_dn2: f64) -> Self {
        let amplitudes =
            harmonics(self.amplitudes).map(|(harmonic, amplitude)| amplitude * blur(harmonic, variance_dn2));
        Self { amplitudes, ..self }
    }

    /// Amplitude of the mean code's first harmonic.
    pub fn mean_amplitude_dn(&self) -> f64 {
        self.amplitudes[0]
    }
}

/// Amplitude over a code in which the variance of a conversion's codes swings with its level: the first harmonic, (4 sigma^2 + 1/pi^2)
/// exp(-2 pi^2 sigma^2), averaged over levels that spread.
pub fn variance_amplitude_dn2(noise_dn2: f64, spread_dn2: f64) -> f64 {
    (4.0 * noise_dn2 + 1.0 / (PI * PI)) * blur(1.0, noise_dn2 + spread_dn2)
}

/// Variance over a pattern of the mean code. The pattern of variance `part_dn2` adds to the signal alone; an offset of variance
/// `common_dn2` adds to signal and reset alike and cancels but for what quantisers make of it.
///
/// With u the pattern, c the offset, S and R the harmonics of signal and reset: Var(u + S(u + c) - R(c)), each term in closed form by the
/// characteristic function of a normal.
pub fn pattern_variance(signal: &Dither, reset: &Dither, part_dn2: f64, common_dn2: f64) -> f64 {
    let both_dn2 = part_dn2 + common_dn2;
    let mut sum = part_dn2;
    for (harmonic, amplitude) in harmonics(signal.amplitudes) {
        // E[u sin(a (x + u))] = a Var(u) cos(a x) blur.
        let wave = 2.0 * PI * harmonic;
        sum += 2.0 * amplitude * wave * part_dn2 * libm::cos(wave * signal.level_dn) * blur(harmonic, both_dn2);
    }
    sum + covariance(signal, signal, 0.0, both_dn2) + covariance(reset, reset, 0.0, common_dn2)
        - 2.0 * covariance(signal, reset, part_dn2, common_dn2)
}

/// Covariance of two sums of sines, whose levels share an offset of variance `shared`, where the first has `own` besides.
fn covariance(one: &Dither, other: &Dither, own: f64, shared: f64) -> f64 {
    let mut sum = 0.0;
    for (h, a) in harmonics(one.amplitudes) {
        for (k, b) in harmonics(other.amplitudes) {
            let (x, y) = (2.0 * PI * h * one.level_dn, 2.0 * PI * k * other.level_dn);
            let apart = libm::cos(x - y) * blur(h - k, shared);
            let together = libm::cos(x + y) * blur(h + k, shared);
            let means = libm::sin(x) * libm::sin(y) * blur(h, shared) * blur(k, shared);
            sum += a * b * blur(h, own) * (0.5 * (apart - together) - means);
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::super::moments::{RampLevel, normal_nodes, quantised};
    use super::*;

    #[test]
    fn a_coarse_quantiser_steepens_or_flattens_a_faint_pattern_by_its_phase() {
        // d/dx of the mean code is 1 + 2 cos(2 pi x) exp(-2 pi^2 s^2) and higher: at a code's lower edge (x whole) steeper, in its
        // middle flatter. The second harmonic is 2 exp(-8 pi^2 s^2) = 7e-6.
        let (part, noise) = (1e-6, 0.16);
        let slope = 2.0 * libm::exp(-2.0 * PI * PI * noise);
        for (mean_dn, expected) in [(64.0, 1.0 + slope), (64.5, 1.0 - slope)] {
            let found = (pattern_variance(&Dither::new(mean_dn, noise), &Dither::none(), part, 0.0) / part).sqrt();
            // The pattern's own width of 1e-3 DN bends the slope by 2 pi^2 1e-6.
            assert!((found - expected).abs() < 1e-4, "{found} for {expected}");
        }
    }

    #[test]
    fn the_closed_form_is_the_average_over_patterns_of_two_quantised_levels() {
        for (signal_dn, noise, part, common) in
            [(64.3, 0.045, 0.02, 3.0), (70.0, 0.1, 0.3, 0.04), (64.6, 0.06, 0.0, 1.0)]
        {
            let signal = Dither::new(signal_dn, noise);
            let reset = Dither::new(64.0, 0.05);
            let found = pattern_variance(&signal, &reset, part, common);
            let code = |mean: f64, noise: f64| quantised(RampLevel { mean, sigma: noise.sqrt() }, 0.0, 1023.0).mean;
            let (mut mean, mut square) = (0.0, 0.0);
            for &(u, weight_u) in &normal_nodes(101) {
                for &(c, weight_c) in &normal_nodes(201) {
                    let (u, c) = (u * part.sqrt(), c * common.sqrt());
                    let difference = code(signal_dn + u + c, noise) - code(64.0 + c, 0.05);
                    mean += weight_u * weight_c * difference;
                    square += weight_u * weight_c * difference * difference;
                }
            }
            let expected = square - mean * mean;
            // Beyond 5 sigma lies 1.5e-5 of a normal's variance; the fourth harmonic is below 1e-6.
            assert!((found - expected).abs() < 3e-5 * expected + 2e-6, "{found} for {expected}");
        }
    }
}
