//! Logarithmic histograms of pixels (EMVA 1288 release 4.0, section 8, defect pixels). Computes counts by bin, the normal of the same mean
//! and variance, and the share of pixels beyond each deviation.

use serde::Serialize;

use crate::num::{f64_from_i64, f64_from_u64, f64_from_usize, index, u32_from};

/// Most bins of a histogram (the standard's 256).
const BINS_MAX: i64 = 256;

/// Counts over deviation.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Histogram {
    /// Lower end of each bin, in the histogram's unit, about the mean.
    pub bins: Vec<f64>,
    /// Pixels in it.
    pub counts: Vec<u64>,
    /// Pixels that a normal of the same mean and variance would have there.
    pub normal: Vec<f64>,
    /// Lower ends of the bins of absolute deviation.
    pub deviation: Vec<f64>,
    /// Share of pixels in % that deviate at least so much.
    pub beyond_percent: Vec<f64>,
    /// Pixels beyond 5 standard deviations: a normal leaves 6 in ten million.
    pub beyond_5_sigma: u64,
}

/// Of integer values, each `unit` long (for a sum of L frames: 1 / L DN).
pub fn histogram(values: &[i64], unit: f64) -> Histogram {
    let count = f64_from_usize(values.len());
    let mean = values.iter().map(|&value| f64_from_i64(value)).sum::<f64>() / count;
    let square = |value: &i64| (f64_from_i64(*value) - mean) * (f64_from_i64(*value) - mean);
    let sigma = (values.iter().map(square).sum::<f64>() / count).sqrt();
    let (starts, counts, width) = binned(values.iter().copied());
    let normal = |start: &f64| {
        let z = (start + 0.5 * (width - 1.0) - mean) / sigma;
        if sigma > 0.0 { count * width / (sigma * 2.506_628_274_631) * libm::exp(-0.5 * z * z) } else { 0.0 }
    };
    let centre = crate::num::i64_half_even(mean);
    let (deviations, mut beyond, _) = binned(values.iter().map(|value| (value - centre).abs()));
    for at in (1..beyond.len()).rev() {
        beyond[at - 1] += beyond[at];
    }
    let far = values.iter().filter(|&&value| (f64_from_i64(value) - mean).abs() > 5.0 * sigma).count();
    Histogram {
        normal: starts.iter().map(normal).collect(),
        bins: starts.iter().map(|start| (start - mean) * unit).collect(),
        counts,
        deviation: deviations.iter().map(|start| start * unit).collect(),
        beyond_percent: beyond.iter().map(|&pixels| 100.0 * f64_from_u64(pixels) / count).collect(),
        beyond_5_sigma: u32_from(far).into(),
    }
}

/// Starts, counts and width of at most 256 bins of whole width.
fn binned(values: impl Iterator<Item = i64> + Clone) -> (Vec<f64>, Vec<u64>, f64) {
    let (least, most) =
        values.clone().fold((i64::MAX, i64::MIN), |(low, high), value| (low.min(value), high.max(value)));
    let span = most - least;
    let width = if span + 1 > BINS_MAX { span / BINS_MAX + 1 } else { 1 };
    let bins = u32::try_from(span / width + 1).expect("at most 256 bins");
    let mut counts = vec![0; index(bins)];
    for value in values {
        counts[usize::try_from((value - least) / width).expect("values are at least the least")] += 1;
    }
    let starts = (0..i64::from(bins)).map(|bin| f64_from_i64(least + bin * width)).collect();
    (starts, counts, f64_from_i64(width))
}

/// Twenty-five times the deviation of each pixel from the mean of the 5 x 5 around it: the standard's high pass for the photo response,
/// which takes slow shading off. Pixels within two of the border are left out.
pub fn high_passed(values: &[i64], width: usize) -> Vec<i64> {
    let height = values.len() / width;
    let mut found = Vec::new();
    for y in 2..height.saturating_sub(2) {
        for x in 2..width.saturating_sub(2) {
            let rows = (y - 2..=y + 2).map(|row| &values[row * width + x - 2..=row * width + x + 2]);
            let around: i64 = rows.flatten().sum();
            found.push(25 * values[y * width + x] - around);
        }
    }
    found
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_pixel_is_counted_once_and_shares_fall_from_all_to_the_farthest() {
        let values: Vec<i64> = (0..1000).map(|value| value * value % 977).chain([5000]).collect();
        let found = histogram(&values, 0.5);
        assert_eq!(found.counts.iter().sum::<u64>(), 1001);
        assert!(found.counts.len() <= 256 && found.beyond_percent[0] == 100.0);
        assert!(found.beyond_percent.is_sorted_by(|a, b| a >= b));
        assert_eq!(found.beyond_5_sigma, 1);
    }

    #[test]
    fn the_high_pass_takes_a_slope_off_and_keeps_a_hot_pixel() {
        let width = 9;
        let mut values: Vec<i64> = (0..81).map(|pixel| 3 * (pixel % 9) + 7 * (pixel / 9)).collect();
        assert!(high_passed(&values, width).iter().all(|&value| value == 0));
        values[4 * 9 + 4] += 10;
        let found = high_passed(&values, width);
        assert_eq!((found.len(), found[12], found[0]), (25, 240, -10));
    }
}
