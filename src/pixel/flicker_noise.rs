//! 1/f noise of the source follower. Computes the normal draw that represents it at the samples.
//!
//! Model: noise of spectral density K^2 / f through one pole at the follower's bandwidth; two samples t apart pass 4 sin^2(pi f t) of it
//! (correlated double sampling; Kansy, IEEE J. Solid-State Circuits 15, 1980). With a = 2 pi bandwidth t the variance of the difference is
//!
//!   K^2 integral of 4 sin^2(pi f t) / (f (1 + (f / bandwidth)^2)) df = 2 K^2 (gamma + ln a - (e^-a Ei(a) - e^a E1(a)) / 2).
//!
//! A signal alone has no such lower limit: its noise is counted from 1 Hz, K^2 ln(1 + bandwidth^2) / 2 with the bandwidth in Hz; what
//! is slower is an offset that black-level correction takes. Pixels, rows and frames are drawn independently.

use super::params::PixelParams;
use super::sample_noise::{SampleNoise, SampleSigmas, SampleTiming};
use crate::effect::Effect;

/// 1/f noise of the source follower; `None` where it is silent.
pub fn flicker_noise(params: &PixelParams, timing: SampleTiming) -> Option<Box<dyn Effect>> {
    let sigma_uv = flicker_variance_uv2(params, timing).sqrt();
    SampleNoise::boxed("flicker_noise", 111, SampleSigmas::of_difference(sigma_uv, timing.samples))
}

/// Variance of what is converted in uV^2: of the difference where both samples are taken.
pub fn flicker_variance_uv2(params: &PixelParams, timing: SampleTiming) -> f64 {
    let density_uv2 = params.flicker_uv_per_rthz * params.flicker_uv_per_rthz;
    let bandwidth_hz = params.follower_bandwidth_hz;
    if timing.samples.is_double() {
        2.0 * density_uv2 * transfer(2.0 * std::f64::consts::PI * bandwidth_hz * timing.interval_s)
    } else {
        0.5 * density_uv2 * libm::log1p(bandwidth_hz * bandwidth_hz)
    }
}

const EULER_GAMMA: f64 = 0.577_215_664_901_532_9;

/// The integral of (1 - cos a x) / (x (1 + x^2)) over x from 0, for a >= 0, relative error below 1e-6: a series whose next term is
/// a^2 of it, below 1e-3; asymptotic from 40 on, where the next term is 5040 / a^8; exponential integrals in between, which lose 7
/// digits to cancellation at the lower seam.
fn transfer(a: f64) -> f64 {
    if a <= 0.0 {
        return 0.0;
    }
    let logarithm = EULER_GAMMA + libm::log(a);
    if a < 1e-3 {
        return 0.5 * a * a * (1.5 - logarithm);
    }
    let inverse = 1.0 / (a * a);
    if a > 40.0 {
        return logarithm - inverse * (1.0 + inverse * (6.0 + inverse * 120.0));
    }
    logarithm - 0.5 * (libm::exp(-a) * ei(a) - libm::exp(a) * e1(a))
}

/// The exponential integral Ei by its power series (DLMF 6.6.2), for 0 < a <= 40: all terms are positive.
fn ei(a: f64) -> f64 {
    EULER_GAMMA + libm::log(a) + power_series(a)
}

/// The sum of a^k / (k k!).
fn power_series(a: f64) -> f64 {
    let (mut term, mut sum) = (1.0, 0.0);
    for k in (1..200).map(f64::from) {
        term *= a / k;
        sum += term / k;
    }
    sum
}

/// The exponential integral E1: its power series (DLMF 6.6.2) up to 1, its continued fraction (DLMF 6.9.1) from the tail beyond.
fn e1(a: f64) -> f64 {
    if a <= 1.0 {
        return -EULER_GAMMA - libm::log(a) - power_series(-a);
    }
    // a + 1 / (1 + 1 / (a + 2 / (1 + 2 / (a + ...)))): 300 levels leave less than 1e-14 at a = 1.
    let mut tail = a;
    for k in (1..=300).rev().map(f64::from) {
        tail = a + k / (1.0 + k / tail);
    }
    libm::exp(-a) / tail
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Trapezoids in ln x: the integrand is smooth there. From x = 1e-9, below which lies less than a^2 1e-18, to X = 1e5, beyond which
    /// 2 sin^2 / x^3 averages to 1 / (2 X^2), to the hundredth of it at the least a.
    fn by_quadrature(a: f64) -> f64 {
        let steps = 4_000_000_u32;
        let (low, high) = (libm::log(1e-9), libm::log(1e5));
        let step = (high - low) / f64::from(steps);
        let integrand = |index: u32| {
            let x = libm::exp(low + step * f64::from(index));
            let half = libm::sin(0.5 * a * x);
            2.0 * half * half / (1.0 + x * x)
        };
        (0..=steps).map(integrand).sum::<f64>() * step + 5e-11
    }

    /// Steps of 8e-6 in ln x resolve a x up to 1e4 by 12 points an oscillation at least; faster ones carry under 2e-8 of the integral.
    #[test]
    fn the_closed_form_equals_the_integral_on_every_side_of_its_seams() {
        for a in [9.9e-4, 1.01e-3, 0.1, 0.99, 1.01, 5.0, 39.9, 40.1, 94.0] {
            let (closed, summed) = (transfer(a), by_quadrature(a));
            println!("a {a}: {closed} and {summed}, {:e}", closed / summed - 1.0);
            assert!((closed / summed - 1.0).abs() < 2e-6, "a {a}: {closed} for {summed}");
        }
        assert_eq!(transfer(0.0), 0.0);
    }
}
