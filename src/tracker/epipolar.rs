//! Matching along epipolar curves of any lens between two cameras at known poses, and triangulation. Points are metres.

use glam::{DMat3, DVec2, DVec3};

use crate::num::{greater, lesser};
use crate::pose::Pose;
use crate::tracker::matching::{Best, MatchRule, mutual};
use crate::tracker::rig::{DEPTH_M_MIN, Keypoint, RigCamera};
use crate::tracker::row_motion::Moving;

/// Where the partner of a keypoint may be.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Band {
    /// Greatest angle between a bearing and the epipolar plane, in radians.
    pub off_plane_rad_max: f64,
    /// Nearest depth along the first bearing, in metres.
    pub range_m_min: f64,
    /// How far the second bearing may seem to lie beyond infinity, in radians: room for noise.
    pub beyond_rad_max: f64,
}

/// Pairs (first, second) of keypoints that agree in geometry and descriptor, each the other's best. `second_from_first` maps
/// the first camera's frame into the second's; `skip` flags name keypoints that take no part. Counts compared descriptors.
pub fn matches(
    (first, skip_first): (&[Keypoint], &[bool]),
    (second, skip_second): (&[Keypoint], &[bool]),
    second_from_first: &Pose,
    (band, rule): (Band, MatchRule),
    compared: &mut u64,
) -> Vec<(usize, usize)> {
    let rotation = DMat3::from_quat(second_from_first.rotation);
    let baseline = second_from_first.translation_m;
    let mut forward = vec![Best::NONE; first.len()];
    let mut backward = vec![Best::NONE; second.len()];
    for (a, keypoint) in first.iter().enumerate().filter(|&(a, _)| !skip_first[a]) {
        let far = rotation * keypoint.bearing_at_frame_time;
        let near = (far * band.range_m_min + baseline).normalize_or_zero();
        // The plane holds the baseline and both ends of the segment; it is undefined towards the epipole.
        let normal = far.cross(near);
        let span = normal.length();
        if span < 1e-6 {
            continue;
        }
        let normal = normal / span;
        let across = normal.cross(far);
        let reach = libm::asin(lesser(span, 1.0));
        let (least, most) = (-libm::sin(band.beyond_rad_max), libm::sin(lesser(reach + band.beyond_rad_max, 1.5)));
        let off_max = libm::sin(band.off_plane_rad_max);
        for (b, other) in second.iter().enumerate() {
            let off = normal.dot(other.bearing_at_frame_time);
            if off.abs() > off_max * greater(keypoint.scale, other.scale) || skip_second[b] {
                continue;
            }
            let along = across.dot(other.bearing_at_frame_time);
            if along < least
                || along > most
                || far.dot(other.bearing_at_frame_time) <= 0.0
                || keypoint.octave.abs_diff(other.octave) > 1
            {
                continue;
            }
            *compared += 1;
            let distance = keypoint.descriptor.distance(&other.descriptor);
            forward[a].offer(b, distance);
            backward[b].offer(a, distance);
        }
    }
    mutual(&forward, &backward, rule)
}

/// One measured direction to a point: the camera, where its body was, and the position in its picture.
#[derive(Clone, Copy, Debug)]
pub struct Ray<'a> {
    pub camera: &'a RigCamera,
    /// Pose of the body at the time of the keypoint's row.
    pub body_from_world: Pose,
    pub keypoint: &'a Keypoint,
}

impl<'a> Ray<'a> {
    /// From a camera of a moving body.
    pub fn new(camera: &'a RigCamera, state: &Moving, keypoint: &'a Keypoint) -> Self {
        Self { camera, body_from_world: state.at(keypoint.offset_s), keypoint }
    }
}

/// A triangulated point.
#[derive(Clone, Copy, Debug)]
pub struct Fix {
    pub point_m: DVec3,
    /// Greatest squared distance of a position from the point's projection, in units of the keypoints' scale.
    pub miss2_px2: f64,
    /// Angle between the two rays at the point in radians.
    pub parallax_rad: f64,
}

/// Gauss-Newton steps after the mid-point; reprojection errors fall by over ten a step.
const STEPS: u32 = 4;

/// The point that two rays meet at: mid-point of their shortest connection, then least squares of the reprojection. `None`
/// for parallel rays, and where the point falls behind a camera.
pub fn triangulate(rays: &[Ray<'_>; 2]) -> Option<Fix> {
    let origin_and_direction = rays.map(|ray| {
        let world_from_body = ray.body_from_world.inverse();
        let mounting = &ray.camera.calibration.body_from_camera;
        let origin = world_from_body.point(mounting.translation_m);
        (origin, world_from_body.direction(mounting.direction(ray.keypoint.bearing)))
    });
    let [(o1, d1), (o2, d2)] = origin_and_direction;
    let cross = d1.cross(d2);
    let sine2 = cross.length_squared();
    if sine2 < 1e-10 {
        return None;
    }
    let link = o2 - o1;
    let (s, t) = (link.cross(d2).dot(cross) / sine2, link.cross(d1).dot(cross) / sine2);
    if s < DEPTH_M_MIN || t < DEPTH_M_MIN {
        return None;
    }
    let mut point_m = 0.5 * (o1 + d1 * s + o2 + d2 * t);
    for _ in 0..STEPS {
        point_m += step(rays, point_m)?;
    }
    let mut miss2_px2 = 0.0;
    for ray in rays {
        let (position_px, _) = ray.camera.project_with_jacobian(ray.body_from_world.point(point_m))?;
        let scale = ray.keypoint.scale;
        miss2_px2 = greater(miss2_px2, (position_px - ray.keypoint.position_px).length_squared() / (scale * scale));
    }
    let parallax_rad = angle_between(point_m - o1, point_m - o2);
    point_m.is_finite().then_some(Fix { point_m, miss2_px2, parallax_rad })
}

/// One Gauss-Newton step of the reprojection error.
fn step(rays: &[Ray<'_>; 2], point_m: DVec3) -> Option<DVec3> {
    let (mut hessian, mut gradient) = (DMat3::ZERO, DVec3::ZERO);
    for ray in rays {
        let rotation = DMat3::from_quat(ray.body_from_world.rotation).transpose();
        let (position_px, by_body) = ray.camera.project_with_jacobian(ray.body_from_world.point(point_m))?;
        let miss: DVec2 = (ray.keypoint.position_px - position_px) / ray.keypoint.scale;
        for (row, miss) in by_body.iter().zip(miss.to_array()) {
            let row = rotation * DVec3::from_array(*row) / ray.keypoint.scale;
            hessian += DMat3::from_cols(row * row.x, row * row.y, row * row.z);
            gradient += row * miss;
        }
    }
    let step = hessian.inverse() * gradient;
    step.is_finite().then_some(step)
}

/// Without an arc cosine, which loses half of its digits near zero.
fn angle_between(a: DVec3, b: DVec3) -> f64 {
    libm::atan2(a.cross(b).length(), a.dot(b))
}
