//! Hard cases of the pixel: binomial thinning, dark current, full well, reset noise, blooming, lag, telegraph noise. Effects run as the
//! chain runs them.

use sensel::config::Resolved;
use sensel::draw::{DrawKey, RowId, fill_uniforms};
use sensel::effect::{ArrayPass, Effect, KeptKeys, RowPass};
use sensel::num::{f32_nearest, f64_from_usize, i64_truncated};
use sensel::pixel::{
    Blooming, DarkCurrent, FullWell, ImageLag, PixelParams, RtsNoise, SampleTiming, SampledLevels, dark_charge_e,
    ktc_noise,
};
use sensel::plane::Plane;
use sensel::units::{BOLTZMANN_J_PER_K, CameraIndex, ELEMENTARY_CHARGE_C, FrameIndex, RowIndex, Size};

use super::double_double::{Dd, LN_2, dd};
use super::draw::outside;
use super::table::{Chance, Stage};

const ROW_ID: RowId = RowId { seed: 7, camera: CameraIndex(0), frame: FrameIndex(3), slot: 0, row: RowIndex(0) };

fn params() -> PixelParams {
    Resolved::from_layers("hard", "", &["scene.generator=box".to_owned()])
        .expect("the default holds")
        .scenario
        .pixel()
        .expect("the default holds")
}

/// One row through one effect; the reset sample where there is one.
fn through(effect: &dyn Effect, values: &mut [f32], reset: &mut [f32], times_s: [f64; 2]) {
    let (mut uniforms, mut draws) = (vec![0; values.len()], vec![0.0; values.len()]);
    let mut pass = RowPass {
        row_id: ROW_ID,
        die_seed: 9,
        exposure_s: times_s[0],
        storage_s: times_s[1],
        readout_s: 0.0,
        values,
        reset,
        uniforms: &mut uniforms,
        draws: &mut draws,
        keys: &KeptKeys::default(),
        saturated_from_e: f32::INFINITY,
        idle_px: 0,
    };
    effect.apply(&mut pass);
}

/// An array through one of the effects that need all of it; what it leaves behind.
fn through_array(effect: &dyn Effect, charge_e: &mut Plane<f32>) -> Option<Plane<f32>> {
    let mut pass = ArrayPass { row_id: ROW_ID, charge_e, before_e: None, left_e: None };
    effect.apply_to_array(&mut pass);
    pass.left_e
}

pub fn run(stage: &mut Stage) {
    thinning(stage);
    lag_keeps_electrons(stage);
    dark_current(stage);
    full_well(stage);
    reset_noise(stage);
    blooming(stage);
    telegraph(stage);
}

/// P(K <= k) and P(K > k) of n electrons that go with probability p: of those that stay where p is above 1/2.
fn binomial_tails(n: u32, p: f64, k: i64) -> [Dd; 2] {
    if p > 0.5 {
        let [below, above] = rarer_tails(n, dd(1.0) - dd(p), i64::from(n) - k - 1);
        return [above, below];
    }
    rarer_tails(n, dd(p), k)
}

fn rarer_tails(n: u32, p: Dd, k: i64) -> [Dd; 2] {
    let q = dd(1.0) - p;
    let odds = p / q;
    // q^n by its logarithm: n |ln q| stays below 1000 ln 2 for p up to 1/2.
    let mut term = (q.ln() * dd(f64::from(n))).exp();
    let (mut below, mut above) = (dd(0.0), dd(0.0));
    for j in 0..=n {
        if i64::from(j) <= k {
            below = below + term;
        } else {
            above = above + term;
        }
        term = term * dd(f64::from(n - j)) / dd(f64::from(j + 1)) * odds;
    }
    [below, above]
}

