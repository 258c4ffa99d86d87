//! Verbs that list what there is: presets, the schema, the effective configuration.

use sensel::config::presets::{self, Kind};
use sensel::config::scenario::Scenario;
use sensel::error::Error;
use serde_json::json;

use super::args::{ConfigArguments, Shared};
use super::place;

/// `sensel presets`.
pub fn presets(shared: &Shared) -> Result<(), Error> {
    let list = |kind: Kind| -> Vec<serde_json::Value> {
        let of_kind = presets::ALL.iter().filter(|preset| preset.kind == kind);
        of_kind.map(|preset| json!({"name": preset.name, "summary": preset.summary, "toml": preset.text})).collect()
    };
    let technologies = sensel::energy::Technology::names().collect::<Vec<_>>();
    let scenes = place::known_scenes(shared);
    if shared.json {
        print_json(&json!({
            "sensors": list(Kind::Sensor),
            "lenses": list(Kind::Lens),
            "technologies": technologies.iter().map(|name| json!({"name": name})).collect::<Vec<_>>(),
            "scenes": scenes.iter().map(|name| json!({"name": name})).collect::<Vec<_>>(),
        }));
        return Ok(());
    }
    for (title, kind) in [("sensors", Kind::Sensor), ("lenses", Kind::Lens)] {
        outln!("{title}");
        for preset in presets::ALL.iter().filter(|preset| preset.kind == kind) {
            outln!("  {:<16} {}", preset.name, preset.summary);
        }
    }
    outln!("technologies\n  {}", technologies.join("\n  "));
    outln!("scenes\n  {}", scenes.join("\n  "));
    Ok(())
}

/// `sensel schema`.
pub fn schema() -> Result<(), Error> {
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

/// `sensel config show`.
pub fn config(arguments: &ConfigArguments, shared: &Shared) -> Result<(), Error> {
    let located = place::locate(arguments.scenario.as_deref(), shared, &[])?;
    let resolved = &located.resolved;
    if shared.json {
        let values = serde_json::to_value(&resolved.scenario).expect("every field has a JSON form");
        print_json(&json!({"config": values, "config_hash": resolved.hash()}));
        return Ok(());
    }
    let mut section = String::new();
    for line in resolved.canonical_text().lines() {
        if let Some(name) = line.strip_prefix('[').and_then(|rest| rest.strip_suffix(']')) {
            section = format!("{name}.");
        }
        let key = line.split_once(" = ").map(|(key, _)| format!("{section}{key}"));
        match key.and_then(|key| resolved.tree.origin(&key)) {
            Some(origin) if origin.line > 0 => outln!("{line:<44} # {}:{}", origin.layer, origin.line),
            Some(origin) => outln!("{line:<44} # {}", origin.layer),
            None => outln!("{line}"),
        }
    }
    Ok(())
}

/// Prints one JSON value, indented.
pub fn print_json(value: &serde_json::Value) {
    outln!("{}", pretty(value));
}

/// One JSON value's text, indented.
pub fn pretty(value: &serde_json::Value) -> String {
    serde_json::to_string_pretty(value).expect("a JSON value has a text")
}
