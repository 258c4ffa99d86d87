//! Light that reaches an object where it moves: found at instants along its path, and mixed in between.
//!
//! The object receives direct light with the shadows of the static scene, of all objects and of itself, and the light that the static
//! scene's surfaces send back. Objects in the way of that are taken to be as bright as the point that they hide it from: where they hide a
//! share f of the light from all around, a surface of albedo a has 1 / (1 - f a) times what comes past them. They send no light to the
//! static scene, which they shade in the render (`optics/render/shadows`).

use glam::DVec3;
use std::sync::OnceLock;

use super::super::bake::Bake;
use super::super::bake::blockers::Blocker;
use super::super::bake::buried::{fill, stand_ins};
use super::super::bake::light_at::LightAt;
use super::super::bake::light_points::LightPoints;
use super::super::bake::rays::Receiver;
use super::super::geometry::Scene;
use super::super::light::{BANDS, Bands};
use super::data::{ExitanceBounds, LitScene};
use crate::num::{f32_nearest, f64_from_usize, index, u32_truncated};
use crate::parallel::collected;
use crate::pose::Pose;
use crate::units::Span;

/// Points on lamps that a sample of an object sends shadow rays to.
const LAMP_RAYS: usize = 128;
/// Directions from which a sample of an object gathers the light of surfaces.
const RAYS: usize = 256;
/// Time between the instants at which the light is found: 0.14 m of a walk.
const STEP_S: f64 = 0.1;
/// Instants at most; the step doubles until no more are needed.
const STEPS_MAX: f64 = 256.0;
/// A point from which objects hide more than this share of all directions, by their cosine, lies within one of them.
const HIDDEN_MIN: f64 = 0.875;

/// An object's shape and its irradiance at equal steps of time.
#[derive(Clone, Debug)]
pub struct ObjectLight {
    /// In the dark, in the object's frame.
    shape: LitScene,
    light: LightSteps,
    bounds: ExitanceBounds,
}

/// The light of an object on its way.
#[derive(Clone, Debug)]
pub struct LightSteps {
    start_s: f64,
    step_s: f64,
    /// Steady and flickering lux-equivalents of each side of each sample, at each step.
    steps: Vec<[Vec<Bands>; 2]>,
}

impl LightSteps {
    /// Of a shape on its path through a scene among blockers, itself one of them; of one instant only where all `is_still`.
    pub fn of<'a>(
        shape: &Scene,
        fixed: &LitScene,
        world_from_object: &dyn Fn(f64) -> Pose,
        blockers: &dyn Fn(f64) -> Vec<Blocker<'a>>,
        (run, is_still): (Span, bool),
    ) -> Self {
        let mut step_s = STEP_S;
        while run.length_s() > STEPS_MAX * step_s {
            step_s *= 2.0;
        }
        // Steps stand at multiples of their length, so that a longer run finds the same light at the same time.
        let start_s = (run.start_s / step_s).floor() * step_s;
        let count = if is_still { 1 } else { 1 + index(u32_truncated(((run.end_s - start_s) / step_s).ceil())) };
        let at_s = |step: usize| (start_s + step_s * f64_from_usize(step)).clamp(run.start_s, run.end_s);
        let light_points = LightPoints::new(&fixed.scene, LAMP_RAYS, RAYS);
        let at = |t_s: f64| irradiance(shape, fixed, &light_points, &world_from_object(t_s), &blockers(t_s));
        Self { start_s, step_s, steps: (0..count).map(|step| at(at_s(step))).collect() }
    }
}

impl ObjectLight {
    /// Of a shape whose light is found. The static scene gives its units.
    pub fn of(shape: Scene, fixed: &LitScene, light: LightSteps) -> Self {
        let dark = Bake::even(&shape, 0.0);
        let lux_per_unit = fixed.lux_per_radiance / std::f64::consts::PI;
        let mut shape = LitScene::scaled(shape, &dark, lux_per_unit, fixed.illuminant);
        (shape.flicker, shape.shadows) = (fixed.flicker, None);
        let mut lit = Self { bounds: shape.exitance_bounds(), shape, light };
        for step in 0..lit.light.steps.len() {
            lit.bounds = lit.bounds.and(&lit.mixed(step, step, 0.0).exitance_bounds());
        }
        lit
    }

