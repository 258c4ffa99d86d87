//! Layers of configuration as trees that remember, for every value, the file and line it came from.

use std::collections::BTreeMap;

use toml::de::{DeTable, DeValue};
use toml::{Table, Value};

use crate::error::Error;
use crate::text::without_mark;

/// Where a value was written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Origin {
    /// File name, preset name, or `--set`.
    pub layer: String,
    /// Counted from 1; 0 where the layer has no lines.
    pub line: usize,
}

/// A tree of values; a later layer's value replaces an earlier one's, table by table.
#[derive(Clone, Debug, Default)]
pub struct Tree {
    values: Table,
    origins: BTreeMap<String, Origin>,
}

impl Tree {
    /// Parses one TOML layer. Gives `Error::Content` with line and column where the text is no TOML.
    pub fn parse(layer: &str, text: &str) -> Result<Self, Error> {
        let text = without_mark(text);
        let refused = |error: &toml::de::Error| {
            let line = error.span().map_or(0, |span| line_of(text, span.start));
            let reason = format!("line {line}: {}", error.message());
            Error::Content { file: layer.to_owned(), reason }
        };
        let values: Table = toml::from_str(text).map_err(|error| refused(&error))?;
        let spans = DeTable::parse(text).map_err(|error| refused(&error))?;
        let mut origins = Origins { layer, lines: Lines::of(text), found: BTreeMap::new() };
        origins.record(spans.get_ref(), "");
        Ok(Self { values, origins: origins.found })
    }

    /// One `--set a.b=value`; the value is TOML, or else taken as a string. Fails without an equals sign, with an empty part in the path,
    /// and on several lines that are not one value.
    pub fn from_assignment(assignment: &str) -> Result<Self, Error> {
        let refused = |reason: &str| Error::Config {
            file: "--set".to_owned(),
            line: 0,
            key: assignment.to_owned(),
            value: String::new(),
            reason: reason.to_owned(),
        };
        let (path, text) = assignment.split_once('=').ok_or_else(|| refused("expected key=value"))?;
        let path = path.trim();
        if path.split('.').any(str::is_empty) {
            return Err(refused("expected a dotted path of keys before the equals sign"));
        }
        let text = text.trim();
        let one_key = || refused("expected one value of one key; use --set once for each key");
        let value = match toml::from_str::<Table>(&format!("value = {text}")) {
            Ok(mut parsed) if parsed.len() == 1 => parsed.remove("value").ok_or_else(one_key)?,
            Err(_) if !text.contains(['\n', '\r']) => Value::String(text.to_owned()),
            _ => return Err(one_key()),
        };
        let mut tree = Self::default();
        tree.put(path, value, Origin { layer: "--set".to_owned(), line: 0 });
        Ok(tree)
    }

    /// Sets one value by its dotted path.
    fn put(&mut self, path: &str, value: Value, origin: Origin) {
        let mut nested = value;
        for key in path.split('.').rev() {
            nested = Value::Table(Table::from_iter([(key.to_owned(), nested)]));
        }
        let Value::Table(values) = nested else { unreachable!("a path has at least one key") };
        self.merge(Self { values, origins: BTreeMap::from([(path.to_owned(), origin)]) });
    }

    /// Lays another layer over this one.
    pub fn merge(&mut self, above: Self) {
        // A value that replaces a table removes the origins of what stood in it; a table that is laid over a table does not.
        let replaced = |path: &&String| above.get(path).is_some_and(|value| !value.is_table());
        let replaced: Vec<String> = above.origins.keys().filter(replaced).cloned().collect();
        merge_tables(&mut self.values, above.values);
        for path in &replaced {
            forget_inside(&mut self.origins, path);
        }
        self.origins.extend(above.origins);
    }

    /// Lays another layer over this one, where keys of a group stand for each other: one that the layer above writes takes the others'
    /// place, so that a scenario can say in other words what its preset says.
    pub fn merge_exclusive(&mut self, above: Self, groups: &[&[&str]]) {
        for group in groups {
            if group.iter().any(|key| above.get(key).is_some()) {
                for key in group.iter().filter(|key| above.get(key).is_none()) {
                    self.remove(key);
                }
            }
        }
        self.merge(above);
    }

