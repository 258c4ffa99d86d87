//! Moments of a conversion. Computes the mean and variance of the code of a level with normal noise, including quantisation and clipping.
//!
//! A count is the number of ramp levels j at or below the column's, so its mean is the sum over j of P_j, the probability that the
//! column is at or above ramp level j, and its mean square the sum of (2 j - 1) P_j. Ramp levels further than `REACH` sigmas below count
//! fully, those above not at all. Where sigma is above `SMOOTH_LSB` and both ends are further than that, the sums are level / LSB - 1/2
//! and sigma^2 / LSB^2 + 1/12, with the column's level above the ramp's bottom: what quantisation adds to them has the Fourier
//! coefficients exp(-2 pi^2 sigma^2 / LSB^2) (Widrow and Kollar, "Quantization Noise", 2008), below 1e-19 there.
//! The difference of two counts is summed over both counts where it can meet an end; where that takes more than `PAIRS_MAX` pairs (sigmas
//! of some 18 LSB) it is clipped as a normal instead. This holds only for ramps of equal steps with equal comparators.

use super::columns::Converter;
use super::params::Cds;
use super::sample::Sample;
use crate::num::{f64_from_i64, f64_from_usize, greater, i64_truncated, lesser};

/// A level in uV above the dark level, with normal noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct NoisyLevel {
    /// Mean.
    pub mean_uv: f64,
    /// Variance.
    pub variance_uv2: f64,
}

/// Mean and variance of a code, or of what it is made from.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct CodeMoments {
    /// Mean.
    pub mean: f64,
    /// Variance.
    pub variance: f64,
}

/// Sigmas beyond which a normal has no weight: 1e-12 on each side.
const REACH: f64 = 7.0;
/// Sigma in LSB from which on quantisation adds its variance and nothing else: exp(-2 pi^2 1.5^2) is 5e-20.
const SMOOTH_LSB: f64 = 1.5;
/// Greatest number of pairs of counts that a difference beside an end is summed over. It limits the time.
const PAIRS_MAX: usize = 65_536;

impl Converter {
    /// Whether codes of noisy levels have moments in closed form.
    pub fn has_moments(&self) -> bool {
        self.is_plain
    }

    /// Moments of a column's code. Panics where `has_moments` is false.
    pub fn code_moments(&self, signal: NoisyLevel, reset: NoisyLevel) -> CodeMoments {
        assert!(self.has_moments(), "only ramps of equal steps have moments in closed form");
        let up = self.count_moments(Sample::Signal, signal);
        if self.params.cds != Cds::Digital {
            return up;
        }
        let down = self.count_moments(Sample::Reset, reset);
        let (black_dn, most_dn) = (f64::from(self.params.black_level_dn), f64::from(self.params.code_max()));
        let whole = CodeMoments { mean: black_dn - down.mean + up.mean, variance: up.variance + down.variance };
        if clipped(whole, 0.0, most_dn) == whole {
            return whole;
        }
        let (ups, downs) = (self.weights(Sample::Signal, signal), self.weights(Sample::Reset, reset));
        if ups.1.len() * downs.1.len() > PAIRS_MAX {
            return clipped(whole, 0.0, most_dn);
        }
        clipped_difference(&ups, &downs, black_dn, most_dn)
    }

    fn count_moments(&self, sample: Sample, level: NoisyLevel) -> CodeMoments {
        let (mean, sigma) = self.in_steps(level);
        count_moments(mean, sigma, self.steps(sample))
    }

    fn weights(&self, sample: Sample, level: NoisyLevel) -> (f64, Vec<f64>) {
        let (mean, sigma) = self.in_steps(level);
        count_weights(mean, sigma, self.steps(sample))
    }

    /// Mean and sigma of a level in steps of the ramp above its bottom.
    fn in_steps(&self, level: NoisyLevel) -> (f64, f64) {
        let lsb_uv = self.params.lsb_uv();
        let pedestal_uv = f64_from_i64(self.level_nv(0.0)) / 1000.0;
        // Levels are rounded to whole nanovolts: a column reaches a ramp level from half a nanovolt below it on.
        ((level.mean_uv + pedestal_uv + 0.0005) / lsb_uv, level.variance_uv2.sqrt() / lsb_uv)
    }
}

