//! Shadow rays: the light that a surface of the static scene has more, or less, than the bake gives it, beside edges of shadows and where
//! moving objects stand in the way of a source.

use super::objects::Objects;
use super::view::{PacketSamples, Traced, View};
use crate::draw::sobol::{fifth, fourth};
use crate::num::u32_from;
use crate::optics::motion::PacketPoses;
use crate::scene::lanes::{Floats, LANES, Mask, Vectors, next_lane, unrolled};
use crate::scene::light::{BANDS, Bands};
use crate::scene::lit::{Relief, Shadows, SourceBounds};
use crate::scene::tracer::{Packet, Stack, blocked_through};
use crate::simd::Kernel;

/// Names the numbers that choose points on sources: beyond those of reflections.
const OF_SOURCES: u32 = 16;

/// An object's shadow from a source that gives a point less than this share of its light is left out.
const FAINT: f32 = 0.02;

/// Rays of a packet that met one triangle.
#[derive(Clone, Copy)]
pub(super) struct OnSurface<'a, 'b> {
    pub view: &'a View<'b>,
    pub shadows: &'a Shadows,
    pub traced: &'a Traced,
    pub triangle: u32,
    pub lanes: Mask,
    pub samples: &'a PacketSamples<'a>,
    /// Of the choice of points on sources.
    pub seeds: &'a [u32; LANES],
}

/// Lux by band that the baked irradiance lacks beside the edges of shadows and under a normal map.
pub(super) struct EdgeShadows<'a, 'b> {
    pub surface: OnSurface<'a, 'b>,
    /// Sources that may be asked for: a bit each.
    pub sources: u32,
    /// Texels of the normal map.
    pub normals: Option<&'a [Bands; LANES]>,
    pub stack: &'a mut Stack,
}

/// Lux by band that moving objects take from the irradiance.
pub(super) struct ObjectShadows<'a, 'b> {
    pub surface: OnSurface<'a, 'b>,
    /// Of the camera at each ray's instant.
    pub pose: &'a PacketPoses,
    pub stack: &'a mut Stack,
}

/// Where a ray met the triangle: the baked samples around with their weights, normal, and where in the world.
#[derive(Clone, Copy)]
struct Hit {
    around: [(usize, f32); 3],
    normal: [f32; 3],
    at_m: [f32; 3],
}

const NO_HIT: Hit = Hit { around: [(0, 0.0); 3], normal: [0.0; 3], at_m: [0.0; 3] };

impl OnSurface<'_, '_> {
    #[inline(always)]
    fn hit(&self, lane: usize) -> Hit {
        let Traced { hits: met, packet } = self.traced;
        let direction = [0, 1, 2].map(|axis| packet.direction[axis].0[lane]);
        let (around, normal) =
            self.view.scene.sample_sides_around(self.triangle, [met.u.0[lane], met.v.0[lane]], direction);
        let at_m = [0, 1, 2].map(|axis| packet.origin_m[axis].0[lane] + direction[axis] * met.t.0[lane]);
        Hit { around, normal, at_m }
    }

    /// The number that chooses the point of a source that a lane's sample asks.
    #[inline(always)]
    fn number(&self, lane: usize, source: u32) -> f32 {
        fourth(self.samples.numbers[lane], self.seeds[lane], OF_SOURCES + source)
    }

    /// The number that chooses the point in each quarter of a wide source.
    #[inline(always)]
    fn quarter_number(&self, lane: usize, source: u32) -> f32 {
        fifth(self.samples.numbers[lane], self.seeds[lane], OF_SOURCES + 1 + source)
    }

    /// Normals where a lane's ray met the triangle, by a texel of its normal map.
    #[inline(always)]
    fn relief(&self, lane: usize, texel: Bands) -> Relief {
        let Traced { hits: met, packet } = self.traced;
        let direction = [0, 1, 2].map(|axis| packet.direction[axis].0[lane]);
        self.view.scene.relief(self.triangle, [met.u.0[lane], met.v.0[lane]], direction, texel)
    }

    /// Level of a source's light.
    #[inline(always)]
    fn level(&self, source: u32, lane: usize) -> f32 {
        if self.shadows.flickers(source) { self.samples.lamp_levels[lane] } else { 1.0 }
    }

