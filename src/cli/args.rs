//! The grammar of the command line.

use std::path::PathBuf;

use clap::{Args, Parser, Subcommand};

/// What to try first.
const FIRST: &str = "First: 'sensel run box --frames 30' simulates a small generated room and writes out/box/report.html; \
'sensel run' takes\nthe default scenario, a furnished room. 'sensel presets' lists sensors, lenses and scenes; \
'sensel VERB --help' explains a verb.";

/// A pixel as "column,row".
fn pixel(text: &str) -> Result<(u32, u32), String> {
    let number = |part: &str| part.trim().parse::<u32>().ok();
    text.split_once(',')
        .and_then(|(x, y)| Some((number(x)?, number(y)?)))
        .ok_or_else(|| "must be a column and a row, as in 120,80".to_owned())
}

/// From photons to pose, bit by bit: simulates a machine-perception image sensor end to end.
#[derive(Parser, Debug)]
#[command(name = "sensel", version, about, propagate_version = true, after_help = FIRST)]
pub struct Arguments {
    /// What to do.
    #[command(subcommand)]
    pub verb: Option<Verb>,
    /// Options of every verb.
    #[command(flatten)]
    pub shared: CommonOptions,
}

/// Options of every verb.
#[derive(Args, Debug)]
pub struct CommonOptions {
    /// Sets one key of the scenario, as in --set sensor.adc.bits=8; may be repeated.
    #[arg(long = "set", value_name = "KEY=VALUE", global = true)]
    pub set: Vec<String>,
    /// Seed of the noise of sensors, link and IMU, and of the tracker's random draws. Photons do not depend on it; run.render_seed seeds
    /// the render.
    #[arg(long, global = true)]
    pub seed: Option<u64>,
    /// Where the results go: a folder (default: out/SCENARIO; an earlier result there is replaced, a folder that holds anything else is
    /// refused); of features and track a file.
    #[arg(long, value_name = "PATH", global = true)]
    pub out: Option<PathBuf>,
    /// Threads; 0: as many as cores. Changes no byte of the result.
    #[arg(long, global = true)]
    pub threads: Option<u32>,
    /// Folder of scenarios (default: SENSEL_SCENES, ./scenes, or beside the program).
    #[arg(long, value_name = "DIR", global = true)]
    pub scenes: Option<PathBuf>,
    /// Folder of baked light (default: the user's cache folder).
    #[arg(long, value_name = "DIR", global = true)]
    pub cache: Option<PathBuf>,
    /// Gibibytes that mean photons may take in the cache; runs and cells that differ behind the lens share them; 0: none are kept.
    #[arg(long, value_name = "N", default_value_t = 4, global = true)]
    pub photons_gib: u32,
    /// Prints data as JSON on stdout, and errors, warnings and progress as one JSON object a line on stderr.
    #[arg(long, global = true)]
    pub json: bool,
    /// Ends with exit code 1 where the extractor needs more clocks than a frame has (run, timing, power). The result is written all the
    /// same.
    #[arg(long, global = true)]
    pub strict: bool,
    /// No progress and no summary.
    #[arg(long, short, global = true)]
    pub quiet: bool,
}

/// What to do.
#[derive(Subcommand, Debug)]
pub enum Verb {
    /// Runs a scenario from photons to pose and writes report, pictures, packets and trajectories.
    Run(RunVerbArguments),
    /// Prints which effects a scenario calls for, which are left out, and the bound of what that changes; simulates nothing.
    Plan(PlanArguments),
    /// Prints line and frame times, exposure limits, latency and link use of a sensor, and where a line's time goes.
    Timing(TimingArguments),
    /// Draws how a row is converted: phases, ramp, comparators, counters and codes over the line.
    Waves(WavesArguments),
    /// Prints energy and bandwidth by block, raw pictures against features.
    Power(PowerArguments),
    /// Runs the extractor alone on a picture.
    Features(FeaturesArguments),
    /// Runs the tracker alone on an EuRoC or TUM folder.
    Track(TrackArguments),
    /// Lists sensor, lens and technology presets and scenes; 'presets show NAME' prints one with where each value comes from.
    Presets(PresetsArguments),
    /// Prints the JSON Schema of a scenario.
    Schema,
    /// Shows the effective configuration.
    Config(ConfigArguments),
    /// What accuracy costs in time: error beside time of every rung, knob and their best combinations.
    Ladder(LadderArguments),
    /// Measures a sensor by EMVA 1288: frames, descriptor and truth for a judge, every figure, a report.
    Characterize(CharacterizeArguments),
    /// Tests whether one run is better than another: differences with 95 % intervals, and a page with the pictures under a wiper.
    Compare(CompareArguments),
    /// A design space: many runs, one table, one page.
    Sweep(SweepArguments),
    /// Finds a sensor's parameters with intervals from its frames, dark and bright: the inverse of characterize.
    Fit(FitArguments),
    /// Prints what a glTF file holds and what of it is not read, and writes a scenario whose camera sees it.
    Scene(SceneArguments),
}

