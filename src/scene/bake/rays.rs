//! The rays of neighbouring receivers, samples or other points: their direct light, and the hits of their random rays.

use super::super::chance::{frame, turned};
use super::super::geometry::Scene;
use super::super::lanes::LANES;
use super::super::light::{BANDS, Bands};
use super::super::mesh::Material;
use super::super::tracer::{MISS, Packet, Stack, closest_through};
use super::super::vectors::{dot, mirrored, unit};
use super::batch::{self, Hit};
use super::blockers::Blocker;
use super::fan::FLICKERING;
pub use super::fan::{ByGroup, GROUPS, LIFT_M, Receiver, STEADY};
use super::light_points::{LightPoints, ShadowRayLight};
use super::secondary::SecondarySources;
use super::shadow_rays::shadow_ray_light;
use super::sources::{SOURCES_MAX, SourceLight};
use crate::num::{f32_nearest, f64_from_usize, index, low_u16, u32_from, u32_truncated_f32};

/// Mirrors that a ray is followed over. What is left after them is dropped: all that five metal mirrors keep, 1e-7 of glazed tiles.
const MIRRORS_MAX: usize = 4;

/// The light that one side of a sample receives.
#[derive(Clone, Debug)]
pub struct SideLight {
    /// Light of lamps, sky and glowing surfaces, by group.
    pub direct: ByGroup<f64>,
    /// What of it the strongest sources send.
    pub by_source: [SourceLight; SOURCES_MAX],
    /// Hits of the random rays.
    pub bounced: Bounced,
    /// Whether it lies within something closed, as a floor does under a box that stands on it: more than
    /// an eighth of its rays met backs (half of them do right under the box's edge, a quarter under its corner).
    pub is_buried: bool,
}

/// A sample side of whose exitance a share counts: met on or over a glossy surface, or a secondary source, whose share stands for several
/// rays.
#[derive(Clone, Copy, Debug)]
pub struct WeightedHit {
    /// The sample side.
    pub sample_side: u32,
    /// Share of the sample side's exitance, by band, in 65,535ths: there are millions of these.
    shares: [u16; BANDS],
}

const SHARES: f32 = 65_535.0;

impl WeightedHit {
    fn new(sample_side: u32, weight: Bands) -> Self {
        Self { sample_side, shares: weight.map(|band| low_u16(u32_truncated_f32(band.clamp(0.0, 1.0) * SHARES + 0.5))) }
    }

    /// Share of the sample side's exitance, by band.
    #[inline(always)]
    pub fn weight(&self) -> Bands {
        self.shares.map(|share| f32::from(share) * (1.0 / SHARES))
    }
}

/// Traces all rays of neighbouring samples: the light of both sides of each, nothing on the back of a one-sided surface.
pub fn gather(
    scene: &Scene,
    light_points: &LightPoints,
    secondary: &SecondarySources,
    samples: &[u32],
) -> Vec<[SideLight; 2]> {
    let receivers: Vec<Receiver> =
        samples.iter().map(|&number| Receiver::of(&scene.layout.samples[index(number)])).collect();
    let lit = |(ShadowRayLight { all: mut direct, by_source }, bounced): (ShadowRayLight, Bounced)| {
        for group in 0..GROUPS {
            for band in 0..BANDS {
                direct[group][band] += bounced.seen[group][band];
            }
        }
        let is_buried = 8 * bounced.backs > light_points.fan.len();
        SideLight { direct, by_source, bounced, is_buried }
    };
    let by_shadow_rays = shadow_ray_light(scene, &receivers, light_points, &[]);
    let mut bounced = bounce_rays(scene, &receivers, &light_points.fan, secondary, &[]);
    let (rays, mut stack) = (f32_nearest(f64_from_usize(light_points.fan.len())), Stack::new());
    for (receiver, bounced) in receivers.iter().zip(&mut bounced) {
        for (seen, bounced) in secondary.seen_from(scene, receiver, &mut stack).into_iter().zip(bounced) {
            let weighted = |(sample_side, share)| WeightedHit::new(sample_side, [rays * f32_nearest(share); BANDS]);
            bounced.weighted.extend(seen.into_iter().map(weighted));
        }
    }
    let each = by_shadow_rays.into_iter().zip(bounced);
    each.map(|([above, below], [front, back])| [(above, front), (below, back)].map(lit)).collect()
}

/// Light of the random rays of one side.
#[derive(Clone, Debug, Default)]
pub struct Bounced {
    /// Emitted light: sky, emissive surfaces without shadow rays, lamps in mirrors.
    pub seen: ByGroup<f64>,
    /// Sum of the squares of the light of each ray.
    pub squares: ByGroup<f64>,
    /// Sample side of each ray that ended at one.
    pub met: Vec<u32>,
    /// What was met on or over glossy surfaces, and secondary sources.
    pub weighted: Vec<WeightedHit>,
    /// Rays that met the back of what has none.
    pub backs: usize,
    /// Rays that met a moving object.
    pub blocked: usize,
}

