//! Looks for positions from which a camera sees much of a scene: at the file's own cameras, inside its bounds, and around them.

use glam::{DQuat, DVec3};

use super::lanes::{Floats, LANES};
use super::mesh::dot;
use super::tracer::{MISS, Packet, Stack, closest_through};
use super::{Scene, Viewpoint};
use crate::num::{f32_nearest, f64_from_usize, index};
use crate::pose::Pose;

/// Rays of a trial: columns and rows.
const GRID: [usize; 2] = [16, 12];
/// Angle across of the cameras that are found.
pub const FOV_RAD: f64 = 0.5 * std::f64::consts::PI;
/// Height of a picture over its width.
const HEIGHT: f64 = 0.75;
/// Positions inside the bounds along x, y and z.
const INSIDE: [usize; 3] = [7, 3, 7];
/// Directions from each position inside, and positions around the bounds.
const TURNS: usize = 12;
/// Heights of the positions around, as angles.
const ELEVATIONS_DEG: [f64; 3] = [5.0, 20.0, 40.0];
/// A surface nearer than this share of the scene's size fills the picture with next to nothing.
const NEAR: f64 = 0.01;

/// Box around a scene.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SceneBox {
    /// Least coordinates in metres.
    pub least_m: DVec3,
    /// Greatest coordinates in metres.
    pub greatest_m: DVec3,
}

impl SceneBox {
    /// Of all triangles.
    pub fn of(scene: &Scene) -> Self {
        let mut extent = Self { least_m: DVec3::INFINITY, greatest_m: DVec3::NEG_INFINITY };
        for triangle in 0..scene.mesh.triangles.len() {
            for corner in scene.mesh.corners_m(triangle) {
                let corner_m = DVec3::from_array(corner.map(f64::from));
                extent.least_m = extent.least_m.min(corner_m);
                extent.greatest_m = extent.greatest_m.max(corner_m);
            }
        }
        extent
    }

    /// Width, height and depth in metres.
    pub fn size_m(&self) -> DVec3 {
        self.greatest_m - self.least_m
    }
}

/// A pose to look from.
#[derive(Clone, Debug, PartialEq)]
pub struct CameraView {
    /// Where it comes from: a camera of the file by name, or found here.
    pub name: String,
    /// Looking along +z, y down.
    pub world_from_camera: Pose,
    /// Angle that it sees across.
    pub horizontal_fov_rad: f64,
    /// Share of its rays that meet a surface's front.
    pub covered: f64,
    /// Share of its rays that meet the back of a surface that has one side only: the camera is inside something.
    pub behind: f64,
    /// Distance of the nearest surface in metres.
    pub nearest_m: f64,
    /// Median distance of what is met, in metres.
    pub median_m: f64,
    /// How much there is to see: more is better, 0 for nothing.
    pub score: f64,
}

/// Orientation of a level camera that looks along -z turned by `yaw_rad` to the left about y, and up by `pitch_rad`.
pub fn looking(yaw_rad: f64, pitch_rad: f64) -> DQuat {
    let level = DQuat::from_rotation_x(std::f64::consts::PI);
    DQuat::from_rotation_y(yaw_rad) * DQuat::from_rotation_x(pitch_rad) * level
}