/// A scenario and how much of it.
#[derive(Args, Clone, Debug, Default)]
pub struct RunArguments {
    /// A scenario: a file, a folder with a scene.toml, or a name in the folder of scenarios.
    pub scenario: Option<String>,
    /// Frames of each camera.
    #[arg(long)]
    pub frames: Option<u32>,
    /// Rung of the ladder: expected, sampled, clocked, rtl.
    #[arg(long)]
    pub rung: Option<String>,
    /// Effects: all, auto, none, or +name,-name.
    #[arg(long, allow_hyphen_values = true)]
    pub effects: Option<String>,
    /// What is kept: packets, photons, electrons, codes, features, colour, poses, depth, normals, materials, objects, flow, visibility,
    /// stereo, tum, map; on the rung expected variance.
    #[arg(long, value_name = "LIST", value_delimiter = ',')]
    pub keep: Vec<String>,
}

/// What power is counted from.
#[derive(Args, Debug, Default)]
pub struct PowerArguments {
    #[command(flatten)]
    pub run: RunArguments,
    /// Simulates nothing: every pixel stands at 0.4 of the greatest code. Bias, clocks and raw traffic are those of a run.
    #[arg(long)]
    pub estimate: bool,
}

/// What a run also writes.
#[derive(Args, Debug, Default)]
pub struct RunVerbArguments {
    #[command(flatten)]
    pub run: RunArguments,
    /// Waveforms of one of its frames.
    #[command(flatten)]
    pub waves: WaveArguments,
    /// Frame of the waveforms, from 0 (default: 0).
    #[arg(long, value_name = "N", requires = "waves")]
    pub wave_frame: Option<u32>,
    /// Error of the picture in units of photon noise, at most, 0.1 to 10: a pilot on a few frames picks the cheapest settings.
    #[arg(long, value_name = "ERROR", conflicts_with = "time_budget")]
    pub accuracy: Option<f64>,
    /// Wall time of a frame of the rig, at most, as in 50ms or 0.2s: a pilot on a few frames picks the most accurate settings.
    #[arg(long, value_name = "TIME")]
    pub time_budget: Option<String>,
    /// Converts every Nth row once more on the rung above (sampled: clocked; clocked: rtl), and stops at the first code that differs.
    #[arg(long, value_name = "N")]
    pub check_every: Option<u32>,
}

/// How much a ladder looks at.
#[derive(Args, Debug)]
pub struct LadderArguments {
    /// A scenario: a file, a folder with a scene.toml, or a name in the folder of scenarios.
    pub scenario: Option<String>,
    /// Pictures of the first camera that are judged, spread evenly over the run, 1 to 100.
    #[arg(long, default_value_t = 3)]
    pub frames: u32,
    /// Frames of each run whose poses are judged; 0: none.
    #[arg(long, value_name = "N", default_value_t = 40)]
    pub pose_frames: u32,
    /// Smallest error that is resolved, in units of photon noise, 0.1 to 10; smaller ones are not shown.
    #[arg(long, value_name = "ERROR", default_value_t = 0.5)]
    pub finest: f64,
    /// Times that each setting is timed; the least counts, 1 to 20.
    #[arg(long, default_value_t = 2)]
    pub repeats: u32,
}

/// Waveforms.
#[derive(Args, Debug, Default)]
pub struct WaveArguments {
    /// Waveforms of the sensor: a file ending in .fst or .vcd, for GTKWave or Surfer, or in .svg, a picture of the first row.
    #[arg(long, value_name = "FILE")]
    pub waves: Option<PathBuf>,
    /// Rows of the waveforms, as 0,1,2-5 (default: the first two).
    #[arg(long, value_name = "LIST", requires = "waves")]
    pub wave_rows: Option<String>,
    /// Columns of the waveforms, as 0,100,639 (default: the first, the middle and the last).
    #[arg(long, value_name = "LIST", requires = "waves")]
    pub wave_columns: Option<String>,
}

/// A scenario and its effects.
#[derive(Args, Debug)]
pub struct PlanArguments {
    /// A scenario: a file, a folder with a scene.toml, or a name in the folder of scenarios.
    pub scenario: Option<String>,
    /// Effects: all, auto, none, or +name,-name.
    #[arg(long, allow_hyphen_values = true)]
    pub effects: Option<String>,
}

