//! Light points: the points on lamps and in bulbs and the bright directions that all samples send shadow rays to.

use super::super::bulb::BulbPoint;
use super::super::environment::DistantLight;
use super::super::geometry::Scene;
use super::super::lamps::LampPoint;
use super::super::lanes::LANES;
use super::super::light::BANDS;
use super::super::vectors::{dot, sub};
use super::fan::{ByGroup, GROUPS, Receiver, STEADY, fan};
use super::settings::BakeSettings;
use super::sources::{SOURCES_MAX, Source, SourceLight, sources};

/// Shadow rays end at this share of the way to a lamp.
pub(super) const END_SHARE: f32 = 0.999;

/// Light points that all samples of one kind share, and the directions of their random rays.
#[derive(Clone, Debug)]
pub struct LightPoints {
    /// Points on lamps.
    pub lamp_points: Vec<LampPoint>,
    /// Points in bulbs.
    pub bulb_points: Vec<BulbPoint>,
    /// Bright directions of the surroundings: light points infinitely far away.
    pub distant: Vec<DistantLight>,
    /// Directions of bounces. Empty where random rays cannot find light.
    pub fan: Vec<[f32; 3]>,
    /// The strongest sources, each a range of the light points.
    pub sources: Vec<Source>,
}

impl LightPoints {
    /// On lamps, in bulbs and in bright directions; with a fan of the given number of random rays.
    pub fn new(scene: &Scene, lamp_rays: usize, rays: usize) -> Self {
        let mut far =
            scene.environment.as_ref().map_or_else(Vec::new, |environment| environment.distant_lights(lamp_rays));
        far.extend(scene.mesh.distant.iter().map(|light| light.points(lamp_rays / 4).collect()));
        let (lamp_points, bulb_points) = (scene.lamps.points(lamp_rays), scene.lamps.bulb_points(lamp_rays));
        let sources = sources(&scene.lamps, &lamp_points, &bulb_points, &far);
        Self { lamp_points, bulb_points, distant: far.concat(), fan: fan(rays), sources }
    }

    /// Of samples on vertices, then of samples on grids.
    pub fn of(scene: &Scene, settings: &BakeSettings) -> [Self; 2] {
        let with_fan = settings.bounces || scene.glows_beyond_shadow_rays();
        [(settings.vertex_lamp_rays, settings.vertex_rays), (settings.grid_lamp_rays, settings.grid_rays)].map(
            |(lamp_rays, rays)| {
                let light_points = Self::new(scene, lamp_rays, rays);
                if with_fan { light_points } else { Self { fan: Vec::new(), ..light_points } }
            },
        )
    }

