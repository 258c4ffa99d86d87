//! The surface behind the centre of every pixel: range, depth along the axis, normal, material.

use glam::DVec3;

use super::view::TruthView;
use crate::num::{f32_nearest, f64_from_usize, greater, index, u32_from};
use crate::parallel::collected;
use crate::plane::Plane;
use crate::pose::Pose;
use crate::scene::Scene;
use crate::scene::lanes::LANES;
use crate::scene::mesh::{BackfaceCulled, Mesh};
use crate::scene::object::Shapes;
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
    /// Triangle of the object's shape, or `tracer::MISS`.
    pub triangle: Plane<u32>,
    /// Number of the moving object from 1; 0 for the static scene.
    pub object: Plane<u32>,
}

/// What one pixel sees.
#[derive(Clone, Copy)]
struct NearestSurface {
    range_m: f64,
    triangle: u32,
    object: u32,
}

/// Finds the surfaces of a view.
pub fn surfaces<'a>(scene: impl Into<Shapes<'a>>, view: &TruthView<'_>) -> Surfaces {
    let (scene, size) = (scene.into(), view.camera.size);
    let found = collected(index(size.height_px), |row| surfaces_of_row(&scene, view, row)).concat();
    Surfaces {
        range_m: Plane::from_values(size, found.iter().map(|seen| seen.range_m).collect()),
        triangle: Plane::from_values(size, found.iter().map(|seen| seen.triangle).collect()),
        object: Plane::from_values(size, found.iter().map(|seen| seen.object).collect()),
    }
}

fn surfaces_of_row(scene: &Shapes<'_>, view: &TruthView<'_>, row: usize) -> Vec<NearestSurface> {
    let bearings: Vec<Option<DVec3>> =
        (0..index(view.camera.size.width_px)).map(|column| view.bearing(column, row)).collect();
    let mut found = vec![NearestSurface { range_m: f64::INFINITY, triangle: MISS, object: 0 }; bearings.len()];
    for (number, (shape, world_from_shape)) in (0_u32..).zip(shapes_at(scene, view.row_time_s(row))) {
        let pose = world_from_shape.inverse().then(&view.row_poses[row]);
        // The static scene's frame is the world, and no bit of the pose may change on the way.
        let pose = if number == 0 { view.row_poses[row] } else { pose };
        add_surfaces(shape, number, &pose, &bearings, &mut found);
    }
    found
}

/// The static scene and each object's shape, with `world_from_shape` at a time.
pub(super) fn shapes_at<'a>(scene: &Shapes<'a>, t_s: f64) -> impl Iterator<Item = (&'a Scene, Pose)> {
    let objects = scene.objects.iter().map(move |object| (object.shape(), object.world_from_object(t_s)));
    std::iter::once((scene.fixed, Pose::IDENTITY)).chain(objects)
}

/// Puts what is nearer of a shape in place of what was found before.
fn add_surfaces(shape: &Scene, object: u32, pose: &Pose, bearings: &[Option<DVec3>], found: &mut [NearestSurface]) {
    let mut stack = Stack::new();
    for (group, found) in bearings.chunks(LANES).zip(found.chunks_mut(LANES)) {
        let directions: Vec<Option<DVec3>> =
            group.iter().map(|bearing| bearing.map(|bearing| pose.direction(bearing))).collect();
        let mut packet = Packet::idle();
        for (lane, direction) in directions.iter().enumerate() {
            if let Some(direction) = direction {
                set_ray(&mut packet, lane, pose.translation_m, *direction, f32::MAX);
            }
        }
        let hits = closest_through(&shape.bvh, &BackfaceCulled(&shape.mesh), &packet, &mut stack);
        for (lane, direction) in directions.iter().enumerate() {
            let triangle = hits.triangle[lane];
            let Some(direction) = direction.filter(|_| triangle != MISS) else { continue };
            let traced_m = f64::from(hits.t.0[lane]);
            let range_m = refined_m(corners_m(&shape.mesh, triangle), pose.translation_m, direction, traced_m);
            if range_m < found[lane].range_m {
                found[lane] = NearestSurface { range_m, triangle, object };
            }
        }
    }
}

