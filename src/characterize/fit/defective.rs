//! Defective pixels of a sensor's stacks: hot, dead, stuck, and noisier than chance. A fit leaves them out of all other figures, so that a
//! few of them do not pass for the spread of all pixels, and says how many a sensor of this kind has.
//!
//! Rows and columns have offsets of their own, so a pixel is compared after the medians of its row and of its column are taken off (Tukey's
//! median polish), and against a spread that outliers do not move: 1.4826 times the median absolute deviation.

use serde::Serialize;
use statrs::distribution::{ChiSquared, ContinuousCDF as _};

use crate::characterize::measure::StackSums;
use crate::characterize::set::PlannedShot;
use crate::num::{f64_from_u64, f64_from_usize, greater, index, lesser, low_u16, low_u32, u64_half_even};
use crate::plane::Plane;

/// Robust standard deviations beyond which a pixel is an outlier: a normal leaves one in a thousand million there.
const OUTLIER_SIGMAS: f64 = 6.0;
/// The same as a tail of the chi-squared distribution of a pixel's temporal variance.
const OUTLIER_TAIL: f64 = 1e-9;
/// Least distance of an outlier, for sensors without any spread.
const OUTLIER_DN_MIN: f64 = 0.5;
/// Standard deviation of a normal over its median absolute deviation.
const SIGMA_OVER_MAD: f64 = 1.4826;
/// Share of the median response below which a pixel is dead.
const DEAD_SHARE: f64 = 0.2;

/// A pixel whose dark signal is far above that of its neighbours.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct HotPixel {
    /// Number of the pixel, row by row.
    pub pixel: usize,
    /// Dark signal beyond that of its row and column, at the exposure of the stacks.
    pub excess_dn: f64,
    /// Whether it reaches its full well or the greatest code, so that the excess is a lower bound.
    pub is_clipped: bool,
}

/// A pixel whose temporal noise in the dark is beyond chance.
#[derive(Clone, Copy, Debug, PartialEq, Serialize)]
pub struct NoisyPixel {
    /// Number of the pixel, row by row.
    pub pixel: usize,
    /// Its variance over that of a sound pixel.
    pub variance_ratio: f64,
}

/// A sound pixel that stands for a defective one.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Substitute {
    pixel: usize,
    sound: usize,
    /// What the defective pixel's row and column have more in the dark.
    dark_step_dn: f64,
    /// And more of each DN of signal.
    response_step: f64,
}

/// The defective pixels of a sensor's stacks.
#[derive(Clone, Debug, Default, PartialEq, Serialize)]
pub struct DefectivePixels {
    /// Pixels with additional dark current.
    pub hot: Vec<HotPixel>,
    /// Candidates for random telegraph noise.
    pub noisy: Vec<NoisyPixel>,
    /// Pixels that see no light, by number.
    pub dead: Vec<usize>,
    /// Pixels at one end of the range in every frame, by number.
    pub stuck: Vec<usize>,
    /// Pixels of unusual offset or response that are none of these, and count in the patterns.
    pub others: usize,
    /// Excess from which on a pixel is hot.
    pub hot_from_dn: f64,
    /// Ratio of variances from which on a pixel is noisy.
    pub noisy_from_ratio: f64,
    /// Temporal variance of a sound pixel in the dark.
    pub sound_variance_dn2: f64,
    /// Dark signal of hot pixels beyond that of sound ones: [exposure in ns, mean excess in DN] of each dark pair, clipped pixels left out.
    pub rise: Vec<[f64; 2]>,
    /// Pixels of a frame.
    pub pixels: usize,
    /// Frames of the dark stack that differ from each other.
    pub frames: u64,
    #[serde(skip)]
    substitutes: Vec<Substitute>,
    /// Mean code of the dark stack.
    #[serde(skip)]
    dark_dn: f64,
    #[serde(skip)]
    code_max: u16,
}

