//! Render variance over photon variance in the furnished room, for docs/sampling.md: `cargo bench --bench sampling`.
//!
//! Enters: the default scenario at VGA, 10 ms of exposure, rolling rows, 1,000 e- in the mean of the pixels below 10,000 e-.
//! Leaves: a Markdown table, and with `--svg FILE` its picture. Truth is a render of 2,048 samples with another key, and tells by
//! its own mean which pixels are below saturation. "error" is over all of them; "sensor" is what is left of it where no pixel shows
//! more than saturation; "off lamps" is over pixels without a saturated one beside them. "seeds" is half the mean square difference
//! of two renders with different keys, which has no part of the bias (as "sensor"); "own" is what the render says of itself.
//! `--quick` renders 320 x 240 pixels; `--reference N` takes another number of samples for the truth, `--only NAME` one motion,
//! `--least N` and `--most N` fewer rows of a fixed number, `--fixed` none to a target, `--k K` only targets up to K, `--rays` no
//! sub-frames, `--worst` lists the pixels with the most error; `--reflections N` and `--gloss` follow reflections.

use std::fmt::Write as _;

use glam::{DQuat, DVec3};
use sensel::config::Resolved;
use sensel::draw::DrawKey;
use sensel::error::Error;
use sensel::files::cache::Cache;
use sensel::optics::{Exposure, Sampling, render};
use sensel::plane::Plane;
use sensel::pose::Pose;
use sensel::run::{Assets, NoProgress, Setup};
use sensel::units::Span;

const FOLDER: &str = concat!(env!("CARGO_MANIFEST_DIR"), "/scenes/bathroom");
/// Rows and columns, and those of `--quick`.
const SIZES: [[u32; 2]; 2] = [[480, 640], [240, 320]];
const EXPOSURE_S: f64 = 0.010;
const ROW_S: f64 = 30e-6;
const MEAN_E: f64 = 1_000.0;
/// Saturation over the mean.
const SATURATION: f64 = 10.0;
const FIXED: [u32; 9] = [1, 2, 4, 8, 16, 32, 64, 128, 256];
/// Most samples, tolerance.
const ADAPTIVE: [(u32, f64); 8] =
    [(16, 4.0), (64, 4.0), (256, 2.0), (1_024, 1.0), (1_024, 0.5), (1_024, 0.2), (1_024, 0.1), (1_024, 0.05)];
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

/// One motion with its light level.
struct Case<'a> {
    setup: &'a Setup,
    velocity_m_per_s: DVec3,
    turn_rad_per_s: f64,
    electrons_per_photon: f64,
    saturation_photons: f32,
}

