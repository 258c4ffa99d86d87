//! The program killed at every system call that changes the disk, under strace; and folders that are full, mounted or read-only.

use std::collections::BTreeMap;
use std::fs;
use std::path::Path;
use std::process::{Command, Stdio};

use super::results::everything;
use crate::common::{Scratch, cases, names, sensel, sensel_command};

/// Everything that changes what stands on the disk, or makes it last.
const CALLS: &[&str] = &[
    "mkdir",
    "rename",
    "renameat2",
    "unlink",
    "unlinkat",
    "rmdir",
    "fsync",
    "flock",
    "chmod",
    "fchmodat",
    "chown",
    "ftruncate",
];

/// Calls after which a process of a test would have been killed more often than any run makes them.
const MOST: u32 = 500;

/// A run of a grey wall into `out`: what is killed is the writing, so the picture is as cheap as one can be.
fn flat(out: &str, more: &[&str]) -> Vec<String> {
    let words = ["run", "flat", "--frames", "1", "--quiet", "--threads", "1", "--rung", "expected", "--out", out];
    let size = ["--set", "sensor.width=32", "--set", "sensor.height=24"];
    [&words[..], &size, more].concat().iter().map(|&word| word.to_owned()).collect()
}

/// Runs into `target` and is killed at the `when`th `call`; whether it was.
fn killed(out: &str, folder: &Path, (call, when): (&str, u32)) -> bool {
    let own = sensel_command(&flat(out, &["--seed", "2"]));
    let mut strace = Command::new("strace");
    strace.args(["-f", "-qqq", "-o", "/dev/null", "-e", &format!("trace={call}")]);
    strace.args(["-e", &format!("inject={call}:signal=SIGKILL:when={when}")]);
    strace.arg(own.get_program()).args(own.get_args()).current_dir(folder);
    strace.env("SENSEL_SCENES", concat!(env!("CARGO_MANIFEST_DIR"), "/scenes"));
    let status =
        strace.stdout(Stdio::null()).stderr(Stdio::null()).status().expect("strace; ./check --install brings it");
    !status.success()
}

/// Files of a result without the list's own.
fn result(folder: &Path) -> BTreeMap<String, Vec<u8>> {
    let files = everything(folder).into_iter().filter_map(|(path, bytes)| Some((path, bytes?)));
    let named = files.map(|(path, bytes)| (path.strip_prefix(folder).unwrap().display().to_string(), bytes));
    named.filter(|(name, _)| !name.starts_with('.')).collect()
}

#[test]
fn a_run_that_is_killed_at_any_system_call_leaves_the_old_or_the_new_result_and_the_next_is_whole() {
    let scratch = Scratch::new("reference");
    let reference = |name: &str, seed: &str| {
        assert_eq!(sensel(&flat(&scratch.join(name), &["--seed", seed])).code, 0);
        result(&scratch.path().join(name))
    };
    let (old, new) = (reference("old", "1"), reference("new", "2"));
    assert_ne!(old, new);
    let mut kills = 0;
    for (earlier, out) in [("absent", "out"), ("old", "out"), ("old", ".")] {
        let mut calls_hit = 0;
        for call in CALLS {
            // Each day every second call of a kind.
            for when in (1..MOST).step_by(cases(1, 2)) {
                let scratch = Scratch::new("kills");
                let target = scratch.path().join("out");
                if earlier == "old" {
                    let outcome = sensel(&flat(&scratch.join("out"), &["--seed", "1"]));
                    assert_eq!(outcome.code, 0, "{outcome:?}");
                }
                let folder = if out == "." { target.as_path() } else { scratch.path() };
                let was_killed = killed(out, folder, (call, when));
                let found = if target.exists() { Some(result(&target)) } else { None };
                let case = format!("{earlier}, --out {out}, {call} {when}");
                let is_old = found.as_ref() == (earlier == "old").then_some(&old);
                // A folder that stays is between the two until the next run.
                assert!(
                    is_old || found.as_ref() == Some(&new) || (out == "." && was_killed),
                    "{case}: {:?}",
                    names(folder)
                );
                assert!(was_killed || found.as_ref() == Some(&new), "{case}");
                // What the killed run was about to replace is not read by the next one, which only has to find it repairable.
                let next = sensel(&flat(&target.display().to_string(), &["--seed", "2"]));
                assert_eq!((next.code, next.stderr.as_str()), (0, ""), "{case}");
                assert_eq!(result(&target), new, "{case}");
                assert_eq!(scratch.names(), ["out"], "{case}");
                assert!(names(&target).iter().all(|name| name != ".sensel-work"), "{case}");
                kills += u32::from(was_killed);
                calls_hit += u32::from(was_killed && when == 1);
                if !was_killed {
                    break;
                }
            }
        }
        assert!(calls_hit >= 5, "{earlier} {out}: only {calls_hit} calls were hit");
    }
    assert!(kills > cases(60, 30), "{kills}");
}

