//! Rigid objects that move through a scene: a shape in its own frame, its path, and its light along that.

use glam::{DQuat, DVec3};

use super::animation::{ChainLimits, JointChain};
use super::bake::blockers::Blocker;
use super::geometry::Scene;
use super::light::BANDS;
use super::lit::{ExitanceBounds, LightSteps, LitScene, ObjectLight};
use super::motion::{Motion, MotionError};
use super::views::SceneBox;
use crate::num::{f32_nearest, f64_from_usize, greater, index, lesser, u32_truncated};
use crate::pose::Pose;
use crate::units::Span;

/// From a model to a body that moves ahead: glTF's models stand with y up and look along +z, bodies have y down and z ahead.
const BODY_FROM_MODEL: DQuat = DQuat::from_xyzw(0.0, 0.0, 1.0, 0.0);

/// Objects of a scene at most.
pub const OBJECTS_MAX: usize = 256;

/// Balls that cover a shape at most.
const BALLS_MAX: f64 = 12.0;

/// Instants of a span at which an object's pose is asked for.
const INSTANTS: usize = 9;
/// Share of its motion by which an object may stray between these instants.
const STRAY: f64 = 0.25;

/// A ball in the world: middle and radius in metres.
pub type PlacedBall = ([f32; 3], f32);

/// How a motion moves a model.
#[derive(Clone, Debug, PartialEq)]
pub struct ObjectMotion {
    /// Of the body.
    pub motion: Motion,
    /// Whether the body has y down and z ahead, as a rig on its way, so that the model stands on it and looks ahead; else the body's frame
    /// is the model's.
    pub looks_ahead: bool,
    /// How the model's animation moves the part.
    pub chain: JointChain,
}

impl ObjectMotion {
    /// Whether it never moves.
    fn is_still(&self) -> bool {
        matches!(self.motion, Motion::Still(_)) && self.chain.length_s == 0.0
    }

    fn world_from_object(&self, t_s: f64) -> Pose {
        let body = self.motion.world_from_body(t_s).expect("the motion covers the run");
        let model = if self.looks_ahead { body.then(&Pose::new(BODY_FROM_MODEL, DVec3::ZERO)) } else { body };
        // What has no animation keeps its pose in every bit.
        if self.chain.joints.is_empty() { model } else { model.then(&self.chain.at(t_s)) }
    }
}

/// What moves through a scene.
#[derive(Clone, Debug)]
pub struct MovingObject {
    /// As the user calls it; parts of one file have one name.
    pub name: String,
    /// Number of the object that it is a part of, from 1.
    pub instance: u32,
    motion: ObjectMotion,
    light: ObjectLight,
    /// Ball around the shape, in its frame: middle and radius in metres.
    ball_m: (DVec3, f64),
    balls_m: Vec<(DVec3, f64)>,
    /// Of the animation, for the whole shape.
    limits: ChainLimits,
}

/// A scene at rest and what moves through it.
#[derive(Clone, Copy, Debug)]
pub struct DynamicScene<'a> {
    /// The static scene under its light.
    pub fixed: &'a LitScene,
    /// What moves.
    pub objects: &'a [MovingObject],
}

impl<'a> From<&'a LitScene> for DynamicScene<'a> {
    fn from(fixed: &'a LitScene) -> Self {
        Self { fixed, objects: &[] }
    }
}

