//! Ground-truth depth. Enters: a scene, a camera, a pose. Leaves: distance along the camera's axis.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::camera::Camera;
use super::motion::{Parabola, Parabolas};
use super::render::bilinear;
use crate::num::f32_nearest;
use crate::plane::Plane;
use crate::pose::Pose;
use crate::scene::Scene;
use crate::scene::lanes::{Floats, LANES};
use crate::scene::tracer::{MISS, Packet, Stack, closest_through};
use crate::units::Span;

/// z in metres of what the centre of each pixel sees from a still pose `world_from_body`; positive infinity where it sees
/// nothing, and where the lens has no bearing.
pub fn depth(scene: &Scene, camera: &Camera, world_from_body: &Pose) -> Plane<f32> {
    let mut plane = Plane::filled(camera.size, f32::INFINITY);
    let world_from_camera = world_from_body.then(&camera.body_from_camera);
    let still = Parabola::through(Span { start_s: 0.0, end_s: 0.0 }, &|_| world_from_camera);
    let still = Parabolas::of(&[still; LANES]);
    let mut stack = Stack::new();
    let (width, half) = (plane.width_px(), Floats::splat(f32_nearest(0.5)));
    for row in 0..plane.height_px() {
        for first in (0..width).step_by(LANES) {
            let mut corners = [[Floats::splat(0.0); 3]; 4];
            let mut t_max = Floats::splat(-1.0);
            for lane in 0..LANES.min(width - first) {
                let Some(bearings) = camera.corners(first + lane, row) else { continue };
                t_max.0[lane] = f32::MAX;
                for corner in 0..4 {
                    for axis in 0..3 {
                        corners[corner][axis].0[lane] = bearings[corner][axis];
                    }
                }
            }
            let bearing = bilinear(&corners, half, half);
            let (origin_m, direction) = still.rays(bearing, Floats::splat(0.0));
            let packet = Packet { origin_m, direction, t_min: Floats::splat(0.0), t_max };
            let hits = closest_through(&scene.bvh, &scene.mesh, &packet, &mut stack);
            for lane in 0..LANES.min(width - first) {
                if hits.triangle[lane] != MISS {
                    plane.row_mut(row)[first + lane] = hits.t.0[lane] * bearing[2].0[lane];
                }
            }
        }
    }
    plane
}

#[cfg(test)]
mod tests {
    use super::super::camera::{Aperture, Pupil, RollOff};
    use super::super::lens::Lens;
    use super::*;
    use crate::scene::target;
    use crate::units::Size;

    #[test]
    fn depth_of_a_wall_is_its_distance_along_the_axis_everywhere() {
        let size = Size { width_px: 40, height_px: 30 };
        let aperture = Aperture { f_number: 2.0, transmission: 1.0, pupil: Pupil::ThinLens };
        let camera = Camera::new(Lens::pinhole(size, 1.0), size, Pose::IDENTITY, aperture, 3.0, RollOff::None).unwrap();
        let scene = target::flat(1.0).unwrap();
        let pose = Pose::new(glam::DQuat::IDENTITY, glam::DVec3::new(0.1, 0.0, 0.5));
        let plane = depth(&scene, &camera, &pose);
        // The wall stands at 2 m, the camera at 0.5 m; a few roundings of f32.
        assert!(plane.values().iter().all(|&z_m| (z_m - 1.5).abs() < 3e-6), "{:?}", plane.row(0));
    }
}
