//! Exact integer sums of the frames. Computes means and variances of every point, and from the stacks the inputs of spatial figures and of
//! the temporal noise's shape. Memory does not grow with the number of frames.

use super::set::{PlannedShot, Set};
use crate::num::{f64_from_i64, f64_from_u64, f64_from_usize, u64_from};
use crate::plane::Plane;
use crate::units::Size;

/// A point of photon transfer, in DN and DN^2.
#[derive(Clone, Copy, Debug, Default, PartialEq, serde::Serialize)]
pub struct TransferPoint {
    /// In nanoseconds.
    pub exposure_ns: f64,
    /// Photons on a pixel.
    pub photons: f64,
    /// Mean under light, mu_y.
    pub mean_dn: f64,
    /// Temporal variance under light, sigma_y^2.
    pub variance_dn2: f64,
    /// Mean in the dark, mu_y.dark.
    pub dark_mean_dn: f64,
    /// Temporal variance in the dark, sigma_y.dark^2.
    pub dark_variance_dn2: f64,
}

/// All points with the number of pixels that each is averaged over.
#[derive(Clone, Debug, PartialEq)]
pub struct PhotonTransfer {
    /// Exposure rising.
    pub points: Vec<TransferPoint>,
    /// Pixels of a frame.
    pub pixels: f64,
}

/// Everything that was measured on one channel.
#[derive(Clone, Debug)]
pub struct ChannelMeasurement {
    /// Photon transfer.
    pub transfer: PhotonTransfer,
    /// Stack under light at half saturation.
    pub bright: StackSums,
    /// Stack in the dark of the same exposure.
    pub dark: StackSums,
    /// Share of codes 0 in the dark stack.
    pub dark_clipped: f64,
    first: Option<Vec<u16>>,
}

impl ChannelMeasurement {
    /// Ready for the set's first frame.
    pub fn new(set: &Set) -> Self {
        Self::of_points(set.size, &set.points)
    }

    /// Ready for the first frame of a series of these exposures, and of stacks.
    pub fn of_points(size: Size, exposures: &[super::set::SeriesExposure]) -> Self {
        let point = |exposure: &super::set::SeriesExposure| TransferPoint {
            exposure_ns: f64_from_u64(exposure.exposure_ns),
            photons: exposure.photons,
            ..TransferPoint::default()
        };
        Self {
            transfer: PhotonTransfer {
                points: exposures.iter().map(point).collect(),
                pixels: f64_from_usize(size.pixel_count()),
            },
            bright: StackSums::new(size),
            dark: StackSums::new(size),
            dark_clipped: 0.0,
            first: None,
        }
    }

    /// Takes the next frame. Panics if frames come in another order than the set's.
    pub fn add(&mut self, shot: &PlannedShot, codes: &Plane<u16>) {
        let Some(index) = shot.point else {
            if shot.is_lit {
                self.bright.add(codes);
            } else {
                self.dark.add(codes);
                let zeros = codes.values().iter().filter(|&&code| code == 0).count();
                let frames = f64_from_u64(self.dark.frames);
                let share = f64_from_usize(zeros) / self.transfer.pixels;
                self.dark_clipped += (share - self.dark_clipped) / frames;
            }
            return;
        };
        if shot.is_first {
            self.first = Some(codes.values().to_vec());
            return;
        }
        let first = self.first.take().expect("the first frame of a point comes before its second");
        let (mean, variance) = pair(&first, codes.values());
        let point = &mut self.transfer.points[index];
        if shot.is_lit {
            (point.mean_dn, point.variance_dn2) = (mean, variance);
        } else {
            (point.dark_mean_dn, point.dark_variance_dn2) = (mean, variance);
        }
    }

    /// Mean dark frame about its mean.
    pub fn dark_pattern_dn(&self) -> Vec<f64> {
        centred(self.dark.means_dn())
    }

    /// Mean bright frame less the mean dark frame, in % about its mean.
    pub fn response_percent(&self) -> Vec<f64> {
        let signal: Vec<f64> = self.bright.means_dn().iter().zip(self.dark.means_dn()).map(|(a, b)| a - b).collect();
        let mean = signal.iter().sum::<f64>() / f64_from_usize(signal.len());
        signal.iter().map(|value| 100.0 * (value / mean - 1.0)).collect()
    }
}

