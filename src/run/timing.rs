//! Line-time and frame-time budget of a sensor, as a record for the report and as a diagram.
//!
//! While row n converts, row n - 1 leaves the columns' memory over the serial lanes, where there are any, and the packet of the row
//! before it is on the link: with lanes a line memory stands between them, so a row's packet follows its conversion by one line
//! more.

use super::link_timing::LinkTimes;
use super::sensor::SensorSetup;
use crate::adc::AdcParams;
use crate::error::Error;
use crate::link::{Flow, HEADER_BYTES};
use crate::num::{f64_from_u64, f64_from_usize, greater, index, u64_from};
use crate::readout::{ClockSpan, Pulses, Schedule};
use crate::report::record::{Phase, Timing};
use crate::report::timing_diagram::{BandKind, LineBudget, RowBand, TimingDiagram};
use crate::units::{Clocks, FrameIndex, RowIndex, Size, Span};

/// Share of the time from row to row in which a row's packet holds the link; 0 where rows are not sent. Fails on a row that its link
/// cannot carry.
pub fn burst_utilisation(sensor: &SensorSetup) -> Result<f64, Error> {
    if !sensor.link.mode.sends_codes() {
        return Ok(0.0);
    }
    let rows_apart_s = sensor.schedule.line_time_s() * f64_from_u64(sensor.schedule.lines_per_packet());
    sensor.link.burst_utilisation(sensor.schedule.output_size().width_px, sensor.bits(), rows_apart_s)
}

/// Clocks and times of a sensor that sends so many features per frame, with the spans of a line and of a frame; the host's are those of a
/// rig of so many cameras. Fails on a row that its link cannot carry.
pub fn timing_record(sensor: &SensorSetup, features: u64, cameras: u32) -> Result<Timing, Error> {
    let schedule = &sensor.schedule;
    Ok(Timing {
        line_time_us: 1e6 * schedule.line_time_s(),
        frame_time_us: 1e6 * schedule.frame_time_s(),
        fps: schedule.fps(),
        latency_us: 1e6 * sensor.latency_s(&sensor.flow_of(features)?, schedule, FrameIndex(0)),
        feature_latency_us: sensor.link_times(features)?.feature_latency_s.map(|latency_s| 1e6 * latency_s),
        first_feature_us: None,
        last_feature_us: None,
        waterfall: sensor.waterfall(features, cameras)?,
        extractor: sensor.keep_up(features),
        clocks_per_frame: schedule.frame_clk().0,
        line: line_phases(sensor)?,
        frame: frame_phases(sensor, features)?,
    })
}

/// The budget of a line and the picture of two frames, ready to draw or print. `name` is what a person calls the sensor. Fails on a row
/// that its link cannot carry.
pub fn timing_diagram(sensor: &SensorSetup, features: u64, name: &str) -> Result<TimingDiagram, Error> {
    let schedule = &sensor.schedule;
    let limit = schedule.line_limit().kind;
    let spare_clk = |needed_clk: u64| schedule.line_clk().0.saturating_sub(needed_clk);
    let clock_us = 1e6 * schedule.line_time_s() / f64_from_u64(schedule.line_clk().0);
    let budgets = schedule.line_demands().iter().filter(|demand| demand.needed_clk > 0).map(|demand| LineBudget {
        name: demand.kind.name().to_owned(),
        time_us: 1e6 * demand.time_s,
        needed_hts: demand.needed_clk,
        slack_us: clock_us * f64_from_u64(spare_clk(demand.needed_clk)),
        limits: demand.kind == limit,
    });
    let Size { width_px, height_px } = schedule.output_size();
    let (bits, shutter) = (sensor.bits(), schedule.shutter().name());
    Ok(TimingDiagram {
        name: name.to_owned(),
        mode: format!("{width_px} x {height_px}, {bits} bit, {shutter} shutter"),
        hts: schedule.line_clk().0,
        vts: schedule.vts(),
        pixel_rate_hz: schedule.pixel_rate_hz(),
        budgets: budgets.collect(),
        bands: bands(schedule),
        lanes: frame_lanes(sensor, features)?,
        rows: height_px,
        rows_lines: schedule.frame_demand().rows,
        exposure_lines: schedule.exposure_lines(),
        exposure_lines_max: schedule.exposure_lines_max(),
        timing: timing_record(sensor, features, 1)?,
    })
}

/// From the end of a row's conversion to the start of its packet.
pub(super) fn memory_s(schedule: &Schedule) -> f64 {
    if schedule.shift_lane_clk().0 > 0 { schedule.line_time_s() } else { 0.0 }
}

impl SensorSetup {
    /// From the middle of a frame's exposure to the last bit of its last packet: the last row is converted during its line and sent during
    /// the next (or the next but one, behind serial lanes); feature packets follow the rows and leave when the extractor has made their
    /// last feature.
    pub fn latency_s(&self, flow: &Flow, schedule: &Schedule, frame: FrameIndex) -> f64 {
        let last = schedule.slot_readout(frame, schedule.slots().len() - 1, schedule.last_row());
        let behind_s = self.link.seconds(Clocks(flow.stalled.0 + flow.last_bit().0));
        last.end_s + memory_s(schedule) + behind_s - schedule.t_frame(frame)
    }
}

