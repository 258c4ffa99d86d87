//! A sweep that is killed at any point and run again ends as if nothing had happened.

use std::path::Path;
use std::time::Duration;

use rand::RngExt;
use sensel::draw::DrawKey;

use super::{SweepTest, ended, started};
#[cfg(unix)]
use crate::common::ignores_interrupts;
use crate::common::{cases, names};

/// Cells and kills: the full number with `SENSEL_ALL_CASES`, which takes minutes.
fn size() -> (usize, usize) {
    cases((500, 20), (60, 6))
}

fn sweep(cells: usize) -> String {
    format!(
        "scenario = \"box\"\nseeds = {}\n[set]\n\"run.frames\" = 3\n\"run.samples_per_pixel\" = 1\n\"sensor.width\" = 64\n\
         \"sensor.height\" = 48\n\"sensor.adc.reset_counts\" = 64\n[[factor]]\nname = \"bits\"\nkey = \"sensor.adc.bits\"\n\
         values = [1, 2, 4, 6, 8]\n",
        cells / 5
    )
}

/// Cells whose records are there.
fn finished_in(folder: &Path) -> usize {
    let Ok(entries) = std::fs::read_dir(folder) else { return 0 };
    let inside = entries.map(|entry| names(&entry.unwrap().path()));
    inside.flatten().filter(|name| name.ends_with(".json")).count()
}

#[test]
fn a_killed_sweep_goes_on_and_its_table_is_byte_identical() {
    let (cells, kills) = size();
    let test = SweepTest::new("kill", &sweep(cells));
    test.done("run", "whole", &["--quiet"]);
    let whole = test.gathered("whole");
    let mut stream = DrawKey::root(25).stream();
    let mut finished = Vec::new();
    let folder = test.scratch.path().join("killed/cells");
    for kill in 0..kills {
        let before = finished_in(&folder);
        let mut child = started(&test, "run", "killed", &["--threads", if kill % 2 == 0 { "1" } else { "2" }]);
        // From before the first cell to some way in: after so many cells more, and some milliseconds into the next one.
        let more = stream.random_range(0..=cells / kills);
        while finished_in(&folder) < before + more && child.try_wait().unwrap().is_none() {
            std::thread::sleep(Duration::from_millis(2));
        }
        std::thread::sleep(Duration::from_millis(stream.random_range(0..30)));
        let _ = child.kill();
        child.wait().unwrap();
        finished.push(finished_in(&folder));
        println!("kill {kill}: {} cells", finished[finished.len() - 1]);
    }
    assert!(finished[kills - 1] > 0, "no kill fell into the middle of the run: {finished:?}");
    assert!(finished.windows(2).all(|pair| pair[0] <= pair[1]), "a finished cell was lost: {finished:?}");
    let last = ended(&test, "run", "killed", &["--json"]);
    assert_eq!(last.code, 0, "{}", last.stderr);
    assert!(!last.stderr.contains("damaged"), "no cell is torn: {}", last.stderr);
    assert!(test.gathered("killed") == whole);
    let left = names(&test.scratch.path().join("killed"));
    assert!(left.iter().all(|name| !name.ends_with(".part")), "{left:?}");
}

#[cfg(unix)]
#[test]
fn an_interrupt_keeps_finished_cells_and_ends_with_130() {
    let test = SweepTest::new("interrupt", &sweep(60));
    let mut child = started(&test, "run", "out", &["--threads", "1"]);
    let folder = test.scratch.path().join("out/cells");
    // Until the first cell is there; the test's own limit ends it otherwise.
    while std::fs::read_dir(&folder).is_ok_and(|mut entries| entries.next().is_none()) || !folder.exists() {
        std::thread::sleep(Duration::from_millis(10));
    }
    let id = i32::try_from(child.id()).unwrap();
    use rustix::process::Signal;
    let signal = if ignores_interrupts() { Signal::TERM } else { Signal::INT };
    rustix::process::kill_process(rustix::process::Pid::from_raw(id).unwrap(), signal).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(130));
    let again = ended(&test, "run", "out", &["--json"]).json();
    let run = again["run"].as_u64().unwrap();
    assert!(run < 60, "{run} of 60 ran again");
}

/// As `nohup` starts a program: a terminal that closes does not end it.
#[cfg(unix)]
#[test]
fn a_hang_up_that_was_ignored_at_the_start_stays_ignored() {
    let test = SweepTest::new("nohup", &sweep(30));
    let (file, out, cache) = (test.scratch.join("sweep.toml"), test.scratch.join("out"), test.scratch.join("cache"));
    let mut ignoring = std::process::Command::new("sh");
    ignoring.args(["-c", "trap '' HUP; exec \"$0\" \"$@\"", env!("CARGO_BIN_EXE_sensel"), "sweep", "run", &file]);
    ignoring.args(["--out", &out, "--cache", &cache, "--threads", "1", "--quiet"]);
    let mut child = ignoring.spawn().unwrap();
    let folder = test.scratch.path().join("out/cells");
    while finished_in(&folder) == 0 && child.try_wait().unwrap().is_none() {
        std::thread::sleep(Duration::from_millis(5));
    }
    let id = rustix::process::Pid::from_raw(i32::try_from(child.id()).unwrap()).unwrap();
    assert!(child.try_wait().unwrap().is_none(), "it ended before its signal");
    rustix::process::kill_process(id, rustix::process::Signal::HUP).unwrap();
    assert_eq!(child.wait().unwrap().code(), Some(0));
    assert_eq!(finished_in(&folder), 30);
}