impl Case<'_> {
    fn render(&self, sampling: Sampling) -> Exposure {
        let start = self.setup.motion.world_from_body(0.0).expect("a motion has a start");
        let camera = &self.setup.windows[0];
        // Velocity and turn are the camera's own, so that all motions start from one picture.
        let pose = |t_s: f64| {
            let turn = DQuat::from_rotation_y(self.turn_rad_per_s * t_s);
            let moved = Pose::new(turn, self.velocity_m_per_s * t_s);
            let from_camera = camera.body_from_camera;
            start.then(&from_camera).then(&moved).then(&from_camera.inverse())
        };
        let span = |row: u32| {
            let start_s = ROW_S * f64::from(row);
            Span { start_s, end_s: start_s + EXPOSURE_S }
        };
        let shutter: Vec<Span> = (0..size()[0]).map(span).collect();
        let sampling = Sampling {
            reflections: number_after("--reflections").map_or(0, |text| text.parse().expect("a number")),
            follows_gloss: flag("--gloss"),
            electrons_per_photon: self.electrons_per_photon,
            saturation_photons: self.saturation_photons,
            ..sampling
        };
        render(self.setup.world.scene().expect("a scene with geometry"), camera, &shutter, &pose, sampling)
    }

    /// Mean over counted pixels of the square of the difference over the photons, in electrons, nothing above `limit`.
    fn ratio(&self, [a, b]: [&Plane<f32>; 2], truth: &Truth, counted: &[bool], limit: f32) -> f64 {
        let (mut sum, mut count) = (0.0, 0.0);
        for (at, &mean) in truth.photons.values().iter().enumerate().filter(|(at, _)| counted[*at]) {
            let apart = f64::from(a.values()[at].min(limit)) - f64::from(b.values()[at].min(limit));
            sum += apart * apart / f64::from(mean);
            count += 1.0;
        }
        self.electrons_per_photon * sum / count
    }

    fn bias(&self, a: &[Exposure], truth: &Truth) -> f64 {
        // Product of two independent errors: their common part alone is left.
        let (mut sum, mut count) = (0.0, 0.0);
        for (at, &mean) in truth.photons.values().iter().enumerate().filter(|(at, _)| truth.counted[*at]) {
            let seen = |photons: f32| f64::from(photons.min(self.saturation_photons));
            let error = |side: usize| seen(a[side].photons.values()[at]) - f64::from(mean);
            sum += error(0) * error(1) / f64::from(mean);
            count += 1.0;
        }
        self.electrons_per_photon * sum / count
    }

    fn truth(&self, samples: u32) -> Truth {
        let photons = self.render(Sampling::fixed(samples, DrawKey::root(99))).photons;
        let is_below = |photons: f32| photons < self.saturation_photons;
        let counted: Vec<bool> = photons.values().iter().map(|&mean| mean > 0.0 && is_below(mean)).collect();
        let (width, height) = (photons.width_px(), photons.height_px());
        let beside = |at: usize| {
            let (x, y) = (at % width, at / width);
            let mut around = (y.saturating_sub(1)..(y + 2).min(height))
                .flat_map(|y| (x.saturating_sub(1)..(x + 2).min(width)).map(move |x| (x, y)));
            around.all(|(x, y)| is_below(photons.at(x, y)))
        };
        let off_lamps = (0..counted.len()).map(|at| counted[at] && beside(at)).collect();
        Truth { photons, counted, off_lamps }
    }

    /// One row: mean samples; error, as the sensor shows it, off lamps; from seeds, bias, the render's own word; the mean's shift.
    fn row(&self, sampling: Sampling, truth: &Truth) -> [f64; 8] {
        let both = [11, 12].map(|seed| self.render(Sampling { key: DrawKey::root(seed), ..sampling }));
        if flag("--worst") {
            self.print_worst(&both[0].photons, truth);
        }
        let of = |counted: &[bool], limit: f32| {
            let one = |exposure: &Exposure| self.ratio([&exposure.photons, &truth.photons], truth, counted, limit);
            0.5 * (one(&both[0]) + one(&both[1]))
        };
        let limit = self.saturation_photons;
        let errors = [of(&truth.counted, f32::INFINITY), of(&truth.counted, limit), of(&truth.off_lamps, limit)];
        let seeds = 0.5 * self.ratio([&both[0].photons, &both[1].photons], truth, &truth.counted, limit);
        let pixels = f64::from(size()[0] * size()[1]);
        let samples = both.iter().map(|exposure| exposure.rays).sum::<u64>();
        let samples = f64::from(u32::try_from(samples / 2).expect("a small picture")) / pixels;
        let own = 0.5 * (both[0].render_variance_ratio + both[1].render_variance_ratio);
        let (mut apart, mut all) = (0.0, 0.0);
        for (at, &mean) in truth.photons.values().iter().enumerate().filter(|(at, _)| truth.counted[*at]) {
            let mean_of_two = 0.5 * (both[0].photons.values()[at] + both[1].photons.values()[at]);
            apart += f64::from(mean_of_two - mean);
            all += f64::from(mean);
        }
        [samples, errors[0], errors[1], errors[2], seeds, self.bias(&both, truth), own, apart / all]
    }

    /// The pixels with the most error, each with its share of the mean ratio, and how much of it the worst tenths of a percent
    /// have.
    fn print_worst(&self, photons: &Plane<f32>, truth: &Truth) {
        let mut errors: Vec<(f64, usize)> = Vec::new();
        for (at, &mean) in truth.photons.values().iter().enumerate().filter(|(at, _)| truth.counted[*at]) {
            let apart = f64::from(photons.values()[at]) - f64::from(mean);
            errors.push((self.electrons_per_photon * apart * apart / f64::from(mean), at));
        }
        errors.sort_by(|a, b| b.0.total_cmp(&a.0));
        let count = errors.len();
        let sum = |from: usize| errors[from..].iter().map(|(error, _)| error).sum::<f64>();
        let all = sum(0);
        let per_pixel = 1.0 / sensel::num::f64_from_usize(count);
        for per_myriad in [1, 10, 100, 1_000, 5_000] {
            let left = sum(count * per_myriad / 10_000);
            let (share, beyond) = (1.0 - left / all, left * per_pixel);
            println!(
                "    the worst {per_myriad} of 10,000: {share:.3} of the error; {beyond:.4} of the mean beyond them"
            );
        }
        let width = truth.photons.width_px();
        for (error, at) in &errors[..12] {
            let electrons = |photons: f32| f64::from(photons) * self.electrons_per_photon;
            let (x, y) = (at % width, at / width);
            println!(
                "    ({x}, {y}): {:.4} of the mean; {:.0} e- for {:.0} e-{}",
                error * per_pixel,
                electrons(photons.values()[*at]),
                electrons(truth.photons.values()[*at]),
                if truth.off_lamps[*at] { "" } else { ", beside a lamp" }
            );
        }
    }
}

