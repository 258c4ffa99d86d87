//! The EMVA 1288 reference implementation judges `sensel characterize`: the preset, random sensors, and wrong ones that must fail.
#![cfg(feature = "outside")]
#![allow(clippy::unwrap_used)] // A helper of tests may panic as the tests do.

use crate::common;

use std::path::Path;
use std::process::Command;

use common::Scratch;
use rand::RngExt;
use sensel::characterize::{ChannelTruth, Characterization, MeasurementSize, SensorBench};
use sensel::config::Resolved;
use sensel::config::presets::{self, PresetKind};
use sensel::draw::{DrawKey, EffectNumber, fill_uniforms, normals};
use sensel::effect::{Domain, Effect, Identity, Omission, RowPass};
use sensel::effects::chain::Chain;
use sensel::effects::{self, Parameters};
use sensel::facts::Facts;
use sensel::files::emva::EmvaWriter;
use sensel::num::{index, u32_truncated};
use sensel::run::SensorSetup;
use serde_json::Value;

/// What the judge said of a folder.
struct Verdict {
    passes: bool,
    measured: Value,
    failed: Vec<String>,
    words: String,
}

/// Runs the judge; its absence is a failure, not a pass.
fn judge(folder: &Path) -> Verdict {
    let python = std::env::var("SENSEL_JUDGE_PYTHON").expect("./check names the judges' Python in SENSEL_JUDGE_PYTHON");
    let script = Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/judges/emva1288_check.py");
    let json = folder.join("judge.json");
    let mut command = Command::new(python);
    let output = command.arg(script).arg("judge").arg(folder).arg("--json").arg(&json).output().unwrap();
    let words = format!("{}{}", String::from_utf8_lossy(&output.stdout), String::from_utf8_lossy(&output.stderr));
    let code = output.status.code().unwrap();
    assert!(code == 0 || code == 1, "the judge could not use the folder: {words}");
    // Python writes NaN, which JSON does not have.
    let text = std::fs::read_to_string(&json).unwrap().replace("NaN", "null");
    let found: Value = serde_json::from_str(&text).unwrap();
    let failed = found["failed"].as_array().unwrap().iter().map(|name| name.as_str().unwrap().to_owned()).collect();
    Verdict { passes: code == 0, measured: found["measured"].clone(), failed, words }
}

/// Shoots a bench into a folder, judges it, and returns the own analysis of the same frames.
fn shot_and_judged(resolved: &Resolved, bench: &SensorBench) -> (Verdict, Characterization, ChannelTruth) {
    let scratch = Scratch::new("emva");
    let mut writer = EmvaWriter::create(scratch.path(), bench.set()).unwrap();
    let measurement = bench.run(|shot, codes| writer.frame(shot, codes)).unwrap();
    let truth = bench.truth();
    writer.finish(&truth).unwrap();
    (judge(scratch.path()), Characterization::new("test", resolved, bench, &measurement), truth)
}

/// What SciPy's `leastsq`, which the judge fits straight lines with, leaves of a slope: it stops when a step is below 1.5e-8 of the
/// solution, each unknown weighed by its column, so a faint slope t carries 1.5e-8 of the offset over the root mean square time.
fn line_tolerance(name: &str, ours: &Characterization) -> f64 {
    let points = &ours.summary.transfer.points;
    let mean = |of: &dyn Fn(&sensel::characterize::measure::TransferPoint) -> f64| {
        points.iter().map(of).sum::<f64>() / points.len() as f64
    };
    let time_s = mean(&|point| (point.exposure_ns * 1e-9) * (point.exposure_ns * 1e-9)).sqrt();
    let k = ours.measured("K");
    match name {
        "u_I_mean" => 1.5e-8 * mean(&|point| point.dark_mean_dn) / (time_s * k),
        "u_I_var" => 1.5e-8 * mean(&|point| point.dark_variance_dn2) / (time_s * k * k),
        _ => 0.0,
    }
}

/// Every figure of ours against the judge's from the same frames, to 1e-6. Correlations and linearity errors are differences of numbers
/// near 1 and near 100 %, so their rounding is absolute.
fn compare(ours: &Characterization, theirs: &Value) -> usize {
    let mut compared = 0;
    for (name, figure) in ours.figures.iter() {
        let (Some(value), Some(judged)) = (figure.value, theirs[name].as_f64()) else { continue };
        let near_zero = name.starts_with("x_rho") || name.starts_with("LE_");
        let tolerance = if near_zero { 1e-9 } else { 1e-6 * judged.abs() } + line_tolerance(name, ours);
        assert!((value - judged).abs() <= tolerance, "{name}: {value} here, {judged} by the judge");
        compared += 1;
    }
    compared
}

