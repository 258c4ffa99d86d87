//! No circle of imports between files: what two files need of each other stands in a third one.

use std::collections::{BTreeMap, BTreeSet};
use std::fs;
use std::path::{Path, PathBuf};

use super::{files_under, root};

/// Roots of crates, each with the file that stands for its root module.
const CRATES: [(&str, &str); 3] = [("src", "lib"), ("rtl_models/src", "lib"), ("web/src", "lib")];

/// A module as the names on its path; the root's is empty.
type Module = Vec<String>;

/// Code up to its module of tests, without other lines that only tests compile.
fn without_tests(text: &str) -> String {
    let mut found = String::new();
    let mut lines = text.lines();
    while let Some(line) = lines.next() {
        if line.starts_with("#[cfg(test)]") || line.starts_with("#[cfg(all(test") {
            match lines.by_ref().find(|line| !line.starts_with("#[")) {
                Some(item) if !item.contains("mod ") || item.ends_with(';') => continue,
                _ => break,
            }
        }
        found.push_str(line);
        found.push('\n');
    }
    found
}

/// Code without comments, texts and test modules. A test may use what it likes, since nothing uses a test.
pub fn code(text: &str) -> String {
    let mut found = String::new();
    let text = without_tests(text);
    let mut rest = &text[..];
    while let Some(at) = rest.find(['"', '/', '\'']) {
        found.push_str(&rest[..at]);
        rest = &rest[at..];
        let raw = found.ends_with('r') || found.ends_with('#');
        let end = if rest.starts_with("//") {
            rest.find('\n').unwrap_or(rest.len())
        } else if rest.starts_with('"') && raw {
            let hashes = found.len() - found.trim_end_matches('#').len();
            let close = format!("\"{}", "#".repeat(hashes));
            rest[1..].find(&close).map_or(rest.len(), |end| end + 1 + close.len())
        } else if rest.starts_with('"') {
            let mut characters = rest.char_indices().skip(1);
            let mut end = rest.len();
            while let Some((at, character)) = characters.next() {
                match character {
                    '\\' => drop(characters.next()),
                    '"' => {
                        end = at + 1;
                        break;
                    }
                    _ => {}
                }
            }
            end
        } else if rest.starts_with("'\"'") || rest.starts_with("'/'") {
            3
        } else {
            found.push_str(&rest[..1]);
            rest = &rest[1..];
            continue;
        };
        rest = &rest[end..];
    }
    found + rest
}

/// Paths that a `use` tree names.
fn leaves(tree: &str, prefix: &str, found: &mut Vec<String>) {
    let (mut depth, mut start) = (0, 0);
    let mut parts = Vec::new();
    for (at, character) in tree.char_indices() {
        match character {
            '{' => depth += 1,
            '}' => depth -= 1,
            ',' if depth == 0 => {
                parts.push(&tree[start..at]);
                start = at + 1;
            }
            _ => {}
        }
    }
    parts.push(&tree[start..]);
    for part in parts.into_iter().map(str::trim).filter(|part| !part.is_empty()) {
        match part.split_once('{') {
            Some((head, inside)) => {
                leaves(inside.trim_end().trim_end_matches('}'), &format!("{prefix}{}", head.trim()), found);
            }
            None => found.push(format!("{prefix}{}", part.split(" as ").next().unwrap_or(part).trim())),
        }
    }
}

/// All paths with `::` in code, those of `use` statements in full.
fn paths(code: &str) -> Vec<String> {
    let mut found = Vec::new();
    let mut others = String::new();
    let mut rest = code;
    while let Some(at) = rest.find("use ") {
        let is_statement = rest[..at].chars().next_back().is_none_or(|before| before.is_whitespace());
        let end = rest[at..].find(';').map_or(rest.len(), |end| at + end);
        others.push_str(&rest[..at]);
        if is_statement {
            leaves(&rest[at + 4..end].split_whitespace().collect::<Vec<_>>().join(" "), "", &mut found);
            rest = &rest[end..];
        } else {
            rest = &rest[at + 4..];
        }
    }
    others.push_str(rest);
    let is_path = |character: char| character.is_alphanumeric() || character == '_' || character == ':';
    let words = others.replace("(in crate", "(").replace("(in super", "(");
    found.extend(words.split(|character| !is_path(character)).filter(|word| word.contains("::")).map(str::to_owned));
    found
}

