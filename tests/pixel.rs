//! The pixel's effects against their closed forms, each alone in the chain, at samples before quantisation or at codes of one
//! electron each.
//!
//! Seeds are fixed. Where nothing else is said a tolerance is 4.5 standard errors, a false alarm in 1.5e5.

#![allow(clippy::unwrap_used)]

use sensel::config::Resolved;
use sensel::effects::chain::{Capture, Captured, Chain, RowTimes};
use sensel::effects::{self, Parameters};
use sensel::num::{f32_nearest, f64_from_u64, f64_from_usize, index};
use sensel::pixel::{self, DefectKind, defects, flicker_variance_uv2};
use sensel::plane::Plane;
use sensel::run::SensorSetup;
use sensel::units::{CameraIndex, FrameIndex, RowIndex, Size};

const SIZE: Size = Size { width_px: 256, height_px: 64 };
const TIMES: RowTimes = RowTimes { exposure_s: 0.01, storage_s: 0.0, readout_s: 0.0 };

/// A sensor of 10 uV an electron and a 16-bit code an electron: codes less the black level of 4096 are electrons.
fn parameters(assignments: &[&str]) -> Parameters {
    let mut all = vec![
        "scene.generator=box",
        "sensor.pixel.quantum_efficiency=1.0",
        "sensor.pixel.fill_factor=1.0",
        "sensor.pixel.full_well_e=50000.0",
        "sensor.adc.bits=16",
        "sensor.adc.full_scale_uv=655360.0",
        "sensor.adc.cds=analog",
    ];
    all.extend(assignments);
    let assignments: Vec<String> = all.into_iter().map(str::to_owned).collect();
    let resolved = Resolved::from_layers("test", "", &assignments).unwrap();
    Parameters { pixel: resolved.scenario.pixel().unwrap(), adc: resolved.scenario.adc().unwrap() }
}

fn chain_of_die(parameters: &Parameters, names: &[&str], die_seed: u64) -> Chain {
    let mut chosen = effects::build_all(parameters);
    chosen.retain(|effect| names.contains(&effect.name()));
    assert_eq!(chosen.len(), names.len(), "{names:?} are effects with their parameters set");
    Chain::new(parameters.clone(), chosen, 11, die_seed)
}

fn chain(parameters: &Parameters, names: &[&str]) -> Chain {
    chain_of_die(parameters, names, 12)
}

fn at(camera: u32, frame: u32) -> Capture<'static> {
    Capture::single(CameraIndex(camera), FrameIndex(frame))
}

/// Electrons of a flat picture's rows, one after the other, as the difference of the samples.
fn flat(chain: &Chain, mean_e: f32, times: RowTimes, capture: Capture<'_>) -> Vec<f64> {
    let row = vec![mean_e; index(SIZE.width_px)];
    let electrons = |y| {
        let samples = chain.row_samples(&row, capture, RowIndex(y), times);
        let reset_uv = if samples.reset_uv.is_empty() { vec![0.0; row.len()] } else { samples.reset_uv };
        let both = samples.signal_uv.into_iter().zip(reset_uv);
        both.map(|(signal_uv, reset_uv)| (f64::from(signal_uv) - f64::from(reset_uv)) / 10.0).collect::<Vec<f64>>()
    };
    (0..SIZE.height_px).flat_map(electrons).collect()
}

/// Electrons of a captured picture, code by code.
fn electrons(captured: &Captured) -> Vec<f64> {
    captured.codes.values().iter().map(|&code| f64::from(code) - 4096.0).collect()
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / f64_from_usize(values.len())
}

fn moment(values: &[f64], power: u32) -> f64 {
    let centre = mean(values);
    mean(&values.iter().map(|value| (0..power).fold(1.0, |term, _| term * (value - centre))).collect::<Vec<_>>())
}