fn paper(assignments: &[&str]) -> Resolved {
    let text = "[sensor]\npreset = \"paper_6t_vga\"\n";
    let assignments: Vec<String> = assignments.iter().map(|&word| word.to_owned()).collect();
    Resolved::from_layers("test", text, &assignments).unwrap()
}

#[test]
fn the_papers_sensor_passes_and_every_figure_equals_the_judges() {
    let resolved = paper(&[]);
    let bench = SensorBench::new(&resolved, &MeasurementSize::default()).unwrap();
    let (verdict, ours, truth) = shot_and_judged(&resolved, &bench);
    assert!(verdict.passes, "{}", verdict.words);
    // All the judge knows but the row parts, which this sensor does not have.
    assert_eq!(compare(&ours, &verdict.measured), 24);
    let missing: Vec<&str> = truth.not_measurable.iter().map(|(name, _)| name).collect();
    assert_eq!(missing, ["DSNU1288_row", "PRNU1288_row"]);
    assert_eq!(truth.wants.get("K").unwrap().configured.map(|k| (k * 1e4).round()), Some(931.0));
}

/// Every preset bare, in the channel that responds most; one colour sensor in its faintest channel as well.
#[test]
fn every_preset_passes() {
    let channels =
        presets::names(PresetKind::Sensor).into_iter().map(|name| (name, None)).chain([("imx219", Some('R'))]);
    let channels: Vec<_> = channels.step_by(common::cases(1, 3)).collect();
    let mut judged = 0;
    for &(name, channel) in &channels {
        let resolved = Resolved::from_layers("test", &format!("[sensor]\npreset = \"{name}\"\n"), &[]).unwrap();
        // 57 e- a code and 26 e- of dark noise: the third cumulant of so coarse a sensor takes 147 frames to tell from a normal's.
        let stack = if name == "generic_3t" { 160 } else { 48 };
        let bench =
            SensorBench::new(&resolved, &MeasurementSize { channel, stack, ..MeasurementSize::default() }).unwrap();
        let (verdict, ours, truth) = shot_and_judged(&resolved, &bench);
        println!("{name} {}: {} figures", bench.set().channel.name(), truth.wants.iter().count());
        assert!(verdict.passes, "{name}: {}", verdict.words);
        compare(&ours, &verdict.measured);
        for figure in ALWAYS {
            assert!(truth.wants.get(figure).is_some(), "{name}: {figure}: {:?}", truth.not_measurable.get(figure));
            judged += 1;
        }
    }
    println!("{judged} figures");
    // Nine presets and a second channel; each day every third of them.
    assert_eq!(channels.len(), common::cases(10, 4));
    assert_eq!(judged, channels.len() * ALWAYS.len());
}

/// Rarer effects that the truth has in closed form: all at once, strong enough to show, each passes; and what it does not know is left
/// out of it by name.
#[test]
fn rarer_effects_pass_in_closed_form_or_are_left_out_by_name() {
    let strong = [
        "sensor.adc.row_noise_uv=60",
        "sensor.adc.column_noise_uv=40",
        "sensor.adc.row_offset_uv=30",
        "sensor.adc.comparator_noise_uv=50",
        "sensor.adc.ramp_noise_uv=20",
        "sensor.adc.ramp_jitter_ps=500",
        "sensor.pixel.flicker_uv_per_rthz=10",
        "sensor.pixel.gain_compression=0.02",
        "sensor.pixel.storage_leakage_per_s=2",
        "sensor.pixel.parasitic_light=0.01",
        "sensor.pixel.storage_dark_e_per_s=60",
    ];
    let resolved = paper(&strong);
    let bench = SensorBench::new(&resolved, &MeasurementSize::default()).unwrap();
    let (verdict, _, truth) = shot_and_judged(&resolved, &bench);
    assert!(verdict.passes, "{}", verdict.words);
    let rows = truth.wants.get("x_rho_row").unwrap();
    // 60 uV and twice 20 uV are 0.38 DN^2 of some 43 DN^2 of shot noise at half saturation: beyond the tolerance.
    assert!(rows.value.unwrap() > 2.0 * rows.abs_tol.unwrap(), "{rows:?}");
    let left: Vec<&str> = truth.not_expected.iter().map(|(name, _)| name).collect();
    assert_eq!(left, ["PRNU1288_row", "x_k3_ratio"]);

    let hot = paper(&["sensor.pixel.hot_ppm=200", "sensor.pixel.hot_dark_e_per_s=500"]);
    let bench = SensorBench::new(&hot, &MeasurementSize::default()).unwrap();
    let (verdict, _, truth) = shot_and_judged(&hot, &bench);
    assert!(verdict.passes, "{}", verdict.words);
    assert!(truth.not_expected.get("DSNU1288").unwrap().starts_with("hot_pixels: "));
    assert!(truth.wants.get("K").is_some() && truth.wants.get("DSNU1288").is_none());
}

