//! The host's end of a rig's links, between decoder and tracker: turns each camera's frame, damaged or lost as it may be, into what the
//! tracker may know of it. All of it is known from bytes, the sensor's configuration and the host's own clock.

use super::extractor::extract_one;
use super::sensor::SensorSetup;
use crate::compute::{Extractor, Feature, PATCH_MARGIN_PX};
use crate::error::Error;
use crate::link::{FrameMetadata, Received};
use crate::num::{f64_from_u64, i64_half_even, u32_from, u64_half_even};
use crate::tracker::{FrameInput, RowClock};
use crate::units::{CameraIndex, FrameIndex};

/// Greatest distance between a frame's stamp and the time that its number calls for, in frame times, where the exposure is fixed.
const STAMP_TOLERANCE: f64 = 0.02;
/// The same where an automatic exposure moves the middle of the exposure by up to half a frame. Below 1, so that a time taken from the
/// number does not pass the next frame's stamp.
const AUTO_STAMP_TOLERANCE: f64 = 0.75;
/// Added tolerance per frame since the last accepted stamp: two crystals are each off by a thousandth at most.
const CLOCK_TOLERANCE: f64 = 2e-3;

/// What a host keeps from frame to frame.
#[derive(Default)]
pub struct Host {
    before: Option<TimedFrame>,
    cameras: Vec<CameraClock>,
}

/// A frame and its time.
#[derive(Clone, Copy)]
struct TimedFrame {
    number: u64,
    time_ns: u64,
}

/// What is known of a camera's clock.
#[derive(Clone, Copy, Debug, Default)]
struct CameraClock {
    /// The last frame whose stamp was accepted; 0 before the first.
    number: u64,
    /// When its rows were exposed then.
    rows: Option<RowClock>,
    /// From the first camera's frames to this one's by the configuration, in seconds.
    nominal_offset_s: f64,
}

impl CameraClock {
    fn offset_s(&self) -> f64 {
        self.rows.map_or(self.nominal_offset_s, |rows| rows.offset_s)
    }
}

/// A frame of the rig as the host has it.
pub struct HostFrame {
    /// What the tracker gets.
    pub input: FrameInput,
    /// Of each camera: the indices of its features in the sensor's own list.
    pub indices: Vec<Vec<u32>>,
}

impl Host {
    /// What each camera's frame of this number brought, none where it was lost; `extractors` are the host's own, for pictures without
    /// features. Numbers rise from call to call, and so do the times. A frame whose stamp is lost, or is not one that its number allows,
    /// gets the time that its number calls for. Fails on a picture that the host's own extractor refuses.
    pub fn receive(
        &mut self,
        sensor: &SensorSetup,
        extractors: &mut [Extractor],
        (number, received): (u64, Vec<Option<Received>>),
    ) -> Result<HostFrame, Error> {
        self.begin(sensor, received.len());
        let stamps = self.believed(sensor, number, &received);
        let time_ns = self.time_ns(sensor, number, &stamps);
        let t_s = f64_from_u64(time_ns) * 1e-9;
        for (camera, metadata) in self.cameras.iter_mut().zip(stamps) {
            if let Some(metadata) = metadata {
                let offset_s = f64_from_u64(metadata.timestamp_ns) * 1e-9 - t_s;
                let rows = RowClock { offset_s, row_time_s: f64::from(metadata.row_time_ns) * 1e-9 };
                *camera = CameraClock { number, rows: Some(rows), ..*camera };
            }
        }
        self.before = Some(TimedFrame { number, time_ns });
        let clocks = self.cameras.iter().map(|camera| camera.rows.unwrap_or_default()).collect();
        let input = FrameInput { t_s, features: Vec::new(), clocks };
        let mut host = HostFrame { input, indices: Vec::new() };
        for (frame, extractor) in received.into_iter().zip(extractors) {
            let (features, indices) = match frame {
                Some(frame) => features_of(sensor, extractor, frame)?,
                None => (Vec::new(), Vec::new()),
            };
            host.input.features.push(features);
            host.indices.push(indices);
        }
        Ok(host)
    }

