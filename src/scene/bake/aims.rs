//! What samples aim at: points on lamps and bright directions; and the shadow rays towards them.

use super::super::bulb::BulbPoint;
use super::super::environment::DistantLight;
use super::super::geometry::Scene;
use super::super::lamps::LampPoint;
use super::super::lanes::LANES;
use super::super::light::BANDS;
use super::super::tracer::{Packet, Stack, blocked_through};
use super::super::vectors::{dot, sub};
use super::fan::{ByGroup, GROUPS, LIFT_M, STEADY, fan, idle, set_ray};
use super::settings::BakeSettings;

/// Aimed rays end this share short of the lamp.
const AIM_SHARE: f32 = 0.999;

/// What all samples of one kind aim at and where they look.
pub struct Aims {
    /// Points on lamps.
    pub lamp_points: Vec<LampPoint>,
    /// Points in bulbs.
    pub bulb_points: Vec<BulbPoint>,
    /// Bright directions of the surroundings.
    pub distant: Vec<DistantLight>,
    /// Directions of bounces. Empty where random rays cannot find light.
    pub fan: Vec<[f32; 3]>,
}

impl Aims {
    /// At lamps and bright directions, along so many rays.
    pub fn new(scene: &Scene, lamp_rays: usize, rays: usize) -> Self {
        let mut distant = scene.environment.as_ref().map_or_else(Vec::new, |environment| environment.aims(lamp_rays));
        distant.extend(scene.mesh.distant.iter().flat_map(|light| light.points(lamp_rays / 4)));
        let (lamp_points, bulb_points) = (scene.lamps.points(lamp_rays), scene.lamps.bulb_points(lamp_rays));
        Self { lamp_points, bulb_points, distant, fan: fan(rays) }
    }

    /// Of samples on vertices, then of samples on grids.
    pub fn of(scene: &Scene, settings: &BakeSettings) -> [Self; 2] {
        let with_fan = settings.bounces || scene.glows_beyond_aims();
        [(settings.vertex_lamp_rays, settings.vertex_rays), (settings.grid_lamp_rays, settings.grid_rays)].map(
            |(lamp_rays, rays)| {
                let aims = Self::new(scene, lamp_rays, rays);
                if with_fan { aims } else { Self { fan: Vec::new(), ..aims } }
            },
        )
    }

    /// Every so many-th of these aims, 16 at most.
    pub fn thinned(&self) -> Self {
        let [lamps, bulbs] = [self.lamp_points.len(), self.bulb_points.len()];
        let total = lamps + bulbs + self.distant.len();
        let mut few = Self { lamp_points: Vec::new(), bulb_points: Vec::new(), distant: Vec::new(), fan: Vec::new() };
        for number in (0..total.min(LANES)).map(|lane| (2 * lane + 1) * total / (2 * total.min(LANES))) {
            if number < lamps {
                few.lamp_points.push(self.lamp_points[number]);
            } else if number < lamps + bulbs {
                few.bulb_points.push(self.bulb_points[number - lamps]);
            } else {
                few.distant.push(self.distant[number - lamps - bulbs]);
            }
        }
        few
    }

    /// Whether there is anything to aim at.
    pub fn is_empty(&self) -> bool {
        self.lamp_points.is_empty() && self.bulb_points.is_empty() && self.distant.is_empty()
    }

    /// Rays of a sample with so many sides.
    pub fn rays(&self, sides: usize) -> usize {
        self.lamp_points.len() + self.bulb_points.len() + self.distant.len() + sides * self.fan.len()
    }
}

/// Rays towards sources that wait until a packet is full.
struct Shadows<'a> {
    scene: &'a Scene,
    stack: Stack,
    packet: Packet,
    waiting: [(usize, usize, [f64; BANDS]); LANES],
    lanes: usize,
    light: [ByGroup<f64>; 2],
}

impl Shadows<'_> {
    fn push(&mut self, ray: ([f32; 3], [f32; 3], f32), side: usize, group: usize, sent: [f64; BANDS]) {
        let (origin, direction, t_max) = ray;
        set_ray(&mut self.packet, self.lanes, origin, direction, t_max);
        self.waiting[self.lanes] = (side, group, sent);
        self.lanes += 1;
        if self.lanes == LANES {
            self.flush();
        }
    }

    fn flush(&mut self) {
        let shadowed = blocked_through(&self.scene.bvh, &self.scene.mesh, &self.packet, &mut self.stack);
        for lane in (0..self.lanes).filter(|&lane| !shadowed[lane]) {
            let (side, group, sent) = self.waiting[lane];
            for band in 0..BANDS {
                self.light[side][group][band] += sent[band];
            }
        }
        (self.packet, self.lanes) = (idle(), 0);
    }
}

