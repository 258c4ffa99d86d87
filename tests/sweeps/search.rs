//! Searches for designs: better than chance on a known front, the same cells on every engine, refusals in words.
#![cfg(feature = "outside")]

use std::io::Write;
use std::path::Path;
use std::process::{Command, Stdio};

use super::SweepTest;
use super::outside::{had_slurm, judge};
use crate::common::cases;

/// Two figures over three keys of a small room.
const SEARCH: &str = r#"
scenario = "box"
constraints = ["power_mw < 1000", "tracked_fraction >= 0"]
[set]
"run.frames" = 3
"run.samples_per_pixel" = 1
"sensor.width" = 96
"sensor.height" = 72
"run.render_quantum_efficiency" = 0.5
"run.render_full_well_e" = 9000.0
[[factor]]
name = "bits"
key = "sensor.adc.bits"
low = 4
high = 10
whole = true
[[factor]]
name = "read_noise_uv"
key = "sensor.pixel.read_noise_uv"
low = 50.0
high = 800.0
spacing = "log"
[[factor]]
name = "sent"
key = "link.mode"
values = ["features", "both"]
[[objective]]
figure = "power_mw"
[[objective]]
figure = "corners"
goal = "maximise"
[[guess]]
name = "expert"
is = { bits = 8, read_noise_uv = 200.0, sent = "features" }
[search]
cells = 24
batch = 5
start = 6
seeds = 1
seeds_most = 4
[final]
seeds = 2
designs = 2
"#;

#[test]
fn the_parts_of_a_search_keep_closed_forms() {
    let said = judge("search_parts.py", &[]);
    assert_eq!((said["volumes"].as_u64(), said["checks"].as_u64()), (Some(80), Some(17)), "{said}");
}

#[test]
fn a_share_is_judged_from_few_runs_and_gaussian_processes_propose_as_closed_forms_say() {
    let said = judge("search_models.py", &[]);
    assert_eq!(said["checks"].as_u64(), Some(7), "{said}");
}

#[test]
fn a_search_finds_more_of_a_known_front_than_chance() {
    let said = judge("search_front.py", &["tpe", cases("10", "6")]);
    println!("{said}");
    // The mean over the searches, and the lower end of its interval.
    assert!(said["ratio"].as_f64().unwrap() >= 1.2 && said["interval"][0].as_f64().unwrap() > 1.0, "{said}");
    let share = |kind: &str| said["share_of_front"][kind].as_f64().unwrap();
    assert!(share("random") > 0.0 && share("tpe") <= 1.0, "{said}");
}

#[test]
fn a_rung_is_used_only_if_it_ranks_designs_as_full_cells_do_and_the_gain_is_stated() {
    let said = judge("search_rungs.py", &[cases("6", "3")]);
    println!("{said}");
    let rho = |rung: &str| said[rung]["tracking.ate_m"].as_f64().unwrap();
    assert!(rho("short") >= 0.6 && rho("useless") < 0.6, "{said}");
    assert!(said["left_out_by_short"].as_u64().unwrap() > 5, "a rung in use leaves proposals out: {said}");
    assert_eq!(said["left_out_by_useless"], 0, "{said}");
    assert_eq!(said["files_of_useless"], serde_json::json!(["000-rung0.toml"]), "measured once, then left out: {said}");
    // At equal cost a rung neither gains nor loses much here (docs/search.md).
    assert!((0.8..1.25).contains(&said["ratio"].as_f64().unwrap()), "{said}");
}

