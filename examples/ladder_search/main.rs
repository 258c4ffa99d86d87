//! Holds `run --accuracy` against a search by brute force: five scenes, two accuracies. Enters: scene names (default: all five). Leaves: a
//! table of the pilot's choice and of the best point of the grid, both judged on frames that the pilot did not see.
//!
//! `cargo run --release --example ladder_search [SCENE ...]`

use std::path::Path;
use std::time::Instant;

use sensel::config::Resolved;
use sensel::error::Error;
use sensel::files::input::InputFolders;
use sensel::ladder::{Bench, Clocks, EffectsKnob, Goal, Rays, Setting, choose, judge};
use sensel::run::{Assets, NoProgress, Setup, Stopwatch};
use sensel::scene::images::PictureBytes;

const SCENES: [&str; 5] = ["bathroom", "bathroom_night", "hall", "street", "photo_box"];
const ACCURACIES: [f64; 2] = [0.5, 1.0];

/// Two frames between those that a pilot looks at, an eighth and five eighths into the run.
const HELD_OUT: [u32; 2] = [1, 5];

struct Wall(Instant);

impl Stopwatch for Wall {
    fn now_s(&self) -> f64 {
        self.0.elapsed().as_secs_f64()
    }
}

struct Files(InputFolders);

impl Assets for Files {
    fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        self.0.read(name)
    }
}

fn main() -> Result<(), Error> {
    let named: Vec<String> = std::env::args().skip(1).collect();
    let scenes: Vec<&str> = if named.is_empty() { SCENES.to_vec() } else { named.iter().map(String::as_str).collect() };
    println!("| scene | goal | chosen | error | CPU ms | best of the grid | error | CPU ms | times |");
    println!("|---|---|---|---|---|---|---|---|---|");
    for scene in scenes {
        search(scene)?;
    }
    Ok(())
}

fn setup(scene: &str) -> Result<Setup, Error> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("scenes").join(scene);
    let file = folder.join("scene.toml");
    let text = sensel::files::read_text(&file, 1 << 20)?;
    let resolved = Resolved::from_layers(&file.display().to_string(), &text, &[])?;
    let scenes = folder.parent().map(|scenes| scenes.join("bathroom"));
    let folders = std::iter::once(folder).chain(scenes).collect();
    Setup::new(resolved, &Files(InputFolders::new(folders)), &NoProgress)
}

/// Every family of settings on a fine grid.
fn grid(own: &Setting) -> Vec<Setting> {
    let mut all = Vec::new();
    let mut families = vec![own.reflections];
    families.extend((own.reflections > 0).then_some(0));
    for reflections in families {
        let of = |rays| Setting { rays, reflections, ..own.clone() };
        all.extend([1, 2, 4, 8, 16, 32].map(|samples| of(Rays::Fixed(samples))));
        for most in [64, 256, 1024] {
            for tolerance in [2.0, 1.5, 1.0, 0.7, 0.5, 0.35, 0.25, 0.18, 0.12] {
                all.push(of(Rays::Tolerance { tolerance, most }));
            }
        }
    }
    all
}

fn search(scene: &str) -> Result<(), Error> {
    let wall = Wall(Instant::now());
    let bench = Bench { setup: setup(scene)?, clocks: Clocks { wall: &wall, work: &wall }, progress: &NoProgress };
    let own = Setting::of(&bench.setup.resolved.scenario);
    let frames = HELD_OUT.map(|eighth| eighth * bench.setup.frames / 8);
    for accuracy in ACCURACIES {
        let choice = choose(&bench, Goal::Accuracy(accuracy))?;
        let chosen = Setting::of(&bench.setup.resolved.with(&choice.settings)?.scenario);
        // The chosen one is timed within the same turns as the grid; effects are the scenario's own in both.
        let mut settings = vec![Setting { effects: own_effects(&own), ..chosen.clone() }];
        settings.extend(grid(&own));
        let verdicts = judge(&bench, &settings, &frames, 0.5 * accuracy, 2)?;
        let met = (1..settings.len()).filter(|&place| verdicts[place].photon_noise_ratio <= accuracy);
        let best = met.min_by(|&a, &b| verdicts[a].cost.work_ms.total_cmp(&verdicts[b].cost.work_ms));
        let chosen_cost = verdicts[0].cost.work_ms;
        let (words, error, cost) = best.map_or(("none".to_owned(), f64::NAN, f64::NAN), |place| {
            (settings[place].words(), verdicts[place].photon_noise_ratio, verdicts[place].cost.work_ms)
        });
        println!(
            "| {scene} | {accuracy} | {} | {:.3} | {chosen_cost:.0} | {words} | {error:.3} | {cost:.0} | {:.2} |",
            chosen.words(),
            verdicts[0].photon_noise_ratio,
            chosen_cost / cost
        );
    }
    Ok(())
}

fn own_effects(own: &Setting) -> EffectsKnob {
    own.effects.clone()
}
