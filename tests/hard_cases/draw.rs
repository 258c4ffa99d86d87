//! Hard cases of the Poisson quantile, against the distribution function in double-double. Means are electrons.

use sensel::draw::{fill_uniforms, normal_quantile, normals, poisson, poisson_of_one_mean};
use sensel::num::f64_from_u64;

use super::double_double::{Dd, PI, dd};
use super::table::{Case, Chance, Stage};

/// The Poisson distribution of one mean in double-double.
pub struct Law {
    mean: Dd,
}

impl Law {
    pub fn new(mean_e: f64) -> Self {
        Self { mean: dd(mean_e) }
    }

    /// P(N = k). Below a mean of 500 exp(-mean) is a number of f64's range and the factors are multiplied up; above it Stirling's series
    /// of ln k! leaves 1e-28 for any k that matters (k above 300): its tenth term is B20 / (380 k^19).
    fn probability(&self, k: u64) -> Dd {
        if self.mean.high < 500.0 {
            return (1..=k).fold((-self.mean).exp(), |p, j| p * self.mean / dd(f64_from_u64(j)));
        }
        let n = dd(f64_from_u64(k));
        let (inverse, square) = (dd(1.0) / n, dd(1.0) / (n * n));
        let terms = [
            (1.0, 12.0),
            (-1.0, 360.0),
            (1.0, 1260.0),
            (-1.0, 1680.0),
            (1.0, 1188.0),
            (-691.0, 360_360.0),
            (1.0, 156.0),
            (-3617.0, 122_400.0),
        ];
        let series = terms.iter().rev().fold(dd(0.0), |sum, (above, below)| sum * square + dd(*above) / dd(*below));
        // k ln(mean / k) + k - mean loses no digits that 106 bits lack: at 1e7 its terms are 1.6e8.
        let exponent = n * (self.mean / n).ln() + n - self.mean - series * inverse;
        exponent.exp() / (PI * n * dd(2.0)).sqrt()
    }

    /// P(N <= k) and P(N > k), each summed on its own from the terms that make it, so that neither cancels.
    pub fn tails(&self, k: i64) -> [Dd; 2] {
        let Ok(k) = u64::try_from(k) else { return [dd(0.0), dd(1.0)] };
        let first = self.probability(k);
        let (mut below, mut term, mut j) = (first, first, k);
        while j > 0 && term.high > 1e-26 * below.high {
            term = term * dd(f64_from_u64(j)) / self.mean;
            below = below + term;
            j -= 1;
        }
        let (mut above, mut term, mut j) = (dd(0.0), first, k);
        loop {
            j += 1;
            term = term * self.mean / dd(f64_from_u64(j));
            above = above + term;
            if term.high <= 1e-26 * above.high && f64_from_u64(j) > self.mean.high {
                break;
            }
        }
        // The greater of the two by the smaller one: sums that start beyond their mode end too early.
        if below.high < above.high { [below, dd(1.0) - below] } else { [dd(1.0) - above, above] }
    }
}

/// How far U lies outside the stretch of uniforms that a count owns, as a probability: 0 for the right count.
pub fn outside(uniform: u32, [before, at]: [[Dd; 2]; 2]) -> f64 {
    // U = (u + 1/2) / 2^32 exactly; P(N <= k - 1) < U <= P(N <= k), judged on the side of the smaller tail.
    let below = dd((f64::from(uniform) + 0.5) / 4_294_967_296.0);
    let above = dd(1.0) - below;
    let over = |tails: [Dd; 2]| if below.high < 0.5 { (below - tails[0]).f64() } else { (tails[1] - above).f64() };
    let (past_at, past_before) = (over(at), over(before));
    if past_at > 0.0 {
        past_at
    } else if past_before > 0.0 {
        0.0
    } else {
        -past_before
    }
}

/// The quantile is decided in f64 where f32 leaves a doubt. There a sum of n terms of three roundings each and an exponential of an
/// argument up to 64 are off by (64 + 4 * 130) * 2^-53 = 6.5e-14 of a probability at most; the saddle-point's exponent (below 30, three
/// roundings) by less. So a uniform may be given to the neighbouring count only if it lies this close to the step.
const STEP_BOUND: f64 = 6.5e-14;

