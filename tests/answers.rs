//! An architect's questions, each by one command: when is the pose there, does the extractor keep up, what does extraction save, how many
//! gates, and what of a sensor that is no preset.

use serde_json::Value;

use crate::common::{Scratch, sensel};

/// Figures of a small always-on sensor as its vendor publishes them: 320 x 240, 376 clocks per line, 260 lines.
const HM01B0: &str = "[sensor]\nwidth = 320\nheight = 240\n[sensor.adc]\nbits = 8\nclock_hz = 12000000\nreset_counts = 32\n\
    [sensor.readout]\nshutter = \"rolling\"\nhts = 376\nvts = 260\npixel_rate_hz = 6000000\nexposure_us = 4000.0\n";

fn folder_with_sensor() -> Scratch {
    let folder = Scratch::new("answers");
    std::fs::write(folder.join("hm01b0.toml"), HM01B0).unwrap();
    let scenario = "[scene]\ntarget = \"flat\"\n[rig]\nbaseline_mm = 0.0\n[sensor]\npreset = \"./hm01b0.toml\"\n";
    std::fs::write(folder.join("mine.toml"), scenario).unwrap();
    folder
}

fn json(arguments: &[&str]) -> Value {
    let outcome = sensel(arguments);
    assert_eq!(outcome.code, 0, "{arguments:?}: {outcome:?}");
    serde_json::from_str(&outcome.stdout).unwrap()
}

#[test]
fn power_of_a_preset_is_estimated_by_its_name_alone() {
    let by_name = json(&["power", "ov7251", "--estimate", "--json"]);
    let in_a_room = json(&["power", "box", "--set", "sensor.preset=ov7251", "--estimate", "--json"]);
    assert_eq!(by_name["energy"]["rails"], in_a_room["energy"]["rails"]);
    assert!(by_name["energy"]["power_mw"].as_f64().unwrap() > 1.0, "{by_name}");
}

#[test]
fn the_hm01b0_does_not_keep_up_and_the_named_clock_and_engines_do() {
    let folder = folder_with_sensor();
    let mine = folder.join("mine.toml");
    let timing = json(&["timing", &mine, "--json"]);
    let extractor = &timing["extractor"];
    assert_eq!(extractor["available_clk"], 376 * 260);
    assert_eq!(extractor["keeps_up"], false, "{extractor}");
    assert!(extractor["required_clk"].as_u64() > extractor["available_clk"].as_u64(), "{extractor}");
    let text = sensel(&["timing", &mine]).stdout;
    assert!(text.contains("does not keep up") && text.contains("of a frame's 97760"), "{text}");

    let remedy = extractor["remedy"].as_str().unwrap();
    let clock = remedy.split("compute.clock_hz = ").nth(1).unwrap().split(' ').next().unwrap();
    let with_clock = json(&["timing", &mine, "--json", "--strict", "--set", &format!("compute.clock_hz={clock}")]);
    assert_eq!(with_clock["extractor"]["keeps_up"], true, "{remedy}");
    assert_eq!(with_clock["extractor"]["clock_hz"].to_string(), clock);
    if let Some(engines) = remedy.split("compute.engines = ").nth(1) {
        let engines = format!("compute.engines={}", &engines[..1]);
        assert_eq!(json(&["timing", &mine, "--json", "--set", &engines])["extractor"]["keeps_up"], true, "{remedy}");
    }
}

#[test]
fn strict_makes_an_overrun_an_error_and_a_stopped_clock_is_refused() {
    let folder = folder_with_sensor();
    let mine = folder.join("mine.toml");
    for verb in [&["timing", &mine][..], &["power", &mine, "--estimate"]] {
        let strict = sensel(&[verb, &["--strict"]].concat());
        assert_eq!(strict.code, 1, "{verb:?}: {strict:?}");
        assert!(strict.stderr.contains("does not keep up") && strict.stderr.contains("compute.clock_hz"), "{strict:?}");
        assert_eq!(sensel(verb).code, 0, "{verb:?}");
    }
    for value in ["0", "999", "1000000001"] {
        let refused = sensel(&["timing", &mine, "--set", &format!("compute.clock_hz={value}")]);
        assert_eq!(refused.code, 2, "{value}: {refused:?}");
        assert!(
            refused.stderr.contains("compute.clock_hz") && refused.stderr.contains("1000 to 1000000000"),
            "{refused:?}"
        );
    }
}

