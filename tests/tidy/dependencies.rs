//! Every dependency in a manifest is used by the code that it is for.

use std::fs;
use std::path::{Path, PathBuf};

use super::{files_under, root};

/// Tables of a manifest, and the folders (or files) of code that they are for. Programs and libraries that only tests use belong to
/// `dev-dependencies`.
const TABLES: [(&str, &[&str]); 3] = [
    ("dependencies", &["src"]),
    ("dev-dependencies", &["src", "tests", "benches", "examples"]),
    ("build-dependencies", &["build.rs"]),
];

/// Whether code names a crate: as the first part of a path, or in `use name;`, `use name as` or `extern crate name`. Comments do not count.
fn names(code: &str, crate_name: &str) -> bool {
    let is_word = |c: char| c.is_alphanumeric() || c == '_';
    code.lines().map(|line| line.split("//").next().unwrap_or_default()).any(|line| {
        line.match_indices(crate_name).any(|(at, _)| {
            let (before, after) = (&line[..at], &line[at + crate_name.len()..]);
            let inside_a_path = before.strip_suffix("::").is_some_and(|path| path.ends_with(is_word));
            let whole = !before.ends_with(is_word) && !after.starts_with(is_word) && !inside_a_path;
            let declared = ["use ", "extern crate "].iter().any(|word| before.ends_with(word));
            whole && (after.starts_with("::") || declared && (after.starts_with(';') || after.starts_with(" as ")))
        })
    })
}

/// Dependencies of a manifest that `code_of` a folder names nowhere, each with its table. One whose own feature a feature of the manifest
/// turns on is there for that.
fn unused(manifest: &str, code_of: impl Fn(&str) -> String) -> Vec<String> {
    let manifest: toml::Table = manifest.parse().expect("a manifest is TOML");
    let targets = manifest.get("target").and_then(toml::Value::as_table);
    let of_targets = targets.into_iter().flat_map(|targets| targets.values()).filter_map(toml::Value::as_table);
    let features = manifest.get("features").and_then(toml::Value::as_table);
    let turned_on: Vec<&str> = features
        .into_iter()
        .flat_map(toml::Table::values)
        .filter_map(toml::Value::as_array)
        .flatten()
        .filter_map(toml::Value::as_str)
        .filter_map(|feature| feature.split_once('/').map(|(name, _)| name))
        .collect();
    let mut found = Vec::new();
    for tables in std::iter::once(&manifest).chain(of_targets) {
        for (table, folders) in TABLES {
            let Some(listed) = tables.get(table).and_then(toml::Value::as_table) else { continue };
            let code: String = folders.iter().map(|folder| code_of(folder)).collect();
            let is_lost =
                |name: &&String| !turned_on.contains(&name.as_str()) && !names(&code, &name.replace('-', "_"));
            let lost = listed.keys().filter(is_lost);
            found.extend(lost.map(|name| format!("{name} in [{table}]")));
        }
    }
    found
}

/// The Rust code of a folder or file.
fn code(path: &Path) -> String {
    let mut sources = Vec::new();
    if path.is_file() {
        sources.push(path.to_owned());
    }
    files_under(path, "rs", &mut sources);
    sources.iter().map(|source| fs::read_to_string(source).expect("sources are text") + "\n").collect()
}

#[test]
fn every_dependency_is_used_by_the_code_that_it_is_for() {
    let mut manifests: Vec<PathBuf> = Vec::new();
    files_under(root(), "toml", &mut manifests);
    manifests.retain(|path| path.file_name().is_some_and(|name| name == "Cargo.toml"));
    assert!(manifests.len() >= 4, "only {} manifests were read", manifests.len());
    for path in manifests {
        let folder = path.parent().unwrap();
        let lost = unused(&fs::read_to_string(&path).unwrap(), |name| code(&folder.join(name)));
        assert!(lost.is_empty(), "{} lists what no code of its crate uses: {}", path.display(), lost.join(", "));
    }
}

#[test]
fn a_dependency_that_is_only_spoken_of_or_used_by_tests_alone_is_found() {
    let manifest = "
        [dependencies]
        used-one = '1'
        renamed = { package = 'other', version = '1' }
        left-over = { version = '2', optional = true }
        only-in-tests = '1'
        [dev-dependencies]
        in_tests = '1'
        [target.'cfg(unix)'.dependencies]
        unix_part = '1'
        [build-dependencies]
        maker = '1'
    ";
    let code = |folder: &str| {
        match folder {
        "src" => {
            "use used_one::{A, B};\nuse renamed as short;\n// left_over::run();\nlet x = 1; // left_over::run()
            left_over_more::run(); my_left_over::run(); crate::left_over::run(); self::unix_part::f(); let left_over = 1;"
        }
        "tests" => "#[in_tests::test]\nfn f() { only_in_tests::g() }",
        _ => "",
    }
    };
    let found = unused(manifest, |folder| code(folder).to_owned());
    assert_eq!(
        found,
        [
            "left-over in [dependencies]",
            "only-in-tests in [dependencies]",
            "maker in [build-dependencies]",
            "unix_part in [dependencies]"
        ]
    );
    assert_eq!(unused("[dependencies]\nused = '1'", |_| "::used::run()".to_owned()), [""; 0]);
}