/// The best views of a scene, the best first: the file's cameras that see something, then those that are found: around a thing, and inside
/// and around a room or a landscape. Views that are found stand apart from each other.
pub fn best(scene: &Scene, count: usize) -> Vec<CameraView> {
    let extent = SceneBox::of(scene);
    let named = |view: &Viewpoint| {
        let fov_rad = view.horizontal_fov_rad.unwrap_or(FOV_RAD);
        judged(scene, &extent, &view.name, view.world_from_camera, fov_rad)
    };
    let mut chosen: Vec<CameraView> = scene.viewpoints.iter().map(named).filter(|view| view.score > 0.0).collect();
    let by_score = |a: &CameraView, b: &CameraView| b.score.total_cmp(&a.score);
    chosen.sort_by(by_score);
    chosen.truncate(count);
    let [mut inside, mut around] = [inside(&extent), around(&extent)].map(|poses| {
        let of = |number: usize| judged(scene, &extent, "found", poses[number], FOV_RAD);
        crate::parallel::collected(poses.len(), of)
    });
    let is_room = extent.size_m().min_element() > ROOM_M && encloses(&inside);
    let has_floor = has_floor(scene, &extent);
    if is_room || has_floor {
        // In the open nothing is above either: beneath a terrain it is the other way round.
        inside.retain(|view| {
            let [below, above] = surfaces_along_the_vertical(scene, view);
            below && (is_room || !above)
        });
    }
    inside.sort_by(by_score);
    around.sort_by(by_score);
    let mut found = around;
    found.append(&mut inside);
    if is_room || has_floor {
        found.sort_by(by_score);
    }
    let apart_m = 0.2 * extent.size_m().length();
    for view in found.into_iter().filter(|view| view.score > 0.0) {
        if chosen.len() >= count {
            break;
        }
        let is_new = |other: &CameraView| {
            let way_m = (other.world_from_camera.translation_m - view.world_from_camera.translation_m).length();
            way_m > apart_m || forward(other).dot(forward(&view)) < 0.3
        };
        if chosen.iter().all(is_new) {
            chosen.push(view);
        }
    }
    chosen
}

fn forward(view: &CameraView) -> DVec3 {
    view.world_from_camera.direction(DVec3::Z)
}

/// Least extent of a room in metres: smaller things that are hollow are things.
const ROOM_M: f64 = 1.0;

/// Whether a fourth of the cameras inside see something, and half of those hardly anything else.
fn encloses(inside: &[CameraView]) -> bool {
    let mut filled: Vec<f64> = inside.iter().filter(|view| view.score > 0.0).map(|view| view.covered).collect();
    filled.sort_by(f64::total_cmp);
    4 * filled.len() >= inside.len() && filled[filled.len() / 2] > 0.85
}

/// Least width of what one walks over, in metres.
const FLOOR_M: f64 = 3.0;

/// Middle of a part of so many, as a share of the whole.
fn middle(number: usize, of: usize) -> f64 {
    (f64_from_usize(number) + 0.5) / f64_from_usize(of)
}

/// Whether a surface fills the bounds as seen from above, and is wide enough to walk over.
fn has_floor(scene: &Scene, extent: &SceneBox) -> bool {
    let size_m = extent.size_m();
    if size_m.x.min(size_m.z) < FLOOR_M {
        return false;
    }
    let top_m = extent.greatest_m.y + 0.1 * size_m.length();
    let (mut met, mut stack) = (0, Stack::new());
    for row in 0..LANES {
        let above = Pose::new(DQuat::IDENTITY, DVec3::ZERO);
        let mut packet = packet_of(&above, |_| DVec3::NEG_Y);
        for column in 0..LANES {
            let at_m = extent.least_m + DVec3::new(middle(column, LANES), 0.0, middle(row, LANES)) * size_m;
            packet.origin_m[0].0[column] = f32_nearest(at_m.x);
            packet.origin_m[1].0[column] = f32_nearest(top_m);
            packet.origin_m[2].0[column] = f32_nearest(at_m.z);
        }
        let hits = closest_through(&scene.bvh, &scene.mesh, &packet, &mut stack);
        met += hits.triangle.iter().filter(|&&triangle| triangle != MISS).count();
    }
    10 * met >= 9 * LANES * LANES
}

/// Whether a surface lies straight below a camera, and straight above it.
fn surfaces_along_the_vertical(scene: &Scene, view: &CameraView) -> [bool; 2] {
    let level = Pose::new(DQuat::IDENTITY, view.world_from_camera.translation_m);
    [DVec3::NEG_Y, DVec3::Y].map(|way| {
        let packet = packet_of(&level, |_| way);
        closest_through(&scene.bvh, &scene.mesh, &packet, &mut Stack::new()).triangle[0] != MISS
    })
}

/// Level cameras on a grid within the bounds.
fn inside(extent: &SceneBox) -> Vec<Pose> {
    let mut poses = Vec::new();
    for x in 0..INSIDE[0] {
        for y in 0..INSIDE[1] {
            for z in 0..INSIDE[2] {
                let share = DVec3::new(middle(x, INSIDE[0]), middle(y, INSIDE[1]), middle(z, INSIDE[2]));
                let position_m = extent.least_m + share * extent.size_m();
                poses.extend((0..TURNS).map(|turn| Pose::new(looking(turn_rad(turn), 0.0), position_m)));
            }
        }
    }
    poses
}

