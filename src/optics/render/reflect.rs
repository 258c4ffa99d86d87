//! Rays that glossy surfaces send on. Enters: a packet's hits. Leaves: the light of those that keep an image, as seen by the camera.
//!
//! Only lanes that met gloss pay. Reflected rays go as packets of those lanes; after the last bounce a surface counts as dull.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::pattern::facet_numbers;
use super::shot::{Aim, Pixels, View};
use crate::scene::lanes::{Floats, LANES};
use crate::scene::light::{BANDS, Bands};
use crate::scene::lit::BOUNCES_MAX;
use crate::scene::texture::Footprint;
use crate::scene::tracer::{Hits, MISS, Packet, Stack, closest_through};

/// Reflected rays start this far above their surface in metres, as those of the bake do.
const LIFT_M: f32 = 2e-4;

/// Paths that are followed, by lane.
struct Paths {
    /// Weight of what the path meets next.
    weight: [Bands; LANES],
    /// Metres from the camera.
    gone_m: [f32; LANES],
    /// Light of the surfaces that are behind.
    settled: [Bands; LANES],
    /// Light of the surface met last, as if it were dull.
    last: [Bands; LANES],
}

impl View<'_> {
    /// Follows the lanes that met gloss; `lux` holds what every lane would be without it.
    #[inline(never)]
    pub(super) fn reflect(&self, hits: &Hits, packet: &Packet, pixels: &Pixels, aim: &Aim, lux: &mut [Bands; LANES]) {
        let (mut hits, mut packet) = (*hits, *packet);
        let mut paths =
            Paths { weight: [[1.0; BANDS]; LANES], gone_m: hits.t.0, settled: [[0.0; BANDS]; LANES], last: *lux };
        let mut stack = Stack::new();
        for bounce in 0..self.reflections.min(BOUNCES_MAX) {
            let numbers = |lane: usize| facet_numbers(aim.numbers[lane], pixels.facet_seeds[lane], bounce);
            let Some(next) = self.turned(&hits, &packet, &numbers, &mut paths) else { break };
            packet = next;
            hits = closest_through(&self.scene.scene().bvh, &self.scene.scene().mesh, &packet, &mut stack);
            for lane in (0..LANES).filter(|&lane| packet.t_max.0[lane] > 0.0) {
                let met = if hits.triangle[lane] == MISS {
                    self.scene.sky_lux(direction_of(&packet, lane))
                } else {
                    paths.gone_m[lane] += hits.t.0[lane];
                    let width_m = paths.gone_m[lane] * pixels.spread.0[lane] * aim.shares.pixel;
                    let footprint = Footprint::round(self.scene.texels_per_m(hits.triangle[lane]) * width_m);
                    let at = [hits.u.0[lane], hits.v.0[lane]];
                    let level = aim.lamp_levels[lane];
                    self.scene.exitance_lux(hits.triangle[lane], at, direction_of(&packet, lane), &footprint, level)
                };
                paths.last[lane] = std::array::from_fn(|band| paths.weight[lane][band] * met[band]);
            }
        }
        for lane in 0..LANES {
            lux[lane] = std::array::from_fn(|band| paths.settled[lane][band] + paths.last[lane][band]);
        }
    }

    /// Leaves of the lanes that met gloss what is diffuse, and sends their reflected rays on; none if there are none.
    fn turned(
        &self,
        hits: &Hits,
        packet: &Packet,
        numbers: &dyn Fn(usize) -> [f32; 2],
        paths: &mut Paths,
    ) -> Option<Packet> {
        let mut next = Packet { t_max: Floats::splat(-1.0), ..*packet };
        let mut any = false;
        for lane in (0..LANES).filter(|&lane| packet.t_max.0[lane] > 0.0 && hits.triangle[lane] != MISS) {
            let direction = direction_of(packet, lane);
            let at = [hits.u.0[lane], hits.v.0[lane]];
            let Some(facet) = self.scene.facet(hits.triangle[lane], at, direction, self.follows_gloss) else {
                continue;
            };
            let (away, share, dull) = facet.reflected(direction, numbers(lane));
            for band in 0..BANDS {
                paths.settled[lane][band] += paths.last[lane][band] * dull[band];
                paths.weight[lane][band] *= share[band];
            }
            paths.last[lane] = [0.0; BANDS];
            if paths.weight[lane] == [0.0; BANDS] {
                continue;
            }
            any = true;
            next.t_max.0[lane] = f32::MAX;
            for axis in 0..3 {
                let met = packet.origin_m[axis].0[lane] + packet.direction[axis].0[lane] * hits.t.0[lane];
                next.origin_m[axis].0[lane] = met + facet.plane[axis] * LIFT_M;
                next.direction[axis].0[lane] = away[axis];
            }
        }
        any.then_some(next)
    }
}

fn direction_of(packet: &Packet, lane: usize) -> [f32; 3] {
    [0, 1, 2].map(|axis| packet.direction[axis].0[lane])
}
