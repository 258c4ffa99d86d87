//! Irradiance on both sides of every sample, in the scene's units: direct and after all bounces. Flickering light is kept separately.
//!
//! Every sample traces shadow rays to the same points on lamps. Sky and bounces come from cosine-weighted rays whose hits form a sparse
//! matrix; bounces are iterated on that matrix until the light settles. Every sample looks along the same directions around its normal, so
//! the result does not depend on threads. On large triangles only some samples are traced (`refine`): the light of the rest is
//! interpolated.

mod batch;
pub mod blockers;
pub mod buried;
mod cells;
mod clearance;
mod cut_off;
mod fan;
mod gathered;
pub(super) mod light_at;
pub(super) mod light_points;
pub(super) mod rays;
mod refine;
mod reflected;
mod secondary;
mod settings;
pub(super) mod shadow_rays;
mod source_lists;
mod sources;
mod store;
mod traced;

use super::geometry::Scene;
use super::hashing::hash_floats;
use super::light::{BANDS, Bands, luminance};
use super::mesh::ALBEDO_MAX;
use crate::num::{f32_nearest, greater, index, lesser, u64_from};
use crate::parallel::collected;
use cut_off::{CutOff, Relit, cut_off};
use fan::{FLICKERING, GROUPS, STEADY};
use light_points::LightPoints;
pub use light_points::ShadowRay;
use refine::traced_samples;
pub use settings::{BAKE_VERSION, BakeCost, BakeSettings};
pub use source_lists::{ListedLight, SourceLists};
pub use sources::{Extent, Source, SourceLight};
use traced::TracedSamples;

/// Baked irradiance of a scene: pi times the mean radiance over the hemisphere, in the scene's own units.
#[derive(Clone, Debug, PartialEq)]
pub struct Bake {
    pub(super) key: [u8; 32],
    /// Steady light by sample side (`samples`).
    pub(super) irradiance: Vec<Bands>,
    /// The same of light that flickers, at its mean; empty where none does.
    pub(super) flickering: Vec<Bands>,
    /// Whether light was followed over surfaces.
    pub(super) bounces: bool,
    /// Sources whose shadow has an edge.
    pub(super) edges: SourceLists,
    /// Sources that light normal maps.
    pub(super) on_normal_maps: SourceLists,
}

/// The iteration ends when no sample's change, nor what all further bounces bring by the rate at which changes fall, is more than this
/// share of its irradiance, in any band that has more than a hundred thousandth of the greatest irradiance.
const CONVERGED_SHARE: f32 = 1e-4;

/// Irradiance below this share of the greatest, which is found beside a lamp, does not keep the iteration going.
const DIM_SHARE: f32 = 1e-5;

/// Bounces that follow once sample sides that are cut off have other light: what changes is near them.
const BOUNCES_AFTER: usize = 2;

/// Iterations at most. A room of the greatest albedo all over needs a few, because its light is extrapolated.
const ITERATIONS_MAX: usize = 1_000;

/// Changes that fall more slowly than this from bounce to bounce are extrapolated once their rate is known.
const SLOW_RATE: f64 = 0.8;

/// A rate is known where it differs from the one before by less than this share of what it lacks to 1.
const RATE_KNOWN: f64 = 0.02;

impl Scene {
    /// Bakes the irradiance of all surfaces. `progress` is told the share done, from 0 to 1, from any thread.
    pub fn bake(&self, settings: &BakeSettings, progress: &(dyn Fn(f64) + Sync)) -> Bake {
        self.bake_under(settings, self.bake_key(settings), progress)
    }

    /// The same where the key is known: it takes as long as reading all textures.
    pub(crate) fn bake_under(&self, settings: &BakeSettings, key: [u8; 32], progress: &(dyn Fn(f64) + Sync)) -> Bake {
        Bake::of(self, settings, key, progress)
    }

