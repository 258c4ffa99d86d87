//! Point spread of the lens: diffraction, defocus and residual aberrations. Blurs planes of photons before the filters.
//!
//! A plane's values are already means over pixels, so its modulation holds the pixel's sinc. The kernel adds the lens: at the
//! frequencies of its grid its transform is the lens' transfer function, between them within 1 % of it up to half a cycle per
//! pixel, so the whole is that times the pixel's sinc. What a kernel of this size cannot hold of the tails is folded into it
//! rather than lost, so it sums to 1. The picture continues beyond its edges as its mirror image, which keeps the sum and leaves
//! no dark rim.
//!
//! A lens sharper than its pixels has no positive kernel of whole pixels with the right modulation: such kernels have lobes below
//! zero, a few per cent of the light in all (`BlurKernel::lobes`). Where a light is so much brighter than what surrounds it that they
//! would take more than half of what the positive part brings, they are limited to that half: photons stay positive, and lamps have a halo.

use core::f64::consts::{PI, TAU};

use crate::num::{f32_nearest, f64_from_usize, greater, index, lesser, u32_truncated};
use crate::parallel::over_chunks;
use crate::plane::Plane;

/// What blurs.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Psf {
    /// Whether light is bent at the pupil's edge.
    pub diffraction: bool,
    /// Focal length over the pupil's diameter.
    pub f_number: f64,
    /// Diameter of the geometric blur circle on the sensor in micrometres: defocus on the sensor's side over the f-number, alike for all
    /// depths of the scene.
    pub defocus_um: f64,
    /// Standard deviation of a Gaussian that represents all other aberrations, in micrometres along each axis.
    pub aberration_um: f64,
}

/// Reach of the widest kernel.
const RADIUS_PX_MAX: usize = 48;

/// Pixels of reach for each unit of the modulation's slope (per cycle per pixel) at its kinks, at 0 and at half a cycle: between its exact
/// frequencies a kernel rounds a kink off by 0.27 times its slope over `2 reach + 1`, here 0.8 %.
const REACH_A_SLOPE: f64 = 17.0;

/// Steps of the defocus integral for each oscillation, and at least. The integrand and its slope vanish at one end and are even at
/// the other, where the trapezoidal rule converges faster than any power.
const STEPS_A_TURN: f64 = 16.0;
const STEPS_MIN: u32 = 48;

impl Psf {
    /// Whether it leaves a picture as it is.
    pub fn is_sharp(&self) -> bool {
        !self.diffraction && self.defocus_um == 0.0 && self.aberration_um == 0.0
    }

    /// Modulation at a frequency in cycles per micrometre, at a wavelength.
    ///
    /// Hopkins (1955): the autocorrelation of a pupil with a quadratic phase. Shifted by `s = f lambda N` of its diameter, and
    /// with the wavefront of a blur circle of diameter d, that is `4 / pi` times the integral over x from 0 to 1 - s of `sqrt(1 -
    /// (x + s)^2) cos(pi d f x)`, which is the diffraction limit for d = 0 and the disc's `2 J1(pi d f) / (pi d f)` for s = 0.
    /// Here `x + s` is a cosine.
    pub fn modulation(&self, cycles_per_um: f64, wavelength_um: f64) -> f64 {
        let shift = if self.diffraction { cycles_per_um * wavelength_um * self.f_number } else { 0.0 };
        if shift >= 1.0 {
            return 0.0;
        }
        let phase = PI * self.defocus_um * cycles_per_um;
        let end = libm::acos(shift);
        let pupil = if phase == 0.0 {
            // The factors keep the digits that 1 - s^2 loses at the cut-off.
            2.0 / PI * (end - shift * ((1.0 - shift) * (1.0 + shift)).sqrt())
        } else {
            // An even count for Simpson's rule.
            let steps = 2 * (STEPS_MIN + u32_truncated(STEPS_A_TURN * phase / TAU));
            let width = end / f64::from(steps);
            let integrand = |step: u32| {
                let (sine, cosine) = libm::sincos(width * f64::from(step));
                sine * sine * libm::cos(phase * (cosine - shift))
            };
            let weight = |step: u32| if step % 2 == 1 { 4.0 } else { 2.0 };
            let inner: f64 = (1..steps).map(|step| weight(step) * integrand(step)).sum();
            4.0 / PI * (width / 3.0) * (integrand(0) + inner + integrand(steps))
        };
        let rest = TAU * self.aberration_um * cycles_per_um;
        pupil * libm::exp(-0.5 * rest * rest)
    }

