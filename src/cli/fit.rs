//! `sensel fit`: a sensor file from the frames of a measurement.

use std::fmt::Write as _;

use sensel::characterize::fit::{Assumed, Fit, Fitted, fit};
use sensel::error::Error;
use sensel::files::emva_reader::{self, FoundMeasurement};
use sensel::num::significant;
use serde_json::json;

use super::args::{FitArguments, Shared};
use super::{listing, place, words};

/// `sensel fit`.
pub fn main(arguments: &FitArguments, shared: &Shared) -> Result<(), Error> {
    let out = place::output_file(shared, &["toml"], "a sensor file", "my_sensor.toml")?;
    if let Some(out) = &out {
        if out.exists() {
            return Err(Error::key("--out", out.display(), "is there already; name a new file"));
        }
        place::check_output("--out", out)?;
    }
    let located = place::locate_sensor(Some(&arguments.preset), shared)?;
    let pixel = &located.resolved.scenario.sensor.pixel;
    let temperature_k = arguments.temperature_k.unwrap_or(300.0);
    if !(200.0..=450.0).contains(&temperature_k) {
        return Err(Error::key("--temperature-k", temperature_k, "out of range; use 200 to 450"));
    }
    let assumed = Assumed {
        conversion_gain_uv_per_e: pixel.conversion_gain_uv_per_e,
        temperature_k,
        dark_doubling_k: pixel.dark_doubling_k,
    };
    let found = emva_reader::read(&arguments.folder)?;
    let refused = |reason: String| Error::Content { file: arguments.folder.display().to_string(), reason };
    let mut fit = fit(&found.measurement, found.bits, &assumed).map_err(refused)?;
    fit.warnings.splice(0..0, found.warnings.iter().cloned());
    if let Some(out) = &out {
        let text = sensor_file(&fit, &found, &arguments.preset, temperature_k);
        place::write_output("--out", out, text.as_bytes())?;
    }
    words::warn(&fit.warnings);
    if shared.json {
        listing::print_json(&json!({
            "preset": arguments.preset,
            "frames": {
                "width_px": found.size.width_px, "height_px": found.size.height_px, "bits": found.bits,
                "points": found.points, "stack": found.stack,
            },
            "temperature_k": temperature_k,
            "fit": fit,
        }));
        return Ok(());
    }
    let FoundMeasurement { size, bits, points, stack, .. } = &found;
    let folder = arguments.folder.display();
    outln!("{folder}: {}x{}, {bits} bit, {points} points, stacks of {stack}", size.width_px, size.height_px);
    for Fitted { key, value, interval: [low, high], rests_on } in &fit.fitted {
        outln!("  {key:<32} {:>12}   {:>12} to {:<12} {rests_on}", digits(*value), digits(*low), digits(*high));
    }
    outln!("left to {} or assumed:", arguments.preset);
    for untold in &fit.untold {
        outln!("  {:<32} {}", untold.key, untold.reason);
    }
    if let Some(out) = &out {
        outln!("sensor file: {0}; use it as sensor.preset = \"./{0}\" in a scenario of its folder", out.display());
    }
    Ok(())
}

/// Five significant digits.
fn digits(value: f64) -> String {
    format!("{}", significant(value, 5))
}

/// What a fitted sensor has besides its fitted keys.
const PIXEL: &str = "
[sensor.pixel]
fill_factor = 1.0                # part of the quantum efficiency that was measured
ktc_noise_uv = 0.0               # part of the read noise that was measured
storage_dark_e_per_s = 0.0       # part of the read noise and of the row offset that were measured
";
const ADC: &str = "
[sensor.adc]
gain = 1.0
cds = \"analog\"                   # one conversion a code; its noise is part of the read noise
";
const NO_WELL: &str = "full_well_e = 1e9                # the frames show no full well below the converter's range\n";

fn sensor_file(fit: &Fit, found: &FoundMeasurement, preset: &str, temperature_k: f64) -> String {
    let FoundMeasurement { bits, size, points, stack, .. } = found;
    let mut text = format!(
        "# From {points} points of photon transfer and stacks of {stack} frames by 'sensel fit'.\n\
         # Comments: 95 % interval; the figure of EMVA 1288 behind it.\n\
         [sensor]\npreset = {}\nwidth = {}\nheight = {}\ntemperature_k = {temperature_k:?}\n",
        toml::Value::from(preset),
        size.width_px,
        size.height_px
    );
    text.push_str(PIXEL);
    if fit.get("pixel.full_well_e").is_none() {
        text.push_str(NO_WELL);
    }
    push_fitted(&mut text, fit, "pixel.");
    text.push_str(ADC);
    let _ = writeln!(text, "bits = {bits}");
    push_fitted(&mut text, fit, "adc.");
    text
}

fn push_fitted(text: &mut String, fit: &Fit, section: &str) {
    for Fitted { key, value, interval: [low, high], rests_on } in &fit.fitted {
        let Some(key) = key.strip_prefix(section) else { continue };
        let value = match key {
            "black_level_dn" => format!("{value:.0}"),
            _ => format!("{:?}", significant(*value, 6)),
        };
        let assignment = format!("{key} = {value}");
        let _ = writeln!(text, "{assignment:<32} # {} to {}; {rests_on}", digits(*low), digits(*high));
    }
}
