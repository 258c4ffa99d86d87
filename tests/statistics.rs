//! Statistics of the draws: the exact distribution, and independence of everything that a key names.
//!
//! Seeds are fixed, so these tests cannot fail by chance later; the stated false-alarm rates say how lucky the seeds had to be.

// Counts and case numbers of a test are small; its reference mathematics need not be the same on all machines.
#![allow(clippy::cast_possible_truncation, clippy::cast_sign_loss, clippy::disallowed_methods)]

use sensel::draw::{DrawKey, EffectNumber, RowId, fill_uniforms, normals, poisson};
use sensel::simd::{self, Level};
use sensel::units::{CameraIndex, FrameIndex, RowIndex};
use statrs::distribution::{Discrete, DiscreteCDF, Poisson};

const WIDTH: usize = 512;

fn row_id(seed: u64, camera: u32, frame: u32, row: u32) -> RowId {
    RowId { seed, camera: CameraIndex(camera), frame: FrameIndex(frame), slot: 0, row: RowIndex(row) }
}

fn uniforms(key: DrawKey, length: usize) -> Vec<u32> {
    let mut uniforms = vec![0; length];
    fill_uniforms(key, &mut uniforms);
    uniforms
}

fn draw(mean_e: f32, seed: u64, length: usize) -> Vec<f32> {
    let uniforms = uniforms(DrawKey::root(seed), length);
    let mut values_e = vec![mean_e; length];
    poisson(&uniforms, &mut values_e);
    values_e
}

/// P(N <= k) summed term by term from the mode outwards in f64, with libm's log-gamma: no code shared with the draw.
fn reference_tails(mean_e: f64) -> impl Fn(f64) -> (f64, f64) {
    let spread = 12.0 * mean_e.sqrt() + 40.0;
    let first = (mean_e - spread).max(0.0).floor();
    let length = (2.0 * spread + 2.0) as usize;
    let term = |k: f64| libm::exp(k * libm::log(mean_e) - mean_e - libm::lgamma(k + 1.0));
    let terms: Vec<f64> = (0..length).map(|step| term(first + step as f64)).collect();
    let mut below = vec![0.0; length + 1];
    let mut above = vec![0.0; length + 1];
    for step in 0..length {
        below[step + 1] = below[step] + terms[step];
    }
    for step in (0..length).rev() {
        above[step] = above[step + 1] + terms[step];
    }
    // P(N <= k) and P(N > k).
    move |k| {
        let step = (k - first + 1.0).clamp(0.0, length as f64) as usize;
        (below[step], above[step])
    }
}

/// For each count from `first` on: the last uniform that surely has it or a lower one, and the last that may, by the reference.
struct LastUniforms {
    first: f64,
    surely: Vec<i64>,
    maybe: Vec<i64>,
}

impl LastUniforms {
    /// U = (u + 1/2) / 2^32 has count k or a lower one when U <= P(N <= k). Log-gamma loses about k ln k ulps, so the reference is good to
    /// `slack`, 1e-15 mean ln(mean) relative.
    fn new(mean_e: f64) -> Self {
        let tails = reference_tails(mean_e);
        let spread = 7.0 * mean_e.sqrt() + 40.0;
        let first = (mean_e - spread).max(0.0).floor() - 1.0;
        let slack = (1e-13 + 4e-16 * mean_e * (1.0 + libm::log(1.0 + mean_e))) * 2_f64.powi(32);
        let (mut surely, mut maybe) = (Vec::new(), Vec::new());
        for step in 0..(2.0 * spread) as usize + 3 {
            let (below, above) = tails(first + step as f64);
            let boundary =
                if below < 0.5 { below * 2_f64.powi(32) } else { 2_f64.powi(32) - above * 2_f64.powi(32) } - 0.5;
            surely.push((boundary - slack).floor() as i64);
            maybe.push((boundary + slack).floor() as i64);
        }
        Self { first, surely, maybe }
    }

    /// Whether the count is surely right; `None` where it is wrong.
    fn judge(&self, uniform: u32, value_e: f32) -> Option<bool> {
        let (step, uniform) = ((f64::from(value_e) - self.first) as usize, i64::from(uniform));
        if uniform > self.maybe[step] || uniform <= self.surely[step - 1] {
            return None;
        }
        Some(uniform <= self.surely[step] && uniform > self.maybe[step - 1])
    }

