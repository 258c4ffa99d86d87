//! Holds `run --accuracy` against a search by brute force: five scenes, two accuracies. Enters: scene names (default: all five) and
//! `KEY=VALUE` assignments for all of them. Leaves: a table of the pilot's choice and of the best point of the grid, both judged on
//! frames that the pilot did not see.
//!
//! `cargo run --release --example ladder_search [SCENE ...] [KEY=VALUE ...]`. Times are processor time of all threads (Linux); each setting
//! is timed in turns with all others, and the least of the turns counts.

use std::path::Path;
use std::time::Instant;

use sensel::config::Resolved;
use sensel::error::Error;
use sensel::files::cache::Cache;
use sensel::files::input::InputFolders;
use sensel::ladder::{Bench, Clocks, EffectsKnob, Goal, Rays, Setting, Verdict, choose, judge_parts};
use sensel::run::{Assets, NoFiles, NoProgress, Setup, Stopwatch};
use sensel::scene::images::PictureBytes;
use sensel::scene::lit::BOUNCES_MAX;

const SCENES: [&str; 5] = ["bathroom", "bathroom_night", "hall", "street", "photo_box"];
const ACCURACIES: [f64; 2] = [0.5, 1.0];
const REPEATS: u32 = 3;

/// Two frames between those that a pilot looks at, an eighth and five eighths into the run.
const HELD_OUT: [u32; 2] = [1, 5];

struct Wall(Instant);

impl Stopwatch for Wall {
    fn now_s(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }
}

/// Processor time of all threads of this process, by the kernel's own account of each, which yielding brings up to date.
struct Work;

impl Stopwatch for Work {
    fn now_s(&self) -> f64 {
        std::thread::yield_now();
        let tasks = std::fs::read_dir("/proc/self/task").expect("Linux tells of a process's threads");
        let of = |task: std::io::Result<std::fs::DirEntry>| {
            let text = std::fs::read_to_string(task.ok()?.path().join("schedstat")).ok()?;
            text.split(' ').next()?.parse::<f64>().ok()
        };
        1e-9 * tasks.filter_map(of).sum::<f64>()
    }
}

/// A scene's folder, and the user's cache of baked light.
struct Files(InputFolders, Option<Cache>);

impl Assets for Files {
    fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        self.0.read(name)
    }

    fn load(&self, key: &str) -> Option<Vec<u8>> {
        self.1.as_ref()?.get(key)
    }

    fn store(&self, key: &str, bytes: &[u8]) {
        if let Some(Err(error)) = self.1.as_ref().map(|cache| cache.put(key, bytes)) {
            eprintln!("baked light is not kept: {error}");
        }
    }
}

fn main() -> Result<(), Error> {
    let (set, named): (Vec<String>, Vec<String>) = std::env::args().skip(1).partition(|word| word.contains('='));
    let scenes: Vec<&str> = if named.is_empty() { SCENES.to_vec() } else { named.iter().map(String::as_str).collect() };
    println!("| scene | goal | chosen | error | CPU ms | best of the grid | error | CPU ms | times |");
    println!("|---|---|---|---|---|---|---|---|---|");
    for scene in scenes {
        search(scene, &set)?;
    }
    Ok(())
}

fn setup(scene: &str, set: &[String]) -> Result<Setup, Error> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(scene);
    let file = folder.join("scene.toml");
    let text = sensel::files::read_text(&file, 1 << 20)?;
    let resolved = Resolved::from_layers(&file.display().to_string(), &text, set)?;
    let scenes = folder.parent().map(|scenes| scenes.join("bathroom"));
    let folders = std::iter::once(folder).chain(scenes).collect();
    Setup::new(resolved, &Files(InputFolders::new(folders), Cache::open(None, 1 << 30).ok()), &NoProgress)
}