/// Image lag draws what stays with `pixel/thinning`. Summed, a count is off only where the uniform lies within the rounding of 60 terms
/// of five roundings and of exp(n ln q), an argument up to 24 of two: (300 + 48) * 2^-53 = 3.9e-14. By expansion the distribution
/// function is off by 1 / (60 n p q), as its documentation claims.
fn thinning(stage: &mut Stage) {
    let name = "binomial thinning at shares near 0, up to 1/2, and over it";
    let reference = "distribution function in double-double";
    let case = stage.case(name, reference, "probability", &["summed", "mirrored sum", "expansion"]);
    let mut uniforms = vec![0; 400];
    fill_uniforms(DrawKey::of_row(ImageLag::NUMBER, ROW_ID), &mut uniforms);
    for (n, share) in [
        (1_u32, 1e-9),
        (1000, 1e-9),
        (1000, 0.01599),
        (1000, 0.01601),
        (40, 0.39),
        (31, 0.5),
        (33, 0.5),
        (1000, 0.3),
        (1000, 0.5),
        (1000, 0.984_01),
        (1000, 0.983_99),
        (1000, 1.0 - 1e-9),
        (40, 0.65),
    ] {
        let params = PixelParams { image_lag: share, full_well_e: 1e6, ..params() };
        let lag = ImageLag::from_params(&params).expect("a share above 0 stays");
        let size = Size { width_px: 400, height_px: 1 };
        let mut charge_e = Plane::filled(size, f32_nearest(f64::from(n)));
        let left_e = through_array(&*lag, &mut charge_e).expect("image lag leaves charge");
        let rarer = f64::from(n) * sensel::num::lesser(share, 1.0 - share);
        let side = if rarer >= 16.0 { 2 } else { usize::from(share > 0.5) };
        let bound = if side == 2 { 1.0 / (60.0 * f64::from(n) * share * (1.0 - share)) } else { 3.9e-14 };
        let mut tails = std::collections::BTreeMap::new();
        for (&uniform, &left_e) in uniforms.iter().zip(left_e.row(0)) {
            let k = i64_truncated(left_e.into());
            let mut of = |k: i64| *tails.entry(k).or_insert_with(|| binomial_tails(n, share, k));
            let error = outside(uniform, [of(k - 1), of(k)]);
            case.see(side, error, bound, || format!("n {n}, share {share}, uniform {uniform}: {left_e}"));
        }
    }
}

/// Whole electrons below 2^24 are exact in f32, so what stays and what goes add up to the last bit.
fn lag_keeps_electrons(stage: &mut Stage) {
    let case = stage.case(
        "image lag at shares of almost 0, 1/2 and almost 1",
        "electrons in, as integers",
        "e-",
        &["1e-9", "1/2", "1 - 1e-9"],
    );
    let mut chance = Chance::new(201);
    for (side, image_lag) in [1e-9, 0.5, 1.0 - 1e-9].into_iter().enumerate() {
        let lag = ImageLag::from_params(&PixelParams { image_lag, full_well_e: 1e9, ..params() }).expect("above 0");
        let size = Size { width_px: 64, height_px: 32 };
        let values: Vec<f32> = (0..2048).map(|_| f32_nearest(chance.decade(1.0, 1.6e7).floor())).collect();
        let mut charge_e = Plane::from_values(size, values.clone());
        let left_e = through_array(&*lag, &mut charge_e).expect("image lag leaves charge");
        for ((&before_e, &read_e), &left_e) in values.iter().zip(charge_e.values()).zip(left_e.values()) {
            let error = (f64::from(read_e) + f64::from(left_e) - f64::from(before_e)).abs();
            case.see(side, error, 0.0, || format!("{before_e} e-: {read_e} read, {left_e} left"));
            case.hold(side, left_e >= 0.0 && read_e >= 0.0, || format!("{before_e} e-: {read_e} read, {left_e} left"));
        }
    }
}