    /// Uniforms at distances 0, 1, 2, 4 ... 2^22 on both sides of every step.
    fn near_steps(&self) -> impl Iterator<Item = u32> + '_ {
        let distances = || (0..23).flat_map(|power| [1_i64 << power, -(1_i64 << power)]).chain([0]);
        let all = self.maybe.iter().flat_map(move |&boundary| distances().map(move |distance| boundary + distance));
        all.filter_map(|uniform| u32::try_from(uniform).ok())
    }
}

/// Every count of the scan is the quantile of its uniform: hundreds of means from 0.003 to 4e6 e-, a million uniforms each, the first
/// and last 2,000, both sides of every step of the distribution, and both sides of each seam between the kernel's methods. Draws within
/// the reference's own error of a step are counted apart and must be few.
#[test]
fn poisson_counts_are_the_exact_quantiles_of_their_uniforms() {
    const RANDOM: usize = 1_000_000;
    let seams = [5.0_f32, 8.0, 64.0, 256.0].into_iter().flat_map(|mean_e| [mean_e.next_down(), mean_e]);
    let means_e: Vec<f32> = (0..260).map(|case| 0.003 * 1.084_f32.powi(case)).chain(seams).collect();
    let (mut tried, mut close) = (0_u64, 0_u64);
    for (case, &mean_e) in means_e.iter().enumerate() {
        let reference = LastUniforms::new(mean_e.into());
        let mut uniforms = uniforms(DrawKey::root(1000 + case as u64), RANDOM);
        uniforms.extend((0..2000).flat_map(|step| [step, !step]));
        uniforms.extend(reference.near_steps());
        let mut values_e = vec![mean_e; uniforms.len()];
        poisson(&uniforms, &mut values_e);
        for (at, (&uniform, &value_e)) in uniforms.iter().zip(&values_e).enumerate() {
            let Some(sure) = reference.judge(uniform, value_e) else {
                panic!("case {case}, mean {mean_e}, uniform {uniform}: {value_e} is not its quantile");
            };
            close += u64::from(!sure && at < RANDOM);
        }
        tried += uniforms.len() as u64;
    }
    println!(
        "{tried} draws at {} means; {close} random ones within the reference's own error of a step",
        means_e.len()
    );
    // Twice the slack at each of some 8 sqrt(mean) steps: 7e-4 of the draws at the brightest means, falling as mean^-3/2, so about 7,000.
    assert!(tried > 268_000_000 && means_e[259] > 3e6 && close < 10_000);
}

const CHI_SQUARE_MEANS_E: [f32; 24] = [
    0.02, 0.1, 0.5, 1.0, 2.0, 3.0, 4.0, 4.9, 5.0, 5.1, 6.3, 7.9, 8.0, 12.5, 20.0, 40.0, 63.0, 90.0, 255.0, 257.0,
    1000.0, 5000.0, 2e4, 1e5,
];

/// Chi-square against statrs' probabilities over bins of at least 20 expected counts. With d degrees of freedom its sigma is
/// sqrt(2 d); 5 sigma is a false alarm in about 1e6.
#[test]
fn poisson_counts_pass_chi_square_at_many_means() {
    let draws = 200_000;
    for (case, mean_e) in CHI_SQUARE_MEANS_E.into_iter().enumerate() {
        let values_e = draw(mean_e, 50 + case as u64, draws);
        let law = Poisson::new(mean_e.into()).unwrap();
        let mut counts = std::collections::BTreeMap::new();
        for value_e in values_e {
            *counts.entry(value_e as u64).or_insert(0_u32) += 1;
        }
        let spread = 7.0 * f64::from(mean_e).sqrt() + 12.0;
        let (first, last) = ((f64::from(mean_e) - spread).max(0.0) as u64, (f64::from(mean_e) + spread) as u64);
        let (mut chi2, mut bins, mut expected, mut found) = (0.0, 0, law.cdf(first) * draws as f64, 0.0);
        found += counts.range(..=first).map(|(_, &count)| f64::from(count)).sum::<f64>();
        let mut used = (0.0, 0.0);
        for k in first + 1..=last {
            if expected >= 20.0 {
                chi2 += (found - expected).powi(2) / expected;
                used = (used.0 + expected, used.1 + found);
                bins += 1;
                (expected, found) = (0.0, 0.0);
            }
            expected += law.pmf(k) * draws as f64;
            found += f64::from(counts.get(&k).copied().unwrap_or(0));
        }
        let (rest_expected, rest_found) = (draws as f64 - used.0, draws as f64 - used.1);
        chi2 += (rest_found - rest_expected).powi(2) / rest_expected.max(1.0);
        let freedom = f64::from(bins);
        println!("mean {mean_e}: chi2 {chi2:.1} of {freedom}");
        assert!(
            bins >= 1 && chi2 < freedom + 5.0 * (2.0 * freedom).sqrt() + 10.0,
            "mean {mean_e}: chi2 {chi2} of {freedom}"
        );
    }
}

