//! Verbs that list what there is: presets, the schema, the effective configuration.

use std::path::Path;

use sensel::config::Resolved;
use sensel::config::presets::{self, Preset, PresetKind};
use sensel::config::scenario::Scenario;
use sensel::error::Error;
use sensel::run::Setup;
use serde_json::json;

use super::args::{CommonOptions, ConfigArguments};
use super::{paths, setup, words};

pub fn presets(shared: &CommonOptions) -> Result<(), Error> {
    check_assignments(shared)?;
    let list = |kind: PresetKind| -> Vec<serde_json::Value> {
        let of_kind = presets::ALL.iter().filter(|preset| preset.kind == kind);
        let values = |text: &str| text.parse::<toml::Table>().expect("presets are tested to be TOML");
        let object = |preset: &Preset| {
            let config = values(preset.text);
            json!({"name": preset.name, "summary": preset.summary, "config": config, "toml": preset.text})
        };
        of_kind.map(object).collect()
    };
    let technologies = sensel::energy::Technology::names().collect::<Vec<_>>();
    let scenes = paths::known_scenes(shared);
    if shared.json {
        print_json(&json!({
            "sensors": list(PresetKind::Sensor),
            "lenses": list(PresetKind::Lens),
            "technologies": technologies.iter().map(|name| json!({"name": name})).collect::<Vec<_>>(),
            "scenes": scenes.iter().map(|name| json!({"name": name})).collect::<Vec<_>>(),
        }));
        return Ok(());
    }
    for (title, kind) in [("sensors", PresetKind::Sensor), ("lenses", PresetKind::Lens)] {
        outln!("{title}");
        for preset in presets::ALL.iter().filter(|preset| preset.kind == kind) {
            outln!("  {:<16} {}", preset.name, preset.summary);
        }
    }
    outln!("technologies\n  {}", technologies.join("\n  "));
    outln!("scenes\n  {}", scenes.join("\n  "));
    Ok(())
}

/// `sensel presets show NAME`: every value of a preset or of a sensor file, with where it comes from.
pub fn preset(name: &str, shared: &CommonOptions) -> Result<(), Error> {
    let kind = if presets::find(PresetKind::Lens, name).is_ok() { PresetKind::Lens } else { PresetKind::Sensor };
    let section = kind.section();
    // A file is read from its own folder.
    let path = Path::new(name);
    let is_file = name.ends_with(".toml");
    let folder = path.parent().filter(|_| is_file).unwrap_or(Path::new(""));
    let own_name =
        path.file_name().filter(|_| is_file).map_or_else(|| name.to_owned(), |own| own.to_string_lossy().into_owned());
    let text = format!("[{section}]\npreset = {}\n", toml::Value::String(own_name));
    let resolved = paths::layered("command line", &text, &paths::assignments(shared, &[]), folder)?;
    if shared.json {
        let config = toml::Table::try_from(&resolved.scenario).expect("every field has a TOML form");
        let summary = presets::find(kind, name).map_or("", |preset| preset.summary);
        print_json(&json!({
            "name": name, "summary": summary, "config": {section: config[section]}, "inherited": resolved.inherited(section),
        }));
        return Ok(());
    }
    print_origins(&resolved, Some(section));
    Ok(())
}

/// Refuses assignments that a run would refuse, for verbs that read no scenario.
fn check_assignments(shared: &CommonOptions) -> Result<(), Error> {
    let resolved = Resolved::from_layers("command line", "", &paths::assignments(shared, &[]))?;
    Setup::check(&resolved, &setup::FolderAssets::new(Path::new("."), shared))
}

pub fn schema(shared: &CommonOptions) -> Result<(), Error> {
    check_assignments(shared)?;
    let mut schema = serde_json::to_value(schemars::schema_for!(Scenario)).expect("a schema has a JSON form");
    require_nothing(&mut schema);
    print_json(&schema);
    Ok(())
}

/// A scenario may leave out every key, because presets and defaults fill it.
fn require_nothing(schema: &mut serde_json::Value) {
    match schema {
        serde_json::Value::Object(fields) => {
            fields.remove("required");
            fields.values_mut().for_each(require_nothing);
        }
        serde_json::Value::Array(items) => items.iter_mut().for_each(require_nothing),
        _ => {}
    }
}

/// `sensel config show`. It refuses what `run` refuses before its first frame, without baking light.
pub fn config(arguments: &ConfigArguments, shared: &CommonOptions) -> Result<(), Error> {
    let located = paths::locate(arguments.scenario.as_deref(), shared, &[])?;
    let resolved = &located.resolved;
    Setup::check(resolved, &setup::FolderAssets::new(&located.folder, shared))?;
    words::warn(&resolved.inheritance_warnings());
    if !resolved.scenario.scene.is_named() {
        let text =
            "no scene is named: a run needs exactly one of scene.file, scene.generator, scene.target and scene.images";
        words::warn(&[text.to_owned()]);
    }
    if shared.json {
        let inherited: Vec<_> = SECTIONS.iter().flat_map(|section| resolved.inherited(section)).collect();
        let config = toml::Table::try_from(&resolved.scenario).expect("every field has a TOML form");
        print_json(&json!({
            "config": config, "config_hash": resolved.hash(), "inherited": inherited,
            "sensor": resolved.label(PresetKind::Sensor), "optics": resolved.label(PresetKind::Lens),
        }));
        return Ok(());
    }
    print_origins(resolved, None);
    Ok(())
}

/// Prints the effective configuration, or one section of it, with the layer and line of each value.
fn print_origins(resolved: &Resolved, only: Option<&str>) {
    let mut section = String::new();
    for line in resolved.canonical_text().lines() {
        if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            section = format!("{name}.");
        }
        let is_inside = |only: &str| section.strip_prefix(only).is_some_and(|rest| rest.starts_with('.'));
        if only.is_some_and(|only| !is_inside(only)) {
            continue;
        }
        let key = line.split_once(" = ").map(|(key, _)| format!("{section}{key}"));
        match key.as_ref().and_then(|key| resolved.tree.origin(key)) {
            Some(origin) if origin.line > 0 => outln!("{line:<44} # {}:{}", origin.layer, origin.line),
            Some(origin) => outln!("{line:<44} # {}", origin.layer),
            None if key.is_some_and(|key| key.starts_with("run.render_")) => outln!("{line:<44} # the sensor's own"),
            None => outln!("{line}"),
        }
    }
}

/// Sections of a scenario.
const SECTIONS: [&str; 11] =
    ["scene", "motion", "run", "rig", "optics", "sensor", "compute", "link", "tracker", "energy", "host"];

/// Prints one JSON value, indented.
pub fn print_json(value: &serde_json::Value) {
    outln!("{}", pretty(value));
}

/// One JSON value's text, indented.
pub fn pretty(value: &serde_json::Value) -> String {
    serde_json::to_string_pretty(value).expect("a JSON value has a text")
}