    /// The kernel over pixels of this pitch, of 4 to 48 pixels' reach.
    pub fn kernel(&self, wavelength_um: f64, pixel_pitch_um: f64) -> BlurKernel {
        let modulation = |cycles_per_px: f64| self.modulation(cycles_per_px / pixel_pitch_um, wavelength_um);
        let kinks = [100.0 * (1.0 - modulation(0.01)), 50.0 * (modulation(0.49) - modulation(0.51)).abs()];
        let by_kinks = REACH_A_SLOPE * greater(kinks[0], kinks[1]);
        let by_size = (0.5 * self.defocus_um + 4.0 * self.aberration_um) / pixel_pitch_um + 1.0;
        let reach_px = lesser(greater(by_kinks, by_size).ceil(), f64_from_usize(RADIUS_PX_MAX));
        BlurKernel::of(index(u32_truncated(reach_px)).max(4), &modulation)
    }
}

/// A symmetric kernel: one quadrant, rows first, the centre first.
#[derive(Clone, Debug, PartialEq)]
pub struct BlurKernel {
    radius: usize,
    quadrant: Vec<f64>,
}

impl BlurKernel {
    /// The kernel whose transform at multiples of `1 / (2 radius + 1)` cycles per pixel is this modulation.
    fn of(radius: usize, modulation: &dyn Fn(f64) -> f64) -> Self {
        let (side, count) = (2 * radius + 1, radius + 1);
        let cycles_per_px = |frequency: usize| f64_from_usize(frequency) / f64_from_usize(side);
        // A whole plane is even: each frequency but 0 counts twice.
        let cosine = |frequency: usize, position: usize| {
            let turns = cycles_per_px(frequency * position % side);
            libm::cos(TAU * turns) * if frequency == 0 { 1.0 } else { 2.0 } / f64_from_usize(side)
        };
        let cosines: Vec<f64> = (0..count * count).map(|n| cosine(n / count, n % count)).collect();
        let modulations: Vec<f64> = (0..count * count)
            .map(|n| modulation(libm::hypot(cycles_per_px(n % count), cycles_per_px(n / count))))
            .collect();
        let mut by_row = vec![0.0; count * count];
        for (n, value) in by_row.iter_mut().enumerate() {
            let (fy, x) = (n / count, n % count);
            for fx in 0..count {
                *value += modulations[fy * count + fx] * cosines[fx * count + x];
            }
        }
        let mut quadrant = vec![0.0; count * count];
        for (n, value) in quadrant.iter_mut().enumerate() {
            let (y, x) = (n / count, n % count);
            for fy in 0..count {
                *value += by_row[fy * count + x] * cosines[fy * count + y];
            }
        }
        Self { radius, quadrant }.normalised()
    }

    fn normalised(mut self) -> Self {
        let sum = self.sum();
        for value in &mut self.quadrant {
            *value /= sum;
        }
        self
    }

    fn sum(&self) -> f64 {
        self.sum_of(&|value| value)
    }

    fn sum_of(&self, part: &dyn Fn(f64) -> f64) -> f64 {
        let count = self.radius + 1;
        let twice = |offset: usize| if offset == 0 { 1.0 } else { 2.0 };
        self.quadrant.iter().enumerate().map(|(n, value)| part(*value) * twice(n / count) * twice(n % count)).sum()
    }

    /// How much of the light its parts below zero take, which its parts above zero have beyond 1.
    pub fn lobes(&self) -> f64 {
        self.sum_of(&|value| if value < 0.0 { -value } else { 0.0 })
    }

    /// Kernels of several bands as one, by the bands' shares of the light. They must not all be 0.
    pub fn mean(kernels: &[(&Self, f64)]) -> Self {
        let radius = kernels.iter().map(|(kernel, _)| kernel.radius).max().unwrap_or(0);
        let count = radius + 1;
        let mut mean = Self { radius, quadrant: vec![0.0; count * count] };
        for (kernel, share) in kernels {
            for (n, value) in kernel.quadrant.iter().enumerate() {
                mean.quadrant[n / (kernel.radius + 1) * count + n % (kernel.radius + 1)] += share * value;
            }
        }
        mean.normalised()
    }

    /// Pixels on each side of the centre.
    pub fn radius(&self) -> usize {
        self.radius
    }

    /// Share of a pixel's light that lands the given number of pixels aside.
    pub fn at(&self, x_px: usize, y_px: usize) -> f64 {
        if x_px > self.radius || y_px > self.radius { 0.0 } else { self.quadrant[y_px * (self.radius + 1) + x_px] }
    }

    /// A plane blurred by the kernel.
    pub fn blurred(&self, plane: &Plane<f32>) -> Plane<f32> {
        let mut blurred = Plane::filled(plane.size(), 0.0_f32);
        let width = plane.width_px();
        over_chunks(blurred.values_mut(), width, |row, values| self.row(plane, row, values));
        blurred
    }