/// A render that is taken for the truth.
struct Truth {
    photons: Plane<f32>,
    /// Pixels that are lit and below saturation.
    counted: Vec<bool>,
    /// Those of them without a saturated one beside them.
    off_lamps: Vec<bool>,
}

/// Light level of a case from a first look: 1,000 e- in the mean of what is below ten times that.
fn levelled<'a>(setup: &'a Setup, velocity_m_per_s: DVec3, turn_rad_per_s: f64) -> Case<'a> {
    let mut case =
        Case { setup, velocity_m_per_s, turn_rad_per_s, electrons_per_photon: 1.0, saturation_photons: f32::INFINITY };
    let look = case.render(Sampling::fixed(16, DrawKey::root(1))).photons;
    for _ in 0..20 {
        let counted = || look.values().iter().filter(|&&value| value < case.saturation_photons).map(|&v| f64::from(v));
        let mean = counted().sum::<f64>() / f64::from(u32::try_from(counted().count()).expect("a small picture"));
        case.electrons_per_photon = MEAN_E / mean;
        case.saturation_photons = sensel::num::f32_nearest(SATURATION * mean);
    }
    case
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

fn main() {
    let reference_samples = number_after("--reference").map_or(2_048, |text| text.parse().expect("a number"));
    let setup = setup();
    let cases = [
        ("still", DVec3::ZERO, 0.0),
        ("walking", DVec3::new(0.3, 0.0, 1.37), 0.5),
        ("200 deg/s", DVec3::ZERO, 200_f64.to_radians()),
    ];
    let mut curves = Vec::new();
    let only = number_after("--only");
    let most: u32 = number_after("--most").map_or(256, |text| text.parse().expect("a number"));
    let least: u32 = number_after("--least").map_or(1, |text| text.parse().expect("a number"));
    let tolerance_most: f64 = number_after("--k").map_or(f64::INFINITY, |text| text.parse().expect("a number"));
    let targets = || ADAPTIVE.into_iter().filter(|row| row.1 <= tolerance_most && !flag("--fixed"));
    for (name, velocity, turn) in cases.into_iter().filter(|case| only.as_ref().is_none_or(|only| only == case.0)) {
        let case = levelled(&setup, velocity, turn);
        let truth = case.truth(reference_samples);
        println!(
            "\n| {name} | samples | error | sensor | off lamps | seeds | bias | own | mean off |\n|---|---|---|---|---|---|---|---|---|"
        );
        let print = |label: &str, [samples, error, sensor, off_lamps, seeds, bias, own, off]: [f64; 8]| {
            println!(
                "| {label} | {samples:.2} | {error:.4} | {sensor:.4} | {off_lamps:.4} | {seeds:.4} | {bias:.4} | {own:.4} | {off:+.5} |"
            );
        };
        let key = DrawKey::root(1);
        let mut curve = Vec::new();
        for samples in FIXED.into_iter().filter(|&samples| (least..=most).contains(&samples)) {
            let row = case.row(Sampling::fixed(samples, key), &truth);
            print("fixed", row);
            curve.push((row[0], row[2]));
        }
        curves.push((name.to_owned(), curve));
        let mut curve = Vec::new();
        for (samples_max, tolerance) in targets() {
            let row = case.row(Sampling { samples_max, tolerance, ..Sampling::fixed(1, key) }, &truth);
            print(&format!("up to {samples_max}, k = {tolerance}"), row);
            curve.push((row[0], row[2]));
        }
        curves.push((format!("{name}, adaptive"), curve));
        let mut curve = Vec::new();
        for subframes in SUBFRAMES.into_iter().filter(|&subframes| subframes <= most && !flag("--rays")) {
            let row = case.row(Sampling { subframes, ..Sampling::fixed(1, key) }, &truth);
            print(&format!("{subframes} sub-frames"), row);
            curve.push((row[0], row[2]));
        }
        curves.push((format!("{name}, sub-frames"), curve));
    }
    if let Some(path) = number_after("--svg") {
        std::fs::write(path, svg(&curves)).expect("the picture's folder is there");
    }
}