/// Puts a ray into a lane of a packet, rounded.
pub(super) fn set_ray(packet: &mut Packet, lane: usize, origin_m: DVec3, direction: DVec3, t_max: f32) {
    packet.set_ray(lane, origin_m.to_array().map(f32_nearest), direction.to_array().map(f32_nearest), t_max);
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
    pub fn depth_m(&self, view: &TruthView<'_>) -> Plane<f32> {
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
    pub fn normals<'a>(&self, scene: impl Into<Shapes<'a>>, view: &TruthView<'_>) -> [Plane<f32>; 3] {
        let scene = scene.into();
        let normals = self.of_pixels(DVec3::ZERO, &|column, row, _, triangle| {
            let object = self.object.at(column, row);
            let shape = scene.shape(object);
            let moved = scene.object(object).map(|object| object.world_from_object(view.row_time_s(row)));
            let world_from_shape = moved.unwrap_or(Pose::IDENTITY);
            let camera_from_shape = view.row_poses[row].rotation.conjugate() * world_from_shape.rotation;
            let [a, b, c] = corners_m(&shape.mesh, triangle);
            let normal = camera_from_shape * (b - a).cross(c - a).normalize_or_zero();
            let away = view.bearing(column, row).is_some_and(|bearing| bearing.dot(normal) > 0.0);
            if away { -normal } else { normal }
        });
        [0, 1, 2].map(|axis| normals.map(|normal: DVec3| f32_nearest(normal[axis])))
    }

    /// Index of each pixel's material, counted from 1, in the list of the static scene's materials and then those of each object; 0 where
    /// nothing is met.
    pub fn materials<'a>(&self, scene: impl Into<Shapes<'a>>) -> Plane<u32> {
        let scene = scene.into();
        let shapes: Vec<&Scene> = scene.all().collect();
        let mut first = vec![1_u32];
        for shape in &shapes {
            first.push(first[first.len() - 1] + u32_from(shape.mesh.materials.len()));
        }
        self.of_pixels(0, &|column, row, _, triangle| {
            let object = index(self.object.at(column, row));
            first[object] + shapes[object].mesh.material_of[index(triangle)]
        })
    }

    /// The point that a pixel sees, or a direction where it is infinitely far. None where there is no ray.
    pub(super) fn point(&self, scene: &Shapes<'_>, view: &TruthView<'_>, column: usize, row: usize) -> Option<Point> {
        let pose = view.row_poses[row];
        let direction = pose.direction(view.bearing(column, row)?);
        let range_m = self.range_m.at(column, row);
        if !range_m.is_finite() {
            return Some(Point { coordinates: direction, weight: 0.0, triangle: MISS, object: 0 });
        }
        let (position_m, object) = (pose.translation_m + direction * range_m, self.object.at(column, row));
        let coordinates = match scene.object(object) {
            None => position_m,
            Some(object) => object.world_from_object(view.row_time_s(row)).inverse().point(position_m),
        };
        Some(Point { coordinates, weight: 1.0, triangle: self.triangle.at(column, row), object })
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

/// A point of a surface in the frame of its object (the world, for the static scene), or (weight 0) a direction to what is infinitely far.
#[derive(Clone, Copy, Debug)]
pub(super) struct Point {
    coordinates: DVec3,
    weight: f64,
    pub(super) triangle: u32,
    pub(super) object: u32,
}

impl Point {
    /// The point as it is in the world at a time.
    pub(super) fn at(&self, scene: &Shapes<'_>, t_s: f64) -> WorldPoint {
        let moved = scene.object(self.object).map(|object| object.world_from_object(t_s).point(self.coordinates));
        WorldPoint { coordinates: moved.unwrap_or(self.coordinates), weight: self.weight }
    }

    /// Whether it is infinitely far.
    pub(super) fn is_far(&self) -> bool {
        self.weight == 0.0
    }
}

/// A point of a surface in the world at some time, or (weight 0) a direction to what is infinitely far.
#[derive(Clone, Copy, Debug)]
pub(super) struct WorldPoint {
    coordinates: DVec3,
    weight: f64,
}

impl WorldPoint {
    /// In the frame of a camera.
    pub(super) fn in_camera(&self, world_from_camera: &Pose) -> DVec3 {
        world_from_camera.rotation.conjugate() * self.toward(world_from_camera)
    }

    /// From the camera to the point, in the world; of unit length where the point is infinitely far.
    pub(super) fn toward(&self, world_from_camera: &Pose) -> DVec3 {
        self.coordinates - world_from_camera.translation_m * self.weight
    }
}

/// Whether a position lies in a picture: pixels reach half a pixel around their centres.
pub(super) fn is_inside(size: Size, position_px: glam::DVec2) -> bool {
    let [width, height] = [size.width_px, size.height_px].map(|edge| f64_from_usize(index(edge)));
    (-0.5..width - 0.5).contains(&position_px.x) && (-0.5..height - 0.5).contains(&position_px.y)
}
