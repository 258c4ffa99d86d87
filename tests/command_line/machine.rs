//! What programs that call sensel rely on: errors as JSON, messages that are safe to repeat, warnings, refusals that agree between verbs.

use serde_json::Value;

use crate::common::{Outcome, Scratch, nulls, sensel, sensel_bare, sensel_in_cache};

const TINY: [&str; 4] = ["--set", "sensor.width=64", "--set", "sensor.height=48"];

/// The only line on stderr, as the object of an error.
fn error_object(outcome: &Outcome) -> Value {
    assert_eq!((outcome.stdout.as_str(), outcome.stderr.lines().count()), ("", 1), "{outcome:?}");
    let value: Value = serde_json::from_str(&outcome.stderr).unwrap();
    assert_eq!(value["error"]["exit_code"], outcome.code, "{value}");
    assert!(value["error"]["message"].as_str().unwrap().len() > 10, "{value}");
    value["error"].clone()
}

#[test]
fn with_json_every_error_is_one_object_on_stderr_that_names_its_kind_and_location() {
    let folder = Scratch::new("json");
    let file = folder.join("mine.toml");
    std::fs::write(&file, "seed = 1\n[sensor.adc]\nbits = 30\n").unwrap();
    let cases: [(&[&str], &str, &str, Value); 8] = [
        (&["run", &file, "--json"], "config", "key", "sensor.adc.bits".into()),
        (&["run", &file, "--json"], "config", "line", 3.into()),
        (&["run", "ballroom", "--json"], "unknown", "value", "ballroom".into()),
        (&["timing", "imx287", "--json"], "unknown", "what", "sensor preset or scenario".into()),
        (&["--json", "dance"], "usage", "value", "dance".into()),
        (&["run", "--json", "--dance"], "usage", "key", "--dance".into()),
        (&["run", "box", "--frames", "x", "--json"], "usage", "value", "x".into()),
        (&["features", "none.png", "--json"], "content", "file", "none.png".into()),
    ];
    let mut seen = 0;
    for (words, kind, part, expected) in cases {
        let outcome = sensel(words);
        let error = error_object(&outcome);
        assert_eq!((&error["kind"], &error[part]), (&kind.into(), &expected), "{words:?}: {error}");
        seen += 1;
    }
    assert_eq!(seen, 8);
}

#[test]
fn no_argument_at_all_prints_the_help_with_every_verb_and_a_first_command() {
    let outcome = sensel_bare();
    assert_eq!((outcome.code, outcome.stderr.as_str()), (0, ""));
    for word in ["run", "plan", "timing", "characterize", "presets", "sensel run box --frames 30"] {
        assert!(outcome.stdout.contains(word), "{word}: {}", outcome.stdout);
    }
    let without_verb = sensel(&["--seed", "3"]);
    assert!(without_verb.code == 2 && without_verb.stderr.contains("name one of run, plan"), "{without_verb:?}");
}

#[test]
fn values_are_repeated_without_control_characters_and_cut() {
    let (escape, long) = ("\u{1b}[31m", "x".repeat(100_000));
    let cases: [Vec<String>; 7] = [
        vec!["run".into(), format!("{escape}room")],
        vec!["run".into(), long.clone()],
        vec!["run".into(), "box".into(), "--set".into(), format!("scene.illuminant={escape}{long}")],
        vec!["run".into(), "box".into(), "--set".into(), format!("{escape}{long}=1")],
        vec!["run".into(), "box".into(), "--set".into(), format!("sensor.{escape}{long}=1")],
        vec!["run".into(), "box".into(), format!("--{escape}{long}")],
        vec!["timing".into(), "ov7251".into(), "--svg".into(), format!("{escape}{long}.png")],
    ];
    for words in &cases {
        for more in [&[][..], &["--json".to_owned()]] {
            let outcome = sensel(&[&words[..], more].concat());
            assert_eq!(outcome.code, 2, "{}", outcome.stderr);
            let said = &outcome.stderr;
            assert!(said.len() < 4000 && !said.is_empty(), "{} bytes", said.len());
            assert!(said.chars().all(|letter| letter == '\n' || !letter.is_control()), "{said}");
        }
    }
}

