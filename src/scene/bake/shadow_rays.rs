//! Shadow rays to light points, and the light that they bring.

use super::super::geometry::Scene;
use super::super::lanes::LANES;
use super::super::light::{BANDS, luminance};
use super::super::tracer::{Packet, Stack, blocked_through};
use super::blockers::{Blocker, nearest};
use super::fan::Receiver;
use super::light_points::{LightPoints, ShadowRay, ShadowRayLight, shadow_ray_to};
use super::reflected::add_reflected;
use crate::num::f32_nearest;

/// Shadow rays that wait until a packet is full.
struct ShadowRays<'a> {
    scene: &'a Scene,
    blockers: &'a [Blocker<'a>],
    stack: Stack,
    packet: Packet,
    waiting: [Waiting; LANES],
    lanes: usize,
    /// Of both sides of each receiver.
    light: Vec<[ShadowRayLight; 2]>,
}

/// What a shadow ray adds, if nothing is in its way.
#[derive(Clone, Copy)]
struct Waiting {
    receiver: usize,
    side: usize,
    group: usize,
    sent: [f64; BANDS],
    source: Option<usize>,
}

impl Waiting {
    const NONE: Self = Self { receiver: 0, side: 0, group: 0, sent: [0.0; BANDS], source: None };
}

impl ShadowRays<'_> {
    fn push(&mut self, receiver: usize, ray: &ShadowRay, source: Option<usize>) {
        if let Some(source) = source {
            self.light[receiver][ray.side].by_source[source].unoccluded += f32_nearest(luminance(ray.sent));
        }
        if ray.cone == 0.0 {
            return;
        }
        self.packet.set_ray(self.lanes, ray.origin_m, ray.direction, ray.t_max);
        let sent = ray.sent.map(|band| band * f64::from(ray.cone));
        self.waiting[self.lanes] = Waiting { receiver, side: ray.side, group: ray.group, sent, source };
        self.lanes += 1;
        if self.lanes == LANES {
            self.flush();
        }
    }

    fn flush(&mut self) {
        let shadowed = blocked_through(&self.scene.bvh, &self.scene.mesh, &self.packet, &mut self.stack);
        let (nearest, t_max) = (nearest(self.blockers, &self.packet, &mut self.stack), self.packet.t_max);
        for lane in (0..self.lanes).filter(|&lane| shadowed.0[lane] == 0 && nearest.0[lane] >= t_max.0[lane]) {
            let Waiting { receiver, side, group, sent, source } = self.waiting[lane];
            let light = &mut self.light[receiver][side];
            for band in 0..BANDS {
                light.all[group][band] += sent[band];
            }
            if let Some(source) = source {
                light.by_source[source].received += f32_nearest(luminance(sent));
            }
        }
        (self.packet, self.lanes) = (Packet::idle(), 0);
    }
}

/// Light that lamps and bright directions send to the first or to both sides of receivers, straight or over plane mirrors, past moving
/// objects.
pub fn shadow_ray_light(
    scene: &Scene,
    receivers: &[Receiver],
    light_points: &LightPoints,
    blockers: &[Blocker],
) -> Vec<[ShadowRayLight; 2]> {
    let (stack, waiting) = (Stack::new(), [Waiting::NONE; LANES]);
    let light = vec![[ShadowRayLight::NONE; 2]; receivers.len()];
    let mut shadows = ShadowRays { scene, blockers, stack, packet: Packet::idle(), waiting, lanes: 0, light };
    for number in 0..light_points.count() {
        let source = light_points.sources.iter().position(|source| source.holds(number));
        for (receiver_index, receiver) in receivers.iter().enumerate() {
            if let Some(ray) = shadow_ray_to(scene, receiver, light_points, number) {
                shadows.push(receiver_index, &ray, source);
            }
        }
    }
    if shadows.lanes > 0 {
        shadows.flush();
    }
    add_reflected(scene, receivers, light_points, blockers, &mut shadows.light);
    shadows.light
}

/// Which of at most 16 light points a sample sees: a bit each.
pub fn visible_light_points(scene: &Scene, number: usize, light_points: &LightPoints, stack: &mut Stack) -> u32 {
    let receiver = Receiver::of(&scene.layout.samples[number]);
    let (mut packet, mut above) = (Packet::idle(), 0_u32);
    for number in 0..light_points.count() {
        if let Some(ray) = shadow_ray_to(scene, &receiver, light_points, number) {
            packet.set_ray(number, ray.origin_m, ray.direction, ray.t_max);
            above |= 1 << number;
        }
    }
    if above == 0 {
        return 0;
    }
    let shadowed = blocked_through(&scene.bvh, &scene.mesh, &packet, stack);
    (0..LANES).fold(above, |seen, lane| if shadowed.0[lane] != 0 { seen & !(1 << lane) } else { seen })
}