    /// What a bake of this scene depends on: geometry, materials, textures, sky, what flickers, settings and the method's version.
    pub fn bake_key(&self, settings: &BakeSettings) -> [u8; 32] {
        let mut hasher = blake3::Hasher::new();
        hasher.update(&BAKE_VERSION.to_le_bytes());
        for rays in [settings.grid_rays, settings.vertex_rays, settings.grid_lamp_rays, settings.vertex_lamp_rays] {
            hasher.update(&crate::num::u64_from(rays).to_le_bytes());
        }
        hasher.update(&[u8::from(settings.bounces) | u8::from(!settings.interpolates) << 1]);
        hash_floats(&mut hasher, &self.sky);
        hasher.update(&[u8::from(self.environment.is_some())]);
        if let Some(environment) = &self.environment {
            environment.hash_into(&mut hasher);
        }
        hasher.update(&crate::num::u64_from(self.flickering.len()).to_le_bytes());
        hasher.update(&self.flickering.iter().copied().map(u8::from).collect::<Vec<_>>());
        // In pieces: the bytes of a large mesh beside the mesh would take as much again.
        for vertices in self.mesh.vertices.chunks(1024) {
            let numbers = vertices.iter().flat_map(|v| v.position_m.into_iter().chain(v.normal).chain(v.uv));
            hash_floats(&mut hasher, &numbers.collect::<Vec<f32>>());
        }
        for numbers in [self.mesh.triangles.as_flattened(), &self.mesh.material_of].map(|all| all.chunks(1024)) {
            for numbers in numbers {
                hasher.update(&numbers.iter().flat_map(|number| number.to_le_bytes()).collect::<Vec<u8>>());
            }
        }
        for material in &self.mesh.materials {
            hash_floats(&mut hasher, &material.base_colour);
            hash_floats(&mut hasher, &material.emission);
            hash_floats(&mut hasher, &[material.metallic, material.roughness]);
            hasher.update(&[u8::from(material.double_sided)]);
            hasher.update(&material.texture.unwrap_or(u32::MAX).to_le_bytes());
            material.maps.hash_into(&mut hasher);
            if let Some(bulb) = &material.bulb {
                hash_floats(&mut hasher, &bulb.centre_m);
                hash_floats(&mut hasher, &[bulb.radius_m]);
                hash_floats(&mut hasher, &bulb.cone.map_or([0.0; 5], |cone| cone.numbers()));
            }
        }
        for texture in &self.mesh.textures {
            texture.hash_into(&mut hasher);
        }
        for material in &self.mesh.materials {
            if let Some(cut_out) = material.cut_out {
                hasher.update(&cut_out.to_le_bytes());
            }
        }
        for cut_out in &self.mesh.cut_outs {
            cut_out.hash_into(&mut hasher);
        }
        if !self.mesh.colours.is_empty() {
            hasher.update(b"colours");
            self.mesh.colours.chunks(1024).for_each(|colours| hash_floats(&mut hasher, colours.as_flattened()));
        }
        for light in &self.mesh.distant {
            hasher.update(b"distant");
            hash_floats(&mut hasher, &light.direction);
            hash_floats(&mut hasher, &light.normal_irradiance);
        }
        if self.mesh.materials.iter().any(|material| material.culled) {
            hasher.update(b"culled");
            hasher.update(&self.mesh.materials.iter().map(|material| u8::from(material.culled)).collect::<Vec<_>>());
        }
        *hasher.finalize().as_bytes()
    }
}

impl Bake {
    /// The same irradiance at every sample, for targets that are lit evenly.
    pub(super) fn even(scene: &Scene, irradiance: f32) -> Self {
        Self {
            key: scene.bake_key(&BakeSettings::ROOM),
            irradiance: vec![[irradiance; BANDS]; 2 * scene.layout.samples.len()],
            flickering: Vec::new(),
            bounces: true,
            edges: SourceLists::default(),
            on_normal_maps: SourceLists::default(),
        }
    }

    /// Whether a shadow has an edge that a render traces.
    pub fn has_shadow_edges(&self) -> bool {
        !self.edges.lights.is_empty()
    }

    /// Bakes a scene, whose key under these settings is known. `progress` is told the share done, from any thread.
    pub(super) fn of(scene: &Scene, settings: &BakeSettings, key: [u8; 32], progress: &(dyn Fn(f64) + Sync)) -> Self {
        progress(0.0);
        let mut traced = traced_samples(scene, settings, &|share| progress(0.95 * share));
        let stand_ins = buried::stand_ins(&scene.layout, |sample_side| traced.buried[sample_side]);
        let mut light = [STEADY, FLICKERING].map(|group| {
            let shines = group == STEADY || !scene.flickering.is_empty();
            if shines { settled(scene, &traced, &stand_ins, group) } else { Vec::new() }
        });
        let ambient = ambient(&light, traced.sources.len(), |source| light_of(&traced, &stand_ins, source));
        let cut_off = cut_off(scene, &ambient, &traced.buried);
        let relit = if cut_off.is_empty() { Vec::new() } else { relight(scene, settings, &cut_off, &mut light) };
        for (group, light) in light.iter_mut().enumerate().filter(|(_, light)| !relit.is_empty() && !light.is_empty()) {
            // What stands there is lit by what is in front of it.
            for _ in 0..BOUNCES_AFTER {
                *light = bounced(scene, &traced, &stand_ins, group, light, &mut vec![[0.0; BANDS]; light.len()]);
                relit.iter().for_each(|relit| light[index(relit.sample_side)] = relit.light[group]);
            }
        }
        traced.drop_hits();
        let light_of = |source: usize| {
            let mut light = light_of(&traced, &stand_ins, source);
            relit.iter().for_each(|relit| light[index(relit.sample_side)] = relit.by_source[source]);
            light
        };
        let [irradiance, flickering] = light;
        let light = [irradiance.as_slice(), &flickering];
        let [edges, on_normal_maps] =
            SourceLists::beside_edges_and_on_normal_maps(&scene.mesh, &scene.layout, &traced.sources, light, light_of);
        progress(1.0);
        Self { key, irradiance, flickering, bounces: settings.bounces, edges, on_normal_maps }
    }
}