/// Moments of `black + up - down`, clipped to 0 and `most`, of two independent counts.
fn clipped_difference(ups: &(f64, Vec<f64>), downs: &(f64, Vec<f64>), black_dn: f64, most_dn: f64) -> CodeMoments {
    let (mut first, mut second) = (0.0, 0.0);
    for (u, up) in ups.1.iter().enumerate() {
        for (d, down) in downs.1.iter().enumerate() {
            let code = black_dn + (ups.0 + f64_from_usize(u)) - (downs.0 + f64_from_usize(d));
            let code = lesser(greater(code, 0.0), most_dn);
            first += up * down * code;
            second += up * down * code * code;
        }
    }
    CodeMoments { mean: first, variance: greater(second - first * first, 0.0) }
}

/// The least number of whole numbers from 1 to `most` at or below a normal that has any weight, and the weights from it on.
fn count_weights(mean: f64, sigma: f64, most: u32) -> (f64, Vec<f64>) {
    let top = f64::from(most);
    let reach = REACH * sigma;
    let base = lesser(greater(libm::floor(mean - reach), 0.0), top);
    let last = lesser(greater(libm::floor(mean + reach) + 1.0, base), top);
    let reached = |count: f64| match count {
        count if count <= base => 1.0,
        count if count > last => 0.0,
        count => at_least(mean, sigma, count),
    };
    let counts = (0..=i64_truncated(last - base)).map(|step| base + f64_from_i64(step));
    (base, counts.map(|count| reached(count) - reached(count + 1.0)).collect())
}

/// Moments of the number of whole numbers from 1 to `most` at or below a normal of this mean and sigma.
fn count_moments(mean: f64, sigma: f64, most: u32) -> CodeMoments {
    let top = f64::from(most);
    let reach = REACH * sigma;
    if mean - reach >= top {
        return CodeMoments { mean: top, variance: 0.0 };
    }
    if mean + reach < 1.0 {
        return CodeMoments::default();
    }
    if sigma >= SMOOTH_LSB && mean - reach >= 0.0 && mean + reach <= top {
        return CodeMoments { mean: mean - 0.5, variance: sigma * sigma + 1.0 / 12.0 };
    }
    let base = lesser(greater(libm::floor(mean - reach), 0.0), top);
    let last = lesser(libm::floor(mean + reach) + 1.0, top);
    let (mut first, mut second) = (0.0, 0.0);
    for step in 1..=i64_truncated(last - base) {
        let step = f64_from_i64(step);
        let share = at_least(mean, sigma, base + step);
        first += share;
        second += (2.0 * step - 1.0) * share;
    }
    CodeMoments { mean: base + first, variance: greater(second - first * first, 0.0) }
}

/// P(X >= level) of a normal.
fn at_least(mean: f64, sigma: f64, level: f64) -> f64 {
    if sigma > 0.0 {
        0.5 * libm::erfc((level - mean) / (sigma * core::f64::consts::SQRT_2))
    } else if mean >= level {
        1.0
    } else {
        0.0
    }
}

