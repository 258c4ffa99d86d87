//! Transfers a frame's codes and features over the link to the host. The host uses only the received bytes, the configuration and its own
//! clock.

use super::host::HostFrame;
use super::on_link::rows_in;
use super::sensor::SensorSetup;
use super::session::Session;
use super::warnings::Warnings;
use super::waterfall::{PacketTime, SentFrame};
use crate::compute::{Extracted, Overflow};
use crate::draw::RowPlace;
use crate::error::Error;
use crate::link::{self, Flow, FrameMetadata, FrameOut, LinkCounts, Traffic};
use crate::num::{f64_from_u64, greater, index, low_u8, low_u32, u32_from, u64_from, u64_half_even};
use crate::plane::Plane;
use crate::readout::{Schedule, Shutter};
use crate::tracker::TrackedFrame;
use crate::units::{CameraIndex, FrameIndex, RowIndex};
use crate::words::RampGain;

/// What the links of a run did.
#[derive(Default)]
pub(super) struct LinkTotals {
    /// What the host's decoder saw.
    pub counts: LinkCounts,
    /// What was sent.
    pub traffic: Traffic,
    /// Bits flipped on the way.
    pub bits_flipped: u64,
    /// Frames that carried rows.
    pub frames_with_rows: u64,
    /// Rows for which a readout stood still.
    pub rows_stalled: u64,
    /// For how long.
    pub stalled_s: f64,
    /// Most rows in a FIFO at once.
    pub fifo_rows_most: u32,
    /// Longest time from a last row to the last feature byte behind it; none where features are not sent.
    pub feature_latency_s: Option<f64>,
    /// Longest time from the middle of a frame's exposure to the last bit of its last packet.
    pub latency_s: f64,
    /// The frame that took it.
    pub slowest: Option<SentFrame>,
    /// The same of the last frame alone.
    pub frame_latency_s: f64,
    /// Features that left the extractor and found no time on the link before the next frame.
    pub features_dropped: u64,
    /// Frames of a camera that lost some so.
    pub frames_dropping: u64,
}

impl LinkTotals {
    fn add_flow(
        &mut self,
        sensor: &SensorSetup,
        flow: &Flow,
        (schedule, frame): (&Schedule, FrameIndex),
        out_clk: &[u64],
    ) {
        self.rows_stalled += u64::from(flow.rows_stalled);
        self.stalled_s += sensor.link.seconds(flow.stalled);
        self.fifo_rows_most = self.fifo_rows_most.max(flow.fifo_rows_most);
        if let Some(latency) = flow.feature_latency() {
            let latency_s = sensor.link.seconds(latency);
            let longest_s = self.feature_latency_s.unwrap_or(0.0);
            self.feature_latency_s = Some(greater(longest_s, latency_s));
        }
        let latency_s = sensor.latency_s(flow, schedule, frame);
        if self.slowest.is_none() || latency_s > self.latency_s {
            let (flow, schedule, out_clk) = (flow.clone(), schedule.clone(), out_clk.to_vec());
            (self.latency_s, self.slowest) = (latency_s, Some(SentFrame { flow, schedule, frame, out_clk }));
        }
        self.frame_latency_s = greater(self.frame_latency_s, latency_s);
    }

    /// Warns of features that the link had no time for.
    pub fn warn(&self, warnings: &mut Warnings) {
        let (features, frames) = (self.features_dropped, self.frames_dropping);
        if features > 0 {
            warnings.add(format!(
                "{features} features of {frames} frames of a camera found no time on the link before the next frame and were dropped; a \
                 lower compute.target_features (0 sets no limit), a faster link or a longer frame would carry them"
            ));
        }
    }
}

/// `t_frame` on the nanosecond, as the embedded line carries it.
pub(super) fn frame_time_s(schedule: &Schedule, frame: FrameIndex) -> f64 {
    f64_from_u64(nanoseconds(schedule.t_frame(frame))) * 1e-9
}

fn nanoseconds(seconds: f64) -> u64 {
    u64_half_even(seconds * 1e9)
}

/// A time for the embedded line, whose field ends at 4.29 s: longer ones stand at its end.
fn metadata_ns(seconds: f64) -> u32 {
    u32::try_from(nanoseconds(seconds)).unwrap_or(u32::MAX)
}

/// Keeps so many features, in their order: the strongest where the extractor drops the weakest, else the first that left.
fn kept(extracted: &Extracted, count: usize, overflow: Overflow) -> Extracted {
    let mut places: Vec<usize> = (0..extracted.features.len()).collect();
    if overflow == Overflow::DropWeakest {
        places.sort_by_key(|&place| std::cmp::Reverse(extracted.features[place].score));
    }
    places.truncate(count);
    places.sort_unstable();
    Extracted {
        features: places.iter().map(|&place| extracted.features[place]).collect(),
        out_clk: places.iter().map(|&place| extracted.out_clk[place]).collect(),
        ..extracted.clone()
    }
}

/// Drops features of a frame until its packets pass before the next frame; returns how many. No more than that are dropped.
///
/// # Errors
/// Rows that do not pass even without features.
fn drop_what_does_not_pass(
    sensor: &SensorSetup,
    (schedule, frame): (&Schedule, FrameIndex),
    extracted: &mut Extracted,
) -> Result<u64, Error> {
    let check = |extracted: &Extracted| {
        let packets = sensor.packets(frame, &sensor.batches(&extracted.out_clk))?;
        let flow = sensor.flow_at(&packets, &extracted.out_clk)?;
        sensor.check_passes(&flow, u64_from(extracted.features.len()), schedule)
    };
    if check(extracted).is_ok() {
        return Ok(0);
    }
    let of = |count: usize| kept(extracted, count, sensor.extractor.overflow);
    check(&of(0))?;
    // `passes` features do, `fails` do not.
    let (mut passes, mut fails) = (0, extracted.features.len());
    while fails - passes > 1 {
        let middle = usize::midpoint(passes, fails);
        if check(&of(middle)).is_ok() {
            passes = middle;
        } else {
            fails = middle;
        }
    }
    let dropped = u64_from(extracted.features.len() - passes);
    *extracted = of(passes);
    Ok(dropped)
}