/// Mean and variance within 4.5 standard errors, which the sample's own second and fourth moments give.
fn check(what: &str, values: &[f64], expected_mean: f64, expected_variance: f64) {
    let (found, variance, count) = (mean(values), moment(values, 2), f64_from_usize(values.len()));
    let (mean_se, variance_se) =
        ((variance / count).sqrt(), ((moment(values, 4) - variance * variance) / count).sqrt());
    println!(
        "{what}: mean {found} of {expected_mean} +- {mean_se}, variance {variance} of {expected_variance} +- {variance_se}"
    );
    assert!((found - expected_mean).abs() <= 4.5 * mean_se + 1e-6 * expected_mean.abs() + 1e-9, "{what}: mean");
    assert!((variance - expected_variance).abs() <= 4.5 * variance_se + 1e-6, "{what}: variance");
}

fn correlation(a: &[f64], b: &[f64]) -> f64 {
    let (mean_a, mean_b) = (mean(a), mean(b));
    let product: Vec<f64> = a.iter().zip(b).map(|(a, b)| (a - mean_a) * (b - mean_b)).collect();
    mean(&product) / (moment(a, 2) * moment(b, 2)).sqrt()
}

/// Rows wait 20 us longer each; the signal is exact in f32 to 2^-22 of itself. With shot noise the whole picture is Poisson.
#[test]
fn parasitic_light_grows_linearly_over_the_rows_and_needs_an_exposure() {
    let parameters = parameters(&["sensor.pixel.parasitic_light=0.01"]);
    let times: Vec<RowTimes> =
        (0..SIZE.height_px).map(|y| RowTimes { storage_s: 20e-6 * f64::from(y), ..TIMES }).collect();
    let (quiet, noisy) =
        (chain(&parameters, &["parasitic_light"]), chain(&parameters, &["parasitic_light", "shot_noise"]));
    let row = [1000.0; 256];
    for (y, times) in (0..).zip(&times) {
        let expected_e = 1000.0 * (1.0 + 0.01 * times.storage_s / 0.01);
        let found_uv = f64::from(quiet.row_samples(&row, at(0, 0), RowIndex(y), *times).signal_uv[7]);
        assert!((found_uv / (10.0 * expected_e) - 1.0).abs() < 1.0 / 4_194_304.0, "row {y}: {found_uv}");
    }
    let late = noisy.capture(&Plane::filled(SIZE, 1000.0), at(0, 1), &times);
    check(
        "whole picture",
        &electrons(&late),
        1000.63,
        1000.63 + moment(&(0..64).map(|y| 0.02 * f64::from(y)).collect::<Vec<_>>(), 2),
    );
    let none = RowTimes { exposure_s: 0.0, storage_s: 1.0, readout_s: 0.0 };
    assert!(flat(&quiet, 5.0, none, at(0, 0)).iter().all(|&electrons| electrons == 5.0));
}

#[test]
fn what_a_leaking_node_keeps_is_a_poisson_count_of_the_decayed_mean() {
    for (mean_e, rate_per_s, storage_s) in
        [(1000.0, 50.0, 0.004), (3.0, 50.0, 0.02), (20_000.0, 0.1, 0.01), (1e6, 100.0, 5.0)]
    {
        let parameters = parameters(&[&format!("sensor.pixel.storage_leakage_per_s={rate_per_s:.3}")]);
        let leaking = chain(&parameters, &["shot_noise", "storage_leakage"]);
        let kept_e = f64::from(mean_e) * libm::exp(-rate_per_s * storage_s);
        let found = flat(&leaking, mean_e, RowTimes { storage_s, ..TIMES }, at(0, 0));
        check(&format!("{mean_e} e-, {rate_per_s} /s, {storage_s} s"), &found, kept_e, kept_e);
        assert!(found.iter().all(|&electrons| electrons >= 0.0 && (electrons - electrons.round()).abs() < 0.01));
    }
}

