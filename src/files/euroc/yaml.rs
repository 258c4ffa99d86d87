//! Reads a `sensor.yaml` into its values by dotted key, each with its line: scalars and lists of scalars in nested mappings. Refuses
//! what else YAML has, naming the line.

use std::collections::BTreeMap;

use saphyr_parser::{Event, Parser};

/// Files nest two deep; a limit keeps hostile ones from filling the memory with keys.
const DEPTH_MAX: usize = 8;

/// A value as written, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Entry {
    pub(super) text: String,
    /// Items of a list.
    items: Option<Vec<String>>,
    /// Counted from 1.
    pub(super) line: usize,
}

impl Entry {
    fn list(&self) -> Option<Vec<f64>> {
        self.items.as_ref()?.iter().map(|item| finite(item)).collect()
    }
}

/// Values by dotted key.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Document {
    entries: BTreeMap<String, Entry>,
}

/// What is wrong in which line.
pub(super) type Refusal = (usize, String);

/// A mapping or list whose end has not come yet.
enum Open {
    /// Its own key, empty at the top, and the key whose value comes next.
    Mapping {
        parent: String,
        key: Option<String>,
    },
    List {
        path: String,
        line: usize,
        items: Vec<String>,
    },
}

impl Document {
    pub(super) fn parse(text: &str) -> Result<Self, Refusal> {
        let text = without_opencv_header(text);
        let mut document = Self::default();
        let mut open: Vec<Open> = Vec::new();
        for event in Parser::new_from_str(&text) {
            let (event, span) =
                event.map_err(|error| (error.marker().line(), format!("is no YAML: {}", error.info())))?;
            let line = span.start.line();
            match event {
                Event::MappingStart(..) | Event::SequenceStart(..) => {
                    let path = path_of_value(&mut open, line)?;
                    if open.len() == DEPTH_MAX {
                        return Err((line, format!("is more than {DEPTH_MAX} levels deep")));
                    }
                    open.push(match event {
                        Event::MappingStart(..) => Open::Mapping { parent: path, key: None },
                        _ => Open::List { path, line, items: Vec::new() },
                    });
                }
                Event::Scalar(text, ..) => match open.last_mut() {
                    Some(Open::List { items, .. }) => items.push(text.into_owned()),
                    Some(Open::Mapping { key: key @ None, .. }) => *key = Some(text.into_owned()),
                    _ => {
                        let path = path_of_value(&mut open, line)?;
                        document.insert(path, Entry { text: text.into_owned(), items: None, line })?;
                    }
                },
                Event::MappingEnd | Event::SequenceEnd => {
                    if let Some(Open::List { path, line, items }) = open.pop() {
                        let text = format!("[{}]", items.join(", "));
                        document.insert(path, Entry { text, items: Some(items), line })?;
                    }
                }
                Event::Alias(_) => return Err((line, "has an alias; write the value".to_owned())),
                Event::DocumentEnd => break,
                Event::Nothing | Event::StreamStart | Event::StreamEnd | Event::DocumentStart(_) => {}
            }
        }
        Ok(document)
    }

    fn insert(&mut self, path: String, entry: Entry) -> Result<(), Refusal> {
        let (line, key) = (entry.line, shortened(&path));
        match self.entries.insert(path, entry) {
            Some(_) => Err((line, format!("'{key}' is there twice"))),
            None => Ok(()),
        }
    }

    pub(super) fn get(&self, key: &str) -> Result<&Entry, Refusal> {
        self.entries.get(key).ok_or_else(|| (0, format!("has no '{key}'")))
    }

    pub(super) fn number(&self, key: &str) -> Result<f64, Refusal> {
        let entry = self.get(key)?;
        finite(&entry.text).ok_or_else(|| (entry.line, format!("{key} = '{}' is no number", shortened(&entry.text))))
    }

    /// A list of exactly N finite numbers.
    pub(super) fn numbers<const N: usize>(&self, key: &str) -> Result<[f64; N], Refusal> {
        let entry = self.get(key)?;
        let wrong = || (entry.line, format!("{key} = '{}' is no list of {N} numbers", shortened(&entry.text)));
        entry.list().ok_or_else(wrong)?.try_into().map_err(|_| wrong())
    }

    /// A list of any number of finite numbers.
    pub(super) fn list(&self, key: &str) -> Result<Vec<f64>, Refusal> {
        let entry = self.get(key)?;
        let wrong = || (entry.line, format!("{key} = '{}' is no list of numbers", shortened(&entry.text)));
        entry.list().ok_or_else(wrong)
    }
}

/// The dotted key of the value that begins here; its mapping waits for the next key.
fn path_of_value(open: &mut [Open], line: usize) -> Result<String, Refusal> {
    match open.last_mut() {
        None => Ok(String::new()),
        Some(Open::Mapping { parent, key }) => {
            let key = key.take().ok_or_else(|| (line, "has a key that is no text".to_owned()))?;
            Ok(if parent.is_empty() { key } else { format!("{parent}.{key}") })
        }
        Some(Open::List { path, .. }) => Err((line, format!("'{}' is a list of more than numbers", shortened(path)))),
    }
}

/// OpenCV begins files with `%YAML:1.0`, which is no directive of YAML: the line is left empty.
fn without_opencv_header(text: &str) -> std::borrow::Cow<'_, str> {
    match text.strip_prefix("%YAML:") {
        Some(rest) => rest.trim_start_matches(|letter| letter != '\n').into(),
        None => text.into(),
    }
}

fn finite(text: &str) -> Option<f64> {
    text.parse::<f64>().ok().filter(|value| value.is_finite())
}

/// The first forty letters: messages stay one line long whatever a file holds.
pub(super) fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}
