//! Reads a sweep file and finds its folder.

use super::super::args::{CommonOptions, SweepFileArguments};
use super::super::setup::FolderAssets;
use super::super::{paths, words};
use sensel::config::Resolved;
use sensel::error::Error;
use sensel::files::sweep::{FoundCells, SweepFolder};
use sensel::run::inputs_hash;
use sensel::sweep::cells::Base;
use sensel::sweep::{Cells, SweepFile};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::sync::Mutex;

/// A sweep file is written by hand or by a small script.
pub(super) const SWEEP_BYTES_MAX: u64 = 1 << 24;

/// A sweep with everything that its verbs need.
pub struct Loaded {
    /// The sweep file.
    pub file: PathBuf,
    pub text: String,
    /// What it says.
    pub sweep: SweepFile,
    pub cells: Cells,
    /// Files of the scenario, and the cache.
    pub assets: FolderAssets,
    /// Where the sweep lies, or will lie.
    pub target: PathBuf,
}

/// Name of a sweep: that of its file.
pub(super) fn name_of(file: &Path) -> String {
    file.file_stem().map_or_else(|| "sweep".to_owned(), |stem| stem.to_string_lossy().into_owned())
}

pub(super) fn title(loaded: &Loaded) -> String {
    loaded.sweep.report.title.clone().unwrap_or_else(|| name_of(&loaded.file))
}

/// Reads a sweep file, its scenario and the files that this names, and resolves all cells.
pub(super) fn load(own: &SweepFileArguments, shared: &CommonOptions) -> Result<Loaded, Error> {
    let file = own.file.clone();
    let text = sensel::files::read_text(&file, SWEEP_BYTES_MAX)?;
    let shown = file.display().to_string();
    let sweep = SweepFile::parse(&shown, &text)?;
    // A count that no folder holds is refused before anything is resolved.
    sensel::sweep::design::points(&sweep).map_err(|error| at_file(error, &shown))?;
    // A folder of results may have the name of a built-in scenario.
    let is_scenario = |path: &PathBuf| path.is_file() || path.join("scene.toml").is_file();
    let beside = file.parent().map(|folder| folder.join(&sweep.scenario)).filter(is_scenario);
    let asked = beside.map_or_else(|| sweep.scenario.clone(), |path| path.display().to_string());
    let (scenario_file, scenario_text) = paths::scenario_text(Some(&asked), shared)?;
    let folder = scenario_file.parent().map_or_else(PathBuf::new, Path::to_path_buf);
    let assets = FolderAssets::new(&folder, shared);
    let name = scenario_file.display().to_string();
    let layered = move |layers: &[String]| paths::layered(&name, &scenario_text, layers, &folder);
    let base = Base { layered: Box::new(layered), assignments: paths::assignments(shared, &[]) };
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
pub(super) fn at_file(error: Error, shown: &str) -> Error {
    match error {
        Error::Config { file, line, key, value, reason } if file.is_empty() => {
            Error::Config { file: shown.to_owned(), line, key, value, reason }
        }
        other => other,
    }
}

/// The records in a sweep's folder; damaged ones are said.
pub(super) fn found(loaded: &Loaded, folder: &SweepFolder) -> FoundCells {
    let found = folder.find(loaded.cells.cells.iter().map(|cell| cell.name.as_str()));
    for path in &found.damaged {
        words::note(&format!("{} is damaged and counts as not run", path.display()));
    }
    found
}