/// Exposure and wait gather at their own rates. Over pixels each rate has relative sigma 0.5; the two nodes' factors are independent.
#[test]
fn dark_current_has_a_rate_for_each_node_and_its_own_for_each_pixel() {
    let parameters = parameters(&[
        "sensor.pixel.dark_current_e_per_s=4000.0",
        "sensor.pixel.storage_dark_e_per_s=20000.0",
        "sensor.pixel.dcnu=0.5",
    ]);
    let dark = chain(&parameters, &["dark_current"]);
    for (exposure_s, storage_s) in [(0.01, 0.0), (0.0, 0.004), (0.01, 0.004)] {
        let (photodiode_e, storage_e) = (4000.0 * exposure_s, 20_000.0 * storage_s);
        let variance_e2 = photodiode_e + storage_e + 0.25 * (photodiode_e * photodiode_e + storage_e * storage_e);
        let times = RowTimes { exposure_s, storage_s, readout_s: 0.0 };
        let [first, second] = [0, 1].map(|frame| flat(&dark, 0.0, times, at(0, frame)));
        check(&format!("{exposure_s} s + {storage_s} s"), &first, photodiode_e + storage_e, variance_e2);
        // What two frames share is the pattern. 16,384 pixels: the correlation's standard error is at most 1/128.
        let expected = 1.0 - (photodiode_e + storage_e) / variance_e2;
        let found = correlation(&first, &second);
        assert!((found - expected).abs() < 4.5 / 128.0, "{found} for {expected}");
    }
}

#[test]
fn defects_act_exactly_where_their_list_says() {
    let parameters = parameters(&[
        "sensor.pixel.hot_ppm=5000.0",
        "sensor.pixel.hot_dark_e_per_s=20000.0",
        "sensor.pixel.dead_ppm=4000.0",
        "sensor.pixel.stuck_ppm=3000.0",
        "sensor.pixel.defect_cluster_share=0.2",
        "sensor.temperature_k=308.0",
    ]);
    let list = defects(&parameters.pixel, 12, CameraIndex(0), SIZE);
    let index_of = |defect: &pixel::Defect| index(defect.row.0) * index(SIZE.width_px) + defect.x_px;
    let of = |name: &str, mean_e: f32, frame: u32| {
        let times = vec![RowTimes { storage_s: 0.005, ..TIMES }; index(SIZE.height_px)];
        electrons(&chain(&parameters, &[name]).capture(&Plane::filled(SIZE, mean_e), at(0, frame), &times))
    };
    let (mut hot, mut dead, mut stuck) =
        (vec![0.0; SIZE.pixel_count()], vec![200.0; SIZE.pixel_count()], vec![200.0; SIZE.pixel_count()]);
    for defect in &list {
        match defect.kind {
            DefectKind::Hot { rate_e_per_s } => hot[index_of(defect)] = rate_e_per_s * 0.015,
            DefectKind::Dead => dead[index_of(defect)] = 0.0,
            DefectKind::StuckLow => stuck[index_of(defect)] = -4096.0,
            DefectKind::StuckHigh => stuck[index_of(defect)] = 61_439.0,
        }
    }
    assert_eq!(of("dead_pixels", 200.0, 0), dead);
    assert_eq!(of("stuck_pixels", 200.0, 0), stuck);
    assert!(stuck.contains(&-4096.0) && stuck.contains(&61_439.0));
    let frames: Vec<Vec<f64>> = (0..8).map(|frame| of("hot_pixels", 0.0, frame)).collect();
    let (mut pulls, mut count) = (0.0, 0.0);
    for (pixel, &mean_e) in hot.iter().enumerate() {
        let sum: f64 = frames.iter().map(|frame| frame[pixel]).sum();
        assert!(mean_e > 0.0 || sum == 0.0, "pixel {pixel} is not hot");
        if mean_e > 1.0 {
            pulls += (sum - 8.0 * mean_e) * (sum - 8.0 * mean_e) / (8.0 * mean_e);
            count += 1.0;
        }
    }
    // Squared pulls of Poisson sums of 8 e- or more have mean 1 and variance at most 2 + 1/8.
    println!("{} defects, {count} hot pixels with mean pull^2 {}", list.len(), pulls / count);
    assert!(count > 50.0 && (pulls / count - 1.0).abs() < 4.5 * (2.125_f64 / count).sqrt());
    // 82 expected at 300 K and at 308 K alike; the rates double, and their mean over pixels with them.
    let rates: Vec<f64> = hot.iter().filter(|&&mean_e| mean_e > 0.0).map(|mean_e| mean_e / 0.015).collect();
    let rate_se = 40_000.0 / f64_from_usize(rates.len()).sqrt();
    assert!((mean(&rates) - 40_000.0).abs() < 4.5 * rate_se, "{} e-/s", mean(&rates));
}

