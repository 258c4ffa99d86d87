//! Writes `characterization.json`: every figure with its standard error and truth, the curves and maps behind them, configuration, seed and
//! version.

use serde::Serialize;
use serde_json::{Value, json};

use super::analysis::{Figures, Summary, figures};
use super::bench::SensorBench;
use super::defects::{Histogram, high_passed, histogram};
use super::measure::{ChannelMeasurement, TransferPoint};
use super::set::Set;
use super::spatial::{Profile, profiles, spectrogram, transposed};
use super::truth::{ChannelTruth, Want};
use super::uncertainty::measured_errors;
use crate::adc::density::{Density, Linearity, linearity, ramp_histogram};
use crate::adc::{AdcParams, Converter};
use crate::config::Resolved;
use crate::config::inherited::Inherited;
use crate::config::presets::PresetKind;
use crate::num::f64_from_u64;
use crate::report::Ordered;

/// Samples of the ramp histogram in each LSB, as `adc::density::linearity` takes them.
const SAMPLES_PER_LSB: u32 = 64;

/// Version of the form of `characterization.json`.
pub const SCHEMA_VERSION: u32 = 2;

/// One figure.
#[derive(Clone, Debug, Serialize)]
pub struct Figure {
    /// Measured; none where it is not measurable, with the reason.
    pub value: Option<f64>,
    /// From the size of the set.
    pub standard_error: Option<f64>,
    /// EMVA 1288's unit.
    pub unit: &'static str,
    /// What the configuration implies.
    pub truth: Option<Want>,
    /// Why there is no value.
    pub not_measurable: Option<String>,
    /// Why there is a value and nothing that it has to be.
    pub not_expected: Option<String>,
}

/// Everything that one channel's measurement leaves.
pub struct Characterization {
    /// Name of scenario or preset.
    pub name: String,
    /// Effective configuration.
    pub config: toml::Table,
    /// Its hash.
    pub config_hash: String,
    /// What to call the sensor: its preset and what was changed.
    pub sensor: String,
    /// What the measured quantum efficiency is made of, and where each factor stands.
    pub efficiency: String,
    /// Values of the sensor that the user did not write.
    pub inherited: Vec<Inherited>,
    /// What a user should know.
    pub warnings: Vec<String>,
    /// Of the run.
    pub seed: u64,
    /// Of the die.
    pub die: u64,
    /// What was shot.
    pub set: Set,
    /// The converter on its own, by code density.
    pub linearity: Linearity,
    /// The codes behind it.
    pub density: Density,
    /// Which of several readings of a pixel was measured; none where there is one.
    pub reading: Option<&'static str>,
    /// Means and variances.
    pub summary: Summary,
    /// By name.
    pub figures: Ordered<Figure>,
    /// Share of codes 0 in the dark.
    pub dark_clipped: f64,
    /// Mean dark frame about its mean, in DN.
    pub dark_map_dn: Vec<f64>,
    /// Mean bright frame less the mean dark frame, in % about its mean.
    pub response_map_percent: Vec<f64>,
    /// Of the mean dark frame, in DN.
    pub dark_histogram: Histogram,
    /// Of the high-passed response, in %.
    pub response_histogram: Histogram,
    measured: Figures,
}

pub(super) fn unit(name: &str) -> &'static str {
    match name {
        "K" => "DN/e-",
        "R" => "DN/photon",
        "QE" | "LE_min" | "LE_max" => "%",
        "sigma_y_dark" => "DN",
        "u_I_mean" | "u_I_var" => "e-/s",
        "sigma_d" | "u_e_sat" | "u_e_min" => "e-",
        "u_p_sat" | "u_p_min" => "photons",
        "SNR_max_dB" | "DR_dB" => "dB",
        _ if name.starts_with("DSNU") => "e-",
        _ if name.starts_with("PRNU") => "%",
        _ => "1",
    }
}

