//! `sensel fit`: parameters of random sensors come back from their frames, and frames that tell nothing are refused.

#![allow(clippy::unwrap_used)]

use std::path::Path;

use sensel::characterize::fit::{Assumed, SensorFit, SensorFrames, fit};
use sensel::characterize::{MeasurementSize, SensorBench};
use sensel::config::Resolved;
use sensel::draw::DrawKey;
use sensel::files::emva::EmvaWriter;
use sensel::files::emva_reader;
use sensel::units::Size;

use crate::common::{Outcome, Scratch, cases, sensel};

/// Names the random sensors.
const SEED: u64 = 20_261_125;
/// A region that shows patterns of columns and takes little time.
const OPTIONS: MeasurementSize =
    MeasurementSize { size: Some(Size { width_px: 128, height_px: 96 }), points: 40, stack: 32, channel: None };
const GAIN_UV_PER_E: f64 = 50.0;

/// A sensor that a fit can describe: what it has to find, by key.
struct Sensor {
    truth: Vec<(&'static str, f64)>,
    assignments: Vec<String>,
}

fn random(number: u64) -> Sensor {
    let key = DrawKey::root(SEED).with(number);
    let share = |draw: u64| key.with(draw).uniform();
    let between = |draw: u64, low: f64, high: f64| low * libm::pow(high / low, share(draw));
    let bits = 10 + u32::from(share(0) < 0.5) * 2;
    let codes = f64::from(1_u32 << bits);
    let k = between(1, 0.4, 2.0);
    let lsb_uv = GAIN_UV_PER_E / k;
    // Above 0.7 DN of noise quantisation is a small part of it.
    let read_noise_uv = lsb_uv * between(2, 0.9, 4.0);
    let black = libm::floor(between(3, 40.0, 120.0));
    let range_e = (codes - 1.0 - black) / k;
    let is_well = share(4) < 0.5;
    let mut truth = vec![
        ("adc.full_scale_uv", lsb_uv * codes),
        ("pixel.quantum_efficiency", between(5, 0.3, 0.9)),
        ("adc.black_level_dn", black),
        ("pixel.dark_current_e_per_s", between(6, 200.0, 5_000.0)),
        ("pixel.read_noise_uv", read_noise_uv),
        ("adc.row_noise_uv", lsb_uv * between(7, 0.1, 1.0)),
        ("adc.column_noise_uv", lsb_uv * between(8, 0.1, 1.0)),
        ("pixel.dsnu_e", between(9, 0.5, 5.0)),
        ("adc.column_offset_residual_uv", lsb_uv * between(10, 0.3, 2.0)),
        ("adc.row_offset_uv", lsb_uv * between(11, 0.3, 2.0)),
        ("pixel.prnu", between(12, 0.004, 0.02)),
        ("adc.column_gain_sigma", between(13, 0.002, 0.01)),
        ("adc.ramp_inl_lsb", 4.0 * share(14) - 2.0),
        ("pixel.hot_ppm", between(15, 1_000.0, 5_000.0)),
        ("pixel.dead_ppm", between(17, 300.0, 2_000.0)),
        ("pixel.stuck_ppm", between(18, 300.0, 2_000.0)),
        ("pixel.rts_ppm", between(19, 2_000.0, 20_000.0)),
        ("pixel.rts_amplitude_uv", read_noise_uv * between(20, 2.0, 8.0)),
    ];
    truth.push(("pixel.hot_dark_e_per_s", truth[3].1 * between(16, 20.0, 60.0)));
    let well_e = libm::floor(range_e * if is_well { 0.7 } else { 1.5 });
    if is_well {
        truth.push(("pixel.full_well_e", well_e));
    }
    let mut assignments: Vec<String> = truth.iter().map(|(key, value)| format!("sensor.{key}={value:?}")).collect();
    // A whole number in the configuration.
    assignments.retain(|assignment| !assignment.contains("black_level_dn") && !assignment.contains("full_well_e"));
    assignments.extend([
        format!("sensor.adc.black_level_dn={black:.0}"),
        format!("sensor.pixel.full_well_e={well_e:?}"),
        format!("sensor.adc.bits={bits}"),
        format!("sensor.pixel.conversion_gain_uv_per_e={GAIN_UV_PER_E:?}"),
        format!("seed={number}"),
        format!("sensor.die={}", number + 1),
    ]);
    for fixed in [
        "pixel.fill_factor=1.0",
        "pixel.ktc_noise_uv=0.0",
        "pixel.storage_dark_e_per_s=0.0",
        "pixel.rts_rate_hz=1e9",
        "adc.cds=analog",
    ] {
        assignments.push(format!("sensor.{fixed}"));
    }
    Sensor { truth, assignments }
}

/// Shoots a sensor's frames into a folder.
fn shoot(folder: &Path, assignments: &[String]) {
    let resolved = Resolved::from_layers("fit.toml", "[sensor]\npreset = \"paper_6t_vga\"\n", assignments)
        .unwrap_or_else(|e| panic!("{assignments:?}: {e}"));
    let bench = SensorBench::new(&resolved, &OPTIONS).unwrap_or_else(|e| panic!("{assignments:?}: {e}"));
    let mut writer = EmvaWriter::create(folder, bench.set()).unwrap();
    bench.run(|shot, codes| writer.frame(shot, codes)).unwrap();
    writer.finish(&bench.truth()).unwrap();
}

fn fitted(folder: &Path) -> SensorFit {
    let found = emva_reader::read(folder).unwrap();
    assert_eq!((found.points, found.stack), (40, 32));
    let assumed = Assumed { conversion_gain_uv_per_e: GAIN_UV_PER_E, temperature_k: 300.0, dark_doubling_k: 8.0 };
    let frames = SensorFrames {
        measurement: &found.measurement,
        defects: &found.defects,
        bits: found.bits,
        half: found.half,
        temperatures: &[],
    };
    fit(&frames, &assumed).unwrap()
}

#[test]
fn nine_of_ten_parameters_of_random_sensors_lie_in_their_intervals() {
    let (mut held, mut tried, mut traps, mut missed) = (0_u32, 0_u32, 0_u32, Vec::new());
    let sensors = cases(20, 8);
    for number in 0..sensors {
        let Sensor { truth, assignments } = random(number);
        let folder = Scratch::new("fit");
        shoot(folder.path(), &assignments);
        let fit = fitted(folder.path());
        assert_eq!(fit.get("pixel.full_well_e").is_some(), truth.iter().any(|(key, _)| *key == "pixel.full_well_e"));
        for (key, truth) in truth {
            let Some(found) = fit.get(key) else {
                // Few traps that are hardly above the noise do not tell their amplitude.
                assert!(
                    key.contains("rts") && fit.undetermined.iter().any(|one| one.key == "pixel.rts_ppm"),
                    "{key}, {number}"
                );
                continue;
            };
            traps += u32::from(key == "pixel.rts_ppm");
            let [low, high] = found.interval;
            assert!(low <= found.value && found.value <= high, "{found:?}");
            tried += 1;
            if (low..=high).contains(&truth) {
                held += 1;
            } else {
                missed.push(format!("sensor {number}: {key} = {truth:.5} is not in {low:.5} to {high:.5}"));
            }
        }
    }
    let share = f64::from(held) / f64::from(tried);
    println!("seed {SEED}: {held} of {tried} parameters lie in their 95 % intervals\n{}", missed.join("\n"));
    assert!(
        u64::from(tried) > 18 * sensors && 4 * u64::from(traps) >= 3 * sensors && share >= 0.9,
        "seed {SEED}: {share:.3} of {tried}\n{}",
        missed.join("\n")
    );
}

#[test]
fn dark_frames_of_three_temperatures_tell_the_doubling_step() {
    let at = |kelvin: f64| {
        let mut assignments = random(4).assignments;
        assignments.extend([format!("sensor.temperature_k={kelvin:?}"), "sensor.pixel.dark_doubling_k=6.5".to_owned()]);
        let folder = Scratch::new("fit");
        shoot(folder.path(), &assignments);
        folder
    };
    let (usual, [cold, warm]) = (at(300.0), [290.0, 315.0].map(at));
    let dark = |kelvin: &str, folder: &Scratch| format!("{kelvin}={}", folder.path().display());
    let (cold, warm_too) = (dark("290", &cold), dark("315", &warm));
    let found = json_of(&fit_of(&usual, &["--dark", &cold, "--dark", &warm_too, "--json"]));
    let parameter = |key: &str| -> [f64; 3] {
        let all = found["fit"]["fitted"].as_array().unwrap();
        let one = all.iter().find(|one| one["key"] == key).unwrap_or_else(|| panic!("{key} is not fitted: {found}"));
        [&one["interval"][0], &one["value"], &one["interval"][1]].map(|value| value.as_f64().unwrap())
    };
    let [low, value, high] = parameter("pixel.dark_doubling_k");
    assert!(low < 6.5 && 6.5 < high && low < value && value < high && high - low < 0.5, "{low} {value} {high}");
    let [low, _, high] = parameter("pixel.dark_current_e_per_s");
    let truth = random(4).truth.iter().find(|(key, _)| *key == "pixel.dark_current_e_per_s").unwrap().1;
    assert!(low < truth && truth < high, "{truth} is not in {low} to {high}");
    // What is no temperature, no folder, another sensor, one exposure.
    for (words, accepted) in [("320", "320=FOLDER"), ("20=x", "200 to 450"), ("320=nowhere", "emva1288.txt")] {
        let outcome = fit_of(&usual, &["--dark", words]);
        assert!(outcome.code == 2 && outcome.stderr.contains(accepted), "{words}: {outcome:?}");
    }
    let descriptor = warm.path().join("emva1288.txt");
    let text = std::fs::read_to_string(&descriptor).unwrap();
    std::fs::write(&descriptor, text.replace(" 128 96", " 96 128")).unwrap();
    let outcome = fit_of(&usual, &["--dark", &warm_too]);
    assert!(outcome.code == 2 && outcome.stderr.contains("frames of the same sensor: 128 x 96"), "{outcome:?}");
    let single: Vec<&str> = text.split("\nd ").take(2).collect();
    std::fs::write(&descriptor, single.join("\nd ")).unwrap();
    let outcome = fit_of(&usual, &["--dark", &warm_too]);
    assert!(outcome.code == 2 && outcome.stderr.contains("fewer than two exposures"), "{outcome:?}");
}

#[test]
fn flats_tell_the_roll_off_of_a_lens() {
    let folder = Scratch::new("fit");
    let sensor = random(6);
    shoot(folder.path(), &sensor.assignments);
    let bits: u32 = if sensor.assignments.contains(&"sensor.adc.bits=12".to_owned()) { 12 } else { 10 };
    // 128 x 96 pixels of 3 um, 0.3 mm: 80 pixels are 38.7 degrees in the corner. cos^4 of a flat pupil, with noise of 3 DN.
    let [focal_mm, pitch_um] = [0.3, 3.0];
    let flat = Scratch::new("flat");
    let full_dn = 0.6 * f64::from(1_u32 << bits);
    let mut text = format!("n {bits} 128 96\n");
    let share = |radius_px: f64| {
        let tangent = radius_px * pitch_um / (1e3 * focal_mm);
        let square = tangent * tangent;
        1.0 / ((1.0 + square) * (1.0 + square))
    };
    for is_lit in [true, false] {
        text.push_str(if is_lit { "b 1000000 100\n" } else { "d 1000000\n" });
        for number in 0..8_u64 {
            let name = format!("{is_lit}{number}.raw");
            let key = DrawKey::root(SEED).with(number).with(u64::from(is_lit));
            let code = |pixel: u32| {
                let [x, y] = [pixel % 128, pixel / 128].map(|coordinate| f64::from(coordinate) + 0.5);
                let light = if is_lit { full_dn * share(libm::hypot(x - 64.0, y - 48.0)) } else { 0.0 };
                let noise: f64 = (0..3).map(|draw| key.with(u64::from(pixel)).with(draw).uniform() - 0.5).sum();
                u16::try_from(sensel::num::i64_half_even(60.0 + light + 6.0 * noise)).unwrap()
            };
            std::fs::write(
                flat.path().join(&name),
                (0..128 * 96).flat_map(|pixel| code(pixel).to_le_bytes()).collect::<Vec<u8>>(),
            )
            .unwrap();
            text.push_str(&format!("i {name}\n"));
        }
    }
    std::fs::write(flat.path().join("emva1288.txt"), &text).unwrap();
    let named = flat.path().display().to_string();
    let outcome = fit_of(&folder, &["--flat", &named, "--focal-mm", "0.3", "--json"]);
    let found = json_of(&outcome);
    let table = found["roll_off"]["table"].as_array().unwrap_or_else(|| panic!("{outcome:?}"));
    assert_eq!(table.len(), 13);
    for row in table {
        let [angle_deg, found] = [0, 1].map(|column| row[column].as_f64().unwrap());
        let square = libm::cos(angle_deg.to_radians()) * libm::cos(angle_deg.to_radians());
        let truth = square * square;
        // The curve is of fourth degree in the radius; cos^4 lies within 0.6 % of one to the corner.
        assert!((found - truth).abs() < 0.01, "{angle_deg}: {found} {truth}");
    }
    assert!(found["roll_off"]["left_over"].as_f64().unwrap() < 0.02, "{found}");
    let outcome = fit_of(&folder, &["--flat", &named]);
    assert!(outcome.code == 2 && outcome.stderr.contains("--focal-mm"), "{outcome:?}");
    let outcome = fit_of(&folder, &["--flat", &named, "--focal-mm", "0.3"]);
    let table =
        outcome.stdout.lines().skip_while(|line| !line.contains("[optics]")).take(3).collect::<Vec<_>>().join("\n");
    let table: toml::Table = toml::from_str(&table).unwrap_or_else(|error| panic!("{error}: {table}"));
    assert_eq!(
        table["optics"]["roll_off_table"].as_array().unwrap().len(),
        13,
        "the lines that are printed are those of a scenario"
    );
}

#[test]
fn frames_may_be_tiff_files() {
    let folder = Scratch::new("fit");
    shoot(folder.path(), &random(5).assignments);
    let raw = fit_of(&folder, &["--json"]);
    for entry in std::fs::read_dir(folder.path().join("frames")).unwrap() {
        let path = entry.unwrap().path();
        let codes =
            std::fs::read(&path).unwrap().chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]])).collect();
        let picture: image::ImageBuffer<image::Luma<u16>, Vec<u16>> =
            image::ImageBuffer::from_raw(128, 96, codes).unwrap();
        picture.save_with_format(&path, image::ImageFormat::Tiff).unwrap();
    }
    let tiff = fit_of(&folder, &["--json"]);
    assert!(raw.code == 0 && raw.stdout == tiff.stdout, "{tiff:?}");
}