/// A ray that was mirrored, and the share of light that comes along it.
#[derive(Clone, Copy)]
struct Path {
    origin_m: [f32; 3],
    direction: [f32; 3],
    weight: Bands,
    /// Whether shadow rays are aimed at what shines along it (`reflected`).
    is_aimed: bool,
}

/// Cosine-weighted rays of both sides of neighbouring receivers along the directions of a fan: what they met, but for
/// secondary sources from afar. A side that is not lit has none.
pub fn bounce_rays(
    scene: &Scene,
    receivers: &[Receiver],
    fan: &[[f32; 3]],
    secondary: &SecondarySources,
    blockers: &[Blocker],
) -> Vec<[Bounced; 2]> {
    let sides =
        || receivers.iter().enumerate().flat_map(|(receiver, of)| (0..of.sides).map(move |side| (receiver, side)));
    let origins_m: Vec<[f32; 3]> = sides().map(|(receiver, side)| receivers[receiver].lifted_m(side)).collect();
    let normals = sides().map(|(receiver, side)| receivers[receiver].normal_of(side));
    let tangent_frames: Vec<_> = normals.map(|normal| (frame(normal), normal)).collect();
    let in_all_frames =
        |&local: &[f32; 3]| tangent_frames.iter().map(move |(tangents, normal)| turned(local, tangents, *normal));
    let directions: Vec<[f32; 3]> = fan.iter().flat_map(in_all_frames).collect();
    let hits = batch::trace(scene, &origins_m, &directions, blockers);
    let share = std::f64::consts::PI / f64_from_usize(fan.len().max(1));
    let mut all = vec![<[Bounced; 2]>::default(); receivers.len()];
    let mut stack = Stack::new();
    for (number, (receiver, side)) in sides().enumerate() {
        let bounced = &mut all[receiver][side];
        bounced.met.reserve_exact(fan.len());
        let mut paths = Vec::new();
        for ray in (number..hits.len()).step_by(origins_m.len()) {
            if hits[ray].is_blocked {
                bounced.blocked += 1;
                continue;
            }
            let end = scene.end_of(&hits[ray], directions[ray]);
            let glow = if end.is_aimed { [0.0; BANDS] } else { end.light };
            for band in 0..BANDS {
                let glow = f64::from(glow[band]);
                bounced.seen[end.group][band] += glow;
                bounced.squares[end.group][band] += glow * glow;
            }
            let origin_m = origins_m[number];
            let path = Path { origin_m, direction: directions[ray], weight: [1.0; BANDS], is_aimed: true };
            match (end.mirror, end.sample_side) {
                (Some(mirror), Some(sample_side)) => {
                    let reflected = mirror.reflected(scene, &path, hits[ray].t, sample_side, bounced);
                    let is_aimed = scene.mirrors.of_triangle(hits[ray].triangle).is_some();
                    paths.extend(reflected.map(|path| Path { is_aimed, ..path }));
                }
                (None, Some(sample_side)) if secondary.counts(sample_side, hits[ray].t) => {
                    bounced.met.push(sample_side)
                }
                (None, Some(_)) => {}
                (_, None) => bounced.backs += usize::from(!end.is_sky),
            }
        }
        follow(scene, paths, bounced, &mut stack);
        bounced.seen = bounced.seen.map(|light| light.map(|sum| sum * share));
        bounced.squares = bounced.squares.map(|light| light.map(|sum| sum * share * share));
    }
    all
}

/// Rays of a sample that must find the image of lamps in curved mirrors, or in several, before it counts: fewer would be specks of light,
/// each some lamp that one ray in hundreds met.
const IMAGE_RAYS_MIN: usize = 16;

/// Follows rays over mirrors, where lamps shine as well unless shadow rays are aimed at them over the mirror. (The sun's disc and what else
/// is aimed at beyond all surfaces is not found this way: a few rays would carry all of it.)
fn follow(scene: &Scene, mut paths: Vec<Path>, bounced: &mut Bounced, stack: &mut Stack) {
    let mut images: ByGroup<f64> = ByGroup::default();
    let mut found = 0;
    for _ in 0..MIRRORS_MAX {
        let mut further = Vec::new();
        for group in paths.chunks(LANES) {
            let mut packet = Packet::idle();
            for (lane, path) in group.iter().enumerate() {
                packet.set_ray(lane, path.origin_m, path.direction, f32::MAX);
            }
            let hits = closest_through(&scene.bvh, &scene.mesh, &packet, stack);
            for (lane, path) in group.iter().enumerate() {
                let end = scene.end_of(&Hit::of(&hits, lane), path.direction);
                let shines = end.light.iter().any(|&band| band > 0.0) && !(end.is_aimed && path.is_aimed);
                found += usize::from(end.is_aimed && shines);
                let light = if end.is_aimed { &mut images } else { &mut bounced.seen };
                for band in (0..BANDS).filter(|_| shines) {
                    light[end.group][band] += f64::from(end.light[band] * path.weight[band]);
                }
                match (end.mirror, end.sample_side) {
                    (Some(mirror), Some(sample_side)) => {
                        further.extend(mirror.reflected(scene, path, hits.t.0[lane], sample_side, bounced));
                    }
                    (None, Some(sample_side)) => bounced.weighted.push(WeightedHit::new(sample_side, path.weight)),
                    (_, None) => {}
                }
            }
        }
        paths = further;
    }
    if found >= IMAGE_RAYS_MIN {
        for (sum, light) in bounced.seen.iter_mut().flatten().zip(images.iter().flatten()) {
            *sum += light;
        }
    }
}

