//! The surface behind the centre of every pixel: range, depth along the axis, normal, material.

use glam::DVec3;

use super::view::View;
use crate::num::{f32_nearest, f64_from_usize, greater, index};
use crate::parallel::collected;
use crate::plane::Plane;
use crate::pose::Pose;
use crate::scene::Scene;
use crate::scene::lanes::{Floats, LANES};
use crate::scene::mesh::{BackfaceCulled, Mesh};
use crate::scene::tracer::{MISS, Packet, Stack, closest_through};
use crate::units::Size;

/// How far the exact distance to a triangle's plane may lie from the traced one, as a share of it. Rays that meet a triangle so nearly
/// edge-on that rounding exceeds this keep the traced distance.
const REFINED_SHARE_MAX: f64 = 1e-3;

/// What the pixels of a picture see first.
#[derive(Clone, Debug, PartialEq)]
pub struct Surfaces {
    /// Distance along the ray of the pixel's centre in metres; positive infinity where it meets nothing or there is no ray.
    pub range_m: Plane<f64>,
    /// Triangle of the scene, or `tracer::MISS`.
    pub triangle: Plane<u32>,
}

/// Finds the surfaces of a view.
pub fn surfaces(scene: &Scene, view: &View<'_>) -> Surfaces {
    let size = view.camera.size;
    let found = collected(index(size.height_px), |row| surfaces_of_row(scene, view, row)).concat();
    let (range_m, triangle) = found.into_iter().unzip();
    Surfaces { range_m: Plane::from_values(size, range_m), triangle: Plane::from_values(size, triangle) }
}

fn surfaces_of_row(scene: &Scene, view: &View<'_>, row: usize) -> Vec<(f64, u32)> {
    let pose = view.row_poses[row];
    let directions: Vec<Option<DVec3>> = (0..index(view.camera.size.width_px))
        .map(|column| view.bearing(column, row).map(|bearing| pose.direction(bearing)))
        .collect();
    let mut stack = Stack::new();
    let mut found = Vec::with_capacity(directions.len());
    for group in directions.chunks(LANES) {
        let mut packet = idle();
        for (lane, direction) in group.iter().enumerate() {
            if let Some(direction) = direction {
                set_lane(&mut packet, lane, pose.translation_m, *direction, f32::MAX);
            }
        }
        let hits = closest_through(&scene.bvh, &BackfaceCulled(&scene.mesh), &packet, &mut stack);
        for (lane, direction) in group.iter().enumerate() {
            found.push(match direction {
                Some(direction) if hits.triangle[lane] != MISS => {
                    let corners_m = corners_m(&scene.mesh, hits.triangle[lane]);
                    let traced_m = f64::from(hits.t.0[lane]);
                    (refined_m(corners_m, pose.translation_m, *direction, traced_m), hits.triangle[lane])
                }
                _ => (f64::INFINITY, MISS),
            });
        }
    }
    found
}

/// A packet without rays.
pub(super) fn idle() -> Packet {
    let zero = Floats::splat(0.0);
    let along = [zero, zero, Floats::splat(1.0)];
    Packet { origin_m: [zero; 3], direction: along, t_min: zero, t_max: Floats::splat(-1.0) }
}

/// Puts a ray into a packet.
pub(super) fn set_lane(packet: &mut Packet, lane: usize, origin_m: DVec3, direction: DVec3, t_max: f32) {
    for axis in 0..3 {
        packet.origin_m[axis].0[lane] = f32_nearest(origin_m[axis]);
        packet.direction[axis].0[lane] = f32_nearest(direction[axis]);
    }
    packet.t_max.0[lane] = t_max;
}

fn corners_m(mesh: &Mesh, triangle: u32) -> [DVec3; 3] {
    mesh.corners_m(index(triangle)).map(|corner| DVec3::from_array(corner.map(f64::from)))
}

/// Distance along the unit direction to the triangle's plane.
fn refined_m([a, b, c]: [DVec3; 3], origin_m: DVec3, direction: DVec3, traced_m: f64) -> f64 {
    let normal = (b - a).cross(c - a);
    let exact_m = normal.dot(a - origin_m) / normal.dot(direction);
    let is_near = exact_m.is_finite() && (exact_m - traced_m).abs() <= REFINED_SHARE_MAX * greater(traced_m, 1e-3);
    if is_near { exact_m } else { traced_m }
}