#[test]
fn a_file_whose_ending_promises_another_format_is_refused_before_anything_is_done() {
    let folder = Scratch::new("endings");
    let picture = folder.join("grey.png");
    image::GrayImage::from_fn(64, 64, |x, y| image::Luma([if x / 8 % 2 == y / 8 % 2 { 20 } else { 220 }]))
        .save(&picture)
        .unwrap();
    let at = |name: &str| folder.join(name);
    let cases: [(&[&str], &str, &str); 8] = [
        (&["timing", "ov7251", "--svg"], "x.png", ".svg"),
        (&["features", &picture, "--csv"], "x.json", ".csv"),
        (&["features", &picture, "--draw"], "x.jpg", ".png"),
        (&["features", &picture, "--out"], "x.json", ".csv"),
        (&["features", &picture, "--json", "--out"], "x.csv", ".json"),
        (&["track", folder.path().to_str().unwrap(), "--out"], "x.csv", ".tum"),
        (&["track", folder.path().to_str().unwrap(), "--map"], "x.obj", ".ply"),
        (&["timing", "ov7251", "--waves"], "x.txt", ".vcd"),
    ];
    for (words, name, needed) in cases {
        let outcome = sensel(&[words, &[&at(name)]].concat());
        assert!(outcome.code == 2 && outcome.stderr.contains(needed), "{words:?} {name}: {outcome:?}");
        assert!(!folder.path().join(name).exists(), "{name} was written");
    }
    for (words, name) in [(&["timing", "ov7251", "--svg"][..], "x.SVG"), (&["features", &picture, "--csv"], "x.csv")] {
        assert_eq!(sensel(&[words, &[&at(name)]].concat()).code, 0, "{name}");
        assert!(folder.path().join(name).exists(), "{name}");
    }
    let outcome = sensel(&["track", folder.path().to_str().unwrap(), "--out", folder.path().to_str().unwrap()]);
    assert!(outcome.code == 2 && outcome.stderr.contains("is a folder; name a file"), "{outcome:?}");
    let outcome = sensel(&["timing", "ov7251", "--out", &at("timing")]);
    assert!(outcome.code == 2 && outcome.stderr.contains("writes no files"), "{outcome:?}");
}

#[test]
fn who_asks_for_an_unknown_sensor_hears_of_every_preset() {
    for verb in ["timing", "characterize"] {
        let outcome = sensel(&[verb, "imx287"]);
        assert_eq!(outcome.code, 2);
        for known in ["ov7251", "imx219", "box", "bathroom"] {
            assert!(outcome.stderr.contains(known), "{verb} lacks {known}: {}", outcome.stderr);
        }
    }
    let outcome = sensel(&["run", "ov7251"]);
    assert!(outcome.stderr.contains("--set sensor.preset=ov7251"), "{}", outcome.stderr);
}

