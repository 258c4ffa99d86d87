//! `sensel sweep submit`: an array script for Slurm. Each task runs one part of the cells; ids and exit codes alone go over the wire.

use std::path::Path;

use sensel::error::Error;

use super::loaded::{Loaded, name_of};
use crate::cli::args::{CommonOptions, SweepSubmitArguments};

/// Most tasks of an array: Slurm's own limit is 1,001 unless its site raised it.
const SHARDS_MAX: u32 = 10_000;

pub fn main(own: &SweepSubmitArguments, loaded: &Loaded, shared: &CommonOptions) -> Result<(), Error> {
    let cells = loaded.cells.cells.len();
    let shards = own.shards;
    if shards == 0 || shards > SHARDS_MAX {
        return Err(Error::key("--shards", shards, format!("out of range; use 1 to {SHARDS_MAX}")));
    }
    if own.cpus == 0 {
        return Err(Error::key("--cpus", own.cpus, "a task needs at least one processor"));
    }
    let shards = shards.min(sensel::num::u32_from(cells));
    let program = std::env::current_exe().map_err(|source| Error::Io { path: "this program".to_owned(), source })?;
    let folder = std::env::current_dir().map_err(|source| Error::Io { path: ".".to_owned(), source })?;
    let mut options = String::new();
    let mut add = |option: &str, value: &str| options.push_str(&format!(" {option} {}", quoted(value)));
    add("--out", &loaded.target.display().to_string());
    for (option, value) in [("--cache", &shared.cache), ("--scenes", &shared.scenes)] {
        if let Some(value) = value {
            add(option, &value.display().to_string());
        }
    }
    for set in &shared.set {
        add("--set", set);
    }
    if let Some(seed) = shared.seed {
        add("--seed", &seed.to_string());
    }
    add("--photons-gib", &shared.photons_gib.to_string());
    outln!("#!/bin/bash");
    outln!(
        "# {cells} cells in {shards} parts. Submit with: sbatch SCRIPT. A part that is run again goes on where it stopped."
    );
    let (file, target) = (quoted(&shown(&loaded.file)), quoted(&shown(&loaded.target)));
    outln!("# When all tasks have ended: sensel sweep gather {file} --out {target}");
    outln!("#SBATCH --job-name={}", job_name(&name_of(&loaded.file)));
    outln!("#SBATCH --array=1-{shards}");
    outln!("#SBATCH --cpus-per-task={}", own.cpus);
    outln!("#SBATCH --requeue");
    outln!("set -u");
    outln!("cd {}", quoted(&shown(&folder)));
    outln!(
        "exec {} sweep run {}{options} --threads \"${{SLURM_CPUS_PER_TASK:-{}}}\" --shard \"${{SLURM_ARRAY_TASK_ID}}/{shards}\"",
        quoted(&shown(&program)),
        file,
        own.cpus
    );
    Ok(())
}

fn shown(path: &Path) -> String {
    path.display().to_string()
}

/// For bash, on one line: a comment of the script repeats words.
fn quoted(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        text.to_owned()
    } else if text.chars().any(char::is_control) {
        let escaped = |c: char| match c {
            '\'' | '\\' => format!("\\{c}"),
            c if c.is_control() => format!("\\u{:04x}", u32::from(c)),
            c => c.to_string(),
        };
        format!("$'{}'", text.chars().map(escaped).collect::<String>())
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

fn job_name(name: &str) -> String {
    name.chars().map(|c| if c.is_ascii_alphanumeric() || c == '-' { c } else { '_' }).collect()
}

#[cfg(test)]
mod tests {
    use super::quoted;

    #[test]
    fn words_reach_a_shell_as_they_are() {
        assert_eq!(quoted("out/a-1.toml"), "out/a-1.toml");
        assert_eq!(quoted("a\ntouch 'b' #.toml"), "$'a\\u000atouch \\'b\\' #.toml'");
        assert_eq!(quoted("it's here"), "'it'\\''s here'");
        assert_eq!(quoted(""), "''");
    }
}