/// Moments of a normal that is clipped at both ends. Away from them nothing changes.
pub fn clipped(of: CodeMoments, low: f64, high: f64) -> CodeMoments {
    let sigma = of.variance.sqrt();
    if of.mean - REACH * sigma >= low && of.mean + REACH * sigma <= high {
        return of;
    }
    if !(sigma > 0.0) {
        return CodeMoments { mean: lesser(greater(of.mean, low), high), variance: 0.0 };
    }
    let (a, b) = ((low - of.mean) / sigma, (high - of.mean) / sigma);
    let below = |z: f64| 0.5 * libm::erfc(-z * core::f64::consts::FRAC_1_SQRT_2);
    let density = |z: f64| libm::exp(-0.5 * z * z) / (2.0 * core::f64::consts::PI).sqrt();
    let (at_low, at_high) = (below(a), below(-b));
    let inside = 1.0 - at_low - at_high;
    // In units of sigma about the mean.
    let (low_z, high_z) = (greater(a, -1e8), lesser(b, 1e8));
    let first = at_low * low_z + at_high * high_z + density(a) - density(b);
    let edge = |z: f64, density: f64| if z.abs() < 1e3 { z * density } else { 0.0 };
    let second =
        at_low * low_z * low_z + at_high * high_z * high_z + inside + edge(a, density(a)) - edge(b, density(b));
    CodeMoments { mean: of.mean + sigma * first, variance: of.variance * greater(second - first * first, 0.0) }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::AdcParams;
    use crate::adc::params::tests::paper_adc;
    use crate::draw::{DrawKey, fill_uniforms, normals};
    use crate::num::f32_nearest;

    const DRAWS: usize = 40_000;

    fn normal(key: u64, level: NoisyLevel) -> Vec<f32> {
        let (mut uniforms, mut draws) = (vec![0; DRAWS], vec![0.0; DRAWS]);
        fill_uniforms(DrawKey::root(key), &mut uniforms);
        normals(&uniforms, &mut draws);
        let sigma_uv = level.variance_uv2.sqrt();
        draws.iter().map(|&z| f32_nearest(level.mean_uv + sigma_uv * f64::from(z))).collect()
    }

    /// 5 standard errors of mean and variance; beside an end a code is nearly two-valued, so the draws' own fourth moment tells the
    /// variance's. No level is one of the ramp's, which f32 cannot represent. 240 checks: a false alarm in 7,000 runs.
    #[test]
    fn the_moments_are_those_of_converted_draws_on_every_side_of_their_seams() {
        let lsb_uv = paper_adc().lsb_uv();
        let mut tried = 0;
        for cds in [Cds::Analog, Cds::Digital] {
            let converter = Converter::new(&AdcParams { cds, ..paper_adc() });
            for sigma_lsb in [0.0, 0.2, 0.7, 1.49, 1.51, 6.0] {
                for level_lsb in [-70.3, -63.7, -59.7, 0.3, 0.6, 100.4, 940.3, 955.4, 958.7, 1000.3] {
                    let sigma_uv = sigma_lsb * lsb_uv;
                    let signal = NoisyLevel { mean_uv: level_lsb * lsb_uv, variance_uv2: sigma_uv * sigma_uv };
                    let reset = NoisyLevel { mean_uv: 0.0, variance_uv2: 0.5 * sigma_uv * sigma_uv };
                    let mut codes = vec![0; DRAWS];
                    converter.convert_row(&normal(1, signal), &normal(2, reset), &mut codes);
                    let found = converter.code_moments(signal, reset);
                    let count = f64::from(40_000);
                    let mean = codes.iter().map(|&code| f64::from(code)).sum::<f64>() / count;
                    let moment = |power: i32| {
                        codes.iter().map(|&code| libm::pow(f64::from(code) - mean, power.into())).sum::<f64>() / count
                    };
                    let (variance, fourth) = (moment(2), moment(4));
                    let (mean_se, variance_se) =
                        ((variance / count).sqrt(), ((fourth - variance * variance).abs() / count).sqrt());
                    let words =
                        format!("{cds:?}, sigma {sigma_lsb}, level {level_lsb}: {found:?}, drawn {mean} {variance}");
                    assert!((found.mean - mean).abs() <= 5.0 * mean_se + 1e-6, "{words}");
                    assert!((found.variance - variance).abs() <= 5.0 * variance_se + 1e-6 + 0.01 * variance, "{words}");
                    tried += 1;
                }
            }
        }
        assert_eq!(tried, 120);
    }

    #[test]
    fn a_normal_clipped_in_its_middle_has_the_half_normals_moments() {
        let found = clipped(CodeMoments { mean: 5.0, variance: 4.0 }, 5.0, 1e9);
        let half = 2.0 / (2.0 * core::f64::consts::PI).sqrt();
        assert!((found.mean - 5.0 - half).abs() < 1e-12, "{found:?}");
        assert!((found.variance - (2.0 - half * half)).abs() < 1e-12, "{found:?}");
        let far = CodeMoments { mean: 5.0, variance: 1e-4 };
        assert_eq!(clipped(far, 0.0, 10.0), far);
    }
}