/// rate * 2^((T - 300) / d): the quotient and the difference round once each (2^-53 of an exponent of at most 150 either way is 150 ln 2
/// 2^-52 of the power), exp2 is good to an ulp and the product rounds: (208 + 3) * 2^-53 = 2.4e-14, relative.
fn dark_current(stage: &mut Stage) {
    let reference = "exp in double-double";
    let sides = &["colder than 300 K", "300 K and hotter"];
    let case = stage.case("dark current over doubling steps from 1 to 100 K", reference, "relative", sides);
    let mut chance = Chance::new(202);
    for number in 0..2000 {
        let dark_doubling_k = if number % 5 == 0 { 100.0 } else { chance.decade(1.0, 100.0) };
        let temperature_k = match number % 4 {
            0 => 450.0,
            1 => 150.0 + 150.0 * f64::EPSILON * f64::from(number),
            2 => 300.0 * (1.0 - f64::EPSILON),
            _ => chance.between(150.0, 450.0),
        };
        let params =
            PixelParams { dark_doubling_k, temperature_k, dark_current_e_per_s: 17.3, die_dark_sigma: 0.0, ..params() };
        let found = params.dark_current_now_e_per_s();
        let exact = (LN_2 * (dd(temperature_k) - dd(300.0)) / dd(dark_doubling_k)).exp() * dd(17.3);
        let side = usize::from(temperature_k >= 300.0);
        let at = || format!("{temperature_k} K, doubling in {dark_doubling_k} K: {found}");
        case.see(side, exact.miss(found) / exact.high, 2.4e-14, at);
    }
    // Underflow at one end, refusal at the other: never an infinity.
    let case = stage.case("dark current beyond the range of numbers", "limit", "yes or no", &["0 K", "refused"]);
    let cold = PixelParams { temperature_k: 0.0, dark_doubling_k: 0.01, ..params() };
    let mut row = [5.0_f32; 16];
    if let Some(effect) = DarkCurrent::from_params(&cold) {
        through(&*effect, &mut row, &mut [], [1.0, 1.0]);
    }
    let (mean_e, square_e2) = dark_charge_e(&cold, 1.0, 1.0, sensel::pixel::ANY_DIE);
    case.hold(0, row == [5.0; 16] && mean_e == 0.0 && square_e2 == 0.0, || format!("{row:?}"));
    let hot = PixelParams { temperature_k: 450.0, dark_doubling_k: 0.01, dark_current_e_per_s: 1.0, ..params() };
    let message = hot.check().map_or_else(|error| error.to_string(), |()| "accepted".to_owned());
    case.hold(1, message.contains("dark_doubling_k"), || message);
}

fn full_well(stage: &mut Stage) {
    let sides = &["below", "at the well", "above"];
    let case = stage.case("full well at its neighbours in f32 and at the ends", "least of two numbers", "e-", sides);
    for full_well_e in [1.0, 6000.0, 16_777_217.0, 1e9] {
        let well_e = f32_nearest(full_well_e);
        let effect = FullWell::from_params(&PixelParams { full_well_e, ..params() }).expect("every pixel has it");
        let (below, above) = (f32::from_bits(well_e.to_bits() - 1), f32::from_bits(well_e.to_bits() + 1));
        let before = [0.0, -0.5, below, well_e, above, 2.0 * well_e, f32::MAX, f32::INFINITY];
        let mut row = before;
        through(&*effect, &mut row, &mut [], [0.01, 0.0]);
        for (before_e, after_e) in before.into_iter().zip(row) {
            let expected_e = if before_e < well_e { before_e } else { well_e };
            let side = if before_e < well_e { 0 } else { 1 + usize::from(before_e > well_e) };
            case.see(side, f64::from((after_e - expected_e).abs()), 0.0, || {
                format!("{before_e} of {well_e}: {after_e}")
            });
        }
    }
}

/// sqrt(A k T g / q) in uV: five products and a quotient under a root halve their six roundings, 1e-6 and 1e6 round once each and the root
/// and last product once: (3 + 4) * 2^-53 = 7.8e-16, relative. At 0 K there is none.
fn reset_noise(stage: &mut Stage) {
    let sides = &["down to 1e-3 K", "0 K"];
    let case = stage.case("reset noise from gain and temperature", "root in double-double", "relative", sides);
    let mut chance = Chance::new(203);
    for number in 0..1000 {
        let temperature_k = if number % 10 == 0 { 0.0 } else { chance.decade(1e-3, 450.0) };
        let gain = chance.decade(1e-3, 1000.0);
        let params = PixelParams { temperature_k, conversion_gain_uv_per_e: gain, ktc_noise_uv: None, ..params() };
        let found = params.ktc_of_one_reset_uv();
        let heat = dd(0.85) * dd(BOLTZMANN_J_PER_K) * dd(temperature_k) / dd(ELEMENTARY_CHARGE_C);
        let exact = (heat * dd(gain) * dd(1e6)).sqrt();
        if temperature_k == 0.0 {
            let none = ktc_noise(&params, SampledLevels::Signal).is_none();
            case.hold(1, none && found == 0.0, || format!("{found} uV at 0 K"));
        } else {
            let at = || format!("{gain} uV/e-, {temperature_k} K: {found}");
            case.see(0, exact.miss(found) / exact.high, 7.8e-16, at);
        }
    }
}

