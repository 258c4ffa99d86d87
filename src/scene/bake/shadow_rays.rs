//! Shadow rays towards what samples aim at, and the light that they find.

use super::super::geometry::Scene;
use super::super::lanes::LANES;
use super::super::light::{BANDS, luminance};
use super::super::tracer::{Packet, Stack, blocked_through};
use super::aims::{Aimed, AimedLight, Aims, aimed};
use super::blockers::{Blocker, nearest};
use super::fan::{Receiver, idle, set_ray};
use super::reflected::add_reflected;
use crate::num::f32_nearest;

/// Rays towards sources that wait until a packet is full.
struct ShadowRays<'a> {
    scene: &'a Scene,
    blockers: &'a [Blocker<'a>],
    stack: Stack,
    packet: Packet,
    waiting: [Waiting; LANES],
    lanes: usize,
    /// Of both sides of each receiver.
    light: Vec<[AimedLight; 2]>,
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
    fn push(&mut self, receiver: usize, aimed: &Aimed, source: Option<usize>) {
        if let Some(source) = source {
            self.light[receiver][aimed.side].by_source[source].unoccluded += f32_nearest(luminance(aimed.sent));
        }
        if aimed.cone == 0.0 {
            return;
        }
        set_ray(&mut self.packet, self.lanes, aimed.origin_m, aimed.direction, aimed.t_max);
        let sent = aimed.sent.map(|band| band * f64::from(aimed.cone));
        self.waiting[self.lanes] = Waiting { receiver, side: aimed.side, group: aimed.group, sent, source };
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
        (self.packet, self.lanes) = (idle(), 0);
    }
}

/// Light that lamps and bright directions send to the first or to both sides of receivers, straight or over plane mirrors, past moving
/// objects.
pub fn aimed_light(scene: &Scene, receivers: &[Receiver], aims: &Aims, blockers: &[Blocker]) -> Vec<[AimedLight; 2]> {
    let (stack, waiting) = (Stack::new(), [Waiting::NONE; LANES]);
    let light = vec![[AimedLight::NONE; 2]; receivers.len()];
    let mut shadows = ShadowRays { scene, blockers, stack, packet: idle(), waiting, lanes: 0, light };
    for number in 0..aims.count() {
        let source = aims.sources.iter().position(|source| source.holds(number));
        for (receiver_index, receiver) in receivers.iter().enumerate() {
            if let Some(aimed) = aimed(scene, receiver, aims, number) {
                shadows.push(receiver_index, &aimed, source);
            }
        }
    }
    if shadows.lanes > 0 {
        shadows.flush();
    }
    add_reflected(scene, receivers, aims, blockers, &mut shadows.light);
    shadows.light
}

/// Which of at most 16 aims a sample sees: a bit each.
pub fn visible_aims(scene: &Scene, number: usize, aims: &Aims, stack: &mut Stack) -> u32 {
    let receiver = Receiver::of(&scene.layout.samples[number]);
    let (mut packet, mut above) = (idle(), 0_u32);
    for number in 0..aims.count() {
        if let Some(aimed) = aimed(scene, &receiver, aims, number) {
            set_ray(&mut packet, number, aimed.origin_m, aimed.direction, aimed.t_max);
            above |= 1 << number;
        }
    }
    if above == 0 {
        return 0;
    }
    let shadowed = blocked_through(&scene.bvh, &scene.mesh, &packet, stack);
    (0..LANES).fold(above, |seen, lane| if shadowed.0[lane] != 0 { seen & !(1 << lane) } else { seen })
}