/// Spans one after another from the start of a line; those of no length are left out.
fn chain(lane: &str, steps: &[(&str, f64)]) -> Vec<Phase> {
    let mut phases = Vec::new();
    let mut start_us = 0.0;
    for &(name, length_us) in steps.iter().filter(|(_, length_us)| *length_us > 0.0) {
        let end_us = start_us + length_us;
        phases.push(Phase { lane: lane.to_owned(), name: name.to_owned(), start_us, end_us });
        start_us = end_us;
    }
    phases
}

/// What happens within one line: columns, lanes, link.
pub(super) fn line_phases(sensor: &SensorSetup) -> Result<Vec<Phase>, Error> {
    let schedule = &sensor.schedule;
    let mut phases = conversion_phases(&sensor.parameters.adc, schedule);
    let behind_lanes = schedule.shift_lane_clk().0 > 0;
    if behind_lanes {
        let lane_clock_hz = f64_from_u64(schedule.params().lane_clock_hz);
        let shift_us = 1e6 * f64_from_u64(schedule.shift_lane_clk().0) / lane_clock_hz;
        phases.extend(chain("lanes, row n-1", &[("shift out", shift_us)]));
    }
    phases.extend(packet_phases(sensor, if behind_lanes { "link, row n-2" } else { "link, row n-1" })?);
    Ok(phases)
}

/// What a column does within its row's line.
fn conversion_phases(adc: &AdcParams, schedule: &Schedule) -> Vec<Phase> {
    let clocks_us = |clocks: u64| 1e6 * f64_from_u64(clocks) / f64_from_u64(adc.clock_hz);
    let pulse_us = |clocks: u32| 1e6 * f64::from(clocks) / f64_from_u64(schedule.pixel_rate_hz());
    let Pulses { reset_clk, transfer_clk, latch_clk } = schedule.params().pulses;
    // Columns that share a converter settle and convert one after the other.
    let settle_reset_us = f64::from(adc.columns_per_adc) * adc.settle_reset_used_us();
    let reset_counts = u64::from(adc.columns_per_adc) * u64::from(adc.reset_counts_used());
    let steps = [
        ("reset", pulse_us(reset_clk)),
        ("settle reset", settle_reset_us),
        ("ramp reset", clocks_us(reset_counts)),
        ("transfer", pulse_us(transfer_clk)),
        ("settle signal", 1e6 * adc.settling_s() - settle_reset_us),
        ("ramp signal", clocks_us(adc.ramp_clk().0 - reset_counts)),
        ("latch", pulse_us(latch_clk)),
    ];
    chain("columns, row n", &steps)
}

/// The burst of an output row's packet.
fn packet_phases(sensor: &SensorSetup, lane: &str) -> Result<Vec<Phase>, Error> {
    let link = &sensor.link;
    if !link.mode.sends_codes() {
        return Ok(Vec::new());
    }
    let bits = sensor.bits();
    let payload_bytes = link.raw_kind(bits)?.payload_bytes(index(sensor.schedule.output_size().width_px));
    let us = |clocks: Clocks| 1e6 * link.seconds(clocks);
    // Bytes go round the lanes, so that a header ends in the middle of a byte clock where four lanes carry two of them.
    let bytes_us = |bytes: usize| us(Clocks(1)) * f64_from_usize(bytes) / f64::from(link.lanes);
    let total_us = us(link.long_packet_time(u64_from(payload_bytes)));
    let before_us = us(link.burst_entry()) + bytes_us(HEADER_BYTES) + bytes_us(payload_bytes);
    let steps = [
        ("line start", if link.line_sync { us(link.short_packet_time()) } else { 0.0 }),
        ("LP to HS", us(link.burst_entry())),
        ("header", bytes_us(HEADER_BYTES)),
        ("payload", bytes_us(payload_bytes)),
        // With the last lanes' filler bytes, where the bytes are no multiple of the lanes.
        ("footer", total_us - us(link.burst_exit()) - before_us),
        ("HS to LP", us(link.burst_exit())),
    ];
    Ok(chain(lane, &steps))
}

