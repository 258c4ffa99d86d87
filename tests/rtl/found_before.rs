//! Netlists that Yosys has found before. They depend on nothing but the Verilog, the script and Yosys itself, so it looks again only after
//! one of these or an expected figure has changed, and each week.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

use super::judge::sources;

/// Hashes of what was asked when each test last held, by its name.
fn record() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/vectors/netlists_found.json")
}

/// Runs a test of netlists, unless it has held for the sources of the same blocks, the same `words` (the test itself, and expected
/// figures) and the same Yosys. With `SENSEL_UPDATE=1` a test that holds is recorded.
pub fn unless_found_before(test: &str, blocks: &[&str], words: &str, run: impl FnOnce()) {
    let version = Command::new("yosys").arg("-V").output().expect("yosys runs: ./check --install").stdout;
    let mut hasher = blake3::Hasher::new();
    let mut add = |part: &[u8]| {
        hasher.update(part);
        hasher.update(&[0]);
    };
    add(&version);
    add(words.as_bytes());
    for file in blocks.iter().flat_map(|block| sources(block)) {
        add(&std::fs::read(file).unwrap());
    }
    let asked = hasher.finalize().to_hex().to_string();
    let read = || -> BTreeMap<String, String> { serde_json::from_slice(&std::fs::read(record()).unwrap()).unwrap() };
    let is_known = read().get(test) == Some(&asked);
    if is_known && !crate::common::takes_all_cases() {
        println!("{test}: found before");
        return;
    }
    run();
    if std::env::var_os("SENSEL_UPDATE").is_some() {
        static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
        let _held = ONE_AT_A_TIME.lock().unwrap();
        let mut known = read();
        known.insert(test.to_owned(), asked);
        std::fs::write(record(), serde_json::to_string_pretty(&known).unwrap() + "\n").unwrap();
    } else if !is_known {
        println!("{test}: not found before; SENSEL_UPDATE=1 records it");
    }
}