/// Gives sample sides that are cut off the light in front of what cuts them off.
fn relight(scene: &Scene, settings: &BakeSettings, cut_off: &[CutOff], light: &mut [Vec<Bands>; GROUPS]) -> Vec<Relit> {
    let [_, light_points] = LightPoints::of(scene, settings);
    let known = [light[STEADY].as_slice(), &light[FLICKERING]];
    let relit = collected(cut_off.len(), |number| cut_off[number].relit(scene, &light_points, known));
    for (group, light) in light.iter_mut().enumerate().filter(|(_, light)| !light.is_empty()) {
        relit.iter().for_each(|relit| light[index(relit.sample_side)] = relit.light[group]);
    }
    relit
}

/// What one of the strongest sources sends to every sample side.
fn light_of(traced: &TracedSamples, stand_ins: &[(u32, u32)], source: usize) -> Vec<SourceLight> {
    let mut light = traced.by_source(source, traced.buried.len());
    buried::fill(&mut light, stand_ins);
    light
}

/// Light of each sample side without what comes straight from single sources: 0 where that is all but rounding.
fn ambient(light: &[Vec<Bands>; GROUPS], sources: usize, light_of: impl Fn(usize) -> Vec<SourceLight>) -> Vec<f32> {
    let of_group = |group: &[Bands], sample_side: usize| {
        group.get(sample_side).map_or(0.0, |light| luminance(light.map(f64::from)))
    };
    let all: Vec<f64> = (0..light[0].len())
        .map(|sample_side| of_group(&light[0], sample_side) + of_group(&light[1], sample_side))
        .collect();
    let mut rest = all.clone();
    for source in 0..sources {
        rest.iter_mut().zip(light_of(source)).for_each(|(rest, light)| *rest -= f64::from(light.received));
    }
    let rest = rest.into_iter().zip(all);
    rest.map(|(rest, all)| if rest > AMBIENT_SHARE_MIN * all { f32_nearest(rest) } else { 0.0 }).collect()
}

/// Below this share of all light, what is left beside single sources is taken for the rounding of their sum.
const AMBIENT_SHARE_MIN: f64 = 1e-3;

/// Iterates the bounces of a group until they settle.
fn settled(scene: &Scene, traced: &TracedSamples, stand_ins: &[(u32, u32)], group: usize) -> Vec<Bands> {
    let mut now = traced.direct(group, 2 * scene.layout.samples.len());
    buried::fill(&mut now, stand_ins);
    let mut exitance = vec![[0.0; BANDS]; now.len()];
    let mut rates = Rates::default();
    for _ in 0..ITERATIONS_MAX {
        let mut next = bounced(scene, traced, stand_ins, group, &now, &mut exitance);
        rates.follow(&now, &next);
        let settled = is_settled(&now, &next, &rates);
        if !settled && rates.are_known() {
            rates.extrapolate(&now, &mut next);
        }
        now = next;
        if settled {
            break;
        }
    }
    now
}

/// One more bounce of a group: direct light + mean of (albedo times irradiance) over the sample sides that rays met.
fn bounced(
    scene: &Scene,
    traced: &TracedSamples,
    stand_ins: &[(u32, u32)],
    group: usize,
    now: &[Bands],
    exitance: &mut [Bands],
) -> Vec<Bands> {
    for (sample_side, (exitance, light)) in exitance.iter_mut().zip(now).enumerate() {
        let albedo = &scene.layout.samples[sample_side / 2].albedo;
        *exitance = std::array::from_fn(|band| light[band] * albedo[band]);
    }
    let mut next = traced.bounced(group, exitance);
    buried::fill(&mut next, stand_ins);
    next
}