#[test]
fn one_seed_gives_the_same_cells_on_threads_on_slurm_and_on_dask_with_a_killed_worker() {
    let test = SweepTest::new("search-engines", SEARCH);
    let [file, first, dask, slurm, cache] =
        ["sweep.toml", "threads", "dask", "slurm", "cache"].map(|name| test.scratch.join(name));
    let program = env!("CARGO_BIN_EXE_sensel");
    let store = ["--cache", &cache, "--photons-gib", "1"];
    let said = judge("search_engines.py", &[&[program, &file, &first, &dask, &slurm], &store[..]].concat());
    assert_eq!(said["exit"], serde_json::json!([0, 0, 0]), "{said}");
    had_slurm(&said);
    assert!(said["killed"].as_u64().unwrap() >= 2, "a worker was killed while it ran cells: {said}");
    assert!((1..30).contains(&said["finished_at_kill"].as_u64().unwrap()), "in mid-search: {said}");
    // Plan, sweep file and table of every round: four, and the final one.
    assert!(said["files"].as_u64().unwrap() >= 12 && said["unequal"] == serde_json::json!([]), "{said}");
    let report: serde_json::Value =
        serde_json::from_slice(&std::fs::read(Path::new(&first).join("report.json")).unwrap()).unwrap();
    assert_eq!((report["cells"].as_u64(), report["is_finished"].as_bool()), (Some(24), Some(true)));
    assert!(report["chosen"].is_u64(), "{report}");
    let guesses = report["final"].as_array().unwrap().iter().filter(|one| one["number"] == 6).count();
    assert_eq!(guesses, 1, "the guess is evaluated anew: {}", report["final"]);
    let page = std::fs::read_to_string(Path::new(&first).join("report.html")).unwrap();
    for words in ["The choice", "Front", "Progress", "Which keys mattered", "(guess: expert)", "cost twice"] {
        assert!(page.contains(words), "{words}");
    }
    assert!(!page.contains("http://") && !page.contains("https://"), "the page needs no network");
    let chosen = std::fs::read_to_string(Path::new(&first).join("chosen.toml")).unwrap();
    let keys: toml::Table = chosen.parse().unwrap();
    assert!(keys["sensor"]["adc"]["bits"].is_integer(), "{chosen}");
}

/// Calls `sensel-sweep` with the words of each line of its input, and answers each with a line: exit code and stderr.
const CALLS: &str = "
import contextlib, io, json, sys
from sensel_sweep import main
for words in map(json.loads, sys.stdin):
    said = io.StringIO()
    sys.argv[1:] = words
    with contextlib.redirect_stderr(said):
        try:
            main()
        except SystemExit as end:
            print(json.dumps([end.code, said.getvalue()]))
";

/// Exit code and stderr of `sensel-sweep` called with each of these words, in one process: its packages take a second to load.
fn sensel_sweep(calls: &[Vec<&str>]) -> Vec<(i64, String)> {
    let python = std::env::var("SENSEL_JUDGE_PYTHON").expect("./check names the judges' Python in SENSEL_JUDGE_PYTHON");
    let mut command = Command::new(python);
    command.args(["-c", CALLS]).env("PYTHONPATH", Path::new(env!("CARGO_MANIFEST_DIR")).join("python"));
    let lines: String = calls.iter().map(|words| serde_json::json!(words).to_string() + "\n").collect();
    let mut child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn().expect("the judges' Python runs");
    child.stdin.take().unwrap().write_all(lines.as_bytes()).unwrap();
    let output = child.wait_with_output().unwrap();
    let answers = String::from_utf8(output.stdout).unwrap();
    let answers: Vec<_> = answers.lines().map(|line| serde_json::from_str(line).unwrap()).collect();
    assert_eq!(answers.len(), calls.len(), "each call ends with an exit code: {answers:?}");
    answers
}

