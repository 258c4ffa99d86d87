//! How sure the difference of two runs is: 95 % intervals by the moving-block bootstrap (Künsch 1989), over frames.
//!
//! Errors of neighbouring frames depend on each other, so blocks of frames are drawn, not single frames. The block length follows the
//! series' own autocorrelation (Politis and White 2004, as corrected by Patton, Politis and White 2009). Few and short blocks understate
//! the spread: Student's quantile for the number of blocks, and the correlation that blocks cut, widen the interval.

use crate::draw::DrawKey;
use crate::num::{f64_from_usize, greater, i64_half_even, index, lesser, low_u32, u32_truncated, u64_from};

/// The published number of these draws.
const DRAWS: u64 = 0x636f_6d70_6172_6564;
/// Resamples of an interval. The 2.5 % quantile of 2,000 has a standard error of 0.35 % of rank.
const RESAMPLES: u64 = 2_000;
/// Fewest values of a series that an interval is drawn from.
pub const VALUES_MIN: usize = 12;
/// A series is cut into this many blocks at least.
const BLOCKS_MIN: usize = 4;
/// Quantiles of Student's t at 97.5 % and their degrees of freedom; between them the inverse is interpolated.
const STUDENT: [(f64, f64); 14] = [
    (1.0, 12.706),
    (2.0, 4.303),
    (3.0, 3.182),
    (4.0, 2.776),
    (5.0, 2.571),
    (6.0, 2.447),
    (7.0, 2.365),
    (8.0, 2.306),
    (10.0, 2.228),
    (12.0, 2.179),
    (15.0, 2.131),
    (20.0, 2.086),
    (30.0, 2.042),
    (60.0, 2.000),
];
/// The quantile for any number of degrees of freedom.
const NORMAL: f64 = 1.960;

/// How a figure follows from the values of its frames.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Statistic {
    /// Their mean.
    Mean,
    /// The root of their mean: values are squares.
    RootMean,
}

impl Statistic {
    fn of_mean(self, mean: f64) -> f64 {
        match self {
            Self::Mean => mean,
            Self::RootMean => greater(mean, 0.0).sqrt(),
        }
    }

    /// The figure of these values; none of an empty list.
    pub fn of(self, values: &[f64]) -> Option<f64> {
        (!values.is_empty()).then(|| self.of_mean(mean(values)))
    }

    /// What each value adds to the figure, to first order.
    fn influences(self, values: &[f64]) -> Vec<f64> {
        let mean = mean(values);
        let slope = match self {
            Self::Mean => 1.0,
            Self::RootMean if mean > 0.0 => 0.5 / mean.sqrt(),
            Self::RootMean => 0.0,
        };
        values.iter().map(|value| slope * (value - mean)).collect()
    }
}

/// A difference, B minus A, and where it lies with 95 % confidence.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Difference {
    /// The figure of A.
    pub a: f64,
    /// The figure of B.
    pub b: f64,
    /// 95 % interval of b - a.
    pub interval: [f64; 2],
    /// Frames of a block.
    pub block_frames: usize,
}

/// The difference of a figure between two runs whose values belong to the same frames: both are drawn with the same blocks, so what the
/// frames have in common cancels. None where the values are too few.
pub fn paired(a: &[f64], b: &[f64], statistic: Statistic) -> Option<Difference> {
    assert!(a.len() == b.len(), "values come in pairs");
    if a.len() < VALUES_MIN {
        return None;
    }
    let influences: Vec<f64> =
        statistic.influences(a).iter().zip(statistic.influences(b)).map(|(a, b)| b - a).collect();
    let Cut { block, lost } = cut(&influences);
    let (of_a, of_b) = (Blocks::new(a, block), Blocks::new(b, block));
    let differences = (0..RESAMPLES).map(|number| {
        let key = DrawKey::root(DRAWS).with(number);
        statistic.of_mean(of_b.mean(key)) - statistic.of_mean(of_a.mean(key))
    });
    let spread = lost * spread_of(a.len(), block);
    Some(difference(statistic, (a, b), differences.collect(), spread, block))
}