/// Rates at which changes fall from bounce to bounce in each band: after some bounces, the greatest eigenvalue of the light transport.
#[derive(Clone, Copy, Debug, Default)]
struct Rates {
    /// Sum of the last change's magnitudes; none before the first and after an extrapolation.
    change: Option<[f64; BANDS]>,
    /// The last rate and the one before.
    last: [Option<[f64; BANDS]>; 2],
}

impl Rates {
    fn follow(&mut self, now: &[Bands], next: &[Bands]) {
        let mut change = [0.0; BANDS];
        for (now, next) in now.iter().zip(next) {
            for band in 0..BANDS {
                change[band] += f64::from((next[band] - now[band]).abs());
            }
        }
        let rate = self.change.map(|before| {
            std::array::from_fn(|band| {
                let rate = if before[band] > 0.0 { change[band] / before[band] } else { 0.0 };
                lesser(rate, f64::from(ALBEDO_MAX))
            })
        });
        (self.change, self.last) = (Some(change), [rate, self.last[0]]);
    }

    /// What all further bounces bring, over the last change.
    fn rest(&self) -> Option<[f64; BANDS]> {
        self.last[0].map(|rates| rates.map(|rate| rate / (1.0 - rate)))
    }

    fn are_known(&self) -> bool {
        let [Some(last), Some(before)] = self.last else { return false };
        let is_known = |band: usize| (last[band] - before[band]).abs() < RATE_KNOWN * (1.0 - last[band]);
        last.iter().any(|&rate| rate > SLOW_RATE) && (0..BANDS).all(is_known)
    }

    /// Adds what all further bounces bring at these rates (Lyusternik). Whatever it misses, further bounces put right.
    fn extrapolate(&mut self, now: &[Bands], next: &mut [Bands]) {
        let Some(rest) = self.rest() else { return };
        for (now, next) in now.iter().zip(next) {
            for band in 0..BANDS {
                let light = f64::from(next[band]) + f64::from(next[band] - now[band]) * rest[band];
                next[band] = f32_nearest(greater(light, 0.0));
            }
        }
        *self = Self::default();
    }
}

/// Whether no sample side changes any more, now or by all further bounces, each against its own light.
fn is_settled(now: &[Bands], next: &[Bands], rates: &Rates) -> bool {
    let greatest = next.iter().flatten().fold(0.0_f32, |greatest, &light| greatest.max(light));
    let dim = DIM_SHARE * greatest;
    // Before any rate is known only a change of nothing is an end.
    let left = rates.rest().map_or([f32::INFINITY; BANDS], |rest| rest.map(|rest| f32_nearest(greater(rest, 1.0))));
    now.iter().zip(next).all(|(now, next)| {
        (0..BANDS).all(|band| {
            let change = (now[band] - next[band]).abs();
            change == 0.0 || change * left[band] <= CONVERGED_SHARE * next[band].max(dim)
        })
    })
}

impl BakeCost {
    /// Of a scene with settings.
    pub fn of(scene: &Scene, settings: &BakeSettings) -> Self {
        let light_points = LightPoints::of(scene, settings);
        let mut cost = Self { rays: 0, bytes: 0 };
        for sample in &scene.layout.samples {
            let light_points = &light_points[usize::from(sample.on_grid)];
            cost.rays += u64_from(light_points.rays(sample.sides()));
            let kept = if settings.bounces { 4 * sample.sides() * light_points.fan.len() } else { 0 };
            cost.bytes += u64_from(kept + BYTES_PER_SAMPLE);
        }
        cost
    }
}

/// Bytes of a sample beside what its rays met: of both sides and groups direct light, its moments, the light by which cells are judged with
/// its error, and exitance (later two iterates and exitance); light of each source twice; lists' heads.
pub(super) const BYTES_PER_SAMPLE: usize = 1_024;

#[cfg(test)]
mod tests {
    use super::super::mesh::{Material, Mesh};
    use super::super::{box_room, target};
    use super::*;

    fn furnace(albedo: f32) -> Scene {
        let mut mesh = Mesh::default();
        mesh.materials.push(Material { emission: [1.0; BANDS], ..Material::plain("glow", [albedo; 3]) });
        for corners_m in target::cube([-1.0; 3], [1.0; 3], true) {
            mesh.append_quad(0, corners_m, [1.0, 1.0]);
        }
        Scene::new("furnace", mesh, [0.0; BANDS]).unwrap()
    }

