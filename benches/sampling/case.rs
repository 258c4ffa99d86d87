//! Runs one motion through the furnished room under its light and measures its error as render variance over photon variance.
//!
//! A truth is two renders A and B with keys of their own: the mean of (S - A)(S - B) over a render S is its error without theirs, and a
//! quarter of (A - B)^2 is the noise of their mean. What a render and a truth have in common (a bias of the code that made both) shows
//! in neither.

use std::time::Instant;

use glam::{DQuat, DVec3};
use sensel::draw::DrawKey;
use sensel::num::{f32_nearest, f64_from_usize};
use sensel::optics::{Exposure, Sampling, render};
use sensel::plane::Plane;
use sensel::pose::Pose;
use sensel::run::Setup;
use sensel::units::{Size, Span};

use super::{flag, number_after, size};

const EXPOSURE_S: f64 = 0.010;
const ROW_S: f64 = 30e-6;
const MEAN_E: f64 = 1_000.0;
/// Saturation over the mean.
const SATURATION: f64 = 10.0;

/// One motion with its light level.
pub struct Case<'a> {
    setup: &'a Setup,
    name: &'a str,
    velocity_m_per_s: DVec3,
    turn_rad_per_s: f64,
    electrons_per_photon: f64,
    saturation_photons: f32,
}

/// Two renders that are taken for the truth.
pub struct Truth {
    halves: [Plane<f32>; 2],
    /// Their mean.
    pub photons: Plane<f32>,
    /// Pixels that are lit and below saturation.
    pub counted: Vec<bool>,
    /// Those of them without a saturated one beside them.
    pub off_lamps: Vec<bool>,
}

/// What renders of one kind have in common.
pub struct Row {
    /// Rays per pixel.
    pub rays: f64,
    /// Processor time of a frame, seconds.
    pub cpu_s: f64,
    /// Over all counted pixels, and its standard error by what renders scatter.
    pub error: [f64; 2],
    /// The same, where nothing shows more than saturation.
    pub sensor: [f64; 2],
    /// That over pixels without a saturated one beside them.
    pub off_lamps: f64,
    /// Half the mean square of what two renders differ by, as the sensor shows it.
    pub seeds: f64,
    /// Product of two renders' errors to one truth each: their bias against it.
    pub bias: f64,
    /// The render's own word.
    pub own: f64,
    /// Shift of the picture's mean.
    pub off: f64,
}