impl<'a> DynamicScene<'a> {
    /// The same without its light.
    pub fn shapes(&self) -> Shapes<'a> {
        Shapes { fixed: self.fixed.scene(), objects: self.objects }
    }

    /// Whether something is glossy; unless `all` gloss counts, a mirror.
    pub fn has_gloss(&self, all: bool) -> bool {
        self.fixed.has_gloss(all) || self.objects.iter().any(|object| object.light.has_gloss(all))
    }

    /// Whether objects shade the static scene.
    fn casts_shadows(&self) -> bool {
        !self.objects.is_empty() && self.fixed.traced_shadows().is_some()
    }

    /// Whether a ray can come back black from something.
    pub fn may_be_black(&self) -> bool {
        let in_shadow = self.casts_shadows() && !self.fixed.has_bounces();
        in_shadow || self.fixed.may_be_black() || self.objects.iter().any(|object| object.light.has_dark_backs())
    }

    /// Bounds of the light that leaves anything, at any time.
    pub fn exitance_bounds(&self) -> ExitanceBounds {
        let mut bounds = self.fixed.exitance_bounds();
        for object in self.objects {
            bounds = bounds.and(object.light.exitance_bounds());
        }
        if self.casts_shadows() {
            bounds.least = [0.0; BANDS];
        }
        bounds
    }
}

/// The shape of a scene at rest, and what moves through it.
#[derive(Clone, Copy, Debug)]
pub struct Shapes<'a> {
    /// The static scene.
    pub fixed: &'a Scene,
    /// What moves.
    pub objects: &'a [MovingObject],
}

impl<'a> From<&'a Scene> for Shapes<'a> {
    fn from(fixed: &'a Scene) -> Self {
        Self { fixed, objects: &[] }
    }
}

impl<'a> From<DynamicScene<'a>> for Shapes<'a> {
    fn from(scene: DynamicScene<'a>) -> Self {
        scene.shapes()
    }
}

impl<'a> Shapes<'a> {
    /// An object by its number from 1; none for 0, the static scene.
    pub fn object(&self, number: u32) -> Option<&'a MovingObject> {
        number.checked_sub(1).map(|number| &self.objects[index(number)])
    }

    /// The shape of an object by its number from 1, or of the static scene (0).
    pub fn shape(&self, number: u32) -> &'a Scene {
        self.object(number).map_or(self.fixed, MovingObject::shape)
    }

    /// The shape of the static scene, then those of the objects.
    pub fn all(&self) -> impl Iterator<Item = &'a Scene> {
        std::iter::once(self.fixed).chain(self.objects.iter().map(MovingObject::shape))
    }
}

/// An object before its light is known.
pub struct UnlitObject {
    name: String,
    instance: u32,
    shape: Scene,
    motion: ObjectMotion,
    ball_m: (DVec3, f64),
    balls_m: Vec<(DVec3, f64)>,
}

impl UnlitObject {
    /// Of a shape and its motion, which must cover the run; with its name and the number of the object that it is a part of, from 1. Fails
    /// on a motion that ends before the run.
    pub fn new(
        (name, instance): (&str, u32),
        shape: Scene,
        motion: ObjectMotion,
        run: Span,
    ) -> Result<Self, MotionError> {
        motion.motion.covers(run)?;
        let extent = SceneBox::of(&shape);
        let ball_m = (0.5 * (extent.least_m + extent.greatest_m), 0.5 * extent.size_m().length());
        Ok(Self { name: name.to_owned(), instance, shape, motion, ball_m, balls_m: covering_balls_m(&extent) })
    }

    /// Where it is in the way of light.
    fn blocker(&self, t_s: f64) -> Blocker<'_> {
        Blocker::new(&self.shape, self.ball_m, &self.motion.world_from_object(t_s))
    }

    /// Lets objects move through a scene for a run, and finds their light among each other on the way.
    pub fn lit(objects: Vec<Self>, fixed: &LitScene, run: Span) -> Vec<MovingObject> {
        let are_still = objects.iter().all(|object| object.motion.is_still());
        let blockers = |t_s: f64| objects.iter().map(|object| object.blocker(t_s)).collect::<Vec<Blocker>>();
        let steps_of = |object: &Self| {
            let path = |t_s: f64| object.motion.world_from_object(t_s);
            LightSteps::of(&object.shape, fixed, &path, &blockers, (run, are_still))
        };
        let steps: Vec<LightSteps> = objects.iter().map(steps_of).collect();
        let lit = |(object, steps): (Self, LightSteps)| {
            let Self { name, instance, shape, motion, ball_m, balls_m } = object;
            let limits = motion.chain.limits(ball_m.0.length() + ball_m.1);
            let light = ObjectLight::of(shape, fixed, steps);
            MovingObject { name, instance, motion, light, ball_m, balls_m, limits }
        };
        objects.into_iter().zip(steps).map(lit).collect()
    }
}