/// Values about their mean.
pub(super) fn centred(values: Vec<f64>) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / f64_from_usize(values.len());
    values.iter().map(|value| value - mean).collect()
}

/// Mean and temporal variance of two frames (release 4.0, section 6.4): the variance is half the mean square of the difference, less
/// half the square of the mean difference.
fn pair(first: &[u16], second: &[u16]) -> (f64, f64) {
    let (mut sum, mut difference, mut squares) = (0_u64, 0_i64, 0_u64);
    for (&a, &b) in first.iter().zip(second) {
        let step = i64::from(b) - i64::from(a);
        sum += u64::from(a) + u64::from(b);
        difference += step;
        squares += step.unsigned_abs() * step.unsigned_abs();
    }
    let pixels = f64_from_usize(first.len());
    let mean_difference = f64_from_i64(difference) / pixels;
    let variance = f64_from_u64(squares) / (2.0 * pixels) - 0.5 * mean_difference * mean_difference;
    (f64_from_u64(sum) / (2.0 * pixels), variance)
}

/// Sums of a stack, exact in integers: 2,000 frames of 16 bits stay below 2^59 in every sum.
#[derive(Clone, Debug)]
pub struct StackSums {
    /// Width and height.
    pub size: Size,
    /// Frames so far.
    pub frames: u64,
    /// Of each pixel, its codes' sum.
    pub sums: Vec<u64>,
    squares: Vec<u64>,
    cubes: Vec<u64>,
    /// Products of each code with the next frame's.
    products: Vec<u64>,
    first: Vec<u16>,
    last: Vec<u16>,
    row_squares: Vec<u64>,
    column_squares: Vec<u64>,
    /// How often each code occurs in all frames, up to the greatest one.
    counts: Vec<u64>,
}

impl StackSums {
    fn new(size: Size) -> Self {
        let pixels = size.pixel_count();
        let zeros = || vec![0_u64; pixels];
        Self {
            size,
            frames: 0,
            sums: zeros(),
            squares: zeros(),
            cubes: zeros(),
            products: zeros(),
            first: Vec::new(),
            last: Vec::new(),
            row_squares: vec![0; crate::num::index(size.height_px)],
            column_squares: vec![0; crate::num::index(size.width_px)],
            counts: Vec::new(),
        }
    }

    fn add(&mut self, codes: &Plane<u16>) {
        assert!(codes.size() == self.size, "all frames of a stack have one size");
        let values = codes.values();
        for (index, &code) in values.iter().enumerate() {
            let value = u64::from(code);
            self.sums[index] += value;
            self.squares[index] += value * value;
            self.cubes[index] += value * value * value;
            let code = usize::from(code);
            if self.counts.len() <= code {
                self.counts.resize(code + 1, 0);
            }
            self.counts[code] += 1;
        }
        for (product, (&last, &code)) in self.products.iter_mut().zip(self.last.iter().zip(values)) {
            *product += u64::from(last) * u64::from(code);
        }
        let mut columns = vec![0_u64; codes.width_px()];
        for (total, (_, row)) in self.row_squares.iter_mut().zip(codes.rows()) {
            let sum: u64 = row.iter().map(|&code| u64::from(code)).sum();
            *total += sum * sum;
            columns.iter_mut().zip(row).for_each(|(column, &code)| *column += u64::from(code));
        }
        self.column_squares.iter_mut().zip(&columns).for_each(|(total, &sum)| *total += sum * sum);
        if self.first.is_empty() {
            self.first = values.to_vec();
        }
        self.last = values.to_vec();
        self.frames += 1;
    }

    /// Codes of the first frame.
    pub fn first(&self) -> &[u16] {
        &self.first
    }

    /// Last frame less first one, over the root of two: the temporal noise of a frame, free of the pattern.
    pub fn noise_dn(&self) -> Vec<f64> {
        let pairs = self.last.iter().zip(&self.first);
        pairs.map(|(&last, &first)| (f64::from(last) - f64::from(first)) * std::f64::consts::FRAC_1_SQRT_2).collect()
    }

    /// How often each code occurs in all frames, from code 0 to the greatest.
    pub fn counts(&self) -> &[u64] {
        &self.counts
    }

