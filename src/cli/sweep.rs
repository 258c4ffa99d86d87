//! `sensel sweep`: a design space from its file to its table.

mod cell;
mod plan;
mod run;
mod specs;
mod submit;

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

use sensel::config::Resolved;
use sensel::error::Error;
use sensel::files::sweep::{FoundCells, SweepFolder};
use sensel::run::inputs_hash;
use sensel::sweep::cells::Base;
use sensel::sweep::gather::Table;
use sensel::sweep::{Cells, SweepFile, picture, report};

use super::args::{Shared, SweepArguments, SweepFileArguments, SweepPart};
use super::run::FolderAssets;
use super::{place, words};

/// A sweep file is written by hand or by a small script.
const SWEEP_BYTES_MAX: u64 = 1 << 24;

/// A sweep with everything that its verbs need.
pub struct Loaded {
    /// The sweep file.
    pub file: PathBuf,
    /// Its text.
    pub text: String,
    /// What it says.
    pub sweep: SweepFile,
    /// All cells.
    pub cells: Cells,
    /// Files of the scenario, and the cache.
    pub assets: FolderAssets,
    /// Where the sweep lies, or will lie.
    pub target: PathBuf,
}

/// `sensel sweep`.
pub fn main(arguments: &SweepArguments, shared: &Shared) -> Result<(), Error> {
    match &arguments.part {
        SweepPart::Plan(own) => plan::main(&load(own, shared)?, shared),
        SweepPart::Run(own) => run::main(own, &load(&own.sweep, shared)?, shared),
        SweepPart::Gather(own) => gather(&load(own, shared)?, shared),
        SweepPart::Report(own) => {
            let loaded = load(&own.sweep, shared)?;
            let folder = SweepFolder::read(&loaded.target)?;
            let found = found(&loaded, &folder);
            let verdicts = specs::judged(&specs::parse(&own.spec)?, &loaded.cells, &found.records)?;
            let table = Table::new(&loaded.cells, &found.records, &loaded.text);
            let title = title(&loaded);
            let page = report::page(&title, &loaded.sweep.report, &table, &verdicts)?;
            let place = folder.write_file("report.html", page.as_bytes())?;
            let mut tables = String::new();
            for interaction in report::interactions(&loaded.sweep.report, &table)? {
                tables.push_str(&format!("{}\n", interaction.markdown()));
                if let Some(svg) = picture::svg(&interaction) {
                    folder.write_file(&format!("{}.svg", interaction.file_name()), svg.as_bytes())?;
                }
            }
            if !tables.is_empty() {
                folder.write_file("report.md", tables.as_bytes())?;
            }
            said(shared, &[("report", &place)], table.rows, loaded.cells.cells.len());
            Ok(())
        }
        SweepPart::Submit(own) => submit::main(own, &load(&own.sweep, shared)?, shared),
    }
}

/// Name of a sweep: that of its file.
fn name_of(file: &Path) -> String {
    file.file_stem().map_or_else(|| "sweep".to_owned(), |stem| stem.to_string_lossy().into_owned())
}

fn title(loaded: &Loaded) -> String {
    loaded.sweep.report.title.clone().unwrap_or_else(|| name_of(&loaded.file))
}

/// Reads a sweep file, its scenario and the files that this names, and resolves all cells.
fn load(own: &SweepFileArguments, shared: &Shared) -> Result<Loaded, Error> {
    let file = own.file.clone();
    let text = sensel::files::read_text(&file, SWEEP_BYTES_MAX)?;
    let shown = file.display().to_string();
    let sweep = SweepFile::parse(&shown, &text)?;
    // A count that no folder holds is refused before anything is resolved.
    sensel::sweep::design::points(&sweep).map_err(|error| at_file(error, &shown))?;
    let beside = file.parent().map(|folder| folder.join(&sweep.scenario)).filter(|path| path.exists());
    let asked = beside.map_or_else(|| sweep.scenario.clone(), |path| path.display().to_string());
    let (scenario_file, scenario_text) = place::scenario_text(Some(&asked), shared)?;
    let folder = scenario_file.parent().map_or_else(PathBuf::new, Path::to_path_buf);
    let assets = FolderAssets::new(&folder, shared);
    let name = scenario_file.display().to_string();
    let layered = move |layers: &[String]| place::layered(&name, &scenario_text, layers, &folder);
    let base = Base { layered: Box::new(layered), assignments: place::assignments(shared, &[]) };
    let known: Mutex<BTreeMap<String, String>> = Mutex::new(BTreeMap::new());
    let assets_hash = |resolved: &Resolved| {
        let scenario = &resolved.scenario;
        let named = format!("{:?} {:?} {}", scenario.scene, scenario.motion.file, scenario.energy.technology);
        if let Some(hash) = known.lock().expect("no thread panics while it holds a hash").get(&named) {
            return Ok(hash.clone());
        }
        let hash = inputs_hash(resolved, &assets)?;
        known.lock().expect("no thread panics while it holds a hash").insert(named, hash.clone());
        Ok(hash)
    };
    let cells = Cells::new((&shown, &text), &sweep, base, &assets_hash)?;
    let target = shared.out.clone().unwrap_or_else(|| Path::new("out").join("sweeps").join(name_of(&file)));
    Ok(Loaded { file, text, sweep, cells, assets, target })
}

/// An error about a key of the sweep file, with the file's name.
fn at_file(error: Error, shown: &str) -> Error {
    match error {
        Error::Config { file, line, key, value, reason } if file.is_empty() => {
            Error::Config { file: shown.to_owned(), line, key, value, reason }
        }
        other => other,
    }
}

/// The records in a sweep's folder; damaged ones are said.
fn found(loaded: &Loaded, folder: &SweepFolder) -> FoundCells {
    let found = folder.find(loaded.cells.cells.iter().map(|cell| cell.name.as_str()));
    for place in &found.damaged {
        words::note(&format!("{} is damaged and counts as not run", place.display()));
    }
    found
}

fn gather(loaded: &Loaded, shared: &Shared) -> Result<(), Error> {
    let folder = SweepFolder::read(&loaded.target)?;
    let found = found(loaded, &folder);
    let table = Table::new(&loaded.cells, &found.records, &loaded.text);
    let parquet = folder.write_file("cells.parquet", &table.to_parquet()?)?;
    let csv = folder.write_file("cells.csv", table.to_csv().as_bytes())?;
    said(shared, &[("parquet", &parquet), ("csv", &csv)], table.rows, loaded.cells.cells.len());
    Ok(())
}

/// Says which files were written, of how many cells.
fn said(shared: &Shared, files: &[(&str, &PathBuf)], rows: usize, cells: usize) {
    if shared.json {
        let mut value = serde_json::json!({"cells": cells, "finished": rows});
        for (name, file) in files {
            value[*name] = file.display().to_string().into();
        }
        outln!("{value}");
    } else if !shared.quiet {
        for (name, file) in files {
            outln!("{name}: {} ({rows} of {cells} cells)", file.display());
        }
    }
}