/// Runs a script of the shell where mounts are its own; none where the user may not.
fn in_own_mounts(script: &str) -> Option<String> {
    let may = Command::new("unshare").args(["-m", "true"]).status().is_ok_and(|status| status.success());
    if !may {
        return None;
    }
    let output = Command::new("unshare").args(["-m", "bash", "-euc", script]).output().unwrap();
    let said = String::from_utf8_lossy(&output.stdout).into_owned() + &String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    Some(said)
}

fn words(out: &Path) -> String {
    let command = sensel_command(&flat(&out.display().to_string(), &[]));
    let words = command.get_args().map(|word| format!("'{}'", word.to_str().unwrap()));
    let program = [env!("CARGO_BIN_EXE_sensel").to_owned()];
    program.into_iter().chain(words).collect::<Vec<_>>().join(" ")
}

#[test]
fn a_mount_point_takes_a_result_and_its_successor_and_a_full_or_read_only_disk_loses_nothing() {
    let scratch = Scratch::new("mounts");
    let at = |name: &str| scratch.path().join(name);
    for name in ["volume", "bound", "source", "small", "locked"] {
        fs::create_dir(at(name)).unwrap();
    }
    let run = |name: &str| words(&at(name));
    let base = scratch.path().display();
    let script = format!(
        r#"
cd {root}
whole() {{ test "$(ls -A "$1" | tr '\n' ' ')" = ".sensel config.toml expected expected.json "; }}
mount -t tmpfs -o size=64m none {base}/volume
{volume} ; whole {base}/volume
{volume} ; whole {base}/volume
echo mine > {base}/volume/notes.txt
if {volume} ; then exit 10; fi
test "$(cat {base}/volume/notes.txt)" = mine
rm {base}/volume/notes.txt
mount --bind {base}/source {base}/bound
{bound} ; whole {base}/bound
{bound} ; whole {base}/bound
mount -t tmpfs -o size=300k none {base}/small
{small} ; whole {base}/small/out
sha256sum {base}/small/out/*.json {base}/small/out/expected/*/* > {base}/sums
dd if=/dev/zero of={base}/small/filler bs=1k 2> {base}/dd || true
if {small} ; then exit 11; fi
sha256sum --quiet -c {base}/sums
test "$(ls -A {base}/small | tr '\n' ' ')" = "filler out "
rm {base}/small/filler
{small} ; whole {base}/small/out
{locked} ; whole {base}/locked
mount --bind {base}/locked {base}/locked
mount -o remount,ro,bind {base}/locked
if {locked} ; then exit 12; fi
whole {base}/locked
echo done
"#,
        root = env!("CARGO_MANIFEST_DIR"),
        volume = run("volume"),
        bound = run("bound"),
        small = run("small/out"),
        locked = run("locked"),
    );
    let said = in_own_mounts(&script);
    assert!(said.as_deref().is_none_or(|said| said.contains("done")), "{said:?}");
}
