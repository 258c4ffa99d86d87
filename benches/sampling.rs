//! Render variance over photon variance in the furnished room, for docs/sampling.md: `cargo bench --bench sampling`.
//!
//! Enters: the default scenario at VGA, 10 ms of exposure, rolling rows, 1,000 e- in the mean of the pixels below 10,000 e-.
//! Leaves: a Markdown table, and with `--svg FILE` its picture. Truth is two renders of 2,048 samples with keys of their own, whose own
//! noise is taken out of every error (`case`). "error" is over all pixels below saturation; "sensor" is what is left of it where no pixel
//! shows more than saturation; "off lamps" is over pixels without a saturated one beside them. "seeds" is half the mean square
//! difference of two renders with different keys, which has no part of the bias (as "sensor"); "bias" is what two of them have in
//! common against the truth, "own" what the render says of itself, "cpu" processor seconds of a frame.
//! `--quick` renders 320 x 240 pixels; `--reference N` takes another number of samples for the truth, `--keep FOLDER` keeps truths for the
//! next run of the same code, `--pairs N` averages over so many pairs of renders, `--only NAME` one motion, `--least N` and `--most N`
//! fewer rows of a fixed number, `--fixed` none to a target, `--k K` only targets up to K, `--rays` no sub-frames, `--worst` lists the
//! pixels with the most error; `--reflections N` and `--gloss` follow reflections.

#[path = "sampling/case.rs"]
mod case;
#[path = "sampling/picture.rs"]
mod picture;

use case::{Case, Row, Truth, levelled};
use glam::DVec3;
use sensel::config::Resolved;
use sensel::draw::DrawKey;
use sensel::error::Error;
use sensel::files::cache::Cache;
use sensel::optics::Sampling;
use sensel::run::{Assets, NoProgress, Setup};

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/bathroom");
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

struct Files(Cache);

impl Assets for Files {
    fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        std::fs::read(format!("{FOLDER}/{name}")).map_err(|source| Error::Io { path: name.to_owned(), source })
    }

    fn load(&self, key: &str) -> Option<Vec<u8>> {
        self.0.get(key)
    }

    fn store(&self, key: &str, bytes: &[u8]) {
        // Without room in the cache the next bench bakes again.
        let _ = self.0.put(key, bytes);
    }
}

fn setup() -> Setup {
    let text = std::fs::read_to_string(format!("{FOLDER}/scene.toml")).expect("the bathroom lies among the scenes");
    let [rows, columns] = size();
    let set = [format!("sensor.width={columns}"), format!("sensor.height={rows}"), "run.frames=1".to_owned()];
    let resolved = Resolved::from_layers("scene.toml", &text, &set).expect("a sound scenario");
    let cache = Cache::open(None, 1 << 31).expect("a folder for the light");
    Setup::new(resolved, &Files(cache), &NoProgress).expect("a sound scenario")
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

fn main() {
    let number = |name: &str, unless: u32| number_after(name).map_or(unless, |text| text.parse().expect("a number"));
    let setup = setup();
    let cases = [
        ("still", DVec3::ZERO, 0.0),
        ("walking", DVec3::new(0.3, 0.0, 1.37), 0.5),
        ("200 deg/s", DVec3::ZERO, 200_f64.to_radians()),
    ];
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