/// A ray towards a source that is above the horizon of one side of a place.
struct Aimed {
    origin_m: [f32; 3],
    direction: [f32; 3],
    t_max: f32,
    side: usize,
    group: usize,
    /// Unoccluded light along it.
    sent: [f64; BANDS],
}

/// Makes the rays of a place towards all sources, each with its number among the aims.
fn each_aimed(
    scene: &Scene,
    (at_m, normal, sides): ([f32; 3], [f32; 3], usize),
    aims: &Aims,
    mut each: impl FnMut(usize, Aimed),
) {
    let lifted = |side: usize| -> [f32; 3] {
        let lift = if side == 0 { LIFT_M } else { -LIFT_M };
        [0, 1, 2].map(|axis| at_m[axis] + normal[axis] * lift)
    };
    for (number, point) in aims.lamp_points.iter().enumerate() {
        let side = usize::from(dot(sub(point.position_m, at_m), normal) < 0.0);
        let origin_m = lifted(side);
        let direction = sub(point.position_m, origin_m);
        let strength = disc_form_factor(normal, direction, point.normal, point.area_m2);
        if strength > 0.0 && side < sides {
            let sent = point.radiance.map(|band| std::f64::consts::PI * f64::from(band) * strength);
            let group = scene.group_of(point.material);
            each(number, Aimed { origin_m, direction, t_max: AIM_SHARE, side, group, sent });
        }
    }
    for (number, point) in (aims.lamp_points.len()..).zip(&aims.bulb_points) {
        let side = usize::from(dot(sub(point.position_m, at_m), normal) < 0.0);
        if side >= sides {
            continue;
        }
        let origin_m = lifted(side);
        if let Some((strength, enters)) = point.toward(origin_m, normal) {
            let sent = point.intensity.map(|band| f64::from(band) * strength);
            let (direction, t_max) = (sub(point.position_m, origin_m), enters * AIM_SHARE);
            each(number, Aimed { origin_m, direction, t_max, side, group: scene.group_of(point.material), sent });
        }
    }
    for (number, light) in (aims.lamp_points.len() + aims.bulb_points.len()..).zip(&aims.distant) {
        let cos = f64::from(dot(light.direction, normal));
        let side = usize::from(cos < 0.0);
        let sent = light.normal_irradiance.map(|band| f64::from(band) * cos.abs());
        if side < sides {
            let (origin_m, direction) = (lifted(side), light.direction);
            each(number, Aimed { origin_m, direction, t_max: f32::MAX, side, group: STEADY, sent });
        }
    }
}

/// Light that lamps and bright directions send straight to the first or to both sides of a place.
pub fn aimed_light(scene: &Scene, at_m: [f32; 3], normal: [f32; 3], sides: usize, aims: &Aims) -> [ByGroup<f64>; 2] {
    let dark = [[[0.0; BANDS]; GROUPS]; 2];
    let (stack, waiting) = (Stack::new(), [(0, 0, [0.0; BANDS]); LANES]);
    let mut shadows = Shadows { scene, stack, packet: idle(), waiting, lanes: 0, light: dark };
    each_aimed(scene, (at_m, normal, sides), aims, |_, aimed| {
        shadows.push((aimed.origin_m, aimed.direction, aimed.t_max), aimed.side, aimed.group, aimed.sent);
    });
    if shadows.lanes > 0 {
        shadows.flush();
    }
    shadows.light
}

/// Which of at most 16 aims a sample sees: a bit each.
pub fn visible_aims(scene: &Scene, number: usize, aims: &Aims, stack: &mut Stack) -> u32 {
    let sample = &scene.layout.samples[number];
    let (mut packet, mut above) = (idle(), 0_u32);
    each_aimed(scene, (sample.position_m, sample.normal, sample.sides()), aims, |number, aimed| {
        set_ray(&mut packet, number, aimed.origin_m, aimed.direction, aimed.t_max);
        above |= 1 << number;
    });
    if above == 0 {
        return 0;
    }
    let shadowed = blocked_through(&scene.bvh, &scene.mesh, &packet, stack);
    (0..LANES).fold(above, |seen, lane| if shadowed[lane] { seen & !(1 << lane) } else { seen })
}

/// Form factor of a small disc of the area that a ray represents: cos cos A / (pi d^2 + A). It never exceeds 1, so a lamp that
/// touches a sample does not give it infinite light; far away its error against a point's is A / (pi d^2).
fn disc_form_factor(normal: [f32; 3], toward: [f32; 3], lamp: [f32; 3], area_m2: f64) -> f64 {
    let distance2 = f64::from(dot(toward, toward));
    let cos_here = f64::from(dot(toward, normal)).abs();
    let cos_there = -f64::from(dot(toward, lamp));
    if distance2 <= 0.0 || cos_there <= 0.0 {
        return 0.0;
    }
    cos_here * cos_there / distance2 * area_m2 / (std::f64::consts::PI * distance2 + area_m2)
}