    /// One row: each pair of rows at the same distance is added first, then each pair of columns, so a product serves four pixels.
    fn row(&self, plane: &Plane<f32>, row: usize, values: &mut [f32]) {
        let (width, height, reach) = (plane.width_px(), plane.height_px(), self.radius);
        // What the kernel's parts above and below zero bring.
        let mut sums = [vec![0.0_f64; width], vec![0.0_f64; width]];
        let mut padded = vec![0.0_f64; width + 2 * reach];
        for y in 0..=reach {
            let above = plane.row(mirrored(row + height * reach - y, height, reach));
            let below = plane.row(mirrored(row + height * reach + y, height, reach));
            for x in 0..width {
                padded[reach + x] = if y == 0 { above[x].into() } else { f64::from(above[x]) + f64::from(below[x]) };
            }
            for x in 0..reach {
                padded[x] = padded[reach + mirrored(x + width * reach - reach, width, reach)];
                padded[reach + width + x] = padded[reach + mirrored(width + x + width * reach, width, reach)];
            }
            for (x, &share) in self.quadrant[y * (reach + 1)..(y + 1) * (reach + 1)].iter().enumerate() {
                let sums = &mut sums[usize::from(share < 0.0)];
                let (left, right) = (&padded[reach - x..][..width], &padded[reach + x..][..width]);
                let share = if x == 0 { 0.5 * share.abs() } else { share.abs() };
                for ((sum, left), right) in sums.iter_mut().zip(left).zip(right) {
                    *sum += share * (left + right);
                }
            }
        }
        let [gains, losses] = sums;
        for ((value, gain), loss) in values.iter_mut().zip(gains).zip(losses) {
            *value = f32_nearest(gain - lesser(loss, 0.5 * gain));
        }
    }
}

