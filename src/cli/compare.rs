//! `sensel compare`: is one run better than another, by how much, and how sure.

use std::path::{Path, PathBuf};

use sensel::error::Error;
use sensel::files::finished::{read_pictures, read_run};
use sensel::files::folder::OutputFolder;
use sensel::num::low_u8;
use sensel::plane::Plane;
use sensel::report::compare::{Against, Comparison, FigureDifference, FinishedRun, compare, compare_replicates};
use sensel::report::display_curve;
use sensel::report::html::compare::{ComparedFrame, change, compare_html, letter, quantity, range};

use super::args::{CommonOptions, CompareArguments};
use super::paths;

/// Frames that the page shows under the wiper.
const PICTURES: usize = 3;
/// Runs that are compared without replicates.
const RUNS: std::ops::RangeInclusive<usize> = 2..=8;

pub fn main(arguments: &CompareArguments, shared: &CommonOptions) -> Result<(), Error> {
    let target = shared.out.clone().unwrap_or_else(|| Path::new("out").join("compare"));
    if !shared.set.is_empty() || shared.seed.is_some() {
        let key = if shared.seed.is_some() { "--seed" } else { "--set" };
        return Err(Error::key(key, "given", "compare reads finished runs; set keys and seeds in 'sensel run'"));
    }
    OutputFolder::check(&target)?;
    let read = |folders: &[PathBuf]| folders.iter().map(|folder| read_run(folder)).collect::<Result<Vec<_>, _>>();
    let has_replicates = !arguments.against.is_empty();
    if !has_replicates && !RUNS.contains(&arguments.folders.len()) {
        let reason = "compare 2 to 8 runs, or name replicates: A1 A2 A3 --against B1 B2 B3";
        return Err(Error::key("compare", format!("{} folders", arguments.folders.len()), reason));
    }
    let (mut runs, others): (Vec<FinishedRun>, _) = (read(&arguments.folders)?, read(&arguments.against)?);
    for run in runs.iter().chain(&others) {
        if paths::real(Path::new(&run.folder)) == paths::real(&target) {
            return Err(Error::key("--out", target.display(), "is a folder that this command reads; name another"));
        }
    }
    let comparison = if has_replicates { compare_replicates(&runs, &others)? } else { compare(&runs)? };
    if has_replicates {
        // The page shows the first pair.
        runs.truncate(1);
        runs.extend(others.into_iter().take(1));
    }
    let frames = pictures(&runs)?;
    let json =
        serde_json::to_string_pretty(&comparison).map_err(|error| Error::Run(format!("compare.json: {error}")))?;
    let folder = OutputFolder::create(&target)?;
    let write = |file: &str, text: &str| sensel::files::write(&folder.path().join(file), text);
    write("compare.json", &format!("{json}\n"))?;
    write("compare.html", &compare_html(&comparison, &runs, &frames))?;
    paths::put(folder)?;
    if shared.json {
        outln!("{json}");
    } else if !shared.quiet {
        table(&comparison);
        outln!("page: {}", target.join("compare.html").display());
    }
    Ok(())
}

/// Frames that every run has, evenly over the shortest; none where sizes differ.
fn pictures(runs: &[FinishedRun]) -> Result<Vec<ComparedFrame>, Error> {
    let size = |run: &FinishedRun| (run.report.scenario.width_px, run.report.scenario.height_px);
    if runs.iter().any(|run| size(run) != size(&runs[0])) {
        return Ok(Vec::new());
    }
    let count = runs.iter().map(|run| run.report.frames.len()).min().unwrap_or(0);
    let frame_indices: Vec<usize> = (0..PICTURES.min(count)).map(|k| k * count / PICTURES.min(count)).collect();
    let shown: Vec<Vec<Plane<u8>>> = runs.iter().map(|run| shown(run, &frame_indices)).collect::<Result<_, _>>()?;
    let frame = |(k, frame_index): (usize, &usize)| ComparedFrame {
        caption: format!("{frame_index}, {:.3} s", runs[0].report.frames[*frame_index].t_s),
        pictures: shown.iter().map(|pictures| pictures[k].clone()).collect(),
    };
    Ok(frame_indices.iter().enumerate().map(frame).collect())
}

fn shown(run: &FinishedRun, frame_indices: &[usize]) -> Result<Vec<Plane<u8>>, Error> {
    let adc = run.report.config.get("sensor").and_then(|sensor| sensor.get("adc"));
    let key = adc.and_then(|adc| adc.get("black_level_dn")).and_then(toml::Value::as_integer);
    let black_level_dn = key.and_then(|value| u32::try_from(value).ok()).unwrap_or(0);
    // The folder's pictures have the top eight bits of the codes.
    let bits = run.report.scenario.bits;
    let black_of_8 = if bits > 8 { black_level_dn >> (bits - 8) } else { black_level_dn << (8 - bits) };
    let curve = |picture: Plane<u16>| {
        if black_of_8 < 255 {
            display_curve(&picture, 8, black_of_8)
        } else {
            picture.map(|value| low_u8(u32::from(value)))
        }
    };
    Ok(read_pictures(run, frame_indices)?.into_iter().map(curve).collect())
}

fn table(comparison: &Comparison) {
    outln!("A: {} ({}, seed {})", comparison.base.folder, comparison.base.scenario, comparison.base.seed);
    for (at, other) in comparison.others.iter().enumerate() {
        against(other, &letter(at + 1));
    }
}

fn against(other: &Against, name: &str) {
    outln!("{name}: {} ({}, seed {})", other.run.folder, other.run.scenario, other.run.seed);
    outln!("  {}", other.pairing);
    if other.config.is_empty() {
        outln!("  configurations are equal");
    }
    for key in &other.config {
        let shown = |value: &Option<String>| value.clone().unwrap_or_else(|| "not set".to_owned());
        outln!("  {} = {} -> {}", key.key, shown(&key.a), shown(&key.b));
    }
    outln!("  {:<36} {:>14} {:>14} {:>15} {:>32}  verdict", "figure", "A", name, "difference", "95 % interval");
    other.figures.iter().for_each(line);
}

fn line(figure: &FigureDifference) {
    let unit = &figure.unit;
    let text = |value: Option<String>| plain(&value.unwrap_or_else(|| "-".to_owned()));
    outln!(
        "  {:<36} {:>14} {:>14} {:>15} {:>32}  {}",
        figure.name,
        text(figure.a.map(|a| quantity(a, unit))),
        text(figure.b.map(|b| quantity(b, unit))),
        text(figure.difference.map(|difference| change(difference, unit))),
        text(figure.interval.map(|interval| range(interval, unit))),
        figure.verdict.words()
    );
}

/// The page's typography in ASCII, for terminals.
fn plain(text: &str) -> String {
    text.replace(['\u{a0}', '\u{202f}'], " ").replace('\u{2212}', "-").replace('\u{b5}', "u")
}