/// What any sensor that the standard can measure has; parts of patterns that are too faint may be missing, with the reason.
const ALWAYS: [&str; 21] = [
    "K",
    "R",
    "QE",
    "sigma_d",
    "sigma_y_dark",
    "u_I_mean",
    "u_e_sat",
    "u_p_sat",
    "u_p_min",
    "SNR_max",
    "DR_dB",
    "DSNU1288",
    "DSNU1288_pixel",
    "PRNU1288",
    "PRNU1288_pixel",
    "LE_min",
    "LE_max",
    "x_k3_ratio",
    "x_rho_frame",
    "x_rho_row",
    "x_rho_col",
];

/// A random sensor that the standard can measure: dark noise of 0.3 to 3 DN before the converter, a black level six sigma above 0.
fn random_sensor(seed: u64) -> Vec<String> {
    let mut stream = DrawKey::root(seed).stream();
    let mut draw = |least: f64, most: f64| least + (most - least) * stream.random::<f64>();
    let exp = |low: f64, high: f64, at: f64| low * libm::pow(high / low, at);
    let bits = 8 + u32_truncated(draw(0.0, 6.999));
    let codes = f64::from(1 << bits);
    let full_well = exp(1500.0, 12_000.0, draw(0.0, 1.0));
    let per_e = exp(5.0, 150.0, draw(0.0, 1.0));
    let adc_gain = exp(0.5, 8.0, draw(0.0, 1.0));
    // The converter clips first below 1, the well above.
    let range = draw(0.6, 1.5);
    let gain_dn = 0.9 * codes / (full_well * range);
    let full_scale = adc_gain * codes * per_e / gain_dn;
    // More than 1.5 e- of noise: a sensor that counts single electrons is another chapter.
    let noise_e = f64::max(exp(0.32, 3.0, draw(0.0, 1.0)) / gain_dn, 1.5);
    let pixel = ["3T", "4T", "5T", "6T"][index(u32_truncated(draw(0.0, 3.999)))];
    let cds = ["none", "analog", "digital"][index(u32_truncated(draw(0.0, 2.999)))];
    let resets = match (cds, pixel) {
        ("none", _) => 1.0,
        (_, "3T" | "5T") => 2.0,
        _ => 0.0,
    };
    let ktc_share = if resets > 0.0 { draw(0.1, 0.8) } else { 0.0 };
    let read_uv = per_e * noise_e * (1.0 - ktc_share * ktc_share).sqrt();
    let ktc_uv = if resets > 0.0 { per_e * noise_e * ktc_share / f64::sqrt(resets) } else { 300.0 };
    let offset_e = noise_e * draw(0.0, 1.0);
    let dsnu_e = noise_e * draw(0.05, 1.0);
    let spread_dn = gain_dn * (noise_e * noise_e + offset_e * offset_e + dsnu_e * dsnu_e).sqrt();
    let offset_uv = per_e * offset_e;
    vec![
        format!("seed={seed}"),
        format!("sensor.die={}", seed + 77),
        format!("sensor.temperature_k={}", draw(280.0, 330.0)),
        format!("sensor.pixel.type='{pixel}'"),
        format!("sensor.pixel.quantum_efficiency={}", draw(0.2, 1.0)),
        format!("sensor.pixel.fill_factor={}", draw(0.3, 1.0)),
        format!("sensor.pixel.conversion_gain_uv_per_e={per_e}"),
        format!("sensor.pixel.full_well_e={full_well}"),
        format!("sensor.pixel.dark_current_e_per_s={}", exp(0.5, 1000.0, draw(0.0, 1.0))),
        format!("sensor.pixel.read_noise_uv={read_uv}"),
        format!("sensor.pixel.ktc_noise_uv={ktc_uv}"),
        format!("sensor.pixel.prnu={}", draw(0.002, 0.03)),
        format!("sensor.pixel.dsnu_e={dsnu_e}"),
        format!("sensor.adc.bits={bits}"),
        "sensor.adc.clock_hz=8000000000".to_owned(),
        format!("sensor.adc.gain={adc_gain}"),
        format!("sensor.adc.full_scale_uv={full_scale}"),
        format!("sensor.adc.black_level_dn={}", (6.0 * spread_dn + 2.0).ceil()),
        format!("sensor.adc.cds='{cds}'"),
        format!("sensor.adc.column_offset_uv={offset_uv}"),
        format!("sensor.adc.column_offset_residual_uv={offset_uv}"),
        format!("sensor.adc.column_gain_sigma={}", draw(0.0, 0.01)),
        format!("sensor.readout.shutter='{}'", if draw(0.0, 1.0) < 0.5 { "global" } else { "rolling" }),
        "link.lanes=4".to_owned(),
    ]
}