#[test]
fn config_show_presets_and_schema_refuse_what_run_refuses() {
    let folder = Scratch::new("shown");
    let file = folder.join("lost.toml");
    std::fs::write(&file, "[scene]\nfile = \"lost.glb\"\n").unwrap();
    let mut tried = 0;
    for assignment in
        ["sensor.adc.bits=30", "run.frames=0", "run.threads=5000", "sensor.readout.hts=100", "run.effects=-glow"]
    {
        for words in [&["config", "show", "box"][..], &["presets"], &["schema"]] {
            let outcome = sensel(&[words, &["--set", assignment]].concat());
            let refused = sensel(&["run", "box", "--set", assignment]);
            assert_eq!((outcome.code, &outcome.stderr), (2, &refused.stderr), "{words:?} {assignment}");
            tried += 1;
        }
    }
    assert_eq!(tried, 15);
    for more in [["--set", "scene.generator=palace"], ["--set", "optics.k1=-3.0"], ["--set", "rig.imu=brick"]] {
        assert_eq!(sensel(&[&["config", "show", "box"][..], &more].concat()).code, 2, "{more:?}");
    }
    assert_eq!(sensel(&["config", "show", &file]).stderr, sensel(&["run", &file]).stderr);
    assert_eq!(sensel(&["presets", "--scenes", &folder.join("nowhere")]).code, 2);
    let shown = sensel(&["config", "show", "box", "--json"]).json();
    let mut missing = Vec::new();
    nulls(&shown, "", &mut missing);
    assert_eq!(missing, Vec::<String>::new(), "what is not written is left out");
    assert!(shown["inherited"].as_array().unwrap().iter().any(|value| value["key"] == "sensor.pixel.fill_factor"));
}

#[test]
fn a_byte_order_mark_is_read_past_in_scenarios_sensors_and_tables() {
    let folder = Scratch::new("mark");
    let write = |name: &str, text: &str| std::fs::write(folder.path().join(name), format!("\u{feff}{text}")).unwrap();
    write("sensor.toml", "[sensor]\npreset = \"ov7251\"\n");
    assert_eq!(sensel(&["timing", &folder.join("sensor.toml"), "--json"]).json()["hts"], 928);
    let poses: String = (0..300).map(|step| format!("{} 0 0 0 0 0 0 1\n", 0.01 * f64::from(step))).collect();
    write("path.txt", &poses);
    write("scene.toml", "[scene]\ngenerator = \"box\"\n[motion]\nfile = \"path.txt\"\n[run]\nframes = 2\n");
    let scene = folder.join("scene.toml");
    assert_eq!(sensel(&["config", "show", &scene]).code, 0);
    write("broken.toml", "seed = 1\nbits = = 3\n");
    assert!(sensel(&["run", &folder.join("broken.toml")]).stderr.contains("line 2"));
}

#[test]
fn dark_pictures_lost_tracks_short_starts_and_a_cache_that_cannot_be_used_are_warned_of_with_a_remedy() {
    let folder = Scratch::new("warned");
    std::fs::write(folder.path().join("file"), "x").unwrap();
    let run = |more: &[&str]| {
        let out = folder.join("out");
        let words = ["run", "box", "--frames", "2", "--quiet", "--out", &out];
        let outcome = sensel(&[&words[..], &TINY, more].concat());
        assert_eq!(outcome.code, 0, "{}", outcome.stderr);
        let report: Value =
            serde_json::from_str(&std::fs::read_to_string(format!("{out}/report.json")).unwrap()).unwrap();
        let warnings: Vec<String> = serde_json::from_value(report["warnings"].clone()).unwrap();
        let lines: Vec<String> = warnings.iter().map(|text| format!("sensel: warning: {text}")).collect();
        assert_eq!(outcome.stderr.lines().collect::<Vec<_>>(), lines, "each once, and the same as in the report");
        warnings.join("\n")
    };
    let dark = run(&["--set", "scene.illuminance_lux=5"]);
    assert!(
        dark.contains("the pictures are dark: mean code ") && dark.contains("lengthen sensor.readout.exposure_us"),
        "{dark}"
    );
    let bright = run(&["--set", "scene.illuminance_lux=100000"]);
    assert!(bright.contains("% of the pixels are saturated: shorten"), "{bright}");
    let black = run(&["--set", "scene.illuminance_lux=0.001"]);
    assert!(black.contains("0 % of the frames have a pose") && black.contains("compute.threshold"), "{black}");
    let one = run(&["--set", "rig.baseline_mm=0"]);
    assert!(one.contains("too short for one camera to start a map") && one.contains("raise run.frames"), "{one}");
    let own = run(&["--set", "sensor.pixel.quantum_efficiency=0.5"]);
    assert!(own.contains("fill_factor = 0.9 is inherited"), "{own}");
    let outcome = sensel_in_cache(
        &[&["run", "box", "--frames", "1", "--quiet", "--out", &folder.join("c")][..], &TINY].concat(),
        &folder.join("file/cache"),
    );
    assert_eq!(outcome.code, 0, "{outcome:?}");
    assert!(
        outcome.stderr.contains("sensel: warning: the cache cannot be used") && outcome.stderr.contains("--cache"),
        "{outcome:?}"
    );
}