#[test]
fn a_faster_extractor_brings_features_earlier_and_a_faster_host_the_pose() {
    let folder = folder_with_sensor();
    let mine = folder.join("mine.toml");
    let of = |set: &[&str]| {
        let timing = json(&[&["timing", &mine, "--json"][..], set].concat());
        let step = |name: &str| {
            let steps = timing["waterfall"]["frame"].as_array().unwrap();
            let found = steps.iter().find(|step| step["step"] == name);
            found.map_or(0.0, |step| step["end_us"].as_f64().unwrap() - step["start_us"].as_f64().unwrap())
        };
        (step("extractor"), step("tracker"), timing["waterfall"]["pose_us"].as_f64().unwrap())
    };
    let (usual, fast_extractor) = (of(&[]), of(&["--set", "compute.clock_hz=60000000"]));
    assert!(fast_extractor.0 < 0.5 * usual.0 && fast_extractor.2 < usual.2, "{usual:?} {fast_extractor:?}");
    let fast_host = of(&["--set", "host.clock_hz=3.7e9"]);
    assert!((usual.1 / fast_host.1 - 10.0).abs() < 1e-6, "{usual:?} {fast_host:?}");
    let none = sensel(&["timing", &mine, "--set", "host.model=none"]).stdout;
    assert!(!none.contains("tracker") && !none.contains("pose  "), "{none}");
}

#[test]
fn one_table_has_every_way_of_sending_and_each_row_is_what_its_own_scenario_gives() {
    let folder = folder_with_sensor();
    let mine = folder.join("mine.toml");
    let power = json(&["power", &mine, "--estimate", "--json"]);
    let rows = power["alternatives"]["rows"].as_array().unwrap();
    let number = |row: &Value, key: &str| row[key].as_f64().unwrap();
    let names: Vec<&str> = rows.iter().map(|row| row["name"].as_str().unwrap()).collect();
    assert_eq!(names, ["raw", "features", "both", "both, rows every 4th frame"]);
    for row in rows {
        let rails = number(row, "analog_mw") + number(row, "digital_mw") + number(row, "io_mw");
        assert!((rails / number(row, "power_mw") - 1.0).abs() < 1e-9, "{row}");
    }
    assert!(number(&rows[1], "link_mbit_per_s") < 0.5 * number(&rows[0], "link_mbit_per_s"));
    assert!(number(&rows[0], "host_mj_per_frame") > number(&rows[1], "host_mj_per_frame"));
    assert!(number(&rows[3], "power_mw") < number(&rows[2], "power_mw"));
    assert_eq!(rows.iter().filter(|row| row["is_run"] == true).count(), 1);
    for (row, set) in rows.iter().zip(["frames", "features", "both", "both"]) {
        let every = if row["name"] == "both, rows every 4th frame" { "4" } else { "1" };
        let mode = format!("link.mode={set}");
        let every = format!("link.frames_every={every}");
        let own = json(&["power", &mine, "--estimate", "--json", "--set", &mode, "--set", &every]);
        // Counts of a cycle are cut to whole events a frame.
        let ratio = number(row, "power_mw") / own["energy"]["power_mw"].as_f64().unwrap();
        assert!((ratio - 1.0).abs() < 1e-3, "{}: {ratio}", row["name"]);
    }
    let text = sensel(&["power", &mine, "--estimate"]).stdout;
    assert!(text.contains("what is sent") && text.contains("both, rows every 4th frame"), "{text}");
}

