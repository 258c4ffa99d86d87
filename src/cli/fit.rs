//! `sensel fit`: a sensor file from the frames of a measurement.

use std::fmt::Write as _;
use std::path::Path;

use sensel::characterize::fit::defective::DefectivePixels;
use sensel::characterize::fit::doubling::DarkSeries;
use sensel::characterize::fit::roll_off::{RollOffTable, roll_off};
use sensel::characterize::fit::sound::sound_measurement;
use sensel::characterize::fit::{Assumed, Fitted, SensorFit, SensorFrames, fit};
use sensel::characterize::fit_page::{self, Beside};
use sensel::characterize::set::SIDE_MAX;
use sensel::characterize::{ChannelMeasurement, SensorBench};
use sensel::error::Error;
use sensel::files::emva_reader::{self, FoundMeasurement};
use sensel::num::significant;
use sensel::run::SensorSetup;
use sensel::units::Size;
use serde_json::json;

use super::args::{CommonOptions, FitArguments};
use super::{listing, paths, progress, words};

pub fn main(arguments: &FitArguments, shared: &CommonOptions) -> Result<(), Error> {
    let out = paths::output_file(shared, &["toml"], "a sensor file", "my_sensor.toml")?;
    if let Some(out) = &out {
        if out.exists() {
            return Err(Error::key("--out", out.display(), "is there already; name a new file"));
        }
        paths::check_output("--out", out)?;
    }
    if let Some(page) = &arguments.page {
        paths::check_ending("--page", page, &["html"], "a page")?;
        paths::check_output("--page", page)?;
        paths::refuse_same(&[("--out", out.as_ref()), ("--page", Some(page))])?;
    }
    let located = paths::locate_sensor(Some(&arguments.preset), shared)?;
    let pixel = &located.resolved.scenario.sensor.pixel;
    let temperature_k = arguments.temperature_k.unwrap_or(300.0);
    if !TEMPERATURES_K.contains(&temperature_k) {
        return Err(Error::key("--temperature-k", temperature_k, "out of range; use 200 to 450"));
    }
    let (pitch_um, focal_mm) = (pixel.pitch_um, arguments.focal_mm.unwrap_or(1.0));
    if !(0.01..=10_000.0).contains(&focal_mm) {
        return Err(Error::key("--focal-mm", focal_mm, "out of range; use 0.01 to 10,000"));
    }
    let assumed = Assumed {
        conversion_gain_uv_per_e: pixel.conversion_gain_uv_per_e,
        temperature_k,
        dark_doubling_k: pixel.dark_doubling_k,
    };
    let found = emva_reader::read(&arguments.folder)?;
    let temperatures =
        arguments.dark.iter().map(|dark| dark_series(dark, &found)).collect::<Result<Vec<_>, Error>>()?;
    let frames = SensorFrames {
        measurement: &found.measurement,
        defects: &found.defects,
        bits: found.bits,
        half: found.half,
        temperatures: &temperatures,
    };
    let mut fit = fit(&frames, &assumed).map_err(refused(&arguments.folder))?;
    let lens = match &arguments.flat {
        Some(folder) => {
            let flat = emva_reader::read_flat(folder, &found)?;
            let px_of_focal = 1e3 * focal_mm / pitch_um;
            Some(roll_off(&flat.bright, &flat.dark, found.bits, px_of_focal).map_err(refused(folder))?)
        }
        None => None,
    };
    fit.warnings.splice(0..0, found.warnings.iter().cloned());
    let text = sensor_file(&fit, &found, &arguments.preset, temperature_k);
    if let Some(out) = &out {
        paths::write_output("--out", out, text.as_bytes())?;
    }
    if let Some(page) = &arguments.page {
        let (simulated, made) = simulated(&found, &fit, arguments, temperature_k, shared)?;
        let name = arguments.folder.file_name().map_or("frames".into(), |name| name.to_string_lossy());
        let html = fit_page::html(&Beside {
            name: &name,
            preset: &arguments.preset,
            bits: found.bits,
            fit: &fit,
            measured: &found.measurement,
            simulated: &simulated,
            defects: [&found.defects, &made],
        });
        paths::write_output("--page", page, html.as_bytes())?;
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
            "defects": found.defects,
            "roll_off": lens,
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
    for undetermined in &fit.undetermined {
        outln!("  {:<32} {}", undetermined.key, undetermined.reason);
    }
    defects(&found.defects);
    if let Some(lens) = &lens {
        outln!("{}", lens_lines(lens));
    }
    if let Some(out) = &out {
        outln!("sensor file: {0}; use it as sensor.preset = \"./{0}\" in a scenario of its folder", out.display());
    }
    if let Some(page) = &arguments.page {
        outln!("page: {}", page.display());
    }
    Ok(())
}

/// Temperatures of a die in K.
const TEMPERATURES_K: std::ops::RangeInclusive<f64> = 200.0..=450.0;

fn refused(folder: &Path) -> impl Fn(String) -> Error {
    |reason| Error::Content { file: folder.display().to_string(), reason }
}

/// Dark frames by the words of `--dark`.
fn dark_series(words: &str, found: &FoundMeasurement) -> Result<DarkSeries, Error> {
    let parts = words.split_once('=').and_then(|(kelvin, folder)| Some((kelvin.parse::<f64>().ok()?, folder)));
    match parts {
        Some((kelvin, folder)) if TEMPERATURES_K.contains(&kelvin) => {
            emva_reader::read_dark(Path::new(folder), kelvin, found)
        }
        _ => Err(Error::key("--dark", words, "is no temperature of 200 to 450 K with a folder; use 320=FOLDER")),
    }
}

/// What was left out of all other figures.
fn defects(defects: &DefectivePixels) {
    let [hot, noisy] = [defects.hot.len(), defects.noisy.len()];
    let (dead, stuck) = (defects.dead.len(), defects.stuck.len());
    outln!(
        "defective pixels, left out of all other figures: {hot} hot, {noisy} noisy, {dead} dead, {stuck} stuck of {}; --json lists them",
        defects.pixels
    );
}

/// Lines of a scenario for a lens.
fn lens_lines(lens: &RollOffTable) -> String {
    let mut text = "lens, for a scenario:\n  [optics]\n  roll_off = \"table\"\n  roll_off_table = [".to_owned();
    for [angle_deg, share] in &lens.table {
        let _ = write!(text, "[{:.3}, {:.5}], ", angle_deg, share);
    }
    let half = lens.intervals.iter().map(|[low, high]| 0.5 * (high - low)).fold(0.0, f64::max);
    let _ = write!(
        text,
        "]\n  shares to {half:.5} (95 %); rings of the frames lie up to {:.5} beside the curve",
        lens.left_over
    );
    text
}

/// Frames of the fitted sensor under the light of those that were read: of their first rows and columns where they are large.
fn simulated(
    found: &FoundMeasurement,
    fit: &SensorFit,
    arguments: &FitArguments,
    temperature_k: f64,
    shared: &CommonOptions,
) -> Result<(ChannelMeasurement, DefectivePixels), Error> {
    let size = Size { width_px: found.size.width_px.min(SIDE_MAX), height_px: found.size.height_px.min(SIDE_MAX) };
    // The frames are of one colour plane. Lines long enough for a row of it: exposures here are free of the readout.
    let assignments = [
        format!("sensor.width={}", size.width_px),
        format!("sensor.height={}", size.height_px),
        "sensor.pixel.cfa=mono".to_owned(),
        format!("sensor.readout.hts={HTS}"),
        format!("sensor.readout.vts={VTS}"),
        "link.frequency_hz=2000000000".to_owned(),
        // Frames that characterize made have draws of their own.
        format!("seed={OTHER}"),
        format!("sensor.die={OTHER}"),
    ];
    // A preset that is a file is read from its own folder.
    let path = Path::new(&arguments.preset);
    let (preset, folder) = match path.file_name().filter(|_| path.exists()) {
        Some(name) => (format!("./{}", name.to_string_lossy()), path.parent().unwrap_or(Path::new(""))),
        None => (arguments.preset.clone(), Path::new("")),
    };
    let text = sensor_file(fit, found, &preset, temperature_k);
    let resolved = paths::layered("fitted sensor", &text, &assignments, folder)?;
    let pixel = SensorSetup::new(&resolved)?.parameters.pixel;
    let mut points = fit.light(&found.measurement, found.half, pixel.quantum_efficiency * pixel.fill_factor);
    let half = points.pop().unwrap_or(found.half);
    let stack = u32::try_from(found.stack).unwrap_or(u32::MAX);
    let bench = SensorBench::of_frames(&resolved, size, points, half, stack)?;
    let bar = progress::bar("simulated frames", bench.set().frames(), shared.quiet);
    let made = sound_measurement(&bench, || bar.inc());
    bar.finish();
    Ok(made)
}

/// Five significant digits.
fn digits(value: f64) -> String {
    format!("{}", significant(value, 5))
}

/// Clocks of a line and lines of a frame that hold any row and frame of a simulated stack.
const HTS: u32 = 16_384;
const VTS: u32 = 4_096;
/// Seed and die of the simulated frames.
const OTHER: u32 = 20_001;

/// What a fitted sensor has besides its fitted keys.
const PIXEL: &str = "
[sensor.pixel]
fill_factor = 1.0                # part of the quantum efficiency that was measured
ktc_noise_uv = 0.0               # part of the read noise that was measured
flicker_uv_per_rthz = 0.0        # part of the read noise that was measured
storage_dark_e_per_s = 0.0       # part of the read noise and of the row offset that were measured
";
const ADC: &str = "
[sensor.adc]
gain = 1.0
cds = \"analog\"                   # one conversion a code; its noise is part of the read noise
comparator_noise_uv = 0.0        # part of the read noise that was measured
ramp_noise_uv = 0.0              # part of the row noise that was measured
";
const INDEPENDENT: &str = "rts_rate_hz = 1e9                # amplitudes are what double sampling leaves\n";
const STRAIGHT: &str = "gain_compression = 0.0           # the bend is put down to the converter\n";
const NO_WELL: &str = "full_well_e = 1e9                # the frames show no full well below the converter's range\n";

fn sensor_file(fit: &SensorFit, found: &FoundMeasurement, preset: &str, temperature_k: f64) -> String {
    let FoundMeasurement { bits, size: Size { width_px, height_px }, points, stack, .. } = found;
    let mut text = format!(
        "# From {points} points of photon transfer and stacks of {stack} frames by 'sensel fit'.\n\
         # Comments: 95 % interval; the figure of EMVA 1288 behind it.\n\
         [sensor]\npreset = {}\nwidth = {width_px}\nheight = {height_px}\ntemperature_k = {temperature_k:?}\n",
        toml::Value::from(preset)
    );
    text.push_str(PIXEL);
    if fit.get("pixel.full_well_e").is_none() {
        text.push_str(NO_WELL);
    }
    push_fitted(&mut text, fit, "pixel.");
    for (key, line) in [("pixel.rts_ppm", INDEPENDENT), ("adc.ramp_inl_lsb", STRAIGHT)] {
        if fit.get(key).is_some() {
            text.push_str(line);
        }
    }
    text.push_str(ADC);
    let _ = writeln!(text, "bits = {bits}");
    push_fitted(&mut text, fit, "adc.");
    text
}

fn push_fitted(text: &mut String, fit: &SensorFit, section: &str) {
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