/// A sensor.
#[derive(Args, Debug)]
pub struct TimingArguments {
    /// A sensor preset's name, a file with [sensor] sections, or a scenario (a file, a folder with a scene.toml, a name).
    pub sensor: Option<String>,
    /// Draws the time of a line and of a frame.
    #[arg(long, value_name = "FILE")]
    pub svg: Option<PathBuf>,
    /// Waveforms of a test picture, a wedge from dark to full scale.
    #[command(flatten)]
    pub waves: WaveArguments,
}

/// Frames of a sensor.
#[derive(Args, Debug)]
pub struct FitArguments {
    /// A folder with emva1288.txt and the frames that it names: pairs at several exposures, and stacks, bright and dark.
    pub folder: PathBuf,
    /// Sensor preset or file that has what the frames do not determine.
    #[arg(long, default_value = "paper_6t_vga")]
    pub preset: String,
    /// Temperature of the die while the frames were taken, in K (default: 300).
    #[arg(long, value_name = "K")]
    pub temperature_k: Option<f64>,
    /// Dark frames at another temperature of the die, two exposures or more: the step over which dark current doubles. Repeatable.
    #[arg(long, value_name = "K=FOLDER")]
    pub dark: Vec<String>,
    /// Bright and dark stacks behind the lens, before an even source: the lens's roll-off.
    #[arg(long, value_name = "FOLDER", requires = "focal_mm")]
    pub flat: Option<PathBuf>,
    /// Focal length of that lens; the pixel pitch is the preset's.
    #[arg(long, value_name = "MM")]
    pub focal_mm: Option<f64>,
    /// Simulates the fitted sensor's frames and writes a page with both sides: histograms, spectra, photon transfer, frames.
    #[arg(long, value_name = "FILE")]
    pub page: Option<PathBuf>,
}

/// A scene from elsewhere.
#[derive(Args, Debug)]
pub struct SceneArguments {
    /// A glTF file (.glb or .gltf).
    pub file: PathBuf,
    /// Metres of a unit of the file; 0.01 for one in centimetres.
    #[arg(long, default_value_t = 1.0)]
    pub scale: f64,
    /// Axis of the file that points up: y (as glTF says) or z.
    #[arg(long, default_value = "y")]
    pub up: String,
    /// Draws the best views of the scene, one beside the other, as PNG.
    #[arg(long, value_name = "FILE")]
    pub picture: Option<PathBuf>,
}

/// A sensor whose conversions are drawn.
#[derive(Args, Debug)]
pub struct WavesArguments {
    /// A sensor preset's name, a file with [sensor] sections, or a scenario; the picture is a wedge from dark to full scale.
    pub sensor: Option<String>,
    /// The picture: a file ending in .svg.
    #[arg(long, value_name = "FILE")]
    pub plot: PathBuf,
    /// Row of the picture (default: the first).
    #[arg(long)]
    pub row: Option<u32>,
    /// Columns, as 0,100,639 (default: the first, the middle and the last); the first six are drawn.
    #[arg(long, value_name = "LIST")]
    pub columns: Option<String>,
}

/// A picture for the extractor.
#[derive(Args, Debug)]
pub struct FeaturesArguments {
    /// PNG, JPEG (8 or 16 bit) or OpenEXR (linear: its brightest pixel becomes code 65535); colour becomes luma.
    pub image: PathBuf,
    /// "fast9": every corner after suppression, without cells, octaves or choice.
    #[arg(long)]
    pub detector: Option<String>,
    /// In DN of the pipeline (compute.pipeline_bits, 8 by default).
    #[arg(long)]
    pub threshold: Option<u16>,
    /// Says what becomes of this pixel in each octave: a feature, or the stage that loses it.
    #[arg(long, value_name = "X,Y", value_parser = pixel, conflicts_with_all = ["detector", "csv", "draw"])]
    pub at: Option<(u32, u32)>,
    /// Writes the features as CSV; without it and --draw they go to stdout or to --out, as CSV or, with --json, as JSON.
    #[arg(long, value_name = "FILE")]
    pub csv: Option<PathBuf>,
    /// Draws the features over the picture, as a PNG.
    #[arg(long, value_name = "FILE")]
    pub draw: Option<PathBuf>,
}

/// A recorded or simulated folder for the tracker.
#[derive(Args, Debug)]
pub struct TrackArguments {
    /// An EuRoC ASL folder (with mav0 or cam0 in it), or one camera's: rgb.txt or images, K.txt, groundtruth.txt.
    pub folder: PathBuf,
    /// Where features come from: packets that a run kept in the folder (each row has its own time there), or its pictures through the
    /// extractor on the host. Without a word: packets if there are any and no compute key is set.
    #[arg(long, value_name = "WHAT", value_parser = ["packets", "pictures"])]
    pub from: Option<String>,
    /// File of the map's landmarks at the end, as a PLY cloud of points.
    #[arg(long, value_name = "FILE")]
    pub map: Option<PathBuf>,
}

