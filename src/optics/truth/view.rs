//! The view whose ground truth is computed.

use super::super::camera::Camera;
use crate::num::{f64_from_usize, index, u64_from, u64_truncated};
use crate::pose::Pose;
use glam::{DVec2, DVec3};

/// A picture's rows in time.
pub struct TruthView<'a> {
    /// Who looks.
    pub camera: &'a Camera,
    /// Middle of each row's exposure in seconds of run time.
    row_times_s: Vec<f64>,
    /// Where the camera is at these times.
    pub(super) row_poses: Vec<Pose>,
    world_from_body: &'a (dyn Fn(f64) -> Pose + Sync),
}

impl<'a> TruthView<'a> {
    /// A view whose rows are seen at these times. Panics if there is not one for each row of the camera's picture.
    pub fn new(camera: &'a Camera, row_times_s: Vec<f64>, world_from_body: &'a (dyn Fn(f64) -> Pose + Sync)) -> Self {
        assert!(row_times_s.len() == index(camera.size.height_px), "a view needs one time for each row");
        let mut row_poses: Vec<Pose> = Vec::with_capacity(row_times_s.len());
        for (row, &t_s) in row_times_s.iter().enumerate() {
            let known = row.checked_sub(1).filter(|&before| row_times_s[before] == t_s).map(|before| row_poses[before]);
            row_poses.push(known.unwrap_or_else(|| world_from_body(t_s).then(&camera.body_from_camera)));
        }
        Self { camera, row_times_s, row_poses, world_from_body }
    }

    /// Middle of each row's exposure in seconds of run time.
    pub fn row_times_s(&self) -> &[f64] {
        &self.row_times_s
    }

    /// `world_from_camera` at the middle of each row's exposure.
    pub fn row_poses(&self) -> &[Pose] {
        &self.row_poses
    }

    /// Unit bearing in the camera's frame of a pixel's centre.
    pub(super) fn bearing(&self, x_px: usize, y_px: usize) -> Option<DVec3> {
        let position_px = DVec2::new(f64_from_usize(x_px), f64_from_usize(y_px));
        self.camera.lens.unproject(position_px).filter(|bearing| bearing.is_finite())
    }

    /// Whether all rows are seen at once.
    pub(super) fn is_instant(&self) -> bool {
        self.row_times_s.windows(2).all(|pair| pair[0] == pair[1])
    }

    /// The rows above and below a position, and the share of the way between them. Positions beyond the picture count as its edge.
    fn rows_around(&self, y_px: f64) -> (usize, usize, f64) {
        let last = self.row_times_s.len() - 1;
        let y_px = y_px.clamp(0.0, f64_from_usize(last));
        let above = usize::try_from(u64_truncated(y_px).min(u64_from(last))).expect("a row of the picture");
        (above, (above + 1).min(last), y_px - f64_from_usize(above))
    }

    /// Time at which a position between rows is seen: linear between its rows, and the edge row's beyond the picture.
    pub fn time_s(&self, y_px: f64) -> f64 {
        let (above, below, share) = self.rows_around(y_px);
        self.row_times_s[above] + share * (self.row_times_s[below] - self.row_times_s[above])
    }

    /// When the middle of a row's exposure is, in seconds of run time.
    pub(super) fn row_time_s(&self, row: usize) -> f64 {
        self.row_times_s[row]
    }

    /// `world_from_camera` at that time, exact.
    pub(super) fn pose(&self, y_px: f64) -> Pose {
        (self.world_from_body)(self.time_s(y_px)).then(&self.camera.body_from_camera)
    }

    /// The same by interpolation between the rows' poses: cheap, and off by an eighth of the acceleration times the row time squared.
    pub(super) fn pose_between(&self, y_px: f64) -> Pose {
        let (above, below, share) = self.rows_around(y_px);
        let (a, b) = (self.row_poses[above], self.row_poses[below]);
        Pose::new(a.rotation.lerp(b.rotation, share), a.translation_m.lerp(b.translation_m, share))
    }
}