/// An index into a row of values that continues as its mirror image: `shifted` is the index plus `length` times `reach`.
fn mirrored(shifted: usize, length: usize, reach: usize) -> usize {
    // Whole periods of two lengths lie before the first value, or one length less.
    let in_period = (shifted + length * (reach % 2)) % (2 * length);
    if in_period < length { in_period } else { 2 * length - 1 - in_period }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Size;

    fn psf(f_number: f64, defocus_um: f64, aberration_um: f64) -> Psf {
        Psf { diffraction: f_number > 0.0, f_number, defocus_um, aberration_um }
    }

    /// Transform of a kernel along a row.
    fn transform(kernel: &BlurKernel, cycles_per_px: f64) -> f64 {
        let twice = |offset: usize| if offset == 0 { 1.0 } else { 2.0 };
        let mut sum = 0.0;
        for y in 0..=kernel.radius() {
            for x in 0..=kernel.radius() {
                sum += twice(x) * twice(y) * kernel.at(x, y) * libm::cos(TAU * cycles_per_px * f64_from_usize(x));
            }
        }
        sum
    }

    #[test]
    fn mirrored_indices_go_back_and_forth() {
        for (length, reach) in [(5, 3), (5, 4), (3, 8), (1, 4)] {
            let line: Vec<usize> =
                (0..length + 2 * reach).map(|at| mirrored(at + length * reach - reach, length, reach)).collect();
            for (at, &mirrored_at) in line.iter().enumerate() {
                // Walked by hand from the middle: a step outwards, turning at the ends with the end counted twice.
                let mut expected = i64::try_from(at).unwrap() - i64::try_from(reach).unwrap();
                let last = i64::try_from(length).unwrap() - 1;
                while expected < 0 || expected > last {
                    expected = if expected < 0 { -1 - expected } else { 2 * last + 1 - expected };
                }
                assert_eq!(i64::try_from(mirrored_at).unwrap(), expected, "{length} {reach} {at}");
            }
        }
    }

    #[test]
    fn modulation_meets_its_two_limits() {
        // Half the cut-off of an ideal lens: (2/pi)(acos(1/2) - sqrt(3)/4).
        let cutoff = 1.0 / (0.55 * 2.0);
        let half = psf(2.0, 0.0, 0.0).modulation(0.5 * cutoff, 0.55);
        assert!((half - 0.391_002_218_955).abs() < 1e-11, "{half}");
        assert_eq!(psf(2.0, 0.0, 0.0).modulation(cutoff, 0.55), 0.0);
        // A disc of 10 um at 0.05 / um: 2 J1(pi/2) / (pi/2), J1(pi/2) = 0.566824088906. Simpson with 96 steps: 1e-9.
        let disc = psf(0.0, 10.0, 0.0).modulation(0.05, 0.55);
        assert!((disc - 2.0 * 0.566_824_088_906 / (0.5 * PI)).abs() < 1e-9, "{disc}");
        // Hopkins' integral by a thousand times finer mid-points; their error falls with the square root's end to 1e-7.
        let both = psf(2.0, 10.0, 0.0).modulation(0.1, 0.55);
        let (s, n) = (0.11, 100_000_u32);
        let mut sum = 0.0;
        for k in 0..n {
            let x = (f64::from(k) + 0.5) * (1.0 - s) / f64::from(n);
            sum += (1.0 - (x + s) * (x + s)).sqrt() * libm::cos(PI * x);
        }
        assert!((both - sum * 4.0 / PI * (1.0 - s) / f64::from(n)).abs() < 1e-6, "{both}");
    }

    #[test]
    fn kernels_transfer_what_the_lens_does() {
        let mut tried = 0;
        for (lens, wavelength_um, pitch_um) in [
            (psf(2.0, 0.0, 0.0), 0.55, 3.0),
            (psf(1.4, 0.0, 0.0), 0.45, 2.2),
            (psf(2.8, 0.0, 0.0), 0.85, 3.0),
            (psf(4.0, 0.0, 0.0), 0.65, 2.2),
            (psf(8.0, 0.0, 0.0), 0.55, 1.4),
            (psf(2.0, 0.0, 3.0), 0.55, 3.0),
            (psf(2.0, 12.0, 0.0), 0.55, 3.0),
            (psf(0.0, 12.0, 1.5), 0.55, 3.0),
            (psf(2.0, 0.0, 0.5), 0.55, 3.0),
            (psf(2.0, 0.0, 1.0), 0.55, 3.0),
            (psf(2.0, 3.0, 0.0), 0.55, 3.0),
            (psf(0.0, 0.0, 1.0), 0.55, 3.0),
        ] {
            let kernel = lens.kernel(wavelength_um, pitch_um);
            assert!((kernel.sum() - 1.0).abs() < 1e-14);
            let mut off = 0.0_f64;
            for step in 0..=100_u32 {
                let cycles_per_px = 0.005 * f64::from(step);
                let error =
                    transform(&kernel, cycles_per_px) - lens.modulation(cycles_per_px / pitch_um, wavelength_um);
                off = off.max(error.abs());
            }
            let (radius, lobes) = (kernel.radius(), kernel.lobes());
            println!(
                "{lens:?} at {wavelength_um} um, {pitch_um} um: radius {radius}, lobes {lobes:.4}, off by {off:.4}"
            );
            // What the reach was chosen for, with a fifth to spare.
            assert!(off < 0.01, "{lens:?}: {off}");
            assert!(lobes < 0.12, "{lens:?}: {lobes}");
            tried += 1;
        }
        assert_eq!(tried, 12);
    }

    #[test]
    fn blur_keeps_the_sum_and_makes_no_rim() {
        let size = Size { width_px: 37, height_px: 29 };
        let kernel = psf(2.8, 6.0, 1.0).kernel(0.55, 3.0);
        let mut even = Plane::filled(size, 100.0_f32);
        // One rounding to f32 of a sum that f64 keeps to 1e-14.
        assert!(kernel.blurred(&even).values().iter().all(|&value| (value - 100.0).abs() <= 1e-5));
        for (x, y) in [(18, 14), (0, 0), (36, 5)] {
            even.row_mut(y)[x] += 300.0;
        }
        let sum = |plane: &Plane<f32>| plane.values().iter().map(|&value| f64::from(value)).sum::<f64>();
        let blurred = kernel.blurred(&even);
        // f32 rounds each value by 6e-8 of it.
        assert!((sum(&blurred) / sum(&even) - 1.0).abs() < 1e-6);
        let bright = f64::from(blurred.at(18, 14)) - 100.0;
        assert!((bright / 300.0 / kernel.at(0, 0) - 1.0).abs() < 1e-5, "{bright}");
    }

    #[test]
    fn a_lamp_in_the_dark_leaves_no_pixel_below_zero() {
        let kernel = psf(0.0, 0.0, 1.0).kernel(0.55, 3.0);
        let mut plane = Plane::filled(Size { width_px: 31, height_px: 31 }, 1.0_f32);
        plane.row_mut(15)[15] = 1e6;
        let blurred = kernel.blurred(&plane);
        assert!(
            blurred.values().iter().all(|&value| value > 0.4),
            "half of what is above zero of an even plane of 1 stays"
        );
        assert!(kernel.lobes() > 0.01, "the case is to have lobes");
    }
}
