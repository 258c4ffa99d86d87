//! `sensel characterize`: an EMVA 1288 measurement of a sensor, and the folder for its judge.

use std::path::Path;
use std::sync::atomic::Ordering;
use std::time::Instant;

use sensel::characterize::{Characterization, MeasurementSize, SensorBench};
use sensel::error::Error;
use sensel::files::emva::EmvaWriter;
use sensel::files::folder::OutputFolder;
use sensel::files::write;
use sensel::units::Size;

use super::args::{CharacterizeArguments, CommonOptions};
use super::{interrupt, paths, progress, setup, words};

pub fn main(arguments: &CharacterizeArguments, shared: &CommonOptions) -> Result<(), Error> {
    let started = Instant::now();
    let paths::Located { name, resolved, .. } = paths::locate_sensor(arguments.sensor.as_deref(), shared)?;
    setup::use_threads(resolved.scenario.threads().map_err(|error| resolved.tree.locate(error))?)?;
    let bench = SensorBench::new(&resolved, &options(arguments)?)?;
    words::warn(&resolved.inheritance_warnings());
    let target = shared.out.clone().unwrap_or_else(|| Path::new("out").join(format!("{name}-emva1288")));
    let interrupted = interrupt::watch();
    let folder = OutputFolder::create(&target)?;
    let mut writer = EmvaWriter::create(folder.path(), bench.set())?;
    let bar = progress::bar("frames", bench.set().frames(), shared.quiet);
    let measurement = bench.run(|shot, codes| {
        if interrupted.load(Ordering::Relaxed) {
            return Err(Error::Interrupted);
        }
        bar.inc();
        writer.frame(shot, codes)
    })?;
    bar.finish();
    writer.finish(&bench.truth())?;
    let record = Characterization::new(&name, &resolved, &bench, &measurement);
    write(&folder.path().join("characterization.json"), record.to_json())?;
    write(&folder.path().join("characterization.html"), sensel::characterize::page::html(&record))?;
    write(&folder.path().join("config.toml"), resolved.recorded_text())?;
    paths::put(folder)?;
    if shared.json {
        outln!("{}", record.figures_json());
    } else if !shared.quiet {
        summary(&record, &target, started.elapsed().as_secs_f64());
    }
    Ok(())
}

fn options(arguments: &CharacterizeArguments) -> Result<MeasurementSize, Error> {
    let size = arguments.size.as_deref().map(size).transpose()?;
    let usual = MeasurementSize::default();
    Ok(MeasurementSize {
        size,
        points: arguments.points.unwrap_or(usual.points),
        stack: arguments.stack.unwrap_or(usual.stack),
        channel: arguments.channel,
    })
}

fn size(text: &str) -> Result<Size, Error> {
    let sides = text.split_once('x').and_then(|(width, height)| Some((width.parse().ok()?, height.parse().ok()?)));
    let (width_px, height_px) =
        sides.ok_or_else(|| Error::key("size", text, "is no size; use WIDTHxHEIGHT such as 320x240"))?;
    Ok(Size { width_px, height_px })
}

fn summary(record: &Characterization, target: &Path, seconds: f64) {
    let set = &record.set;
    let (name, Size { width_px, height_px }, points) = (&record.name, set.size, set.points.len());
    let (bits, stack) = (set.bits, set.stack);
    outln!("{name}: EMVA 1288 release 4.0, {width_px}x{height_px}, {bits} bit, {points} points, stacks of {stack}");
    outln!("channel: {}{}", set.channel.name(), record.reading.map_or(String::new(), |reading| format!("; {reading}")));
    outln!("sensor: {}; {} values inherited, listed in characterization.json", record.sensor, record.inherited.len());
    outln!("QE: {}", record.efficiency);
    let converter = &record.linearity;
    let ends = |[low, high]: [f64; 2]| format!("{low:+.3} to {high:+.3} LSB");
    outln!(
        "converter: DNL {}, INL {} (each to {:.3} LSB), {} missing codes, ENOB {}",
        ends(converter.dnl_lsb),
        ends(converter.inl_lsb),
        converter.error_lsb,
        converter.missing_codes,
        converter.enob_bits.map_or("none below 4 bits".to_owned(), |bits| format!("{bits:.2} bits"))
    );
    let mut missing = 0;
    for (name, figure) in record.figures.iter() {
        match (figure.value, figure.standard_error, &figure.not_measurable) {
            (Some(value), error, _) => {
                let error = error.map_or(String::new(), |error| format!("+- {error:.2e}"));
                let reason = figure.not_expected.as_ref().and_then(|reason| reason.split_once(": "));
                let note = reason.map_or(String::new(), |(cause, _)| format!("  (nothing expected: {cause})"));
                outln!("  {name:<16} {:>12} {error:<11} {}{note}", significant(value), figure.unit);
            }
            (None, _, reason) => {
                missing += 1;
                let reason = reason.as_deref().unwrap_or("the data hold none");
                outln!("  {name:<16} not measurable: {reason}");
            }
        }
    }
    let mut reasons: Vec<&String> =
        record.figures.iter().filter_map(|(_, figure)| figure.not_expected.as_ref()).collect();
    reasons.sort();
    reasons.dedup();
    reasons.iter().for_each(|reason| outln!("  {reason}"));
    outln!("  took             {seconds:.1} s for {} frames", set.frames());
    outln!("report: {}", target.join("characterization.html").display());
    outln!("{} measured, {missing} not measurable", record.figures.iter().count() - missing);
}

/// Five significant digits.
fn significant(value: f64) -> String {
    let size = value.abs();
    if size >= 1e6 || (size > 0.0 && size < 1e-3) {
        return format!("{value:.4e}");
    }
    let digits = [(1e4, 0), (1e3, 1), (1e2, 2), (1e1, 3), (1.0, 4)];
    let decimals = digits.into_iter().find(|(least, _)| size >= *least).map_or(5, |(_, decimals)| decimals);
    format!("{value:.decimals$}")
}
