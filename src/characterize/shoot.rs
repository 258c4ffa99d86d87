//! One frame of uniform light: returns the codes of a shot. Only this file calls the chain for a frame.

use super::set::{PlannedShot, SeriesExposure, Set};
use crate::effects::chain::{Capture, Chain, RowTimes};
use crate::num::{f64_from_usize, greater};
use crate::plane::Plane;
use crate::run::SensorSetup;
use crate::units::{CameraIndex, RowIndex};

/// When the rows of the measured part of the array are read: as the sequencer reads them.
pub struct ReadoutTiming {
    /// Wait between exposure and readout in seconds, of every row of the array's part.
    storage_s: Vec<f64>,
    /// The same of the rows that are kept.
    kept_s: Vec<f64>,
    line_s: f64,
    /// From frame to frame: the sequencer's, or the longest exposure where that is more.
    period_s: f64,
}

impl ReadoutTiming {
    /// Of the first rows of the array. Rows beyond a window wait as its last one does.
    pub fn new(sensor: &SensorSetup, set: &Set) -> Self {
        let schedule = &sensor.schedule;
        let binning = schedule.geometry().binning();
        let wait_s = |row: u32| schedule.storage_s(RowIndex(row / binning).min(schedule.last_row()));
        let rows = set.channel.array_size(set.size).height_px;
        Self {
            storage_s: (0..rows).map(wait_s).collect(),
            kept_s: (0..set.size.height_px).map(|row| wait_s(set.channel.array_row(row))).collect(),
            line_s: schedule.line_time_s(),
            period_s: greater(schedule.frame_time_s(), set.points.last().map_or(0.0, SeriesExposure::exposure_s)),
        }
    }

    /// Mean over the kept rows of a function of the storage time in seconds.
    pub fn mean_of(&self, of: impl Fn(f64) -> f64) -> f64 {
        self.kept_s.iter().map(|&wait_s| of(wait_s)).sum::<f64>() / f64_from_usize(self.kept_s.len())
    }

    /// Mean and population standard deviation of the waits over the kept rows.
    pub fn mean_and_sigma_s(&self) -> (f64, f64) {
        let mean = self.mean_of(|wait_s| wait_s);
        (mean, self.mean_of(|wait_s| (wait_s - mean) * (wait_s - mean)).sqrt())
    }

    fn of(&self, shot: &PlannedShot) -> Vec<RowTimes> {
        let exposure_s = shot.exposure.exposure_s();
        let start_s = f64::from(shot.frame.0) * self.period_s;
        let row = |(row, &storage_s): (usize, &f64)| RowTimes {
            exposure_s,
            storage_s,
            readout_s: start_s + f64_from_usize(row) * self.line_s,
        };
        self.storage_s.iter().enumerate().map(row).collect()
    }
}

/// Codes of the kept rows and columns of one frame.
pub fn capture_frame(chain: &Chain, set: &Set, shot: &PlannedShot, times: &ReadoutTiming) -> Plane<u16> {
    let photons = if shot.is_lit { shot.exposure.photons } else { 0.0 };
    let light = set.channel.light(set.channel.array_size(set.size), photons);
    let captured = chain.capture(&light, Capture::single(CameraIndex(0), shot.frame), &times.of(shot));
    set.channel.pick(captured.codes, set.size)
}
