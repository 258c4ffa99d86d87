//! Calibrated rig and its observations. Converts decoded features to keypoints with bearings, and projects points.
//!
//! Positions are pixels, points metres in the named frame, bearings unit vectors of a camera's frame.

use glam::{DMat3, DVec2, DVec3};

use crate::compute::Feature;
use crate::num::{greater, index, u32_from};
use crate::optics::lens::{Lens, ProjectionJacobian};
use crate::pose::Pose;
use crate::tracker::matching::Descriptor;
use crate::tracker::row_motion::{Moving, RowClock};
use crate::units::Size;

/// Points nearer to a camera's plane than this cannot be imaged sharply, and their derivatives blow up.
pub const DEPTH_M_MIN: f64 = 0.05;

/// What the host knows of one camera.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CameraCalibration {
    /// Lens mapping.
    pub lens: Lens,
    /// Size of the full picture in pixels.
    pub size: Size,
    /// Pose of the camera on the body.
    pub body_from_camera: Pose,
}

/// A camera with what follows from its calibration.
#[derive(Clone, Debug)]
pub struct RigCamera {
    /// As given.
    pub calibration: CameraCalibration,
    /// Inverse of the mounting.
    pub camera_from_body: Pose,
    /// Its rotation as a matrix, for derivatives.
    pub rotation: DMat3,
    /// Mean focal length in pixels: how many pixels a radian is near the axis.
    pub focal_px: f64,
}

impl RigCamera {
    /// Prepares a camera.
    pub fn new(calibration: CameraCalibration) -> Self {
        let camera_from_body = calibration.body_from_camera.inverse();
        let rotation = DMat3::from_quat(camera_from_body.rotation);
        let focal_px = calibration.lens.focal_px();
        Self { calibration, camera_from_body, rotation, focal_px }
    }

    /// A pinhole of VGA pictures at the body's origin, with this principal point.
    #[cfg(test)]
    pub fn vga_pinhole([cx_px, cy_px]: [f64; 2]) -> Self {
        use crate::optics::lens::{Intrinsics, Mapping};
        let intrinsics = Intrinsics { fx_px: 320.0, fy_px: 320.0, cx_px, cy_px };
        let lens = Lens { intrinsics, mapping: Mapping::Pinhole };
        let size = Size { width_px: 640, height_px: 480 };
        Self::new(CameraCalibration { lens, size, body_from_camera: Pose::IDENTITY })
    }

    /// Projection of a point of the body's frame; `None` outside the lens' field or outside the picture.
    pub fn project(&self, point_in_body_m: DVec3) -> Option<DVec2> {
        self.project_unclipped(point_in_body_m).filter(|&position_px| self.contains(position_px))
    }

    /// The position of [`RigCamera::project_with_jacobian`] alone, to the same bits.
    pub fn project_unclipped(&self, point_in_body_m: DVec3) -> Option<DVec2> {
        let point_m = self.rotation * point_in_body_m + self.camera_from_body.translation_m;
        if !self.may_see(point_m) {
            return None;
        }
        self.calibration.lens.project(point_m)
    }

    /// Position and its derivative by the point in the body's frame (2 x 3, pixels a metre). Not limited to the picture, so
    /// that a refinement can follow a point over the edge.
    #[inline]
    pub fn project_with_jacobian(&self, point_in_body_m: DVec3) -> Option<(DVec2, ProjectionJacobian)> {
        let point_m = self.rotation * point_in_body_m + self.camera_from_body.translation_m;
        if !self.may_see(point_m) {
            return None;
        }
        let (position_px, by_camera) = self.calibration.lens.project_with_jacobian(point_m)?;
        let transposed = self.rotation.transpose();
        let row = |r: [f64; 3]| (transposed * DVec3::from_array(r)).to_array();
        position_px.is_finite().then(|| (position_px, [row(by_camera[0]), row(by_camera[1])]))
    }

    /// Refuses points behind the camera, and points so far aside that the distortion polynomial may fold them back. Models of wide lenses
    /// know their own domain, which may reach behind the camera's plane: for them only points at the camera itself are refused.
    fn may_see(&self, point_m: DVec3) -> bool {
        if !self.calibration.lens.mapping.is_flat() {
            return point_m.is_finite() && point_m.length_squared() >= DEPTH_M_MIN * DEPTH_M_MIN;
        }
        if !point_m.is_finite() || point_m.z < DEPTH_M_MIN {
            return false;
        }
        let (intrinsics, size) = (self.calibration.lens.intrinsics, self.calibration.size);
        // The picture's half extent in tangents, with 30 % for distortion.
        let half = |extent_px: u32, centre_px: f64, focal_px: f64| {
            1.3 * greater(centre_px, f64::from(extent_px) - centre_px) / focal_px
        };
        point_m.x.abs() <= point_m.z * half(size.width_px, intrinsics.cx_px, intrinsics.fx_px)
            && point_m.y.abs() <= point_m.z * half(size.height_px, intrinsics.cy_px, intrinsics.fy_px)
    }

    fn contains(&self, position_px: DVec2) -> bool {
        let size = self.calibration.size;
        position_px.x >= 0.0
            && position_px.y >= 0.0
            && position_px.x <= f64::from(size.width_px) - 1.0
            && position_px.y <= f64::from(size.height_px) - 1.0
    }
}

