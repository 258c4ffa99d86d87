//! Parses the subset of YAML that `sensor.yaml` files use: nested keys, scalars, lists in brackets over any number of lines, comments.
//! Maps dotted keys to values with their lines; refuses anything else, naming the line.

use std::collections::BTreeMap;

/// A value as written, and where.
#[derive(Clone, Debug, PartialEq, Eq)]
pub(super) struct Entry {
    pub(super) text: String,
    /// Counted from 1.
    pub(super) line: usize,
}

impl Entry {
    fn list(&self) -> Option<Vec<f64>> {
        let inner = self.text.strip_prefix('[').and_then(|text| text.strip_suffix(']'))?;
        inner.split(',').map(str::trim).filter(|item| !item.is_empty()).map(finite).collect()
    }
}

/// Values by dotted key.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub(super) struct Document {
    entries: BTreeMap<String, Entry>,
}

/// What is wrong in which line.
pub(super) type Refusal = (usize, String);

impl Document {
    pub(super) fn parse(text: &str) -> Result<Self, Refusal> {
        let mut document = Self::default();
        let mut parents: Vec<(usize, String)> = Vec::new();
        let mut lines = text.lines().enumerate();
        while let Some((index, raw)) = lines.next() {
            let line = index + 1;
            let content = without_comment(raw);
            let trimmed = content.trim();
            if trimmed.is_empty() || trimmed == "---" || trimmed == "..." || trimmed.starts_with('%') {
                continue;
            }
            let indent = content.len() - content.trim_start().len();
            let (key, value) = trimmed
                .split_once(':')
                .ok_or_else(|| (line, format!("'{}' is no 'key: value'", shortened(trimmed))))?;
            let (key, mut value) = (unquoted(key.trim()), value.trim().to_owned());
            while parents.last().is_some_and(|(depth, _)| *depth >= indent) {
                parents.pop();
            }
            while value.starts_with('[') && !value.contains(']') {
                // A line with a key in it belongs to what follows: the bracket was never closed.
                let more = lines.next().map(|(_, more)| without_comment(more)).filter(|more| !more.contains(':'));
                let more = more.ok_or_else(|| (line, format!("the list of '{key}' has no end")))?;
                value.push(' ');
                value.push_str(more.trim());
            }
            let path = parents.last().map_or_else(|| key.to_owned(), |(_, parent)| format!("{parent}.{key}"));
            if value.is_empty() || value.starts_with("!!") {
                parents.push((indent, path));
            } else if document.entries.insert(path, Entry { text: unquoted(&value).to_owned(), line }).is_some() {
                return Err((line, format!("'{key}' is there twice")));
            }
        }
        Ok(document)
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

fn finite(text: &str) -> Option<f64> {
    text.parse::<f64>().ok().filter(|value| value.is_finite())
}

/// A `#` starts a comment at a line's start or after a blank, outside quotes.
fn without_comment(line: &str) -> &str {
    let mut quote = None;
    let mut before = ' ';
    for (at, letter) in line.char_indices() {
        match (quote, letter) {
            (None, '#') if before.is_whitespace() => return &line[..at],
            (None, '"' | '\'') => quote = Some(letter),
            (Some(open), letter) if letter == open => quote = None,
            _ => {}
        }
        before = letter;
    }
    line
}

fn unquoted(text: &str) -> &str {
    for quote in ['"', '\''] {
        if let Some(inner) = text.strip_prefix(quote).and_then(|text| text.strip_suffix(quote)) {
            return inner;
        }
    }
    text
}

/// The first forty letters: messages stay one line long whatever a file holds.
pub(super) fn shortened(text: &str) -> String {
    text.chars().take(40).collect()
}
