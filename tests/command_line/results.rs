//! What a user has on the disk: results that are replaced, files that are read and written, and a program that is stopped.

use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Stdio};

#[cfg(unix)]
use crate::common::ignores_interrupts;
use crate::common::{Outcome, Scratch, names, outcome, sensel, sensel_command};

/// A run of a tiny box into `out`.
pub fn tiny(out: &str, more: &[&str]) -> Vec<String> {
    let words = ["run", "box", "--frames", "1", "--quiet", "--threads", "1", "--set", "sensor.width=64"];
    let more = [&["--set", "sensor.height=48", "--out", out], more].concat();
    words.iter().chain(&more).map(|&word| word.to_owned()).collect()
}

/// All that lies under a folder: names with contents, and folders.
pub fn everything(folder: &Path) -> Vec<(PathBuf, Option<Vec<u8>>)> {
    let mut found = Vec::new();
    for name in names(folder) {
        let path = folder.join(name);
        if path.is_dir() {
            found.push((path.clone(), None));
            found.extend(everything(&path));
        } else {
            let bytes = fs::read(&path).unwrap();
            found.push((path, Some(bytes)));
        }
    }
    found
}

#[test]
fn a_result_is_replaced_wherever_its_folder_is_named_from() {
    let scratch = Scratch::new("again");
    let whole = scratch.join("whole");
    for out in ["new", "./other", "deep/in", "deep/../beside", &whole] {
        for _ in 0..2 {
            let mut command = sensel_command(&tiny(out, &["--scenes", concat!(env!("CARGO_MANIFEST_DIR"), "/scenes")]));
            command.current_dir(scratch.path());
            let outcome = outcome(command);
            assert_eq!(outcome.code, 0, "{out}: {outcome:?}");
        }
    }
}

#[test]
fn a_result_with_a_file_of_the_user_s_is_refused_by_its_name_and_stays_as_it_is() {
    let scratch = Scratch::new("notes");
    let run = || sensel(&tiny(&scratch.join("out"), &["--rung", "expected"]));
    assert_eq!(run().code, 0);
    for (file, text) in [("notes.txt", "mine"), ("expected/cam0/notes.txt", "mine"), ("config.toml", "# mine")] {
        let path = scratch.path().join("out").join(file);
        let own = fs::read(&path).ok();
        fs::write(&path, text).unwrap();
        let before = everything(scratch.path());
        let Outcome { code, stderr, .. } = run();
        assert!(code == 2 && stderr.contains(file) && stderr.lines().count() == 1, "{file}: {code} {stderr}");
        assert_eq!(everything(scratch.path()), before, "{file}");
        own.map_or_else(|| fs::remove_file(&path), |own| fs::write(&path, own)).unwrap();
    }
    assert_eq!(run().code, 0, "once they are gone, the result is replaced");
    // A mark alone makes no result.
    let theirs = scratch.path().join("theirs");
    fs::create_dir(&theirs).unwrap();
    fs::write(theirs.join(".sensel"), "sensel 0.1.0\n").unwrap();
    fs::write(theirs.join("thesis.tex"), "mine").unwrap();
    for verb in ["run", "characterize", "ladder"] {
        let outcome = sensel(&[verb, "box", "--out", &scratch.join("theirs")]);
        assert!(outcome.code == 2 && outcome.stderr.contains(".sensel"), "{verb}: {outcome:?}");
    }
    assert_eq!(names(&theirs), [".sensel", "thesis.tex"]);
    assert_eq!(scratch.names(), ["out", "theirs"]);
}

#[test]
fn waves_inside_the_result_folder_are_part_of_the_result() {
    let scratch = Scratch::new("waves-inside");
    let waves = scratch.join("out/waves/first.vcd");
    for _ in 0..2 {
        let outcome = sensel(&tiny(&scratch.join("out"), &["--waves", &waves]));
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        assert!(Path::new(&waves).is_file());
    }
    assert_eq!(sensel(&tiny(&scratch.join("out"), &[])).code, 0);
    assert!(!Path::new(&waves).exists());
    // Without a wish a run draws its middle row and links the picture.
    let page = std::fs::read_to_string(scratch.join("out/report.html")).unwrap();
    assert!(Path::new(&scratch.join("out/waves.svg")).is_file() && page.contains("href=\"waves.svg\""));
    assert_eq!(scratch.names(), ["out"]);
}

