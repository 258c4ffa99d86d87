//! `sensel run`: the whole way, and everything it writes.

use std::path::Path;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};

use sensel::error::Error;
use sensel::fidelity::Rung;
use sensel::files::folder::OutputFolder;
use sensel::files::truth::{Keep, KeptOutput};
use sensel::report::Report;
use sensel::report::record::{Scenario, StageCost};
use sensel::run::{Session, Stopwatch};

use super::args::{CommonOptions, RunVerbArguments};
use super::clocks::WallTime;
use super::output::Output;
use super::setup::{FolderAssets, located, prepare};
use super::waves::WaveRequest;
use super::{expected, goal, interrupt, ladder, progress, words};

pub fn main(verb: &RunVerbArguments, shared: &CommonOptions) -> Result<(), Error> {
    let stopwatch = WallTime::start();
    let located = located(&verb.run, shared)?;
    let name = located.name.clone();
    let target = shared.out.clone().unwrap_or_else(|| Path::new("out").join(&name));
    let ends_at_image = located.resolved.scenario.run.rung == Rung::Expected.name();
    let keep =
        if ends_at_image { expected::check(verb).map(|()| Keep::default())? } else { Keep::parse(&verb.run.keep)? };
    let sensor = sensel::run::SensorSetup::new(&located.resolved)?;
    let mut waves = WaveRequest::new(&verb.waves, verb.wave_frame, &sensor, (&located.resolved, &name))?;
    if waves.is_none() {
        let frames = located.resolved.scenario.frames().map_err(|error| located.resolved.tree.locate(error))?;
        waves = WaveRequest::picture(&target, &sensor, (frames, &name));
    }
    let waves_within = waves.as_ref().and_then(|waves| waves.within(&target));
    let goal = goal::of(verb, shared)?;
    OutputFolder::check(&target)?;
    let assets = FolderAssets::new(&located.folder, shared);
    let mut setup = prepare(located, shared)?;
    if let Some(goal) = goal {
        setup = goal::resolve(setup, goal, &assets, shared)?;
    }
    let warned = words::warn(setup.warnings.texts());
    if ends_at_image {
        return expected::main(verb, shared, &setup, &name, &target);
    }
    let prepared_s = stopwatch.now_s();

    let electrons = keep.has(KeptOutput::Electrons);
    if let Some(photons) = assets.photons() {
        setup.keep_photons_in(Arc::new(photons));
    }
    let interrupted = interrupt::watch();
    let mut output = Output::create(&target, &setup, keep)?;
    let mut session = Session::new(setup)?;
    session.track_cameras_alone()?;
    if electrons {
        session.keep_electrons();
    }
    let held_to = verb.check_every.map(|every| session.check_rows(every, &assets)).transpose()?;
    let wave_codes = step_all(&mut session, &mut output, waves.as_ref(), (shared, &interrupted), &stopwatch)?;
    let frames = session.setup().frames;
    let mut report = session.report(&name)?;
    words::warn(&report.warnings[warned..]);
    report.cost.insert("prepare", per_frame(prepared_s, frames));
    report.cost.insert("write", per_frame(output.seconds(), frames));
    if let Some(record) = ladder::kept(&session.setup().resolved, &assets) {
        report.set_ladder(record);
    }
    if let (Some(waves), Some(path)) = (&mut waves, &waves_within) {
        // A file of the result is built and replaced with it.
        waves.redirect(&output.path().join(path))?;
    }
    let write_waves = || match (&waves, &wave_codes) {
        (Some(waves), Some(codes)) => waves.write_probed(&session, codes),
        _ => Ok(()),
    };
    if let Some(path) = &waves_within {
        write_waves()?;
        output.link_waves(path);
    }
    output.finish(&session, &report)?;
    if waves_within.is_none() {
        write_waves()?;
    }

    if shared.json {
        out!("{}", report.to_json()?);
    } else if !shared.quiet {
        summary(&report, &target, stopwatch.now_s());
        if let Some(rung) = held_to {
            outln!("{} rows converted once more on the rung {}: all codes equal", session.rows_checked(), rung.name());
        }
    }
    words::check_strict(shared, report.timing.extractor.as_ref())
}

