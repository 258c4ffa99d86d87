//! Messages are taken at their word: the ends of every range that a refusal states are accepted, and a run at each of them finishes.

#![allow(clippy::collapsible_if, reason = "each condition is one phrase of a message")]

use std::collections::BTreeMap;

use sensel::config::Resolved;
use sensel::draw::mix;
use sensel::error::Error;
use sensel::run::{NoClock, NoFiles, NoProgress, Session, Setup};
use serde_json::Value;

use super::sensel;
use crate::common::cases;

/// A scene without files or a bake, seen by the smallest array.
const BASE: &str = "[scene]\ntarget = \"checkerboard\"\n[sensor]\nwidth = 16\nheight = 16\n[run]\nframes = 1\n";

/// What makes keys act whose refusal says so in words only. The first prefix that fits counts.
const MODES: &[(&str, &[&str])] = &[
    ("sensor.readout.hdr_", &["sensor.readout.hdr=multi_exposure", "sensor.readout.shutter=rolling"]),
    ("sensor.readout.trigger_period", &["sensor.readout.trigger=external"]),
    ("sensor.readout.trigger_delay", &["sensor.readout.trigger=external", "sensor.readout.trigger_period_us=1e6"]),
    ("sensor.pixel.storage_", &["sensor.readout.shutter=global"]),
    ("sensor.pixel.parasitic", &["sensor.readout.shutter=global"]),
    (
        "sensor.pixel.low_conversion",
        &["sensor.readout.hdr=dual_gain", "sensor.pixel.conversion_gain_uv_per_e=100.0", "sensor.adc.bits=10"],
    ),
    ("sensor.pixel.overflow", &["sensor.readout.hdr=dual_gain", "sensor.pixel.low_conversion_gain_uv_per_e=5.0"]),
    ("scene.target_angle", &["scene.target=slanted_edge"]),
    ("scene.target_steps", &["scene.target=grey_wedge"]),
    ("scene.target_point", &["scene.target=point_sources"]),
    ("motion.oscillation_", &["motion.oscillation_mm=1.0"]),
    ("motion.radius_m", &["motion.kind=walk", "motion.path=circle"]),
    ("run.samples_max", &["run.render_tolerance=1000.0"]),
    ("run.gloss", &["run.reflections=1"]),
    ("link.frames_every", &["link.mode=both"]),
    ("link.fifo_rows", &["link.mode=both"]),
    ("host.", &["host.model=microcontroller"]),
];

/// Keys of scenes that need files, geometry or a bake; their ranges go through the same checks, without a run here.
const ELSEWHERE: [&str; 6] =
    ["scene.images", "scene.sky.", "scene.environment", "scene.surroundings", "scene.bake", "scene.flicker"];

fn setup(set: &[(String, String)]) -> Result<Setup, Error> {
    let set: Vec<String> = set.iter().map(|(key, value)| format!("{key}={value}")).collect();
    Setup::new(Resolved::from_layers("ends.toml", BASE, &set)?, &NoFiles, &NoProgress)
}

fn assign(set: &mut Vec<(String, String)>, key: &str, value: &str) {
    set.retain(|(known, _)| known != key);
    set.push((key.to_owned(), value.to_owned()));
}

/// All numeric keys of the schema, with whether they are whole numbers.
fn numeric_keys() -> BTreeMap<String, bool> {
    fn walk(schema: &Value, object: &Value, prefix: &str, keys: &mut BTreeMap<String, bool>) {
        for (name, field) in object["properties"].as_object().into_iter().flatten() {
            let path = if prefix.is_empty() { name.clone() } else { format!("{prefix}.{name}") };
            let part = field["$ref"].as_str().and_then(|part| part.rsplit('/').next());
            if let Some(part) = part {
                walk(schema, &schema["$defs"][part], &path, keys);
            }
            let is = |kind: &str| field["type"] == kind || field["type"].as_array().is_some_and(|of| of[0] == kind);
            if is("number") || is("integer") {
                keys.insert(path, is("integer"));
            }
        }
    }
    let schema = sensel(&["schema"]).json();
    let mut keys = BTreeMap::new();
    walk(&schema, &schema, "", &mut keys);
    keys
}

/// A number of a message, without the signs around it.
fn number(word: &str) -> Option<(String, f64)> {
    let word = word.trim_matches(|sign: char| !(sign.is_ascii_digit() || sign == '-' || sign == '.')).replace(',', "");
    let word = word.trim_end_matches('.').to_owned();
    word.parse().ok().map(|value| (word, value))
}

/// What a reason says instead of a value: the nearer end of "A to B", the number of "N or more", "at most N", "key = N", "use N".
fn suggestion(key: &str, reason: &str, value: f64) -> Option<(String, String)> {
    // A comma after a number ends it, one within it does not.
    let words: Vec<&str> = reason.split([' ', ';', '(', ')']).filter(|word| !word.is_empty()).collect();
    for (at, word) in words.iter().enumerate() {
        let (before, after) = (at.checked_sub(1).map(|before| words[before]), words.get(at + 1));
        let own = |text: String| Some((key.to_owned(), text));
        if *word == "to"
            && let (Some(low), Some(high)) = (before.and_then(number), after.and_then(|after| number(after)))
        {
            return own(if value < low.1 { low.0 } else { high.0 });
        }
        if *word == "=" && before.is_some_and(|before| before.contains('_') || ["hts", "vts"].contains(&before)) {
            let named = before?.trim_matches(',');
            let path = if named.contains('.') { named.to_owned() } else { format!("sensor.readout.{named}") };
            return Some((path, after?.trim_matches(|sign| sign == ',' || sign == '"').to_owned()));
        }
        let asks_for_one = *word == "use" && words.get(at + 2) != Some(&"to");
        if asks_for_one && let Some((text, _)) = after.and_then(|after| number(after)) {
            return own(text);
        }
        if (*word == "or" && after.is_some_and(|after| ["more", "less", "fewer"].contains(&after.trim_matches(','))))
            || (*word == "would" && after == Some(&"do"))
        {
            if let Some((text, _)) = before.and_then(number) {
                return own(text);
            }
        }
        if (*word == "most" || *word == "least") && before == Some("at") {
            if let Some((text, _)) = after.and_then(|after| number(after)) {
                return own(text);
            }
        }
    }
    None
}