impl MovingObject {
    /// Where the shape's frame is at a time of the run. Panics outside it.
    pub fn world_from_object(&self, t_s: f64) -> Pose {
        self.motion.world_from_object(t_s)
    }

    /// The shape, in its own frame.
    pub fn shape(&self) -> &Scene {
        self.light.shape()
    }

    /// The shape under the light of a time of the run.
    pub fn lit_at(&self, t_s: f64) -> LitScene {
        self.light.at(t_s)
    }

    /// A ball that holds the shape over a span of the run, and smaller ones that hold its parts. Panics outside the run.
    pub fn balls_over_m(&self, span: Span) -> (PlacedBall, Vec<PlacedBall>) {
        let poses: [Pose; INSTANTS] = std::array::from_fn(|instant| {
            let share = f64_from_usize(instant) / f64_from_usize(INSTANTS - 1);
            self.world_from_object(span.start_s + span.length_s() * share)
        });
        let around = |&(middle_m, radius_m): &(DVec3, f64)| {
            let middles_m = poses.map(|pose| pose.point(middle_m));
            let middle_m = middles_m[INSTANTS / 2];
            let strays_m = middles_m.iter().fold(0.0, |most, position_m| greater(most, position_m.distance(middle_m)));
            (middle_m.to_array().map(f32_nearest), f32_nearest(radius_m + (1.0 + STRAY) * strays_m))
        };
        (around(&self.ball_m), self.balls_m.iter().map(around).collect())
    }

    /// Corners of a box that holds the shape over a span of the run. Fails on a span that the motion does not cover.
    pub fn extent_m(&self, span: Span) -> Result<[DVec3; 2], MotionError> {
        let (low_m, high_m) = self.motion.motion.extent_m(span)?;
        let reach_m = DVec3::splat(self.reach_m());
        Ok([low_m - reach_m, high_m + reach_m])
    }

    /// Greatest speed of any of its points in a span of the run, in m/s. Fails on a span that the motion does not cover.
    pub fn speed_max_m_per_s(&self, span: Span) -> Result<f64, MotionError> {
        let [speed, turn_rad_per_s] = self.motion.motion.speeds_max(span)?;
        Ok(speed + turn_rad_per_s * self.reach_m() + self.limits.speed_m_per_s)
    }

    /// Distance of its farthest point from the point that its motion moves.
    fn reach_m(&self) -> f64 {
        self.ball_m.0.length() + self.ball_m.1 + self.limits.reach_m
    }
}

/// Balls around parts of a box along its longest edge.
fn covering_balls_m(extent: &SceneBox) -> Vec<(DVec3, f64)> {
    let size_m = extent.size_m();
    let axis = (0..3).fold(0, |longest, axis| if size_m[axis] > size_m[longest] { axis } else { longest });
    let across_m = (0..3).filter(|&other| other != axis).fold(0.0, |most, other| greater(most, size_m[other]));
    let parts = lesser((size_m[axis] / greater(across_m, 1e-9)).ceil(), BALLS_MAX);
    let half_m = DVec3::from_array([0, 1, 2].map(|n| 0.5 * size_m[n] / if n == axis { parts } else { 1.0 }));
    let middle_m = |part: u32| {
        let mut middle_m = extent.least_m + half_m;
        middle_m[axis] += 2.0 * half_m[axis] * f64::from(part);
        middle_m
    };
    (0..u32_truncated(parts)).map(|part| (middle_m(part), half_m.length())).collect()
}
