//! Compares `run --accuracy` with a brute-force search over five scenes and two accuracies. Arguments: scene names (default: all five)
//! and `KEY=VALUE` assignments for all of them. Prints the pilot's choice and the grid's best point, both judged on frames that the pilot
//! did not see.
//!
//! `cargo run --release --example ladder_search [SCENE ...] [KEY=VALUE ...]`. Times are processor time of all threads (Linux); each setting
//! is timed in turns with all others, and the least of the turns counts.

use std::path::Path;
use std::time::Instant;

use sensel::config::Resolved;
use sensel::error::Error;
use sensel::files::cache::Cache;
use sensel::files::input::InputFolders;
use sensel::ladder::{
    EffectsKnob, Goal, HeldOut, LadderBench, PILOT_FRAMES, RayBudget, Setting, SettingVerdict, StudyClocks, choose,
};
use sensel::run::{Assets, NoFiles, NoProgress, Setup, Stopwatch};
use sensel::scene::images::PictureBytes;
use sensel::scene::lit::REFLECTIONS_MAX;

const SCENES: [&str; 5] = ["bathroom", "bathroom_night", "hall", "street", "photo_box"];
const ACCURACIES: [f64; 2] = [0.5, 1.0];
const REPEATS: u32 = 3;
/// What one look shows to take at most so many times as long as the fastest is timed in turns with it.
const NEARLY: f64 = 1.2;

/// Frames that are judged, in 32nds of the run: between those that a pilot looks at, which are odd 24ths.
const HELD_OUT: [u32; 8] = [1, 5, 9, 13, 17, 21, 25, 29];

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