/// A table of the tails of neighbouring counts saves most of the sums.
fn check(case: &mut Case, side: usize, mean_e: f32, uniforms: &[u32], counts_e: &[f32]) {
    let law = Law::new(mean_e.into());
    let mut known = std::collections::BTreeMap::<i64, [Dd; 2]>::new();
    for (&uniform, &count_e) in uniforms.iter().zip(counts_e) {
        let count = sensel::num::i64_truncated(count_e.into());
        let mut tails = |k: i64| *known.entry(k).or_insert_with(|| law.tails(k));
        let error = outside(uniform, [tails(count - 1), tails(count)]);
        case.see(side, error, STEP_BOUND, || format!("mean {mean_e}, uniform {uniform}: {count_e}"));
    }
}

const ENDS: [u32; 6] = [0, 1, 1 << 31, (1 << 31) - 1, u32::MAX - 1, u32::MAX];

fn uniforms(chance: &mut Chance, count: usize) -> Vec<u32> {
    let mut uniforms = vec![0; count];
    fill_uniforms(sensel::draw::DrawKey(chance.bits()), &mut uniforms);
    uniforms[..6].copy_from_slice(&ENDS);
    uniforms
}

/// The mean itself and its neighbours in f32.
fn below(mean_e: f32) -> f32 {
    f32::from_bits(mean_e.to_bits() - 1)
}

/// The normal distribution function less 1/2, and its density. Series of positive terms, z^(2 k + 1) / (1 3 5 ... (2 k + 1)): 160 of them
/// leave 1e-35 at 6.4, and the least tail, 2^-33, still has 20 digits.
fn normal_law(z: f64) -> [Dd; 2] {
    let square = dd(z) * dd(z);
    let density = (-square * dd(0.5)).exp() / (PI * dd(2.0)).sqrt();
    let (mut term, mut sum) = (dd(z), dd(z));
    for k in 1..=160_u32 {
        term = term * square / dd(f64::from(2 * k + 1));
        sum = sum + term;
    }
    [sum * density, density]
}

/// The quantile's error is the miss of the distribution function over the density. The published rational functions are good to 1e-16,
/// relative; their 15 steps of two roundings, where all terms are positive, the logarithm and the root leave 36 * 2^-53 = 4e-15. The
/// row's normals in f32 claim 8e-7, relative, up to their own seam at tails of 0.06 %, and answer in f64 beyond it.
fn quantiles(stage: &mut Stage) {
    let sides = &["middle 85 %", "tails", "ends"];
    let mut chance = Chance::new(101);
    let mut uniforms: Vec<u32> = (0..1500).map(|_| chance.word()).collect();
    // Both sides of |U - 1/2| = 0.425, where the rational functions change hands, and the far tails.
    let seam = [322_122_547_u32, 3_972_844_748];
    uniforms.extend(seam.iter().flat_map(|&seam| (seam - 200..seam + 200).step_by(7)));
    // The polynomial of the row ends 2,144,819,850 off the middle.
    uniforms.extend((2_144_819_750..2_144_819_950_u32).step_by(3).flat_map(|off| [(1 << 31) + off, (1 << 31) - off]));
    uniforms.extend((0..31).flat_map(|bit| [1 << bit, u32::MAX - (1 << bit)]));
    uniforms.extend(ENDS);
    let side_of = |uniform: u32| match uniform {
        0..8 | 4_294_967_288.. => 2,
        322_122_547..3_972_844_748 => 0,
        _ => 1,
    };
    let miss = |uniform: u32, z: f64| {
        let [beyond, density] = normal_law(z);
        let exact = (dd(f64::from(uniform)) + dd(0.5)) / dd(4_294_967_296.0) - dd(0.5);
        ((beyond - exact) / density).abs().f64()
    };
    let reference = "distribution function in double-double";
    let case = stage.case("normal quantile in f64", reference, "relative", sides);
    for &uniform in &uniforms {
        let z = normal_quantile(uniform);
        case.see(side_of(uniform), miss(uniform, z) / z.abs(), 4e-15, || format!("uniform {uniform}: {z}"));
    }
    let case = stage.case("normals of a row in f32", reference, "relative", sides);
    let mut values = vec![0.0; uniforms.len()];
    normals(&uniforms, &mut values);
    for (&uniform, &z) in uniforms.iter().zip(&values) {
        case.see(side_of(uniform), miss(uniform, z.into()) / f64::from(z.abs()), 8e-7, || {
            format!("uniform {uniform}: {z}")
        });
    }
}

