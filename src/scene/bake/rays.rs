//! The rays of one sample. Enters: a sample. Leaves: its direct light and what its rays met.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::super::Scene;
use super::super::chance::{cosine_direction, frame, pair, turned};
use super::super::lamps::LampPoint;
use super::super::lanes::{Floats, LANES};
use super::super::light::{BANDS, Bands};
use super::super::mesh::{dot, sub};
use super::super::tracer::{MISS, Packet, Stack, blocked_through, closest_through};
use super::BakeSettings;
use crate::draw::DrawKey;
use crate::num::{f32_nearest, f64_from_usize, index, u32_from, u64_from};

/// A ray met nothing and saw the sky.
pub const SKY: u32 = u32::MAX;
/// A ray met something that sends no bounced light.
pub const DARK: u32 = u32::MAX - 1;

/// Rays start this far above their surface in metres: above the rounding of coordinates up to 1 km (6e-5 m), below what
/// furniture is made of.
const LIFT_M: f32 = 2e-4;

/// Aimed rays end this share short of the lamp.
const AIM_SHARE: f32 = 0.999;

/// What the rays of one sample brought.
#[derive(Clone, Debug)]
pub struct Gathered {
    /// Light of lamps, sky and glowing surfaces on each side.
    pub direct: [Bands; 2],
    /// Twice the sample met plus its side for every ray, the first half from side 0; or `SKY`, or `DARK`.
    pub met: Vec<u32>,
}

/// Number of the bounces' draws: the seed of their key.
const BOUNCE_DRAWS: u64 = 0x626F_756E;

/// What all samples of one kind aim at and where they look.
pub struct Aims {
    /// Points on lamps.
    pub lamp_points: Vec<LampPoint>,
    /// Directions of bounces.
    pub fan: Vec<[f32; 3]>,
}

impl Aims {
    /// Of samples on vertices, then of samples on grids.
    pub fn of(scene: &Scene, settings: &BakeSettings) -> [Self; 2] {
        let aims = |lamp_rays, rays| Self { lamp_points: scene.lamps.points(lamp_rays), fan: fan(rays) };
        [aims(settings.vertex_lamp_rays, settings.vertex_rays), aims(settings.grid_lamp_rays, settings.grid_rays)]
    }
}

/// Traces all rays of a sample.
pub fn gather(scene: &Scene, aims: &[Aims; 2], number: usize) -> Gathered {
    let sample = &scene.layout.samples[number];
    let aims = &aims[usize::from(sample.on_grid)];
    let mut direct = lamp_light(scene, sample.position_m, sample.normal, &aims.lamp_points);
    let mut met = Vec::with_capacity(2 * aims.fan.len());
    for (side, light) in direct.iter_mut().enumerate() {
        let normal = if side == 0 { sample.normal } else { sample.normal.map(|x| -x) };
        let seen = bounce_rays(scene, sample.position_m, normal, &aims.fan, &mut met);
        for band in 0..BANDS {
            light[band] += seen[band];
        }
    }
    Gathered { direct: direct.map(|light| light.map(f32_nearest)), met }
}

/// Light that lamps send straight to both sides of a place.
pub fn lamp_light(scene: &Scene, at_m: [f32; 3], normal: [f32; 3], points: &[LampPoint]) -> [[f64; BANDS]; 2] {
    let mut light = [[0.0; BANDS]; 2];
    let mut stack = Stack::new();
    let mut packet = idle();
    let mut waiting = [(0, [0.0; BANDS]); LANES];
    let mut lanes = 0;
    for (number, point) in points.iter().enumerate() {
        let side = usize::from(dot(sub(point.position_m, at_m), normal) < 0.0);
        let lift = if side == 0 { LIFT_M } else { -LIFT_M };
        let origin: [f32; 3] = [0, 1, 2].map(|axis| at_m[axis] + normal[axis] * lift);
        let direction = sub(point.position_m, origin);
        let strength = disc_form_factor(normal, direction, point.normal, point.area_m2);
        if strength > 0.0 {
            set_ray(&mut packet, lanes, origin, direction, AIM_SHARE);
            let sent = point.radiance.map(|band| std::f64::consts::PI * f64::from(band) * strength);
            waiting[lanes] = (side, sent);
            lanes += 1;
        }
        if lanes == LANES || (number + 1 == points.len() && lanes > 0) {
            let shadowed = blocked_through(&scene.bvh, &scene.mesh, &packet, &mut stack);
            for lane in (0..lanes).filter(|&lane| !shadowed[lane]) {
                let (side, sent) = waiting[lane];
                for band in 0..BANDS {
                    light[side][band] += sent[band];
                }
            }
            (packet, lanes) = (idle(), 0);
        }
    }
    light
}

