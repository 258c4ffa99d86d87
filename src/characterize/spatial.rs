//! Spatial figures of a stack's mean frame. Splits the spatial variance into rows, columns and pixels (EMVA 1288 release 4.0, section 8.2,
//! equations 36 to 44), and computes profiles (8.5) and spectrograms (8.4).

use super::measure::StackSums;
use crate::num::{f64_from_u64, f64_from_usize};

/// Parts of the temporal variance in the dark that all pixels of a row, and of a column, have in common.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SharedVariance {
    /// Of a row, in DN^2.
    pub row_dn2: f64,
    /// Of a column, in DN^2.
    pub column_dn2: f64,
}

/// Spatial variances of one stack, freed from temporal noise.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct SpatialVariances {
    pub mean_dn: f64,
    /// Temporal variance, averaged over pixels: sigma_y.stack^2.
    pub stack_variance_dn2: f64,
    /// s_y^2.
    pub total_dn2: f64,
    /// s_y.row^2.
    pub row_dn2: f64,
    /// s_y.col^2.
    pub column_dn2: f64,
    /// s_y.pixel^2.
    pub pixel_dn2: f64,
    /// Frames of the stack.
    pub frames: f64,
    /// M.
    pub rows: f64,
    /// N.
    pub columns: f64,
}

/// Means of each row and each column.
pub fn line_means(values: &[f64], width: usize) -> (Vec<f64>, Vec<f64>) {
    let height = values.len() / width;
    let mut columns = vec![0.0; width];
    let mut rows = Vec::with_capacity(height);
    for row in values.chunks_exact(width) {
        rows.push(row.iter().sum::<f64>() / f64_from_usize(width));
        columns.iter_mut().zip(row).for_each(|(column, value)| *column += value);
    }
    columns.iter_mut().for_each(|column| *column /= f64_from_usize(height));
    (rows, columns)
}

/// Variances of a stack.
pub fn parts(stack: &StackSums) -> SpatialVariances {
    let means = stack.means_dn();
    let width = crate::num::index(stack.size.width_px);
    let (rows, columns): (f64, f64) = (stack.size.height_px.into(), stack.size.width_px.into());
    let frames = f64_from_u64(stack.frames);
    let count = rows * columns;
    let mean = means.iter().sum::<f64>() / count;
    let squares = |values: &[f64]| values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>();
    let stack_variance = stack.variance_dn2();
    // Equation 36: what temporal noise leaves in the mean of L frames is taken off.
    let total = squares(&means) / (count - 1.0) - stack_variance / frames;
    let (row_means, column_means) = line_means(&means, width);
    // Equation 41: the same for means of rows and columns.
    let column_average = squares(&column_means) / columns - stack_variance / (frames * rows);
    let row_average = squares(&row_means) / rows - stack_variance / (frames * columns);
    // Equations 42 to 44 solve for the parts, since a mean of a column holds 1 / M of the pixels' variance as well.
    let rest = count - rows - columns;
    SpatialVariances {
        mean_dn: mean,
        stack_variance_dn2: stack_variance,
        total_dn2: total,
        row_dn2: (count - columns) / rest * row_average - rows / rest * (total - column_average),
        column_dn2: (count - rows) / rest * column_average - columns / rest * (total - row_average),
        pixel_dn2: count / rest * (total - column_average - row_average),
        frames,
        rows,
        columns,
    }
}

/// Mean, least and greatest value of each line of a frame.
#[derive(Clone, Debug, PartialEq)]
pub struct Profile {
    pub mean: Vec<f64>,
    pub least: Vec<f64>,
    pub most: Vec<f64>,
}

/// Horizontal profile (one value per column) and vertical profile (one value per row).
pub fn profiles(values: &[f64], width: usize) -> (Profile, Profile) {
    let (row_means, column_means) = line_means(values, width);
    let bounds = |line: &mut dyn Iterator<Item = f64>| {
        line.fold((f64::INFINITY, f64::NEG_INFINITY), |(low, high), value| {
            (crate::num::lesser(low, value), crate::num::greater(high, value))
        })
    };
    let columns: Vec<(f64, f64)> =
        (0..width).map(|column| bounds(&mut values.iter().skip(column).step_by(width).copied())).collect();
    let rows: Vec<(f64, f64)> = values.chunks_exact(width).map(|row| bounds(&mut row.iter().copied())).collect();
    let profile = |mean: Vec<f64>, bounds: Vec<(f64, f64)>| Profile {
        mean,
        least: bounds.iter().map(|bound| bound.0).collect(),
        most: bounds.iter().map(|bound| bound.1).collect(),
    };
    (profile(column_means, columns), profile(row_means, rows))
}

/// Power spectrum along rows, averaged over rows: |DFT|^2 / N of the deviation from the frame's mean, for 0 to 1/2 cycles a pixel. White
/// noise of variance s^2 lies at s^2 everywhere.
pub fn spectrogram(values: &[f64], width: usize) -> Vec<f64> {
    let mean = values.iter().sum::<f64>() / f64_from_usize(values.len());
    let angle = std::f64::consts::TAU / f64_from_usize(width);
    let turns: Vec<(f64, f64)> = (0..width).map(|step| libm::sincos(angle * f64_from_usize(step))).collect();
    let height = f64_from_usize(values.len() / width);
    let mut power = vec![0.0; width / 2 + 1];
    let mut line = vec![0.0; width];
    for row in values.chunks_exact(width) {
        line.iter_mut().zip(row).for_each(|(deviation, value)| *deviation = value - mean);
        for (frequency, power) in power.iter_mut().enumerate() {
            let (mut real, mut imaginary, mut step) = (0.0, 0.0, 0);
            for deviation in &line {
                let (sine, cosine) = turns[step];
                real += deviation * cosine;
                imaginary += deviation * sine;
                step += frequency;
                step = if step >= width { step - width } else { step };
            }
            *power += (real * real + imaginary * imaginary) / (f64_from_usize(width) * height);
        }
    }
    power
}

/// Rows become columns.
pub fn transposed(values: &[f64], width: usize) -> Vec<f64> {
    (0..width).flat_map(|column| values.iter().skip(column).step_by(width).copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_wave_along_rows_is_one_line_of_the_spectrogram() {
        let wave = |x: u32| libm::cos(std::f64::consts::TAU * 3.0 * f64::from(x) / 16.0);
        let values: Vec<f64> = (0..4).flat_map(|_| (0..16).map(wave)).collect();
        let found = spectrogram(&values, 16);
        // Of amplitude 1: |sum|^2 / N = (N/2)^2 / N = N / 4.
        for (frequency, power) in found.iter().enumerate() {
            let expected = if frequency == 3 { 4.0 } else { 0.0 };
            assert!((power - expected).abs() < 1e-12, "{frequency}: {power}");
        }
    }

    #[test]
    fn profiles_hold_mean_and_bounds_of_each_line() {
        let values = [1.0, 2.0, 3.0, 5.0, 4.0, 9.0];
        let (across, down) = profiles(&values, 3);
        assert_eq!(across.mean, [3.0, 3.0, 6.0]);
        assert_eq!((across.least, across.most), (vec![1.0, 2.0, 3.0], vec![5.0, 4.0, 9.0]));
        assert_eq!((down.mean, down.most), (vec![2.0, 6.0], vec![3.0, 9.0]));
        assert_eq!(transposed(&values, 3), [1.0, 5.0, 2.0, 4.0, 3.0, 9.0]);
    }
}
