//! A second tracker of the same packets that does not use the IMU.

use super::state::Session;
use super::totals::{Alone, FrameNotes};
use crate::error::Error;
use crate::pose::{Pose, TimedPose};
use crate::report::cameras_alone::CamerasAlone;

impl Session {
    /// Tracks every frame a second time without the IMU, where the tracker uses one. It changes nothing else. Before the first
    /// frame only. Fails on a calibration that the tracker refuses.
    pub fn track_cameras_alone(&mut self) -> Result<(), Error> {
        assert!(self.notes.is_empty(), "the second tracker sees every frame");
        if self.setup.imu_calibration().is_some() {
            let tracker = self.setup.camera_tracker()?;
            self.alone = Some(Alone { tracker, poses: Vec::new(), seconds: 0.0 });
        }
        Ok(())
    }

    /// Poses of the cameras alone; none where they are not tracked apart.
    pub fn estimate_of_cameras_alone(&self) -> Option<Vec<TimedPose>> {
        let alone = self.alone.as_ref()?;
        let pose = |(note, (pose, _)): (&FrameNotes, &(Option<Pose>, f64))| {
            Some(TimedPose { t_s: note.truth.t_s, world_from_body: (*pose)? })
        };
        Some(self.notes.iter().zip(&alone.poses).filter_map(pose).collect())
    }

    pub(super) fn figures_of_cameras_alone(
        &self,
        reasons: &mut std::collections::BTreeMap<String, String>,
    ) -> Option<CamerasAlone> {
        let estimate = self.estimate_of_cameras_alone()?;
        let tracked: Vec<f64> = self.alone.as_ref()?.poses.iter().map(|(_, tracked)| *tracked).collect();
        Some(CamerasAlone::of(&self.truth(), &estimate, &tracked, self.setup.cameras.len(), reasons))
    }
}