/// The third cumulant of a Poisson law is its mean, of a normal one 0. Its sample's standard error is
/// sqrt((6 m^3 + ...) / n), about 2.5 m^1.5 / sqrt(n): 0.2 % to 8 % of the mean here, so a normal in disguise fails.
#[test]
fn the_third_cumulant_equals_the_mean() {
    let draws = 2_000_000;
    for (case, mean_e) in [0.3_f32, 2.0, 4.9, 5.1, 9.0, 50.0, 400.0].into_iter().enumerate() {
        let values_e = draw(mean_e, 90 + case as u64, draws);
        let n = draws as f64;
        let mean = values_e.iter().map(|&value| f64::from(value)).sum::<f64>() / n;
        let moment = |power: i32| values_e.iter().map(|&value| (f64::from(value) - mean).powi(power)).sum::<f64>() / n;
        let (variance, third) = (moment(2), moment(3));
        let m = f64::from(mean_e);
        // Var of the third sample moment: (k6 + 9 k4 k2 + 9 k3^2 + 6 k2^3) / n with all cumulants m.
        let error = ((m + 18.0 * m * m + 6.0 * m * m * m) / n).sqrt();
        println!("mean {mean_e}: mean {mean:.4}, variance {variance:.4}, third {third:.4} +- {error:.4}");
        assert!((mean - m).abs() < 4.5 * (m / n).sqrt());
        assert!((variance - m).abs() < 4.5 * ((m + 2.0 * m * m) / n).sqrt());
        assert!((third - m).abs() < 4.5 * error);
        assert!(m > 5.0 * error, "the test must tell the law from a normal one");
    }
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let n = a.len() as f64;
    let (mean_a, mean_b) = (a.iter().sum::<f64>() / n, b.iter().sum::<f64>() / n);
    let product = |x: &[f64], y: &[f64], p: f64, q: f64| x.iter().zip(y).map(|(x, y)| (x - p) * (y - q)).sum::<f64>();
    product(a, b, mean_a, mean_b) / (product(a, a, mean_a, mean_a) * product(b, b, mean_b, mean_b)).sqrt()
}

/// 4.5 sigma is a false alarm in 1.5e5 a pair; 48 pairs are tried.
#[test]
fn neighbours_in_every_field_of_a_key_are_uncorrelated_and_so_are_row_sums() {
    let rows = 256;
    let picture = |effect: u64, seed: u64, camera: u32, frame: u32, first_row: u32| -> Vec<f64> {
        let keys = (first_row..first_row + rows)
            .map(|row| DrawKey::of_row(EffectNumber(effect), row_id(seed, camera, frame, row)));
        keys.flat_map(|key| uniforms(key, WIDTH)).map(f64::from).collect()
    };
    let sums = |picture: &[f64]| -> Vec<f64> { picture.chunks(WIDTH).map(|row| row.iter().sum()).collect() };
    let mut pairs = 0;
    for seed in [0, 1, 77, u64::MAX] {
        let base = picture(102, seed, 0, 0, 0);
        let others = [
            ("x", base[1..].iter().copied().chain([base[0]]).collect()),
            ("y", picture(102, seed, 0, 0, 1)),
            ("frame", picture(102, seed, 0, 1, 0)),
            ("camera", picture(102, seed, 1, 0, 0)),
            ("effect", picture(103, seed, 0, 0, 0)),
            ("seed", picture(102, seed.wrapping_add(1), 0, 0, 0)),
        ];
        for (name, other) in others {
            for (kind, a, b) in [("pixels", base.clone(), other.clone()), ("row sums", sums(&base), sums(&other))] {
                let limit = 4.5 / (a.len() as f64).sqrt();
                let r = correlation(&a, &b);
                if !(kind == "row sums" && name == "x") {
                    assert!(
                        r.abs() < limit,
                        "seed {seed}, neighbours in {name}, {kind}: r = {r:.2e}, limit {limit:.2e}"
                    );
                    pairs += 1;
                }
            }
        }
    }
    assert_eq!(pairs, 4 * 11);
}