impl Characterization {
    /// Analyses a measurement.
    pub fn new(name: &str, resolved: &Resolved, bench: &SensorBench, measurement: &ChannelMeasurement) -> Self {
        let summary = Summary::of(measurement);
        let measured = figures(&summary);
        let errors = measured_errors(&summary, &measured);
        let truth = bench.truth();
        let figure = |(name, &value): (&str, &f64)| {
            let reason = truth.not_measurable.get(name).cloned();
            let finite = |value: f64| (reason.is_none() && value.is_finite()).then_some(value);
            let figure = Figure {
                value: finite(value),
                standard_error: errors.get(name).copied().and_then(finite),
                unit: unit(name),
                truth: truth.wants.get(name).cloned(),
                not_measurable: reason.clone(),
                not_expected: truth.not_expected.get(name).cloned(),
            };
            (name.to_owned(), figure)
        };
        let figures = measured.iter().map(figure).collect();
        let (dark_histogram, response_histogram) = histograms(measurement);
        let (linearity, density) = converter(&bench.sensor().parameters.adc);
        Self {
            name: name.to_owned(),
            config: resolved.recorded(),
            config_hash: resolved.hash(),
            sensor: resolved.label(PresetKind::Sensor),
            efficiency: efficiency(resolved),
            inherited: resolved.inherited("sensor"),
            warnings: resolved.inheritance_warnings(),
            seed: resolved.scenario.seed,
            die: resolved.scenario.sensor.die,
            set: bench.set().clone(),
            linearity,
            density,
            reading: reading(bench),
            figures,
            dark_clipped: measurement.dark_clipped,
            dark_map_dn: measurement.dark_pattern_dn(),
            response_map_percent: measurement.response_percent(),
            dark_histogram,
            response_histogram,
            summary,
            measured,
        }
    }

    /// A figure as measured, also where the standard does not report it.
    pub fn measured(&self, name: &str) -> f64 {
        self.measured.get(name).copied().unwrap_or(f64::NAN)
    }

    /// The figures alone, in the order of a report.
    pub fn figures_json(&self) -> String {
        serde_json::to_string_pretty(&self.figures).expect("figures have a JSON form")
    }

    /// The whole record as text.
    pub fn to_json(&self) -> String {
        let set = &self.set;
        let record = CharacterizationRecord {
            schema_version: SCHEMA_VERSION,
            version: env!("CARGO_PKG_VERSION"),
            standard: "EMVA 1288 release 4.0",
            name: &self.name,
            seed: self.seed,
            die: self.die,
            config_hash: &self.config_hash,
            config: &self.config,
            sensor: &self.sensor,
            efficiency: &self.efficiency,
            inherited: &self.inherited,
            warnings: &self.warnings,
            set: json!({
                "width_px": set.size.width_px, "height_px": set.size.height_px, "bits": set.bits,
                "points": set.points.len(), "stack": set.stack, "frames": set.frames(),
                "photons_per_s": set.photons_per_s, "saturation_e": set.saturation_e,
                "exposure_max_s": set.points.last().map(super::set::SeriesExposure::exposure_s),
                "sequencer_exposure_max_s": set.exposure_limit_s,
                "exposures": "set freely in whole nanoseconds under constant light; \
                              the sequencer rounds to lines and ends at sequencer_exposure_max_s",
                "channels": [set.channel.name()],
                "reading": self.reading,
            }),
            figures: &self.figures,
            converter: self.converter_json(),
            dark_clipped: self.dark_clipped,
            transfer: &self.summary.transfer.points,
            spectrograms: json!({
                "frequency": "entry k of n lies at k / (2 (n - 1)) cycles a pixel",
                "dark_horizontal_dn2": self.spectrum(&self.dark_map_dn, false),
                "dark_vertical_dn2": self.spectrum(&self.dark_map_dn, true),
                "response_horizontal_percent2": self.spectrum(&self.response_map_percent, false),
                "response_vertical_percent2": self.spectrum(&self.response_map_percent, true),
            }),
            profiles: json!({
                "dark_dn": self.profile_json(&self.dark_map_dn),
                "response_percent": self.profile_json(&self.response_map_percent),
            }),
            histograms: json!({"dark_dn": self.dark_histogram, "response_percent": self.response_histogram}),
        };
        serde_json::to_string_pretty(&record).expect("every value has a JSON form") + "\n"
    }

    /// Spectrogram of a map along rows, or along columns.
    pub fn spectrum(&self, map: &[f64], is_vertical: bool) -> Vec<f64> {
        let width = crate::num::index(self.set.size.width_px);
        if is_vertical {
            let turned = transposed(map, width);
            return spectrogram(&turned, map.len() / width);
        }
        spectrogram(map, width)
    }

    /// Horizontal and vertical profile of a map.
    pub fn profiles(&self, map: &[f64]) -> (Profile, Profile) {
        profiles(map, crate::num::index(self.set.size.width_px))
    }

    fn converter_json(&self) -> Value {
        let found = &self.linearity;
        json!({
            "method": "IEEE 1241: histogram of a ramp, 64 samples an LSB; fit of a full-scale sine. Columns alone, no noise",
            "bits": found.bits, "code_min": found.codes[0], "code_max": found.codes[1], "lsb_uv": found.lsb_uv,
            "dnl_min_lsb": found.dnl_lsb[0], "dnl_max_lsb": found.dnl_lsb[1],
            "inl_min_lsb": found.inl_lsb[0], "inl_max_lsb": found.inl_lsb[1],
            "missing_codes": found.missing_codes, "error_lsb": found.error_lsb, "enob_bits": found.enob_bits,
        })
    }

