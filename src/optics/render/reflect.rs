//! Specular reflection: follows the rays that met gloss, and adds the light that they bring back.
//!
//! Lanes without gloss pay nothing. After the last reflection a surface counts as diffuse.

use super::super::motion::PacketPoses;
use super::view::{Filter, Met, ObjectHits, PacketSamples, Traced, View, lane3};
use crate::draw::sobol::{fifth, fourth};
use crate::scene::lanes::{Floats, LANES, unrolled};
use crate::scene::light::BANDS;
use crate::scene::lit::REFLECTIONS_MAX;
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
    pub samples: &'a PacketSamples<'a>,
    /// Of the camera at each ray's instant.
    pub pose: &'a PacketPoses,
    /// What each ray would be without.
    pub lux: [Floats; BANDS],
    pub stack: &'a mut Stack,
}

impl Kernel for Reflection<'_, '_> {
    type Output = [Floats; BANDS];

    #[inline(always)]
    fn run(self) -> [Floats; BANDS] {
        let Self { view, mut met, samples, pose, lux, stack } = self;
        let mut paths = Paths { weight: [Floats::splat(1.0); BANDS], settled: [Floats::splat(0.0); BANDS], last: lux };
        let mut length_m = met.nearest().distance_m;
        for reflection in 0..view.reflections.min(REFLECTIONS_MAX) {
            let Some(packet) = view.reflected(&met, samples, reflection, pose, &mut paths) else { break };
            let fixed = Traced::through(view.scene, packet, stack);
            met = view.among_objects(fixed, pose.rays_back(&packet), samples, stack);
            length_m = length_m + met.nearest().distance_m;
            let width_m = length_m * samples.pixels.spread * Floats::splat(samples.shares.pixel);
            let (lux, _) = view.shade(&met, samples, &Filter::Reflected { width_m, pose }, stack);
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
    fn reflected(
        &self,
        met: &Met,
        samples: &PacketSamples,
        reflection: u32,
        pose: &PacketPoses,
        paths: &mut Paths,
    ) -> Option<Packet> {
        let mut next = self.reflected_by_one(&met.fixed, samples, reflection, paths);
        for ObjectHits { object, traced, pose: of_object } in &met.objects {
            let view = View { scene: &samples.objects.all[*object].lit, ..*self };
            let own = view.reflected_by_one(traced, samples, reflection, paths);
            let (lanes, own) = (Floats::splat(0.0).below(own.t_max), pose.rays(&of_object.rays_back(&own)));
            for axis in 0..3 {
                next.origin_m[axis] = lanes.select(own.origin_m[axis], next.origin_m[axis]);
                next.direction[axis] = lanes.select(own.direction[axis], next.direction[axis]);
            }
            next.t_max = lanes.select(own.t_max, next.t_max);
        }
        Floats::splat(0.0).below(next.t_max).any().then_some(next)
    }

    /// The same of the static scene or of one object, in its frame.
    fn reflected_by_one(&self, traced: &Traced, samples: &PacketSamples, reflection: u32, paths: &mut Paths) -> Packet {
        let Traced { hits, packet } = traced;
        let mut next = Packet { t_max: Floats::splat(-1.0), ..*packet };
        for lane in (0..LANES).filter(|&lane| packet.t_max.0[lane] > 0.0 && hits.triangle[lane] != MISS) {
            if !self.scene.face(hits.triangle[lane]).has_gloss(self.follows_gloss) {
                continue;
            }
            let direction = lane3(&packet.direction, lane);
            let weights = [hits.u.0[lane], hits.v.0[lane]];
            let Some(facet) = self.scene.facet(hits.triangle[lane], weights, direction, self.follows_gloss) else {
                continue;
            };
            let (number, seed) = (samples.numbers[lane], samples.pixels.facet_seeds[lane]);
            let numbers = || [fourth(number, seed, reflection), fifth(number, seed, reflection)];
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