/// A sensor of 400 x 400 at 200 frames a second, unlike any preset.
fn square(set: &[&str]) -> Vec<String> {
    let own = [
        "sensor.preset=paper_6t_vga",
        "sensor.width=400",
        "sensor.height=400",
        "sensor.readout.hts=900",
        "sensor.readout.pixel_rate_hz=100000000",
        "sensor.readout.frame_rate_hz=200",
        "sensor.readout.exposure_us=1000",
        "compute.clock_hz=100000000",
        "link.mode=both",
    ];
    own.iter().chain(set).flat_map(|key| ["--set".to_owned(), (*key).to_owned()]).collect()
}

fn answer(verb: &[&str], set: &[&str]) -> Value {
    let set = square(set);
    json(&verb.iter().copied().chain(set.iter().map(String::as_str)).chain(["--json"]).collect::<Vec<_>>())
}

#[test]
fn a_deep_fifo_carries_no_more_than_the_lanes_do() {
    let lanes = ["link.mode=frames", "link.lanes=1", "link.frequency_hz=60000000"];
    let refused_with = |rows: &str| {
        let fifo = format!("link.fifo_rows={rows}");
        let set = square(&[&lanes[..], &[&fifo]].concat());
        let refused = sensel(&[&["timing"][..], &set.iter().map(String::as_str).collect::<Vec<_>>()].concat());
        assert_eq!(refused.code, 2, "{rows} rows: {refused:?}");
        refused.stderr
    };
    // 400 rows of 500 bytes and their bursts on 120 Mbit/s take 13 ms of a frame's 5.
    let stderr = refused_with("400");
    assert!(stderr.contains("need") && stderr.contains("use "), "{stderr}");
    let rate = stderr.split("use ").nth(1).unwrap().split(' ').next().unwrap().to_owned();
    let slower = format!("sensor.readout.frame_rate_hz={rate}");
    let timing = answer(&["timing"], &[&lanes[..], &["link.fifo_rows=400", &slower]].concat());
    let rate: f64 = rate.parse().unwrap();
    let payload_bits = 400.0 * 400.0 * 10.0;
    assert!(rate * payload_bits < 120e6 && rate * payload_bits > 0.8 * 120e6, "{rate} Hz");
    let last = timing["waterfall"]["frame"].as_array().unwrap().iter().find(|step| step["step"] == "link").unwrap();
    assert!(last["slack_us"].as_f64().unwrap() >= 0.0, "{last}");
    refused_with("100");
}

#[test]
fn the_rate_that_a_refusal_names_is_accepted_by_readout_and_link() {
    // The array alone reads 240 frames a second; the features behind the rows need more lines.
    for more in [&["compute.target_features=900"][..], &["compute.target_features=0", "sensor.readout.hts=1100"]] {
        let refused = |rate: &str| {
            let rate = format!("sensor.readout.frame_rate_hz={rate}");
            let set = square(&[more, &[&rate]].concat());
            sensel(&[&["timing"][..], &set.iter().map(String::as_str).collect::<Vec<_>>()].concat())
        };
        let first = refused("100000");
        assert_eq!(first.code, 2, "{first:?}");
        let rate = first.stderr.split("use ").nth(1).unwrap().split(' ').next().unwrap();
        let accepted = refused(rate);
        assert_eq!(accepted.code, 0, "{first:?} then {accepted:?}");
    }
    let colour = square(&["sensor.pixel.cfa=rggb"]);
    let refused = sensel(&[&["timing"][..], &colour.iter().map(String::as_str).collect::<Vec<_>>()].concat());
    assert!(
        refused.stderr.contains("sensor.pixel.cfa = rggb") && refused.stderr.contains("qe_by_filter"),
        "{refused:?}"
    );
}

