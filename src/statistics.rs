//! Intervals and tests that a study rests on, each with its stated error.

use statrs::distribution::{Beta, ContinuousCDF, StudentsT};

use crate::num::{f64_from_u64, f64_from_usize};
use crate::text::named;

/// Share of intervals that hold the true value.
pub const CONFIDENCE: f64 = 0.95;

/// A mean with its interval.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeanEstimate {
    /// Mean of the values.
    pub mean: f64,
    /// Ends of the 95 % interval; none from a single value.
    pub interval: Option<[f64; 2]>,
    /// Number of values.
    pub count: usize,
}

impl MeanEstimate {
    /// Of independent values: Student's interval. None without a value.
    pub fn of(values: &[f64]) -> Option<Self> {
        let count = values.len();
        if count == 0 {
            return None;
        }
        let mean = mean(values);
        let interval = standard_error(values).map(|error| {
            let half = student_quantile(0.5 + CONFIDENCE / 2.0, f64_from_usize(count - 1)) * error;
            [mean - half, mean + half]
        });
        Some(Self { mean, interval, count })
    }

    /// Whether the interval lies on one side of zero.
    pub fn is_decided(&self) -> bool {
        self.interval.is_some_and(|[low, high]| low > 0.0 || high < 0.0)
    }
}

/// Mean of some values.
pub fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / f64_from_usize(values.len())
}

/// Standard error of their mean; none of fewer than two.
pub fn standard_error(values: &[f64]) -> Option<f64> {
    let count = f64_from_usize(values.len());
    if values.len() < 2 {
        return None;
    }
    let mean = mean(values);
    let squares: f64 = values.iter().map(|value| (value - mean) * (value - mean)).sum();
    Some((squares / (count - 1.0) / count).sqrt())
}

fn student_quantile(share: f64, freedom: f64) -> f64 {
    StudentsT::new(0.0, 1.0, freedom).map_or(f64::INFINITY, |t| t.inverse_cdf(share))
}

/// Exact interval of a share from `met` of `runs` (Clopper and Pearson 1934), of confidence at least `confidence`.
pub fn binomial_interval(met: u64, runs: u64, confidence: f64) -> [f64; 2] {
    let tail = (1.0 - confidence) / 2.0;
    let quantile = |a: f64, b: f64, share: f64| Beta::new(a, b).map_or(f64::NAN, |beta| beta.inverse_cdf(share));
    let (met_f, missed_f) = (f64_from_u64(met), f64_from_u64(runs - met));
    let low = if met == 0 { 0.0 } else { quantile(met_f, missed_f + 1.0, tail) };
    let high = if met == runs { 1.0 } else { quantile(met_f + 1.0, missed_f, 1.0 - tail) };
    [low, high]
}

/// Wald's sequential test of a share: whether it is at most `poor` or at least `good`.
///
/// The likelihood ratio of `good` against `poor` is a martingale of mean 1 under `poor`, so it ever exceeds `1 / pass_error` with a
/// probability of at most `pass_error` (Ville's inequality), and the same the other way round. So the stated errors hold exactly, however
/// long the test goes on.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SequentialTest {
    /// A share that must not pass.
    pub poor: f64,
    /// A share that must not fail.
    pub good: f64,
    /// Probability of passing at `poor` or less, at most.
    pub pass_error: f64,
    /// Probability of failing at `good` or more, at most.
    pub fail_error: f64,
}

named! {
    /// What a test says.
    pub enum SequentialVerdict {
        /// The share is high enough.
        Pass = "pass",
        /// It is not.
        Fail = "fail",
        /// More runs are needed.
        Open = "open",
    }
}

impl SequentialTest {
    /// Logarithm of the likelihood ratio after the given runs.
    fn log_ratio(&self, met: u64, runs: u64) -> f64 {
        let (met, missed) = (f64_from_u64(met), f64_from_u64(runs - met));
        let of = |count: f64, good: f64, poor: f64| {
            if count > 0.0 { count * (libm::log(good) - libm::log(poor)) } else { 0.0 }
        };
        of(met, self.good, self.poor) + of(missed, 1.0 - self.good, 1.0 - self.poor)
    }

    /// What it says after `met` of `runs`, which are looked at after each run or after groups of runs.
    pub fn verdict(&self, met: u64, runs: u64) -> SequentialVerdict {
        let ratio = self.log_ratio(met, runs);
        if ratio >= -libm::log(self.pass_error) {
            SequentialVerdict::Pass
        } else if ratio <= libm::log(self.fail_error) {
            SequentialVerdict::Fail
        } else {
            SequentialVerdict::Open
        }
    }
}

#[cfg(test)]
mod tests {
    use rand::RngExt;

    use super::*;
    use crate::draw::DrawKey;