fn json_of(outcome: &Outcome) -> serde_json::Value {
    assert_eq!(outcome.code, 0, "{outcome:?}");
    serde_json::from_str(&outcome.stdout).unwrap()
}

fn fit_of(folder: &Scratch, more: &[&str]) -> Outcome {
    sensel(&[&["fit", &folder.path().display().to_string()], more].concat())
}

#[test]
fn the_sensor_file_that_is_written_is_a_preset_and_measures_as_the_frames_did() {
    let folder = Scratch::new("fit");
    shoot(folder.path(), &random(3).assignments);
    let own = Scratch::new("fit");
    let file = own.join("mine.toml");
    let outcome = fit_of(&folder, &["--out", &file]);
    assert_eq!(outcome.code, 0, "{outcome:?}");
    assert!(outcome.stdout.contains("pixel.read_noise_uv") && outcome.stdout.contains("assumed"), "{outcome:?}");
    let again = fit_of(&folder, &["--out", &file]);
    assert!(again.code == 2 && again.stderr.contains("is there already"), "{again:?}");
    // The simulated sensor's frames, fitted once more, give the same parameters within both intervals.
    let second = Scratch::new("fit");
    let result = second.join("frames");
    let words = ["characterize", &file, "--size", "128x96", "--points", "40", "--stack", "32", "--out", &result];
    let measured = sensel(&words);
    assert_eq!(measured.code, 0, "{measured:?}");
    // The preset's own conversion gain is the file's, so only ratios to it are compared.
    let [first, second] = [folder.path().to_owned(), second.path().join("frames")].map(|folder| fitted(&folder));
    for key in ["pixel.quantum_efficiency", "pixel.read_noise_uv", "pixel.prnu", "pixel.dsnu_e", "adc.black_level_dn"] {
        let [a, b] = [&first, &second].map(|fit| fit.get(key).unwrap());
        // Two 95 % intervals of one truth overlap but for one case in 200.
        assert!(a.interval[0] <= b.interval[1] && b.interval[0] <= a.interval[1], "{a:?} {b:?}");
    }
}

