//! Verilog to a program. Enters: a module of `rtl_models`, its parameters, a harness in C++. Leaves: the path of a program that Verilator
//! made of them, made once for each content of all that goes in.

use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};

use rtl_models::verilog::sources_of;

use super::io_error;
use crate::error::Error;

/// Name of the header that the harness includes beside `Vblock.h`.
pub const HEADER: &str = "block.h";

/// Numbers the unfinished builds of this process.
static TURN: AtomicU32 = AtomicU32::new(0);

/// What a program is built of.
#[derive(Clone, Copy, Debug)]
pub struct Build<'a> {
    /// Module at the top.
    pub top: &'a str,
    /// Text of the harness.
    pub harness: &'a str,
    /// Text of `HEADER`.
    pub header: &'a str,
    /// Flags of Verilator.
    pub flags: &'a [String],
}

fn failed(what: impl std::fmt::Display) -> Error {
    Error::Run(format!("the Verilog was not built: {what}"))
}

/// Verilator's word about itself.
///
/// # Errors
/// It is not there.
pub fn version() -> Result<String, Error> {
    let absent = |why: &dyn std::fmt::Display| {
        let reason = format!(
            "needs Verilator, and `verilator --version` failed ({why}); installing it (Debian: verilator) or clocked would do"
        );
        Error::key("run.rung", "rtl", reason)
    };
    let output = Command::new("verilator").arg("--version").output().map_err(|error| absent(&error))?;
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
        sources_of(self.top).for_each(|source| add(source.text));
        self.flags.iter().for_each(|flag| add(flag));
        hasher.finalize().to_hex()[..16].to_owned()
    }

    /// The program, in a folder of its own under `base`; built unless it stands there from an earlier time.
    ///
    /// # Errors
    /// Verilator is not there or refuses, or the disk says no.
    pub fn program(&self, base: &Path) -> Result<PathBuf, Error> {
        let name = format!("{}-{}", self.top, self.key(&version()?));
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
        // Its own file first: that is the top.
        let (mut own, mut parts) = (Vec::new(), Vec::new());
        for source in sources_of(self.top) {
            let list = if source.module == self.top { &mut own } else { &mut parts };
            list.push(put(&format!("{}.sv", source.module), source.text)?);
        }
        let mut command = Command::new("verilator");
        command.args(["--cc", "--exe", "--build", "-j", "1", "--prefix", "Vblock", "-o", "../block"]);
        command.args(["--top-module", self.top, "--Mdir"]).arg(folder.join("obj"));
        command.args(["-CFLAGS", &format!("-I{}", folder.display())]).args(self.flags);
        command.args(own).args(parts).arg(harness);
        let output = command.output().map_err(failed)?;
        if !output.status.success() {
            let text = String::from_utf8_lossy(&output.stderr).into_owned() + &String::from_utf8_lossy(&output.stdout);
            return Err(failed(text));
        }
        let objects = folder.join("obj");
        std::fs::remove_dir_all(&objects).map_err(io_error(&objects))
    }
}
