//! What the documents say of the source is there: each name in "`file.rs` (`name`, `Type::name`)" is one of that file.

use std::fs;
use std::path::PathBuf;

use super::glossary::identifiers;
use super::{files, root};

/// Pairs of a source file and a name that a text gives for it.
fn named(text: &str) -> Vec<(&str, &str)> {
    let mut found = Vec::new();
    // Every second piece stands between backticks.
    let pieces: Vec<&str> = text.split('`').collect();
    let mut file = None;
    for at in (1..pieces.len()).step_by(2) {
        let word = pieces[at];
        if pieces[at - 1].contains(')') {
            file = None;
        }
        if word.ends_with(".rs") {
            // A list of names stands in the brackets behind it.
            file = pieces.get(at + 1).filter(|after| after.starts_with(" (")).map(|_| word);
        } else if let Some(file) = file {
            found.push((file, word));
        }
    }
    found
}

#[test]
fn names_that_documents_give_for_a_file_are_in_it() {
    let sources = files(&["src", "rtl_models/src", "tests", "benches"], "rs");
    let mut documents: Vec<PathBuf> = ["ARCHITECTURE.md", "CONTRIBUTING.md"].map(|name| root().join(name)).to_vec();
    documents.extend(files(&["docs"], "md"));
    let mut checked = 0;
    for document in documents {
        let text = fs::read_to_string(&document).unwrap();
        for (file, name) in named(&text) {
            let is_name = |part: &str| part.chars().all(|one| one.is_ascii_alphanumeric() || one == '_');
            if !name.split("::").all(is_name) {
                continue;
            }
            let holds = |path: &PathBuf| {
                let names = identifiers(&fs::read_to_string(path).unwrap());
                name.split("::").all(|part| names.contains(part))
            };
            let files: Vec<_> = sources.iter().filter(|path| path.ends_with(file)).collect();
            assert!(!files.is_empty(), "{}: there is no {file}", document.display());
            assert!(files.into_iter().any(holds), "{}: {file} has no {name}", document.display());
            checked += 1;
        }
    }
    assert!(checked > 30, "only {checked} names were read");
    assert_eq!(
        named("`a.rs` (`A::f`: first; `g`) and `h`, `b.rs`, `c.rs` (`i`)"),
        [("a.rs", "A::f"), ("a.rs", "g"), ("c.rs", "i")]
    );
}
