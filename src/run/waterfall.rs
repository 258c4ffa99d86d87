//! From the middle of the exposure to the pose, step by step: every step ends where the next one starts.

use std::collections::BTreeMap;

use super::sensor::SensorSetup;
use super::timing::memory_s;
use crate::error::Error;
use crate::link::{FeatureReady, Flow, PlannedPacket, Sent};
use crate::num::{f64_from_u64, f64_from_usize, greater, index};
use crate::readout::Schedule;
use crate::report::latency_record::{LatencyStep, Waterfall};
use crate::units::{Clocks, FrameIndex, RowIndex};

/// A frame as the link carried it.
#[derive(Clone, Debug)]
pub(super) struct SentFrame {
    pub flow: Flow,
    pub schedule: Schedule,
    pub frame: FrameIndex,
    /// The clock in which each feature left the extractor.
    pub out_clk: Vec<u64>,
}

/// A packet on the lanes, in run time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PacketTime {
    /// Header, payload and checksum.
    pub bytes: u64,
    /// Its burst starts.
    pub start_s: f64,
    /// Its last bit has left.
    pub last_bit_s: f64,
}

struct Steps {
    zero_s: f64,
    now_s: f64,
    steps: Vec<LatencyStep>,
}

impl Steps {
    fn new(zero_s: f64) -> Self {
        Self { zero_s, now_s: zero_s, steps: Vec::new() }
    }

    /// From the exposure to the end of the column memory of a row that is read so much later than scheduled; when that is.
    fn until_memory(&mut self, (sensor, sent): (&SensorSetup, &SentFrame), row: RowIndex, late_s: f64) -> f64 {
        let SentFrame { schedule, frame, .. } = sent;
        let slot = schedule.slots().len() - 1;
        let (exposure, readout) = (schedule.slot_exposure(*frame, slot, row), schedule.slot_readout(*frame, slot, row));
        self.until("exposure", exposure.end_s, None);
        self.until("wait for the row", readout.start_s + late_s, None);
        self.until("conversion", readout.end_s + late_s, Some(sensor.line_slack_s()));
        let read_s = readout.end_s + late_s + memory_s(schedule);
        self.until("column memory", read_s, None);
        read_s
    }

    /// Adds a step until a time; one that has passed already takes no time and is left out.
    fn until(&mut self, step: &str, end_s: f64, slack_s: Option<f64>) {
        let end_s = greater(end_s, self.now_s);
        if end_s > self.now_s {
            let us = |time_s: f64| 1e6 * (time_s - self.zero_s);
            self.steps.push(LatencyStep {
                step: step.to_owned(),
                start_us: us(self.now_s),
                end_us: us(end_s),
                slack_us: slack_s.map(|slack_s| 1e6 * slack_s),
            });
        }
        self.now_s = end_s;
    }
}

impl SensorSetup {
    /// Latency of a frame with so many features spread evenly over the picture, of a rig of so many cameras. Fails on a row that the link
    /// cannot carry.
    pub fn waterfall(&self, features: u64, cameras: u32) -> Result<Waterfall, Error> {
        let out_clk = self.extractor_clocks(features).map_or_else(Vec::new, |clocks| clocks.out_clk);
        let flow = self.flow_of(features)?;
        let sent = SentFrame { flow, schedule: self.schedule.clone(), frame: FrameIndex(0), out_clk };
        Ok(self.waterfall_of(&sent, features, cameras))
    }

    /// Latency of a frame that was sent, of which the tracker gets so many features. The host decodes and extracts one camera's frame after
    /// the other, and each of them is like this one.
    pub(super) fn waterfall_of(&self, sent: &SentFrame, features: u64, cameras: u32) -> Waterfall {
        let frame = self.frame_steps(sent, features, f64::from(cameras));
        let pose_us = self.host.and_then(|_| frame.last().map(|last| last.end_us));
        Waterfall {
            first_feature: self.feature_steps(sent),
            pose_us,
            features,
            cameras,
            host: self.host.map_or("none", |host| host.name).to_owned(),
            measured_host_us: None,
            frame,
        }
    }

    /// When each packet of a frame is on the lanes.
    pub(super) fn packet_times(&self, flow: &Flow, schedule: &Schedule, frame: FrameIndex) -> Vec<PacketTime> {
        let last = schedule.slot_readout(frame, schedule.slots().len() - 1, schedule.last_row());
        let zero_s =
            last.end_s + memory_s(schedule) + self.link.seconds(flow.stalled) - self.link.seconds(flow.rows_end);
        let at = |clk: Clocks| zero_s + self.link.seconds(clk);
        let time =
            |sent: &Sent| PacketTime { bytes: sent.bytes, start_s: at(sent.start), last_bit_s: at(sent.data_end) };
        flow.sent.iter().map(time).collect()
    }

    /// What a line has left after the work that limits it.
    fn line_slack_s(&self) -> f64 {
        let schedule = &self.schedule;
        let spare_clk = schedule.line_clk().0.saturating_sub(schedule.line_limit().needed_clk);
        schedule.line_time_s() * f64_from_u64(spare_clk) / f64_from_u64(schedule.line_clk().0)
    }