/// The same for runs whose frames do not belong together: each is drawn by itself.
pub fn unpaired(a: &[f64], b: &[f64], statistic: Statistic) -> Option<Difference> {
    if a.len() < VALUES_MIN || b.len() < VALUES_MIN {
        return None;
    }
    let cuts = [a, b].map(|values| cut(&statistic.influences(values)));
    let (of_a, of_b) = (Blocks::new(a, cuts[0].block), Blocks::new(b, cuts[1].block));
    let differences = (0..RESAMPLES).map(|number| {
        let key = DrawKey::root(DRAWS).with(number);
        statistic.of_mean(of_b.mean(key.with(1))) - statistic.of_mean(of_a.mean(key.with(0)))
    });
    let spreads = [(a, cuts[0]), (b, cuts[1])].map(|(values, cut)| cut.lost * spread_of(values.len(), cut.block));
    let spread = greater(spreads[0], spreads[1]);
    Some(difference(statistic, (a, b), differences.collect(), spread, cuts[0].block.max(cuts[1].block)))
}

fn difference(
    statistic: Statistic,
    (a, b): (&[f64], &[f64]),
    mut differences: Vec<f64>,
    spread: f64,
    block_frames: usize,
) -> Difference {
    differences.sort_by(f64::total_cmp);
    let of = |values| statistic.of_mean(mean(values));
    let found = of(b) - of(a);
    let quantile = |share: f64| differences[index(u32_truncated(share * f64_from_usize(differences.len() - 1)))];
    let widened = |end: f64| found + spread * (end - found);
    // Rounding of a resampled mean may leave the found difference just outside of an interval without width.
    let interval = [lesser(widened(quantile(0.025)), found), greater(widened(quantile(0.975)), found)];
    Difference { a: of(a), b: of(b), interval, block_frames }
}

/// By how much a bootstrap of few blocks is too narrow: Student's quantile over the normal one, and the root of n / (n - block), because
/// the mean of all blocks stands for the true one.
fn spread_of(values: usize, block: usize) -> f64 {
    let blocks = f64_from_usize(values) / f64_from_usize(block);
    student(blocks - 1.0) / NORMAL * (blocks / (blocks - 1.0)).sqrt()
}

/// Quantile of Student's t at 97.5 %.
pub(super) fn student(freedom: f64) -> f64 {
    let after = STUDENT.iter().position(|(known, _)| *known > freedom);
    let (below, above) = match after {
        Some(0) => return STUDENT[0].1,
        Some(after) => (STUDENT[after - 1], (1.0 / STUDENT[after].0, STUDENT[after].1)),
        None => (STUDENT[STUDENT.len() - 1], (0.0, NORMAL)),
    };
    let from = 1.0 / below.0;
    below.1 + (above.1 - below.1) * (from - 1.0 / freedom) / (from - above.0)
}

pub(super) fn mean(values: &[f64]) -> f64 {
    values.iter().fold(0.0, |sum, value| sum + value) / f64_from_usize(values.len())
}

/// Sums of a series, so that a block costs one subtraction.
struct Blocks {
    sums: Vec<f64>,
    block: usize,
}

impl Blocks {
    fn new(values: &[f64], block: usize) -> Self {
        // Sums of deviations from the first value: a constant series resamples to itself exactly.
        let mut sums = vec![0.0; values.len() + 1];
        for (at, value) in values.iter().enumerate() {
            sums[at + 1] = sums[at] + (value - values[0]);
        }
        sums.push(values[0]);
        Self { sums, block }
    }

