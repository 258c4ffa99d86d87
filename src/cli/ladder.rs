//! `sensel ladder`: what accuracy costs in time, as a table, JSON, a picture and a page.

use std::path::Path;

use sensel::config::Resolved;
use sensel::error::Error;
use sensel::files::folder::OutputFolder;
use sensel::ladder::{LadderBench, LadderOptions, StudyClocks, ladder, study_key};
use sensel::report::html::ladder_html;
use sensel::report::ladder_picture::svg;
use sensel::report::ladder_record::{LadderRecord, LadderRow};
use sensel::run::Assets;

use super::args::{CommonOptions, LadderArguments};
use super::clocks::{ProcessorTime, WallTime};
use super::progress::Study;
use super::setup::FolderAssets;
use super::{interrupt, paths, setup, words};

pub fn main(arguments: &LadderArguments, shared: &CommonOptions) -> Result<(), Error> {
    let options = options(arguments)?;
    let located = paths::locate(arguments.scenario.as_deref(), shared, &[])?;
    let name = located.name.clone();
    let target = shared.out.clone().unwrap_or_else(|| Path::new("out").join(format!("{name}-ladder")));
    OutputFolder::check(&target)?;
    let assets = FolderAssets::new(&located.folder, shared);
    let setup = setup::prepare(located, shared)?;
    words::warn(setup.warnings.texts());
    let key = study_key(&setup.resolved);
    let threads = u32::try_from(rayon::current_num_threads()).unwrap_or(u32::MAX);
    let (wall, work, progress) = (WallTime::start(), ProcessorTime::start(), Study::new(shared.quiet));
    let clocks = StudyClocks { wall: &wall, work: &work };
    let bench = LadderBench { setup, clocks, progress: &progress, assets: &assets };
    let record = ladder(&bench, options, &name, threads)?;
    drop(progress);
    let json = serde_json::to_string_pretty(&record).map_err(|error| Error::Run(format!("ladder.json: {error}")))?;
    assets.store(&key, json.as_bytes());
    // Writing takes no time; what stops the program meanwhile would leave a hidden folder.
    let _ = interrupt::watch();
    let folder = OutputFolder::create(&target)?;
    let write = |file: &str, text: &str| sensel::files::write(&folder.path().join(file), text);
    write("ladder.json", &format!("{json}\n"))?;
    write("ladder.html", &ladder_html(&record))?;
    if let Some(picture) = svg(&record) {
        write("ladder.svg", &picture)?;
    }
    paths::put(folder)?;
    if shared.json {
        outln!("{json}");
    } else if !shared.quiet {
        table(&record);
        outln!("page: {}", target.join("ladder.html").display());
    }
    Ok(())
}

fn options(arguments: &LadderArguments) -> Result<LadderOptions, Error> {
    let within = |key: &str, value: u32, least: u32, most: u32| {
        if (least..=most).contains(&value) {
            Ok(value)
        } else {
            Err(Error::key(key, value, format!("out of range; use {least} to {most}")))
        }
    };
    if !(0.1..=10.0).contains(&arguments.finest) {
        return Err(Error::key("--finest", arguments.finest, "out of range; use 0.1 to 10"));
    }
    Ok(LadderOptions {
        frames: within("--frames", arguments.frames, 1, 100)?,
        pose_frames: within("--pose-frames", arguments.pose_frames, 0, 1_000_000)?,
        finest: arguments.finest,
        repeats: within("--repeats", arguments.repeats, 1, 20)?,
    })
}

/// The ladder of a scenario, if it was measured before.
pub fn kept(resolved: &Resolved, assets: &dyn Assets) -> Option<LadderRecord> {
    serde_json::from_slice(&assets.load(&study_key(resolved))?).ok()
}

fn table(record: &LadderRecord) {
    let LadderRecord { scenario, frames, reference, .. } = record;
    let (rays, error, saturated) = (reference.rays_per_pixel, reference.standard_error, reference.saturated_share);
    outln!(
        "{scenario}: frames {frames:?}, reference of {rays:.1} rays per pixel, standard error {error:.3} of photon noise; \
         {:.1} % saturated",
        100.0 * saturated
    );
    let numbers = ["ms", "of ref", "error", "rms DN", "max DN", "F1", "ATE mm", "d2 mm", "energy"].map(str::to_owned);
    outln!("{}", aligned(["rung", "knob", "value"], &numbers));
    record.rows.iter().for_each(line);
    outln!("error: in units of photon noise; -: not measured, or finer than {}", reference.finest);
}

fn line(row: &LadderRow) {
    let figure = |value: Option<f64>, factor: f64, decimals: usize| {
        value.map_or("-".to_owned(), |value| format!("{:.decimals$}", factor * value))
    };
    let timed = (row.ms_per_frame > 0.0).then_some(row.ms_per_frame);
    let numbers = [
        figure(timed, 1.0, 1),
        figure(timed.map(|_| row.time_ratio), 1.0, 4),
        figure(row.photon_noise_ratio, 1.0, 3),
        figure(row.rms_dn, 1.0, 2),
        figure(row.max_dn, 1.0, 0),
        figure(row.feature_f1, 1.0, 3),
        figure(row.ate_m, 1e3, 2),
        figure(row.jitter_d2_m, 1e3, 2),
        row.energy_error.map_or("-".to_owned(), |share| format!("{:+.3} %", 100.0 * share)),
    ];
    let front = if row.on_front { "  front" } else { "" };
    outln!("{}{front}", aligned([&row.rung, &row.knob, &row.value], &numbers));
}

/// A line of the table.
fn aligned([rung, knob, value]: [&str; 3], [ms, of_ref, error, rms, max, f1, ate, d2, energy]: &[String; 9]) -> String {
    format!(
        "  {rung:<9} {knob:<18} {value:<44} {ms:>9} {of_ref:>8} {error:>7} {rms:>7} {max:>6} {f1:>6} {ate:>8} {d2:>8} \
         {energy:>9}"
    )
}