/// One test, since the level is one for the whole process: the others' results do not depend on it.
#[test]
fn every_simd_level_gives_the_same_bits() {
    let _turn = crate::common::LEVEL.lock().expect("no test has failed while it held the level");
    let means_e: Vec<f32> = (0..100_003).map(|step| 1.000_2_f32.powi(step % 95_000) - 1.0).collect();
    let run = |level| {
        simd::limit(level);
        let uniforms = uniforms(DrawKey::root(5), means_e.len());
        let (mut values_e, mut values) = (means_e.clone(), vec![0.0; means_e.len()]);
        poisson(&uniforms, &mut values_e);
        normals(&uniforms, &mut values);
        let bits = |values: &[f32]| values.iter().map(|value| value.to_bits()).collect::<Vec<u32>>();
        (simd::level(), uniforms, bits(&values_e), bits(&values))
    };
    let best = run(Level::Avx512);
    for level in [Level::Baseline, Level::Avx2] {
        let other = run(level);
        assert!((&other.1, &other.2, &other.3) == (&best.1, &best.2, &best.3), "{level:?} differs from {:?}", best.0);
    }
    simd::limit(Level::Avx512);
}

#[test]
fn counts_never_fall_when_the_mean_grows() {
    let uniforms = uniforms(DrawKey::root(8), 4096);
    let mut last_e = vec![0.0_f32; uniforms.len()];
    let mut steps = 0;
    let mut mean_e = 0.01_f32;
    while mean_e < 3e9 {
        let mut values_e = vec![mean_e; uniforms.len()];
        poisson(&uniforms, &mut values_e);
        assert!(values_e.iter().zip(&last_e).all(|(now, last)| now >= last), "a count fell at mean {mean_e}");
        last_e = values_e;
        mean_e *= 1.011;
        steps += 1;
    }
    // And across the seams, one float at a time.
    for seam in [5.0_f32, 8.0, 64.0, 256.0, 4_194_304.0, 16_777_216.0] {
        let mut means_e = seam;
        (0..20).for_each(|_| means_e = means_e.next_down());
        let mut last_e = vec![0.0_f32; uniforms.len()];
        for _ in 0..40 {
            let mut values_e = vec![means_e; uniforms.len()];
            poisson(&uniforms, &mut values_e);
            assert!(values_e.iter().zip(&last_e).all(|(now, last)| now >= last), "a count fell at mean {means_e}");
            last_e = values_e;
            means_e = means_e.next_up();
            steps += 1;
        }
    }
    assert!(steps > 2000, "{steps} steps");
}

#[test]
fn zero_light_gives_no_electron() {
    assert!(draw(0.0, 1, 10_000).iter().all(|&value_e| value_e == 0.0));
}

#[test]
fn one_photon_gives_an_electron_as_often_as_the_law_says() {
    let values_e = draw(1.0, 2, 1_000_000);
    let none = values_e.iter().filter(|&&value_e| value_e == 0.0).count() as f64 / 1e6;
    // exp(-1) with a standard error of 4.8e-4; 4.5 of them.
    assert!((none - 0.367_879_44).abs() < 4.5 * 4.8e-4, "{none}");
}

#[test]
fn means_of_two_to_the_thirty_and_beyond_keep_mean_and_variance() {
    for (case, mean_e) in [1_073_741_800.0_f32, 1_073_741_824.0, 2_147_483_648.0, 5e12, 5e20].into_iter().enumerate() {
        let n = 100_000;
        let values_e = draw(mean_e, 30 + case as u64, n);
        let m = f64::from(mean_e);
        let ulp = f64::from(mean_e.next_up()) - m;
        let excess: Vec<f64> = values_e.iter().map(|&value_e| f64::from(value_e) - m).collect();
        let mean = excess.iter().sum::<f64>() / n as f64;
        let variance = excess.iter().map(|excess| (excess - mean) * (excess - mean)).sum::<f64>() / n as f64;
        // Rounding to f32 adds at most half an ulp to each value, and below the mean's binade ulps differ: ulp^2 / 4 bounds it.
        let sigma = (m + 0.25 * ulp * ulp).sqrt();
        assert!(mean.abs() < 4.5 * sigma / 316.0 + 0.5 * ulp, "mean {mean_e}: off by {mean}");
        assert!(variance < (m + 0.25 * ulp * ulp) * (1.0 + 4.5 * 0.0045), "mean {mean_e}: variance {variance:e}");
        assert!(
            m < 4.0 * ulp * ulp || variance > (m - 0.25 * ulp * ulp) * (1.0 - 4.5 * 0.0045),
            "variance {variance:e}"
        );
    }
}
