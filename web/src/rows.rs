//! When each row of the last frame is exposed, read and sent, and each packet on the lanes, for the page's drawing to scale.

use sensel::error::Error;
use sensel::link::{Flow, PlannedPacket};
use sensel::num::f64_from_u64;
use sensel::run::{Frame, SensorSetup};
use sensel::units::{Clocks, RowIndex};

/// The frame's packets in time, with its features' own clocks.
fn flow(sensor: &SensorSetup, frame: &Frame) -> Result<Flow, Error> {
    let out_clk = &frame.cameras[0].features_clk;
    sensor.flow_at(&sensor.packets(frame.frame, &sensor.batches(out_clk))?, out_clk)
}

/// Seconds of run time of a clock of the link.
fn link_s(sensor: &SensorSetup, frame: &Frame, flow: &Flow, clock: Clocks) -> f64 {
    let schedule = &sensor.schedule;
    // The first row is read at `lead`; behind serial lanes a line memory stands between the columns and the link.
    let memory_s = if schedule.shift_lane_clk().0 > 0 { schedule.line_time_s() } else { 0.0 };
    let read_s = schedule.readout(frame.frame, RowIndex(0)).end_s + memory_s;
    let signed = f64_from_u64(clock.0) - f64_from_u64(flow.lead.0);
    read_s + signed * sensor.link.seconds(Clocks(1))
}

/// Start and end of exposure, readout and packet of each row, in us from the start of the first row's exposure. NaN: not sent.
pub fn rows_us(sensor: &SensorSetup, frame: &Frame) -> Result<Vec<f64>, Error> {
    let schedule = &sensor.schedule;
    let flow = flow(sensor, frame)?;
    let zero_s = schedule.exposure(frame.frame, RowIndex(0)).start_s;
    let mut table = Vec::new();
    let sent = |row: u32| flow.sent.iter().find(|sent| sent.packet == PlannedPacket::Row(row));
    for row in 0..sensor.size.height_px {
        let (exposed, read) =
            (schedule.exposure(frame.frame, RowIndex(row)), schedule.readout(frame.frame, RowIndex(row)));
        let link =
            sent(row).map_or([f64::NAN; 2], |sent| [sent.start, sent.end].map(|at| link_s(sensor, frame, &flow, at)));
        let spans = [exposed.start_s, exposed.end_s, read.start_s, read.end_s, link[0], link[1]];
        table.extend(spans.map(|at_s| 1e6 * (at_s - zero_s)));
    }
    Ok(table)
}

/// Kind of a packet as a number: 0 short or embedded, 1 row, 2 features.
fn kind(packet: PlannedPacket) -> (f64, u32, u32) {
    match packet {
        PlannedPacket::FrameStart | PlannedPacket::Embedded | PlannedPacket::FrameEnd => (0.0, 0, 0),
        PlannedPacket::LineStart(row) => (0.0, row, 0),
        PlannedPacket::Row(row) => (1.0, row, 1),
        PlannedPacket::Features { first, count, .. } => (2.0, first, count),
    }
}

/// Of each packet: kind, first row or feature, count, bytes, start and end in us from the start of the first row's exposure.
pub fn packets_us(sensor: &SensorSetup, frame: &Frame) -> Result<Vec<f64>, Error> {
    let flow = flow(sensor, frame)?;
    let zero_s = sensor.schedule.exposure(frame.frame, RowIndex(0)).start_s;
    let of = |sent: &sensel::link::Sent| {
        let (kind, first, count) = kind(sent.packet);
        let at = |clock| 1e6 * (link_s(sensor, frame, &flow, clock) - zero_s);
        [kind, first.into(), count.into(), f64_from_u64(sent.bytes), at(sent.start), at(sent.end)]
    };
    Ok(flow.sent.iter().flat_map(of).collect())
}