pub fn run(stage: &mut Stage) {
    quantiles(stage);
    let reference = "distribution function in double-double";
    let mut chance = Chance::new(100);
    let case = stage.case("Poisson quantile at 1e-6, 0.1, 1e3, 1e5, 1e7", reference, "probability", &["dim", "bright"]);
    for (side, mean_e, count) in
        [(0, 1e-6, 3000), (0, 0.1, 3000), (0, 1.0, 1000), (1, 1e3, 600), (1, 1e5, 200), (1, 1e7, 60)]
    {
        let uniforms = uniforms(&mut chance, count);
        let mut counts_e = vec![mean_e; count];
        poisson(&uniforms, &mut counts_e);
        check(case, side, mean_e, &uniforms, &counts_e);
    }
    // Where the algorithms of the row kernel and of its slow twin change hands; a block is served by one of them if all its means agree.
    for (name, seam, count) in [
        ("Poisson quantile across the seam of summation and series, 5 e-", 5.0_f32, 1500),
        ("Poisson quantile across the seam in f64, 64 e-", 64.0, 1000),
        ("Poisson quantile across the seam of few and many terms, 256 e-", 256.0, 800),
        ("Poisson quantile across the end of f32's series, 2^22 e-", 4_194_304.0, 60),
    ] {
        let case = stage.case(name, reference, "probability", &["below", "at and above"]);
        for (side, mean_e) in [(0, below(seam)), (1, seam)] {
            let uniforms = uniforms(&mut chance, count);
            let mut counts_e = vec![mean_e; count];
            poisson(&uniforms, &mut counts_e);
            check(case, side, mean_e, &uniforms, &counts_e);
        }
    }
    let name = "Poisson quantile of one mean, steps against row kernel, 8 e-";
    let case = stage.case(name, reference, "probability", &["below", "at and above"]);
    for (side, mean_e) in [(0, below(8.0)), (1, 8.0)] {
        let uniforms = uniforms(&mut chance, 1000);
        let mut counts_e = vec![0.0; uniforms.len()];
        poisson_of_one_mean(&uniforms, mean_e, &mut counts_e);
        check(case, side, mean_e, &uniforms, &counts_e);
    }
    let name = "Poisson quantile beside its own step";
    let case = stage.case(name, reference, "probability", &["last below", "first above"]);
    for mean_e in [0.1_f32, 0.7, 4.9, 5.1, 63.0, 65.0, 255.0, 257.0, 1000.0] {
        beside_steps(case, mean_e, &mut chance);
    }
}

/// Uniforms on both sides of steps that exact sums give: the hardest questions that a quantile is asked.
fn beside_steps(case: &mut Case, mean_e: f32, chance: &mut Chance) {
    let law = Law::new(mean_e.into());
    let sigma = f64::from(mean_e).sqrt();
    for _ in 0..60 {
        let value = (f64::from(mean_e) + sigma * chance.between(-3.0, 4.0)).floor();
        let count = sensel::num::i64_truncated(if value > 0.0 { value } else { 0.0 });
        let step = law.tails(count)[0] * dd(4_294_967_296.0) - dd(0.5);
        let last = sensel::num::u32_truncated(step.high.floor());
        if last == 0 || last == u32::MAX {
            continue;
        }
        for (side, uniform) in [(0, last), (1, last + 1)] {
            let mut count_e = [mean_e];
            poisson(&[uniform], &mut count_e);
            check(case, side, mean_e, &[uniform], &count_e);
        }
    }
}