/// What happens within one frame, from the start of the first row's first exposure.
fn frame_phases(sensor: &SensorSetup, features: u64) -> Result<Vec<Phase>, Error> {
    let (schedule, frame) = (&sensor.schedule, FrameIndex(0));
    let zero_s = schedule.exposure(frame, RowIndex(0)).start_s;
    let phase = |lane: &str, name: String, start_s: f64, end_s: f64| Phase {
        lane: lane.to_owned(),
        name,
        start_us: 1e6 * (start_s - zero_s),
        end_us: 1e6 * (end_s - zero_s),
    };
    let slots = schedule.slots().len();
    let numbered = |name: &str, slot: usize| if slots > 1 { format!("{name} {}", slot + 1) } else { name.to_owned() };
    let mut phases = Vec::new();
    let times = sensor.link_times(features)?;
    // Rows before the last one may have waited for the link, and it with them.
    for (lane, row, late_s) in [("first row", RowIndex(0), 0.0), ("last row", schedule.last_row(), times.stalled_s)] {
        for slot in 0..slots {
            let exposure = schedule.slot_exposure(frame, slot, row);
            let readout = schedule.slot_readout(frame, slot, row);
            phases.push(phase(lane, numbered("exposure", slot), exposure.start_s, exposure.end_s));
            phases.push(phase(lane, numbered("readout", slot), readout.start_s + late_s, readout.end_s + late_s));
        }
    }
    let first = schedule.readout(frame, RowIndex(0));
    let last = schedule.slot_readout(frame, slots - 1, schedule.last_row());
    let next = schedule.readout(FrameIndex(1), RowIndex(0));
    let read_s = last.end_s + times.stalled_s;
    phases.push(phase("sensor", "readout".to_owned(), first.start_s, read_s));
    phases.push(phase("sensor", "blanking".to_owned(), read_s, next.start_s));
    if let Some(last_s) = times.last_feature_s {
        let from_s = first.end_s + memory_s(schedule);
        phases.push(phase("extractor", "features".to_owned(), from_s, from_s + times.stalled_s + last_s));
    }
    for (name, span) in link_spans(sensor, &times, (first, last)) {
        phases.push(phase("link", name.to_owned(), span.start_s, span.end_s));
    }
    Ok(phases)
}

/// When rows and features are on the link in a frame whose first and last rows are read in these spans.
fn link_spans(sensor: &SensorSetup, times: &LinkTimes, (first, last): (Span, Span)) -> Vec<(&'static str, Span)> {
    let memory_s = memory_s(&sensor.schedule);
    let read_s = last.end_s + memory_s + times.stalled_s;
    let rows_end_s = read_s + times.rows_tail_s;
    let mut spans = Vec::new();
    if sensor.link.mode.sends_codes() {
        spans.push(("rows", Span { start_s: first.end_s + memory_s, end_s: rows_end_s }));
    }
    if sensor.link.mode.sends_features() {
        let start_s = times.features_from_s.map_or(rows_end_s, |from_s| greater(rows_end_s, read_s + from_s));
        spans.push(("features", Span { start_s, end_s: read_s + times.tail_s }));
    }
    spans
}

/// First clock of the second frame in run time: zero of the picture of two frames.
fn second_frame_s(schedule: &Schedule) -> f64 {
    let zero = schedule.frame_start_clk(FrameIndex(1));
    schedule.span(ClockSpan { start: zero, end: zero }).start_s
}

/// When rows are read and what is on the link, from the start of the second frame, over three frames.
fn frame_lanes(sensor: &SensorSetup, features: u64) -> Result<Vec<Phase>, Error> {
    let schedule = &sensor.schedule;
    let zero_s = second_frame_s(schedule);
    let times = sensor.link_times(features)?;
    let mut lanes = Vec::new();
    let mut push = |lane: &str, name: &str, start_s: f64, end_s: f64| {
        let (start_us, end_us) = (1e6 * (start_s - zero_s), 1e6 * (end_s - zero_s));
        lanes.push(Phase { lane: lane.to_owned(), name: name.to_owned(), start_us, end_us });
    };
    for frame in (0..3).map(FrameIndex) {
        let first = schedule.readout(frame, RowIndex(0));
        let last = schedule.slot_readout(frame, schedule.slots().len() - 1, schedule.last_row());
        push("readout", "rows", first.start_s, last.end_s);
        push("readout", "blanking", last.end_s, schedule.readout(FrameIndex(frame.0 + 1), RowIndex(0)).start_s);
        for (name, span) in link_spans(sensor, &times, (first, last)) {
            push("link", name, span.start_s, span.end_s);
        }
    }
    Ok(lanes)
}

/// Exposures and readouts of three frames in time over rows, from the start of the second.
fn bands(schedule: &Schedule) -> Vec<RowBand> {
    let zero_s = second_frame_s(schedule);
    let mut bands = Vec::new();
    for frame in 0..3 {
        for slot in 0..schedule.slots().len() {
            let frame = FrameIndex(frame);
            let us = |span: Span| [1e6 * (span.start_s - zero_s), 1e6 * (span.end_s - zero_s)];
            let rows = [RowIndex(0), schedule.last_row()];
            let exposures = rows.map(|row| us(schedule.slot_exposure(frame, slot, row)));
            let readouts = rows.map(|row| us(schedule.slot_readout(frame, slot, row)));
            for (kind, [first_us, last_us]) in [(BandKind::Exposure { slot }, exposures), (BandKind::Readout, readouts)]
            {
                bands.push(RowBand { kind, frame: frame.0, first_us, last_us });
            }
        }
    }
    bands
}