#[test]
fn frames_that_cannot_tell_are_refused_with_what_would_help() {
    let descriptor = |lines: &str| {
        let folder = Scratch::new("fit");
        std::fs::write(folder.path().join("emva1288.txt"), lines).unwrap();
        folder
    };
    let pair = "b 1000 10\ni a.raw\ni b.raw\n";
    let cases = [
        ("v 4.0\n", "n BITS WIDTH HEIGHT"),
        ("n 12 64\n", "n 12 640 480"),
        ("n 40 64 64\n", "1 to 16 bits"),
        ("n 8 64 64\ni a.raw\n", "before the first i"),
        ("n 8 64 64\nb x 3\n", "b EXPOSURE_NS PHOTONS"),
        ("n 8 64 64\nb 1e30 3\n", "1 to 1e15 ns"),
        ("n 8 64 64\nq\n", "n, b, d or i"),
        ("n 8 64 64\nn 12 64 64\n", "one line n"),
        (&format!("n 8 64 64\n{pair}"), "no bright stack"),
    ];
    for (lines, accepted) in cases {
        let outcome = fit_of(&descriptor(lines), &[]);
        assert!(outcome.code == 2 && outcome.stderr.contains(accepted), "{lines}: {outcome:?}");
        assert_eq!(outcome.stderr.lines().count(), 1, "{outcome:?}");
    }
    let nothing = Scratch::new("fit");
    assert!(fit_of(&nothing, &[]).stderr.contains("emva1288.txt"));
    // A whole set whose frames are damaged in turn.
    let folder = Scratch::new("fit");
    shoot(folder.path(), &random(1).assignments);
    let frame = folder.path().join("frames/f00003.raw");
    let bytes = std::fs::read(&frame).unwrap();
    std::fs::write(&frame, &bytes[1..]).unwrap();
    assert!(fit_of(&folder, &[]).stderr.contains("take 24576"));
    std::fs::write(&frame, vec![0xFF; bytes.len()]).unwrap();
    assert!(fit_of(&folder, &[]).stderr.contains("beyond"));
    std::fs::write(&frame, &bytes).unwrap();
    let text = std::fs::read_to_string(folder.path().join("emva1288.txt")).unwrap();
    std::fs::write(folder.path().join("emva1288.txt"), text.replace("n 12", "n 16").replace("n 10", "n 16")).unwrap();
    let shallow = fit_of(&folder, &[]);
    assert!(shallow.stderr.contains("if the frames have fewer bits"), "{shallow:?}");
}