impl DefectivePixels {
    /// Of both stacks, of whose dark frames so many differ, and of the dark frame of the shortest exposure.
    pub fn find(bright: &StackSums, dark: &StackSums, frames: u64, shortest: &[u16], bits: u32) -> Self {
        let width = index(dark.size.width_px);
        let most = low_u16((1 << bits) - 1);
        let code_max = f64::from(most);
        let (means, lit) = (dark.means_dn(), bright.means_dn());
        let signals: Vec<f64> = lit.iter().zip(&means).map(|(lit, dark)| lit - dark).collect();
        let usual_dn = median(&signals);
        let residuals = polished(&means, width);
        let hot_from_dn = greater(OUTLIER_SIGMAS * spread(&residuals), OUTLIER_DN_MIN);
        let responses = polished(&signals, width);
        let response_from_dn = greater(OUTLIER_SIGMAS * spread(&responses), OUTLIER_DN_MIN);
        let variances: Vec<f64> = (0..means.len()).map(|pixel| dark.pixel_variance_dn2(pixel)).collect();
        let freedom = greater(f64_from_u64(frames) - 1.0, 1.0);
        let [middle, far] = chi_squared_over_freedom(freedom, [0.5, 1.0 - OUTLIER_TAIL]);
        let sound_variance_dn2 = median(&variances) / middle;
        let mut found = Self {
            hot_from_dn,
            noisy_from_ratio: far,
            sound_variance_dn2,
            pixels: means.len(),
            frames,
            dark_dn: means.iter().sum::<f64>() / f64_from_usize(means.len()),
            code_max: most,
            ..Self::default()
        };
        let mut is_sound = vec![true; means.len()];
        for pixel in 0..means.len() {
            let (mean, excess_dn) = (means[pixel], residuals[pixel]);
            let is_still = variances[pixel] == 0.0 && bright.pixel_variance_dn2(pixel) == 0.0 && mean == lit[pixel];
            let variance_ratio = variances[pixel] / sound_variance_dn2;
            is_sound[pixel] = false;
            if is_still && (mean == 0.0 || mean == code_max) && f64::from(shortest[pixel]) == mean {
                found.stuck.push(pixel);
            } else if excess_dn > hot_from_dn {
                // A pixel that is full in the dark gains nothing by light.
                let is_clipped = mean > code_max - 1.0 || signals[pixel] < DEAD_SHARE * usual_dn;
                found.hot.push(HotPixel { pixel, excess_dn, is_clipped });
            } else if signals[pixel] < DEAD_SHARE * usual_dn {
                found.dead.push(pixel);
            } else if variance_ratio > far {
                found.noisy.push(NoisyPixel { pixel, variance_ratio });
            } else {
                is_sound[pixel] = true;
                found.others += usize::from(excess_dn < -hot_from_dn || responses[pixel].abs() > response_from_dn);
            }
        }
        let [dark_of, signal_of] = [(&means, &residuals), (&signals, &responses)]
            .map(|(values, left)| move |pixel: usize| values[pixel] - left[pixel]);
        let with_steps = |[pixel, sound]: [usize; 2]| Substitute {
            pixel,
            sound,
            dark_step_dn: dark_of(pixel) - dark_of(sound),
            response_step: (signal_of(pixel) - signal_of(sound)) / usual_dn,
        };
        found.substitutes = substitutes(&is_sound, width).into_iter().map(with_steps).collect();
        found
    }

    /// Notes the dark signal of hot pixels in a frame of photon transfer, which is still as it was read.
    pub fn follow(&mut self, shot: &PlannedShot, codes: &Plane<u16>) {
        let hot = || self.hot.iter().filter(|hot| !hot.is_clipped);
        let count = hot().count();
        if shot.is_lit || shot.point.is_none() || count == 0 {
            return;
        }
        let values = codes.values();
        let mean_dn = hot().map(|hot| f64::from(values[hot.pixel])).sum::<f64>() / f64_from_usize(count);
        let usual_dn = median(&values.iter().copied().map(f64::from).collect::<Vec<f64>>());
        self.rise.push([f64_from_u64(shot.exposure.exposure_ns), mean_dn - usual_dn]);
    }

    /// Gives each defective pixel the code of a sound one of its row, moved by what their columns differ.
    pub fn mend(&self, codes: &mut Plane<u16>) {
        let values = codes.values_mut();
        let sum: u64 = values.iter().map(|&code| u64::from(code)).sum();
        let signal_dn = f64_from_u64(sum) / f64_from_usize(values.len()) - self.dark_dn;
        for substitute in &self.substitutes {
            let code = values[substitute.sound];
            let step_dn = substitute.dark_step_dn + signal_dn * substitute.response_step;
            // At the ends of the range a code does not say how far beyond the level lies.
            let is_inside = 0 < code && code < self.code_max;
            let moved = if is_inside { f64::from(code) + step_dn } else { f64::from(code) };
            let moved = greater(0.0, lesser(moved, f64::from(self.code_max)));
            values[substitute.pixel] = low_u16(low_u32(u64_half_even(moved)));
        }
    }
}

