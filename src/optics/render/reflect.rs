//! Specular reflection: follows the rays that met gloss, and adds the light that they bring back.
//!
//! Lanes without gloss pay nothing. After the last bounce a surface counts as diffuse.

use super::super::motion::Turns;
use super::view::{Aim, Filter, Met, ObjectHits, Traced, View, lane3};
use crate::draw::sobol::{fifth, fourth};
use crate::scene::lanes::{Floats, LANES, unrolled};
use crate::scene::light::BANDS;
use crate::scene::lit::BOUNCES_MAX;
use crate::scene::tracer::{MISS, Packet, Stack};
use crate::simd::Kernel;

/// Reflected rays start this far above their surface in metres, as those of the bake do.
const LIFT_M: f32 = 2e-4;

/// Light along the paths of a packet, by band.
struct Paths {
    /// Weight of what a path meets next.
    weight: [Floats; BANDS],
    /// Light of the surfaces before the last one.
    settled: [Floats; BANDS],
    /// Light of the last surface, as if it were diffuse.
    last: [Floats; BANDS],
}

/// Light of rays with what their surfaces reflect.
pub(super) struct Reflection<'a, 'b> {
    pub view: &'a View<'b>,
    pub met: Met,
    pub aim: &'a Aim<'a>,
    /// Of the camera at each ray's instant.
    pub pose: &'a Turns,
    /// What each ray would be without.
    pub lux: [Floats; BANDS],
    pub stack: &'a mut Stack,
}

impl Kernel for Reflection<'_, '_> {
    type Output = [Floats; BANDS];

    #[inline(always)]
    fn run(self) -> [Floats; BANDS] {
        let Self { view, mut met, aim, pose, lux, stack } = self;
        let mut paths = Paths { weight: [Floats::splat(1.0); BANDS], settled: [Floats::splat(0.0); BANDS], last: lux };
        let mut length_m = met.nearest().distance_m;
        for bounce in 0..view.reflections.min(BOUNCES_MAX) {
            let Some(packet) = view.reflected(&met, aim, bounce, pose, &mut paths) else { break };
            let fixed = Traced::through(view.scene, packet, stack);
            met = view.among_objects(fixed, pose.rays_back(&packet), aim, stack);
            length_m = length_m + met.nearest().distance_m;
            let width_m = length_m * aim.pixels.spread * Floats::splat(aim.shares.pixel);
            let (lux, _) = view.shade(&met, aim, &Filter::Reflected { width_m, pose }, stack);
            let is_followed = Floats::splat(0.0).below(packet.t_max);
            for band in 0..BANDS {
                paths.last[band] = is_followed.select(paths.weight[band] * lux[band], paths.last[band]);
            }
        }
        unrolled!(BAND in 4 => paths.settled[BAND] + paths.last[BAND])
    }
}

impl View<'_> {
    /// Splits the light of the lanes that met gloss and turns their rays; none if there are none.
    #[inline(never)]
    fn reflected(&self, met: &Met, aim: &Aim, bounce: u32, pose: &Turns, paths: &mut Paths) -> Option<Packet> {
        let mut next = self.reflected_by_one(&met.fixed, aim, bounce, paths);
        for ObjectHits { object, traced, pose: of_object } in &met.objects {
            let view = View { scene: &aim.objects.all[*object].lit, ..*self };
            let own = view.reflected_by_one(traced, aim, bounce, paths);
            let (lanes, own) = (Floats::splat(0.0).below(own.t_max), pose.rays(&of_object.rays_back(&own)));
            for axis in 0..3 {
                next.origin_m[axis] = lanes.select(own.origin_m[axis], next.origin_m[axis]);
                next.direction[axis] = lanes.select(own.direction[axis], next.direction[axis]);
            }
            next.t_max = lanes.select(own.t_max, next.t_max);
        }
        Floats::splat(0.0).below(next.t_max).any().then_some(next)
    }

    /// The same of the fixed scene or of one object, in its frame.
    fn reflected_by_one(&self, traced: &Traced, aim: &Aim, bounce: u32, paths: &mut Paths) -> Packet {
        let Traced { hits, packet } = traced;
        let mut next = Packet { t_max: Floats::splat(-1.0), ..*packet };
        for lane in (0..LANES).filter(|&lane| packet.t_max.0[lane] > 0.0 && hits.triangle[lane] != MISS) {
            if !self.scene.face(hits.triangle[lane]).has_gloss(self.follows_gloss) {
                continue;
            }
            let direction = lane3(&packet.direction, lane);
            let at = [hits.u.0[lane], hits.v.0[lane]];
            let Some(facet) = self.scene.facet(hits.triangle[lane], at, direction, self.follows_gloss) else {
                continue;
            };
            let (number, seed) = (aim.numbers[lane], aim.pixels.facet_seeds[lane]);
            let numbers = || [fourth(number, seed, bounce), fifth(number, seed, bounce)];
            let (away, share, diffuse) = facet.reflected(direction, numbers);
            let mut is_black = true;
            for band in 0..BANDS {
                paths.settled[band].0[lane] += paths.last[band].0[lane] * diffuse[band];
                paths.weight[band].0[lane] *= share[band];
                paths.last[band].0[lane] = 0.0;
                is_black &= paths.weight[band].0[lane] == 0.0;
            }
            if is_black {
                continue;
            }
            next.t_max.0[lane] = f32::MAX;
            for axis in 0..3 {
                let met = packet.origin_m[axis].0[lane] + packet.direction[axis].0[lane] * hits.t.0[lane];
                next.origin_m[axis].0[lane] = met + facet.plane[axis] * LIFT_M;
                next.direction[axis].0[lane] = away[axis];
            }
        }
        next
    }
}