#[test]
fn random_sensors_pass_third_cumulant_included() {
    let (mut judged, sensors) = (0, common::cases(10, 3));
    for seed in 1288..1288 + sensors {
        let assignments = random_sensor(seed);
        println!("seed {seed}: {}", assignments.join(" "));
        let words: Vec<&str> = assignments.iter().map(String::as_str).collect();
        let resolved = paper(&words);
        let bench = SensorBench::new(&resolved, &MeasurementSize::default()).unwrap();
        let (verdict, ours, truth) = shot_and_judged(&resolved, &bench);
        assert!(verdict.passes, "seed {seed}: {}", verdict.words);
        compare(&ours, &verdict.measured);
        for name in ALWAYS {
            assert!(truth.wants.get(name).is_some(), "seed {seed}: {name}: {:?}", truth.not_measurable.get(name));
            judged += 1;
        }
    }
    println!("{judged} figures");
    assert_eq!(judged, 21 * sensors);
}

/// Shot noise as a normal of Poisson's mean and variance: what a stand-in would do.
struct NormalShot;

impl Effect for NormalShot {
    fn identity(&self) -> Identity {
        Identity { name: "shot_noise", number: EffectNumber(102), domain: Domain::MeanElectrons }
    }

    fn omission(&self, _facts: &Facts) -> Option<Omission> {
        None
    }

    fn reason(&self, _facts: &Facts) -> String {
        "a stand-in".to_owned()
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        fill_uniforms(row.temporal_key(self.identity().number), row.uniforms);
        normals(row.uniforms, row.draws);
        for (value, draw) in row.values.iter_mut().zip(row.draws.iter()) {
            *value += value.max(0.0).sqrt() * draw;
        }
    }
}

/// Judges frames of a changed chain against the truth of the paper's sensor.
fn judged_with(change: impl Fn(&mut Parameters), effects: impl Fn(&Parameters) -> Vec<Box<dyn Effect>>) -> Verdict {
    let resolved = paper(&[]);
    let mut parameters = SensorSetup::new(&resolved).unwrap().parameters;
    change(&mut parameters);
    let chosen = effects(&parameters);
    let chain = Chain::new(parameters, chosen, 1, 1);
    let bench = SensorBench::with_chain(&resolved, &MeasurementSize::default(), chain).unwrap();
    shot_and_judged(&resolved, &bench).0
}

#[test]
fn a_normal_in_the_place_of_poisson_fails_by_its_third_cumulant_alone() {
    let normal = |parameters: &Parameters| {
        let all = effects::build_all(parameters).into_iter();
        let swap = |effect: Box<dyn Effect>| match effect.name() {
            "shot_noise" => Box::new(NormalShot) as Box<dyn Effect>,
            _ => effect,
        };
        all.map(swap).collect()
    };
    let verdict = judged_with(|_| {}, normal);
    assert_eq!(verdict.failed, ["x_k3_ratio"], "{}", verdict.words);
    // A normal has none: 0 within 4.5 standard errors of 0.1 (4.5 sqrt(6 N / (n L)) for N = 5,000 e-, n = 76,800 pixels, L = 48).
    assert!(verdict.measured["x_k3_ratio"].as_f64().unwrap().abs() < 0.45);
}

#[test]
fn a_gain_two_percent_off_fails() {
    let verdict = judged_with(|parameters| parameters.pixel.conversion_gain_uv_per_e *= 1.02, effects::build_all);
    for name in ["K", "R"] {
        assert!(verdict.failed.iter().any(|failed| failed == name), "{name}: {}", verdict.words);
    }
}
