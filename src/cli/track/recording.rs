//! Reads what an EuRoC folder, or the folder of one of its cameras, says of the rig: calibration, truth, IMU, and the
//! paths of its pictures.

use std::path::Path;

use sensel::error::Error;
use sensel::files::content_error;
use sensel::files::euroc::{CameraFolder, EurocReader, FrameEntry, ImuFolder};
use sensel::files::grey;
use sensel::files::tum::TumFolder;
use sensel::pose::{Pose, TimedPose};
use sensel::tracker::CameraCalibration;

/// A recording, whichever its layout.
pub struct AnyRecording {
    pub cameras: Vec<CameraCalibration>,
    /// Pictures of each camera in rising time.
    pub frames: Vec<Vec<FrameEntry>>,
    pub ground_truth: Option<Vec<TimedPose>>,
    pub imu: Option<ImuFolder>,
}

impl AnyRecording {
    /// Reads everything but the pictures. Fails on a folder of no known layout, or a file that is not what it should be.
    pub fn open(folder: &Path) -> Result<Self, Error> {
        if TumFolder::is_one(folder) {
            let TumFolder { frames, lens, ground_truth } = TumFolder::open(folder)?;
            let Some(first) = frames.first() else {
                return Err(content_error(folder, "lists no picture"));
            };
            let size = grey::read(&first.path)?.codes.size();
            let camera = CameraCalibration { lens, size, body_from_camera: Pose::IDENTITY };
            return Ok(Self { cameras: vec![camera], frames: vec![frames], ground_truth, imu: None });
        }
        let reader = EurocReader::open(folder)?;
        let calibration = |folder: &CameraFolder| CameraCalibration {
            lens: folder.camera.lens,
            size: folder.camera.size,
            body_from_camera: folder.camera.body_from_camera,
        };
        Ok(Self {
            cameras: reader.cameras().iter().map(calibration).collect(),
            frames: reader.cameras().iter().map(|folder| folder.frames.clone()).collect(),
            ground_truth: reader.ground_truth().map(<[TimedPose]>::to_vec),
            imu: reader.imu().cloned(),
        })
    }

    /// The truth of what the tracker reports: the body, or one camera's own position.
    pub fn reported(&self, truth: &[TimedPose]) -> Vec<TimedPose> {
        let arm = match &self.cameras[..] {
            [only] => Pose { translation_m: only.body_from_camera.translation_m, ..Pose::IDENTITY },
            _ => Pose::IDENTITY,
        };
        truth.iter().map(|pose| TimedPose { world_from_body: pose.world_from_body.then(&arm), ..*pose }).collect()
    }
}
