//! The glossary and the source agree: its words are in use, and words that were given up for the field's terms are names of nothing.

use std::collections::BTreeSet;
use std::fs;

use super::circles::code;
use super::{files, root};

/// Names that were given up, each for the field's term (glossary and style sheet).
const RETIRED: [&str; 24] = [
    "Desk", "Felt", "Foreseen", "Glint", "Net", "Parting", "Ride", "Seat", "Seen", "Shares", "Sight", "Silicon",
    "Ways", "UNMET", "desk", "felt", "foreseen", "glint", "hear", "ride", "seat", "sight", "silicon", "spend",
];

/// Names in code: comments and texts have none.
pub(super) fn identifiers(text: &str) -> BTreeSet<String> {
    let is_name = |character: char| character.is_alphanumeric() || character == '_';
    code(text).split(|character| !is_name(character)).map(str::to_owned).collect()
}

/// Words in the first column of the glossary, without what stands in brackets.
fn terms() -> Vec<String> {
    let text = fs::read_to_string(root().join("docs/glossary.md")).unwrap();
    let cell = |line: &str| Some(line.strip_prefix("| ")?.split(['|', '(']).next()?.trim().to_owned());
    text.lines().filter_map(cell).filter(|term| term != "word").collect()
}

#[test]
fn no_retired_word_is_a_name() {
    let mut read = 0;
    for path in files(&["src", "rtl_models/src", "web/src"], "rs") {
        let names = identifiers(&fs::read_to_string(&path).unwrap());
        for word in RETIRED {
            assert!(!names.contains(word), "{} names something `{word}`; use the field's term", path.display());
        }
        read += names.len();
    }
    assert!(read > 10_000, "only {read} names were read");
    assert!(identifiers("struct Seen; // Desk\nfn f() { \"Glint\"; }").contains("Seen"));
    assert!(!identifiers("// Desk\nfn f() { \"Glint\"; }").iter().any(|name| RETIRED.contains(&name.as_str())));
}

#[test]
fn each_word_of_the_glossary_is_in_use() {
    let mut sources = files(&["src", "rtl_models/src"], "rs");
    sources.extend(files(&["python"], "py"));
    let all: String = sources.iter().map(|path| fs::read_to_string(path).unwrap().to_lowercase()).collect();
    let words = terms();
    assert!(words.len() > 30, "only {} words were read", words.len());
    assert!(words.is_sorted_by_key(|word| word.to_lowercase()), "the glossary is in alphabetical order");
    for word in &words {
        let word = word.to_lowercase();
        // As words of a text, a name in snake case, a type's name, or with a hyphen.
        let forms = [" ", "_", "", "-"].map(|between| word.replace([' ', '-'], between));
        assert!(forms.iter().any(|form| all.contains(form)), "no source says '{word}'");
    }
}