/// Which preset to show.
#[derive(Args, Debug)]
pub struct PresetsArguments {
    /// "show".
    #[arg(value_parser = ["show"], requires = "name")]
    pub what: Option<String>,
    /// A sensor's or a lens's preset, or a sensor file (mine.toml).
    pub name: Option<String>,
}

/// What to show of a configuration.
#[derive(Args, Debug)]
pub struct ConfigArguments {
    /// "show".
    #[arg(value_parser = ["show"])]
    pub what: String,
    /// A scenario: a file, a folder with a scene.toml, or a name in the folder of scenarios.
    pub scenario: Option<String>,
}

/// A sensor and how large its measurement is.
#[derive(Args, Debug)]
pub struct CharacterizeArguments {
    /// A sensor preset's name, or a scenario: a file, a folder with a scene.toml, or a name in the folder of scenarios.
    pub sensor: Option<String>,
    /// Columns and rows that are measured, from the first on, of one colour's pixels (default: 320x240, or all where that is less).
    #[arg(long, value_name = "WxH")]
    pub size: Option<String>,
    /// Points of photon transfer, 40 to 1000 (default: 42).
    #[arg(long)]
    pub points: Option<u32>,
    /// Frames of each spatial stack, 32 to 2000 (default: 48).
    #[arg(long)]
    pub stack: Option<u32>,
    /// Letter of the colour filter whose pixels are measured (default: the one that passes most).
    #[arg(long, value_name = "LETTER")]
    pub channel: Option<char>,
}

/// Runs to compare.
#[derive(Args, Debug)]
pub struct CompareArguments {
    /// Folders that 'sensel run' wrote; each is compared with the first.
    #[arg(required = true, num_args = 1.., value_name = "FOLDER")]
    pub folders: Vec<PathBuf>,
    /// Replicates: the folders before it are runs of one design, those after it of the other, pair by pair. Intervals then hold what
    /// varies between runs.
    #[arg(long, num_args = 1.., value_name = "FOLDER")]
    pub against: Vec<PathBuf>,
}

/// What to do with a sweep.
#[derive(Args, Debug)]
pub struct SweepArguments {
    #[command(subcommand)]
    pub part: SweepPart,
}

#[derive(Subcommand, Debug)]
pub enum SweepPart {
    /// Prints how many cells there are, what they share, and the processor time and disk that they need; simulates two frames.
    Plan(SweepFileArguments),
    /// Runs the cells that are not finished.
    Run(SweepRunArguments),
    /// Writes cells.parquet and cells.csv from all finished cells.
    Gather(SweepFileArguments),
    /// Writes report.html from all finished cells.
    Report(SweepRunArguments),
    /// Prints a script for a cluster's scheduler.
    Submit(SweepSubmitArguments),
}

#[derive(Args, Debug)]
pub struct SweepFileArguments {
    /// A sweep file: TOML with a scenario and factors (docs/sweeps.md).
    pub file: PathBuf,
}

/// A sweep file and what is asked of its runs.
#[derive(Args, Debug)]
pub struct SweepRunArguments {
    #[command(flatten)]
    pub sweep: SweepFileArguments,
    /// A specification of each point, as in --spec "ate_m < 0.010 for 99 %"; may be repeated.
    #[arg(long, value_name = "TEXT")]
    pub spec: Vec<String>,
    /// Runs a point's cells only until a sequential test decides its specifications, with an error of at most 5 % on either side.
    #[arg(long, requires = "spec")]
    pub until_decided: bool,
    /// Runs one of N parts of the cells, as in 3/16. Parts may run at once, on machines that share the folder.
    #[arg(long, value_name = "I/N", conflicts_with = "until_decided")]
    pub shard: Option<String>,
    /// Runs the cells whose names stand in this file, a line each.
    #[arg(long, value_name = "FILE", conflicts_with_all = ["until_decided", "shard"])]
    pub cells: Option<PathBuf>,
}

/// A sweep file and a scheduler.
#[derive(Args, Debug)]
pub struct SweepSubmitArguments {
    #[command(flatten)]
    pub sweep: SweepFileArguments,
    /// The scheduler.
    #[arg(long, value_parser = ["slurm"], default_value = "slurm")]
    pub engine: String,
    /// Parts of the cells, one a task of the array.
    #[arg(long, value_name = "N", default_value_t = 16)]
    pub shards: u32,
    /// Processors of a task.
    #[arg(long, value_name = "N", default_value_t = 4)]
    pub cpus: u32,
}