impl Surfaces {
    /// Width and height.
    pub fn size(&self) -> Size {
        self.range_m.size()
    }

    /// Coordinate along the camera's axis in metres: the range times the bearing's z. Zero or below for what stands beside or behind a
    /// camera that sees more than 180 degrees; positive infinity where nothing is met.
    pub fn depth_m(&self, view: &View<'_>) -> Plane<f32> {
        self.of_pixels(f32::INFINITY, &|column, row, range_m, _| {
            view.bearing(column, row).map_or(f32::INFINITY, |bearing| f32_nearest(range_m * bearing.z))
        })
    }

    /// Distance from the camera in metres; positive infinity where nothing is met.
    pub fn range_m(&self) -> Plane<f32> {
        self.range_m.map(f32_nearest)
    }

    /// Unit normals in the camera's frame (x right, y down, z forward), on the side that is seen: of the triangles themselves, not
    /// smoothed between corners. Zero where nothing is met. One plane a coordinate.
    pub fn normals(&self, scene: &Scene, view: &View<'_>) -> [Plane<f32>; 3] {
        let normals = self.of_pixels(DVec3::ZERO, &|column, row, _, triangle| {
            let pose = view.row_poses[row];
            let [a, b, c] = corners_m(&scene.mesh, triangle);
            let normal = pose.rotation.conjugate() * (b - a).cross(c - a).normalize_or_zero();
            let away = view.bearing(column, row).is_some_and(|bearing| bearing.dot(normal) > 0.0);
            if away { -normal } else { normal }
        });
        [0, 1, 2].map(|axis| normals.map(|normal: DVec3| f32_nearest(normal[axis])))
    }

    /// Index of each pixel's material in the scene's list, counted from 1; 0 where nothing is met.
    pub fn materials(&self, scene: &Scene) -> Plane<u32> {
        self.of_pixels(0, &|_, _, _, triangle| scene.mesh.material_of[index(triangle)] + 1)
    }

    /// The point that a pixel sees: in the world, or as a direction where it is infinitely far. None where there is no ray.
    pub(super) fn point(&self, view: &View<'_>, column: usize, row: usize) -> Option<Point> {
        let pose = view.row_poses[row];
        let direction = pose.direction(view.bearing(column, row)?);
        let range_m = self.range_m.at(column, row);
        Some(if range_m.is_finite() {
            Point {
                place: pose.translation_m + direction * range_m,
                weight: 1.0,
                triangle: self.triangle.at(column, row),
            }
        } else {
            Point { place: direction, weight: 0.0, triangle: MISS }
        })
    }

    /// A value of every pixel that meets something.
    fn of_pixels<T: Copy + Send + Sync>(
        &self,
        nothing: T,
        value: &(dyn Fn(usize, usize, f64, u32) -> T + Sync),
    ) -> Plane<T> {
        let values = collected(self.range_m.height_px(), |row| {
            let seen = self.range_m.row(row).iter().zip(self.triangle.row(row)).enumerate();
            let of = |(column, (&range_m, &triangle)): (usize, (&f64, &u32))| {
                if triangle == MISS { nothing } else { value(column, row, range_m, triangle) }
            };
            seen.map(of).collect::<Vec<T>>()
        });
        Plane::from_values(self.size(), values.concat())
    }
}

/// A point of a surface, or (weight 0) a direction to what is infinitely far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    place: DVec3,
    weight: f64,
    pub(super) triangle: u32,
}

impl Point {
    /// In the frame of a camera.
    pub(super) fn in_camera(&self, world_from_camera: &Pose) -> DVec3 {
        world_from_camera.rotation.conjugate() * self.toward(world_from_camera)
    }

    /// From the camera to the point, in the world; of unit length where the point is infinitely far.
    pub(super) fn toward(&self, world_from_camera: &Pose) -> DVec3 {
        self.place - world_from_camera.translation_m * self.weight
    }

    /// Whether it is infinitely far.
    pub(super) fn is_far(&self) -> bool {
        self.weight == 0.0
    }
}

/// Whether a place lies on a picture: pixels reach half a pixel around their centres.
pub(super) fn is_inside(size: Size, place_px: glam::DVec2) -> bool {
    let [width, height] = [size.width_px, size.height_px].map(|edge| f64_from_usize(index(edge)));
    (-0.5..width - 0.5).contains(&place_px.x) && (-0.5..height - 0.5).contains(&place_px.y)
}
