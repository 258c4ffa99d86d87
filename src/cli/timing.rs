//! `sensel timing`: the clocks of a sensor; needs no scene.

use std::collections::BTreeMap;

use sensel::error::Error;
use sensel::link::Flow;
use sensel::report::timing_diagram::{LineBudget, TimingDiagram};
use sensel::run::{self, SensorSetup};
use sensel::units::{FrameIndex, RowIndex};
use serde_json::{Value, json};

use super::args::{CommonOptions, TimingArguments};
use super::waves::WaveRequest;
use super::{listing, paths, words};

pub fn main(arguments: &TimingArguments, shared: &CommonOptions) -> Result<(), Error> {
    if let Some(picture) = &arguments.svg {
        paths::check_ending("--svg", picture, &["svg"], "SVG")?;
    }
    let located = paths::locate_sensor(arguments.sensor.as_deref(), shared)?;
    let resolved = &located.resolved;
    let sensor = SensorSetup::new(resolved)?;
    words::warn(sensor.extractor_warning().as_slice());
    let expected_features = sensor.extractor.features_expected(sensor.size);
    paths::refuse_same(&[("--svg", arguments.svg.as_ref()), ("--waves", arguments.waves.waves.as_ref())])?;
    let waves = WaveRequest::new(&arguments.waves, None, &sensor, (resolved, &located.name))?;
    let diagram = run::timing_diagram(&sensor, expected_features, &located.name)?;
    if let Some(path) = &arguments.svg {
        paths::write_output("--svg", path, diagram.svg().as_bytes())?;
    }
    if let Some(waves) = &waves {
        waves.write_wedge(&sensor, resolved.scenario.sensor.die)?;
    }
    let link = LinkUse::new(&sensor, expected_features)?;
    if shared.json {
        listing::print_json(&as_json(&sensor, &diagram, &link, expected_features));
    } else {
        print(&sensor, &diagram, &link, expected_features);
    }
    words::check_strict(shared, diagram.timing.extractor.as_ref())
}

/// How much of the link a frame takes.
struct LinkUse {
    /// Container and feature bits over what the link could carry in a frame's time.
    utilisation: f64,
    /// Share of the time from row to row in which a row's packet holds the link.
    burst: f64,
    capacity_bps: u64,
    /// Container and feature bits a second.
    payload_bps: f64,
    /// Features that pass between two rows' packets.
    features_per_gap: u32,
    flow: Flow,
}

impl LinkUse {
    fn new(sensor: &SensorSetup, features: u64) -> Result<Self, Error> {
        let (link, schedule) = (&sensor.link, &sensor.schedule);
        let cycle = sensor.traffic_of_cycle(features)?;
        let utilisation = link.mean_utilisation(&cycle, schedule.frame_time_s() * f64::from(link.frames_every));
        let capacity_bps = link.capacity_bits_per_s();
        let payload_bits = sensel::num::f64_from_u64(cycle.container_bits + cycle.feature_bits);
        let payload_bps = payload_bits * schedule.fps() / f64::from(link.frames_every);
        let (burst, features_per_gap) = (run::burst_utilisation(sensor)?, sensor.features_per_gap()?);
        Ok(Self { utilisation, burst, capacity_bps, payload_bps, features_per_gap, flow: sensor.flow_of(features)? })
    }
}

/// The longest exposure in effect, in us.
fn exposure_us(sensor: &SensorSetup) -> f64 {
    1e6 * sensor.schedule.exposure(FrameIndex(0), RowIndex(0)).length_s()
}