    #[test]
    fn a_closed_glowing_box_settles_at_the_sum_of_all_bounces() {
        for albedo in [0.0, 0.3, 0.5, 0.8, 0.9, 0.98, 0.99, 1.0] {
            let scene = furnace(albedo);
            let bake = scene.bake(&BakeSettings::DRAFT, &|_| {});
            // Beyond the greatest albedo of a bake there is no finite sum.
            let albedo = albedo.min(ALBEDO_MAX);
            let expected = std::f64::consts::PI / (1.0 - f64::from(albedo));
            // The iteration leaves out 1e-4 of the result by the rate of its changes, which is the albedo here; sums of f32 add 1e-6 a
            // bounce, amplified by 1 / (1 - a). Every ray sees the same light, so there is no noise at all.
            let bound = 1.1e-4 + 2e-6 / (1.0 - f64::from(albedo));
            let mut inside = 0;
            for light in bake.irradiance.iter().step_by(2).flatten() {
                let error = f64::from(*light) / expected - 1.0;
                assert!(error.abs() < bound, "albedo {albedo}: {light}, expected {expected}, bound {bound:e}");
                inside += 1;
            }
            assert!(inside > 1_000);
        }
    }

    #[test]
    fn light_straight_from_a_square_lamp_is_its_form_factor() {
        let mut mesh = Mesh::default();
        mesh.materials.push(Material::plain("floor", [0.0; 3]));
        mesh.materials.push(Material {
            emission: [1.0; BANDS],
            double_sided: false,
            ..Material::plain("lamp", [0.0; 3])
        });
        mesh.append_quad(0, [[-3.0, 0.0, 3.0], [3.0, 0.0, 3.0], [3.0, 0.0, -3.0], [-3.0, 0.0, -3.0]], [1.0, 1.0]);
        mesh.append_quad(1, [[-0.5, 2.0, -0.5], [0.5, 2.0, -0.5], [0.5, 2.0, 0.5], [-0.5, 2.0, 0.5]], [1.0, 1.0]);
        let scene = Scene::new("lamp", mesh, [0.0; BANDS]).unwrap();
        let light_points = LightPoints::new(&scene, BakeSettings::ROOM.grid_lamp_rays, 16);
        let mut tried = 0;
        for x_m in [0.0_f32, 0.7, 1.5, 2.5] {
            let receiver = [rays::Receiver { at_m: [x_m, 0.0, 0.0], normal: [0.0, 1.0, 0.0], sides: 1 }];
            let light = shadow_rays::shadow_ray_light(&scene, &receiver, &light_points, &[])[0][0].all[0][0];
            // A fine midpoint sum of cos cos / d^2 over the lamp: its own error is below 1e-5.
            let mut expected = 0.0;
            for i in 0..100 {
                for j in 0..100 {
                    let [u, v] = [i, j].map(|k| (f64::from(k) + 0.5) / 100.0 - 0.5);
                    let d2 = (u - f64::from(x_m)) * (u - f64::from(x_m)) + v * v + 4.0;
                    expected += 1e-4 * 4.0 / (d2 * d2);
                }
            }
            // 96 points in each of two triangles have a star discrepancy of about ln(96)^2 / 96 / 4 = 5 %, and the integrand varies
            // by at most 20 % over the lamp: 1 %. The discs add 1 / (192 pi 4 m^2) = 0.04 %.
            assert!((light / expected - 1.0).abs() < 0.01, "{x_m} m: {light} {expected}");
            tried += 1;
        }
        assert_eq!(tried, 4);
    }

    #[test]
    fn a_bake_survives_its_bytes_and_refuses_all_others() {
        let scene = furnace(0.5);
        let settings = BakeSettings::DRAFT;
        let bake = scene.bake(&settings, &|_| {});
        let bytes = bake.to_bytes();
        assert_eq!(Bake::from_bytes("b", &bytes).unwrap(), bake);
        assert_eq!(bake.key(), scene.bake_key(&settings));
        assert_ne!(bake.key(), furnace(0.6).bake_key(&settings));
        for cut in [0, 7, 60, bytes.len() - 1] {
            assert!(Bake::from_bytes("b", &bytes[..cut]).is_err(), "{cut}");
        }
        let mut damaged = bytes;
        damaged[100] ^= 1;
        assert!(Bake::from_bytes("b", &damaged).unwrap_err().to_string().contains("damaged"));
    }

    #[cfg(feature = "parallel")]
    #[test]
    fn a_bake_has_the_same_bits_on_one_thread_and_on_many() {
        let scene = box_room::box_room(2);
        let settings = BakeSettings { grid_rays: 16, vertex_rays: 16, grid_lamp_rays: 8, ..BakeSettings::DRAFT };
        let [one, three] = [1, 3].map(|threads| {
            let pool = rayon::ThreadPoolBuilder::new().num_threads(threads).build().unwrap();
            pool.install(|| scene.bake(&settings, &|_| {}))
        });
        assert_eq!(one.to_bytes(), three.to_bytes());
    }
}