    /// Every n-th of these light points, 16 at most.
    pub fn thinned(&self) -> Self {
        let [lamps, bulbs] = [self.lamp_points.len(), self.bulb_points.len()];
        let total = lamps + bulbs + self.distant.len();
        let mut few = Self {
            lamp_points: Vec::new(),
            bulb_points: Vec::new(),
            distant: Vec::new(),
            fan: Vec::new(),
            sources: Vec::new(),
        };
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

    /// Number of light points.
    pub fn count(&self) -> usize {
        self.lamp_points.len() + self.bulb_points.len() + self.distant.len()
    }

    /// Rays of a sample with the given number of sides.
    pub fn rays(&self, sides: usize) -> usize {
        self.count() + sides * self.fan.len()
    }
}

/// Light that shadow rays bring.
#[derive(Clone, Copy, Debug)]
pub struct ShadowRayLight {
    /// From all light points, straight and over plane mirrors.
    pub all: ByGroup<f64>,
    /// Straight from each of the strongest sources.
    pub by_source: [SourceLight; SOURCES_MAX],
}

impl ShadowRayLight {
    /// None.
    pub const NONE: Self = Self { all: [[0.0; BANDS]; GROUPS], by_source: [SourceLight::NONE; SOURCES_MAX] };
}

/// A ray towards a light point that is above the horizon of one side of a receiver.
#[derive(Clone, Copy, Debug)]
pub struct ShadowRay {
    /// Just above the surface.
    pub origin_m: [f32; 3],
    /// Towards the light point; of any length.
    pub direction: [f32; 3],
    /// Where the source begins, in lengths of the direction.
    pub t_max: f32,
    /// Side of the receiver.
    pub side: usize,
    /// Whether it flickers.
    pub group: usize,
    /// Unoccluded light along it, whatever its cone.
    pub sent: [f64; BANDS],
    /// Share of it within the source's cone.
    pub cone: f32,
}

/// The ray from a receiver, on the first or on both of its sides, to the light point of a number; none where that is below the horizon.
#[inline]
pub fn shadow_ray_to(
    scene: &Scene,
    receiver: &Receiver,
    light_points: &LightPoints,
    number: usize,
) -> Option<ShadowRay> {
    let Receiver { at_m, normal, sides } = *receiver;
    let side_of = |position_m: [f32; 3]| usize::from(dot(sub(position_m, at_m), normal) < 0.0);
    let [lamps, bulbs] = [light_points.lamp_points.len(), light_points.bulb_points.len()];
    if number < lamps {
        let point = &light_points.lamp_points[number];
        let side = side_of(point.position_m);
        let origin_m = receiver.lifted_m(side);
        let direction = sub(point.position_m, origin_m);
        let strength = disc_form_factor(normal, direction, point.normal, point.area_m2);
        let sent = point.radiance.map(|band| std::f64::consts::PI * f64::from(band) * strength);
        let group = scene.group_of(point.material);
        let ray = ShadowRay { origin_m, direction, t_max: END_SHARE, side, group, sent, cone: 1.0 };
        (strength > 0.0 && side < sides).then_some(ray)
    } else if number < lamps + bulbs {
        let point = &light_points.bulb_points[number - lamps];
        let side = side_of(point.position_m);
        let origin_m = receiver.lifted_m(side);
        let (strength, cone, enters) = point.toward(origin_m, normal).filter(|_| side < sides)?;
        let sent = point.intensity.map(|band| f64::from(band) * strength);
        let (direction, t_max) = (sub(point.position_m, origin_m), enters * END_SHARE);
        Some(ShadowRay { origin_m, direction, t_max, side, group: scene.group_of(point.material), sent, cone })
    } else {
        let light = &light_points.distant[number - lamps - bulbs];
        let cos = f64::from(dot(light.direction, normal));
        let side = usize::from(cos < 0.0);
        let sent = light.normal_irradiance.map(|band| f64::from(band) * cos.abs());
        let (origin_m, direction) = (receiver.lifted_m(side), light.direction);
        let ray = ShadowRay { origin_m, direction, t_max: f32::MAX, side, group: STEADY, sent, cone: 1.0 };
        (side < sides).then_some(ray)
    }
}

/// Form factor of a small disc of the area that a ray represents, cos cos A / sqrt((pi d^2)^2 + A^2). It never exceeds 1, so a lamp that
/// touches a sample does not give it infinite light; far away it falls short of a point's, which the points of a lamp sum to, by half the
/// square of A / (pi d^2).
pub(super) fn disc_form_factor(normal: [f32; 3], toward: [f32; 3], lamp: [f32; 3], area_m2: f64) -> f64 {
    let distance2 = f64::from(dot(toward, toward));
    let cos_here = f64::from(dot(toward, normal)).abs();
    let cos_there = -f64::from(dot(toward, lamp));
    if distance2 <= 0.0 || cos_there <= 0.0 {
        return 0.0;
    }
    let sphere_m2 = std::f64::consts::PI * distance2;
    cos_here * cos_there / distance2 * area_m2 / (sphere_m2 * sphere_m2 + area_m2 * area_m2).sqrt()
}
