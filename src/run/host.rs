//! The host's end of a rig's links, between decoder and tracker. Enters: each camera's frame, damaged or lost as it may be. Leaves: what
//! the tracker may know of it. All of it is known from bytes, the sensor's configuration and the host's own clock.

use super::sensor::SensorSetup;
use super::session::extract_one;
use crate::compute::{Extractor, Feature, PATCH_MARGIN_PX};
use crate::error::Error;
use crate::link::Received;
use crate::num::{f64_from_u64, u32_from};
use crate::tracker::{FrameInput, RowClock};

/// What a host keeps from frame to frame.
#[derive(Default)]
pub struct Host {
    /// Time of the frame before.
    time_s: Option<f64>,
    /// When each camera's rows were exposed in the last frame that said so.
    clocks: Vec<RowClock>,
}

/// A frame of the rig as the host has it.
pub struct HostFrame {
    /// What the tracker gets.
    pub input: FrameInput,
    /// Of each camera: the places of its features in the sensor's own list.
    pub indices: Vec<Vec<u32>>,
}

impl Host {
    /// What each camera's frame brought, none where it was lost; `extractors` are the host's own, for pictures without features. A frame
    /// whose time is lost is taken to follow the one before it at the configured rate.
    ///
    /// # Errors
    /// A picture that the host's own extractor refuses.
    pub fn hear(
        &mut self,
        sensor: &SensorSetup,
        extractors: &mut [Extractor],
        received: Vec<Option<Received>>,
    ) -> Result<HostFrame, Error> {
        let t_s = self.time_s(sensor, &received);
        self.clocks.resize(received.len(), RowClock::default());
        for (clock, frame) in self.clocks.iter_mut().zip(&received) {
            if let Some(metadata) = frame.as_ref().and_then(|frame| frame.metadata) {
                let offset_s = f64_from_u64(metadata.timestamp_ns) * 1e-9 - t_s;
                *clock = RowClock { offset_s, row_time_s: f64::from(metadata.row_time_ns) * 1e-9 };
            }
        }
        let input = FrameInput { t_s, features: Vec::new(), clocks: self.clocks.clone() };
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

    /// A rig has one time a frame: its first camera's, or the next one's that arrived.
    fn time_s(&mut self, sensor: &SensorSetup, received: &[Option<Received>]) -> f64 {
        let stamp = received.iter().flatten().find_map(|frame| frame.metadata).map(|metadata| metadata.timestamp_ns);
        let t_s = match (stamp, self.time_s) {
            (Some(timestamp_ns), _) => f64_from_u64(timestamp_ns) * 1e-9,
            (None, Some(before_s)) => before_s + sensor.schedule.frame_time_s(),
            (None, None) => 0.0,
        };
        self.time_s = Some(t_s);
        t_s
    }
}

/// Features that arrived, or those that the host's own extractor finds, and their places in the sensor's list.
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
    // Lost rows are black there, and their edges are no corners. A place may stand in the pixel beside its corner's.
    let lost: Vec<u32> = frame.damaged_rows.into_iter().chain(frame.missing_rows).collect();
    features.retain(|feature| lost.iter().all(|row| row.abs_diff(feature.pixel().1) > PATCH_MARGIN_PX + 1));
    let indices = (0..u32_from(features.len())).collect();
    Ok((features, indices))
}
