//! Documents state the formats of words with a fraction as the types have them.

use std::fs;

use sensel::words::{EXTRACTOR_FORMATS, FORMATS, Format};

use super::{files, root};

/// A row of a document's table.
fn row(format: &Format) -> String {
    let Format { name, is_signed, int_bits, frac_bits, holds, range } = *format;
    let sign = if is_signed { 'i' } else { 'u' };
    format!("| `{name}` | {sign}{int_bits}.{frac_bits} | {holds} | {range} |")
}

/// Whether a table's row states a format: its second cell is one.
fn states_a_format(line: &str) -> bool {
    let Some(cell) = line.strip_prefix("| `").and_then(|rest| rest.split(" | ").nth(1)) else { return false };
    let numbers = cell.strip_prefix(['u', 'i']).and_then(|numbers| numbers.split_once('.'));
    numbers.is_some_and(|(int, frac)| int.parse::<u32>().is_ok() && frac.parse::<u32>().is_ok())
}

#[test]
fn documents_state_every_format_once_and_as_the_type_has_it() {
    let mut expected: Vec<String> = EXTRACTOR_FORMATS.iter().chain(FORMATS).map(row).collect();
    let mut stated = Vec::new();
    for path in files(&["docs"], "md") {
        let text = fs::read_to_string(&path).unwrap();
        stated.extend(text.lines().filter(|line| states_a_format(line)).map(str::to_owned));
    }
    expected.sort();
    stated.sort();
    assert!(expected.len() > 10 && expected.iter().all(|row| states_a_format(row)), "{expected:#?}");
    assert!(stated == expected, "the rows should be:\n{}", expected.join("\n"));
}

#[test]
fn a_twin_has_no_float_and_no_dependency_but_fixed() {
    let manifest: toml::Table = fs::read_to_string(root().join("rtl_models/Cargo.toml")).unwrap().parse().unwrap();
    let dependencies: Vec<&str> = manifest["dependencies"].as_table().unwrap().keys().map(String::as_str).collect();
    assert_eq!(dependencies, ["fixed"]);
    for path in files(&["rtl_models/src"], "rs") {
        let text = fs::read_to_string(&path).unwrap();
        let code = text.split("#[cfg(test)]").next().unwrap_or_default();
        let is_word = |c: char| c.is_alphanumeric() || c == '_';
        let float = code.split(|c: char| !is_word(c)).find(|word| ["f32", "f64", "f16"].contains(word));
        assert!(float.is_none(), "{} uses {float:?}", path.display());
    }
}