#[test]
fn blooming_spreads_a_lamp_through_the_chain_on_any_number_of_threads() {
    let parameters = parameters(&["sensor.pixel.blooming=0.8", "sensor.pixel.full_well_e=5000.0"]);
    let blooming = chain(&parameters, &["blooming", "full_well"]);
    let mut light = Plane::filled(SIZE, 100.0);
    light.row_mut(40)[128] = 45_000.0;
    let times = vec![TIMES; index(SIZE.height_px)];
    let on = |threads: usize| {
        let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
        pool.install(|| blooming.capture(&light, at(0, 0), &times).codes)
    };
    let codes = on(1);
    assert_eq!(codes, on(3));
    let at = |x: usize, y: usize| f64::from(codes.at(x, y)) - 4096.0;
    assert_eq!([at(128, 40), at(0, 0)], [5000.0, 100.0]);
    let around = [at(127, 40), at(129, 40), at(128, 39), at(128, 41)];
    assert!(around.iter().all(|&electrons| electrons == 5000.0), "8000 e- reach each neighbour: {around:?}");
    // The four pass on 0.8 (8000 - 4900) in all; the diagonal ones get two quarters of it, the far ones one, and the lamp the last.
    let (diagonal_e, far_e) = (at(127, 39) - 100.0, at(126, 40) - 100.0);
    assert!(diagonal_e >= 1240.0 && far_e >= 620.0 && diagonal_e > far_e, "{diagonal_e} and {far_e}");
}

/// 16,384 pixels; after the light goes R falls by l a frame, so with l = 0.2 from 2000 e-: 400, 80, 16, 3.2 e-.
#[test]
fn image_lag_conserves_every_electron_and_decays_geometrically() {
    let parameters = parameters(&["sensor.pixel.image_lag=0.2"]);
    let (lagging, prompt) = (chain(&parameters, &["shot_noise", "image_lag"]), chain(&parameters, &["shot_noise"]));
    let times = vec![TIMES; index(SIZE.height_px)];
    let light = [2000.0, 2000.0, 2000.0, 2000.0, 0.0, 0.0, 0.0, 0.0_f32];
    let mut left: Option<Plane<f32>> = None;
    let mut balance = vec![0.0; SIZE.pixel_count()];
    let mut read = Vec::new();
    for (frame, mean_e) in (0..).zip(light) {
        let photons = Plane::filled(SIZE, mean_e);
        let captured = lagging.capture(&photons, Capture { before_e: left.as_ref(), ..at(0, frame) }, &times);
        let gathered = electrons(&prompt.capture(&photons, at(0, frame), &times));
        read.push(electrons(&captured));
        for ((balance, gathered), read) in balance.iter_mut().zip(gathered).zip(read.last().unwrap()) {
            *balance += gathered - read;
        }
        left = captured.charge_e;
        let still: Vec<f64> = left.as_ref().unwrap().values().iter().map(|&left| f64::from(left)).collect();
        assert_eq!(balance, still, "frame {frame}: what was gathered and not read is what is left");
    }
    // T is Q + 0.2 of the T before: 1600, 1920, 1984, 1996.8 e- are read, each a Poisson count; then a fifth a frame of 499.2 e- left.
    for (frame, mean_e) in [1600.0, 1920.0, 1984.0, 1996.8, 399.36, 79.872, 15.9744, 3.19488].into_iter().enumerate() {
        check(&format!("frame {frame}"), &read[frame], mean_e, mean_e);
    }
    // Frames stay independent, as thinned Poisson counts are.
    assert!(correlation(&read[2], &read[3]).abs() < 4.5 / 128.0);
    let filled = chain(&parameters, &["image_lag"]).capture(&Plane::filled(SIZE, 1e9), at(0, 0), &times);
    let most_e = electrons(&filled).into_iter().fold(0.0, f64::max);
    assert!(most_e < 50_000.0, "no more than a full well takes part: {most_e}");
}

