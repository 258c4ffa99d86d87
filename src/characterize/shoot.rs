//! One frame of uniform light. Enters: a chain, a shot, the rows' waits. Leaves: codes. The only place here that knows how a chain
//! is asked for a frame.

use super::set::{Set, Shot};
use crate::effects::chain::{Capture, Chain, RowTimes};
use crate::num::f32_nearest;
use crate::plane::Plane;
use crate::readout::Schedule;
use crate::units::{CameraIndex, RowIndex, Size};

/// Waits of the region's rows between exposure and readout, in seconds: those of the sequencer.
pub struct Times {
    storage_s: Vec<f64>,
}

impl Times {
    /// Of the first rows of the array.
    pub fn new(schedule: &Schedule, size: Size) -> Self {
        Self { storage_s: (0..size.height_px).map(|row| schedule.storage_s(RowIndex(row))).collect() }
    }

    /// Mean and population standard deviation over the rows.
    pub fn mean_and_sigma_s(&self) -> (f64, f64) {
        let count = crate::num::f64_from_usize(self.storage_s.len());
        let mean = self.storage_s.iter().sum::<f64>() / count;
        let square = self.storage_s.iter().map(|wait_s| (wait_s - mean) * (wait_s - mean)).sum::<f64>() / count;
        (mean, square.sqrt())
    }
}

/// Codes of one shot.
pub fn shoot(chain: &Chain, set: &Set, shot: &Shot, times: &Times) -> Plane<u16> {
    let photons = if shot.is_lit { shot.exposure.photons } else { 0.0 };
    let light = Plane::filled(set.size, f32_nearest(photons));
    let exposure_s = shot.exposure.exposure_s();
    let rows: Vec<RowTimes> =
        times.storage_s.iter().map(|&storage_s| RowTimes { exposure_s, storage_s, readout_s: 0.0 }).collect();
    chain.capture(&light, Capture::single(CameraIndex(0), shot.frame), &rows).codes
}