    #[inline(always)]
    fn blocked(&self, packet: &Packet, stack: &mut Stack) -> Mask {
        let scene = self.view.scene.scene();
        blocked_through(&scene.bvh, &scene.mesh, packet, stack)
    }
}

/// Middle, in all lanes, and radius of a ball around the points of some lanes.
#[inline(always)]
fn ball_around(at_m: &Vectors, lanes: Mask) -> (Vectors, Floats) {
    let (mut middle_m, mut reach2) = ([Floats::splat(0.0); 3], 0.0);
    for axis in 0..3 {
        let least = lanes.select(at_m[axis], Floats::splat(f32::MAX)).least();
        let most = lanes.select(at_m[axis], Floats::splat(-f32::MAX)).most();
        middle_m[axis] = Floats::splat(0.5 * (least + most));
        reach2 += 0.25 * (most - least) * (most - least);
    }
    (middle_m, Floats::splat(reach2.sqrt()))
}

impl Kernel for EdgeShadows<'_, '_> {
    type Output = [Floats; BANDS];

    #[inline(always)]
    fn run(self) -> [Floats; BANDS] {
        let Self { surface, mut sources, normals, stack } = self;
        let shadows = surface.shadows;
        let (mut hits, mut reliefs) = ([NO_HIT; LANES], [None; LANES]);
        let mut rest = surface.lanes.bits();
        while rest != 0 {
            let lane = next_lane(&mut rest);
            hits[lane] = surface.hit(lane);
            if let Some(texels) = normals {
                reliefs[lane] = Some(surface.relief(lane, texels[lane]));
            }
        }
        let mut asked = [0_u32; LANES];
        let mut added = [Floats::splat(0.0); BANDS];
        while sources != 0 {
            let source = sources.trailing_zeros();
            sources &= sources - 1;
            let mut packet = Packet::idle();
            let (mut unoccluded, mut received) = (Floats::splat(0.0), Floats::splat(0.0));
            let mut rest = surface.lanes.bits();
            while rest != 0 {
                let lane = next_lane(&mut rest);
                let Some(light) = shadows.light(source, &hits[lane].around) else { continue };
                let Hit { at_m, normal, .. } = hits[lane];
                let numbers = (surface.number(lane, source), || surface.quarter_number(lane, source));
                let scene = surface.view.scene;
                let Some(ray) = scene.shadow_ray_by_light(shadows, (at_m, normal), source, numbers) else { continue };
                let level = surface.level(source, lane);
                packet.set_ray(lane, ray.origin_m, ray.direction, ray.t_max);
                let tilted = reliefs[lane].map_or(1.0, |relief| shadows.tilted(source, at_m, &relief));
                let sent = light.unoccluded * ray.cone * level;
                (unoccluded.0[lane], received.0[lane]) = (sent * tilted, light.received * level);
                asked[lane] |= 1 << source;
            }
            let visible = surface.blocked(&packet, stack).select(Floats::splat(0.0), unoccluded);
            let change = visible - received;
            let colour = shadows.colour(source);
            for band in 0..BANDS {
                added[band] = added[band] + Floats::splat(colour[band]) * change;
            }
        }
        for lane in 0..LANES {
            let (Hit { around, at_m, .. }, Some(relief)) = (&hits[lane], &reliefs[lane]) else { continue };
            let level = surface.samples.lamp_levels[lane];
            let scene = surface.view.scene;
            let of_lane = scene.light_on_relief(shadows, (around, *at_m), relief, asked[lane], level);
            for band in 0..BANDS {
                added[band].0[lane] += of_lane[band];
            }
        }
        added
    }
}

impl Kernel for ObjectShadows<'_, '_> {
    type Output = [Floats; BANDS];

