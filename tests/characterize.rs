//! `characterize` without a judge: its own figures meet its own truth, what cannot be measured is said in words, and the same
//! configuration gives the same bytes.

#![allow(clippy::unwrap_used)]

use crate::common;

use common::{Scratch, sensel};
use sensel::characterize::{ChannelTruth, Characterization, MeasurementSize, SensorBench};
use sensel::config::Resolved;
use sensel::units::Size;

fn sensor(assignments: &[&str]) -> Resolved {
    let text = "[sensor]\npreset = \"paper_6t_vga\"\n";
    let assignments: Vec<String> = assignments.iter().map(|&word| word.to_owned()).collect();
    Resolved::from_layers("test", text, &assignments).unwrap()
}

fn small() -> MeasurementSize {
    MeasurementSize {
        size: Some(Size { width_px: 160, height_px: 120 }),
        points: 40,
        stack: 32,
        ..MeasurementSize::default()
    }
}

fn measured(assignments: &[&str], options: &MeasurementSize) -> (Characterization, ChannelTruth) {
    let resolved = sensor(assignments);
    let bench = SensorBench::new(&resolved, options).unwrap();
    let measurement = bench.run(|_, _| Ok(())).unwrap();
    (Characterization::new("test", &resolved, &bench, &measurement), bench.truth())
}

#[test]
fn own_figures_meet_the_truth_of_the_configuration() {
    let (record, truth) = measured(&[], &small());
    let mut held = 0;
    for (name, want) in truth.wants.iter() {
        let value = record.figures.get(name).unwrap().value.unwrap();
        if let (Some(expected), Some(tolerance)) = (want.value, want.abs_tol) {
            assert!((value - expected).abs() <= tolerance, "{name}: {value}, {expected} +- {tolerance}");
        }
        assert!(want.min.is_none_or(|min| value >= min) && want.max.is_none_or(|max| value <= max), "{name}: {value}");
        held += 1;
    }
    // All 28 but the row parts, which this sensor does not have, and PRNU's column part and the third cumulant, for which 160x120 with 32
    // frames is too small.
    assert_eq!(held, 24, "{:?}", truth.not_measurable);
    let reason = truth.not_measurable.get("x_k3_ratio").unwrap();
    assert!(reason.contains("frames, or more pixels"), "{reason}");
}

#[test]
fn a_tolerance_shrinks_with_the_root_of_the_pixels() {
    let tolerance = |width_px, height_px| {
        let options = MeasurementSize { size: Some(Size { width_px, height_px }), ..MeasurementSize::default() };
        SensorBench::new(&sensor(&[]), &options).unwrap().truth().wants.get("QE").unwrap().abs_tol.unwrap()
    };
    let ratio = tolerance(100, 80) / tolerance(400, 320);
    // Sixteen times the pixels: four times less, as every term of QE's error falls with their root; dark charge of four times as many
    // waiting rows is 0.05 e-^2 of the 110 e-^2 of the dark noise's variance.
    assert!((ratio - 4.0).abs() < 1e-3, "{ratio}");
}

#[test]
fn a_black_level_too_low_for_the_noise_leaves_no_figure_and_the_level_that_would_do_does() {
    let options = small();
    let (record, truth) = measured(&["sensor.adc.black_level_dn=2"], &options);
    assert!(truth.wants.is_empty());
    let reason = truth.not_measurable.get("K").unwrap();
    assert!(reason.contains("black level 2 DN is too low"), "{reason}");
    assert!(record.figures.iter().all(|(_, figure)| figure.value.is_none() && figure.not_measurable.is_some()));
    let would_do = reason.split("black_level_dn = ").nth(1).unwrap().split(' ').next().unwrap();
    let (record, truth) = measured(&[&format!("sensor.adc.black_level_dn={would_do}")], &options);
    assert!(truth.wants.get("K").is_some(), "{would_do}: {:?}", truth.not_measurable);
    assert!(record.dark_clipped < 0.005, "{}", record.dark_clipped);
}

#[test]
fn dark_noise_that_quantisation_hides_is_not_reported_and_gain_still_is() {
    let (_, truth) = measured(&["sensor.pixel.read_noise_uv=20"], &small());
    for name in ["sigma_d", "sigma_y_dark", "u_p_min", "DSNU1288", "DR_dB"] {
        let reason = truth.not_measurable.get(name).unwrap();
        assert!(reason.contains("below 0.3 DN"), "{name}: {reason}");
    }
    for name in ["K", "R", "QE", "u_e_sat", "PRNU1288"] {
        assert!(truth.wants.get(name).is_some(), "{name}: {:?}", truth.not_measurable.get(name));
    }
}

