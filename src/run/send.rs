//! Packs a frame's codes and features, and sends them over the link.

use super::link_timing::rows_in;
use super::sensor::SensorSetup;
use super::state::Session;
use super::waterfall::PacketTime;
use crate::compute::{Extracted, Overflow};
use crate::draw::RowId;
use crate::error::Error;
use crate::link::{self, FrameMetadata, FrameOut};
use crate::num::{f64_from_u64, index, low_u8, low_u32, u32_from, u64_from, u64_half_even};
use crate::plane::Plane;
use crate::readout::{Schedule, Shutter};
use crate::tracker::TrackedFrame;
use crate::units::{CameraIndex, FrameIndex, RowIndex};
use crate::words::RampGain;

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
    let mut indices: Vec<usize> = (0..extracted.features.len()).collect();
    if overflow == Overflow::DropWeakest {
        indices.sort_by_key(|&at| std::cmp::Reverse(extracted.features[at].score));
    }
    indices.truncate(count);
    indices.sort_unstable();
    Extracted {
        features: indices.iter().map(|&at| extracted.features[at]).collect(),
        out_clk: indices.iter().map(|&at| extracted.out_clk[at]).collect(),
        ..extracted.clone()
    }
}

/// Drops features of a frame until its packets pass before the next frame; returns how many. No more than that are dropped. Fails on rows
/// that do not pass even without features.
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
            let row_id = RowId { seed, camera, frame, slot: 0, row: RowIndex(0) };
            totals.bits_flipped += link::flip_bits(&mut bytes, sensor.bit_error_rate, row_id);
            arrived.push((bytes, sensor.packet_times(&flow, schedule, frame)));
        }
        Ok(arrived)
    }
}

/// Which of a camera's features the tracker's pose rests on; `indices` are those of the host's features in the sensor's list.
pub(super) fn marks(tracked: &TrackedFrame, camera: usize, indices: &[u32], features: usize) -> Vec<bool> {
    let mut marks = vec![false; features];
    for inlier in &tracked.inliers {
        if index(inlier.camera.0) != camera {
            continue;
        }
        let feature = indices.get(index(inlier.feature)).map(|&at| index(at));
        if let Some(mark) = feature.and_then(|feature| marks.get_mut(feature)) {
            *mark = true;
        }
    }
    marks
}
