//! Verilog to a program: Verilator builds a module, of `rtl_models` or another, with its parameters and a harness in C++. A program is
//! built once for each content of all that goes in, in a folder that only this user can write. It is run again only where it is still the
//! same.

use std::borrow::Cow;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::sync::atomic::{AtomicU32, Ordering};

use rtl_models::verilog::{self, sources_of};

use super::errors::io_error;
use super::open::{open_regular, read_opened};
use super::{disk, private, write};
use crate::error::Error;

/// Name of the header that the harness includes beside `Vblock.h`.
const HEADER: &str = "block.h";

/// The program.
const PROGRAM: &str = "block";
/// Its hash in hexadecimal, in a file beside it.
const CHECKSUM: &str = "block.blake3";
/// Longest program that is taken for one.
const PROGRAM_BYTES_MAX: u64 = 1 << 30;

/// Numbers the unfinished builds of this process.
static TURN: AtomicU32 = AtomicU32::new(0);

/// A file of Verilog: name and text. One that ends in `.sv` is translated, any other lies beside it for those that include it.
pub type VerilogSource<'a> = (String, Cow<'a, str>);

/// What a program is built of.
#[derive(Clone, Debug)]
pub struct Build<'a> {
    /// Verilator's program.
    pub verilator: &'a str,
    /// Module at the top.
    pub top: &'a str,
    /// Verilog, the top's file first.
    pub sources: Vec<VerilogSource<'a>>,
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
pub fn sources(top: &str) -> Vec<VerilogSource<'static>> {
    let (own, parts): (Vec<_>, Vec<_>) = sources_of(top).partition(|source| source.module == top);
    let named = |source: &verilog::VerilogModule| (format!("{}.sv", source.module), Cow::Borrowed(source.text));
    own.into_iter().chain(parts).map(named).collect()
}

