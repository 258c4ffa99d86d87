//! The plan's frames against those with all effects: an easy scene, and the worst.

use std::path::Path;
use std::time::Instant;

use sensel::config::Resolved;
use sensel::error::Error;
use sensel::run::{Assets, NoClock, NoProgress, Session, Setup, Stopwatch};

use super::{cpu_s, medians_s};

const ROUNDS: usize = 101;

/// Frames whose stages are timed one by one.
const STAGE_ROUNDS: usize = 25;

struct Folder;

impl Assets for Folder {
    fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes/photo_box").join(name);
        std::fs::read(&path).map_err(|source| Error::Io { path: path.display().to_string(), source })
    }
}

/// The stages' times in CPU seconds.
struct Cpu;

impl Stopwatch for Cpu {
    fn now_s(&self) -> f64 {
        cpu_s()
    }
}

fn session(effects: &str, set: &[&str]) -> Session {
    let own = format!("run.effects='{effects}'");
    let more = ["sensor.width=320", "sensor.height=240", "run.frames=600", "rig.baseline_mm=0.0", own.as_str()];
    let all = GOOD.iter().chain(set).chain(&more);
    let set: Vec<String> = all.map(|text| (*text).to_owned()).collect();
    let resolved = Resolved::from_layers("bench", "", &set).expect("the keys are known");
    Session::new(Setup::new(resolved, &Folder, &NoProgress).expect("it can be run")).expect("it can start")
}

/// A sensor with every effect, as weak as a good one has them today.
const GOOD: &[&str] = &[
    "sensor.pixel.prnu=0.005",
    "sensor.pixel.dark_current_e_per_s=20.0",
    "sensor.pixel.hot_ppm=50.0",
    "sensor.pixel.hot_dark_e_per_s=200.0",
    "sensor.pixel.dsnu_e=0.5",
    "sensor.pixel.blooming=0.05",
    "sensor.pixel.image_lag=1e-5",
    "sensor.pixel.gain_compression=1e-5",
    "sensor.die_gain_sigma=1e-6",
    "sensor.pixel.rts_ppm=100.0",
    "sensor.pixel.rts_amplitude_uv=3.0",
    "sensor.pixel.flicker_uv_per_rthz=0.1",
    "sensor.adc.column_bias_ua=10.0",
    "sensor.pixel.stuck_ppm=20.0",
    "sensor.adc.column_gain_sigma=1e-5",
    "sensor.die_offset_uv=0.05",
    "sensor.adc.column_offset_uv=100.0",
    "sensor.adc.column_offset_residual_uv=1.0",
    "sensor.adc.column_noise_uv=1.0",
    "sensor.adc.row_noise_uv=1.0",
    "sensor.adc.row_offset_uv=1.0",
    "sensor.adc.comparator_noise_uv=2.0",
    "sensor.adc.ramp_noise_uv=1.0",
    "sensor.adc.ramp_jitter_ps=20.0",
    "sensor.adc.supply_ripple_uv=1.0",
];

pub fn print() {
    // Still, bright, monochrome, short exposure: a bright white target of little contrast at half the well.
    let easy: &[&str] = &[
        "scene.target=checkerboard",
        "scene.target_contrast=2.0",
        "scene.target_distance_m=0.5",
        "scene.reflectance=0.5",
        "scene.illuminance_lux=60000.0",
        "motion.kind=still",
        "sensor.pixel.type=6T",
        "sensor.pixel.storage_leakage_per_s=1e-4",
        "sensor.pixel.parasitic_light=1e-8",
        "sensor.readout.exposure_us=50.0",
        "sensor.adc.cds=analog",
    ];
    // Night, running, fisheye, colour, two exposures merged.
    let worst: &[&str] = &[
        "sensor.preset=rggb_rolling",
        "scene.generator=photo_box",
        "scene.bake=direct",
        "scene.illuminance_lux=0.3",
        "motion.kind=run",
        "motion.offset_m=[0.0, 1.5, 0.3]",
        "optics.preset=kb4_190",
        "sensor.readout.hdr=multi_exposure",
        "sensor.readout.exposure_us=8000.0",
    ];
    compare("still, bright, monochrome, 50 us", easy);
    compare("night, running, fisheye, colour, HDR", worst);
}

/// Frames with all effects and with those of the plan, in turns.
fn compare(words: &str, set: &[&str]) {
    let sessions = ["all", "auto"].map(|effects| std::cell::RefCell::new(session(effects, set)));
    for session in &sessions {
        let session = session.borrow();
        let plan = &session.setup().plan;
        println!(
            "{words}: {} left out, kept {:?}",
            plan.omitted.len(),
            plan.kept.iter().map(|effect| effect.name).collect::<Vec<_>>()
        );
    }
    // Whole frames run without a watch inside: each look at the thread's account takes as long as a stage of the easy frame.
    let mut jobs: Vec<Box<dyn FnMut() + '_>> = Vec::new();
    for session in &sessions {
        jobs.push(Box::new(move || drop(session.borrow_mut().step(&NoClock).expect("a frame"))));
    }
    let whole = medians_s(ROUNDS, &mut jobs);
    drop(jobs);
    let sensor = sensor_medians_s(&sessions);
    let plan = sessions[1].borrow().setup().plan.sensor_ms_per_frame;
    println!(
        "{words}: sensor {:.3} ms with all, {:.3} ms planned (predicted {plan:.3}): {:.2} times as fast; whole frame {:.2} ms, {:.2} ms: \
             {:.2} times",
        1e3 * sensor[0],
        1e3 * sensor[1],
        sensor[0] / sensor[1],
        1e3 * whole[0],
        1e3 * whole[1],
        whole[0] / whole[1]
    );
    let frames = STAGE_ROUNDS as f64;
    let stages = ["compute", "link", "host_link", "tracker"];
    let rest: Vec<String> = stages
        .iter()
        .map(|stage| format!("{stage} {:.3} ms", 1e3 * sessions[1].borrow().stage_s(stage) / frames))
        .collect();
    println!("    what the plan does not touch, mean a frame: {}", rest.join(", "));
}

/// The sensor's time in frames of their own, in turns.
fn sensor_medians_s(sessions: &[std::cell::RefCell<Session>; 2]) -> [f64; 2] {
    let mut times = [Vec::new(), Vec::new()];
    for _ in 0..STAGE_ROUNDS {
        for (session, times) in sessions.iter().zip(&mut times) {
            let before_s = session.borrow().stage_s("sensor");
            session.borrow_mut().step(&Cpu).expect("a frame");
            times.push(session.borrow().stage_s("sensor") - before_s);
        }
    }
    times.map(|mut times| {
        times.sort_by(f64::total_cmp);
        times[times.len() / 2]
    })
}

/// Facts and plan anew, the scene being loaded.
pub fn print_planning() {
    for (words, set) in [
        (
            "photo_box, sway",
            &["scene.generator=photo_box", "scene.bake=direct", "motion.kind=sway", "motion.offset_m=[0.0, 1.5, 0.3]"]
                [..],
        ),
        ("checkerboard, still", &["scene.target=checkerboard"][..]),
    ] {
        let session = session("auto", set);
        let mut times: Vec<f64> = (0..15)
            .map(|_| {
                let start = Instant::now();
                std::hint::black_box(session.setup().planned_anew().expect("it was planned before"));
                start.elapsed().as_secs_f64()
            })
            .collect();
        times.sort_by(f64::total_cmp);
        println!("{words}: facts and plan in {:.2} ms", 1e3 * times[7]);
    }
}
