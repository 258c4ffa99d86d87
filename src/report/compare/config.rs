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

/// Keys with other values, sorted by path.
pub fn differences(a: &toml::Table, b: &toml::Table) -> Vec<KeyDifference> {
    let (a, b) = (leaves(a), leaves(b));
    let of = |list: &[(String, String)], key: &str| {
        list.binary_search_by(|(known, _)| known.as_str().cmp(key)).ok().map(|place| list[place].1.clone())
    };
    let mut keys: Vec<&String> = a.iter().chain(&b).map(|(key, _)| key).collect();
    keys.sort();
    keys.dedup();
    let both = keys.into_iter().map(|key| KeyDifference { key: key.clone(), a: of(&a, key), b: of(&b, key) });
    both.filter(|difference| difference.a != difference.b).collect()
}

/// Refuses runs of different scenes or motions: their difference says nothing of the designs.
pub fn check_same_scene(a: &FinishedRun, b: &FinishedRun) -> Result<(), Error> {
    let is_same =
        |key: &str, same: &str| key == same || key.strip_prefix(same).is_some_and(|rest| rest.starts_with('.'));
    let differing = differences(&a.report.config, &b.report.config)
        .into_iter()
        .find(|difference| SAME.iter().any(|same| is_same(&difference.key, same)));
    let Some(KeyDifference { key, a: of_a, b: of_b }) = differing else { return Ok(()) };
    let shown = |value: Option<String>| value.unwrap_or_else(|| "not set".to_owned());
    let what = if key.starts_with("scene") { "scene" } else { "motion" };
    Err(Error::Content {
        file: b.folder.clone(),
        reason: format!(
            "is a run of another {what} than {}: {key} is {} there and {} here; compare runs of one {what}",
            a.folder,
            shown(of_a),
            shown(of_b)
        ),
    })
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