enum End {
    /// The run finished at these assignments.
    Ran,
    /// Another relation refuses it and names no number.
    InWords(String),
}

/// Sets a key far out and does what refusals say until the run starts; then a frame and the report have to come.
fn follow(key: &str, far: &str, more: &[(String, String)]) -> End {
    let mut set: Vec<(String, String)> = Vec::new();
    let modes = MODES.iter().find(|(prefix, _)| key.starts_with(prefix)).map_or(&[][..], |(_, modes)| modes);
    for (known, value) in modes.iter().filter_map(|mode| mode.split_once('=')) {
        assign(&mut set, known, value);
    }
    for (known, value) in more {
        assign(&mut set, known, value);
    }
    assign(&mut set, key, far);
    for _ in 0..12 {
        let error = match setup(&set) {
            Ok(setup) => {
                let mut session = Session::new(setup).unwrap_or_else(|error| panic!("{set:?}: {error}"));
                match session.step(&NoClock) {
                    Ok(_) => {
                        let report = session.report("ends").and_then(|report| report.to_json());
                        report.unwrap_or_else(|error| panic!("{set:?}: {error}"));
                        return End::Ran;
                    }
                    // What the features of the frame need of the link is known with them.
                    Err(error @ Error::Config { .. }) => return End::InWords(format!("{set:?}: {error}")),
                    Err(error) => panic!("{set:?}: {error}"),
                }
            }
            Err(error) => error,
        };
        let Error::Config { key: named, value, reason, .. } = &error else { panic!("{set:?}: {error}") };
        let refused = number(value).map_or(0.0, |(_, value)| value);
        let Some((path, text)) = suggestion(named, reason, refused) else {
            return End::InWords(format!("{set:?}: {error}"));
        };
        assert!(
            !set.contains(&(path.clone(), text.clone())) || path != *named,
            "{set:?}: a refusal does not take what it names: {error}"
        );
        if set.contains(&(path.clone(), text.clone())) {
            return End::InWords(format!("{set:?}: {error}"));
        }
        assign(&mut set, &path, &text);
    }
    End::InWords(format!("{set:?}: no end of refusals"))
}

#[test]
fn the_ends_of_every_range_that_a_refusal_states_run() {
    let (mut ran, mut in_words) = (0, Vec::new());
    let mut keys = numeric_keys();
    keys.retain(|key, _| !ELSEWHERE.iter().any(|prefix| key.starts_with(prefix)));
    assert!(keys.len() > 120, "{}", keys.len());
    // A third of the keys each day, all of them each week.
    for (key, is_whole) in keys.iter().step_by(cases(1, 3)) {
        for far in if *is_whole { ["-1", "9223372036854775807"] } else { ["-1e308", "1e308"] } {
            match follow(key, far, &[]) {
                End::Ran => ran += 1,
                End::InWords(words) => in_words.push(words),
            }
        }
    }
    in_words.iter().for_each(|words| println!("in words: {words}"));
    println!("{ran} ends ran, {} are refused in words", in_words.len());
    assert!(in_words.len() * 5 < ran, "{} of {ran}", in_words.len());
}

#[test]
fn two_values_at_the_ends_of_their_ranges_run_or_are_refused_with_what_runs() {
    const SEED: u64 = 7;
    let mut keys = numeric_keys();
    keys.retain(|key, _| {
        // What takes long at its end is tried alone.
        let is_slow = ["run.", "sensor.width", "sensor.height"].iter().any(|prefix| key.starts_with(prefix));
        !is_slow && !ELSEWHERE.iter().any(|prefix| key.starts_with(prefix))
    });
    let keys: Vec<(&String, &bool)> = keys.iter().collect();
    let far = |(_, is_whole): &(&String, &bool), draw: u64| match (**is_whole, draw % 2) {
        (true, 0) => "-1",
        (true, _) => "9223372036854775807",
        (false, 0) => "-1e308",
        (false, _) => "1e308",
    };
    let mut ran = 0;
    let cases = cases(150_u64, 50);
    for case in 0..cases {
        let draw = |of: u64| mix(SEED ^ mix(case << 8 | of));
        let at = |of: u64| &keys[usize::try_from(draw(of) % u64::try_from(keys.len()).unwrap()).unwrap()];
        let (one, other) = (at(0), at(1));
        println!("seed {SEED}, case {case}: {} and {}", one.0, other.0);
        let more = [(other.0.clone(), far(other, draw(3)).to_owned())];
        if one.0 != other.0 && matches!(follow(one.0, far(one, draw(2)), &more), End::Ran) {
            ran += 1;
        }
    }
    println!("seed {SEED}: {ran} of {cases} ran");
    assert!(15 * ran > 4 * cases, "{ran}");
}
