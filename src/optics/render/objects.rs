//! Moving objects in a render. A rigid object that moves before a camera is a camera that moves before the object: rays are turned into the
//! object's frame and traced against its own tree there, each at its own instant.

use glam::DVec3;

use super::super::motion::{PacketMotion, Parabolas, Timeline};
use super::settings::ROWS;
use crate::num::{f32_nearest, f64_from_usize, greater, lesser};
use crate::parallel::collected;
use crate::pose::Pose;
use crate::scene::LitScene;
use crate::scene::lanes::{Floats, LANES, Mask, Vectors, dot3, splat3};
use crate::scene::lit::Towards;
use crate::scene::object::MovingObject;
use crate::units::Span;

/// Instants of a group's exposures at which an object's place is asked for.
const INSTANTS: usize = 9;
/// Share of its motion in view by which an object may stray between these instants.
const STRAY: f64 = 0.25;

/// An object over one exposure.
pub struct ObjectInView {
    /// Under the light of the exposure's middle.
    pub lit: LitScene,
    /// `object_from_camera` over the exposures of each group of rows.
    pub timelines: Vec<Timeline>,
    /// Where each group of rows may see it: around all of it, and around its parts.
    cones: Vec<(ViewCone, Vec<ViewCone>)>,
    /// Where it and its parts are in the world over the exposures of each group of rows.
    balls_m: Vec<(Ball, Vec<Ball>)>,
}

/// Middle and radius in metres.
type Ball = ([f32; 3], f32);

/// Directions in the camera's frame.
#[derive(Clone, Copy, Debug)]
struct ViewCone {
    axis: [f32; 3],
    /// Least cosine to the axis.
    cosine: f32,
}

/// What of a timeline the rays of a packet belong to.
#[derive(Clone, Copy)]
pub enum Instants<'a> {
    /// A tile's rows, in one piece of their exposures.
    Tile(usize),
    /// One row, whose exposure is one piece.
    Row(usize),
    /// A lane's row, in a piece for each lane.
    Pieces(usize, &'a [usize; LANES]),
}

impl Instants<'_> {
    /// The motion of a timeline there; `gathered` holds what has to be put together.
    #[inline(always)]
    pub fn of<'t>(&self, timeline: &'t Timeline, gathered: &'t mut Option<Parabolas>) -> PacketMotion<'t> {
        match self {
            Self::Tile(piece) => PacketMotion::ByLane(&timeline.pieces[*piece]),
            Self::Row(row) => PacketMotion::Shared(timeline.first_of_row(*row)),
            Self::Pieces(lane, piece_of) => PacketMotion::ByLane(gathered.insert(timeline.gathered(*lane, piece_of))),
        }
    }
}

/// The objects as the rays of one packet may meet them.
#[derive(Clone, Copy)]
pub struct Objects<'a> {
    /// All of them.
    pub all: &'a [ObjectInView],
    /// The packet's group of rows.
    pub group: usize,
    /// Its rays' instants.
    pub instants: Instants<'a>,
}

impl ObjectInView {
    /// For the spans of groups of rows and the motion of a camera, in `pieces` of time a group.
    pub fn new(
        object: &MovingObject,
        groups: &[[Span; ROWS]],
        pieces: u32,
        world_from_camera: &(dyn Fn(f64) -> Pose + Sync),
    ) -> Self {
        let pose = |t_s: f64| object.world_from_object(t_s).inverse().then(&world_from_camera(t_s));
        let timelines = collected(groups.len(), |group| Timeline::of(groups[group], pieces, &pose));
        let cones = collected(groups.len(), |group| {
            let poses = instants(&groups[group], &pose);
            let around = |ball_m: (DVec3, f64)| ViewCone::around(ball_m, &poses);
            (around(object.ball_m()), object.balls_m().iter().copied().map(around).collect())
        });
        let balls_m = collected(groups.len(), |group| {
            let poses = instants(&groups[group], &|t_s: f64| object.world_from_object(t_s).inverse());
            let around = |ball_m: (DVec3, f64)| swept(ball_m, &poses);
            (around(object.ball_m()), object.balls_m().iter().copied().map(around).collect())
        });
        Self { lit: object.lit_at(whole(groups.as_flattened()).middle_s()), timelines, cones, balls_m }
    }

    /// Which lanes' places may be shaded by it over the exposures of a group of rows from the lanes' sources, by its whole.
    #[inline(always)]
    pub fn may_shade(&self, group: usize, at_m: &Vectors, towards: &Towards, slack_m: Floats) -> Mask {
        towards.may_be_blocked(self.balls_m[group].0, at_m, slack_m)
    }