/// The nearest sound pixel of the same row for each that is not, or of any row where a row has none. Time grows with the pixels alone,
/// however many are defective.
fn substitutes(is_sound: &[bool], width: usize) -> Vec<[usize; 2]> {
    let mut next = None;
    let mut after: Vec<Option<usize>> = Vec::with_capacity(is_sound.len());
    for pixel in (0..is_sound.len()).rev() {
        next = if is_sound[pixel] { Some(pixel) } else { next };
        after.push(next);
    }
    after.reverse();
    let (mut last, mut found) = (None, Vec::new());
    for pixel in 0..is_sound.len() {
        if is_sound[pixel] {
            last = Some(pixel);
            continue;
        }
        let beside = [last, after[pixel]].into_iter().flatten();
        let nearest = beside.min_by_key(|&other| (other / width != pixel / width, other.abs_diff(pixel)));
        found.extend(nearest.map(|sound| [pixel, sound]));
    }
    found
}

/// Quantiles of the mean of squares of `freedom` standard normals.
pub(super) fn chi_squared_over_freedom<const N: usize>(freedom: f64, shares: [f64; N]) -> [f64; N] {
    let law = ChiSquared::new(freedom);
    shares.map(|share| law.as_ref().map_or(f64::NAN, |law| law.inverse_cdf(share) / freedom))
}

/// The middle value; the upper one of two. 0 of none.
fn median(values: &[f64]) -> f64 {
    let mut values = values.to_vec();
    if values.is_empty() {
        return 0.0;
    }
    let middle = values.len() / 2;
    *values.select_nth_unstable_by(middle, f64::total_cmp).1
}

/// Robust standard deviation about 0.
fn spread(residuals: &[f64]) -> f64 {
    SIGMA_OVER_MAD * median(&residuals.iter().map(|value| value.abs()).collect::<Vec<f64>>())
}

/// Values less the medians of rows and columns, in two rounds.
fn polished(values: &[f64], width: usize) -> Vec<f64> {
    let mut left = values.to_vec();
    for _ in 0..2 {
        for row in left.chunks_exact_mut(width) {
            let middle = median(row);
            row.iter_mut().for_each(|value| *value -= middle);
        }
        for column in 0..width {
            let of_column: Vec<f64> = left.iter().skip(column).step_by(width).copied().collect();
            let middle = median(&of_column);
            left.iter_mut().skip(column).step_by(width).for_each(|value| *value -= middle);
        }
    }
    left
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_pixel_is_seen_against_its_row_and_column() {
        let width = 7;
        let mut values: Vec<f64> =
            (0..35).map(|pixel| f64_from_usize(3 * (pixel % width) + 50 * (pixel / width))).collect();
        assert!(polished(&values, width).iter().all(|&value| value == 0.0));
        values[17] += 9.0;
        let left = polished(&values, width);
        assert!(left.iter().enumerate().all(|(pixel, &value)| value == if pixel == 17 { 9.0 } else { 0.0 }));
    }

    #[test]
    fn a_defective_pixel_takes_the_nearest_sound_one_of_its_row() {
        let mut is_sound = [true; 12];
        for pixel in [0, 1, 6, 8, 9, 10, 11] {
            is_sound[pixel] = false;
        }
        let found = substitutes(&is_sound, 4);
        assert_eq!(found, [[0, 2], [1, 2], [6, 5], [8, 7], [9, 7], [10, 7], [11, 7]]);
        assert!(substitutes(&[false; 4], 4).is_empty());
        // A frame of a million pixels, all of which but one are defective, takes no longer than any other.
        let mut is_sound = vec![false; 1 << 20];
        assert!(substitutes(&is_sound, 1 << 10).is_empty());
        is_sound[12_345] = true;
        assert!(substitutes(&is_sound, 1 << 10).iter().all(|&[_, sound]| sound == 12_345));
    }
}