/// Refuses each search file that has one text in place of another, in one line with these words and before its first cell.
fn refuse_all(cases: &[(&str, &str, &[&str])]) {
    let tests: Vec<(SweepTest, [String; 2])> = cases
        .iter()
        .map(|(from, to, _)| {
            let text = SEARCH.replace(*from, to);
            assert_ne!(text, SEARCH, "{from}");
            let text = if to.contains("values = [") { text.replace("bits = 8", "bits = \"a\"") } else { text };
            let test = SweepTest::new("search-refused", &text);
            let names = ["sweep.toml", "out"].map(|name| test.scratch.join(name));
            (test, names)
        })
        .collect();
    let program = env!("CARGO_BIN_EXE_sensel");
    let calls: Vec<Vec<&str>> =
        tests.iter().map(|(_, [file, out])| vec!["search", file, "--out", out, "--program", program]).collect();
    for (((_, to, words), (_test, [_, out])), (code, said)) in cases.iter().zip(&tests).zip(sensel_sweep(&calls)) {
        assert_eq!(code, 2, "{to}: {said}");
        for word in *words {
            assert!(said.contains(word), "{word}: {said}");
        }
        assert!(
            said.contains("sweep.toml") && said.trim().lines().count() == 1,
            "one line that names the file: {said}"
        );
        assert!(!Path::new(out).join("sweep").exists(), "no cell ran: {to}");
    }
}

#[test]
fn a_bad_search_is_refused_before_its_first_cell() {
    let bits = "key = \"sensor.adc.bits\"\nlow = 4\nhigh = 10\nwhole = true";
    let cases: [(&str, &str, &[&str]); 19] = [
        ("figure = \"power_mw\"", "figure = \"power_mww\"", &["objective.0.figure", "power_mww", "energy.power_mw"]),
        ("\"power_mw < 1000\"", "\"powr_mw < 9\"", &["constraints.0", "powr_mw", "energy.power_mw"]),
        ("\"power_mw < 1000\"", "\"power_mw\"", &["constraints.0", "ate_m < 0.010 for 99 %"]),
        ("\"power_mw < 1000\"", "\"power_mw < 9 for 100 %\"", &["constraints.0", "below 100 %"]),
        ("low = 4\nhigh = 10", "low = 10\nhigh = 4", &["factor.0.high = 4", "above low, which is 10"]),
        ("low = 50.0", "low = -50.0", &["factor.1.low = -50.0", "above 0"]),
        ("sensor.adc.bits", "sensor.adc.bit", &["sensor.adc.bit", "did you mean 'bits'"]),
        ("high = 10", "high = 10\nstep = 2", &["factor.0.step", "unknown key"]),
        ("cells = 24", "cells = 4", &["search.cells = 4", "7 cells", "or more"]),
        ("batch = 5", "batch = 5\nsampler = \"cma\"", &["search.sampler = cma", "tpe", "nsga2"]),
        ("bits = 8, ", "bits = 11, ", &["guess.0.is.bits = 11", "from 4 to 10"]),
        ("[final]\nseeds = 2", "[final]\nseeds = [3]", &["final.seeds = 3", "5 or more"]),
        (
            "figure = \"power_mw\"",
            "figure = \"power_mw\"\nresolution = 0.1",
            &["objective.0.resolution = 0.1", "leave it out: several"],
        ),
        ("goal = \"maximise\"", "goal = \"max\"", &["objective.1.goal = max", "maximise"]),
        ("[search]", "[[rung]]\nname = \"a\"\n[search]", &["rung.0", "is a full cell", "fewer frames"]),
        ("[search]", "[[rung]]\nname = \"a\"\nframes = 2.0\n[search]", &["rung.0.frames = 2.0", "to 1.0"]),
        (
            "[search]",
            "[[rung]]\nname = \"a\"\nset = { \"sensor.adc.bits\" = 4 }\n[search]",
            &["rung.0.set.sensor.adc.bits", "varied by a factor"],
        ),
        (
            "[set]\n\"run.frames\" = 3",
            "[[rung]]\nname = \"a\"\nframes = 0.5\n[set]",
            &["rung.0.frames = 0.5", "needs run.frames"],
        ),
        (bits, "key = \"sensor.adc.bits\"\nvalues = [\"a\", \"b\"]", &["sensor.adc.bits", "whole number"]),
    ];
    refuse_all(&cases);
}