impl Case<'_> {
    /// A render.
    pub fn render(&self, sampling: Sampling) -> Exposure {
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

    /// Mean over counted pixels of a product of two differences over the photons, in electrons, nothing above `limit`, and its standard
    /// error if pixels are independent.
    fn product(
        &self,
        [[a, b], [c, d]]: [[&Plane<f32>; 2]; 2],
        truth: &Truth,
        counted: &[bool],
        limit: f32,
    ) -> [f64; 2] {
        let (mut sum, mut squares, mut count) = (0.0, 0.0, 0.0);
        for (at, &mean) in truth.photons.values().iter().enumerate().filter(|(at, _)| counted[*at]) {
            let seen = |plane: &Plane<f32>| f64::from(plane.values()[at].min(limit));
            let term = (seen(a) - seen(b)) * (seen(c) - seen(d)) / f64::from(mean);
            sum += term;
            squares += term * term;
            count += 1.0;
        }
        let spread: f64 = squares / count - (sum / count) * (sum / count);
        [self.electrons_per_photon * sum / count, self.electrons_per_photon * (spread.max(0.0) / count).sqrt()]
    }

    /// Two renders of so many samples, with keys that no row uses.
    fn two(&self, samples: u32) -> [Plane<f32>; 2] {
        [0, 1].map(|half: u64| {
            let key = DrawKey::root(98 + half);
            let read = || self.kept(samples, half).and_then(|path| std::fs::read(path).ok());
            if let Some(bytes) = read() {
                let values = bytes.chunks_exact(4).map(|four| f32::from_le_bytes(four.try_into().expect("four bytes")));
                return Plane::from_values(Size { width_px: size()[1], height_px: size()[0] }, values.collect());
            }
            let photons = self.render(Sampling::fixed(samples, key)).photons;
            if let Some(path) = self.kept(samples, half) {
                let bytes: Vec<u8> = photons.values().iter().flat_map(|value| value.to_le_bytes()).collect();
                std::fs::write(path, bytes).expect("the folder for truths is there");
            }
            photons
        })
    }

    /// Where a truth is kept for the next run, if it is.
    fn kept(&self, samples: u32, half: u64) -> Option<String> {
        let name = self.name.replace(['/', ' '], "_");
        let [rows, _] = size();
        number_after("--keep").map(|folder| format!("{folder}/{name}_{rows}_{samples}_{half}.f32"))
    }

    /// A truth of two renders of so many samples.
    pub fn truth(&self, samples: u32) -> Truth {
        let halves = self.two(samples);
        let mean = halves[0].values().iter().zip(halves[1].values()).map(|(a, b)| 0.5 * (a + b)).collect();
        let photons = Plane::from_values(halves[0].size(), mean);
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
        Truth { halves, photons, counted, off_lamps }
    }

    /// Noise of a truth's mean: all counted pixels, and as the sensor shows it.
    pub fn noise_of(&self, truth: &Truth) -> [f64; 2] {
        let [a, b] = &truth.halves;
        [f32::INFINITY, self.saturation_photons]
            .map(|limit| 0.25 * self.product([[a, b], [a, b]], truth, &truth.counted, limit)[0])
    }

    /// What `2 * pairs` renders have in common.
    pub fn row(&self, sampling: Sampling, truth: &Truth, pairs: u64) -> Row {
        let begin_s = cpu_s();
        let all: Vec<Exposure> =
            (11..11 + 2 * pairs).map(|seed| self.render(Sampling { key: DrawKey::root(seed), ..sampling })).collect();
        let count = f64_from_usize(all.len());
        let cpu_s = (cpu_s() - begin_s) / count;
        let planes: Vec<&Plane<f32>> = all.iter().map(|exposure| &exposure.photons).collect();
        if flag("--worst") {
            self.print_worst(planes[0], truth);
        }
        let ([a, b], limit) = ([&truth.halves[0], &truth.halves[1]], self.saturation_photons);
        let error = |counted: &[bool], limit: f32| {
            let of = |s: &&Plane<f32>| self.product([[s, a], [s, b]], truth, counted, limit)[0];
            mean_of(&planes.iter().map(of).collect::<Vec<f64>>())
        };
        let seen = |pair: &[&Plane<f32>]| {
            let [s, u] = [pair[0], pair[1]];
            let seeds = 0.5 * self.product([[s, u], [s, u]], truth, &truth.counted, limit)[0];
            let bias = |first, second| self.product([[s, first], [u, second]], truth, &truth.counted, limit)[0];
            (seeds, 0.5 * (bias(a, b) + bias(b, a)))
        };
        let by_pair: Vec<(f64, f64)> = planes.chunks_exact(2).map(seen).collect();
        let (mut apart, mut light) = (0.0, 0.0);
        for (at, &mean) in truth.photons.values().iter().enumerate().filter(|(at, _)| truth.counted[*at]) {
            apart += planes.iter().map(|plane| f64::from(plane.values()[at] - mean)).sum::<f64>() / count;
            light += f64::from(mean);
        }
        let pixels = f64::from(size()[0] * size()[1]);
        let rays = |exposure: &Exposure| f64::from(u32::try_from(exposure.rays).expect("a small picture")) / pixels;
        Row {
            rays: all.iter().map(rays).sum::<f64>() / count,
            cpu_s,
            error: error(&truth.counted, f32::INFINITY),
            sensor: error(&truth.counted, limit),
            off_lamps: error(&truth.off_lamps, limit)[0],
            seeds: mean_of(&by_pair.iter().map(|pair| pair.0).collect::<Vec<f64>>())[0],
            bias: mean_of(&by_pair.iter().map(|pair| pair.1).collect::<Vec<f64>>())[0],
            own: all.iter().map(|exposure| exposure.render_variance_ratio).sum::<f64>() / count,
            off: apart / light,
        }
    }

    /// The pixels with the most error, each with its share of the mean ratio, and how much of it the worst tenths of a percent have.
    fn print_worst(&self, photons: &Plane<f32>, truth: &Truth) {
        let mut errors: Vec<(f64, usize)> = Vec::new();
        for (at, &mean) in truth.photons.values().iter().enumerate().filter(|(at, _)| truth.counted[*at]) {
            let apart = |half: usize| f64::from(photons.values()[at] - truth.halves[half].values()[at]);
            errors.push((self.electrons_per_photon * apart(0) * apart(1) / f64::from(mean), at));
        }
        errors.sort_by(|a, b| b.0.total_cmp(&a.0));
        let count = errors.len();
        let sum = |from: usize| errors[from..].iter().map(|(error, _)| error).sum::<f64>();
        let all = sum(0);
        let per_pixel = 1.0 / f64_from_usize(count);
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

/// A mean and its standard error by the scatter.
fn mean_of(values: &[f64]) -> [f64; 2] {
    let count = f64_from_usize(values.len());
    let mean = values.iter().sum::<f64>() / count;
    let scatter = values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / (count - 1.0);
    [mean, if count > 1.0 { (scatter / count).sqrt() } else { f64::NAN }]
}

/// Processor time of all threads so far; wall time where the system does not tell.
fn cpu_s() -> f64 {
    thread_local!(static BEGIN: Instant = Instant::now());
    std::thread::yield_now();
    let of = |text: String| text.split_whitespace().next().and_then(|word| word.parse::<f64>().ok());
    let threads = || -> Option<f64> {
        let mut sum_s = 0.0;
        for thread in std::fs::read_dir("/proc/self/task").ok()? {
            sum_s += 1e-9 * of(std::fs::read_to_string(thread.ok()?.path().join("schedstat")).ok()?)?;
        }
        Some(sum_s)
    };
    threads().unwrap_or_else(|| BEGIN.with(|begin| begin.elapsed().as_secs_f64()))
}

/// Light level of a case from a first look: 1,000 e- in the mean of what is below ten times that.
pub fn levelled<'a>(setup: &'a Setup, name: &'a str, velocity_m_per_s: DVec3, turn_rad_per_s: f64) -> Case<'a> {
    let (electrons_per_photon, saturation_photons) = (1.0, f32::INFINITY);
    let mut case = Case { setup, name, velocity_m_per_s, turn_rad_per_s, electrons_per_photon, saturation_photons };
    let look = case.render(Sampling::fixed(16, DrawKey::root(1))).photons;
    for _ in 0..20 {
        let counted = || look.values().iter().filter(|&&value| value < case.saturation_photons).map(|&v| f64::from(v));
        let mean = counted().sum::<f64>() / f64_from_usize(counted().count());
        case.electrons_per_photon = MEAN_E / mean;
        case.saturation_photons = f32_nearest(SATURATION * mean);
    }
    case
}