    /// The same by its parts.
    #[inline(always)]
    pub fn parts_may_shade(&self, group: usize, at_m: &Vectors, towards: &Towards, slack_m: Floats) -> Mask {
        let (whole, parts) = &self.balls_m[group];
        let near = towards.may_be_blocked(*whole, at_m, slack_m);
        if !near.any() {
            return near;
        }
        // No fold: its closure would be compiled without the instructions of the kernel around it.
        let mut by_part = Mask([0; LANES]);
        for part in parts {
            by_part = by_part | towards.may_be_blocked(*part, at_m, slack_m);
        }
        near & by_part
    }

    /// Whether a ray of some pixels of a group may, each of which has this bearing and is so wide.
    #[inline(always)]
    pub fn may_be_near(&self, group: usize, bearing: &Vectors, spread: Floats) -> bool {
        // The cosine of an angle falls by no more than the angle grows.
        let slack = spread + spread;
        let (whole, parts) = &self.cones[group];
        whole.may_hold(bearing, slack) && parts.iter().any(|part| part.may_hold(bearing, slack))
    }
}

/// From the first start to the last end of some spans.
fn whole(spans: &[Span]) -> Span {
    Span {
        start_s: spans.iter().fold(f64::INFINITY, |least, span| lesser(least, span.start_s)),
        end_s: spans.iter().fold(f64::NEG_INFINITY, |most, span| greater(most, span.end_s)),
    }
}

/// `camera_from_object` at even instants from the first to the last of some spans.
fn instants(spans: &[Span], object_from_camera: &dyn Fn(f64) -> Pose) -> [Pose; INSTANTS] {
    let Span { start_s, end_s } = whole(spans);
    std::array::from_fn(|instant| {
        let share = f64_from_usize(instant) / f64_from_usize(INSTANTS - 1);
        object_from_camera(start_s + (end_s - start_s) * share).inverse()
    })
}

/// A ball around a ball of an object on its way, which stands at these poses in the world over the spans of some rows.
fn swept((middle_m, radius_m): (DVec3, f64), world_from_object: &[Pose; INSTANTS]) -> Ball {
    let places = world_from_object.map(|pose| pose.point(middle_m));
    let middle_m = places[INSTANTS / 2];
    let strays_m = places.iter().fold(0.0, |most, place_m| greater(most, place_m.distance(middle_m)));
    (middle_m.to_array().map(f32_nearest), f32_nearest(radius_m + (1.0 + STRAY) * strays_m))
}

impl ViewCone {
    /// Around a ball of an object that is seen from these poses, `camera_from_object` over the spans of some rows.
    fn around((middle_m, radius_m): (DVec3, f64), camera_from_object: &[Pose; INSTANTS]) -> Self {
        let places = camera_from_object.map(|pose| pose.point(middle_m));
        let everywhere = Self { axis: [0.0, 0.0, 1.0], cosine: -2.0 };
        let Some(axis) = places[INSTANTS / 2].try_normalize() else { return everywhere };
        let (mut strays_rad, mut strays_m, mut nearest_m) = (0.0, 0.0, f64::INFINITY);
        for place_m in places {
            let distance_m = place_m.length();
            nearest_m = lesser(nearest_m, distance_m);
            strays_m = greater(strays_m, (distance_m - places[INSTANTS / 2].length()).abs());
            let cosine = place_m.dot(axis) / greater(distance_m, 1e-12);
            strays_rad = greater(strays_rad, libm::acos(cosine.clamp(-1.0, 1.0)));
        }
        let distance_m = nearest_m - STRAY * strays_m;
        if distance_m <= radius_m {
            return everywhere;
        }
        let angle_rad = libm::asin(radius_m / distance_m) + (1.0 + STRAY) * strays_rad + 1e-3;
        if angle_rad >= std::f64::consts::PI {
            return everywhere;
        }
        Self { axis: axis.to_array().map(f32_nearest), cosine: f32_nearest(libm::cos(angle_rad)) - 1e-6 }
    }

    /// Whether a ray with one of these bearings of unit length may meet what the cone is around, with so much slack of the cosine.
    #[inline(always)]
    fn may_hold(&self, bearing: &Vectors, slack: Floats) -> bool {
        // Bearings between corners of a pixel are shorter than 1 by an eighth of its square: below a millionth.
        (Floats::splat(self.cosine) - slack).below(dot3(splat3(self.axis), *bearing)).any()
    }
}