#[test]
fn the_page_shows_the_frames_beside_those_of_the_fitted_sensor_and_finds_an_effect_that_only_one_side_has() {
    let folder = Scratch::new("fit");
    shoot(folder.path(), &random(3).assignments);
    let own = Scratch::new("fit");
    let page = own.join("page.html");
    let outcome = fit_of(&folder, &["--page", &page]);
    assert_eq!(outcome.code, 0, "{outcome:?}");
    let text = std::fs::read_to_string(&page).unwrap();
    for words in
        ["Photon transfer", "Codes in the dark", "Dark noise: spectrum along rows", "Response: spectrum along columns"]
    {
        assert!(text.contains(words), "{words}");
    }
    assert_eq!(text.matches("data:image/png;base64").count(), 8, "four contents, both sides");
    assert!(!text.contains("http://") && !text.contains("https://"), "the page needs no network");
    // 4 standard errors, some 30 figures: a true fit leaves none.
    assert!(text.contains(">EMVA 1288 figures of both sides. 0 of 3"), "{}", differing(&text));
    // Noises of the preset that are part of what was measured do not count twice.
    let preset = own.join("preset.toml");
    let parts = "[sensor]\npreset = \"paper_6t_vga\"\n[sensor.pixel]\nktc_noise_uv = 900.0\nflicker_uv_per_rthz = 900.0\n\
                 [sensor.adc]\ncomparator_noise_uv = 900.0\nramp_noise_uv = 900.0\n";
    std::fs::write(&preset, parts).unwrap();
    let outcome = fit_of(&folder, &["--page", &page, "--preset", &preset]);
    assert_eq!(outcome.code, 0, "{outcome:?}");
    let text = std::fs::read_to_string(&page).unwrap();
    assert!(text.contains(">EMVA 1288 figures of both sides. 0 of 3"), "{}", differing(&text));
    // Ripple on the supply, which the preset alone has, bands the simulated rows.
    let noisy =
        "[sensor]\npreset = \"paper_6t_vga\"\n[sensor.adc]\nsupply_ripple_uv = 2000.0\nsupply_ripple_hz = 12345.0\n";
    std::fs::write(&preset, noisy).unwrap();
    let outcome = fit_of(&folder, &["--page", &page, "--preset", &preset]);
    assert_eq!(outcome.code, 0, "{outcome:?}");
    let text = std::fs::read_to_string(&page).unwrap();
    assert!(!text.contains(">EMVA 1288 figures of both sides. 0 of 3") && text.contains("class=\"num left\""));
    let wrong = fit_of(&folder, &["--page", &own.join("page.txt")]);
    assert!(wrong.code == 2 && wrong.stderr.contains("page.html"), "{wrong:?}");
}

