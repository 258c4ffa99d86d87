//! Sweeps on disks that are full, small or read-only: the message says so, and finished cells are kept.
#![cfg(target_os = "linux")]

use std::process::{Command, Stdio};

use super::{SMALL, SweepTest};

/// A script of bash in which `run` is `sensel sweep run` into the folder `$disk/out`; `prefix` starts it: code, output, errors.
fn in_bash(test: &SweepTest, prefix: &[&str], script: &str) -> (i32, String, String) {
    let words =
        test.arguments("run", "disk/out", &["--cache", &test.scratch.join("cache"), "--threads", "1", "--quiet"]);
    let quoted: Vec<String> = words.iter().map(|word| format!("'{word}'")).collect();
    let disk = test.scratch.join("disk");
    std::fs::create_dir_all(&disk).unwrap();
    let program = env!("CARGO_BIN_EXE_sensel");
    let script = format!("run() {{ '{program}' {}; }}\ndisk='{disk}'\n{script}", quoted.join(" "));
    let all = [prefix, &["bash", "-c", &script]].concat();
    let output = Command::new(all[0]).args(&all[1..]).stdin(Stdio::null()).output().unwrap();
    let text = |bytes: &[u8]| String::from_utf8_lossy(bytes).into_owned();
    (output.status.code().unwrap_or(-1), text(&output.stdout), text(&output.stderr))
}

/// Whether this process may mount a file system that only it sees.
fn can_mount() -> bool {
    let mut command = Command::new("unshare");
    command.args(["--mount", "mount", "-t", "tmpfs", "none", "/mnt"]).stdout(Stdio::null()).stderr(Stdio::null());
    command.status().is_ok_and(|status| status.success())
}

#[test]
fn a_file_that_may_not_grow_ends_the_sweep_with_4_and_its_name() {
    let test = SweepTest::new("file-limit", SMALL);
    // Files of 2 KiB at most: neither a record of a cell nor photons fit. A signal that is ignored becomes an error of the write.
    let (code, _, said) = in_bash(&test, &[], "trap '' XFSZ; ulimit -f 2; run");
    assert_eq!(code, 4, "{said}");
    assert!(said.contains("photons are not stored") && said.contains(".json"), "{said}");
    let (code, _, said) = in_bash(&test, &[], "run");
    assert_eq!(code, 0, "{said}");
    assert!(!said.contains("damaged"), "no torn file was left: {said}");
}

#[test]
fn a_full_disk_keeps_finished_cells_and_the_sweep_goes_on_when_there_is_room() {
    if !can_mount() {
        println!("no file system can be mounted here; a_file_that_may_not_grow covers the refused write");
        return;
    }
    let test = SweepTest::new("full-disk", &SMALL.replace("seeds = 2", "seeds = 10"));
    let script = "mount -t tmpfs -o size=100k none $disk; run; echo code $?; ls $disk/out/cells/* | grep -c json; \
                  mount -o remount,size=50m $disk; run; echo code $?; ls $disk/out/cells/* | grep -c json; ls -A $disk/out";
    let (_, told, said) = in_bash(&test, &["unshare", "--mount"], script);
    let lines: Vec<&str> = told.lines().collect();
    assert_eq!((lines[0], lines[2], lines[3]), ("code 4", "code 0", "40"), "{told}{said}");
    let kept: u32 = lines[1].parse().unwrap();
    assert!((1..40).contains(&kept), "the disk was full in mid-sweep: {told}");
    assert!(said.contains("No space left"), "{said}");
    assert!(lines[4..].iter().all(|name| !name.ends_with(".part")), "{told}");
}

#[test]
fn a_read_only_folder_is_refused_with_4() {
    let test = SweepTest::new("read-only", SMALL);
    let is_root = rustix::process::geteuid().is_root();
    if is_root && !can_mount() {
        println!("nothing is read-only for root, and no file system can be mounted here");
        return;
    }
    let (code, _, said) = if is_root {
        in_bash(&test, &["unshare", "--mount"], "mount -t tmpfs -o ro none $disk; run")
    } else {
        in_bash(&test, &[], "chmod 555 $disk; run; code=$?; chmod 755 $disk; exit $code")
    };
    assert_eq!(code, 4, "{said}");
    assert!(said.contains("Read-only") || said.contains("ermission"), "{said}");
}