#[cfg(unix)]
#[test]
fn a_run_into_the_current_folder_leaves_the_shell_where_it_is() {
    use std::os::unix::fs::MetadataExt as _;
    let scratch = Scratch::new("here");
    let folder = scratch.path().join("place");
    fs::create_dir(&folder).unwrap();
    let inode = fs::metadata(&folder).unwrap().ino();
    for _ in 0..2 {
        for out in [".", "../place", &folder.display().to_string()] {
            let mut command = sensel_command(&tiny(out, &["--rung", "expected"]));
            command.current_dir(&folder);
            let outcome = outcome(command);
            assert_eq!((outcome.code, outcome.stderr.as_str()), (0, ""));
            assert_eq!(fs::metadata(&folder).unwrap().ino(), inode);
            assert_eq!(names(&folder), [".sensel", "config.toml", "expected", "expected.json"]);
            assert_eq!(scratch.names(), ["place"]);
        }
    }
}

/// A picture with a corner or two.
fn picture(path: &Path) {
    let grey = image::GrayImage::from_fn(64, 64, |x, y| image::Luma([if x > 20 && y > 30 { 200 } else { 40 }]));
    grey.save(path).unwrap();
}

/// A bright quarter whose corner is brighter still.
#[test]
fn a_pixel_says_what_became_of_its_corner() {
    let folder = Scratch::new("fates");
    let file = folder.join("x.png");
    let quarter = |x: u32, y: u32| if x.min(y) < 24 { 50 } else { 200 + 10 * u8::from((x, y) == (24, 24)) };
    image::GrayImage::from_fn(48, 48, |x, y| image::Luma([quarter(x, y)])).save(&file).unwrap();
    for (at, said) in [
        ("24,24", "octave 0 (24, 24): a corner of score 159: feature 0 of the list, from 0\n"),
        ("25,24", "octave 0 (25, 24): suppressed: its arc difference is 150, that of (24, 24) beside it 160\n"),
        ("3, 3", "octave 0 (3, 3): no corner: its arc difference of 0 is not above the threshold of 20\n"),
        ("2,9", "octave 0 (2, 9): no corner: it is within 3 pixels of the edge\n"),
    ] {
        let outcome = sensel(&["features", &file, "--at", at]);
        assert_eq!((outcome.code, outcome.stdout.as_str()), (0, said), "{outcome:?}");
    }
    let outcome = sensel(&["features", &file, "--at", "24,24", "--json"]);
    let read: serde_json::Value = serde_json::from_str(&outcome.stdout).unwrap();
    let octave =
        serde_json::json!({"octave": 0, "x_px": 24, "y_px": 24, "arc_difference": 160, "fate": "feature", "number": 0});
    assert_eq!(
        read,
        serde_json::json!({"bits": 8, "full_scale": null, "threshold": 20, "pipeline_bits": 8, "octaves": [octave]})
    );
    for (at, said) in [("48,3", "use 0,0 to 47,47"), ("3", "as in 120,80"), ("-1,3", "")] {
        let outcome = sensel(&["features", &file, "--at", at]);
        assert!(outcome.code == 2 && outcome.stderr.contains(said), "{at}: {outcome:?}");
    }
}

