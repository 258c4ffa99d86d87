//! The cells of a sweep: every point with every replicate, resolved and named.

use std::collections::BTreeMap;

use toml::Value;

use super::design::{Point, assignments, factor_names, points};
use super::file::SweepFile;
use crate::config::Resolved;
use crate::error::Error;
use crate::parallel::collected;

/// Merges a scenario with defaults, presets and these assignments.
pub type Layered = Box<dyn Fn(&[String]) -> Result<Resolved, Error> + Send + Sync>;

/// A scenario before any cell changes it.
pub struct Base {
    /// Merges it with what a sweep lays over it.
    pub layered: Layered,
    /// What the command line lays over it and over every cell.
    pub assignments: Vec<String>,
}

/// A sweep, ready to run.
pub struct Cells {
    base: Base,
    /// The base with what all cells share.
    shared: Resolved,
    /// Columns that tell points apart.
    pub factors: Vec<String>,
    /// Every cell, in the order of the file; replicates of a point stand together.
    pub cells: Vec<Cell>,
}

/// One run of a sweep.
#[derive(Clone, Debug)]
pub struct Cell {
    /// Hash of its resolved configuration, its assets and the version.
    pub name: String,
    /// Number of its point.
    pub point: usize,
    /// What each factor is.
    pub shown: Vec<Value>,
    /// Name of its trajectory, where there are several.
    pub trajectory: Option<String>,
    /// Seed of its sensors' noise, where there are several.
    pub seed: Option<u64>,
    /// Its die, where there are several.
    pub die: Option<u64>,
    /// Keys that it sets.
    pub set: Vec<(String, Value)>,
    /// Hash of the keys that can reach its photons: cells of one group share them.
    pub group: String,
}

impl Cells {
    /// Lays out a sweep. `assets_hash` is asked for the hash of the files that a configuration names. Fails on too many cells; a key or
    /// value that the scenario refuses, named with the sweep file's line.
    pub fn new(
        (file, text): (&str, &str),
        sweep: &SweepFile,
        base: Base,
        assets_hash: &(dyn Fn(&Resolved) -> Result<String, Error> + Sync),
    ) -> Result<Self, Error> {
        let mut all = assignments(&sweep.set);
        let located = |error: Error| in_sweep(error, file, text);
        let layers: Vec<String> = all.drain(..).map(assignment).chain(base.assignments.iter().cloned()).collect();
        let shared = (base.layered)(&layers).map_err(located)?;
        let points = points(sweep)?;
        let mut this = Self {
            base: Base { assignments: layers, ..base },
            shared,
            factors: factor_names(sweep),
            cells: Vec::new(),
        };
        let unnamed = unnamed(sweep, &points);
        let named = |cell: &Cell| {
            let resolved = this.resolve(cell).map_err(located)?;
            let name = name_of(&resolved, &assets_hash(&resolved)?, sweep.cameras_alone);
            Ok(Cell { name, group: group_of(&resolved)?, ..cell.clone() })
        };
        let cells = collected(unnamed.len(), |number| named(&unnamed[number]));
        this.cells = cells.into_iter().collect::<Result<_, Error>>()?;
        this.refuse_twins()?;
        Ok(this)
    }

    /// A cell's configuration. Fails on a key or value that the scenario refuses.
    pub fn resolve(&self, cell: &Cell) -> Result<Resolved, Error> {
        let own: Vec<String> = cell.set.iter().cloned().map(assignment).collect();
        if cell.set.iter().any(|(key, _)| key.ends_with(".preset")) {
            let layers = [self.base.assignments.clone(), own].concat();
            return (self.base.layered)(&layers);
        }
        self.shared.with(&own)
    }

    /// What all cells share.
    pub fn shared(&self) -> &Resolved {
        &self.shared
    }

    /// Two cells of one name would be one run counted twice.
    fn refuse_twins(&self) -> Result<(), Error> {
        let mut known: BTreeMap<&str, &Cell> = BTreeMap::new();
        for cell in &self.cells {
            if let Some(other) = known.insert(&cell.name, cell) {
                let reason = format!(
                    "cells {} and {} have the same configuration; a factor changes nothing, or a value stands there twice",
                    other.described(&self.factors),
                    cell.described(&self.factors)
                );
                return Err(Error::key("factor", "", reason));
            }
        }
        Ok(())
    }

    /// Number of groups that share their photons.
    pub fn groups(&self) -> usize {
        self.cells.iter().map(|cell| cell.group.as_str()).collect::<std::collections::BTreeSet<_>>().len()
    }
}

