//! Correspondences between views: displacement of every pixel, and whether its point is visible in the other view. The next frame's view
//! gives optical flow, another camera's gives disparity.

use glam::DVec2;

use super::surface::{Point, Surfaces, is_inside, set_ray};
use super::view::TruthView;
use crate::num::{f32_nearest, f64_from_usize, u32_from};
use crate::parallel::collected;
use crate::plane::Plane;
use crate::pose::Pose;
use crate::scene::lanes::LANES;
use crate::scene::mesh::BackfaceCulled;
use crate::scene::object::Shapes;
use crate::scene::tracer::{MISS, Packet, Stack, closest_through};

/// Visibility of a pixel's point in the other view. The numbers are those of kept pictures.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Visibility {
    /// The pixel has no bearing, so there is no point.
    Nothing = 0,
    /// It is seen.
    Visible = 1,
    /// Another surface is in front of it.
    Occluded = 2,
    /// It lies outside the other picture, or where its lens has no position for it.
    Outside = 3,
    /// It moves over the other picture's rows as fast as they are exposed, so no single row gives its time.
    Unsettled = 4,
}

/// Positions of one view's points in another.
#[derive(Clone, Debug, PartialEq)]
pub struct Matches {
    /// Column there less column here in pixels; NaN where the other lens has no position for the point.
    pub dx_px: Plane<f32>,
    /// Row there less row here in pixels; NaN where the other lens has no position for the point.
    pub dy_px: Plane<f32>,
    /// Whether the point is seen.
    pub seen: Plane<Visibility>,
}

/// What stands nearer to a point than this share of its distance is taken for its own surface: rounding of f32 (1e-7 of the scene) seen
/// under 0.1 degrees and above stays below it.
const OCCLUDER_GAP_SHARE: f64 = 1e-4;

/// Steps of the search for a point's row. Each shrinks the error by the point's speed over the rows' (a few hundredths for a hand-held
/// camera), so ten do for any but extreme motion.
const STEPS_MAX: u32 = 100;

/// Rows within which the search has settled. The displacement is off by this times the same ratio.
const SETTLED_PX: f64 = 1e-7;

/// Finds where `to` sees the points of `from`. A point is seen at the time of the row on which it then lies: that row is
/// found as the fixed point of `y = row of project(point at the time of y)`. Points without a surface are taken as infinitely far.
pub fn matches<'a>(
    scene: impl Into<Shapes<'a>>,
    from: &TruthView<'_>,
    surfaces: &Surfaces,
    to: &TruthView<'_>,
) -> Matches {
    let (scene, size) = (scene.into(), surfaces.size());
    let search = Search { scene, view: to, pose_of_all: to.is_instant().then(|| to.row_poses[0]) };
    let work = |row: usize| {
        let mut found: Vec<PixelMatch> = Vec::with_capacity(surfaces.range_m.width_px());
        for column in 0..surfaces.range_m.width_px() {
            let here_px = DVec2::new(f64_from_usize(column), f64_from_usize(row));
            found.push(search.match_of(surfaces.point(&scene, from, column, row), here_px));
        }
        mark_occluded(&scene, &mut found);
        found.into_iter().map(|found| (found.shift_px.map(f32_nearest), found.seen)).collect::<Vec<_>>()
    };
    let found: Vec<([f32; 2], Visibility)> = collected(surfaces.range_m.height_px(), work).concat();
    let of = |axis: usize| Plane::from_values(size, found.iter().map(|(shift_px, _)| shift_px[axis]).collect());
    let seen = Plane::from_values(size, found.iter().map(|(_, seen)| *seen).collect());
    Matches { dx_px: of(0), dy_px: of(1), seen }
}

struct PixelMatch {
    shift_px: [f64; 2],
    seen: Visibility,
    /// The point, and the time and the camera's pose that see it, where it lies on the picture.
    met: Option<(Point, f64, Pose)>,
}

impl PixelMatch {
    fn none(seen: Visibility) -> Self {
        Self { shift_px: [f64::NAN; 2], seen, met: None }
    }
}

struct Search<'a, 'b> {
    scene: Shapes<'a>,
    view: &'a TruthView<'b>,
    /// Where all rows are seen at once.
    pose_of_all: Option<Pose>,
}

impl Search<'_, '_> {
    fn match_of(&self, point: Option<Point>, here_px: DVec2) -> PixelMatch {
        let Some(point) = point else { return PixelMatch::none(Visibility::Nothing) };
        let lens = &self.view.camera.lens;
        let (pose, t_s) = match self.pose_of_all {
            Some(pose) => (pose, self.view.time_s(0.0)),
            None => match self.row_of(&point, here_px.y) {
                Ok(y_px) => (self.view.pose(y_px), self.view.time_s(y_px)),
                Err(seen) => return PixelMatch::none(seen),
            },
        };
        let in_world = point.at(&self.scene, t_s);
        let Some(position_px) = lens.project(in_world.in_camera(&pose)) else {
            return PixelMatch::none(Visibility::Outside);
        };
        let inside = is_inside(self.view.camera.size, position_px);
        let seen = if inside { Visibility::Visible } else { Visibility::Outside };
        PixelMatch { shift_px: (position_px - here_px).to_array(), seen, met: inside.then_some((point, t_s, pose)) }
    }

    /// The row on which a point lies while that row is exposed; the poses between rows are interpolated.
    fn row_of(&self, point: &Point, first_px: f64) -> Result<f64, Visibility> {
        let mut y_px = first_px;
        for _ in 0..STEPS_MAX {
            let in_world = point.at(&self.scene, self.view.time_s(y_px));
            let position_px = self.view.camera.lens.project(in_world.in_camera(&self.view.pose_between(y_px)));
            let Some(position_px) = position_px else { return Err(Visibility::Outside) };
            let before_px = std::mem::replace(&mut y_px, position_px.y);
            // Beyond the picture all positions have the edge row's time.
            if (y_px - before_px).abs() < SETTLED_PX || self.view.time_s(y_px) == self.view.time_s(before_px) {
                return Ok(y_px);
            }
        }
        Err(Visibility::Unsettled)
    }
}

/// Looks from where each point is seen back to the point.
fn mark_occluded(scene: &Shapes<'_>, found: &mut [PixelMatch]) {
    let mut stack = Stack::new();
    for group in found.chunks_mut(LANES) {
        for object in 0..=u32_from(scene.objects.len()) {
            let shape = scene.shape(object);
            let mut packet = Packet::idle();
            for (lane, found) in group.iter().enumerate() {
                let Some((point, t_s, pose)) = &found.met else { continue };
                let toward = point.at(scene, *t_s).toward(pose);
                let t_max =
                    if point.is_far() { f32::MAX } else { f32_nearest(toward.length() * (1.0 - OCCLUDER_GAP_SHARE)) };
                let (origin_m, direction) = match scene.object(object) {
                    None => (pose.translation_m, toward.normalize_or_zero()),
                    Some(object) => {
                        let object_from_world = object.world_from_object(*t_s).inverse();
                        let direction = object_from_world.direction(toward.normalize_or_zero());
                        (object_from_world.point(pose.translation_m), direction)
                    }
                };
                set_ray(&mut packet, lane, origin_m, direction, t_max);
            }
            let hits = closest_through(&shape.bvh, &BackfaceCulled(&shape.mesh), &packet, &mut stack);
            for (lane, found) in group.iter_mut().enumerate() {
                let Some((point, ..)) = &found.met else { continue };
                if hits.triangle[lane] != MISS && (object, hits.triangle[lane]) != (point.object, point.triangle) {
                    found.seen = Visibility::Occluded;
                }
            }
        }
    }
}