/// Every pixel has a trap; samples 3 us apart and 50 kHz leave 1 - exp(-0.3) of independence: each outer peak has a sixth of that.
#[test]
fn telegraph_noise_has_three_peaks_after_double_sampling_and_two_without() {
    let keys =
        ["sensor.pixel.rts_ppm=1000000.0", "sensor.pixel.rts_amplitude_uv=300.0", "sensor.pixel.rts_rate_hz=50000.0"];
    let with = |cds: &str| {
        parameters(&[&keys[..], &[&format!("sensor.adc.cds={cds}"), "sensor.adc.settle_signal_us=3.0"]].concat())
    };
    let pixels = f64_from_usize(SIZE.pixel_count());
    let share = |values: &[f64], is: &dyn Fn(f64) -> bool| {
        f64_from_usize(values.iter().filter(|&&value| is(value)).count()) / pixels
    };
    let near = |found: f64, expected: f64| {
        assert!(
            (found - expected).abs() < 4.5 * (expected * (1.0 - expected) / pixels).sqrt(),
            "{found} for {expected}"
        );
    };
    let analog = chain(&with("analog"), &["rts_noise"]);
    let frames: Vec<Vec<f64>> = (0..6).map(|frame| flat(&analog, 0.0, TIMES, at(0, frame))).collect();
    let outer = (1.0 - libm::exp(-0.3)) / 6.0;
    near(share(&frames[0], &|e| e > 0.0), outer);
    near(share(&frames[0], &|e| e < 0.0), outer);
    // E A^2 is twice the squared mean amplitude of 30 e-.
    check("double sampling", &frames[0], 0.0, 2.0 * outer * 2.0 * 900.0);
    for pixel in 0..SIZE.pixel_count() {
        let outer: Vec<f64> = frames.iter().map(|frame| frame[pixel].abs()).filter(|&e| e > 0.0).collect();
        assert!(outer.windows(2).all(|pair| pair[0] == pair[1]), "a trap keeps its amplitude: {outer:?}");
    }
    let single = flat(&chain(&with("none"), &["rts_noise"]), 0.0, TIMES, at(0, 0));
    near(share(&single, &|e| e > 0.0), 0.5);
    check("single sampling", &single, 15.0, 0.75 * 900.0);
    // Digital: 128 counts of the reset conversion at 480 MHz lengthen the interval by 0.267 us.
    let digital = flat(&chain(&with("digital"), &["rts_noise"]), 0.0, TIMES, at(0, 0));
    let outer = (1.0 - libm::exp(-1e5 * (3e-6 + 128.0 / 480e6))) / 6.0;
    near(share(&digital, &|e| e > 1e-6), outer);
    near(share(&digital, &|e| e < -1e-6), outer);
}

/// 2 K^2 (gamma + ln(2 pi 5 MHz 3 us)) = 2 (40 uV)^2 5.124, to 1e-4 of it; a signal alone has K^2 ln(5e6).
#[test]
fn flicker_noise_has_the_variance_of_its_transfer() {
    for (cds, expected_uv2) in [("analog", 2.0 * 1600.0 * 5.1239), ("none", 1600.0 * 15.4249)] {
        let parameters = parameters(&[
            "sensor.pixel.flicker_uv_per_rthz=40.0",
            "sensor.adc.settle_signal_us=3.0",
            &format!("sensor.adc.cds={cds}"),
        ]);
        let variance_uv2 = flicker_variance_uv2(&parameters.pixel, effects::sample_timing(&parameters));
        assert!((variance_uv2 / expected_uv2 - 1.0).abs() < 2e-4, "{cds}: {variance_uv2} for {expected_uv2}");
        let found = flat(&chain(&parameters, &["flicker_noise"]), 0.0, TIMES, at(0, 0));
        check(cds, &found, 0.0, variance_uv2 / 100.0);
    }
}

/// An f32 of the curve is off by three roundings of 6e-8.
#[test]
fn a_compressed_gain_loses_its_share_at_exactly_the_full_well() {
    let compressed = chain(&parameters(&["sensor.pixel.gain_compression=0.2"]), &["gain_compression"]);
    for (charge_e, expected_e) in
        [(0.0, 0.0), (1.0, 1.0 - 4e-6), (25_000.0, 22_500.0), (50_000.0, 40_000.0), (100_000.0, 80_000.0)]
    {
        let found_e = flat(&compressed, f32_nearest(charge_e), TIMES, at(0, 0))[0];
        assert!((found_e - expected_e).abs() <= 2e-7 * expected_e, "{charge_e}: {found_e} for {expected_e}");
    }
}

