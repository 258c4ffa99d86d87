//! States fingerprints of the sources, so that nothing that was stored by another version of the code is taken for this one's.

use std::fs;
use std::path::{Path, PathBuf};

/// Modules that come after the photons: a change in them leaves stored photons valid.
const AFTER_PHOTONS: &[&str] = &[
    "adc",
    "pixel",
    "compute",
    "link",
    "energy",
    "tracker",
    "report",
    "effects",
    "ladder",
    "waves",
    "characterize",
    "sweep",
    "files",
    "cli",
    "main",
    "events",
];

/// Modules that change no figure of a run.
const AFTER_FIGURES: &[&str] = &["ladder", "waves", "characterize", "sweep", "files", "cli", "main"];

fn main() {
    println!("cargo::rerun-if-changed=src");
    println!("cargo::rerun-if-changed=rtl_models/src");
    println!("cargo::rerun-if-changed=Cargo.lock");
    let mut files = Vec::new();
    collect(Path::new("src"), &mut files);
    files.sort();
    println!("cargo::rustc-env=SENSEL_PHOTON_SOURCES={}", fingerprint(&files, AFTER_PHOTONS));
    collect(Path::new("rtl_models/src"), &mut files);
    files.push(PathBuf::from("Cargo.lock"));
    files.sort();
    println!("cargo::rustc-env=SENSEL_FIGURE_SOURCES={}", fingerprint(&files, AFTER_FIGURES));
}

fn collect(folder: &Path, files: &mut Vec<PathBuf>) {
    let Ok(entries) = fs::read_dir(folder) else { return };
    for path in entries.filter_map(Result::ok).map(|entry| entry.path()) {
        if path.is_dir() {
            collect(&path, files);
        } else {
            files.push(path);
        }
    }
}

/// Hash of all files but those of the modules left out, in order of their names.
fn fingerprint(files: &[PathBuf], left_out: &[&str]) -> String {
    let mut hash = Fnv::default();
    for file in files {
        let module = file.components().nth(1).map(|part| part.as_os_str().to_string_lossy().into_owned());
        let module = module.unwrap_or_default();
        if file.starts_with("src") && left_out.contains(&module.trim_end_matches(".rs")) {
            continue;
        }
        hash.add(file.to_string_lossy().replace('\\', "/").as_bytes());
        hash.add(&fs::read(file).unwrap_or_default());
    }
    format!("{:032x}", hash.0)
}

/// FNV-1a of 128 bits: a fingerprint, not a defence.
struct Fnv(u128);

impl Default for Fnv {
    fn default() -> Self {
        Self(0x6c62_272e_07bb_0142_62b8_2175_6295_c58d)
    }
}

impl Fnv {
    fn add(&mut self, bytes: &[u8]) {
        for &byte in bytes {
            self.0 = (self.0 ^ u128::from(byte)).wrapping_mul(0x0000_0000_0100_0000_0000_0000_0000_013b);
        }
    }
}
