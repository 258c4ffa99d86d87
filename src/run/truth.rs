//! Ground truth of a run's frames: views of the current and the next frame, and full colour beside a mosaic.

use super::render_inputs::{ExposureId, PictureId};
use super::state::Session;
use crate::error::Error;
use crate::optics::Mosaic;
use crate::optics::truth::TruthView;
use crate::plane::Plane;
use crate::pose::Pose;
use crate::scene::light::BANDS;
use crate::units::{FrameIndex, RowIndex};

/// Names of the bands as channels of a picture: 600-700, 500-600, 400-500 nm, and near infrared.
pub const BAND_CHANNELS: [&str; BANDS] = ["R", "G", "B", "NIR"];

impl Session {
    /// When the rows of a camera's picture are seen: the middle of each one's longest exposure, in seconds of run time. Known of
    /// frames that were simulated, and of the one after them.
    pub fn row_times_s(&self, frame: FrameIndex, camera: usize) -> Vec<f64> {
        let schedule = &self.setup.exposure.schedules(frame)[camera];
        let rows = 0..self.setup.cameras[camera].size.height_px;
        rows.map(|row| schedule.exposure(frame, RowIndex(row)).middle_s()).collect()
    }

    /// A camera's picture with the pose of each row; frames as in `row_times_s`. `pose` is the body's motion in the world.
    pub fn view<'a>(
        &'a self,
        frame: FrameIndex,
        camera: usize,
        pose: &'a (dyn Fn(f64) -> Pose + Sync),
    ) -> TruthView<'a> {
        TruthView::new(&self.setup.cameras[camera], self.row_times_s(frame, camera), pose)
    }

    /// Mean photons of each band at each pixel of the window in the longest exposure of a frame, as they reach its filter: what the mosaic
    /// lets through of them is the frame's `photons`, sample by sample of the same rays. Near infrared only where the lens passes it.
    /// Fails on a picture that cannot be read any more.
    pub fn colour(&self, frame: FrameIndex, camera: usize) -> Result<Vec<(&'static str, Plane<f32>)>, Error> {
        let schedule = &self.setup.exposure.schedules(frame)[camera];
        let window = &self.setup.windows[camera];
        let passed = if window.infrared_transmission > 0.0 { BANDS } else { BANDS - 1 };
        let of_band = |band: usize| {
            let mut only = [0.0; BANDS];
            only[band] = 1.0;
            let (filter, _) = Mosaic::parse("mono", &[('M', only)]).expect("one filter over all pixels is a pattern");
            let alone = self.setup.resolved.scenario.fitted(window.clone().with_mosaic(filter))?;
            let exposure_id = ExposureId { picture: PictureId { frame, camera }, slot: 0 };
            Ok((BAND_CHANNELS[band], self.setup.exposure_of(exposure_id, &alone, schedule)?.photons))
        };
        (0..passed).map(of_band).collect()
    }
}