    fn frame_steps(&self, sent: &SentFrame, features: u64, cameras: f64) -> Vec<LatencyStep> {
        let SentFrame { flow, schedule, frame, out_clk } = sent;
        let period_s = schedule.frame_time_s();
        let stalled_s = self.link.seconds(flow.stalled);
        let mut steps = Steps::new(schedule.t_frame(*frame));
        let read_s = steps.until_memory((self, sent), schedule.last_row(), stalled_s);
        let ready = self.features_ready(out_clk);
        if let Some(last) = ready.last() {
            let behind = (self.whole(flow, *last).0).saturating_sub(flow.rows_end.0);
            let spare_clk = f64_from_u64(self.extractor_clk_available()) - f64_from_u64(out_clk[out_clk.len() - 1] + 1);
            let slack_s = spare_clk / f64_from_u64(self.compute_hz) - stalled_s;
            steps.until("extractor", read_s + self.link.seconds(Clocks(behind)), Some(slack_s));
        }
        let last_bit_s = read_s + self.link.seconds(flow.last_bit());
        steps.until("link", last_bit_s, Some(period_s - self.link.seconds(flow.end())));
        let Some(host) = self.host else { return steps.steps };
        // A packet is decoded when its last byte is there and those before it are done.
        let seconds = |clocks: u64| self.link.seconds(Clocks(clocks));
        let mut decoded_s = 0.0;
        let mut busy_s = 0.0;
        for packet in &flow.sent {
            let packet_s = cameras * host.decode_s(f64_from_u64(packet.bytes));
            decoded_s = greater(decoded_s, seconds(packet.data_end.0)) + packet_s;
            busy_s += packet_s;
        }
        let last_s = flow.sent.last().map_or(0.0, |last| seconds(last.data_end.0));
        let extracts = !self.link.mode.sends_features();
        let pixels = if extracts { cameras * f64_from_usize(self.size.pixel_count()) } else { 0.0 };
        busy_s += host.extract_s(pixels) + host.track_s(f64_from_u64(features));
        let slack_s = Some(period_s - busy_s);
        steps.until("host decoding", last_bit_s + decoded_s - last_s, slack_s);
        steps.until("host extraction", steps.now_s + host.extract_s(pixels), slack_s);
        steps.until("tracker", steps.now_s + host.track_s(f64_from_u64(features)), slack_s);
        steps.steps
    }

    /// When a feature is whole, in `byte_clk` from the frame's first burst.
    fn whole(&self, flow: &Flow, feature: FeatureReady) -> Clocks {
        let from_schedule = || flow.lead.0 + self.row_period().clocks(feature.row.into()).0;
        let read = flow.row_read.get(index(feature.row)).map_or_else(from_schedule, |read| read.0);
        Clocks(read + feature.after.0)
    }

    fn feature_steps(&self, sent: &SentFrame) -> Vec<LatencyStep> {
        let SentFrame { flow, schedule, frame, out_clk } = sent;
        let is_feature = |packet: &PlannedPacket| matches!(packet, PlannedPacket::Features { count, .. } if *count > 0);
        let packet = flow.sent.iter().find(|sent| is_feature(&sent.packet));
        let (Some(first), Some(packet)) = (self.features_ready(&out_clk[..out_clk.len().min(1)]).pop(), packet) else {
            return Vec::new();
        };
        let row = RowIndex(first.row);
        // Rows before this one may have waited for the link.
        let from_schedule = flow.lead.0 + self.row_period().clocks(first.row.into()).0;
        let read = flow.row_read.get(index(first.row)).map_or(from_schedule, |read| read.0);
        let late_s = self.link.seconds(Clocks(read.saturating_sub(from_schedule)));
        let exposure = schedule.slot_exposure(*frame, schedule.slots().len() - 1, row);
        let mut steps = Steps::new(0.5 * (exposure.start_s + exposure.end_s));
        let read_s = steps.until_memory((self, sent), row, late_s);
        steps.until("extractor", read_s + self.link.seconds(first.after), None);
        let arrives_s = read_s + self.link.seconds(Clocks(packet.data_end.0.saturating_sub(read)));
        steps.until("link", arrives_s, None);
        if let Some(host) = self.host {
            steps.until("host decoding", arrives_s + host.decode_s(f64_from_u64(packet.bytes)), None);
        }
        steps.steps
    }
}

/// Reasons for what a waterfall does not have, under their paths in a report.
pub fn waterfall_reasons(waterfall: &Waterfall, prefix: &str) -> BTreeMap<String, String> {
    let mut reasons = BTreeMap::new();
    let mut put = |is_absent: bool, path: &str, reason: &str| {
        if is_absent {
            reasons.insert(format!("{prefix}waterfall.{path}"), reason.to_owned());
        }
    };
    let lacks = |steps: &[LatencyStep]| steps.iter().any(|step| step.slack_us.is_none());
    put(lacks(&waterfall.frame), "frame.slack_us", "the step has no limit");
    put(lacks(&waterfall.first_feature), "first_feature.slack_us", "the step has no limit");
    put(waterfall.pose_us.is_none(), "pose_us", "host.model is none");
    put(waterfall.measured_host_us.is_none(), "measured_host_us", "no time was measured");
    reasons
}