    fn begin(&mut self, sensor: &SensorSetup, cameras: usize) {
        let first_s = |camera: usize| sensor.schedule.for_camera(CameraIndex(u32_from(camera))).t_frame(FrameIndex(0));
        for camera in self.cameras.len()..cameras {
            let nominal_offset_s = first_s(camera) - first_s(0);
            self.cameras.push(CameraClock { nominal_offset_s, ..CameraClock::default() });
        }
    }

    /// The time that a frame's number calls for, in ns.
    fn expected_ns(&self, sensor: &SensorSetup, number: u64) -> f64 {
        let frame_ns = 1e9 * sensor.schedule.frame_time_s();
        match self.before {
            Some(before) => {
                f64_from_u64(before.time_ns) + frame_ns * f64_from_u64(number.saturating_sub(before.number))
            }
            None => 1e9 * sensor.schedule.t_frame(FrameIndex(0)) + frame_ns * f64_from_u64(number),
        }
    }

    /// Each camera's embedded line, where its stamp is one that the frame's number allows: a line's CRC passes damage once in 65,536.
    fn believed(&self, sensor: &SensorSetup, number: u64, received: &[Option<Received>]) -> Vec<Option<FrameMetadata>> {
        let frame_ns = 1e9 * sensor.schedule.frame_time_s();
        let expected_ns = self.expected_ns(sensor, number);
        let since = |frame: u64| f64_from_u64(number.saturating_sub(frame));
        let base = if sensor.schedule.params().auto.is_some() { AUTO_STAMP_TOLERANCE } else { STAMP_TOLERANCE };
        let since_rig = since(self.before.map_or(0, |before| before.number));
        let of_camera = |(frame, camera): (&Option<Received>, &CameraClock)| {
            let tolerance = base + CLOCK_TOLERANCE * (since_rig + since(camera.number));
            let metadata = frame.as_ref().and_then(|frame| frame.metadata)?;
            let apart_ns = f64_from_u64(metadata.timestamp_ns) - 1e9 * camera.offset_s() - expected_ns;
            (apart_ns.abs() <= tolerance * frame_ns).then_some(metadata)
        };
        received.iter().zip(&self.cameras).map(of_camera).collect()
    }

    /// A rig has one time per frame: its first camera's, or what the next one's that arrived says of it. It rises from frame to frame.
    fn time_ns(&self, sensor: &SensorSetup, number: u64, stamps: &[Option<FrameMetadata>]) -> u64 {
        let of_first = |(metadata, camera): (&Option<FrameMetadata>, &CameraClock)| {
            let stamp_ns = metadata.as_ref()?.timestamp_ns;
            let offset_ns = i64_half_even(1e9 * camera.offset_s());
            Some(stamp_ns.saturating_add_signed(offset_ns.saturating_neg()))
        };
        let stamp_ns = stamps.iter().zip(&self.cameras).find_map(of_first);
        let before_ns = self.before.map(|before| before.time_ns);
        match stamp_ns.filter(|&stamp_ns| before_ns.is_none_or(|before_ns| stamp_ns > before_ns)) {
            Some(stamp_ns) => stamp_ns,
            None => {
                let expected_ns = u64_half_even(self.expected_ns(sensor, number));
                before_ns.map_or(expected_ns, |before_ns| expected_ns.max(before_ns.saturating_add(1)))
            }
        }
    }
}

