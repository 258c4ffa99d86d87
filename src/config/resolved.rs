//! A scenario with its defaults, checked, and the origin of every value.

use super::presets::{self, PresetKind};
use super::scenario::Scenario;
use super::tree::Tree;
use super::{sensor_file, suggest};
use crate::error::Error;
use std::collections::BTreeMap;

/// Keys that say one thing in several ways: a layer that writes one takes away the others of the layers below. Two of them in one
/// layer are refused where the value is used.
pub(super) const EXCLUSIVE: &[&[&str]] = &[
    &["motion.file", "motion.kind"],
    &["rig.baseline_mm", "rig.camera"],
    // A field of view stands for both focal lengths.
    &["optics.horizontal_fov_deg", "optics.fx_px"],
    &["optics.horizontal_fov_deg", "optics.fy_px"],
    &["scene.file", "scene.generator", "scene.target", "scene.images"],
    &["scene.illuminant", "scene.blackbody_k"],
    &["run.samples_per_pixel", "run.render_tolerance"],
    &["sensor.pixel.quantum_efficiency", "sensor.pixel.qe_by_filter"],
    &["sensor.readout.exposure_us", "sensor.readout.exposure_lines"],
    &["sensor.readout.vts", "sensor.readout.frame_rate_hz"],
];

/// All layers merged: defaults < presets < scenario < `--set`.
#[derive(Clone)]
pub struct Resolved {
    /// The values, typed.
    pub scenario: Scenario,
    /// The values with their origins.
    pub tree: Tree,
    /// Defaults and presets alone, below what the user wrote.
    pub(super) below: Tree,
    /// Technology files that were read.
    pub(super) technology_files: TechnologyFiles,
}

impl Resolved {
    /// Merges a scenario's text with defaults, the presets it names, and assignments. Fails on no TOML, an unknown or missing key, a
    /// wrong type, an unknown preset; with file, line, key and value.
    pub fn from_layers(file: &str, text: &str, assignments: &[String]) -> Result<Self, Error> {
        let refused = |_: &str| Err(Error::Run("no file can be read here; use the name of a preset".to_owned()));
        Self::from_layers_and_files(file, text, assignments, &refused)
    }

    /// The same where a preset may be a file beside the scenario, as in sensor.preset = "./mine.toml".
    pub fn from_layers_and_files(
        file: &str,
        text: &str,
        assignments: &[String],
        read: &dyn Fn(&str) -> Result<Vec<u8>, Error>,
    ) -> Result<Self, Error> {
        let mut chosen = Tree::parse("defaults", presets::DEFAULTS)?;
        let mut user = Tree::parse(file, text)?;
        user.merge_exclusive(assigned(assignments)?, EXCLUSIVE);
        let mut preview = chosen.clone();
        preview.merge_exclusive(user.clone(), EXCLUSIVE);
        for (key, kind) in [("sensor.preset", PresetKind::Sensor), ("optics.preset", PresetKind::Lens)] {
            let Some(value) = preview.get(key) else { continue };
            let Some(named) = value.as_str() else {
                return Err(preview.locate(Error::key(key, value, "is no text; use the name of a preset in quotes")));
            };
            if kind == PresetKind::Sensor && sensor_file::is_file(named) {
                let [base, own] =
                    sensor_file::layers(named, read).map_err(|error| preview.locate(error.named_by(key, named)))?;
                chosen.merge_exclusive(base, EXCLUSIVE);
                chosen.merge_exclusive(own, EXCLUSIVE);
                continue;
            }
            let name = if named == presets::NO_PRESET { kind.base() } else { named };
            let preset =
                presets::find(kind, name).map_err(|error| preview.locate(Error::key(key, "", error.to_string())))?;
            chosen.merge_exclusive(Tree::parse(&format!("preset {name}"), preset.text)?, EXCLUSIVE);
        }
        let below = chosen.clone();
        chosen.merge_exclusive(user, EXCLUSIVE);
        let scenario = typed(&chosen)?;
        Ok(Self { scenario, tree: chosen, below, technology_files: TechnologyFiles::new() })
    }

    /// The same with further assignments over all layers. They may not name another preset.
    pub fn with(&self, assignments: &[String]) -> Result<Self, Error> {
        let mut tree = self.tree.clone();
        tree.merge_exclusive(assigned(assignments)?, EXCLUSIVE);
        let technology_files = self.technology_files.clone();
        Ok(Self { scenario: typed(&tree)?, tree, below: self.below.clone(), technology_files })
    }

    /// Whether the user gave a key another value than defaults and presets do.
    pub fn is_changed(&self, key: &str) -> bool {
        self.tree.get(key) != self.below.get(key)
    }

    /// Refuses a key that is off and that the user changed, with what would make it act.
    pub(super) fn check_idle(&self, is_off: bool, key: &str, would_do: &str) -> Result<(), Error> {
        if is_off && self.is_changed(key) {
            return Err(Error::key(key, "", format!("has no effect here; use {would_do}, or leave it out")));
        }
        Ok(())
    }

    /// The effective configuration as TOML, keys sorted. It gives the same run again.
    pub fn canonical_text(&self) -> String {
        let value = toml::Value::try_from(&self.scenario).expect("every field has a TOML form");
        toml::to_string(&value).expect("a table has a TOML form")
    }

    /// The effective configuration as results record it. Threads decide no byte, so that the record says 0 (all cores) whatever they were.
    pub fn recorded(&self) -> toml::Table {
        let mut scenario = self.scenario.clone();
        scenario.run.threads = 0;
        // All values of a file stand in the record, which is read where the file is not.
        if sensor_file::is_file(&scenario.sensor.preset) {
            scenario.sensor.preset = presets::NO_PRESET.to_owned();
        }
        toml::Table::try_from(&scenario).expect("every field has a TOML form")
    }

    /// The same as TOML text.
    pub fn recorded_text(&self) -> String {
        toml::to_string(&self.recorded()).expect("a table has a TOML form")
    }

    /// Hash of everything that decides the result's bytes: threads do not.
    pub fn hash(&self) -> String {
        blake3::hash(self.recorded_text().as_bytes()).to_hex().to_string()
    }
}

fn assigned(assignments: &[String]) -> Result<Tree, Error> {
    let mut assigned = Tree::default();
    for assignment in assignments {
        assigned.merge(Tree::from_assignment(assignment)?);
    }
    Ok(assigned)
}

fn typed(tree: &Tree) -> Result<Scenario, Error> {
    let value = toml::Value::Table(tree.values().clone());
    let mut track = serde_path_to_error::Track::new();
    let reader = serde_path_to_error::Deserializer::new(value, &mut track);
    // Behind a trait object, so that the reader's code is compiled once and not once for each section: the browser loads it.
    let mut reader = <dyn erased_serde::Deserializer>::erase(reader);
    let scenario: Result<Scenario, _> = erased_serde::deserialize(&mut reader);
    drop(reader);
    let mut scenario = scenario.map_err(|error| {
        // The reader's own lines say where; the path does so already.
        let text = error.to_string();
        let message = text.split("\nin `").next().unwrap_or_default().trim_end();
        suggest::explain(tree, &track.path().to_string(), message)
    })?;
    scenario.state_render_keys();
    Ok(scenario)
}

/// Texts of technology files by name.
pub(super) type TechnologyFiles = BTreeMap<String, String>;