fn as_json(sensor: &SensorSetup, diagram: &TimingDiagram, link: &LinkUse, features: u64) -> Value {
    let (schedule, timing) = (&sensor.schedule, &diagram.timing);
    let part = |part: &LineBudget| {
        json!({"name": part.name, "time_us": part.time_us, "needed_hts": part.needed_hts, "slack_us": part.slack_us,
               "limits": part.limits})
    };
    let budget: Vec<Value> = diagram.budgets.iter().map(part).collect();
    let slots = schedule.slots().iter();
    let slots = slots.map(|slot| json!({"exposure_lines": slot.exposure_lines, "offset_lines": slot.offset_lines}));
    let (size, demand) = (schedule.output_size(), schedule.frame_demand());
    let without_features = timing.feature_latency_us.is_none().then_some("link.mode = frames sends no features");
    let mut not_measurable: BTreeMap<String, String> = run::waterfall_reasons(&timing.waterfall, "");
    not_measurable.extend(without_features.map(|why| ("feature_latency_us".to_owned(), why.to_owned())));
    json!({
        "not_measurable": not_measurable,
        "hts": schedule.hts(), "vts": schedule.vts(),
        "line_time_us": timing.line_time_us, "frame_time_us": timing.frame_time_us, "fps": timing.fps,
        "exposure_max_lines": schedule.exposure_lines_max(), "exposure_us": exposure_us(sensor),
        "exposure_lines": schedule.exposure_lines(), "exposure_fine_clk": schedule.exposure_fine_clk(),
        "latency_us": timing.latency_us,
        "link_utilisation": link.utilisation, "link_utilisation_burst": link.burst,
        "link_capacity_bps": link.capacity_bps, "link_payload_bps": link.payload_bps,
        "feature_latency_us": timing.feature_latency_us,
        "features_per_gap": link.features_per_gap,
        "waterfall": timing.waterfall,
        "extractor": timing.extractor.as_ref().map(|clocks| json!({
            "features": features, "required_clk": clocks.required, "available_clk": clocks.available, "clock_hz": clocks.clock_hz,
            "keeps_up": clocks.keeps_up, "queue_most": clocks.queue_most, "queue_depth": clocks.queue_depth, "remedy": clocks.remedy,
        })),
        "warnings": sensor.extractor_warning().as_slice(),
        "rows_stalled": link.flow.rows_stalled,
        "stalled_us": 1e6 * sensor.link.seconds(link.flow.stalled),
        "fifo_rows_most": link.flow.fifo_rows_most,
        "width": size.width_px, "height": size.height_px,
        "line_budget": budget,
        "frame_demand_lines": {"rows": demand.rows, "exposure": demand.exposure},
        "slots": slots.collect::<Vec<_>>(),
        "line": timing.line, "frame": timing.frame,
    })
}

fn print(sensor: &SensorSetup, diagram: &TimingDiagram, link: &LinkUse, features: u64) {
    let (schedule, timing) = (&sensor.schedule, &diagram.timing);
    outln!("sensor      {}: {}", diagram.name, diagram.mode);
    outln!("line        {:.3} us: HTS {} at {} Hz", timing.line_time_us, schedule.hts(), schedule.pixel_rate_hz());
    outln!("frame       {:.3} us: VTS {}, {:.3} fps", timing.frame_time_us, schedule.vts(), timing.fps);
    let (lines, lines_max) = (schedule.exposure_lines(), schedule.exposure_lines_max());
    outln!(
        "exposure    {:.3} us, {lines} lines and {} clocks ({} shutter), at most {lines_max} lines",
        exposure_us(sensor),
        schedule.exposure_fine_clk(),
        schedule.shutter().name()
    );
    for (number, slot) in schedule.slots().iter().enumerate().skip(1) {
        let (exposure, offset) = (slot.exposure_lines, slot.offset_lines);
        outln!("            exposure {}: {exposure} lines, read {offset} lines after the first", number + 1);
    }
    let latency_us = timing.latency_us;
    outln!("latency     {latency_us:.1} us from the middle of the exposure to the last bit of the frame's last packet");
    if let Some(clocks) = &timing.extractor {
        outln!("extractor   {}, with {features} features spread evenly", clocks.verdict());
        let (hz, most, depth) = (clocks.clock_hz, clocks.queue_most.unwrap_or(0), clocks.queue_depth);
        outln!("            at {hz} Hz; {most} candidates wait at once, of {depth} that the queue holds");
    }
    outln!("link        {:.1} % of a frame, {:.1} % of a line", 100.0 * link.utilisation, 100.0 * link.burst);
    if let Some(latency_us) = timing.feature_latency_us {
        let gap = link.features_per_gap;
        outln!("features    {latency_us:.1} us from the last row to the last feature byte, {gap} fit between two rows");
    }
    if link.flow.rows_stalled > 0 {
        let stalled_us = 1e6 * sensor.link.seconds(link.flow.stalled);
        outln!("stalls      {} rows, {stalled_us:.1} us per frame: the row FIFO is full", link.flow.rows_stalled);
    }
    out!("{}", timing.waterfall.text());
    out!("{}", diagram.text());
}