/// Simulates and writes every frame; the codes of the waveforms' frame, where there are any.
fn step_all(
    session: &mut Session,
    output: &mut Output,
    waves: Option<&WaveRequest>,
    (shared, interrupted): (&CommonOptions, &AtomicBool),
    stopwatch: &WallTime,
) -> Result<Option<Vec<Vec<u16>>>, Error> {
    if let Some(waves) = waves {
        waves.probe_rows(session);
    }
    let frames = session.setup().frames;
    let bar = progress::bar("frames", u64::from(frames), shared.quiet);
    let mut wave_codes = None;
    for _ in 0..frames {
        if interrupted.load(Ordering::Relaxed) {
            return Err(Error::Interrupted);
        }
        let frame = session.step(stopwatch)?;
        output.frame(session, &frame)?;
        wave_codes = waves.and_then(|waves| waves.codes_of(&frame)).or(wave_codes);
        bar.inc();
    }
    bar.finish();
    Ok(wave_codes)
}

fn per_frame(seconds: f64, frames: u32) -> StageCost {
    StageCost { ms_per_frame: 1e3 * seconds / f64::from(frames) }
}

fn summary(report: &Report, target: &Path, seconds: f64) {
    let scenario = &report.scenario;
    let figure = |value: Option<f64>, factor: f64, unit: &str| {
        value.map_or("not measurable".to_owned(), |value| format!("{:.2} {unit}", value * factor))
    };
    let Scenario { name, frames, cameras, width_px, height_px, illuminance_lux, bits, .. } = scenario;
    outln!("{name}: {frames} frames, {cameras} camera(s) of {width_px}x{height_px}, {illuminance_lux} lux, {bits} bit");
    for note in &scenario.scene_notes {
        outln!("  scene         {note}");
    }
    let tracking = &report.tracking;
    let (percent, features) = (100.0 * tracking.tracked_fraction, report.features.median_tracked);
    let features = features.map_or("no".to_owned(), |count| format!("{count:.0}"));
    outln!("  tracked       {percent:.1} % of frames, {features} features (median)");
    let how = if scenario.cameras == 1 { ", scale aligned" } else { "" };
    outln!("  ATE           {}  over {:.2} m{how}", figure(tracking.ate_m, 1e3, "mm"), scenario.path_m);
    outln!("  RPE over 1 s  {}", figure(tracking.rpe_m, 1e3, "mm"));
    outln!("  jitter frame  {}  (RPE over one frame)", figure(tracking.jitter_frame_m, 1e3, "mm"));
    outln!("  jitter d2     {}  (second differences)", words::jitter(tracking));
    if let Some(alone) = &report.cameras_alone {
        let (ate, d2) = (figure(alone.ate_m, 1e3, "mm"), figure(alone.jitter_d2_m.or(alone.jitter_still_m), 1e3, "mm"));
        outln!("  cameras alone ATE {ate}, jitter d2 {d2}  (the same packets without the IMU)");
    }
    outln!("  power         {:.2} mW, {:.1} pJ per pixel", report.energy.power_mw, report.energy.pj_per_pixel);
    outln!("  link          {:.2} Mbit/s, {}", report.bandwidth.link_bits_per_s * 1e-6, words::reduction(report));
    outln!("  latency       {:.2} ms to the last bit on the lanes", report.timing.latency_us * 1e-3);
    if let Some(pose_us) = report.timing.waterfall.pose_us {
        let measured = report.timing.waterfall.measured_host_us.map_or_else(String::new, |measured_us| {
            format!("; decoding and tracking took {:.2} ms here", 1e-3 * measured_us)
        });
        outln!("  pose          {:.2} ms, with the host {}{measured}", 1e-3 * pose_us, report.timing.waterfall.host);
    }
    if let Some(clocks) = &report.timing.extractor {
        outln!("  extractor     {}", clocks.verdict());
    }
    if let Some(last_us) = report.timing.last_feature_us {
        outln!("  last feature  {last_us:.1} us after the last row");
    }
    outln!("  render noise  {} of photon variance", figure(scenario.render_variance_ratio, 1.0, "times"));
    for note in &scenario.motion_notes {
        outln!("  motion        {note}");
    }
    outln!("  took          {seconds:.1} s");
    outln!("report: {}", target.join("report.html").display());
    // Frames with a pose; errors need three of them, poses do not.
    let tracked = sensel::num::u64_half_even(tracking.tracked_fraction * f64::from(scenario.frames));
    outln!("{} frames, {tracked} tracked, {} lost", scenario.frames, u64::from(scenario.frames) - tracked);
}