#[test]
fn a_period_that_is_too_short_to_sleep_is_refused_and_the_one_that_is_named_works() {
    let sleeping = ["energy.sleep_period_ms=20", "energy.wake_us=15001"];
    let set = square(&sleeping);
    let words: Vec<&str> = ["power", "--estimate"].into_iter().chain(set.iter().map(String::as_str)).collect();
    let refused = sensel(&words);
    assert_eq!(refused.code, 2, "{refused:?}");
    let least = refused.stderr.split("take ").nth(1).unwrap().split(' ').next().unwrap();
    let period = format!("energy.sleep_period_ms={least}");
    let power = answer(&["power", "--estimate"], &[&period, sleeping[1]]);
    let bias_ms = |power: &Value| {
        let entries = power["energy"]["entries"].as_array().unwrap();
        let bias = entries.iter().find(|entry| entry["name"] == "column_bias").unwrap_or_else(|| panic!("{entries:?}"));
        bias["times_per_frame"].as_f64().unwrap()
    };
    // All bias flows while the sensor wakes up.
    let streaming = bias_ms(&answer(&["power", "--estimate"], &[]));
    assert!((bias_ms(&power) - streaming - 15.001).abs() < 1e-3, "{} and {streaming} ms", bias_ms(&power));
}

#[test]
fn an_estimate_has_the_extractor_s_work_on_as_many_features_as_it_names() {
    let compute = |features: &str| {
        let power = answer(&["power", "--estimate"], &[&format!("compute.target_features={features}")]);
        power["energy"]["blocks"]["compute"].as_f64().unwrap()
    };
    let (few, some, many) = (compute("20"), compute("500"), compute("980"));
    // In proportion to their number.
    assert!(some > 1.2 * few && ((many - some) / (some - few) - 1.0).abs() < 0.01, "{few} {some} {many}");
}

#[test]
fn features_of_pictures_that_no_packet_carries_have_a_power() {
    let power = answer(&["power", "--estimate"], &["link.mode=features", "sensor.width=402"]);
    assert_eq!(power["link"]["raw_mw"], Value::Null);
    assert!(power["not_measurable"]["link.raw_mw"].is_string() && power["link"]["feature_mw"].as_f64().unwrap() > 0.0);
    let left_out = power["alternatives"]["left_out"].as_array().unwrap();
    assert!(left_out.iter().any(|way| way["name"] == "raw"), "{left_out:?}");
    // The key is the one that a user wrote.
    let window = square(&["sensor.readout.window=[0,0,202,400]"]);
    let refused = sensel(&[&["timing"][..], &window.iter().map(String::as_str).collect::<Vec<_>>()].concat());
    assert!(refused.stderr.contains("sensor.readout.window = [0, 0, 202, 400]"), "{refused:?}");
}

#[test]
fn the_row_of_what_a_run_sent_has_the_run_s_figures_and_its_host_serves_all_cameras() {
    let of = |set: &[&str]| {
        let set: Vec<&str> = set.iter().flat_map(|key| ["--set", key]).collect();
        let folder = Scratch::new("answers-run");
        let small =
            ["run", "box", "--frames", "4", "--json", "--set", "scene.bake=direct", "--set", "sensor.width=320"];
        let out = folder.join("out");
        let words = [&small[..], &["--set", "sensor.height=240", "--out", &out], &set].concat();
        json(&words)
    };
    let report = of(&["link.mode=features"]);
    let rows = report["alternatives"]["rows"].as_array().unwrap();
    let own = rows.iter().find(|row| row["is_run"] == true).unwrap();
    let near = |found: &Value, expected: &Value, factor: f64| {
        let (found, expected) = (found.as_f64().unwrap(), factor * expected.as_f64().unwrap());
        assert!((found / expected - 1.0).abs() < 1e-6, "{found} for {expected}");
    };
    near(&own["link_mbit_per_s"], &report["bandwidth"]["link_bits_per_s"], 1e-6);
    near(&own["latency_us"], &report["timing"]["latency_us"], 1.0);
    near(&own["pose_us"], &report["timing"]["waterfall"]["pose_us"], 1.0);
    let extraction_us = |report: &Value| {
        let steps = report["timing"]["waterfall"]["frame"].as_array().unwrap();
        let step = steps.iter().find(|step| step["step"] == "host extraction").unwrap();
        step["end_us"].as_f64().unwrap() - step["start_us"].as_f64().unwrap()
    };
    // 320 x 240 pixels at 20 clocks of 370 MHz.
    let one_us = 76_800.0 * 20.0 / 370.0;
    let (pair, single) = (of(&["link.mode=frames"]), of(&["link.mode=frames", "rig.baseline_mm=0.0"]));
    assert!((extraction_us(&single) / one_us - 1.0).abs() < 1e-9 && single["timing"]["waterfall"]["cameras"] == 1);
    assert!((extraction_us(&pair) / one_us - 2.0).abs() < 1e-9 && pair["timing"]["waterfall"]["cameras"] == 2);
}