#[test]
fn a_signal_that_the_planner_caps_is_called_so_and_one_below_is_not() {
    let reason = |lux: &str| {
        let plan = sensel(&["plan", "box", "--json", "--set", &format!("scene.illuminance_lux={lux}")]).json();
        let kept = plan["kept_reasons"].as_array().unwrap();
        let of_prnu = kept.iter().find(|effect| effect["name"] == "prnu").unwrap();
        let facts = plan["facts"].as_array().unwrap();
        let signal = facts.iter().find(|fact| fact["name"] == "signal_e").unwrap();
        (of_prnu["reason"].as_str().unwrap().to_owned(), signal["how"].as_str().unwrap().to_owned())
    };
    for (lux, is_capped) in [("20000", true), ("3000", true), ("100", false)] {
        let (reason, how) = reason(lux);
        assert_eq!(reason.contains("twice what pixel and converter hold"), is_capped, "{lux} lux: {reason}");
        assert_eq!(how.contains("at most, twice what pixel and converter hold"), is_capped, "{lux} lux: {how}");
    }
}

#[test]
fn a_run_says_that_no_features_were_sent_and_names_both_jitters() {
    let folder = Scratch::new("frames");
    let words = ["run", "box", "--frames", "2", "--set", "link.mode=frames", "--out", &folder.join("out")];
    let outcome = sensel(&[&words[..], &TINY].concat());
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    assert!(outcome.stdout.contains("no features (link.mode = frames sends no features)"), "{}", outcome.stdout);
    for name in ["jitter frame", "jitter d2", "RPE over one frame", "second differences"] {
        assert!(outcome.stdout.contains(name), "{name}: {}", outcome.stdout);
    }
    assert!(!outcome.stdout.contains("smaller than raw"), "{}", outcome.stdout);
}

#[test]
fn a_characterized_sensor_says_what_its_efficiency_is_made_of_and_what_it_inherits() {
    let folder = Scratch::new("inherits");
    let file = folder.join("<b>mine.toml");
    std::fs::write(&file, "[sensor.pixel]\nquantum_efficiency = 0.6\n").unwrap();
    let words = ["characterize", &file, "--size", "64x48", "--points", "40", "--stack", "32", "--quiet", "--out"];
    let outcome = sensel(&[&words[..], &[&folder.join("out")]].concat());
    assert_eq!(outcome.code, 0, "{}", outcome.stderr);
    assert!(outcome.stderr.contains("fill_factor = 0.9 is inherited (preset paper_6t_vga:"), "{}", outcome.stderr);
    let text = std::fs::read_to_string(folder.path().join("out/characterization.json")).unwrap();
    let record: Value = serde_json::from_str(&text).unwrap();
    assert_eq!(record["sensor"], "no preset (values of paper_6t_vga)");
    let efficiency = record["efficiency"].as_str().unwrap();
    assert!(
        efficiency.contains("0.6 (written, ") && efficiency.contains("fill_factor 0.9 (inherited, "),
        "{efficiency}"
    );
    assert!(record["inherited"].as_array().unwrap().len() > 60 && record["config"]["sensor"].is_object());
    let page = std::fs::read_to_string(folder.path().join("out/characterization.html")).unwrap();
    assert!(page.contains("inherited values of the sensor") && page.contains("sensor.pixel.fill_factor"));
    assert!(page.contains("&lt;b&gt;mine.toml:2") && !page.contains("<b>"), "a file's name is text");
}