    fn profile_json(&self, map: &[f64]) -> Value {
        let (across, down) = self.profiles(map);
        let one = |profile: Profile| json!({"mean": profile.mean, "min": profile.least, "max": profile.most});
        json!({"horizontal": one(across), "vertical": one(down)})
    }
}

/// The converter by code density, in millionths of an LSB: smaller values are rounding of the method.
fn converter(adc: &AdcParams) -> (Linearity, Density) {
    // Adding 0 turns a negative zero into zero.
    let rounded = |value: f64| (1e6 * value).round_ties_even() / 1e6 + 0.0;
    let (found, mut density) = (linearity(adc), ramp_histogram(&Converter::new(adc), SAMPLES_PER_LSB));
    for values in [&mut density.dnl_lsb, &mut density.inl_lsb] {
        values.iter_mut().for_each(|value| *value = rounded(*value));
    }
    (Linearity { dnl_lsb: found.dnl_lsb.map(rounded), inl_lsb: found.inl_lsb.map(rounded), ..found }, density)
}

/// The standard's quantum efficiency counts the whole pixel: efficiency of the photodiode times its share of the area.
fn efficiency(resolved: &Resolved) -> String {
    let pixel = &resolved.scenario.sensor.pixel;
    let with_location = |key: &str, value: &dyn std::fmt::Display| {
        let path = format!("sensor.pixel.{key}");
        let how = if resolved.is_written(&path) { "written" } else { "inherited" };
        format!("{key} {value} ({how}, {})", resolved.location_of(&path))
    };
    let first = match pixel.quantum_efficiency {
        Some(value) => with_location("quantum_efficiency", &value),
        None => with_location("qe_by_filter", &"of the channel"),
    };
    format!("{first} times {}", with_location("fill_factor", &pixel.fill_factor))
}

/// The standard covers sensors of one reading a pixel.
fn reading(bench: &SensorBench) -> Option<&'static str> {
    let sensor = bench.sensor();
    if sensor.second.is_some() {
        return Some("the reading at the higher conversion gain alone, before both are merged");
    }
    let is_one = sensor.schedule.slots().len() == 1;
    (!is_one).then_some("one exposure alone, before the exposures are merged")
}

/// The form of `characterization.json`.
#[derive(Serialize)]
struct CharacterizationRecord<'a> {
    schema_version: u32,
    version: &'static str,
    standard: &'static str,
    name: &'a str,
    seed: u64,
    die: u64,
    config_hash: &'a str,
    config: &'a toml::Table,
    sensor: &'a str,
    efficiency: &'a str,
    inherited: &'a [Inherited],
    warnings: &'a [String],
    set: Value,
    figures: &'a Ordered<Figure>,
    converter: Value,
    dark_clipped: f64,
    transfer: &'a [TransferPoint],
    spectrograms: Value,
    profiles: Value,
    histograms: Value,
}

impl ChannelTruth {
    /// `truth.json`: the expected values of all figures that the judge computes (it computes neither `u_e_min` nor `SNR_max_dB`).
    pub fn to_json(&self) -> String {
        let judged = self.wants.iter().filter(|(name, _)| !["u_e_min", "SNR_max_dB"].contains(name));
        let judged: Ordered<Want> = judged.map(|(name, want)| (name, want.clone())).collect();
        serde_json::to_string_pretty(&judged).expect("wants have a JSON form") + "\n"
    }
}

fn histograms(measurement: &ChannelMeasurement) -> (Histogram, Histogram) {
    let signed = |sum: &u64| i64::try_from(*sum).expect("sums of 16-bit codes stay far below 2^63");
    let dark: Vec<i64> = measurement.dark.sums.iter().map(signed).collect();
    let response: Vec<i64> = measurement.bright.sums.iter().zip(&dark).map(|(sum, dark)| signed(sum) - dark).collect();
    let mean = response.iter().map(|&value| crate::num::f64_from_i64(value)).sum::<f64>()
        / crate::num::f64_from_usize(response.len());
    let width = crate::num::index(measurement.bright.size.width_px);
    let frames = f64_from_u64(measurement.dark.frames);
    (histogram(&dark, 1.0 / frames), histogram(&high_passed(&response, width), 100.0 / (25.0 * mean)))
}