    /// Takes away a value, if it is there.
    fn remove(&mut self, path: &str) {
        let mut keys: Vec<&str> = path.split('.').collect();
        let last = keys.pop().expect("a path has at least one key");
        let mut table = &mut self.values;
        for key in keys {
            let Some(Value::Table(inner)) = table.get_mut(key) else { return };
            table = inner;
        }
        table.remove(last);
        self.origins.remove(path);
        forget_inside(&mut self.origins, path);
    }

    /// The value at a dotted path.
    pub fn get(&self, path: &str) -> Option<&Value> {
        let (head, rest) = path.split_once('.').map_or((path, None), |(head, rest)| (head, Some(rest)));
        let mut value = self.values.get(head)?;
        for key in rest.into_iter().flat_map(|rest| rest.split('.')) {
            value = value.get(key)?;
        }
        Some(value)
    }

    /// Where the value at a path, or the nearest thing around it, was written.
    pub fn origin(&self, path: &str) -> Option<&Origin> {
        let mut path = path;
        loop {
            if let Some(origin) = self.origins.get(path) {
                return Some(origin);
            }
            path = path.rsplit_once('.')?.0;
        }
    }

    /// Where the first value inside a table was written, for tables that no layer wrote as such.
    fn origin_inside(&self, path: &str) -> Option<&Origin> {
        let inside = format!("{path}.");
        self.origins.iter().find(|(key, _)| key.starts_with(&inside)).map(|(_, origin)| origin)
    }

    /// All values.
    pub fn values(&self) -> &Table {
        &self.values
    }

    /// Adds file, line and value to an error that a stage raised about a key.
    pub fn locate(&self, error: Error) -> Error {
        let Error::Config { file, line, key, value, reason } = error else { return error };
        if !file.is_empty() {
            return Error::Config { file, line, key, value, reason };
        }
        let origin = self
            .origin(&key)
            .or_else(|| self.origin_inside(&key))
            .cloned()
            .unwrap_or(Origin { layer: "scenario".to_owned(), line: 0 });
        let value = if value.is_empty() { self.get(&key).map(ToString::to_string).unwrap_or_default() } else { value };
        Error::Config { file: origin.layer, line: origin.line, key, value, reason }
    }
}

fn merge_tables(below: &mut Table, above: Table) {
    for (key, value) in above {
        match (below.get_mut(&key), value) {
            (Some(Value::Table(below)), Value::Table(above)) => merge_tables(below, above),
            (_, value) => {
                below.insert(key, value);
            }
        }
    }
}

/// Removes the origins of the keys in a table.
fn forget_inside(origins: &mut BTreeMap<String, Origin>, path: &str) {
    let inside = format!("{path}.");
    let old: Vec<String> = origins
        .range(inside.clone()..)
        .map(|(old, _)| old)
        .take_while(|old| old.starts_with(&inside))
        .cloned()
        .collect();
    for old in old {
        origins.remove(&old);
    }
}

/// Where the lines of a text begin.
struct Lines(Vec<usize>);

impl Lines {
    fn of(text: &str) -> Self {
        Self(text.bytes().enumerate().filter(|(_, byte)| *byte == b'\n').map(|(offset, _)| offset + 1).collect())
    }

    /// The line of a byte, counted from 1.
    fn at(&self, offset: usize) -> usize {
        1 + self.0.partition_point(|&start| start <= offset)
    }
}

/// The origins of a layer's values while they are found.
struct Origins<'a> {
    layer: &'a str,
    lines: Lines,
    found: BTreeMap<String, Origin>,
}

impl Origins<'_> {
    fn record(&mut self, table: &DeTable<'_>, prefix: &str) {
        for (key, value) in table {
            let path =
                if prefix.is_empty() { key.get_ref().to_string() } else { format!("{prefix}.{}", key.get_ref()) };
            let origin = Origin { layer: self.layer.to_owned(), line: self.lines.at(key.span().start) };
            self.found.insert(path.clone(), origin);
            match value.get_ref() {
                DeValue::Table(inner) => self.record(inner, &path),
                DeValue::Array(items) => {
                    for (index, item) in items.iter().enumerate() {
                        if let DeValue::Table(inner) = item.get_ref() {
                            self.record(inner, &format!("{path}.{index}"));
                        }
                    }
                }
                _ => {}
            }
        }
    }
}

