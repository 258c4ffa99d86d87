//! Verilog to a program. Enters: a module, of `rtl_models` or another, its parameters, a harness in C++. Leaves: the path of a program
//! that Verilator made of them, made once for each content of all that goes in.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};

use rtl_models::verilog::{self, sources_of};

use super::io_error;
use crate::error::Error;

/// Name of the header that the harness includes beside `Vblock.h`.
const HEADER: &str = "block.h";

/// Numbers the unfinished builds of this process.
static TURN: AtomicU32 = AtomicU32::new(0);

/// A file of Verilog: name and text. One that ends in `.sv` is translated, any other lies beside it for those that include it.
pub type Source<'a> = (String, Cow<'a, str>);

/// What a program is built of.
#[derive(Clone, Debug)]
pub struct Build<'a> {
    /// Verilator's program.
    pub verilator: &'a str,
    /// Module at the top.
    pub top: &'a str,
    /// Verilog, the top's file first.
    pub sources: Vec<Source<'a>>,
    /// Text of the harness.
    pub harness: &'a str,
    /// Text of `block.h`, which the harness includes.
    pub header: &'a str,
    /// Flags of Verilator.
    pub flags: &'a [&'a str],
}

fn failed(what: impl std::fmt::Display) -> Error {
    Error::Run(format!("the Verilog was not built: {what}"))
}

/// The files of a module of `rtl_models`, its own first.
pub fn sources(top: &str) -> Vec<Source<'static>> {
    let (own, parts): (Vec<_>, Vec<_>) = sources_of(top).partition(|source| source.module == top);
    let named = |source: &verilog::Source| (format!("{}.sv", source.module), Cow::Borrowed(source.text));
    own.into_iter().chain(parts).map(named).collect()
}

/// What a program called `verilator` says about itself.
///
/// # Errors
/// It is not there.
pub fn version(verilator: &str) -> Result<String, Error> {
    let absent = |why: &dyn std::fmt::Display| {
        let reason = format!(
            "needs Verilator, and `{verilator} --version` failed ({why}); installing it (Debian: verilator) or clocked would do"
        );
        Error::key("run.rung", "rtl", reason)
    };
    let output = Command::new(verilator).arg("--version").output().map_err(|error| absent(&error))?;
    if !output.status.success() {
        return Err(absent(&output.status));
    }
    Ok(String::from_utf8_lossy(&output.stdout).lines().next().unwrap_or_default().to_owned())
}

impl Build<'_> {
    fn key(&self, version: &str) -> String {
        let mut hasher = blake3::Hasher::new();
        let mut add = |text: &str| {
            hasher.update(&crate::num::u64_from(text.len()).to_le_bytes());
            hasher.update(text.as_bytes());
        };
        [version, self.top, self.harness, self.header].into_iter().for_each(&mut add);
        self.sources.iter().for_each(|(_, text)| add(text));
        self.flags.iter().for_each(|flag| add(flag));
        hasher.finalize().to_hex()[..16].to_owned()
    }

    /// The program, in a folder of its own under `base`; built unless it stands there from an earlier time.
    ///
    /// # Errors
    /// Verilator is not there or refuses, or the disk says no.
    pub fn program(&self, base: &Path) -> Result<PathBuf, Error> {
        let name = format!("{}-{}", self.top, self.key(&version(self.verilator)?));
        let folder = base.join(&name);
        let program = folder.join("block");
        if program.exists() {
            return Ok(program);
        }
        let turn = TURN.fetch_add(1, Ordering::Relaxed);
        let scratch = base.join(format!("{name}.{}-{turn}", std::process::id()));
        std::fs::create_dir_all(&scratch).map_err(io_error(&scratch))?;
        let made = self.make(&scratch);
        if made.is_err() || std::fs::rename(&scratch, &folder).is_err() {
            // A failed build leaves nothing; of two that were built at once the quicker serves.
            std::fs::remove_dir_all(&scratch).map_err(io_error(&scratch))?;
        }
        made.map(|()| program)
    }

    fn make(&self, folder: &Path) -> Result<(), Error> {
        let put = |name: &str, text: &str| -> Result<PathBuf, Error> {
            let path = folder.join(name);
            std::fs::write(&path, text).map_err(io_error(&path))?;
            Ok(path)
        };
        put(HEADER, self.header)?;
        let harness = put("harness.cpp", self.harness)?;
        let placed: Result<Vec<PathBuf>, Error> = self.sources.iter().map(|(name, text)| put(name, text)).collect();
        let translated = placed?.into_iter().filter(|path| path.extension().is_some_and(|end| end == "sv"));
        let mut command = Command::new(self.verilator);
        command.args(["--cc", "--exe", "--build", "-j", "1", "--prefix", "Vblock", "-o", "../block"]);
        command.args(["--top-module", self.top, "--Mdir"]).arg(folder.join("obj"));
        command.args(["-CFLAGS", &format!("-I{}", folder.display())]).arg(format!("-I{}", folder.display()));
        command.args(self.flags).args(translated).arg(harness);
        let output = command.output().map_err(failed)?;
        if !output.status.success() {
            let text = String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
            return Err(failed(text));
        }
        let objects = folder.join("obj");
        std::fs::remove_dir_all(&objects).map_err(io_error(&objects))
    }
}