#[test]
fn frames_of_a_die_share_its_patterns_and_dies_share_nothing() {
    let parameters = parameters(&[
        "sensor.pixel.dead_ppm=2000.0",
        "sensor.die_gain_sigma=0.02",
        "sensor.die_offset_uv=500.0",
        "sensor.pixel.gain_compression=0.1",
    ]);
    let names = ["prnu", "dead_pixels", "dsnu", "gain_compression", "die_gain", "die_offset"];
    let (die, other) = (chain_of_die(&parameters, &names, 1), chain_of_die(&parameters, &names, 2));
    let first = flat(&die, 3000.0, TIMES, at(0, 0));
    assert_eq!(first, flat(&die, 3000.0, TIMES, at(0, 7)), "nothing here differs from frame to frame");
    for (what, another) in
        [("camera", flat(&die, 3000.0, TIMES, at(1, 0))), ("die", flat(&other, 3000.0, TIMES, at(0, 0)))]
    {
        let found = correlation(&first, &another);
        assert!(found.abs() < 4.5 / 128.0, "another {what}: {found}");
        assert!((mean(&first) - mean(&another)).abs() > 1.0, "another {what} has another gain and offset");
    }
    let [all, fewer] = [1, 2].map(|die| defects(&parameters.pixel, die, CameraIndex(0), SIZE));
    assert!(all != fewer && all == defects(&parameters.pixel, 1, CameraIndex(0), SIZE));
}

/// Of 400 dies gain, offset and the logarithm of the dark current have their sigmas: standard error of a sigma 1 / sqrt(800).
#[test]
fn dies_spread_by_their_sigmas() {
    let parameters = parameters(&[
        "sensor.die_gain_sigma=0.05",
        "sensor.die_offset_uv=300.0",
        "sensor.die_dark_sigma=0.5",
        "sensor.pixel.dark_current_e_per_s=10000000.0",
    ]);
    let means = |name: &str, mean_e: f32| -> Vec<f64> {
        let one = |die| {
            let samples =
                chain_of_die(&parameters, &[name], die).row_samples(&[mean_e; 64], at(0, 0), RowIndex(5), TIMES);
            mean(&samples.signal_uv.iter().map(|&uv| f64::from(uv) / 10.0).collect::<Vec<_>>())
        };
        (0..400).map(one).collect()
    };
    check("gain", &means("die_gain", 1000.0), 1000.0, 2500.0);
    check("offset", &means("die_offset", 0.0), 0.0, 900.0);
    let logarithms: Vec<f64> = means("dark_current", 0.0).iter().map(|&mean_e| libm::log(mean_e / 1e5)).collect();
    check("dark current", &logarithms, 0.0, 0.25);
}

