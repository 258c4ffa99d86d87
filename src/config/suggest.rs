//! Converts serde's message about a wrong key or type to one with file, line, key, value and an accepted value.

use super::tree::Tree;
use crate::error::Error;

/// The configuration error for serde's message about the value at `path`.
pub fn explain(tree: &Tree, path: &str, message: &str) -> Error {
    let mut quoted = message.split('`').skip(1).step_by(2).map(str::to_owned);
    let (key, reason) = if message.starts_with("unknown field") {
        let unknown = quoted.next().unwrap_or_default();
        let known: Vec<String> = quoted.collect();
        (child_path(path, &unknown), unknown_key_reason(&unknown, &known))
    } else if message.starts_with("missing field") {
        let missing = quoted.next().unwrap_or_default();
        (child_path(path, &missing), "is missing; neither the scenario, a preset nor the defaults give it".to_owned())
    } else {
        (path.to_owned(), in_words(message))
    };
    tree.locate(Error::key(&key, "", reason))
}

/// Serde names Rust's types; a user knows TOML's. Its whole numbers end at the greatest `i64`.
fn in_words(message: &str) -> String {
    let Some((found, expected)) = message.rsplit_once("expected ") else { return message.to_owned() };
    let would_do = match expected {
        "u8" => "a whole number from 0 to 255",
        "u16" => "a whole number from 0 to 65535",
        "u32" => "a whole number from 0 to 4294967295",
        "u64" => "a whole number from 0 to 9223372036854775807",
        "f32" | "f64" => "a number",
        "a boolean" => "true or false",
        "a string" => "a text in quotes",
        _ if expected.starts_with("struct ") => "a table of keys",
        _ => expected,
    };
    format!("{found}use {would_do}")
}

fn child_path(path: &str, key: &str) -> String {
    let path = path.trim_matches('.');
    if path.is_empty() || path == key || path.ends_with(&format!(".{key}")) {
        return if path.is_empty() { key.to_owned() } else { path.to_owned() };
    }
    format!("{path}.{key}")
}

fn unknown_key_reason(unknown: &str, known: &[String]) -> String {
    if unknown == "top_k" {
        return "unknown key; per_cell and cell_px do this".to_owned();
    }
    let nearest = known.iter().min_by_key(|candidate| edit_distance(unknown, candidate));
    match nearest {
        Some(near) if edit_distance(unknown, near) <= 1 + near.len() / 3 => {
            format!("unknown key; did you mean '{near}'?")
        }
        _ => format!("unknown key; known here: {}", known.join(", ")),
    }
}

/// Levenshtein's distance in bytes.
pub fn edit_distance(a: &str, b: &str) -> usize {
    let mut row: Vec<usize> = (0..=b.len()).collect();
    for (i, left) in a.bytes().enumerate() {
        let mut diagonal = row[0];
        row[0] = i + 1;
        for (j, right) in b.bytes().enumerate() {
            let substituted = diagonal + usize::from(left != right);
            diagonal = row[j + 1];
            row[j + 1] = substituted.min(row[j] + 1).min(diagonal + 1);
        }
    }
    row[b.len()]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edit_distance_counts_insertions_deletions_and_changes() {
        for (a, b, distance) in
            [("", "", 0), ("a", "", 1), ("bits", "bits", 0), ("bit", "bits", 1), ("kitten", "sitting", 3)]
        {
            assert_eq!(edit_distance(a, b), distance, "{a} {b}");
        }
    }
}