/// The file that a path in `module` leads to.
fn target(path: &str, module: &Module, sources: &BTreeMap<Module, PathBuf>) -> Option<Module> {
    let mut names: Vec<&str> = path.split("::").filter(|name| !name.is_empty()).collect();
    let first = *names.first()?;
    let mut whole = module.clone();
    match first {
        "crate" => whole.clear(),
        "self" | "super" => {}
        child if sources.contains_key(&[&module[..], &[child.to_owned()]].concat()) => {}
        _ => return None,
    }
    if matches!(first, "crate" | "self") {
        names.remove(0);
    }
    while names.first() == Some(&"super") {
        whole.pop();
        names.remove(0);
    }
    whole.extend(names.into_iter().map(str::to_owned));
    while !sources.contains_key(&whole) {
        whole.pop()?;
    }
    Some(whole)
}

/// What can be reached from a file over imports.
fn reached<'a>(from: &'a Module, imports: &'a BTreeMap<Module, BTreeSet<Module>>) -> BTreeSet<&'a Module> {
    let mut seen = BTreeSet::new();
    let mut open = vec![from];
    while let Some(module) = open.pop() {
        open.extend(imports[module].iter().filter(|next| seen.insert(*next)));
    }
    seen
}

/// Imports that lie on a circle.
fn circles(imports: &BTreeMap<Module, BTreeSet<Module>>) -> Vec<(Module, Module)> {
    let all: BTreeMap<&Module, _> = imports.keys().map(|from| (from, reached(from, imports))).collect();
    let pairs = imports.iter().flat_map(|(from, next)| next.iter().map(move |to| (from, to)));
    pairs.filter(|(from, to)| all[to].contains(from)).map(|(from, to)| (from.clone(), to.clone())).collect()
}

fn imports_of(folder: &Path, root_file: &str) -> BTreeMap<Module, BTreeSet<Module>> {
    let mut found = Vec::new();
    files_under(folder, "rs", &mut found);
    let module_of = |path: &PathBuf| {
        let inside = path.strip_prefix(folder).unwrap().with_extension("");
        let names = inside.iter().map(|name| name.to_string_lossy().into_owned()).collect::<Module>();
        if names == [root_file] { Module::new() } else { names }
    };
    let sources: BTreeMap<Module, PathBuf> = found.iter().map(|path| (module_of(path), path.clone())).collect();
    let imports = |(module, path): (&Module, &PathBuf)| {
        let code = code(&fs::read_to_string(path).unwrap());
        let targets = paths(&code).into_iter().filter_map(|path| target(&path, module, &sources));
        (module.clone(), targets.filter(|target| target != module).collect())
    };
    sources.iter().filter(|(module, _)| module.last().is_none_or(|name| name != "tests")).map(imports).collect()
}

#[test]
fn no_two_files_import_from_each_other_directly_or_around_a_circle() {
    let mut read = 0;
    for (folder, root_file) in CRATES {
        let mut imports = imports_of(&root().join(folder), root_file);
        let known: BTreeSet<Module> = imports.keys().cloned().collect();
        imports.values_mut().for_each(|targets| targets.retain(|target| known.contains(target)));
        read += imports.values().map(BTreeSet::len).sum::<usize>();
        let found = circles(&imports);
        let lines: Vec<String> =
            found.iter().map(|(from, to)| format!("{} -> {}", from.join("/"), to.join("/"))).collect();
        assert!(lines.is_empty(), "{folder}: imports on circles:\n{}", lines.join("\n"));
    }
    assert!(read > 1000, "only {read} imports were read");
}

#[test]
fn a_circle_is_found_directly_through_a_parent_and_by_a_path_in_code() {
    let folder = std::env::temp_dir().join(format!("sensel-circles-{}", std::process::id()));
    fs::create_dir_all(folder.join("a")).unwrap();
    let write = |name: &str, text: &str| fs::write(folder.join(name), text).unwrap();
    write("lib.rs", "mod a;\nmod b;\n");
    write("a.rs", "mod c;\npub use c::Thing;\n");
    write("a/c.rs", "// use super::Other;\npub fn f() { let text = \"super::Other\"; }\n");
    write("b.rs", "use crate::a::{Thing};\n");
    assert_eq!(circles(&imports_of(&folder, "lib")).len(), 0, "comments and texts are no imports");
    write("a/c.rs", "use super::Other;\n");
    assert_eq!(circles(&imports_of(&folder, "lib")).len(), 2, "a parent re-exports a child that imports from it");
    write("a/c.rs", "pub fn f() { crate::b::g() }\n");
    assert_eq!(circles(&imports_of(&folder, "lib")).len(), 3, "three files around a circle");
    fs::remove_dir_all(&folder).unwrap();
}