    /// The object's shape in its own frame, without light.
    pub fn shape(&self) -> &Scene {
        self.shape.scene()
    }

    /// The object under the light of a time.
    pub fn at(&self, t_s: f64) -> LitScene {
        let LightSteps { start_s, step_s, steps } = &self.light;
        let last = steps.len() - 1;
        let step = ((t_s - start_s) / step_s).clamp(0.0, f64_from_usize(last));
        let before = index(u32_truncated(step));
        self.mixed(before, (before + 1).min(last), f32_nearest(step - f64_from_usize(before)))
    }

    /// Bounds of the light that leaves it at any time.
    pub fn exitance_bounds(&self) -> &ExitanceBounds {
        &self.bounds
    }

    /// Whether some of its surfaces are seen from one side only.
    pub fn has_dark_backs(&self) -> bool {
        self.shape.has_dark_backs()
    }

    /// Whether some of its surfaces are glossy; unless `all` gloss counts, mirrors.
    pub fn has_gloss(&self, all: bool) -> bool {
        self.shape.has_gloss(all)
    }

    fn mixed(&self, before: usize, after: usize, share: f32) -> LitScene {
        let mix = |group: usize| {
            let pairs = self.light.steps[before][group].iter().zip(&self.light.steps[after][group]);
            pairs.map(|(a, b)| std::array::from_fn(|band| a[band] + (b[band] - a[band]) * share)).collect()
        };
        LitScene {
            irradiance_lux: mix(0),
            flickering_lux: mix(1),
            bounds: OnceLock::new(),
            content: OnceLock::new(),
            ..self.shape.clone()
        }
    }
}

/// Irradiance of both sides of all samples, where the object stands at a pose; the second list is empty where nothing flickers.
fn irradiance(
    shape: &Scene,
    fixed: &LitScene,
    light_points: &LightPoints,
    world_from_object: &Pose,
    blockers: &[Blocker],
) -> [Vec<Bands>; 2] {
    let baked = [fixed.irradiance_lux.as_slice(), fixed.flickering_lux.as_slice()];
    let per_unit = fixed.lux_per_radiance / std::f64::consts::PI;
    let wide = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    let narrow = |v: DVec3| v.to_array().map(f32_nearest);
    let samples = &shape.layout.samples;
    let of_side = |sample_side: usize, blockers: &[Blocker]| {
        let sample = &samples[sample_side / 2];
        let side = sample_side % 2;
        if side == 1 && !sample.double_sided {
            return ([[0.0; BANDS]; 2], false);
        }
        let normal = world_from_object.direction(wide(sample.normal)) * if side == 0 { 1.0 } else { -1.0 };
        let at_m = world_from_object.point(wide(sample.position_m));
        let receiver = Receiver { at_m: narrow(at_m), normal: narrow(normal), sides: 1 };
        let LightAt { by_group, hidden, .. } = fixed.scene.light_at(&receiver, light_points, baked, per_unit, blockers);
        let of = |light: f64, albedo: f32| f32_nearest(light / (1.0 - hidden * f64::from(albedo)));
        let lux = by_group.map(|light| std::array::from_fn(|band| of(light[band], sample.albedo[band])));
        (lux, hidden > HIDDEN_MIN)
    };
    let mut found = collected(2 * samples.len(), |sample_side| of_side(sample_side, blockers));
    // What lies within another part takes the light of its neighbour; without one, as of a neck whose corners are all in head and trunk,
    // that of the part by itself.
    let mut is_hidden: Vec<bool> = found.iter().map(|&(_, is_hidden)| is_hidden).collect();
    let neighbours = stand_ins(&shape.layout, |sample_side| is_hidden[sample_side]);
    fill(&mut found, &neighbours);
    neighbours.iter().for_each(|&(sample_side, _)| is_hidden[index(sample_side)] = false);
    let alone: Vec<usize> = (0..found.len()).filter(|&sample_side| is_hidden[sample_side]).collect();
    let light = collected(alone.len(), |number| of_side(alone[number], &[]));
    alone.iter().zip(light).for_each(|(&sample_side, light)| found[sample_side] = light);
    let flickering =
        if fixed.flicker.is_some() { found.iter().map(|(light, _)| light[1]).collect() } else { Vec::new() };
    let steady = found.iter().map(|(light, _)| light[0]).collect();
    [steady, flickering]
}
