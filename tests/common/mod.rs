//! What the integration tests share: folders that vanish, and the program run as a user runs it.

#![allow(dead_code)] // Each test file uses its own part.

pub mod assets;

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};
use std::sync::{Mutex, Once};

use serde_json::Value;

/// A folder of its own for one test, removed when dropped.
pub struct Scratch(PathBuf);

/// Held by a test that limits the instruction set, which is one for the whole process.
pub static LEVEL: Mutex<()> = Mutex::new(());

/// Whether tests take their full number of cases, as they do each week.
pub fn takes_all_cases() -> bool {
    std::env::var_os("SENSEL_ALL_CASES").is_some()
}

/// All of a test's cases each week, and a part of them each day (CONTRIBUTING.md lists both).
pub fn cases<T>(all: T, each_day: T) -> T {
    if takes_all_cases() { all } else { each_day }
}

/// Whether this process, and so what it starts, ignores SIGINT, as a command in the background of a script does.
#[cfg(unix)]
pub fn ignores_interrupts() -> bool {
    let status = std::fs::read_to_string("/proc/self/status").unwrap_or_default();
    let mask = status.lines().find_map(|line| line.strip_prefix("SigIgn:")).unwrap_or_default();
    u64::from_str_radix(mask.trim(), 16).is_ok_and(|mask| mask >> 1 & 1 == 1)
}

static COUNT: AtomicU32 = AtomicU32::new(0);

impl Scratch {
    pub fn new(name: &str) -> Self {
        let count = COUNT.fetch_add(1, Ordering::Relaxed);
        let path = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("{name}-{}-{count}", std::process::id()));
        std::fs::create_dir_all(&path).unwrap();
        Self(path)
    }

    pub fn path(&self) -> &Path {
        &self.0
    }

    /// A path inside, as text.
    pub fn join(&self, name: &str) -> String {
        self.0.join(name).display().to_string()
    }

    /// Names of what stands inside, hidden ones too, sorted.
    pub fn names(&self) -> Vec<String> {
        names(&self.0)
    }
}

impl Drop for Scratch {
    fn drop(&mut self) {
        let _ = std::fs::remove_dir_all(&self.0);
    }
}

pub fn names(folder: &Path) -> Vec<String> {
    let entries = std::fs::read_dir(folder).unwrap();
    let mut names: Vec<String> = entries.map(|entry| entry.unwrap().file_name().into_string().unwrap()).collect();
    names.sort();
    names
}

/// What the program said.
#[derive(Debug)]
pub struct Outcome {
    pub code: i32,
    pub stdout: String,
    pub stderr: String,
}

impl Outcome {
    pub fn json(&self) -> Value {
        assert_eq!(self.code, 0, "{}", self.stderr);
        serde_json::from_str(&self.stdout).unwrap()
    }
}

/// Runs the program in the repository's folder, with a cache of its own that all tests share (entries are written whole).
pub fn sensel<S: AsRef<str>>(arguments: &[S]) -> Outcome {
    outcome(sensel_command(arguments))
}

/// The same where no other program is found.
pub fn sensel_alone<S: AsRef<str>>(arguments: &[S]) -> Outcome {
    let mut alone = sensel_command(arguments);
    alone.env("PATH", "");
    outcome(alone)
}

/// The program without any argument.
pub fn sensel_bare() -> Outcome {
    outcome(Command::new(env!("CARGO_BIN_EXE_sensel")))
}

/// The same as `sensel` with another cache.
pub fn sensel_in_cache<S: AsRef<str>>(arguments: &[S], cache: &str) -> Outcome {
    outcome(command_in(arguments, cache))
}

/// The program with these words, to be run in the repository's folder.
pub fn sensel_command<S: AsRef<str>>(arguments: &[S]) -> Command {
    static EMPTIED: Once = Once::new();
    EMPTIED.call_once(empty_cache_of_other_builds);
    command_in(arguments, CACHE)
}

const CACHE: &str = concat!(env!("CARGO_TARGET_TMPDIR"), "/cache");

/// What another build stored would hide a change of its method under the same version.
fn empty_cache_of_other_builds() {
    let stamp = concat!(env!("CARGO_TARGET_TMPDIR"), "/cache_of_build.txt");
    let built = format!("{:?}", std::fs::metadata(env!("CARGO_BIN_EXE_sensel")).unwrap().modified().unwrap());
    if std::fs::read_to_string(stamp).is_ok_and(|of| of == built) {
        return;
    }
    if Path::new(CACHE).exists() {
        std::fs::remove_dir_all(CACHE).unwrap();
    }
    std::fs::write(stamp, built).unwrap();
}

fn command_in<S: AsRef<str>>(arguments: &[S], cache: &str) -> Command {
    let mut command = Command::new(env!("CARGO_BIN_EXE_sensel"));
    command
        .args(arguments.iter().map(AsRef::as_ref))
        .args(["--cache", cache])
        .env_remove("SENSEL_SCENES")
        .current_dir(env!("CARGO_MANIFEST_DIR"));
    // Photons that an earlier test stored would hide what this one is to show, unless it asks for the store.
    if !arguments.iter().any(|word| word.as_ref() == "--photons-gib") {
        command.args(["--photons-gib", "0"]);
    }
    command
}

/// Runs a command to its end.
pub fn outcome(mut command: Command) -> Outcome {
    let output = command.output().unwrap();
    Outcome {
        code: output.status.code().expect("the program ends by itself"),
        stdout: String::from_utf8(output.stdout).unwrap(),
        stderr: String::from_utf8(output.stderr).unwrap(),
    }
}

/// The box room as a sensor of a quarter VGA sees it: small, and with enough corners to track.
pub const SMALL: [&str; 4] = ["--set", "sensor.width=320", "--set", "sensor.height=240"];

/// Runs the box room into `out` and returns its report.
pub fn run_box(out: &str, frames: u32, more: &[&str]) -> Value {
    let frames = frames.to_string();
    let mut arguments = vec!["run", "box", "--frames", &frames, "--out", out, "--json"];
    arguments.extend(SMALL);
    arguments.extend(more);
    sensel(&arguments).json()
}

/// All paths of nulls in a JSON value; indices of lists are left out.
pub fn nulls(value: &Value, path: &str, found: &mut Vec<String>) {
    match value {
        Value::Null => found.push(path.to_owned()),
        Value::Object(map) => {
            for (key, inner) in map {
                let path = if path.is_empty() { key.clone() } else { format!("{path}.{key}") };
                nulls(inner, &path, found);
            }
        }
        Value::Array(items) => items.iter().for_each(|item| nulls(item, path, found)),
        _ => {}
    }
}
