//! `sensel power`: energy and bandwidth by block and by rail, counted over some frames of the scenario, or estimated without one.

use std::collections::BTreeMap;

use sensel::energy::{HostEnergy, HostParams, Rail};
use sensel::error::Error;
use sensel::num::f64_from_u64;
use sensel::report::alternatives_record::Alternatives;
use sensel::report::energy_record::EnergyRecord;
use sensel::report::gates_record::Gates;
use sensel::report::record::ExtractorClocks;
use sensel::run::{Counted, ESTIMATED_LEVEL, LinkSplit, NoClock, SensorSetup, Session};
use serde_json::{Value, json};

use super::args::{CommonOptions, PowerArguments, RunArguments};
use super::{listing, paths, progress, setup, words};

/// Frames that are counted unless the user says otherwise: features change slowly from frame to frame.
const FRAMES: u32 = 10;

/// What is printed.
struct PowerFigures {
    name: String,
    how: String,
    energy: EnergyRecord,
    /// From frame to frame.
    period_s: f64,
    cameras: u32,
    split: LinkSplit,
    /// Of pictures and of features.
    host: Option<(Option<HostEnergy>, HostEnergy)>,
    alternatives: Alternatives,
    gates: Gates,
    /// The extractor's clocks; none where the sensor extracts nothing.
    extractor: Option<ExtractorClocks>,
    /// Fields of a run's report beside those.
    more: Value,
}

pub fn main(arguments: &PowerArguments, shared: &CommonOptions) -> Result<(), Error> {
    let figures = if arguments.estimate { estimate(&arguments.run, shared)? } else { count(&arguments.run, shared)? };
    if shared.json {
        listing::print_json(&as_json(&figures));
    } else {
        print(&figures);
    }
    words::check_strict(shared, figures.extractor.as_ref())
}

/// From a sensor alone: a preset's name is enough.
fn estimate(arguments: &RunArguments, shared: &CommonOptions) -> Result<PowerFigures, Error> {
    let is_sensor_alone = arguments.frames.is_none() && arguments.rung.is_none() && arguments.effects.is_none();
    let located = if is_sensor_alone {
        paths::locate_sensor(arguments.scenario.as_deref(), shared)?
    } else {
        setup::located(arguments, shared)?
    };
    let sensor = SensorSetup::new(&located.resolved)?;
    let resolve = |error: Error| located.resolved.tree.locate(error);
    let account = sensor.estimated_energy(ESTIMATED_LEVEL).map_err(resolve)?;
    let events = sensor.estimated_events(ESTIMATED_LEVEL).map_err(resolve)?;
    let features = sensor.extractor.features_expected(sensor.size);
    let counted = Counted { events: &events, frames: 1, cameras: 1, features, ate_m: None, waterfall: None };
    let host = located.resolved.scenario.host_params()?;
    let figures = PowerFigures {
        name: located.name,
        how: format!("estimated with every pixel at {ESTIMATED_LEVEL} of the greatest code, one camera"),
        energy: EnergyRecord { line: Some(sensor.line_power().map_err(resolve)?), ..(&account).into() },
        period_s: account.run_time_s(),
        cameras: 1,
        split: sensor.link_split(features)?,
        host: host.map(|host| sensor.host_split(&host, features)).transpose()?,
        alternatives: sensor.alternatives(&counted).map_err(resolve)?,
        gates: sensor.gates(),
        extractor: sensor.keep_up(features),
        more: json!({"fps": sensor.schedule.fps(), "estimated": true}),
    };
    Ok(figures)
}

/// From frames of the scenario.
fn count(arguments: &RunArguments, shared: &CommonOptions) -> Result<PowerFigures, Error> {
    let frames = Some(arguments.frames.unwrap_or(FRAMES));
    let arguments = RunArguments { frames, keep: Vec::new(), ..arguments.clone() };
    let located = setup::located(&arguments, shared)?;
    let name = located.name.clone();
    let setup = setup::prepare(located, shared)?;
    let host: Option<HostParams> = setup.resolved.scenario.host_params()?;
    let frames = setup.frames;
    let mut session = Session::new(setup)?;
    let warned = words::warn(&session.warnings());
    let bar = progress::bar("frames", u64::from(frames), shared.quiet);
    for _ in 0..frames {
        session.step(&NoClock)?;
        bar.inc();
    }
    bar.finish();
    let report = session.report(&name)?;
    words::warn(&report.warnings[warned..]);
    let sensor = &session.setup().sensor;
    let features = session.mean_features();
    Ok(PowerFigures {
        how: format!("over {frames} frames; {}", words::reduction(&report)),
        period_s: session.energy().run_time_s() / f64::from(frames),
        cameras: sensel::num::u32_from(session.setup().cameras.len()),
        split: sensor.link_split(features)?,
        host: host.map(|host| sensor.host_split(&host, features)).transpose()?,
        more: json!({"bandwidth": report.bandwidth, "fps": report.timing.fps, "frames": frames, "warnings": report.warnings}),
        energy: report.energy,
        alternatives: report.alternatives,
        gates: report.gates,
        extractor: report.timing.extractor,
        name,
    })
}