/// Every family of rays and reflections on a fine grid.
fn render_grid(own: &Setting, keeps_images: bool) -> Vec<Setting> {
    let mut all = Vec::new();
    let mut families = if keeps_images { vec![BOUNCES_MAX, own.reflections, 0] } else { vec![own.reflections] };
    families.dedup();
    for reflections in families {
        let of = |rays| Setting { rays, reflections, ..own.clone() };
        all.extend([1, 2, 4, 8, 16].map(|samples| of(Rays::Fixed(samples))));
        for most in [256, 1024, 65_536] {
            for tolerance in [8.0, 4.0, 2.8, 2.0, 1.4, 1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12] {
                all.push(of(Rays::Tolerance { tolerance, most }));
            }
        }
    }
    all
}

/// Every tolerance of effects.
fn chain_grid(own: &Setting) -> Vec<Setting> {
    let EffectsKnob::Planned { words, .. } = &own.effects else { return vec![own.clone()] };
    let of = |tolerance| EffectsKnob::Planned { words: words.clone(), tolerance };
    [0.01, 0.03, 0.1, 0.2, 0.3, 0.5, 0.7, 1.0].map(|tolerance| Setting { effects: of(tolerance), ..own.clone() }).into()
}

fn search(scene: &str, set: &[String]) -> Result<(), Error> {
    let wall = Wall(Instant::now());
    let clocks = Clocks { wall: &wall, work: &Work };
    let bench = Bench { setup: setup(scene, set)?, clocks, progress: &NoProgress, assets: &NoFiles };
    let own = Setting::of(&bench.setup.resolved.scenario);
    let frames = HELD_OUT.map(|eighth| eighth * bench.setup.frames / 8);
    assert!(bench.places(5).iter().all(|seen| !frames.contains(&seen.frame.0)), "frames {frames:?} were seen");
    let mut chosen = Vec::new();
    for accuracy in ACCURACIES {
        let choice = choose(&bench, Goal::Accuracy(accuracy))?;
        eprintln!("{scene} {accuracy}: {choice:?}, {:.0} s", wall.now_s());
        chosen.push(Setting::of(&bench.setup.resolved.with(&choice.settings)?.scenario));
    }
    // Where nothing keeps an image, reflections are a knob of nothing.
    let keeps_images =
        bench.setup.world.scene().is_some_and(|scene| scene.has_gloss(bench.setup.fidelity.follows_gloss));
    // What was chosen is timed within the same turns as the grid.
    let renders = [chosen.clone(), render_grid(&own, keeps_images)].concat();
    let chains = [chosen.clone(), chain_grid(&own)].concat();
    let parts = judge_parts(&bench, &renders, &chains, &frames, ACCURACIES[0], REPEATS)?;
    let all: Vec<(Setting, Verdict)> = (ACCURACIES.len()..renders.len())
        .flat_map(|render| (ACCURACIES.len()..chains.len()).map(move |chain| (render, chain)))
        .map(|(render, chain)| {
            let setting = Setting { effects: chains[chain].effects.clone(), ..renders[render].clone() };
            (setting, parts.renders[render].and(parts.chains[chain]))
        })
        .collect();
    for (place, accuracy) in ACCURACIES.into_iter().enumerate() {
        let found = parts.renders[place].and(parts.chains[place]);
        let met = all.iter().filter(|(_, verdict)| verdict.photon_noise_ratio <= accuracy);
        let best = met.min_by(|a, b| a.1.cost.work_ms.total_cmp(&b.1.cost.work_ms));
        let (words, error, cost_ms) = best.map_or(("none".to_owned(), f64::NAN, f64::NAN), |(setting, verdict)| {
            (setting.words(), verdict.photon_noise_ratio, verdict.cost.work_ms)
        });
        println!(
            "| {scene} | {accuracy} | {} | {:.3} | {:.0} | {words} | {error:.3} | {cost_ms:.0} | {:.2} |",
            chosen[place].words(),
            found.photon_noise_ratio,
            found.cost.work_ms,
            found.cost.work_ms / cost_ms
        );
    }
    eprintln!("{scene}: {:.0} s", wall.now_s());
    Ok(())
}