/// What a program called `verilator` says about itself. Fails where it is not there.
pub fn version(verilator: &str) -> Result<String, Error> {
    let absent = |why: &dyn std::fmt::Display| {
        let reason = format!(
            "needs Verilator, and `{verilator} --version` failed ({why}); install it (Debian: verilator) or use clocked"
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
        hasher.finalize().to_hex()[..32].to_owned()
    }

    /// The program, in its folder under `base`; built unless a complete one exists. Fails where verilator is not there or refuses, other
    /// users can write `base`, or the disk says no.
    pub fn program(&self, base: &Path) -> Result<PathBuf, Error> {
        let name = format!("{}-{}", self.top, self.key(&version(self.verilator)?));
        private::make_private(base)?;
        let folder = base.join(&name);
        let program = folder.join(PROGRAM);
        if is_whole(&folder) {
            return Ok(program);
        }
        let turn = TURN.fetch_add(1, Ordering::Relaxed);
        let scratch = base.join(format!("{name}.{}-{turn}", std::process::id()));
        // What stands here was left by a process of the same number that died.
        let _ = std::fs::remove_dir_all(&scratch);
        private::make_private(&scratch)?;
        let made = self.make(&scratch).and_then(|()| write_checksum(&scratch));
        // A damaged program gives way to the new one; where the system cannot exchange names it goes first.
        let moved = made.as_ref().is_ok_and(|()| match std::fs::rename(&scratch, &folder) {
            Err(_) if !is_whole(&folder) => disk::exchange(&scratch, &folder).is_err_and(|_| {
                std::fs::remove_dir_all(&folder).and_then(|()| std::fs::rename(&scratch, &folder)).is_ok()
            }),
            other => other.is_ok(),
        });
        if !moved {
            // A failed build leaves nothing; of two that were built at once the quicker serves.
            std::fs::remove_dir_all(&scratch).map_err(io_error(&scratch))?;
        }
        made?;
        if is_whole(&folder) { Ok(program) } else { Err(failed(format!("{} is damaged", folder.display()))) }
    }

    fn make(&self, folder: &Path) -> Result<(), Error> {
        let put = |name: &str, text: &str| -> Result<PathBuf, Error> {
            let path = folder.join(name);
            write(&path, text)?;
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

fn hash_of(program: &Path) -> Result<String, Error> {
    let bytes = read_opened(open_regular(program)?, program, PROGRAM_BYTES_MAX)?;
    Ok(blake3::hash(&bytes).to_hex().to_string())
}

fn write_checksum(folder: &Path) -> Result<(), Error> {
    let (program, path) = (folder.join(PROGRAM), folder.join(CHECKSUM));
    write(&path, hash_of(&program)?)?;
    [program, path].iter().try_for_each(|file| private::take_from_others(file).map_err(io_error(file)))
}

/// Whether a folder holds a program as it was built, which nobody else can have put there.
fn is_whole(folder: &Path) -> bool {
    let (program, checksum) = (folder.join(PROGRAM), folder.join(CHECKSUM));
    let told = || read_opened(open_regular(&checksum)?, &checksum, 1 << 10);
    private::check_private(folder).is_ok()
        && [&program, &checksum].into_iter().all(|file| private::is_private_file(file))
        && matches!((told(), hash_of(&program)), (Ok(told), Ok(found)) if told == found.as_bytes())
}

#[cfg(all(test, unix))]
#[allow(clippy::unwrap_used, reason = "tests may stop at the first surprise")]
mod tests {
    use std::os::unix::fs::PermissionsExt as _;

    use super::*;
    use crate::files::scratch::Scratch;

    /// Stands for Verilator: makes a program that says which build it is of.
    const IMITATION: &str = r##"#!/bin/sh
if [ "$1" = --version ]; then echo 'Verilator 5.0'; exit 0; fi
while [ $# -gt 0 ]; do if [ "$1" = --Mdir ]; then folder=$2; fi; shift; done
mkdir -p "$folder"
echo x >> "$0.builds"
echo "#!/bin/sh" > "$folder/../block"
chmod 775 "$folder/../block"
"##;

    fn mode(path: &Path, mode: u32) {
        std::fs::set_permissions(path, std::fs::Permissions::from_mode(mode)).unwrap();
    }

    #[test]
    fn a_program_that_was_changed_is_built_again_and_one_that_others_could_change_is_not_run() {
        let scratch = Scratch::new();
        let imitation = scratch.path().join("verilator");
        std::fs::write(&imitation, IMITATION).unwrap();
        mode(&imitation, 0o700);
        let verilator = imitation.to_str().unwrap();
        let build = Build { verilator, top: "top", sources: vec![], harness: "", header: "", flags: &[] };
        let builds = || std::fs::read(imitation.with_extension("builds")).unwrap().len() / 2;
        let base = scratch.path().join("programs");
        let program = build.program(&base).unwrap();
        assert_eq!((build.program(&base).unwrap(), builds()), (program.clone(), 1), "built once");
        let good = std::fs::read(&program).unwrap();
        let checksum = program.with_file_name(CHECKSUM);
        let mut tried = 0;
        for deed in [|| (PROGRAM, b"#!/bin/sh\nexit 1".to_vec()), || (CHECKSUM, b"0".to_vec()), || (CHECKSUM, vec![])] {
            let (name, bytes) = deed();
            std::fs::write(program.with_file_name(name), bytes).unwrap();
            assert_eq!(std::fs::read(build.program(&base).unwrap()).unwrap(), good);
            tried += 1;
            assert_eq!(builds(), 1 + tried);
        }
        std::fs::remove_file(&checksum).unwrap();
        build.program(&base).unwrap();
        mode(&program, 0o777);
        build.program(&base).unwrap();
        assert_eq!(builds(), 3 + tried, "without a checksum, or writable by others, it is built again");
        assert_eq!(std::fs::read_dir(&base).unwrap().count(), 1, "nothing is left beside it");
        // Whatever stands in a folder that others can write, a whole program with its checksum too, is left where it is.
        mode(&base, 0o777);
        let error = build.program(&base).unwrap_err().to_string();
        assert!(error.contains("can be written by other users"), "{error}");
        assert_eq!((builds(), tried), (6, 3));
    }
}