    /// The exact tails of Clopper and Pearson's definition, from sums of binomial terms.
    #[test]
    fn an_exact_interval_leaves_two_and_a_half_percent_in_each_tail() {
        let terms = |runs: u64, share: f64| -> Vec<f64> {
            let mut term = libm::pow(1.0 - share, f64_from_u64(runs));
            let mut all = vec![term];
            for k in 0..runs {
                term *= f64_from_u64(runs - k) / f64_from_u64(k + 1) * share / (1.0 - share);
                all.push(term);
            }
            all
        };
        let mut tried = 0;
        for runs in [1, 5, 20, 60] {
            for met in 0..=runs {
                let [low, high] = binomial_interval(met, runs, 0.95);
                let at = usize::try_from(met).unwrap();
                // inverse_cdf is iterative; 1e-6 of a tail is far below what a verdict turns on.
                if met > 0 {
                    let tail: f64 = terms(runs, low)[at..].iter().sum();
                    assert!((tail - 0.025).abs() < 1e-6, "{met} of {runs}: {tail}");
                }
                if met < runs {
                    let tail: f64 = terms(runs, high)[..=at].iter().sum();
                    assert!((tail - 0.025).abs() < 1e-6, "{met} of {runs}: {tail}");
                }
                tried += 1;
            }
        }
        assert_eq!(tried, 2 + 6 + 21 + 61);
    }

    #[test]
    fn the_sequential_test_errs_no_more_often_than_it_states() {
        let test = SequentialTest { poor: 0.9, good: 0.97, pass_error: 0.05, fail_error: 0.1 };
        let trials = 2000;
        let mut errors = [0_u32; 2];
        let mut open = 0;
        for (number, (share, wrong)) in
            [(0.9, SequentialVerdict::Pass), (0.97, SequentialVerdict::Fail)].into_iter().enumerate()
        {
            for trial in 0..trials {
                let mut stream = DrawKey::root(7).with(crate::num::u64_from(number)).with(trial).stream();
                let mut met = 0;
                let mut verdict = SequentialVerdict::Open;
                for runs in 1..=4000 {
                    met += u64::from(stream.random::<f64>() < share);
                    verdict = test.verdict(met, runs);
                    if verdict != SequentialVerdict::Open {
                        break;
                    }
                }
                errors[number] += u32::from(verdict == wrong);
                open += u32::from(verdict == SequentialVerdict::Open);
            }
        }
        println!(
            "of {trials} trials {} passed at the poor share (stated: 5 %) and {} failed at the good one (stated: 10 %)",
            errors[0], errors[1]
        );
        // At a true rate equal to the stated one, a count above this has a probability below 0.1 % (normal, 3.1 sigma).
        let most = |rate: f64| rate * 2000.0 + 3.1 * (2000.0 * rate * (1.0 - rate)).sqrt();
        assert!(f64::from(errors[0]) <= most(0.05), "{errors:?}");
        assert!(f64::from(errors[1]) <= most(0.1), "{errors:?}");
        assert!(errors[0] + errors[1] > 20, "the test is not vacuous: {errors:?}");
        assert_eq!(open, 0, "4,000 runs decide");
    }

    /// 1,000 synthetic studies of 8 seeds in 3 trajectories whose pose errors are skewed as root mean squares are.
    #[test]
    fn intervals_of_1000_synthetic_studies_hold_the_truth_in_93_to_97_percent() {
        let (mut held, mut paired_held, studies) = (0, 0, 1000);
        for study in 0..studies {
            let mut stream = DrawKey::root(11).with(study).stream();
            // A root mean square of 30 independent draws (chi over sqrt(30)) times 0.01 m, mean 0.00992 m.
            let mut normal = || {
                let (u, v): (f64, f64) = (stream.random(), stream.random());
                (-2.0 * libm::log(1.0 - u)).sqrt() * libm::cos(std::f64::consts::TAU * v)
            };
            let mut rms =
                |sigma: f64| (0..30).map(|_| normal()).map(|z| z * z).sum::<f64>().sqrt() / 30_f64.sqrt() * sigma;
            let one: Vec<f64> = (0..24).map(|_| rms(0.01)).collect();
            let other: Vec<f64> = one.iter().map(|value| 0.5 * value + rms(0.005)).collect();
            // E chi_30 / sqrt(30) = sqrt(2/30) Gamma(15.5) / Gamma(15) = 0.991702.
            let truth = 0.01 * 0.991_702;
            let inside = |estimate: MeanEstimate, truth: f64| {
                estimate.interval.is_some_and(|[low, high]| low <= truth && truth <= high)
            };
            held += u32::from(inside(MeanEstimate::of(&one).unwrap(), truth));
            let differences: Vec<f64> = one.iter().zip(&other).map(|(one, other)| other - one).collect();
            paired_held += u32::from(inside(MeanEstimate::of(&differences).unwrap(), 0.0));
        }
        println!(
            "of {studies} studies {held} intervals of a mean and {paired_held} of a paired difference hold the truth"
        );
        assert!((930..=970).contains(&held), "{held}");
        assert!((930..=970).contains(&paired_held), "{paired_held}");
    }
}
