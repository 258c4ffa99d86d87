//! `run --accuracy` and `run --time-budget`: from a goal to settings, by a pilot or by what an earlier pilot found.

use sensel::error::Error;
use sensel::ladder::{ChosenSetting, Goal, LadderBench, PILOT_FRAMES, StudyClocks, choose};
use sensel::run::{Assets, Setup, Stopwatch};

use super::args::{CommonOptions, RunVerbArguments};
use super::clocks::{ProcessorTime, WallTime};
use super::progress::Study;
use super::setup::FolderAssets;
use super::words;

/// Keys that a goal decides.
const DECIDED: [&str; 5] =
    ["run.samples_per_pixel", "run.render_tolerance", "run.samples_max", "run.sampling", "run.accuracy"];

/// What the command line asks for.
pub fn of(verb: &RunVerbArguments, shared: &CommonOptions) -> Result<Option<Goal>, Error> {
    let goal = match (verb.accuracy, &verb.time_budget) {
        (None, None) => return Ok(None),
        (Some(accuracy), _) if (0.1..=10.0).contains(&accuracy) => Goal::Accuracy(accuracy),
        (Some(accuracy), _) => return Err(Error::key("--accuracy", accuracy, "out of range; use 0.1 to 10")),
        (None, Some(time)) => Goal::Time(milliseconds(time)?),
    };
    for assignment in &shared.set {
        let (key, value) = assignment.split_once('=').unwrap_or((assignment, ""));
        let key = key.trim();
        if DECIDED.contains(&key) || key == "run.reflections" {
            let reason = "is what --accuracy and --time-budget decide; give one of the two";
            return Err(Error::key(key, value.trim(), reason));
        }
    }
    if verb.run.rung.as_deref().is_some_and(|rung| rung != "sampled") {
        let reason = "--accuracy and --time-budget choose settings of the rung sampled; leave out --rung";
        return Err(Error::key("--rung", verb.run.rung.as_deref().unwrap_or_default(), reason));
    }
    Ok(Some(goal))
}

fn milliseconds(text: &str) -> Result<f64, Error> {
    let parsed = |number: &str, factor: f64| number.trim().parse::<f64>().ok().map(|value| value * factor);
    let found = match (text.strip_suffix("ms"), text.strip_suffix('s')) {
        (Some(number), _) => parsed(number, 1.0),
        (None, Some(number)) => parsed(number, 1e3),
        (None, None) => None,
    };
    let in_range = found.filter(|ms| (0.1..=1e7).contains(ms));
    in_range.ok_or_else(|| Error::key("--time-budget", text, "use a time of 0.1ms or more, as 50ms or 0.2s"))
}

/// The setup of the cheapest settings that meet the goal; says which, and why. Bytes are promised for the configuration that the run
/// writes, which names them.
pub fn resolve(setup: Setup, goal: Goal, assets: &FolderAssets, shared: &CommonOptions) -> Result<Setup, Error> {
    let threads = rayon::current_num_threads();
    let named =
        format!("choice of {} for {} by {goal:?} on {threads}", env!("CARGO_PKG_VERSION"), setup.resolved.hash());
    let key = blake3::hash(named.as_bytes()).to_hex().to_string();
    let kept = assets.load(&key).and_then(|bytes| serde_json::from_slice::<ChosenSetting>(&bytes).ok());
    let is_kept = kept.is_some();
    let (choice, setup) = match kept {
        Some(choice) => (choice, setup),
        None => {
            let (wall, work, progress) = (WallTime::start(), ProcessorTime::start(), Study::new(shared.quiet));
            let work_before_s = work.now_s();
            let clocks = StudyClocks { wall: &wall, work: &work };
            if !shared.quiet {
                announce(&setup);
            }
            let bench = LadderBench { setup, clocks, progress: &progress, assets };
            let choice = choose(&bench, goal)?;
            if !shared.quiet {
                let (wall, work) = (duration(wall.now_s()), duration(work.now_s() - work_before_s));
                words::note(&format!("the pilot took {wall}, {work} of processor time"));
            }
            let text = serde_json::to_vec(&choice).map_err(|error| Error::Run(error.to_string()))?;
            assets.store(&key, &text);
            (choice, bench.setup)
        }
    };
    if !shared.quiet {
        say(&choice, goal, is_kept);
    }
    let resolved = setup.resolved.with(&choice.settings)?;
    let mut again = setup.again(resolved)?;
    setup.warnings.texts().iter().for_each(|text| again.warnings.add(text));
    Ok(again)
}

/// What the pilot will do, before it does it.
fn announce(setup: &Setup) {
    let (pictures, size) = (PILOT_FRAMES.min(setup.frames), setup.sensor.size);
    words::note(&format!(
        "a pilot looks for the cheapest settings: a reference of {pictures} pictures of {} x {}, then a dozen settings or so on \
         them; minutes where pictures are large and the goal is fine. What it finds is kept for this configuration.",
        size.width_px, size.height_px,
    ));
}

fn duration(seconds: f64) -> String {
    if seconds < 100.0 { format!("{seconds:.0} s") } else { format!("{:.1} min", seconds / 60.0) }
}

fn say(choice: &ChosenSetting, goal: Goal, is_kept: bool) {
    let asked = match goal {
        Goal::Accuracy(accuracy) => format!("at most {accuracy} of photon noise"),
        Goal::Time(wall_ms) => format!("at most {wall_ms} ms per frame"),
    };
    let from = if is_kept { "by an earlier pilot" } else { "by a pilot" };
    let ChosenSetting { words, pictures, photon_noise_ratio, with_margin, wall_ms_per_frame, tried, .. } = choice;
    words::note(&format!(
        "{asked}: {words} ({from} on {pictures} pictures: error {photon_noise_ratio:.2}, {with_margin:.2} with its margin; \
         {wall_ms_per_frame:.0} ms per frame; of {tried} settings)"
    ));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn times_have_a_unit() {
        assert_eq!(milliseconds("50ms").unwrap(), 50.0);
        assert_eq!(milliseconds("0.2s").unwrap(), 200.0);
        for refused in ["50", "ms", "-3ms", "0ms", "NaNs", "1h"] {
            assert_eq!(milliseconds(refused).err().unwrap().exit_code(), 2, "{refused}");
        }
    }
}
