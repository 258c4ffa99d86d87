//! Netlists that Yosys has found before. They depend on nothing but the Verilog, the script and Yosys itself, so it looks again only after
//! one of these or an expected figure has changed, and each week.

use std::collections::BTreeMap;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::Mutex;

use serde::{Deserialize, Serialize};

use super::judge::sources;

/// When a test last held: for which sources, with which Yosys.
#[derive(Serialize, Deserialize, PartialEq)]
struct Found {
    sources: String,
    yosys: String,
}

/// What is recorded of each test, by its name.
fn record() -> PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("tests/vectors/netlists_found.json")
}

/// Runs a test of netlists, unless it has held for the sources of the same blocks, the same `words` (the test itself, and expected
/// figures) and the same Yosys. With `SENSEL_UPDATE=1` a test that holds is recorded. One that is not recorded, or for other sources by the
/// same Yosys, fails, since it would run for minutes each day from then on. Another Yosys than the recorded one runs each time.
pub fn unless_found_before(test: &str, blocks: &[&str], words: &str, run: impl FnOnce()) {
    let version = Command::new("yosys").arg("-V").output().expect("yosys runs: ./check --install").stdout;
    let mut hasher = blake3::Hasher::new();
    let mut add = |part: &[u8]| {
        hasher.update(part);
        hasher.update(&[0]);
    };
    add(words.as_bytes());
    for file in blocks.iter().flat_map(|block| sources(block)) {
        add(&std::fs::read(file).unwrap());
    }
    let asked = Found {
        sources: hasher.finalize().to_hex().to_string(),
        yosys: String::from_utf8(version).unwrap().trim().to_owned(),
    };
    let read = || -> BTreeMap<String, Found> { serde_json::from_slice(&std::fs::read(record()).unwrap()).unwrap() };
    let known = read().remove(test);
    if known.as_ref() == Some(&asked) && !crate::common::takes_all_cases() {
        println!("{test}: found before");
        return;
    }
    run();
    if std::env::var_os("SENSEL_UPDATE").is_some() {
        static ONE_AT_A_TIME: Mutex<()> = Mutex::new(());
        let _held = ONE_AT_A_TIME.lock().unwrap();
        let mut all = read();
        all.insert(test.to_owned(), asked);
        std::fs::write(record(), serde_json::to_string_pretty(&all).unwrap() + "\n").unwrap();
    } else {
        let is_stale = known.is_none_or(|known| known.yosys == asked.yosys && known.sources != asked.sources);
        assert!(!is_stale, "{test} holds, but for other sources than recorded; SENSEL_UPDATE=1 records these");
    }
}
