//! Light that reaches an object where it moves: found at places along its path, and mixed in between.
//!
//! The object receives direct light with the fixed scene's shadows and the light that the fixed scene's surfaces send back. It shades the
//! fixed scene (`optics/render/shadows`), but neither itself nor other objects, and sends no light back.

#![allow(clippy::needless_range_loop, reason = "bands and groups of several arrays run in step")]

use glam::DVec3;
use std::sync::OnceLock;

use super::super::bake::Bake;
use super::super::bake::aims::Aims;
use super::super::geometry::Scene;
use super::super::light::{BANDS, Bands};
use super::data::{ExitanceBounds, LitScene};
use crate::num::{f32_nearest, f64_from_usize, index, u32_truncated};
use crate::parallel::collected;
use crate::pose::Pose;
use crate::units::Span;

/// Points on lamps that a sample of an object aims at.
const LAMP_RAYS: usize = 128;
/// Directions from which a sample of an object gathers the light of surfaces.
const RAYS: usize = 256;
/// Time between the places at which the light is found: 0.14 m of a walk.
const STEP_S: f64 = 0.1;
/// Places at most; the step doubles until no more are needed.
const STEPS_MAX: f64 = 256.0;

/// An object's shape and its irradiance at equal steps of time.
#[derive(Clone, Debug)]
pub struct ObjectLight {
    /// In the dark, in the object's frame.
    shape: LitScene,
    start_s: f64,
    step_s: f64,
    /// Steady and flickering lux-equivalents of each side of each sample, at each step.
    steps: Vec<[Vec<Bands>; 2]>,
    bounds: ExitanceBounds,
}

impl ObjectLight {
    /// Finds the light of an object on its way through a scene; at one place only where it `is_still`.
    pub fn of(
        shape: Scene,
        fixed: &LitScene,
        (world_from_object, is_still): (&(dyn Fn(f64) -> Pose + Sync), bool),
        run: Span,
    ) -> Self {
        let dark = Bake::even(&shape, 0.0);
        let lux_per_unit = fixed.lux_per_radiance / std::f64::consts::PI;
        let mut shape = LitScene::scaled(shape, &dark, lux_per_unit, fixed.illuminant);
        (shape.flicker, shape.shadows) = (fixed.flicker, None);
        let mut step_s = STEP_S;
        while run.length_s() > STEPS_MAX * step_s {
            step_s *= 2.0;
        }
        // Steps stand at multiples of their length, so that a longer run finds the same light at the same time.
        let start_s = (run.start_s / step_s).floor() * step_s;
        let count = if is_still { 1 } else { 1 + index(u32_truncated(((run.end_s - start_s) / step_s).ceil())) };
        let at_s = |step: usize| (start_s + step_s * f64_from_usize(step)).clamp(run.start_s, run.end_s);
        let aims = Aims::new(&fixed.scene, LAMP_RAYS, RAYS);
        let steps = (0..count).map(|step| irradiance(&shape, fixed, &aims, &world_from_object(at_s(step)))).collect();
        let mut light = Self { bounds: shape.exitance_bounds(), shape, start_s, step_s, steps };
        for step in 0..count {
            light.bounds = light.bounds.and(&light.mixed(step, step, 0.0).exitance_bounds());
        }
        light
    }

    /// The object's shape in its own frame, without light.
    pub fn shape(&self) -> &Scene {
        self.shape.scene()
    }

    /// The object under the light of a time.
    pub fn at(&self, t_s: f64) -> LitScene {
        let last = self.steps.len() - 1;
        let place = ((t_s - self.start_s) / self.step_s).clamp(0.0, f64_from_usize(last));
        let before = index(u32_truncated(place));
        self.mixed(before, (before + 1).min(last), f32_nearest(place - f64_from_usize(before)))
    }

    /// Bounds of the light that leaves it at any time.
    pub fn exitance_bounds(&self) -> &ExitanceBounds {
        &self.bounds
    }

    /// Whether some of its surfaces are seen from one side only.
    pub fn has_dark_backs(&self) -> bool {
        self.shape.has_dark_backs()
    }

    fn mixed(&self, before: usize, after: usize, share: f32) -> LitScene {
        let mix = |group: usize| {
            let pairs = self.steps[before][group].iter().zip(&self.steps[after][group]);
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
fn irradiance(shape: &LitScene, fixed: &LitScene, aims: &Aims, world_from_object: &Pose) -> [Vec<Bands>; 2] {
    let baked = [fixed.irradiance_lux.as_slice(), fixed.flickering_lux.as_slice()];
    let per_unit = fixed.lux_per_radiance / std::f64::consts::PI;
    let wide = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    let narrow = |v: DVec3| v.to_array().map(f32_nearest);
    let samples = &shape.scene.layout.samples;
    let of_side = |place: usize| {
        let sample = &samples[place / 2];
        let side = place % 2;
        if side == 1 && !sample.double_sided {
            return [[0.0; BANDS]; 2];
        }
        let normal = world_from_object.direction(wide(sample.normal)) * if side == 0 { 1.0 } else { -1.0 };
        let at_m = world_from_object.point(wide(sample.position_m));
        let found = fixed.scene.irradiance_at((narrow(at_m), narrow(normal)), aims, baked, per_unit);
        found.map(|light| light.map(f32_nearest))
    };
    let found = collected(2 * samples.len(), of_side);
    let flickering = if fixed.flicker.is_some() { found.iter().map(|light| light[1]).collect() } else { Vec::new() };
    let steady = found.iter().map(|light| light[0]).collect();
    [steady, flickering]
}