/// Where a ray ended.
struct End {
    /// The sample side; none in the sky and on the back of what has none.
    sample_side: Option<u32>,
    is_sky: bool,
    /// Whether shadow rays are aimed at the lamp that was met.
    is_aimed: bool,
    group: usize,
    /// Emitted light from there.
    light: Bands,
    mirror: Option<Mirror>,
}

/// A glossy surface where a ray met it.
#[derive(Clone, Copy)]
struct Mirror {
    /// Unit normal on the side that was met.
    normal: [f32; 3],
    /// Schlick's reflectance along the ray.
    reflectance: Bands,
}

impl Mirror {
    /// The reflected ray at this surface; its diffuse part is recorded. None where nothing is reflected.
    fn reflected(&self, scene: &Scene, path: &Path, t: f32, sample_side: u32, bounced: &mut Bounced) -> Option<Path> {
        let weight: Bands = std::array::from_fn(|band| path.weight[band] * self.reflectance[band]);
        if scene.layout.samples[index(sample_side) / 2].albedo.iter().any(|&band| band > 0.0) {
            let diffuse = std::array::from_fn(|band| path.weight[band] - weight[band]);
            bounced.weighted.push(WeightedHit::new(sample_side, diffuse));
        }
        let direction = unit(mirrored(path.direction, self.normal))?;
        let origin_m =
            [0, 1, 2].map(|axis| path.origin_m[axis] + path.direction[axis] * t + self.normal[axis] * LIFT_M);
        Some(Path { origin_m, direction, weight, is_aimed: false })
    }
}

impl Scene {
    /// What a ray met: the nearest sample on the side it came from, the light emitted there, and whether it
    /// goes on. Taking the nearest of three samples instead of their mean moves light by half a spacing and loses none.
    fn end_of(&self, hit: &Hit, direction: [f32; 3]) -> End {
        let (triangle, [u, v]) = (hit.triangle, hit.weights);
        if triangle == MISS {
            let light = self.soft_sky(direction);
            return End { sample_side: None, is_sky: true, is_aimed: false, group: STEADY, light, mirror: None };
        }
        let shade = &self.layout.triangles[index(triangle)];
        let facing = dot(shade.normal, direction);
        let back = facing > 0.0;
        let material = &self.mesh.materials[index(shade.material)];
        if back && !material.double_sided {
            let light = [0.0; BANDS];
            return End { sample_side: None, is_sky: false, is_aimed: false, group: STEADY, light, mirror: None };
        }
        let mut nearest = (0, f32::MIN);
        for (sample, weight) in shade.around(u, v) {
            if weight > nearest.1 {
                nearest = (sample, weight);
            }
        }
        let mirror = material.gloss().filter(|_| material.is_mirror()).map(|gloss| Mirror {
            normal: if back { shade.normal.map(|x| -x) } else { shade.normal },
            reflectance: gloss.reflectance(facing.abs()),
        });
        let sample_side = Some(u32_from(2 * nearest.0 + usize::from(back)));
        let (group, is_aimed) = (self.group_of(shade.material), self.lamps.are_aimed_at(shade.material));
        let cone = material.bulb.and_then(|bulb| bulb.cone);
        let emission = self.mesh.emission_at(triangle, [u, v]);
        let light = cone.map_or(emission, |cone| {
            let share = cone.share(direction.map(|x| -x));
            emission.map(|band| band * share)
        });
        End { sample_side, is_sky: false, is_aimed, group, light, mirror }
    }

    /// Group of a material's own light.
    pub(super) fn group_of(&self, material: u32) -> usize {
        if self.flickers(material) { FLICKERING } else { STEADY }
    }

    /// Whether random rays can find light that no shadow ray samples.
    pub(super) fn glows_beyond_shadow_rays(&self) -> bool {
        let sky = self.environment.is_some() || self.sky.iter().any(|&band| band > 0.0);
        let is_left = |(number, material): (u32, &Material)| material.is_emissive() && !self.lamps.are_aimed_at(number);
        sky || (0_u32..).zip(&self.mesh.materials).any(is_left)
    }
}
