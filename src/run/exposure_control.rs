//! Exposure and gain of each frame: fixed, or set by automatic exposure from mean codes, with the latency of the registers.

use super::sensor::SensorSetup;
use crate::error::Error;
use crate::num::u32_from;
use crate::readout::{AutoExposure, Schedule};
use crate::units::{CameraIndex, FrameIndex};

#[derive(Clone)]
pub(super) struct ExposureControl {
    /// One a camera, with the exposure of the configuration.
    schedules: Vec<Schedule>,
    auto: Option<AutoExposure>,
    gain: f64,
}

impl ExposureControl {
    /// For so many cameras. Fails on limits of the automatic exposure that contradict schedule or converter.
    pub fn new(sensor: &SensorSetup, cameras: usize) -> Result<Self, Error> {
        let schedules = (0..cameras).map(|camera| sensor.schedule.for_camera(CameraIndex(u32_from(camera)))).collect();
        Ok(Self { schedules, auto: sensor.auto_exposure()?, gain: sensor.parameters.adc.gain })
    }

    /// Gain of the ramp in effect in a frame.
    pub fn gain(&self, frame: FrameIndex) -> f64 {
        self.auto.as_ref().map_or(self.gain, |auto| auto.in_effect(frame).gain)
    }

    /// Each camera's times of a frame, with the exposure in effect.
    pub fn schedules(&self, frame: FrameIndex) -> Vec<Schedule> {
        let Some(auto) = &self.auto else { return self.schedules.clone() };
        let settings = auto.in_effect(frame);
        let with = |schedule: &Schedule| {
            let changed = schedule.with_exposure(settings.exposure_lines, settings.fine_clk);
            changed.expect("the automatic exposure keeps to the frame's limits")
        };
        self.schedules.iter().map(with).collect()
    }

    /// Tells the automatic exposure a frame's mean code.
    pub fn after_frame(&mut self, frame: FrameIndex, mean_dn: f64) {
        if let Some(auto) = &mut self.auto {
            auto.after_frame(frame, mean_dn);
        }
    }
}