fn line_of(text: &str, offset: usize) -> usize {
    Lines::of(text).at(offset)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn later_layers_win_and_every_value_knows_its_line() {
        let mut tree = Tree::parse("low.toml", "seed = 1\n[sensor.adc]\nbits = 10\nclock_hz = 5\n").unwrap();
        tree.merge(Tree::parse("high.toml", "[sensor.adc]\nbits = 12\n").unwrap());
        tree.merge(Tree::from_assignment("sensor.adc.clock_hz = 7").unwrap());
        assert_eq!(tree.get("sensor.adc.bits"), Some(&Value::Integer(12)));
        assert_eq!(tree.get("sensor.adc.clock_hz"), Some(&Value::Integer(7)));
        assert_eq!(tree.origin("seed").unwrap(), &Origin { layer: "low.toml".into(), line: 1 });
        assert_eq!(tree.origin("sensor.adc.bits").unwrap(), &Origin { layer: "high.toml".into(), line: 2 });
        assert_eq!(tree.origin("sensor.adc.clock_hz").unwrap().layer, "--set");
    }

    #[test]
    fn a_key_takes_the_place_of_what_it_stands_for() {
        let groups: &[&[&str]] = &[&["sensor.qe", "sensor.qe_by_filter"]];
        let mut tree = Tree::parse("low.toml", "[sensor]\nqe = 0.5\nbits = 1\n").unwrap();
        tree.merge_exclusive(Tree::parse("high.toml", "[sensor.qe_by_filter]\nR = [0.1]\n").unwrap(), groups);
        assert!(tree.get("sensor.qe").is_none() && tree.get("sensor.bits").is_some());
        tree.merge_exclusive(Tree::from_assignment("sensor.qe=0.4").unwrap(), groups);
        assert!(tree.get("sensor.qe_by_filter").is_none());
        assert_eq!(tree.origin("sensor.qe").unwrap().layer, "--set");
    }

    #[test]
    fn an_assignment_that_is_no_toml_is_a_string() {
        let tree = Tree::from_assignment("scene.file=bathroom.glb").unwrap();
        assert_eq!(tree.get("scene.file").unwrap().as_str(), Some("bathroom.glb"));
        assert!(Tree::from_assignment("scene.file").is_err());
        assert!(Tree::from_assignment("scene..file=1").is_err());
        for several in ["run.frames=7\nseed=1", "run.frames=7\nvalue=1", "scene.file=a.glb\nseed=1", "a=1\r\nb=2"] {
            let error = Tree::from_assignment(several).unwrap_err().to_string();
            assert!(error.contains("use --set once for each key"), "{error}");
        }
        let list = Tree::from_assignment("a.b=[1,\n 2]").unwrap();
        assert_eq!(list.get("a.b").unwrap().as_array().unwrap().len(), 2);
    }

    #[test]
    fn lines_are_those_of_a_count_of_line_ends() {
        let text = "a = 1\n\n[b]\nc = 2\r\n\u{e4} = 3\nno end";
        let lines = Lines::of(text);
        for offset in 0..text.len() + 2 {
            let counted = 1 + text.bytes().take(offset).filter(|&byte| byte == b'\n').count();
            assert_eq!(lines.at(offset), counted, "{offset}");
        }
    }

    #[test]
    fn a_value_in_a_table_s_place_takes_all_origins_within_it_and_no_others() {
        let mut tree = Tree::parse("low.toml", "[a]\nb = 1\n[a.c]\nd = 2\n[ab]\ne = 3\n").unwrap();
        tree.merge(Tree::parse("high.toml", "\n\na = 4\n").unwrap());
        let layers = ["a.b", "a.c.d", "a", "ab.e"].map(|path| tree.origin(path).unwrap().layer.clone());
        assert_eq!(layers, ["high.toml", "high.toml", "high.toml", "low.toml"]);
    }

    #[test]
    fn text_that_is_no_toml_names_its_line() {
        let error = Tree::parse("a.toml", "seed = 1\nbits = = 3\n").unwrap_err();
        assert!(error.to_string().contains("a.toml: line 2"), "{error}");
    }
}
