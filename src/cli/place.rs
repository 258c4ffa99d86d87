//! Where scenarios, scenes and caches lie, and the effective configuration that the command line asks for.

use std::path::{Path, PathBuf};

use sensel::config::Resolved;
use sensel::config::presets::{self, Kind};
use sensel::error::Error;

use super::args::Shared;

/// The scenario that runs when none is named.
pub const DEFAULT_SCENARIO: &str = "bathroom";

/// The scenario that needs no files; it comes with the program.
const BOX_SCENARIO: &str = "box";
const BOX_TEXT: &str = include_str!("../../scenes/box/scene.toml");

/// A scenario is written by hand; what is longer than this is another file named by mistake.
const SCENARIO_BYTES_MAX: u64 = 1 << 20;

/// A scenario with the folder its files are relative to.
pub struct Located {
    /// Name for a person and for the output folder.
    pub name: String,
    /// Folder of the scenario's own files.
    pub folder: PathBuf,
    /// All layers merged.
    pub resolved: Resolved,
}

/// Finds and reads a scenario (or a file with sections of a sensor only: the rest has defaults) and lays the command line's words over it.
pub fn locate(scenario: Option<&str>, shared: &Shared, more: &[String]) -> Result<Located, Error> {
    let (file, text) = match (find(scenario.unwrap_or(DEFAULT_SCENARIO), shared), scenario) {
        (Ok(file), _) => {
            let text = sensel::files::read_text(&file, SCENARIO_BYTES_MAX)?;
            (file, text)
        }
        (Err(_), Some(BOX_SCENARIO)) => (PathBuf::from("box.toml"), BOX_TEXT.to_owned()),
        (Err(_), None) => {
            eprintln!("sensel: the scene '{DEFAULT_SCENARIO}' is not here; running the generated '{BOX_SCENARIO}'");
            (PathBuf::from("box.toml"), BOX_TEXT.to_owned())
        }
        (Err(error), Some(_)) => return Err(error),
    };
    let resolved = Resolved::from_layers(&file.display().to_string(), &text, &assignments(shared, more))?;
    let folder = file.parent().map_or_else(PathBuf::new, Path::to_path_buf);
    Ok(Located { name: name_of(&file), folder, resolved })
}

/// As `locate`, where a sensor alone will do: a sensor preset's name stands for a scenario that has only this sensor, unless a
/// file or folder has the same name.
pub fn locate_sensor(sensor: Option<&str>, shared: &Shared) -> Result<Located, Error> {
    let preset = sensor.filter(|name| presets::find(Kind::Sensor, name).is_ok() && !Path::new(name).exists());
    let Some(name) = preset else { return locate(sensor, shared, &[]) };
    let text = format!("[sensor]\npreset = \"{name}\"\n");
    let resolved = Resolved::from_layers("command line", &text, &assignments(shared, &[]))?;
    Ok(Located { name: name.to_owned(), folder: PathBuf::new(), resolved })
}

/// What the command line lays over a scenario.
pub fn assignments(shared: &Shared, more: &[String]) -> Vec<String> {
    let seed = shared.seed.map(|seed| format!("seed={seed}"));
    let threads = shared.threads.map(|threads| format!("run.threads={threads}"));
    more.iter().cloned().chain(seed).chain(threads).chain(shared.set.iter().cloned()).collect()
}

/// An error of the disk with the path it is about.
pub fn io(path: &Path, source: std::io::Error) -> Error {
    Error::Io { path: path.display().to_string(), source }
}

fn name_of(file: &Path) -> String {
    let stem = file.file_stem().map_or("scenario".into(), |stem| stem.to_string_lossy().into_owned());
    let folder = file.parent().and_then(Path::file_name).map(|name| name.to_string_lossy().into_owned());
    match folder {
        Some(folder) if stem == "scene" => folder,
        _ => stem,
    }
}

fn find(asked: &str, shared: &Shared) -> Result<PathBuf, Error> {
    let direct = Path::new(asked);
    if direct.is_file() {
        return Ok(direct.to_path_buf());
    }
    if direct.join("scene.toml").is_file() {
        return Ok(direct.join("scene.toml"));
    }
    let folders = scene_folders(shared);
    for folder in &folders {
        for candidate in [folder.join(asked).join("scene.toml"), folder.join(format!("{asked}.toml"))] {
            if candidate.is_file() {
                return Ok(candidate);
            }
        }
    }
    let known = known_scenes(shared).join(", ");
    Err(Error::Unknown { what: "scenario", name: asked.to_owned(), known })
}

/// Folders that may hold scenarios: `--scenes`, else `SENSEL_SCENES`, else `./scenes` and upward from the program.
fn scene_folders(shared: &Shared) -> Vec<PathBuf> {
    if let Some(folder) = &shared.scenes {
        return vec![folder.clone()];
    }
    if let Some(folder) = std::env::var_os("SENSEL_SCENES") {
        return vec![PathBuf::from(folder)];
    }
    let mut folders = vec![PathBuf::from("scenes")];
    if let Ok(program) = std::env::current_exe() {
        folders.extend(program.ancestors().skip(1).map(|folder| folder.join("scenes")));
    }
    folders
}

/// Folders of the scenarios that can be asked for by name, sorted.
pub fn folders_of_known_scenes(shared: &Shared) -> Vec<PathBuf> {
    let mut folders: Vec<PathBuf> = scene_folders(shared)
        .iter()
        .filter_map(|folder| std::fs::read_dir(folder).ok())
        .flat_map(|entries| entries.filter_map(Result::ok))
        .map(|entry| entry.path())
        .filter(|folder| folder.join("scene.toml").is_file())
        .collect();
    folders.sort();
    folders
}

/// Names of the scenarios that can be asked for by name, sorted. The generated box is always there.
pub fn known_scenes(shared: &Shared) -> Vec<String> {
    let mut names: Vec<String> = folders_of_known_scenes(shared)
        .iter()
        .filter_map(|folder| folder.file_name())
        .map(|name| name.to_string_lossy().into_owned())
        .collect();
    names.push(BOX_SCENARIO.to_owned());
    names.sort();
    names.dedup();
    names
}