/// Curves over doubly logarithmic axes: 1 to 256 samples, 0.001 to 100.
fn svg(curves: &[(String, Vec<(f64, f64)>)]) -> String {
    let x = |samples: f64| 60.0 + 560.0 * libm::log2(samples) / 8.0;
    let y = |ratio: f64| 40.0 + 400.0 * (2.0 - libm::log10(ratio.max(1e-3))) / 5.0;
    let mut text = String::from(
        "<svg xmlns=\"http://www.w3.org/2000/svg\" viewBox=\"0 0 860 490\" font-family=\"sans-serif\" font-size=\"13\">\n\
         <rect width=\"860\" height=\"490\" fill=\"white\"/>\n<text x=\"340\" y=\"480\" text-anchor=\"middle\">samples a pixel</text>\n\
         <text x=\"20\" y=\"24\">render variance over photon variance, 1,000 e- mean</text>\n",
    );
    let add = |text: &mut String, line: String| writeln!(text, "{line}").expect("text grows");
    for power in 0..=8 {
        let at = x(f64::from(1 << power));
        add(
            &mut text,
            format!(
                "<path d=\"M{at:.1} 40V440\" stroke=\"#ddd\"/><text x=\"{at:.1}\" y=\"458\" text-anchor=\"middle\">{}</text>",
                1 << power
            ),
        );
    }
    for ratio in [0.001, 0.01, 0.1, 1.0, 10.0, 100.0] {
        let at = y(ratio);
        let stroke = if ratio == 0.1 { "#888" } else { "#ddd" };
        add(
            &mut text,
            format!(
                "<path d=\"M60 {at:.1}H620\" stroke=\"{stroke}\"/><text x=\"54\" y=\"{:.1}\" text-anchor=\"end\">{ratio}</text>",
                at + 4.0
            ),
        );
    }
    let colours = ["#1b6ca8", "#c8553d", "#2a9d5c"];
    let dashes = ["", "6 3", "1 4"];
    for (number, (name, points)) in curves.iter().enumerate() {
        let place = |&(samples, ratio): &(f64, f64)| format!("{:.1},{:.1}", x(samples), y(ratio));
        let points: Vec<String> = points.iter().map(place).collect();
        let (colour, dash) = (colours[number / 3 % 3], dashes[number % 3]);
        let style = format!(
            "fill=\"none\" stroke=\"{colour}\" stroke-width=\"2\" stroke-dasharray=\"{dash}\" stroke-linecap=\"round\""
        );
        add(&mut text, format!("<polyline points=\"{}\" {style}/>", points.join(" ")));
        let at = 60 + 24 * number;
        add(&mut text, format!("<path d=\"M640 {at}H680\" {style}/><text x=\"688\" y=\"{}\">{name}</text>", at + 4));
    }
    text.push_str("</svg>\n");
    text
}
