//! Builds a Verilog block with Verilator and a C++ harness, once for each content of all that goes in. Enters: file names, flags.
//! Leaves: the path of a program under `target/rtl`.

use std::path::{Path, PathBuf};
use std::process::Command;

/// What a build is made of.
pub struct Build<'a> {
    /// Verilator's program.
    pub verilator: &'a str,
    /// Module at the top.
    pub top: &'a str,
    /// Verilog files, the top's first.
    pub sources: &'a [PathBuf],
    /// The harness, which includes Vblock.h.
    pub harness: &'a Path,
    /// Name and text of a header beside it.
    pub header: (&'a str, &'a str),
    /// Flags of Verilator.
    pub flags: &'a [&'a str],
}

/// First line that a tool says about itself; its absence is a failure.
pub fn version(tool: &str, flag: &str) -> String {
    let output = Command::new(tool)
        .arg(flag)
        .output()
        .unwrap_or_else(|error| panic!("{tool} runs ({error}): ./check --install"));
    assert!(output.status.success(), "{tool} {flag} failed");
    String::from_utf8_lossy(&output.stdout).lines().next().unwrap_or_default().to_owned()
}

impl Build<'_> {
    fn key(&self) -> String {
        let mut hasher = blake3::Hasher::new();
        let mut add = |bytes: &[u8]| {
            hasher.update(&u64::try_from(bytes.len()).unwrap().to_le_bytes());
            hasher.update(bytes);
        };
        add(version(self.verilator, "--version").as_bytes());
        for path in self.sources.iter().map(PathBuf::as_path).chain([self.harness]) {
            add(&std::fs::read(path).unwrap_or_else(|error| panic!("{}: {error}", path.display())));
        }
        add(self.header.1.as_bytes());
        for flag in self.flags {
            add(flag.as_bytes());
        }
        hasher.finalize().to_hex()[..16].to_owned()
    }

    /// The program, built unless it stands there from an earlier run. Warnings of Verilator are errors.
    pub fn program(&self) -> PathBuf {
        let base = Path::new(env!("CARGO_TARGET_TMPDIR")).join("../rtl");
        let name = format!("{}-{}", self.top, self.key());
        let folder = base.join(&name);
        let program = folder.join("block");
        if program.exists() {
            return program;
        }
        let scratch = base.join(format!("{name}.{}", std::process::id()));
        std::fs::create_dir_all(&scratch).unwrap();
        std::fs::write(scratch.join(self.header.0), self.header.1).unwrap();
        let mut command = Command::new(self.verilator);
        command.args(["--cc", "--exe", "--build", "-j", "1", "-Wall", "--prefix", "Vblock", "-o", "../block"]);
        command.args(["--top-module", self.top, "--Mdir"]).arg(scratch.join("obj"));
        command.args(["-CFLAGS", &format!("-I{}", scratch.display())]).args(self.flags);
        command.args(self.sources).arg(self.harness);
        let output = command.output().expect("Verilator was found");
        let text = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{command:?}: {text}{}", String::from_utf8_lossy(&output.stdout));
        std::fs::remove_dir_all(scratch.join("obj")).unwrap();
        // Another run may have been quicker: then its program serves.
        if std::fs::rename(&scratch, &folder).is_err() {
            std::fs::remove_dir_all(&scratch).unwrap();
        }
        program
    }
}
