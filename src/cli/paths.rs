//! Where scenarios, scenes and caches lie, and the effective configuration that the command line asks for.

use std::path::{Path, PathBuf};

use sensel::config::Resolved;
use sensel::config::presets::{self, PresetKind};
use sensel::error::Error;
use sensel::files::folder::{OutputFolder, check_file, replace_file};
use sensel::files::input::InputFolders;
use sensel::files::open::{is_input, is_there};
use sensel::scene::images::PictureBytes as _;

use super::args::CommonOptions;
use super::words;

/// The scenario that runs when none is named.
pub const DEFAULT_SCENARIO: &str = "bathroom";

/// The scenario that needs no files; it comes with the program.
const BOX_SCENARIO: &str = "box";
const BOX_TEXT: &str = include_str!("../../scenes/box/scene.toml");

/// A scenario is written by hand; what is longer than this is another file named by mistake.
pub const SCENARIO_BYTES_MAX: u64 = 1 << 20;

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
pub fn locate(scenario: Option<&str>, shared: &CommonOptions, more: &[String]) -> Result<Located, Error> {
    let (file, text) = scenario_text(scenario, shared)?;
    let folder = file.parent().map_or_else(PathBuf::new, Path::to_path_buf);
    let assignments = assignments(shared, more);
    let resolved = layered_with_technology(&file.display().to_string(), &text, &assignments, &folder)?;
    Ok(Located { name: name_of(&file), folder, resolved })
}

/// A scenario's file and its text.
pub fn scenario_text(scenario: Option<&str>, shared: &CommonOptions) -> Result<(PathBuf, String), Error> {
    match (find(scenario.unwrap_or(DEFAULT_SCENARIO), shared), scenario) {
        (Ok(file), _) => {
            let text = sensel::files::read_text(&file, SCENARIO_BYTES_MAX)?;
            Ok((file, text))
        }
        (Err(_), Some(BOX_SCENARIO)) => Ok((PathBuf::from("box.toml"), BOX_TEXT.to_owned())),
        (Err(_), None) => {
            words::note(&format!("the scene '{DEFAULT_SCENARIO}' is not here; running the generated '{BOX_SCENARIO}'"));
            Ok((PathBuf::from("box.toml"), BOX_TEXT.to_owned()))
        }
        (Err(error), Some(_)) => Err(error),
    }
}

/// Merges all layers; files that they name stand in this folder.
pub fn layered(file: &str, text: &str, assignments: &[String], folder: &Path) -> Result<Resolved, Error> {
    let folders = InputFolders::new(vec![folder.to_path_buf()]);
    Resolved::from_layers_and_files(file, text, assignments, &|name| folders.read(name))
}

/// As `layered`, with the technology file that the scenario names.
fn layered_with_technology(file: &str, text: &str, assignments: &[String], folder: &Path) -> Result<Resolved, Error> {
    let folders = InputFolders::new(vec![folder.to_path_buf()]);
    let mut resolved = layered(file, text, assignments, folder)?;
    resolved.read_technology(&|name| folders.read(name)).map(|()| resolved)
}

/// As `locate`, where a sensor alone will do: a sensor preset's name stands for a scenario that has only this sensor, unless a
/// file or folder has the same name.
pub fn locate_sensor(sensor: Option<&str>, shared: &CommonOptions) -> Result<Located, Error> {
    let preset = sensor.filter(|name| presets::find(PresetKind::Sensor, name).is_ok() && !Path::new(name).exists());
    let Some(name) = preset else {
        return locate(sensor, shared, &[]).map_err(|error| match error {
            Error::Unknown { what: "scenario", name, known } => Error::Unknown {
                what: "sensor preset or scenario",
                name,
                known: format!("{}; scenarios: {known}", presets::names(PresetKind::Sensor).join(", ")),
            },
            other => other,
        });
    };
    let text = format!("[sensor]\npreset = \"{name}\"\n");
    let resolved = layered_with_technology("command line", &text, &assignments(shared, &[]), Path::new(""))?;
    Ok(Located { name: name.to_owned(), folder: PathBuf::new(), resolved })
}

/// Adds to the word on an unknown scenario what a sensor preset's name can be used for. A path is a file that is not there.
fn unknown_scenario(asked: &str, shared: &CommonOptions) -> Error {
    if Path::new(asked).extension().is_some_and(|ending| ending == "toml") {
        let reason = "is not there; name a scenario's file, or a scenario by its name, such as box".to_owned();
        return Error::Content { file: asked.to_owned(), reason };
    }
    let mut known = known_scenes(shared).join(", ");
    if presets::find(PresetKind::Sensor, asked).is_ok() {
        known = format!("{known} ({asked} is a sensor preset: add --set sensor.preset={asked} to one of these)");
    }
    Error::Unknown { what: "scenario", name: asked.to_owned(), known }
}

/// Refuses a file whose name promises another format than is written. A name without an ending promises none.
pub fn check_ending(option: &str, file: &Path, endings: &[&str], what: &str) -> Result<(), Error> {
    let Some(found) = file.extension() else { return Ok(()) };
    let found = found.to_string_lossy().to_ascii_lowercase();
    if endings.contains(&found.as_str()) {
        return Ok(());
    }
    let named = file.with_extension(endings[0]);
    let reason = format!(
        "{option} writes {what}; name a file ending in .{}, such as {}",
        endings.join(" or ."),
        named.display()
    );
    Err(Error::key(option, file.display(), reason))
}

