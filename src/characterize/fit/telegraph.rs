//! Random telegraph noise from the temporal variances of pixels in the dark, by maximum likelihood.
//!
//! Model (`pixel::rts_noise`): a share of pixels has a trap of amplitude A, exponentially distributed, that is filled a share d of the
//! time, even over traps. The difference of two samples that lie far apart is -A, 0 or A, each end with chance d (1 - d): variance A^2 w
//! with w = 2 d (1 - d). Only pixels beyond the least variance that chance leaves to sound ones are used. Given the mean amplitude a, the
//! chance of a trap to lie beyond it and the distribution there follow; a has the greatest likelihood of the candidates' variances, and its
//! interval ends where the logarithm of the likelihood is 1.92 lower (profile likelihood).
//!
//! A sample variance over L frames is taken as gamma-distributed with its exact mean and variance, (mu_4 - (L - 3) / (L - 1) mu_2^2) / L.

use statrs::distribution::{ContinuousCDF as _, Gamma};

use super::defective::DefectivePixels;
use super::parameters::Fitted;
use crate::num::{f64_from_u64, f64_from_usize, greater, index, lesser, u32_truncated, u64_from};
use crate::statistics::binomial_interval;

/// Fewest candidates whose variances tell a mean amplitude.
const CANDIDATES_MIN: usize = 8;

/// Fewest frames that tell a pixel's variance.
const FRAMES_MIN: u64 = 4;
/// Amplitudes over the noise of a sound pixel: from one that no stack shows to one beyond any range.
const AMPLITUDE_MIN: f64 = 0.05;
const AMPLITUDE_MAX: f64 = 2_000.0;
/// Steps of the amplitudes, evenly in their logarithm.
const AMPLITUDES: u32 = 160;
/// Steps of the filled share of time from 0 to 1/2; the other half mirrors it.
const DUTIES: u32 = 24;
/// Bins of the ratio of variances, evenly in its logarithm, over this factor.
const BINS: u32 = 60;
const RATIO_SPAN: f64 = 1e7;
/// Greatest share of pixels with a trap: with more, the median variance is no sound pixel's.
const SHARE_MAX: f64 = 0.5;
/// Fall of the logarithm of the likelihood at the ends of a 95 % interval.
const FALL: f64 = 1.92;

/// What candidates tell of all traps.
#[derive(Clone, Debug, PartialEq)]
pub struct Telegraph {
    /// Traps per million pixels, and their mean amplitude in DN, each with its interval.
    pub ppm: Fitted,
    /// Its unit is DN here.
    pub amplitude: Fitted,
    /// Variance, averaged over all pixels, of traps that are no candidates, in DN^2.
    pub hidden_dn2: f64,
}

/// Traps behind the noisy pixels of a dark stack. None of too few candidates, or of so many that pixels without a trap would be none.
pub fn telegraph(defects: &DefectivePixels) -> Option<Telegraph> {
    let seen = defects.noisy.len();
    if seen < CANDIDATES_MIN || defects.frames < FRAMES_MIN {
        return None;
    }
    let ratios: Vec<f64> = defects.noisy.iter().map(|noisy| noisy.variance_ratio).collect();
    let model = TrapModel::new(defects.noisy_from_ratio, f64_from_u64(defects.frames));
    let counts = model.counts(&ratios);
    let ends = [libm::log(2.0 * AMPLITUDE_MIN), libm::log(0.1 * AMPLITUDE_MAX)];
    let likelihood = |log: f64| model.log_likelihood(libm::exp(log), &counts);
    let best = greatest(&likelihood, ends);
    let floor = likelihood(best) - FALL;
    let [low, high] = ends.map(|end| crossing(&likelihood, floor, best, end));
    let sigma_dn = defects.sound_variance_dn2.sqrt();
    let amplitude = Fitted {
        key: "pixel.rts_amplitude_uv",
        value: sigma_dn * libm::exp(best),
        interval: [low, high].map(|log| sigma_dn * libm::exp(log)),
        rests_on: "variances of the noisy pixels of the dark stack",
    };
    let shown = |log: f64| model.shown(libm::exp(log));
    let count_interval = binomial_interval(u64_from(seen), u64_from(defects.pixels), 0.95);
    let share = f64_from_usize(seen) / f64_from_usize(defects.pixels);
    let (value, here) = (share / shown(best), shown(best));
    if !(value < SHARE_MAX) {
        return None;
    }
    // Larger traps show more often, so the two ends of the amplitude move the count the other way.
    let end = |count: f64, log: f64, sign: f64| {
        value * libm::exp(sign * libm::hypot(libm::log(count / share), libm::log(here / shown(log))))
    };
    let interval = [end(count_interval[0], high, -1.0), lesser(end(count_interval[1], low, 1.0), 1.0)];
    let ppm = Fitted {
        key: "pixel.rts_ppm",
        value: 1e6 * value,
        interval: interval.map(|share| 1e6 * share),
        rests_on: "pixels beyond chance in the variance of the dark stack",
    };
    let hidden_dn2 = value * model.hidden(libm::exp(best)) * defects.sound_variance_dn2;
    Some(Telegraph { ppm, amplitude, hidden_dn2 })
}

