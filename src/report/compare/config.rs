//! What differs between two effective configurations, and whether the runs saw the same scene.

use serde::{Deserialize, Serialize};

use super::finished::FinishedRun;
use crate::error::Error;

/// Keys that say where and along which way a run looked. Light and lenses may differ: they are designs to compare.
const SAME: [&str; 5] = ["scene.file", "scene.generator", "scene.target", "scene.images", "motion"];

/// A key with two values.
#[derive(Clone, Debug, Default, PartialEq, Eq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct KeyDifference {
    /// Dotted path.
    pub key: String,
    /// Value of the base, as TOML; none where the base has no such key.
    pub a: Option<String>,
    /// Value of the other run.
    pub b: Option<String>,
}

impl std::fmt::Display for KeyDifference {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let [a, b] = [&self.a, &self.b].map(|value| value.as_deref().unwrap_or("not set"));
        write!(f, "{} is {a} there and {b} here", self.key)
    }
}

/// Keys with other values, sorted by path.
pub fn differences(a: &toml::Table, b: &toml::Table) -> Vec<KeyDifference> {
    let (a, b) = (leaves(a), leaves(b));
    let of = |list: &[(String, String)], key: &str| {
        list.binary_search_by(|(known, _)| known.as_str().cmp(key)).ok().map(|at| list[at].1.clone())
    };
    let mut keys: Vec<&String> = a.iter().chain(&b).map(|(key, _)| key).collect();
    keys.sort();
    keys.dedup();
    let both = keys.into_iter().map(|key| KeyDifference { key: key.clone(), a: of(&a, key), b: of(&b, key) });
    both.filter(|difference| difference.a != difference.b).collect()
}

/// Refuses runs of different scenes or motions: their difference says nothing of the designs.
pub fn check_same_scene(a: &FinishedRun, b: &FinishedRun) -> Result<(), Error> {
    let differing =
        differences(&a.report.config, &b.report.config).into_iter().find(|difference| is_among(&difference.key, &SAME));
    let Some(differing) = differing else { return Ok(()) };
    let what = if differing.key.starts_with("scene") { "scene" } else { "motion" };
    let is = format!("is a run of another {what} than {}", a.folder);
    Err(Error::Content { file: b.folder.clone(), reason: format!("{is}: {differing}; compare runs of one {what}") })
}

/// Whether a key is one of these, or lies in a section of this name.
pub fn is_among(key: &str, names: &[&str]) -> bool {
    names.iter().any(|name| key.strip_prefix(name).is_some_and(|rest| rest.is_empty() || rest.starts_with('.')))
}

/// Every value with its dotted path, sorted. Arrays count as values.
fn leaves(table: &toml::Table) -> Vec<(String, String)> {
    let mut found = Vec::new();
    gather("", table, &mut found);
    found.sort();
    found
}

fn gather(prefix: &str, table: &toml::Table, found: &mut Vec<(String, String)>) {
    for (key, value) in table {
        let path = if prefix.is_empty() { key.clone() } else { format!("{prefix}.{key}") };
        match value {
            toml::Value::Table(inner) => gather(&path, inner, found),
            other => found.push((path, other.to_string())),
        }
    }
}