#[test]
fn a_die_whose_dark_charge_fills_the_pixel_is_said_to_be_too_hot() {
    let (record, truth) = measured(&["sensor.temperature_k=450"], &small());
    assert!(truth.wants.is_empty());
    let reason = truth.not_measurable.get("R").unwrap();
    assert!(reason.contains("use a cooler die"), "{reason}");
    assert!(record.to_json().contains("use a cooler die"));
}

#[test]
fn a_sensor_of_too_few_electrons_or_bits_is_said_to_be_so() {
    let coarse = ["sensor.adc.bits=5", "sensor.adc.black_level_dn=4"];
    for (assignments, words) in [(&coarse[..], "use more bits"), (&["sensor.pixel.full_well_e=1"], "30 e- or more")] {
        let (record, truth) = measured(assignments, &small());
        assert!(truth.wants.is_empty() && truth.not_measurable.get("K").unwrap().contains(words), "{assignments:?}");
        assert!(record.figures.iter().all(|(_, figure)| figure.value.is_none()));
    }
}

#[test]
fn what_cannot_be_measured_is_refused_by_key() {
    let refused = |arguments: &[&str]| {
        let scratch = Scratch::new("characterize");
        let mut all = vec!["characterize", "paper_6t_vga"];
        all.extend(arguments);
        let out = scratch.join("out");
        all.extend(["--out", &out]);
        let outcome = sensel(&all);
        assert_eq!(outcome.code, 2, "{arguments:?}: {}", outcome.stderr);
        assert!(scratch.names().is_empty(), "nothing is left behind");
        outcome.stderr
    };
    let cases: [(&[&str], &str); 6] = [
        (&["--points", "12"], "points = 12: out of range; use 40 to 1000"),
        (&["--stack", "9"], "stack = 9: out of range; use 32 to 2000"),
        (&["--size", "8x8"], "size = 8x8: out of range; use 16x16 to 640x480"),
        (&["--size", "large"], "use WIDTHxHEIGHT such as 320x240"),
        (&["--set", "sensor.pixel.quantum_efficiency=0"], "use above 0"),
        (&["--set", "sensor.adc.bits=99"], "sensor.adc.bits = 99"),
    ];
    for (arguments, words) in cases {
        let said = refused(arguments);
        assert!(said.contains(words), "{arguments:?}: {said}");
    }
    let unknown = sensel(&["characterize", "imx9999"]);
    assert!(unknown.code == 2 && unknown.stderr.contains("paper_6t_vga"), "{}", unknown.stderr);
}

#[test]
fn threads_change_no_byte_and_another_seed_changes_noise_but_not_truth() {
    let scratch = Scratch::new("characterize");
    let shoot = |name: &str, more: &[&str]| {
        let out = scratch.join(name);
        let mut all = vec!["characterize", "paper_6t_vga", "--size", "64x48", "--json", "--out", &out];
        all.extend(more);
        let json = sensel(&all).json();
        let read = |file: &str| std::fs::read(scratch.path().join(name).join(file)).unwrap();
        (json, read("frames/f00010.raw"), read("characterization.json"), read("truth.json"), read("emva1288.txt"))
    };
    let (one, two) = (shoot("one", &["--threads", "1"]), shoot("two", &["--threads", "2"]));
    assert_eq!((&one.0, &one.1, &one.3, &one.4), (&two.0, &two.1, &two.3, &two.4));
    let other = shoot("other", &["--seed", "2"]);
    assert!(other.1 != one.1 && other.3 == one.3 && other.4 == one.4);
    assert!(one.0["K"]["value"].as_f64().unwrap() > 0.0 && one.0["K"]["standard_error"].as_f64().unwrap() > 0.0);
    let descriptor = String::from_utf8(one.4).unwrap();
    assert!(descriptor.starts_with("v 4.0\nn 10 64 48\nb "), "{descriptor}");
    assert_eq!(descriptor.lines().filter(|line| line.starts_with('i')).count(), 42 * 4 + 2 * 48);
    assert_eq!(std::fs::read_dir(scratch.path().join("one/frames")).unwrap().count(), 42 * 4 + 2 * 48);
}