/// A feature as the tracker uses it.
#[derive(Clone, Copy, Debug)]
pub struct Keypoint {
    /// Index in the camera's list of the frame.
    pub feature: u32,
    /// Position in the picture.
    pub position_px: DVec2,
    /// Time of its row minus time of the frame, in seconds.
    pub offset_s: f64,
    /// Unit vector in the camera's frame.
    pub bearing: DVec3,
    /// The bearing that it would have had at the frame's time: the rotation between the two times is taken off, translation is not.
    pub bearing_at_frame_time: DVec3,
    /// Standard deviation of the position, per axis, in units of the tracker's `position_sigma_px`: 1 at full size.
    pub scale: f64,
    /// Half-scale octave.
    pub octave: u8,
    /// 256 bits.
    pub descriptor: Descriptor,
}

/// What one camera saw, with a grid of buckets over its picture.
#[derive(Clone, Debug)]
pub struct CameraKeypoints {
    /// Usable features in the order in which they came.
    pub keypoints: Vec<Keypoint>,
    /// Times of the rows.
    clock: RowClock,
    columns: usize,
    rows: usize,
    /// Start of each bucket in `members`, row-major, and one end.
    starts: Vec<u32>,
    members: Vec<u32>,
}

/// Edge of a bucket.
const BUCKET_PX: f64 = 16.0;

impl CameraKeypoints {
    /// Takes the features that carry a descriptor, lie on the picture and have a bearing.
    pub fn new(camera: &RigCamera, features: &[Feature], clock: RowClock) -> Self {
        let size = camera.calibration.size;
        let mut keypoints = Vec::with_capacity(features.len());
        for (number, feature) in features.iter().enumerate() {
            let position_px = DVec2::new(feature.x_px(), feature.y_px());
            if feature.descriptor == [0; 32] || !camera.contains(position_px) {
                continue;
            }
            let Some(bearing) = camera.calibration.lens.unproject(position_px) else { continue };
            let scale = f64::from(1_u32 << feature.octave.min(8));
            let descriptor = Descriptor::new(&feature.descriptor);
            keypoints.push(Keypoint {
                feature: u32_from(number),
                position_px,
                offset_s: clock.row_offset_s(position_px.y, size),
                bearing,
                bearing_at_frame_time: bearing,
                scale,
                octave: feature.octave,
                descriptor,
            });
        }
        Self::bucketed(keypoints, size, clock)
    }

    fn bucketed(keypoints: Vec<Keypoint>, size: Size, clock: RowClock) -> Self {
        let buckets = |extent_px: u32| bucket(f64::from(extent_px)) + 1;
        let (columns, rows) = (buckets(size.width_px), buckets(size.height_px));
        let cell = |keypoint: &Keypoint| {
            bucket(keypoint.position_px.y).min(rows - 1) * columns + bucket(keypoint.position_px.x).min(columns - 1)
        };
        let mut starts = vec![0_u32; columns * rows + 1];
        for keypoint in &keypoints {
            starts[cell(keypoint) + 1] += 1;
        }
        for cell in 0..columns * rows {
            starts[cell + 1] += starts[cell];
        }
        let mut next = starts.clone();
        let mut members = vec![0; keypoints.len()];
        for (number, keypoint) in keypoints.iter().enumerate() {
            let slot = &mut next[cell(keypoint)];
            members[index(*slot)] = u32_from(number);
            *slot += 1;
        }
        Self { keypoints, clock, columns, rows, starts, members }
    }

    /// Whether rows have other times than the frame.
    pub fn sweeps(&self) -> bool {
        self.clock.sweeps()
    }

    /// Turns the bearings to the frame's time, by the rate at which the body turns.
    pub fn straighten(&mut self, camera: &RigCamera, state: &Moving) {
        for keypoint in &mut self.keypoints {
            let turn = state.row_from_frame(keypoint.offset_s).rotation.conjugate();
            let in_body = camera.calibration.body_from_camera.direction(keypoint.bearing);
            keypoint.bearing_at_frame_time = camera.camera_from_body.direction(turn * in_body);
        }
    }

    /// Position of a point of the body's frame at the frame's time, on the row that sees it.
    pub fn project(&self, camera: &RigCamera, point_in_body_m: DVec3, state: &Moving) -> Option<DVec2> {
        let mut position_px = camera.project(point_in_body_m)?;
        if self.clock.sweeps() {
            // The row's time depends on the row: at 1,000 px/s and 33 us per row each round leaves 3 % of the last one's change.
            for _ in 0..2 {
                let offset_s = self.clock.row_offset_s(position_px.y, camera.calibration.size);
                position_px = camera.project(state.soon(point_in_body_m, offset_s))?;
            }
        }
        Some(position_px)
    }

    /// Numbers of the keypoints within a radius of a position, bucket by bucket; the order is fixed by the input.
    pub fn near(&self, position_px: DVec2, radius_px: f64) -> impl Iterator<Item = usize> + '_ {
        let range = |centre: f64, count: usize| {
            let last = bucket(centre + radius_px).min(count - 1);
            bucket(centre - radius_px).min(count - 1)..last + 1
        };
        let (columns, rows) = (range(position_px.x, self.columns), range(position_px.y, self.rows));
        let radius2 = radius_px * radius_px;
        rows.flat_map(move |row| {
            let from = index(self.starts[row * self.columns + columns.start]);
            let to = index(self.starts[row * self.columns + columns.end]);
            self.members[from..to].iter().map(|&member| index(member))
        })
        .filter(move |&member| (self.keypoints[member].position_px - position_px).length_squared() <= radius2)
    }
}

/// Bucket of a coordinate; negative ones fall into the first.
fn bucket(position_px: f64) -> usize {
    index(crate::num::u32_truncated(position_px / BUCKET_PX))
}