#[test]
fn a_stalled_readout_makes_the_extractor_s_frame_longer_and_hardware_does_not_shrink_with_a_window() {
    let set = ["link.fifo_rows=4", "link.when_full=stall", "link.lanes=1", "link.frequency_hz=60000000"];
    let set = [&set[..], &["sensor.readout.frame_rate_hz=30"]].concat();
    let timing = answer(&["timing"], &set);
    let stalled_us = timing["stalled_us"].as_f64().unwrap();
    let spare = |timing: &Value| {
        let clocks = &timing["extractor"];
        (clocks["available_clk"].as_f64().unwrap() - clocks["required_clk"].as_f64().unwrap()) / 100.0
    };
    let steps = timing["waterfall"]["frame"].as_array().unwrap();
    let slack_us = steps.iter().find(|step| step["step"] == "extractor").unwrap()["slack_us"].as_f64().unwrap();
    assert!(stalled_us > 1000.0 && (spare(&timing) - slack_us).abs() < 100.0, "{} {slack_us}", spare(&timing));

    let gates = |set: &[&str]| answer(&["power", "--estimate"], set)["gates"].clone();
    let block = |gates: &Value, name: &str| {
        gates["blocks"].as_array().unwrap().iter().find(|block| block["name"] == name).unwrap().clone()
    };
    let (whole, window) = (gates(&[]), gates(&["sensor.readout.window=[0,0,200,400]"]));
    assert_eq!(block(&whole, "converters and sequencer"), block(&window, "converters and sequencer"));
    let deep = block(&gates(&["link.fifo_rows=17"]), "packetiser");
    assert_eq!(
        deep["sram_bits"].as_f64().unwrap() - block(&whole, "packetiser")["sram_bits"].as_f64().unwrap(),
        64_000.0
    );
}

#[test]
fn gates_and_area_stand_beside_power_and_grow_with_the_extractor() {
    let folder = folder_with_sensor();
    let mine = folder.join("mine.toml");
    let of = |set: &[&str]| json(&[&["power", &mine, "--estimate", "--json"][..], set].concat())["gates"].clone();
    let usual = of(&[]);
    let blocks = usual["blocks"].as_array().unwrap();
    for key in ["cells", "flip_flops", "sram_bits", "area_mm2"] {
        let sum: f64 = blocks.iter().map(|block| block[key].as_f64().unwrap()).sum();
        assert!((sum / usual["total"][key].as_f64().unwrap() - 1.0).abs() < 1e-9, "{key}");
    }
    let total = |gates: &Value, key: &str| gates["total"][key].as_f64().unwrap();
    assert!(total(&of(&["--set", "compute.engines=4"]), "cells") > total(&usual, "cells") + 10_000.0);
    assert!(total(&of(&["--set", "compute.octaves=2"]), "sram_bits") > total(&usual, "sram_bits"));
    let raw = of(&["--set", "link.mode=frames"]);
    assert!(
        raw["blocks"].as_array().unwrap().iter().all(|block| !block["name"].as_str().unwrap().contains("extractor"))
    );
    let smaller = of(&["--set", "energy.technology=28nm"]);
    assert!(total(&smaller, "area_mm2") < 0.25 * total(&usual, "area_mm2"));
    assert!(sensel(&["power", &mine, "--estimate"]).stdout.contains("SRAM bits"));
}