/// From the exposure of one row of the picture to the next one's; 0 where rows are exposed together.
fn row_step_s(schedule: &Schedule, frame: FrameIndex) -> f64 {
    let start_s = |row| schedule.exposure(frame, RowIndex(row)).start_s;
    match schedule.shutter() {
        Shutter::Global => 0.0,
        Shutter::Rolling => (start_s(schedule.last_row().0) - start_s(0)) / f64::from(schedule.last_row().0.max(1)),
    }
}

impl Session {
    /// Packs each camera's frame and brings it over its link. Features that do not pass before the next frame are dropped and counted.
    pub(super) fn send(
        &mut self,
        frame: FrameIndex,
        schedules: &[Schedule],
        codes: &[Plane<u16>],
        extracted: &mut [Extracted],
    ) -> Result<Vec<(Vec<u8>, Vec<PacketTime>)>, Error> {
        let sensor = &self.setup.sensor;
        let gain = RampGain::saturating_from_num(self.gain);
        let features_per_gap = sensor.features_per_gap()?;
        let mut arrived = Vec::with_capacity(codes.len());
        self.totals.link.frame_latency_s = 0.0;
        for (camera, ((codes, extracted), schedule)) in codes.iter().zip(extracted).zip(schedules).enumerate() {
            let dropped = drop_what_does_not_pass(sensor, (schedule, frame), extracted)?;
            self.totals.link.features_dropped += dropped;
            self.totals.link.frames_dropping += u64::from(dropped > 0);
            let features = &extracted.features;
            let metadata = FrameMetadata {
                frame,
                timestamp_ns: nanoseconds(schedule.t_frame(frame)),
                exposure_ns: metadata_ns(schedule.exposure(frame, RowIndex(0)).length_s()),
                row_time_ns: metadata_ns(row_step_s(schedule, frame)),
                temperature_mk: Some(low_u32(u64_half_even(sensor.parameters.pixel.temperature_k * 1e3))),
                gain,
            };
            let out = FrameOut {
                // Each camera has a link of its own; beyond four of them the channels' numbers come round again.
                virtual_channel: low_u8(u32_from(camera % 4)),
                metadata,
                codes: Some(codes),
                bits: sensor.bits(),
                features: Some(features),
                batches: &sensor.batches(&extracted.out_clk),
                features_per_gap,
            };
            let packets = out.packets(&sensor.link);
            let flow = sensor.flow_at(&packets, &extracted.out_clk)?;
            if sensor.link.mode.sends_features() {
                self.totals.extractor.add_clocks(sensor, extracted, &flow);
            }
            let mut bytes = link::pack_frame(&out, &sensor.link, &mut self.totals.events)?;
            let totals = &mut self.totals.link;
            totals.add_flow(sensor, &flow, (schedule, frame), &extracted.out_clk);
            totals.traffic.add(&sensor.link.traffic_of(&packets, sensor.size, out.bits)?);
            totals.frames_with_rows += u64::from(rows_in(&packets) > 0);
            let (seed, camera) = (self.setup.resolved.scenario.seed, CameraIndex(u32_from(camera)));
            let place = RowPlace { seed, camera, frame, slot: 0, row: RowIndex(0) };
            totals.bits_flipped += link::flip_bits(&mut bytes, sensor.bit_error_rate, place);
            arrived.push((bytes, sensor.packet_times(&flow, schedule, frame)));
        }
        Ok(arrived)
    }

    /// The host's side of the link: from bytes to what the tracker may know.
    ///
    /// # Errors
    /// A picture that the host's own extractor refuses.
    pub(super) fn receive(&mut self, packets: &[Vec<u8>]) -> Result<HostFrame, Error> {
        let mut received = Vec::with_capacity(packets.len());
        // Who gets features does not look at the pictures beside them.
        let features_come = self.setup.sensor.link.mode.sends_features();
        for bytes in packets {
            let decoded = if features_come { link::decode_without_pictures(bytes) } else { link::decode(bytes) };
            self.totals.link.counts.merge(&decoded.counts);
            let mut frames = decoded.frames;
            let best = frames.iter().position(|frame| frame.metadata.is_some()).unwrap_or(0);
            received.push((best < frames.len()).then(|| frames.swap_remove(best)));
        }
        let number = u64::from(self.next_frame().0);
        self.host.receive(&self.setup.sensor, &mut self.extractors, (number, received))
    }
}

/// Which of a camera's features the tracker's pose rests on; `indices` are the places of the host's features in the sensor's list.
pub(super) fn marks(tracked: Option<&TrackedFrame>, camera: usize, indices: &[u32], features: usize) -> Vec<bool> {
    let mut marks = vec![false; features];
    for inlier in tracked.iter().flat_map(|tracked| &tracked.inliers) {
        if index(inlier.camera.0) != camera {
            continue;
        }
        let place = indices.get(index(inlier.feature)).map(|&place| index(place));
        if let Some(mark) = place.and_then(|place| marks.get_mut(place)) {
            *mark = true;
        }
    }
    marks
}