/// Everything at once, at the ends of every range: no NaN, no infinity, no panic, and a plan that can be made.
#[test]
fn hard_cases_stay_finite() {
    let all = [
        "sensor.pixel.prnu=0.15",
        "sensor.pixel.dcnu=2.0",
        "sensor.pixel.storage_leakage_per_s=100.0",
        "sensor.pixel.parasitic_light=1.0",
        "sensor.pixel.rts_ppm=1000000.0",
        "sensor.pixel.rts_amplitude_uv=1000.0",
        "sensor.pixel.flicker_uv_per_rthz=100.0",
        "sensor.pixel.gain_compression=0.5",
        "sensor.pixel.blooming=1.0",
        "sensor.pixel.image_lag=0.5",
        "sensor.pixel.hot_ppm=100000.0",
        "sensor.pixel.hot_dark_e_per_s=1000.0",
        "sensor.pixel.dead_ppm=100000.0",
        "sensor.pixel.stuck_ppm=100000.0",
        "sensor.pixel.defect_cluster_share=1.0",
        "sensor.die_gain_sigma=0.15",
        "sensor.die_offset_uv=1000.0",
        "sensor.die_dark_sigma=3.0",
    ];
    let mut tried = 0_u64;
    for (efficiency, temperature_k) in [(0.0, 0.0), (1.0, 0.0), (0.0, 400.0), (1.0, 400.0), (1.0, 300.0)] {
        let more = [
            format!("sensor.pixel.quantum_efficiency={efficiency:.1}"),
            format!("sensor.temperature_k={temperature_k:.1}"),
        ];
        let parameters = parameters(&[&all[..], &[&more[0], &more[1]]].concat());
        let chain = Chain::new(parameters.clone(), effects::build_all(&parameters), 3, 4);
        for (exposure_s, storage_s) in [(0.0, 0.0), (0.0, 10.0), (1e-6, 1e6), (0.03, 0.03)] {
            let times = RowTimes { exposure_s, storage_s, readout_s: 0.0 };
            for photons in [0.0, 1e-6, 1.0, 50_000.0, 1e6, 2_147_483_648.0_f32] {
                let samples = chain.row_samples(&[photons; 64], at(0, 0), RowIndex(1), times);
                assert!(samples.signal_uv.iter().all(|uv| uv.is_finite()), "{photons} photons, {times:?}, {more:?}");
                let light = effects::regions::LightBounds { photons_min: 0.0, photons_max: photons.into() };
                let choice = effects::plan::EffectChoice::parse("auto", &[]).unwrap();
                let regions =
                    effects::regions::regions(&parameters, light, exposure_s, storage_s, sensel::pixel::ANY_DIE);
                let plan = effects::plan::plan(effects::build_all(&parameters), &regions, 0.1, &choice);
                assert!(
                    plan.bound.error_e2().is_finite()
                        && plan.budget_e > 0.0
                        && regions.iter().all(|region| region.sigma_e > 0.0)
                );
                tried += 1;
            }
        }
    }
    assert_eq!(f64_from_u64(tried), 120.0);
}

fn setup(assignments: &[&str]) -> Result<SensorSetup, String> {
    let mut all = vec!["scene.generator=box".to_owned()];
    all.extend(assignments.iter().map(|&assignment| assignment.to_owned()));
    let resolved = Resolved::from_layers("test", "", &all).map_err(|error| error.to_string())?;
    SensorSetup::new(&resolved).map_err(|error| error.to_string())
}

#[test]
fn corner_and_supply_act_on_a_sensor_and_what_makes_no_sense_is_refused() {
    let typical = setup(&[]).unwrap().parameters;
    let written =
        setup(&["sensor.corner=tt", "sensor.supply_v=3.3", "sensor.supply_nominal_v=3.3"]).unwrap().parameters;
    assert_eq!((&typical.pixel, &typical.adc), (&written.pixel, &written.adc));
    let fast = setup(&["sensor.corner=ff"]).unwrap().parameters;
    assert_eq!(fast.pixel.dark_current_e_per_s, 15.0);
    let low = setup(&["sensor.supply_v=2.52"]).unwrap().parameters;
    assert!(low.pixel.full_well_e < 8400.0 && low.adc.full_scale_uv < 100_000.0);
    let refusals = [
        ("sensor.corner=xx", "tt, ff, ss, fs, sf"),
        ("sensor.supply_v=1.8", "use 2.24 to 3.36"),
        ("sensor.supply_v=0.1", "0.5 to 10"),
        ("sensor.die_gain_sigma=0.2", "0 to 0.15"),
        ("sensor.die_dark_sigma=nan", "0 to 3"),
        ("sensor.temperature_k=451.0", "0 to 450"),
        ("sensor.pixel.image_lag=0.6", "0 to 0.5"),
        ("sensor.pixel.rts_rate_hz=0.0", "use 0.000001 to"),
        ("sensor.pixel.dark_doubling_k=1e-9", "out of range"),
    ];
    for (assignment, would_do) in refusals {
        let found = setup(&[assignment]);
        let message = found.err().unwrap_or_else(|| panic!("{assignment} is taken"));
        assert!(message.contains(assignment.split('=').next().unwrap()) && message.contains(would_do), "{message}");
    }
}