#[test]
fn a_sensor_file_is_shown_with_the_layer_of_every_value() {
    let folder = folder_with_sensor();
    let file = folder.join("hm01b0.toml");
    let shown = sensel(&["presets", "show", &file]).stdout;
    let line = |key: &str| {
        shown.lines().find(|line| line.starts_with(key)).unwrap_or_else(|| panic!("{key}: {shown}")).to_owned()
    };
    assert!(line("width = 320").contains("hm01b0.toml:2"), "{shown}");
    assert!(line("pitch_um = 3.0").contains("preset paper_6t_vga:"), "{shown}");
    let preset = json(&["presets", "show", "ov7251", "--json"]);
    assert_eq!((preset["name"].as_str(), preset["config"]["sensor"]["width"].as_u64()), (Some("ov7251"), Some(640)));
    let inherited = preset["inherited"].as_array().unwrap();
    assert!(inherited.iter().any(|value| value["layer"] == "preset ov7251"));
    assert!(json(&["presets", "show", "kb4_120", "--json"])["config"]["optics"].is_object());
    assert_eq!(sensel(&["presets", "show", "nothing"]).code, 2);
    assert_eq!(sensel(&["presets", "show"]).code, 2);

    // A scenario's keys do not belong in it, and the label is that of the file.
    let config = json(&["config", "show", &folder.join("mine.toml"), "--json"]);
    assert_eq!(config["sensor"], "./hm01b0.toml");
    std::fs::write(&file, format!("{HM01B0}[motion]\nkind = \"still\"\n")).unwrap();
    let refused = sensel(&["timing", &folder.join("mine.toml")]);
    assert_eq!(refused.code, 2, "{refused:?}");
    for word in ["hm01b0.toml:", "motion", "write the rest in the scenario"] {
        assert!(refused.stderr.contains(word), "{word}: {refused:?}");
    }
    std::fs::remove_file(&file).unwrap();
    assert_ne!(sensel(&["timing", &folder.join("mine.toml")]).code, 0);
}

#[test]
fn kept_packets_have_time_stamps_that_end_with_the_latency() {
    let folder = folder_with_sensor();
    let out = folder.join("out");
    let run = sensel(&[
        "run",
        &folder.join("mine.toml"),
        "--frames",
        "2",
        "--keep",
        "packets",
        "--out",
        &out,
        "--quiet",
        "--set",
        "compute.threshold=3",
    ]);
    assert_eq!(run.code, 0, "{run:?}");
    let report: Value = serde_json::from_str(&std::fs::read_to_string(format!("{out}/report.json")).unwrap()).unwrap();
    let stamps = std::fs::read_to_string(format!("{out}/cam0.packets.csv")).unwrap();
    let rows: Vec<Vec<u64>> =
        stamps.lines().skip(1).map(|line| line.split(',').map(|field| field.parse().unwrap()).collect()).collect();
    let bytes = std::fs::read(format!("{out}/cam0.csi2")).unwrap().len();
    assert_eq!(rows.iter().map(|row| row[1]).sum::<u64>(), u64::try_from(bytes).unwrap());
    let times = report["frames"].as_array().unwrap().iter().map(|frame| frame["t_s"].as_f64().unwrap());
    let latencies = times.enumerate().map(|(frame, t_s)| {
        let own = rows.iter().filter(|row| row[0] == u64::try_from(frame).unwrap());
        1e-3 * sensel::num::f64_from_u64(own.map(|row| row[3]).max().unwrap()) - 1e6 * t_s
    });
    let longest_us = latencies.fold(0.0, sensel::num::greater);
    let told_us = report["timing"]["latency_us"].as_f64().unwrap();
    // Stamps and the frame's time are whole nanoseconds.
    assert!((longest_us - told_us).abs() < 2e-3, "{longest_us} and {told_us}");
    assert!(report["timing"]["waterfall"]["pose_us"].as_f64().unwrap() > told_us);
}