/// The file that `--out` names, for verbs that write one file.
pub fn output_file(
    shared: &CommonOptions,
    endings: &[&str],
    what: &str,
    usual: &str,
) -> Result<Option<PathBuf>, Error> {
    let Some(file) = &shared.out else { return Ok(None) };
    if file.is_dir() {
        let reason = format!("is a folder; name a file, such as {}", file.join(usual).display());
        return Err(Error::key("--out", file.display(), reason));
    }
    check_ending("--out", file, endings, what)?;
    Ok(Some(file.clone()))
}

/// Refuses folders that are not there, and an output path where a verb writes no files.
pub fn check_shared(shared: &CommonOptions, writes: bool) -> Result<(), Error> {
    let from_environment = std::env::var_os("SENSEL_SCENES").map(PathBuf::from);
    for (key, folder) in [("--scenes", shared.scenes.as_ref()), ("SENSEL_SCENES", from_environment.as_ref())] {
        if let Some(folder) = folder.filter(|folder| !folder.is_dir()) {
            let reason = "is no folder; name one whose folders hold a scene.toml each";
            return Err(Error::key(key, folder.display(), reason));
        }
    }
    let Some(out) = shared.out.as_ref().filter(|_| !writes) else { return Ok(()) };
    let reason = "this verb writes no files; redirect its output, as in > FILE";
    Err(Error::key("--out", out.display(), reason))
}

/// What the command line lays over a scenario.
pub fn assignments(shared: &CommonOptions, more: &[String]) -> Vec<String> {
    let seed = shared.seed.map(|seed| format!("seed={seed}"));
    let threads = shared.threads.map(|threads| format!("run.threads={threads}"));
    more.iter().cloned().chain(seed).chain(threads).chain(shared.set.iter().cloned()).collect()
}

/// Moves a finished result to its target, and says where files of others stand that were in the way.
pub fn put(folder: OutputFolder) -> Result<(), Error> {
    for kept in folder.commit()?.kept {
        words::note(&format!("{} holds files that this program did not write; they were kept", kept.display()));
    }
    Ok(())
}

/// Whether an option's file may be written: it is none that this command reads, and could be made.
pub fn check_output(option: &str, file: &Path) -> Result<(), Error> {
    refuse_input(option, file)?;
    check_file(file)
}

/// Writes an option's file whole, or leaves what stood there.
pub fn write_output(option: &str, file: &Path, bytes: &[u8]) -> Result<(), Error> {
    refuse_input(option, file)?;
    replace_file(file, bytes)
}

/// Refuses to write over a file that this command reads.
pub fn refuse_input(option: &str, file: &Path) -> Result<(), Error> {
    if is_input(file) {
        return Err(Error::key(option, file.display(), "is a file that this command reads; name another"));
    }
    Ok(())
}

/// Refuses two options that name one file.
pub fn refuse_same(files: &[(&str, Option<&PathBuf>)]) -> Result<(), Error> {
    let named: Vec<(&str, PathBuf)> =
        files.iter().filter_map(|(option, file)| Some((*option, real((*file)?)))).collect();
    for (i, (option, file)) in named.iter().enumerate() {
        // A device takes what all of them write.
        let is_shared = file.metadata().is_ok_and(|about| !about.is_file());
        if let Some((other, _)) = named[..i].iter().find(|(_, before)| before == file && !is_shared) {
            return Err(Error::key(option, file.display(), format!("is the file of {other} too; name another")));
        }
    }
    Ok(())
}

/// A path without links, as far as it is there: two paths of one file begin alike, whether the file exists or not.
pub fn real(path: &Path) -> PathBuf {
    let whole = std::path::absolute(path).unwrap_or_else(|_| path.to_owned());
    let above = whole.ancestors().find_map(|above| Some((std::fs::canonicalize(above).ok()?, above)));
    above.map_or(whole.clone(), |(real, above)| {
        // Nothing joined would end the path in a separator.
        let rest = whole.strip_prefix(above).unwrap_or(Path::new(""));
        if rest.as_os_str().is_empty() { real } else { real.join(rest) }
    })
}

fn name_of(file: &Path) -> String {
    let stem = file.file_stem().map_or("scenario".into(), |stem| stem.to_string_lossy().into_owned());
    let folder = file.parent().and_then(Path::file_name).map(|name| name.to_string_lossy().into_owned());
    match folder {
        Some(folder) if stem == "scene" => folder,
        _ => stem,
    }
}

fn find(asked: &str, shared: &CommonOptions) -> Result<PathBuf, Error> {
    let direct = Path::new(asked);
    if is_there(direct) {
        return Ok(direct.to_path_buf());
    }
    if is_there(&direct.join("scene.toml")) {
        return Ok(direct.join("scene.toml"));
    }
    let folders = scene_folders(shared);
    for folder in &folders {
        for candidate in [folder.join(asked).join("scene.toml"), folder.join(format!("{asked}.toml"))] {
            if is_there(&candidate) {
                return Ok(candidate);
            }
        }
    }
    Err(unknown_scenario(asked, shared))
}

/// Folders that may hold scenarios: `--scenes`, else `SENSEL_SCENES`, else `./scenes` and upward from the program.
fn scene_folders(shared: &CommonOptions) -> Vec<PathBuf> {
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
pub fn folders_of_known_scenes(shared: &CommonOptions) -> Vec<PathBuf> {
    let mut folders: Vec<PathBuf> = scene_folders(shared)
        .iter()
        .filter_map(|folder| std::fs::read_dir(folder).ok())
        .flat_map(|entries| entries.filter_map(Result::ok))
        .map(|entry| entry.path())
        .filter(|folder| is_there(&folder.join("scene.toml")))
        .collect();
    folders.sort();
    folders
}

/// Names of the scenarios that can be asked for by name, sorted. The generated box is always there.
pub fn known_scenes(shared: &CommonOptions) -> Vec<String> {
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