#[cfg(unix)]
#[test]
fn no_output_takes_the_place_of_an_input() {
    let scratch = Scratch::new("inputs");
    let input = scratch.path().join("x.png");
    picture(&input);
    fs::hard_link(&input, scratch.path().join("hard.png")).unwrap();
    std::os::unix::fs::symlink("x.png", scratch.path().join("soft.png")).unwrap();
    let before = fs::read(&input).unwrap();
    let mut tried = 0;
    for option in ["--csv", "--draw", "--out"] {
        for name in ["x.png", "hard.png", "soft.png", "./x.png"] {
            let name = scratch.join(name);
            let outcome = sensel(&["features", &scratch.join("x.png"), option, &name]);
            assert_eq!(outcome.code, 2, "{option} {name}: {outcome:?}");
            assert!(
                ["is a file that this command reads", "--csv writes CSV", "--out writes CSV"]
                    .iter()
                    .any(|words| outcome.stderr.contains(words)),
                "{}",
                outcome.stderr
            );
            assert_eq!(fs::read(&input).unwrap(), before);
            tried += 1;
        }
    }
    assert_eq!(tried, 12);
    let same = scratch.join("same");
    let outcome = sensel(&["features", &scratch.join("x.png"), "--csv", &same, "--draw", &same]);
    assert!(outcome.code == 2 && outcome.stderr.contains("is the file of --csv too"), "{outcome:?}");
    let outcome = sensel(&["features", &scratch.join("x.png"), "--csv", &scratch.join("x.csv"), "--out", "/dev/null"]);
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    // Scenario files are inputs too.
    let scene = scratch.path().join("scene.svg");
    fs::write(&scene, "[sensor]\npreset = \"paper_6t_vga\"\n").unwrap();
    let outcome = sensel(&["timing", &scratch.join("scene.svg"), "--svg", &scratch.join("scene.svg")]);
    assert!(outcome.code == 2 && fs::read_to_string(&scene).unwrap().starts_with("[sensor]"), "{outcome:?}");
    assert_eq!(scratch.names(), ["hard.png", "scene.svg", "soft.png", "x.csv", "x.png"]);
}

#[test]
fn a_trajectory_takes_the_place_of_none_of_the_recording_s_files() {
    let scratch = Scratch::new("recording");
    let out = scratch.join("out");
    assert_eq!(sensel(&tiny(&out, &["--keep", "packets"])).code, 0);
    let before = everything(scratch.path());
    let files: Vec<PathBuf> =
        before.iter().filter(|(_, bytes)| bytes.is_some()).map(|(path, _)| path.clone()).collect();
    let mut tried = 0;
    for file in &files {
        let name = file.strip_prefix(&out).unwrap().display().to_string();
        let is_read = name.contains("mav0/") || name.ends_with(".csi2") || name == "config.toml";
        if !is_read {
            continue;
        }
        for option in ["--out", "--map"] {
            let file = file.display().to_string();
            let other = scratch.join("other.tum");
            let mut words = vec!["track", &out, option, &file];
            words.extend(if option == "--map" { vec!["--out", other.as_str()] } else { vec![] });
            let outcome = sensel(&words);
            assert_eq!(outcome.code, 2, "{option} {name}: {outcome:?}");
            tried += 1;
        }
    }
    assert!(tried > 10, "{tried}");
    assert_eq!(everything(scratch.path()), before);
}

#[cfg(unix)]
fn fifo(path: &Path) {
    assert!(Command::new("mkfifo").arg(path).status().unwrap().success());
}