fn as_json(figures: &PowerFigures) -> Value {
    let split = &figures.split;
    let host = figures.host.map(|host| {
        let of = |host: &HostEnergy| {
            json!({"receive_uj": host.receive_uj, "extract_uj": host.extract_uj, "track_uj": host.track_uj,
                   "idle_uj": host.idle_uj, "total_uj": host.total_uj()})
        };
        json!({"of_pictures": host.0.as_ref().map(of), "of_features": of(&host.1)})
    });
    let mut json = json!({
        "energy": figures.energy,
        "link": {
            "raw_mbit_per_s": split.raw.map(|raw| 1e-6 * raw.bits_per_s),
            "net_mbit_per_s": split.raw.map(|raw| 1e-6 * raw.net_bits_per_s),
            "feature_mbit_per_s": 1e-6 * split.feature_bits_per_s, "raw_mw": split.raw.map(|raw| raw.mw),
            "feature_mw": split.feature_mw, "floor_mw": split.floor_mw,
        },
        "period_ms": 1e3 * figures.period_s,
        "alternatives": figures.alternatives,
        "gates": figures.gates,
        "not_measurable": reasons(figures),
    });
    let fields = json.as_object_mut().expect("just made");
    if let Some(host) = host {
        fields.insert("host".to_owned(), host);
    }
    fields.extend(figures.more.as_object().expect("just made").clone());
    json
}

/// Why figures are absent, by path.
fn reasons(figures: &PowerFigures) -> BTreeMap<&'static str, &'static str> {
    let mut reasons: BTreeMap<_, _> = figures.alternatives.reasons().into_iter().collect();
    if figures.split.raw.is_none() {
        let paths = ["link.raw_mbit_per_s", "link.net_mbit_per_s", "link.raw_mw", "host.of_pictures"];
        reasons.extend(
            paths.map(|path| (path, "the link cannot carry rows of this width; alternatives.left_out says why")),
        );
    }
    reasons
}

fn print(figures: &PowerFigures) {
    let energy = &figures.energy;
    // A picojoule a second is 1e-9 mW.
    let mw = |pj: f64| pj * 1e-9 / figures.period_s;
    outln!("{}, technology {}, {}", figures.name, energy.technology, figures.how);
    out!("{}", figures.alternatives.text());
    if let Some(clocks) = &figures.extractor {
        outln!("extractor {}", clocks.verdict());
    }
    outln!("  {:<10} {:>14} {:>12} {:>24}", "block", "nJ per frame", "mW", "likely mW");
    for (block, &pj) in energy.blocks.iter() {
        let range = energy.blocks_interval.get(block).copied().unwrap_or_default();
        let (low, high) = (mw(range.low_pj), mw(range.high_pj));
        outln!("  {block:<10} {:>14.2} {:>12.3} {low:>11.3} .. {high:>9.3}", pj * 1e-3, mw(pj));
    }
    outln!("  {:<10} {:>14} {:>12}", "rail", "nJ per frame", "mW");
    for (rail, &pj) in energy.rails.iter() {
        outln!("  {rail:<10} {:>14.2} {:>12.3}", pj * 1e-3, mw(pj));
    }
    let total = energy.total_pj_per_frame;
    let (low, high) = (mw(energy.total_interval.low_pj), mw(energy.total_interval.high_pj));
    outln!("  {:<10} {:>14.2} {:>12.3} {low:>11.3} .. {high:>9.3}", "total", total * 1e-3, energy.power_mw);
    outln!("  {:.3} mW flow whatever happens; {:.1} pJ per pixel", energy.static_power_mw, energy.pj_per_pixel);
    if let Some(line) = &energy.line {
        let (peak, ratio) = (line.peak_mw, line.peak_over_mean);
        outln!("  within a line power peaks at {peak:.3} mW, {ratio:.2} times the mean of a frame (one camera)");
    }
    let split = &figures.split;
    outln!("link of one camera, by what is sent ({:.3} mW flow with nothing to send)", split.floor_mw);
    let raw = split.raw.map(|raw| {
        let codes = format!("of these {:.3} Mbit/s are codes", 1e-6 * raw.net_bits_per_s);
        ("raw", raw.bits_per_s, raw.mw, codes)
    });
    let features = ("features", split.feature_bits_per_s, split.feature_mw, compute_words(figures));
    for (what, bits_per_s, link_mw, note) in raw.into_iter().chain([features]) {
        outln!("  {what:<10} {:>14.3} Mbit/s {link_mw:>8.3} mW  {note}", 1e-6 * bits_per_s);
    }
    if let Some((pictures, features)) = &figures.host {
        outln!("host of one camera, uJ per frame");
        let pictures = pictures.as_ref().map(|pictures| ("pictures", pictures));
        for (what, host) in pictures.into_iter().chain([("features", features)]) {
            let HostEnergy { receive_uj, extract_uj, track_uj, idle_uj } = host;
            outln!(
                "  {what:<10} {:>14.1}  receiving {receive_uj:.1}, extracting {extract_uj:.1}, tracking {track_uj:.1}, idle {idle_uj:.1}",
                host.total_uj()
            );
        }
    }
    outln!("decided by");
    for decider in energy.deciders.iter().take(5) {
        let [energy, variance] = [decider.energy_share, decider.variance_share].map(|share| 100.0 * share);
        let name = &decider.name;
        outln!("  {name:<24} {energy:>5.1} % of the energy, {variance:>5.1} % of its constants' uncertainty");
    }
    out!("{}", figures.gates.text());
    assert_eq!(energy.rails.iter().count(), Rail::ALL.len());
}

/// What features cost before they are sent.
fn compute_words(figures: &PowerFigures) -> String {
    let pj = figures.energy.blocks.get("compute").copied().unwrap_or_default() / f64_from_u64(figures.cameras.into());
    let mw = pj * 1e-9 / figures.period_s;
    if mw > 0.0 { format!("besides {mw:.3} mW of the extractor") } else { "without an extractor here".to_owned() }
}
