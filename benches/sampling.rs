//! Render variance over photon variance in the furnished room, for docs/sampling.md: `cargo bench --bench sampling`.
//!
//! Renders the default scenario at VGA, 10 ms of exposure, rolling rows, 1,000 e- in the mean of the pixels below 10,000 e-.
//! Prints a Markdown table; `--svg FILE` draws it. Truth is two renders of 2,048 samples with different keys, whose own
//! noise is taken out of every error (`case`). "error" is over all pixels below saturation; "sensor" is what is left of it where no pixel
//! shows more than saturation; "off lamps" is over pixels without a saturated one beside them. "seeds" is half the mean square
//! difference of two renders with different keys, which has no part of the bias (as "sensor"); "bias" is what two of them have in
//! common against the truth, "own" what the render says of itself, "cpu" processor seconds of a frame.
//! `--cells` prints one table of five scenes and three motions at tolerances 0.4 and 0.1 (or that of `--k`).
//! `--quick` renders 320 x 240 pixels; `--reference N` takes another number of samples for the truth, `--keep FOLDER` keeps truths for the
//! next run of the same code, `--pairs N` averages over so many pairs of renders, `--only NAME` one motion, `--least N` and `--most N`
//! fewer rows of a fixed number, `--fixed` none to a target, `--k K` only targets up to K, `--rays` no sub-frames, `--worst` lists the
//! pixels with the most error; `--reflections N` and `--gloss` follow reflections.

#[path = "sampling/case.rs"]
mod case;
#[path = "sampling/picture.rs"]
mod picture;
#[path = "common/scenario.rs"]
mod scenario;

use case::{Case, Row, Truth, levelled};
use glam::DVec3;
use sensel::draw::DrawKey;
use sensel::optics::Sampling;
use sensel::run::Setup;

/// Rows and columns, and those of `--quick`.
const SIZES: [[u32; 2]; 2] = [[480, 640], [240, 320]];
const FIXED: [u32; 10] = [1, 2, 4, 8, 16, 32, 64, 128, 256, 1_024];
/// Most samples, tolerance.
const ADAPTIVE: [(u32, f64); 9] = [
    (16, 4.0),
    (64, 4.0),
    (256, 2.0),
    (1_024, 1.0),
    (1_024, 0.5),
    (1_024, 0.2),
    (1_024, 0.17),
    (1_024, 0.14),
    (1_024, 0.1),
];
const SUBFRAMES: [u32; 4] = [4, 16, 64, 256];

fn setup(scene: &str) -> Setup {
    let [rows, columns] = size();
    let set = [format!("sensor.width={columns}"), format!("sensor.height={rows}"), "run.frames=1".to_owned()];
    scenario::setup(scene, &set.each_ref().map(String::as_str))
}

fn size() -> [u32; 2] {
    SIZES[usize::from(flag("--quick"))]
}

fn flag(name: &str) -> bool {
    std::env::args().any(|argument| argument == name)
}

fn number_after(name: &str) -> Option<String> {
    let arguments: Vec<String> = std::env::args().collect();
    arguments.windows(2).find(|pair| pair[0] == name).map(|pair| pair[1].clone())
}

fn print(label: &str, row: &Row) {
    let Row { rays, cpu_s, error, sensor, off_lamps, seeds, bias, own, off } = row;
    println!(
        "| {label} | {rays:.2} | {:.4} | {:.4} +- {:.4} | {off_lamps:.4} | {seeds:.4} | {bias:.4} | {own:.4} | {off:+.5} | {cpu_s:.2} |",
        error[0], sensor[0], sensor[1]
    );
}

/// What is known of a truth, and the head of its table.
fn print_truth(name: &str, case: &Case, truth: &Truth) {
    let [all, sensor] = case.noise_of(truth);
    println!("\n{name}: the truth's own noise is {all:.4}, as the sensor shows it {sensor:.4}");
    println!("\n| {name} | rays | error | sensor | off lamps | seeds | bias | own | mean off | cpu |");
    println!("|---|---|---|---|---|---|---|---|---|---|");
}