/// Cameras on circles around the bounds that look at their middle, so far away that the whole is within a picture's height.
fn around(extent: &SceneBox) -> Vec<Pose> {
    let middle_m = 0.5 * (extent.least_m + extent.greatest_m);
    let radius_m = 0.5 * extent.size_m().length();
    let distance_m = radius_m / libm::sin(libm::atan(HEIGHT * libm::tan(0.5 * FOV_RAD)));
    let mut poses = Vec::new();
    for elevation_deg in ELEVATIONS_DEG {
        for turn in 0..TURNS {
            let orientation = looking(turn_rad(turn), -elevation_deg.to_radians());
            poses.push(Pose::new(orientation, middle_m - orientation * DVec3::Z * distance_m));
        }
    }
    poses
}

fn turn_rad(turn: usize) -> f64 {
    2.0 * std::f64::consts::PI * f64_from_usize(turn) / f64_from_usize(TURNS)
}

/// Rays from a camera's centre, one for each lane, along bearings in the camera's axes of any length.
pub fn packet_of(world_from_camera: &Pose, bearing: impl Fn(usize) -> DVec3) -> Packet {
    let mut packet = Packet {
        origin_m: [Floats::splat(0.0); 3],
        direction: [Floats::splat(0.0); 3],
        t_min: Floats::splat(0.0),
        t_max: Floats::splat(f32::MAX),
    };
    for lane in 0..LANES {
        let direction = world_from_camera.direction(bearing(lane).normalize()).to_array();
        for axis in 0..3 {
            packet.origin_m[axis].0[lane] = f32_nearest(world_from_camera.translation_m[axis]);
            packet.direction[axis].0[lane] = f32_nearest(direction[axis]);
        }
    }
    packet
}