/// What a lamp spills is all found again: with a share of 1 and no edge near nothing drains. A pool of radius r loses a share of (2.4 /
/// r)^2 / 4 of its excess a sweep, so one of 3 pixels (30,000 e- over wells of 1,000) is spread out long before 256 sweeps; at the end
/// less than 1/64 e- in each pixel is no longer followed. A sweep rounds each charge once (2^-14 e- beside 1,000) and its inflow three
/// times (less than that again). A larger lamp is cut off after 256 sweeps and the rest drains: then charge is lost, and none may be
/// gained.
fn blooming(stage: &mut Stage) {
    let sides = &["spread out", "cut off: gain", "mirrored"];
    let case = stage.case("blooming of lamps", "charge before, mirrored picture", "e-", sides);
    let size = Size { width_px: 63, height_px: 61 };
    for lamps in [&[(31, 30)][..], &[(24, 30), (38, 29)]] {
        for lamp_e in [1000.5_f32, 1100.0, 7654.3, 30_000.0, 123_456.7, 5e5] {
            let params = PixelParams { blooming: 1.0, full_well_e: 1000.0, ..params() };
            let effect = Blooming::from_params(&params).expect("the share is above 0");
            let mut charge_e = Plane::filled(size, 10.0_f32);
            lamps.iter().for_each(|&(x, y)| charge_e.row_mut(y)[x] = lamp_e);
            let mut mirrored = Plane::from_values(size, charge_e.values().iter().rev().copied().collect());
            let sum = |plane: &Plane<f32>| plane.values().iter().map(|&e| f64::from(e)).sum::<f64>();
            let before_e = sum(&charge_e);
            through_array(&*effect, &mut charge_e);
            through_array(&*effect, &mut mirrored);
            let pool = f64_from_usize(charge_e.values().iter().filter(|&&e| e > 10.0).count());
            let (gained_e, rounding_e) = (sum(&charge_e) - before_e, pool * 256.0 * 2.0 / 16_384.0);
            let at = || format!("{} lamps of {lamp_e} e- over {pool} pixels", lamps.len());
            if lamp_e > 1e5 {
                case.see(1, sensel::num::greater(gained_e, 0.0), rounding_e, at);
            } else {
                case.see(0, gained_e.abs(), pool / 64.0 + rounding_e, at);
            }
            let same = charge_e.values().iter().eq(mirrored.values().iter().rev());
            case.hold(2, same, || format!("{lamp_e} e-"));
        }
    }
}

/// Double sampling hears a trap when its state changes in between: with probability 2 d (1 - d) (1 - exp(-2 rate t)), 1/3 of the bracket
/// over traps. A trap slower than 2^-54 / t never does; others within 4.5 standard errors of the binomial count.
fn telegraph(stage: &mut Stage) {
    let sides = &["never changes", "sometimes", "independent"];
    let case =
        stage.case("telegraph noise with time constants of years to nanoseconds", "two-state law", "share", sides);
    let count = 60_000;
    for (side, rts_rate_hz) in [(0, 1e-12), (0, 1e-13), (1, 100.0), (1, 1e4), (2, 1e9)] {
        let params = PixelParams { rts_ppm: 1e6, rts_amplitude_uv: 100.0, rts_rate_hz, ..params() };
        let timing = SampleTiming { samples: SampledLevels::Difference, interval_s: 1e-5 };
        let effect = RtsNoise::from_params(&params, timing).expect("traps are heard");
        let mut row = vec![0.0_f32; count];
        through(&*effect, &mut row, &mut [], [0.01, 0.0]);
        let changed = f64_from_usize(row.iter().filter(|&&uv| uv != 0.0).count()) / f64_from_usize(count);
        let expected = -libm::expm1(-2.0 * rts_rate_hz * 1e-5) / 3.0;
        let bound = if side == 0 { 0.0 } else { 4.5 * (expected * (1.0 - expected) / f64_from_usize(count)).sqrt() };
        let error = if side == 0 { changed } else { (changed - expected).abs() };
        case.see(side, error, bound, || format!("{rts_rate_hz} Hz: {changed} of {expected}"));
    }
}