/// Each of these waited for ever, or read until the memory was full.
#[cfg(unix)]
#[test]
fn pipes_and_devices_are_refused_wherever_a_file_is_read() {
    let scratch = Scratch::new("pipes");
    let (pipe, at) = (scratch.path().join("pipe"), |name: &str| scratch.path().join(name));
    fifo(&pipe);
    let pipe = pipe.display().to_string();
    fs::create_dir_all(at("scene")).unwrap();
    fifo(&at("scene/scene.toml"));
    fs::create_dir_all(at("named")).unwrap();
    fs::write(at("named/scene.toml"), "[scene]\nfile = \"room.glb\"\n").unwrap();
    fifo(&at("named/room.glb"));
    fs::create_dir_all(at("moved")).unwrap();
    fs::write(at("moved/scene.toml"), "[scene]\ngenerator = \"box\"\n[motion]\nfile = \"path.tum\"\n").unwrap();
    std::os::unix::fs::symlink("/dev/zero", at("moved/path.tum")).unwrap();
    fs::create_dir_all(at("euroc/mav0/cam0")).unwrap();
    fifo(&at("euroc/mav0/cam0/sensor.yaml"));
    fs::create_dir_all(at("tum")).unwrap();
    fifo(&at("tum/rgb.txt"));
    let out = scratch.join("out");
    let mut tried = 0;
    for (words, said) in [
        (vec!["run", &pipe], "pipe"),
        (vec!["run", "/dev/zero"], "device"),
        (vec!["run", "/dev/stdin"], "pipe"),
        (vec!["run", &scratch.join("scene")], "pipe"),
        (vec!["run", &scratch.join("named")], "pipe"),
        // It leads out of the scene's folder as well, which is found first.
        (vec!["run", &scratch.join("moved")], "leads out"),
        (vec!["timing", &pipe], "pipe"),
        (vec!["features", &pipe], "pipe"),
        (vec!["features", "/dev/zero"], "device"),
        (vec!["features", "/dev/stdin"], "pipe"),
        (vec!["track", &scratch.join("euroc")], "pipe"),
        (vec!["track", &scratch.join("tum")], "pipe"),
    ] {
        let mut command = sensel_command(&[&words[..], &["--out", &out]].concat());
        // An input that stays open and never says a word.
        command.stdin(Stdio::piped()).stdout(Stdio::piped()).stderr(Stdio::piped());
        let mut child = command.spawn().unwrap();
        let held = child.stdin.take();
        let output = child.wait_with_output().unwrap();
        drop(held);
        let stderr = String::from_utf8(output.stderr).unwrap();
        assert!(output.status.code() == Some(2) && stderr.contains(said), "{words:?}: {stderr}");
        tried += 1;
    }
    assert_eq!(tried, 12);
    assert!(!Path::new(&out).exists());
}

/// How many files lie under a folder that a program is writing to: what is gone between two looks does not count.
#[cfg(unix)]
fn files_under(folder: &Path) -> usize {
    let entries = fs::read_dir(folder).into_iter().flatten().flatten();
    entries.map(|entry| if entry.path().is_dir() { files_under(&entry.path()) } else { 1 }).sum()
}

/// A run that has begun to write, and how to stop it.
fn stopped(words: &[String], scratch: &Scratch, signal: &str) -> Option<i32> {
    let mut command = sensel_command(words);
    command.stdout(Stdio::null()).stderr(Stdio::null());
    let mut child: Child = command.spawn().unwrap();
    // Written files say that frames are under way.
    while files_under(scratch.path()) < 4 {
        assert!(child.try_wait().unwrap().is_none(), "it ended before it was stopped");
        std::thread::yield_now();
    }
    let sent = Command::new("kill").args([signal, &child.id().to_string()]).status().unwrap();
    assert!(sent.success());
    child.wait().unwrap().code()
}

#[cfg(unix)]
#[test]
fn every_rung_ends_by_a_signal_and_leaves_nothing() {
    for rung in ["expected", "sampled"] {
        for signal in ["-INT", "-TERM"] {
            if signal == "-INT" && ignores_interrupts() {
                println!("SIGINT is ignored here, and stays so");
                continue;
            }
            let scratch = Scratch::new("stopped");
            let mut words = tiny(&scratch.join("out"), &["--rung", rung]);
            // Far more frames than can be ready by then.
            let frames = words.iter().position(|word| word == "1").unwrap();
            words[frames] = "500".to_owned();
            assert_eq!(stopped(&words, &scratch, signal), Some(130), "{rung} {signal}");
            assert!(scratch.names().is_empty(), "{rung} {signal} left {:?}", scratch.names());
        }
    }
}

#[test]
fn a_run_that_was_killed_is_cleared_by_the_next() {
    let scratch = Scratch::new("killed");
    let mut words = tiny(&scratch.join("out"), &["--rung", "expected"]);
    words[3] = "500".to_owned();
    assert_eq!(stopped(&words, &scratch, "-KILL"), None);
    assert!(scratch.names().iter().any(|name| name.starts_with(".out.building-")));
    assert_eq!(sensel(&tiny(&scratch.join("out"), &["--rung", "expected"])).code, 0);
    assert_eq!(scratch.names(), ["out"]);
}