/// Chances of traps by amplitude, in units of a sound pixel's noise.
struct TrapModel {
    /// Least ratio of variances of a candidate.
    from: f64,
    /// Edges between amplitudes.
    edges: Vec<f64>,
    /// Of each amplitude, the chance to lie in each bin, averaged over filled shares.
    chances: Vec<Vec<f64>>,
    /// Of each amplitude, the mean variance of traps that are no candidates, each trap counting.
    hidden: Vec<f64>,
}

impl TrapModel {
    fn new(from: f64, frames: f64) -> Self {
        let step = libm::log(AMPLITUDE_MAX / AMPLITUDE_MIN) / f64::from(AMPLITUDES);
        let edges: Vec<f64> = (0..=AMPLITUDES).map(|at| AMPLITUDE_MIN * libm::exp(step * f64::from(at))).collect();
        let (mut chances, mut hidden) = (Vec::new(), Vec::new());
        for pair in edges.windows(2) {
            let amplitude = (pair[0] * pair[1]).sqrt();
            let mut of_bins = vec![0.0; index(BINS)];
            let mut unseen = 0.0;
            for duty in 0..DUTIES {
                let filled = (f64::from(duty) + 0.5) / f64::from(2 * DUTIES);
                let beyond = beyond(amplitude, filled, frames);
                let mut above = beyond(from);
                unseen += amplitude * amplitude * 2.0 * filled * (1.0 - filled) * (1.0 - above) / f64::from(DUTIES);
                for (bin, chance) in (1..=BINS).zip(&mut of_bins) {
                    let next = if bin == BINS { 0.0 } else { beyond(bin_start(from, bin)) };
                    *chance += greater(above - next, 0.0) / f64::from(DUTIES);
                    above = next;
                }
            }
            chances.push(of_bins);
            hidden.push(unseen);
        }
        Self { from, edges, chances, hidden }
    }

    /// Candidates in each bin.
    fn counts(&self, ratios: &[f64]) -> Vec<f64> {
        let mut counts = vec![0.0; index(BINS)];
        for ratio in ratios {
            let bin = f64::from(BINS) * libm::log(ratio / self.from) / libm::log(RATIO_SPAN);
            counts[index(u32_truncated(greater(bin, 0.0)).min(BINS - 1))] += 1.0;
        }
        counts
    }

    /// Sum over amplitudes of an exponential law of this mean.
    fn over_amplitudes(&self, mean: f64, of: impl Fn(usize) -> f64) -> f64 {
        let beyond = |edge: f64| libm::exp(-edge / mean);
        let pairs = self.edges.windows(2).enumerate();
        pairs.map(|(at, pair)| (beyond(pair[0]) - beyond(pair[1])) * of(at)).sum()
    }

    /// Chance of a trap to be a candidate.
    fn shown(&self, mean: f64) -> f64 {
        self.over_amplitudes(mean, |at| self.chances[at].iter().sum())
    }

    /// Mean variance of a trap, candidates counting as 0.
    fn hidden(&self, mean: f64) -> f64 {
        self.over_amplitudes(mean, |at| self.hidden[at])
    }

    fn log_likelihood(&self, mean: f64, counts: &[f64]) -> f64 {
        let shown = self.shown(mean);
        let seen = counts.iter().enumerate().filter(|(_, count)| **count > 0.0);
        seen.map(|(bin, count)| {
            let chance = self.over_amplitudes(mean, |at| self.chances[at][bin]);
            count * libm::log(greater(chance / shown, f64::MIN_POSITIVE))
        })
        .sum()
    }
}

fn bin_start(from: f64, bin: u32) -> f64 {
    from * libm::exp(libm::log(RATIO_SPAN) * f64::from(bin) / f64::from(BINS))
}

/// Chance of a pixel's sample variance to exceed a ratio to that of a sound pixel.
fn beyond(amplitude: f64, filled: f64, frames: f64) -> impl Fn(f64) -> f64 {
    let square = amplitude * amplitude;
    let weight = 2.0 * filled * (1.0 - filled);
    let mean = 1.0 + square * weight;
    let fourth = 3.0 + 6.0 * square * weight + square * square * weight;
    let variance = (fourth - (frames - 3.0) / (frames - 1.0) * mean * mean) / frames;
    let law = Gamma::new(mean * mean / variance, mean / variance);
    move |ratio: f64| law.as_ref().map_or(f64::NAN, |law| law.sf(ratio))
}

/// Where a function of one hill is greatest.
fn greatest(of: &dyn Fn(f64) -> f64, [mut low, mut high]: [f64; 2]) -> f64 {
    for _ in 0..60 {
        let third = (high - low) / 3.0;
        if of(low + third) < of(high - third) { low += third } else { high -= third }
    }
    0.5 * (low + high)
}

/// Where it crosses a level between the top and an end; the end where it does not.
fn crossing(of: &dyn Fn(f64) -> f64, level: f64, top: f64, end: f64) -> f64 {
    let (mut inside, mut outside) = (top, end);
    if of(end) > level {
        return end;
    }
    for _ in 0..50 {
        let middle = 0.5 * (inside + outside);
        if of(middle) > level { inside = middle } else { outside = middle }
    }
    inside
}