    /// Mean of the blocks that a key draws, as many values as the series has, the last block cut short.
    fn mean(&self, key: DrawKey) -> f64 {
        let values = self.sums.len() - 2;
        let starts = u64_from(values - self.block + 1);
        let (mut sum, mut left, mut number) = (0.0, values, 0);
        while left > 0 {
            // Multiply-shift; its bias of starts / 2^32 does not matter.
            let start = index(low_u32((u64::from(low_u32(key.with(number).0 >> 32)) * starts) >> 32));
            let length = self.block.min(left);
            sum += self.sums[start + length] - self.sums[start];
            (left, number) = (left - length, number + 1);
        }
        self.sums[values + 1] + sum / f64_from_usize(values)
    }
}

/// How a series is cut into blocks.
#[derive(Clone, Copy, Debug, PartialEq)]
struct Cut {
    /// Values of a block.
    block: usize,
    /// Standard error with all correlations over the one that such blocks show, at least 1: cuts between blocks lose correlation.
    lost: f64,
}

/// Blocks are this much longer than the choice that has the least mean square error of the variance: short blocks understate it, and an
/// interval that is too narrow does more harm than one that is too wide.
const LENGTHENED: f64 = 2.0;
/// A series that shows no correlation.
const SINGLE: Cut = Cut { block: 1, lost: 1.0 };
/// Most that an interval is widened for lost correlation; beyond, the series is too short to say.
const LOST_MAX: f64 = 2.0;

/// Length of a block by the automatic choice of Politis and White, with a flat-top lag window. The series has mean zero.
fn cut(series: &[f64]) -> Cut {
    let count = f64_from_usize(series.len());
    let whole = |value: f64| usize::try_from(i64_half_even(libm::ceil(value))).unwrap_or(usize::MAX);
    let most = (series.len() / BLOCKS_MIN).max(1);
    let covariance = |lag: usize| {
        let products = series.iter().zip(&series[lag..]).map(|(a, b)| a * b);
        products.fold(0.0, |sum, product| sum + product) / count
    };
    let variance = covariance(0);
    if !(variance > 0.0) {
        return SINGLE;
    }
    // The smallest lag after which K lags in a row show no correlation.
    let in_a_row = whole(libm::log10(count).sqrt()).max(5);
    let lags = (whole(count.sqrt()) + in_a_row).min(series.len() - 1);
    let covariances: Vec<f64> = (0..=lags.max(most)).map(covariance).collect();
    let threshold = 2.0 * (libm::log10(count) / count).sqrt() * variance;
    let is_quiet = |after: &usize| {
        let next = covariances.iter().skip(after + 1).take(in_a_row);
        next.clone().count() > 0 && next.clone().all(|covariance| covariance.abs() < threshold)
    };
    let last = (0..lags).find(is_quiet).unwrap_or(lags);
    let window = (2 * last).clamp(1, lags);
    let (mut density, mut slope) = (variance, 0.0);
    for (lag, covariance) in covariances.iter().enumerate().take(window + 1).skip(1) {
        let share = f64_from_usize(lag) / f64_from_usize(window);
        let weight = lesser(1.0, 2.0 * (1.0 - share));
        density += 2.0 * weight * covariance;
        slope += 2.0 * weight * f64_from_usize(lag) * covariance;
    }
    if !(density > 0.0) {
        return SINGLE;
    }
    let length = libm::cbrt(1.5 * (slope / density) * (slope / density) * count);
    // A short series hides weak correlation: blocks have the rule of thumb's length at least.
    let least = whole(libm::cbrt(count)).min(most);
    let block = whole(LENGTHENED * length).clamp(least, most);
    // What moving blocks of this length show: Bartlett's window.
    let mut shown = variance;
    for (lag, covariance) in covariances.iter().enumerate().take(block).skip(1) {
        shown += 2.0 * (1.0 - f64_from_usize(lag) / f64_from_usize(block)) * covariance;
    }
    let lost = if shown > 0.0 { (density / shown).sqrt().clamp(1.0, LOST_MAX) } else { LOST_MAX };
    Cut { block, lost }
}

#[cfg(test)]
#[path = "bootstrap_tests.rs"]
mod tests;