impl Cell {
    /// What each factor is, in words.
    pub fn levels(&self, factors: &[String]) -> Vec<String> {
        factors.iter().zip(&self.shown).map(|(name, value)| format!("{name} = {}", shown(value))).collect()
    }

    /// Its factors and replicates in words.
    pub fn described(&self, factors: &[String]) -> String {
        let mut parts = self.levels(factors);
        parts.extend(self.trajectory.iter().map(|name| format!("trajectory = {name}")));
        parts.extend(self.seed.iter().map(|seed| format!("seed = {seed}")));
        parts.extend(self.die.iter().map(|die| format!("die = {die}")));
        parts.join(", ")
    }
}

/// A value without the quotes of a string.
pub fn shown(value: &Value) -> String {
    value.as_str().map_or_else(|| value.to_string(), str::to_owned)
}

fn assignment((key, value): (String, Value)) -> String {
    format!("{key}={value}")
}

/// All points with all replicates, without names.
fn unnamed(sweep: &SweepFile, points: &[Point]) -> Vec<Cell> {
    let numbers = |numbers: &Option<super::file::Numbers>| {
        numbers
            .as_ref()
            .map_or_else(|| vec![None], |some| some.list().into_iter().map(Some).collect::<Vec<Option<u64>>>())
    };
    let (seeds, dies) = (numbers(&sweep.seeds), numbers(&sweep.dies));
    let trajectories: Vec<Option<&super::file::NamedLevel>> =
        if sweep.trajectory.is_empty() { vec![None] } else { sweep.trajectory.iter().map(Some).collect() };
    let mut cells = Vec::new();
    for (number, point) in points.iter().enumerate() {
        for &trajectory in &trajectories {
            for &die in &dies {
                for &seed in &seeds {
                    let mut set: Vec<(String, Value)> = point.iter().flat_map(|setting| setting.set.clone()).collect();
                    set.extend(trajectory.iter().flat_map(|level| assignments(&level.set)));
                    let whole = |number: u64| Value::Integer(i64::try_from(number).unwrap_or(i64::MAX));
                    set.extend(die.map(|die| ("sensor.die".to_owned(), whole(die))));
                    set.extend(seed.map(|seed| ("seed".to_owned(), whole(seed))));
                    cells.push(Cell {
                        name: String::new(),
                        point: number,
                        shown: point.iter().map(|setting| setting.shown.clone()).collect(),
                        trajectory: trajectory.map(|level| level.name.clone()),
                        seed,
                        die,
                        set,
                        group: String::new(),
                    });
                }
            }
        }
    }
    cells
}

fn name_of(resolved: &Resolved, assets: &str, cameras_alone: bool) -> String {
    let mut hasher = blake3::Hasher::new();
    for part in ["sensel cell 1", SOURCES, &resolved.hash(), assets] {
        hasher.update(part.as_bytes());
        hasher.update(&[0]);
    }
    if cameras_alone {
        hasher.update(b"cameras_alone");
    }
    hasher.finalize().to_hex()[..32].to_owned()
}

/// The keys from scene to exposure. The photon store's own key decides what is shared; this one only orders the work.
fn group_of(resolved: &Resolved) -> Result<String, Error> {
    let scenario = &resolved.scenario;
    let fidelity = scenario.fidelity().map_err(|error| resolved.tree.locate(error))?;
    let (rig, sensor) = (&scenario.rig, &scenario.sensor);
    let pixel = &sensor.pixel;
    let parts = (
        (&scenario.scene, &scenario.motion, &scenario.optics, &sensor.readout),
        (&rig.baseline_mm, &rig.camera, &rig.body_from_rig, sensor.width, sensor.height),
        (
            pixel.pitch_um,
            &pixel.cfa,
            &pixel.qe_by_filter,
            pixel.optical_crosstalk,
            pixel.electrical_crosstalk,
            pixel.electrical_crosstalk_nir,
        ),
    );
    let text = format!("{parts:?} {:?}", fidelity.render);
    Ok(blake3::hash(text.as_bytes()).to_hex()[..32].to_owned())
}

/// An error about a key that the sweep file sets, with the file's line.
fn in_sweep(error: Error, file: &str, text: &str) -> Error {
    let Error::Config { file: layer, line, key, value, reason } = error else { return error };
    if layer != "--set" && !layer.is_empty() {
        return Error::Config { file: layer, line, key, value, reason };
    }
    let line = text.lines().position(|line| line.contains(&key)).map_or(0, |line| line + 1);
    Error::Config { file: file.to_owned(), line, key, value, reason }
}

/// Fingerprint of the code that decides a figure.
pub const SOURCES: &str = env!("SENSEL_FIGURE_SOURCES");