/// Features that arrived, or those that the host's own extractor finds, and their indices in the sensor's list.
fn features_of(
    sensor: &SensorSetup,
    extractor: &mut Extractor,
    frame: Received,
) -> Result<(Vec<Feature>, Vec<u32>), Error> {
    if sensor.link.mode.sends_features() {
        return Ok((frame.features, frame.feature_indices));
    }
    let Some(picture) = frame.picture.filter(|picture| picture.size() == sensor.size) else {
        return Ok((Vec::new(), Vec::new()));
    };
    // The host runs the same extractor on the picture it received; none of it is the sensor's energy.
    let (extracted, _) = extract_one(sensor, extractor, &picture)?;
    let mut features = extracted.features;
    // Lost rows are black there, and their edges are no corners. A position may lie in the pixel beside its corner's.
    let lost: Vec<u32> = frame.damaged_rows.into_iter().chain(frame.missing_rows).collect();
    features.retain(|feature| lost.iter().all(|row| row.abs_diff(feature.pixel().1) > PATCH_MARGIN_PX + 1));
    let indices = (0..u32_from(features.len())).collect();
    Ok((features, indices))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Resolved;
    use crate::draw::mix;

    fn sensor(more: &[&str]) -> SensorSetup {
        let set: Vec<String> =
            ["sensor.width=64", "sensor.height=48"].iter().chain(more).map(|s| (*s).into()).collect();
        SensorSetup::new(&Resolved::from_layers("box.toml", "[scene]\ngenerator = \"box\"\n", &set).unwrap()).unwrap()
    }

    fn received(frame: u32, timestamp_ns: Option<u64>) -> Option<Received> {
        let metadata = timestamp_ns.map(|timestamp_ns| FrameMetadata {
            frame: FrameIndex(frame),
            timestamp_ns,
            ..FrameMetadata::default()
        });
        Some(Received {
            virtual_channel: 0,
            frame_number: 1,
            metadata,
            shape: None,
            picture: None,
            damaged_rows: Vec::new(),
            missing_rows: Vec::new(),
            features: Vec::new(),
            feature_indices: Vec::new(),
            whole: false,
        })
    }

    /// Stamps that are lost, false or those of another frame, frames that are lost, a start in the middle, cameras with clocks
    /// of their own.
    #[test]
    fn times_rise_and_stay_near_the_truth_whatever_becomes_of_stamps() {
        const SEED: u64 = 4;
        let rigs: [&[&str]; 3] = [
            &[],
            &["sensor.readout.sync_skew_us=[0.0, 400000.0]"],
            &["sensor.readout.clock_ppm=[1000.0, -1000.0]", "sensor.readout.shutter=rolling"],
        ];
        let (mut frames, mut guessed) = (0, 0);
        for (rig, more) in rigs.iter().enumerate() {
            let sensor = sensor(more);
            let schedules = [0, 1].map(|camera| sensor.schedule.for_camera(CameraIndex(camera)));
            let frame_s = sensor.schedule.frame_time_s();
            for case in 0..100 {
                let draw = |frame: u32, of: u64| mix(SEED ^ mix(case << 40 | u64::from(frame) << 8 | of));
                let (mut host, mut before_s) = (Host::default(), f64::NEG_INFINITY);
                let first = u32::try_from(draw(0, 9) % 1000).unwrap();
                for frame in first..first + 60 {
                    if draw(frame, 0) % 4 == 0 {
                        continue;
                    }
                    let cameras = [0_u32, 1].map(|camera| {
                        let true_ns =
                            u64_half_even(1e9 * schedules[crate::num::index(camera)].t_frame(FrameIndex(frame)));
                        match draw(frame, 1 + u64::from(camera)) % 8 {
                            0 | 1 => None,
                            2 | 3 => received(frame, None),
                            4 => received(frame, Some(true_ns ^ 1 << (draw(frame, 4) % 64))),
                            _ => received(frame, Some(true_ns)),
                        }
                    });
                    let mut extractors = vec![Extractor::new(&sensor.extractor); 2];
                    let is_lost = cameras.iter().flatten().all(|frame| frame.metadata.is_none());
                    let input = host.receive(&sensor, &mut extractors, (frame.into(), cameras.into())).unwrap().input;
                    let true_s = schedules[0].t_frame(FrameIndex(frame));
                    let context = format!("seed {SEED}, rig {rig}, case {case}, frame {frame}");
                    assert!(input.t_s > before_s, "{context}: {} after {before_s}", input.t_s);
                    // A flipped bit of a stamp may move it within the tolerance; two guesses in a row may not add up beyond that by much.
                    let apart = (input.t_s - true_s).abs() / frame_s;
                    // Before the first stamp nothing is known of clocks that are off by a thousandth each.
                    let unknown = if rig == 2 { CLOCK_TOLERANCE * f64::from(frame) } else { 0.0 };
                    assert!(apart < 2.0 + unknown, "{context}: {apart} frames from the truth");
                    before_s = input.t_s;
                    frames += 1;
                    guessed += u32::from(is_lost);
                }
            }
        }
        println!("seed {SEED}: {frames} frames, {guessed} without a stamp");
        assert!(frames > 10_000 && guessed > 1_000);
    }
}