/// Form factor of a small disc of the area a ray stands for: cos cos A / (pi d^2 + A). It never exceeds 1, so a lamp that
/// touches a sample does not burn it; far away its error against a point's is A / (pi d^2).
fn disc_form_factor(normal: [f32; 3], toward: [f32; 3], lamp: [f32; 3], area_m2: f64) -> f64 {
    let distance2 = f64::from(dot(toward, toward));
    let cos_here = f64::from(dot(toward, normal)).abs();
    let cos_there = -f64::from(dot(toward, lamp));
    if distance2 <= 0.0 || cos_there <= 0.0 {
        return 0.0;
    }
    cos_here * cos_there / distance2 * area_m2 / (std::f64::consts::PI * distance2 + area_m2)
}

/// Cosine-weighted rays of one side along the directions of a fan: notes what they met, and returns the light that they saw
/// shining by itself (sky, and glowing surfaces where lamps are not aimed at).
pub fn bounce_rays(
    scene: &Scene,
    at_m: [f32; 3],
    normal: [f32; 3],
    fan: &[[f32; 3]],
    met: &mut Vec<u32>,
) -> [f64; BANDS] {
    let origin: [f32; 3] = [0, 1, 2].map(|axis| at_m[axis] + normal[axis] * LIFT_M);
    let sides = frame(normal);
    let mut seen = [0.0; BANDS];
    let mut stack = Stack::new();
    for directions in fan.chunks_exact(LANES) {
        let mut packet = idle();
        for (lane, &local) in directions.iter().enumerate() {
            set_ray(&mut packet, lane, origin, turned(local, &sides, normal), f32::MAX);
        }
        let hits = closest_through(&scene.bvh, &scene.mesh, &packet, &mut stack);
        for lane in 0..LANES {
            let direction = [0, 1, 2].map(|axis| packet.direction[axis].0[lane]);
            let (place, light) = scene.bounce_place(hits.triangle[lane], hits.u.0[lane], hits.v.0[lane], direction);
            met.push(place);
            for band in 0..BANDS {
                seen[band] += f64::from(light[band]);
            }
        }
    }
    seen.map(|sum| std::f64::consts::PI * sum / f64_from_usize(fan.len()))
}

/// Stratified cosine-weighted directions around +z. Every sample uses the same, so that neighbours on a wall see the same places a
/// little shifted, and what is left of the error is smooth instead of mottled.
pub fn fan(rays: usize) -> Vec<[f32; 3]> {
    assert!(rays > 0 && rays.is_multiple_of(LANES), "bounces go in full packets");
    let (rings, sectors) = strata(rays);
    let key = DrawKey::root(BOUNCE_DRAWS);
    let direction = |ray: usize| {
        // A packet is a few rings by four neighbouring sectors, so that its rays stay close together.
        let (block, lane) = (ray / LANES, ray % LANES);
        let ring = PACKET_RINGS * (block / (sectors / 4)) + lane / 4;
        let sector = 4 * (block % (sectors / 4)) + lane % 4;
        let [a, b] = pair(key, u64_from(ring * sectors + sector));
        let ring = (f64_from_usize(ring) + a) / f64_from_usize(rings);
        cosine_direction([ring, (f64_from_usize(sector) + b) / f64_from_usize(sectors)])
    };
    (0..rays).map(direction).collect()
}

/// Rings of a packet of bounces.
const PACKET_RINGS: usize = LANES / 4;

/// Rings and sectors whose product is the count: sectors a multiple of 4, rings one of `PACKET_RINGS`.
fn strata(rays: usize) -> (usize, usize) {
    let mut rings = PACKET_RINGS;
    while 4 * rings * rings <= rays && rays.is_multiple_of(rings * 8) {
        rings *= 2;
    }
    (rings, rays / rings)
}

fn idle() -> Packet {
    let zero = Floats::splat(0.0);
    Packet { origin_m: [zero; 3], direction: [Floats::splat(1.0), zero, zero], t_min: zero, t_max: Floats::splat(-1.0) }
}

fn set_ray(packet: &mut Packet, lane: usize, origin: [f32; 3], direction: [f32; 3], t_max: f32) {
    for axis in 0..3 {
        packet.origin_m[axis].0[lane] = origin[axis];
        packet.direction[axis].0[lane] = direction[axis];
    }
    packet.t_max.0[lane] = t_max;
}

impl Scene {
    /// What a bounced ray met: the nearest sample on the side it came from, and the light that shines from there by itself.
    fn bounce_place(&self, triangle: u32, u: f32, v: f32, direction: [f32; 3]) -> (u32, Bands) {
        if triangle == MISS {
            return (SKY, self.sky);
        }
        let shade = &self.layout.triangles[index(triangle)];
        let back = dot(shade.normal, direction) > 0.0;
        let material = &self.mesh.materials[index(shade.material)];
        if back && !material.double_sided {
            return (DARK, [0.0; BANDS]);
        }
        let mut nearest = (0, f32::MIN);
        for (sample, weight) in shade.around(u, v) {
            if weight > nearest.1 {
                nearest = (sample, weight);
            }
        }
        let glow = if self.lamps.is_empty() { material.emission } else { [0.0; BANDS] };
        (u32_from(2 * nearest.0 + usize::from(back)), glow)
    }
}