#[test]
fn values_of_the_wrong_kind_and_designs_that_are_equal_are_refused_by_key() {
    let (name, guess) = ("name = \"bits\"", "is = { bits = 8, read_noise_uv = 200.0, sent = \"features\" }");
    let (bits, low) = ("low = 4\nhigh = 10\nwhole = true", format!("low = 1{}", "0".repeat(400)));
    let second = format!("[[guess]]\nname = \"second\"\n{guess}\n[search]");
    let sent = "key = \"link.mode\"\nvalues = [\"features\", \"both\"]";
    let equal = "level = [{ name = \"features\", set = { a = 0 } }, { name = \"both\", set = { a = 0.0 } }]";
    let cases: [(&str, &str, &[&str]); 21] = [
        ("scenario = \"box\"", "scenario = 5", &["scenario = 5", "must be a text"]),
        ("scenario", "cameras_alone = \"false\"\nscenario", &["cameras_alone = \"false\"", "boolean"]),
        ("scenario", "trajectory = []\nscenario", &["trajectory = []", "at least one"]),
        ("[final]", "[final]\ntrajectory = []", &["final.trajectory = []", "at least one"]),
        ("[search]", "[[search]]", &["search = [{", "must be a table", "seeds_most"]),
        ("[final]", "[[final]]", &["final = [{", "must be a table", "designs"]),
        (guess, "is = 5", &["guess.0.is = 5", "must be a table", "read_noise_uv"]),
        (name, "name = [1]", &["factor.0.name = [1]", "must be a text"]),
        (name, "name = 5", &["factor.0.name = 5", "must be a text"]),
        ("low = 4", low.as_str(), &["factor.0.low = 1000", "finite"]),
        (bits, "values = [4, nan]", &["factor.0.values.1 = nan", "finite"]),
        (bits, "values = [4, inf]", &["factor.0.values.1 = inf", "finite"]),
        (bits, "values = [4, 1979-05-27]", &["factor.0.values.1 = 1979-05-27", "a number, a text"]),
        (bits, "values = [0, 0.0]", &["factor.0.values = 0.0", "twice", "leave one out"]),
        (sent, equal, &["factor.2.level.1 = both", "same keys"]),
        ("\"run.frames\" = 3", "\"run.frames\" = nan", &["set.run.frames = nan", "finite"]),
        ("\"run.frames\" = 3", "\"link.mode\" = \"both\"", &["set.link.mode = both", "factor 'sent'"]),
        ("key = \"link.mode\"", "key = \"seed\"", &["factor.2.key = seed", "search.seeds"]),
        ("key = \"link.mode\"", "key = \"sensor.adc.bits\"", &["factor.2.key = sensor.adc.bits", "factor 'bits' too"]),
        ("[search]", second.as_str(), &["guess.1.name = second", "guess 'expert'"]),
        ("high = 800.0", "high = inf", &["factor.1.high = inf", "finite"]),
    ];
    refuse_all(&cases);
}

#[test]
fn a_search_ends_in_a_small_space_is_stopped_by_signals_and_gets_over_damaged_files() {
    let test = SweepTest::new("search-hostile", SEARCH);
    let said = judge("search_hostile.py", &[env!("CARGO_BIN_EXE_sensel"), &test.scratch.join("hostile")]);
    assert_eq!(said["checks"].as_u64(), Some(8), "{said}");
}

#[test]
fn a_search_whose_cells_all_fail_says_why() {
    let text = SEARCH.replace("low = 4\nhigh = 10\nwhole = true", "values = [70, 80]").replace("bits = 8", "bits = 70");
    let test = SweepTest::new("search-failed", &text);
    let [file, out] = ["sweep.toml", "out"].map(|name| test.scratch.join(name));
    let words = ["search", &file, "--out", &out, "--program", env!("CARGO_BIN_EXE_sensel"), "--photons-gib", "0"];
    let (code, said) = sensel_sweep(&[words.to_vec()]).remove(0);
    let last = said.lines().last().unwrap_or_default();
    assert_eq!(code, 3, "{said}");
    for word in ["sweep.toml", "all 7 cells", "sensor.adc.bits", "use 1 to 16"] {
        assert!(last.contains(word), "{word}: {said}");
    }
}