/// What a camera of some angle across sees from a pose.
pub fn judged(
    scene: &Scene,
    extent: &SceneBox,
    name: &str,
    world_from_camera: Pose,
    horizontal_fov_rad: f64,
) -> CameraView {
    let half = libm::tan(0.5 * horizontal_fov_rad);
    let mut stack = Stack::new();
    let (mut distances_m, mut materials, mut behind) = (Vec::new(), Vec::new(), 0_usize);
    let count = GRID[0] * GRID[1];
    for first in (0..count).step_by(LANES) {
        let packet = packet_of(&world_from_camera, |lane| {
            let (column, row) = ((first + lane) % GRID[0], (first + lane) / GRID[0]);
            let share = |number: usize, of: usize| 2.0 * (f64_from_usize(number) + 0.5) / f64_from_usize(of) - 1.0;
            DVec3::new(half * share(column, GRID[0]), HEIGHT * half * share(row, GRID[1]), 1.0)
        });
        let hits = closest_through(&scene.bvh, &scene.mesh, &packet, &mut stack);
        for lane in 0..LANES {
            if hits.triangle[lane] == MISS {
                continue;
            }
            let triangle = index(hits.triangle[lane]);
            let material = scene.mesh.material_of[triangle];
            let direction = [0, 1, 2].map(|axis| packet.direction[axis].0[lane]);
            let is_back = dot(scene.layout.triangles[triangle].normal, direction) > 0.0;
            if is_back && !scene.mesh.materials[index(material)].double_sided {
                behind += 1;
                continue;
            }
            distances_m.push(f64::from(hits.t.0[lane]));
            materials.push(material);
        }
    }
    distances_m.sort_by(f64::total_cmp);
    materials.sort_unstable();
    materials.dedup();
    let all = f64_from_usize(count);
    let (covered, behind) = (f64_from_usize(distances_m.len()) / all, f64_from_usize(behind) / all);
    let at = |share: f64| {
        let rank = index(crate::num::u32_truncated(share * f64_from_usize(distances_m.len())));
        distances_m.get(rank.min(distances_m.len().saturating_sub(1))).copied().unwrap_or(f64::INFINITY)
    };
    let nearest_m = at(0.0);
    let is_near = at(0.1) < NEAR * extent.size_m().length();
    // Octaves of distance that the middle eight tenths span, and kinds of material: depth and variety are what a tracker needs.
    let depth = if distances_m.is_empty() { 0.0 } else { libm::log2(at(0.9) / at(0.1).max(1e-9)).clamp(0.0, 4.0) };
    let variety = libm::log2(1.0 + f64_from_usize(materials.len())).min(4.0);
    let is_seen = covered > 0.02 && behind < 0.05 && !is_near;
    let score = if is_seen { covered * (1.0 + depth) * (1.0 + variety) } else { 0.0 };
    let (name, median_m) = (name.to_owned(), at(0.5));
    CameraView { name, world_from_camera, horizontal_fov_rad, covered, behind, nearest_m, median_m, score }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::box_room;
    use crate::scene::mesh::{Material, Mesh};
    use crate::scene::target::cube;

    #[test]
    fn a_camera_in_a_room_sees_its_walls_and_one_in_a_solid_sees_their_backs() {
        let scene = box_room::box_room(1);
        let extent = SceneBox::of(&scene);
        let views = best(&scene, 4);
        assert!(views.len() == 4 && views[0].covered > 0.95 && views[0].behind < 0.05, "{views:?}");
        let middle_m = 0.5 * (extent.least_m + extent.greatest_m);
        let far = Pose::new(looking(0.0, 0.0), middle_m + DVec3::new(0.0, 0.0, -100.0));
        assert_eq!(judged(&scene, &extent, "away", far, FOV_RAD).score, 0.0);
    }

    #[test]
    fn a_thing_is_seen_from_around_it_and_a_yard_from_within() {
        let mut mesh = Mesh::default();
        mesh.materials.push(Material::plain("box", [0.5; 3]));
        for corners_m in cube([-0.1; 3], [0.1; 3], false) {
            mesh.append_quad(0, corners_m, [1.0, 1.0]);
        }
        let thing = Scene::new("box", mesh.clone(), [0.0; 4]).unwrap();
        let views = best(&thing, 4);
        assert!(views.len() == 4 && views.iter().all(|view| view.world_from_camera.translation_m.length() > 0.25));
        mesh.append_quad(0, [[-4.0, -0.1, 4.0], [4.0, -0.1, 4.0], [4.0, -0.1, -4.0], [-4.0, -0.1, -4.0]], [1.0, 1.0]);
        let yard = Scene::new("yard", mesh, [0.0; 4]).unwrap();
        assert!(has_floor(&yard, &SceneBox::of(&yard)) && !has_floor(&thing, &SceneBox::of(&thing)));
    }

    #[test]
    fn no_camera_is_found_beneath_a_terrain_that_is_open_below() {
        let mut mesh = Mesh::default();
        mesh.materials.push(Material { double_sided: true, ..Material::plain("hill", [0.5; 3]) });
        // A ridge of 20 m along z.
        for side in [-1.0, 1.0] {
            let foot_m = 20.0 * side;
            let corners_m = [[0.0, 20.0, 20.0], [foot_m, 0.0, 20.0], [foot_m, 0.0, -20.0], [0.0, 20.0, -20.0]];
            mesh.append_quad(0, corners_m, [1.0, 1.0]);
        }
        let hill = Scene::new("hill", mesh, [0.0; 4]).unwrap();
        let views = best(&hill, 6);
        assert_eq!(views.len(), 6);
        for CameraView { world_from_camera: Pose { translation_m, .. }, .. } in &views {
            assert!(translation_m.y > 20.0 - translation_m.x.abs(), "{translation_m}");
        }
    }

    #[test]
    fn a_level_camera_looks_along_minus_z_with_y_down() {
        let level = looking(0.0, 0.0);
        assert!((level * DVec3::Z - DVec3::NEG_Z).length() < 1e-12);
        assert!((level * DVec3::Y - DVec3::NEG_Y).length() < 1e-12);
        let up = looking(0.0, 0.3) * DVec3::Z;
        assert!(up.y > 0.29, "{up}");
        // A quarter turn to the left looks along -x.
        assert!((looking(std::f64::consts::FRAC_PI_2, 0.0) * DVec3::Z - DVec3::NEG_X).length() < 1e-12);
    }
}