/// What a page says of the figures that differ.
fn differing(page: &str) -> &str {
    page.split("EMVA 1288 figures of both sides").nth(1).map_or(page, |rest| &rest[..rest.len().min(200)])
}

#[test]
fn one_frame_saturated_stacks_and_eight_bits_said_to_be_more_are_told() {
    let folder = Scratch::new("fit");
    shoot(folder.path(), &random(1).assignments);
    let descriptor = folder.path().join("emva1288.txt");
    let text = std::fs::read_to_string(&descriptor).unwrap();
    // One frame of each group.
    let mut is_first = true;
    let single: Vec<&str> = text
        .lines()
        .filter(|line| {
            let keep = !line.starts_with("i ") || is_first;
            is_first = !line.starts_with("i ");
            keep
        })
        .collect();
    std::fs::write(&descriptor, single.join("\n")).unwrap();
    let outcome = fit_of(&folder, &[]);
    assert!(outcome.code == 2 && outcome.stderr.contains("no bright stack; use 8 or more"), "{outcome:?}");
    std::fs::write(&descriptor, &text).unwrap();
    let frames: Vec<_> =
        std::fs::read_dir(folder.path().join("frames")).unwrap().map(|entry| entry.unwrap().path()).collect();
    assert!(frames.len() > 200, "{}", frames.len());
    let depth: u32 = text.lines().find_map(|line| line.strip_prefix("n ")?.split(' ').next()?.parse().ok()).unwrap();
    // Photons that are far too few, and pairs that are all bright.
    let scarce: Vec<String> = text
        .lines()
        .map(|line| match line.split(' ').collect::<Vec<_>>()[..] {
            ["b", exposure, photons] => format!("b {exposure} {}", 0.1 * photons.parse::<f64>().unwrap()),
            _ => line.to_owned(),
        })
        .collect();
    std::fs::write(&descriptor, scarce.join("\n")).unwrap();
    let outcome = fit_of(&folder, &[]);
    assert!(outcome.code == 0 && outcome.stderr.contains("electrons a photon are more than one"), "{outcome:?}");
    assert!(outcome.stdout.contains("full_scale_uv"), "the rest is told: {outcome:?}");
    let groups: Vec<&str> = text.split("\nb ").collect();
    let (head, bright) = (groups[0], &groups[groups.len() - 12..]);
    std::fs::write(&descriptor, format!("{head}\nb {}\n", bright.join("\nb "))).unwrap();
    let outcome = fit_of(&folder, &[]);
    assert!(outcome.code == 2 && outcome.stderr.contains("add pairs of shorter exposures"), "{outcome:?}");
    std::fs::write(&descriptor, &text).unwrap();
    // The same frames with eight bits.
    for frame in &frames {
        let bytes = std::fs::read(frame).unwrap();
        let codes = bytes.chunks_exact(2).map(|pair| u16::from_le_bytes([pair[0], pair[1]]) >> (depth - 8));
        std::fs::write(frame, codes.flat_map(u16::to_le_bytes).collect::<Vec<u8>>()).unwrap();
    }
    std::fs::write(&descriptor, text.replace(&format!("n {depth} "), "n 12 ")).unwrap();
    let outcome = fit_of(&folder, &[]);
    assert!(outcome.stderr.contains("of 12 bits; if the frames have fewer bits"), "{outcome:?}");
    // A bright stack at the greatest code.
    let stack: Vec<&str> = text.split("\nb ").last().unwrap().split("\nd ").next().unwrap().lines().collect();
    let mut filled = 0;
    for line in stack.iter().filter_map(|line| line.strip_prefix("i ")) {
        let frame = folder.path().join(line.replace('\\', "/"));
        let bytes = std::fs::read(&frame).unwrap();
        std::fs::write(&frame, 4095_u16.to_le_bytes().repeat(bytes.len() / 2)).unwrap();
        filled += 1;
    }
    assert_eq!(filled, 32);
    let outcome = fit_of(&folder, &[]);
    assert!(outcome.code == 2 && outcome.stderr.contains("bright stack is saturated"), "{outcome:?}");
}