/// Every family of rays and reflections on a fine grid, each from coarse to fine.
fn render_grid(own: &Setting, keeps_images: bool) -> Vec<Vec<Setting>> {
    let mut all = Vec::new();
    let mut numbers = if keeps_images { vec![REFLECTIONS_MAX, own.reflections, 0] } else { vec![own.reflections] };
    numbers.dedup();
    for reflections in numbers {
        let of = |rays| Setting { rays, reflections, ..own.clone() };
        all.push([1, 2, 4, 8, 16].map(|samples| of(RayBudget::Fixed(samples))).into());
        for most in [256, 1024, 65_536] {
            let tolerances = [8.0, 4.0, 2.8, 2.0, 1.4, 1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12];
            let finer = [0.09, 0.06, 0.045, 0.03, 0.02, 0.014, 0.01];
            let tolerances = tolerances.into_iter().chain(finer.into_iter().filter(|_| most == 65_536));
            all.push(tolerances.map(|tolerance| of(RayBudget::Tolerance { tolerance, most })).collect());
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

/// Every point of the grid that meets the loosest goal, each render measured once. Along the tolerances of one family errors fall and times
/// grow, so that what is finer than two neighbours that meet the finest goal is beaten by them and is not rendered.
fn explore(
    held_out: &HeldOut<'_>,
    families: &[Vec<Setting>],
    least_chain: f64,
) -> Result<Vec<(Setting, SettingVerdict)>, Error> {
    let [finest, loosest] = ACCURACIES;
    let mut all = Vec::new();
    for family in families {
        let mut met = 0;
        for setting in family {
            let Some(verdict) = held_out.render_within(setting, loosest)? else { continue };
            let square = verdict.photon_noise_ratio * verdict.photon_noise_ratio + least_chain * least_chain;
            let meets = square <= finest * finest;
            met = if meets { met + 1 } else { 0 };
            all.push((setting.clone(), verdict));
            if met == 2 {
                break;
            }
        }
    }
    Ok(all)
}

/// Whether a render is nearly the fastest that meets some goal with some chain, by what one look at it says.
fn is_near(one: &SettingVerdict, all: &[(Setting, SettingVerdict)], chains: &[SettingVerdict]) -> bool {
    ACCURACIES.into_iter().any(|accuracy| {
        let time = |render: &SettingVerdict| {
            let both = chains.iter().map(|chain| render.and(*chain)).filter(|both| both.photon_noise_ratio <= accuracy);
            both.map(|both| both.cost.work_ms).fold(f64::INFINITY, f64::min)
        };
        let least_ms = all.iter().map(|(_, render)| time(render)).fold(f64::INFINITY, f64::min);
        time(one) <= NEARLY * least_ms
    })
}

fn search(scene: &str, set: &[String]) -> Result<(), Error> {
    let wall = Wall(Instant::now());
    let clocks = StudyClocks { wall: &wall, work: &Work };
    let bench = LadderBench { setup: setup(scene, set)?, clocks, progress: &NoProgress, assets: &NoFiles };
    let own = Setting::of(&bench.setup.resolved.scenario);
    let frames = HELD_OUT.map(|part| part * bench.setup.frames / 32);
    assert!(
        bench.picture_ids(PILOT_FRAMES).iter().all(|seen| !frames.contains(&seen.frame.0)),
        "frames {frames:?} were seen"
    );
    let mut chosen = Vec::new();
    for accuracy in ACCURACIES {
        let (before_s, work_s) = (wall.now_s(), Work.now_s());
        let choice = choose(&bench, Goal::Accuracy(accuracy))?;
        let (took_s, took_work_s) = (wall.now_s() - before_s, Work.now_s() - work_s);
        eprintln!("{scene} {accuracy}: {choice:?}, {took_s:.0} s, {took_work_s:.0} s of CPU");
        chosen.push(Setting::of(&bench.setup.resolved.with(&choice.settings)?.scenario));
    }
    // Where nothing keeps an image, reflections are a knob of nothing.
    let keeps_images =
        bench.setup.world.scene().is_some_and(|scene| scene.has_gloss(bench.setup.fidelity.render.follows_gloss));
    let held_out = HeldOut::new(&bench, &frames, ACCURACIES[0])?;
    let chains = [chosen.clone(), chain_grid(&own)].concat();
    let chain_verdicts = held_out.chains(&chains, 2 * REPEATS)?;
    let of_grid = &chain_verdicts[ACCURACIES.len()..];
    let least_chain = of_grid.iter().map(|chain| chain.photon_noise_ratio).fold(f64::INFINITY, f64::min);
    let seen = explore(&held_out, &render_grid(&own, keeps_images), least_chain)?;
    eprintln!("{scene}: {} renders of the grid meet {}, {:.0} s", seen.len(), ACCURACIES[1], wall.now_s());
    let near = seen.iter().filter(|(_, verdict)| is_near(verdict, &seen, of_grid)).map(|(setting, _)| setting.clone());
    // What was chosen is timed within the same turns as what is nearly the best of the grid.
    let renders: Vec<Setting> = chosen.iter().cloned().chain(near).collect();
    let verdicts = held_out.renders(&renders, REPEATS)?;
    let all: Vec<(Setting, SettingVerdict)> = (ACCURACIES.len()..renders.len())
        .flat_map(|render| (ACCURACIES.len()..chains.len()).map(move |chain| (render, chain)))
        .map(|(render, chain)| {
            let setting = Setting { effects: chains[chain].effects.clone(), ..renders[render].clone() };
            (setting, verdicts[render].and(chain_verdicts[chain]))
        })
        .collect();
    for (at, accuracy) in ACCURACIES.into_iter().enumerate() {
        let found = verdicts[at].and(chain_verdicts[at]);
        print_row(scene, accuracy, &chosen[at], found, &all);
    }
    eprintln!("{scene}: {:.0} s, {:.0} s of CPU in all", wall.now_s(), Work.now_s());
    Ok(())
}

fn print_row(scene: &str, accuracy: f64, chosen: &Setting, found: SettingVerdict, all: &[(Setting, SettingVerdict)]) {
    let met = all.iter().filter(|(_, verdict)| verdict.photon_noise_ratio <= accuracy);
    let best = met.min_by(|a, b| a.1.cost.work_ms.total_cmp(&b.1.cost.work_ms));
    let (words, error, cost_ms) = best.map_or(("none".to_owned(), f64::NAN, f64::NAN), |(setting, verdict)| {
        (setting.words(), verdict.photon_noise_ratio, verdict.cost.work_ms)
    });
    println!(
        "| {scene} | {accuracy} | {} | {:.3} | {:.1} | {words} | {error:.3} | {cost_ms:.1} | {:.2} |",
        chosen.words(),
        found.photon_noise_ratio,
        found.cost.work_ms,
        found.cost.work_ms / cost_ms
    );
}