    /// Mean code of each pixel.
    pub fn means_dn(&self) -> Vec<f64> {
        let frames = f64_from_u64(self.frames);
        self.sums.iter().map(|&sum| f64_from_u64(sum) / frames).collect()
    }

    /// L times the sum of squares less the square of the sum, of one pixel: L^2 times its squared residuals' mean.
    fn pseudo_variance(&self, index: usize) -> u64 {
        self.frames * self.squares[index] - self.sums[index] * self.sums[index]
    }

    /// Temporal variance of one pixel, unbiased.
    pub fn pixel_variance_dn2(&self, index: usize) -> f64 {
        let frames = f64_from_u64(self.frames);
        f64_from_u64(self.pseudo_variance(index)) / (frames * (frames - 1.0))
    }

    /// Temporal variance, unbiased, averaged over pixels.
    pub fn variance_dn2(&self) -> f64 {
        let frames = f64_from_u64(self.frames);
        let total: f64 = (0..self.sums.len()).map(|index| f64_from_u64(self.pseudo_variance(index))).sum();
        total / (frames * (frames - 1.0) * f64_from_usize(self.sums.len()))
    }

    /// Third cumulant of the temporal noise, unbiased (k-statistic), averaged over pixels.
    pub fn third_dn3(&self) -> f64 {
        let count = i128::from(self.frames);
        let third = |index: usize| {
            // L^2 times the sum of cubed residuals, in integers.
            let (s1, s2) = (i128::from(self.sums[index]), i128::from(self.squares[index]));
            let s3 = i128::from(self.cubes[index]);
            f64_from_i128(count * count * s3 - 3 * count * s1 * s2 + 2 * s1 * s1 * s1)
        };
        let frames = f64_from_u64(self.frames);
        let total: f64 = (0..self.sums.len()).map(third).sum();
        total / (frames * (frames - 1.0) * (frames - 2.0) * f64_from_usize(self.sums.len()))
    }

    /// Correlation of a pixel's residual with the next frame's, free of what taking off the pixel's own mean does to it.
    pub fn frame_correlation(&self) -> f64 {
        let frames = f64_from_u64(self.frames);
        let count = i128::from(self.frames);
        let (mut products, mut squares) = (0.0, 0.0);
        for index in 0..self.sums.len() {
            let sum = i128::from(self.sums[index]);
            let ends = i128::from(self.first[index]) + i128::from(self.last[index]);
            // L^2 times the sum of products of residuals.
            let product = count * count * i128::from(self.products[index]) - count * sum * (2 * sum - ends)
                + (count - 1) * sum * sum;
            products += f64_from_i128(product);
            squares += f64_from_u64(self.pseudo_variance(index));
        }
        (products / squares + 1.0) / (frames - 1.0)
    }

    /// Temporal variance that a whole row shares, and that a whole column shares, as shares of the pixels' temporal variance.
    pub fn shared_noise(&self) -> (f64, f64) {
        let (width, height) = (crate::num::index(self.size.width_px), crate::num::index(self.size.height_px));
        let mut rows = vec![0_u64; height];
        let mut columns = vec![0_u64; width];
        for (index, &sum) in self.sums.iter().enumerate() {
            rows[index / width] += sum;
            columns[index % width] += sum;
        }
        let squares: f64 = (0..self.sums.len()).map(|index| f64_from_u64(self.pseudo_variance(index))).sum();
        let share = |sums: &[u64], square_sums: &[u64], length: usize| {
            let count = u128::from(self.frames);
            let pairs = sums.iter().zip(square_sums);
            let total: f64 = pairs
                .map(|(&sum, &square)| {
                    crate::num::f64_from_u128(count * u128::from(square) - u128::from(sum) * u128::from(sum))
                })
                .sum();
            // Mean square of line means over mean square of pixels: the number of lines over that of pixels is 1 / length.
            total / (squares * f64_from_u64(u64_from(length))) - 1.0 / f64_from_u64(u64_from(length))
        };
        (share(&rows, &self.row_squares, width), share(&columns, &self.column_squares, height))
    }
}

/// As `f64`, rounded to the nearest.
fn f64_from_i128(value: i128) -> f64 {
    let size = crate::num::f64_from_u128(value.unsigned_abs());
    if value < 0 { -size } else { size }
}