/// The table of docs/sampling.md: five scenes and three motions at one tolerance each.
fn print_cells(tolerances: &[f64], reference: u32, pairs: u64) {
    println!("| scene | motion | k | rays | error | bias | own | own / error | own / (error - bias) | CPU s |");
    println!("|---|---|---|---|---|---|---|---|---|---|");
    for scene in scenario::FIVE {
        let setup = setup(scene);
        for (name, velocity, turn) in motions() {
            let named = format!("{scene} {name}");
            let case = levelled(&setup, &named, velocity, turn);
            let truth = case.truth(reference);
            for &tolerance in tolerances {
                let sampling = Sampling { samples_max: 1_024, tolerance, ..Sampling::fixed(1, DrawKey::root(1)) };
                let Row { rays, cpu_s, sensor, bias, own, .. } = case.row(sampling, &truth, pairs);
                println!(
                    "| {scene} | {name} | {tolerance} | {rays:.1} | {:.3} +- {:.3} | {bias:.3} | {own:.3} | {:.2} | {:.2} | {cpu_s:.2} |",
                    sensor[0],
                    sensor[1],
                    own / sensor[0],
                    own / (sensor[0] - bias)
                );
            }
        }
    }
}

fn motions() -> [(&'static str, DVec3, f64); 3] {
    [
        ("still", DVec3::ZERO, 0.0),
        ("walking", DVec3::new(0.3, 0.0, 1.37), 0.5),
        ("200 deg/s", DVec3::ZERO, 200_f64.to_radians()),
    ]
}

fn main() {
    let number = |name: &str, unless: u32| number_after(name).map_or(unless, |text| text.parse().expect("a number"));
    if flag("--cells") {
        let tolerance = number_after("--k").map_or(vec![0.4, 0.1], |text| vec![text.parse().expect("a number")]);
        print_cells(&tolerance, number("--reference", 1_024), u64::from(number("--pairs", 2)));
        return;
    }
    let setup = setup("bathroom");
    let cases = motions();
    let mut curves = Vec::new();
    let only = number_after("--only");
    let (most, least, pairs) = (number("--most", 256), number("--least", 1), u64::from(number("--pairs", 1)));
    let tolerance_most: f64 = number_after("--k").map_or(f64::INFINITY, |text| text.parse().expect("a number"));
    let targets = || ADAPTIVE.into_iter().filter(|row| row.1 <= tolerance_most && !flag("--fixed"));
    for (name, velocity, turn) in cases.into_iter().filter(|case| only.as_ref().is_none_or(|only| only == case.0)) {
        let case = levelled(&setup, name, velocity, turn);
        let truth = case.truth(number("--reference", 2_048));
        print_truth(name, &case, &truth);
        let key = DrawKey::root(1);
        let mut curve = Vec::new();
        for samples in FIXED.into_iter().filter(|&samples| (least..=most).contains(&samples)) {
            let row = case.row(Sampling::fixed(samples, key), &truth, pairs);
            print("fixed", &row);
            curve.push((row.rays, row.sensor[0]));
        }
        curves.push((name.to_owned(), curve));
        let mut curve = Vec::new();
        for (samples_max, tolerance) in targets() {
            let row = case.row(Sampling { samples_max, tolerance, ..Sampling::fixed(1, key) }, &truth, pairs);
            print(&format!("up to {samples_max}, k = {tolerance}"), &row);
            curve.push((row.rays, row.sensor[0]));
        }
        curves.push((format!("{name}, adaptive"), curve));
        let mut curve = Vec::new();
        for subframes in SUBFRAMES.into_iter().filter(|&subframes| subframes <= most && !flag("--rays")) {
            let row = case.row(Sampling { subframes, ..Sampling::fixed(1, key) }, &truth, pairs);
            print(&format!("{subframes} sub-frames"), &row);
            curve.push((row.rays, row.sensor[0]));
        }
        curves.push((format!("{name}, sub-frames"), curve));
    }
    if let Some(path) = number_after("--svg") {
        std::fs::write(path, picture::svg(&curves)).expect("the picture's folder is there");
    }
}