    #[inline(always)]
    fn run(self) -> [Floats; BANDS] {
        let Self { surface, pose, stack } = self;
        let Objects { all, group, instants } = surface.samples.objects;
        let Traced { hits, packet: camera_rays } = surface.traced;
        let at_m = unrolled!(AXIS in 3 => camera_rays.origin_m[AXIS] + camera_rays.direction[AXIS] * hits.t);
        let none = Floats::splat(0.0);
        let mut added = [none; BANDS];
        let (middle_m, reach_m) = ball_around(&at_m, surface.lanes);
        let mut sources = 0_u32;
        for object in all {
            sources |= object.may_shade(group, &middle_m, surface.shadows.bounds_by_lane(), reach_m).bits();
        }
        if sources == 0 {
            return added;
        }
        let [(sample_side, _), ..] = surface.hit(next_lane(&mut surface.lanes.bits())).around;
        let least_lux = FAINT * surface.view.scene.baked_lux(sample_side);
        sources &= surface.shadows.bounds_by_lane().may_give(&middle_m, least_lux).bits();
        if sources == 0 {
            return added;
        }
        // Each sample asks one of the sources for all of them, by their light.
        let plane = surface.view.scene.face(surface.triangle).normal();
        let (mut source_of, mut per_share, mut points) = ([sources.trailing_zeros(); LANES], none, [NO_POINT; LANES]);
        let mut rest = surface.lanes.bits();
        while rest != 0 {
            let lane = next_lane(&mut rest);
            let position_m = [at_m[0].0[lane], at_m[1].0[lane], at_m[2].0[lane]];
            let [x, y, z] = [0, 1, 2].map(|axis| camera_rays.direction[axis].0[lane] * plane[axis]);
            let normal = if x + y + z > 0.0 { plane.map(|x| -x) } else { plane };
            let lux = surface.shadows.bounds_by_lane().lux_at(position_m, normal);
            let number = fifth(surface.samples.numbers[lane], surface.seeds[lane], OF_SOURCES);
            (source_of[lane], per_share.0[lane]) = chosen(sources, &lux, number);
            points[lane] = (position_m, normal);
        }
        let chosen_sources = SourceBounds::chosen(surface.shadows.bounds_of_each(), &source_of);
        let mut asked = Mask([0; LANES]);
        for object in all {
            asked = asked | object.parts_may_shade(group, &at_m, &chosen_sources, none) & surface.lanes;
        }
        if !asked.any() {
            return added;
        }
        let (mut rays, mut lux) = (Packet::idle(), [none; BANDS]);
        let mut rest = asked.bits();
        while rest != 0 {
            let lane = next_lane(&mut rest);
            let number = surface.number(lane, source_of[lane]);
            let scene = surface.view.scene;
            let Some(ray) = scene.shadow_ray(surface.shadows, points[lane], source_of[lane], number) else { continue };
            let of_lane = surface.shadows.lux_by(&ray, source_of[lane]);
            let level = surface.level(source_of[lane], lane) * per_share.0[lane];
            for band in 0..BANDS {
                lux[band].0[lane] = of_lane[band] * level;
            }
            rays.set_ray(lane, ray.origin_m, ray.direction, ray.t_max);
        }
        let from_camera = pose.rays_back(&rays);
        let mut shaded = Mask([0; LANES]);
        for object in all {
            let near = object.parts_may_shade(group, &at_m, &chosen_sources, none) & asked;
            if !near.any() {
                continue;
            }
            let mut gathered = None;
            let own = instants.of(&object.timelines[group], &mut gathered).at(surface.samples.share);
            let t_max = near.select(shaded.select(Floats::splat(-1.0), rays.t_max), Floats::splat(-1.0));
            let packet = Packet { t_max, ..own.rays(&from_camera) };
            let shape = object.lit.scene();
            shaded = shaded | blocked_through(&shape.bvh, &shape.mesh, &packet, stack);
        }
        if shaded.any() {
            // What the static scene shades anyway has no more to lose.
            let left = Packet { t_max: shaded.select(rays.t_max, Floats::splat(-1.0)), ..rays };
            let already = surface.blocked(&left, stack);
            for band in 0..BANDS {
                added[band] = already.select(none, shaded.select(none - lux[band], none));
            }
        }
        added
    }
}

const NO_POINT: ([f32; 3], [f32; 3]) = ([0.0; 3], [0.0; 3]);

/// One of some sources, with a probability in proportion to its light, by a number of 0..1; and one over that probability.
#[inline(always)]
fn chosen(sources: u32, lux: &Floats, number: f32) -> (u32, f32) {
    let mut sum = 0.0;
    let mut rest = sources;
    while rest != 0 {
        sum += lux.0[next_lane(&mut rest)];
    }
    let (mut last, mut before) = ((sources.trailing_zeros(), 0.0), 0.0);
    let mut rest = sources;
    while rest != 0 {
        let source = next_lane(&mut rest);
        let own = lux.0[source];
        if own > 0.0 {
            last = (u32_from(source), sum / own);
            before += own;
            if number * sum < before {
                break;
            }
        }
    }
    last
}
