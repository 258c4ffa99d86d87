//! Samples that a surface cuts off from the neighbours they are interpolated with: the floor in a crate of two-sided material without a
//! bottom. As they are, they would darken the floor around the crate as far as the next sample.

use super::super::geometry::Scene;
use super::super::lanes::LANES;
use super::super::light::{BANDS, Bands};
use super::super::tracer::{Packet, Stack, closest_through};
use super::super::vectors::sub;
use super::buried::cells;
use super::fan::{GROUPS, Receiver};
use super::light_points::LightPoints;
use super::sources::{SOURCES_MAX, SourceLight};
use crate::num::{f32_from_u32, f32_nearest, index, u32_from};

/// A sample side with less than this share of its neighbour's light, and geometry between the two, lies in something that light hardly
/// enters. Under a crate without a bottom it is up to 7 %, what rays find at samples beyond the crate's foot; where a side is missing, 15 %
/// and more.
const DARK_SHARE: f32 = 0.1;

/// How far towards what cuts a sample side off its light is taken: nearer, only the foot of that is seen.
const WAY_SHARE: f32 = 0.9;

/// A sample side that is cut off, and points on the same surface in front of what does, towards each of its bright neighbours.
#[derive(Clone, Debug)]
pub struct CutOff {
    /// The one that is cut off.
    pub sample_side: u32,
    in_front: Vec<Receiver>,
}

/// The light that a sample side is given.
#[derive(Clone, Debug)]
pub struct Relit {
    /// The sample side.
    pub sample_side: u32,
    /// Irradiance by group.
    pub light: [Bands; GROUPS],
    /// What of it the strongest sources send.
    pub by_source: [SourceLight; SOURCES_MAX],
}

/// Finds sample sides that are dark beside a neighbour of their cell, and that geometry cuts off from all such neighbours. `light` is that
/// of each sample side without what comes straight from single sources, whose shadows may be as dark and are traced; a neighbour that is
/// `buried` has the light of another sample side and tells nothing.
pub fn cut_off(scene: &Scene, light: &[f32], buried: &[bool]) -> Vec<CutOff> {
    let mut pairs = Vec::new();
    for triangle in &scene.layout.triangles {
        let sides = scene.layout.samples[index(triangle.samples[0])].sides();
        cells(triangle, |corners| {
            for side in 0..sides {
                let sample_sides = corners.map(|sample| 2 * sample + side);
                let brightest =
                    sample_sides.into_iter().fold(sample_sides[0], |a, b| if light[b] > light[a] { b } else { a });
                let is_dark = |&sample_side: &usize| light[sample_side] < DARK_SHARE * light[brightest];
                if !buried[brightest] {
                    pairs.extend(
                        sample_sides.into_iter().filter(is_dark).map(|dark| (u32_from(dark), u32_from(brightest))),
                    );
                }
            }
        });
    }
    pairs.sort_unstable();
    pairs.dedup();
    let ways = ways(scene, &pairs);
    let pairs: Vec<_> = pairs.into_iter().zip(ways).collect();
    let by_dark = pairs.chunk_by(|((a, _), _), ((b, _), _)| a == b);
    by_dark.filter_map(|own| CutOff::of(scene, own)).collect()
}

impl CutOff {
    /// Of a dark sample side, from its bright neighbours and the share of the way from each that is free; none where one is not cut off.
    fn of(scene: &Scene, pairs: &[((u32, u32), f32)]) -> Option<Self> {
        let in_front = |&((dark, bright), way): &((u32, u32), f32)| {
            let [dark, bright] = [dark, bright].map(|sample_side| {
                (Receiver::of(&scene.layout.samples[index(sample_side) / 2]), index(sample_side) % 2)
            });
            let at_m = |axis: usize| bright.0.at_m[axis] + WAY_SHARE * way * (dark.0.at_m[axis] - bright.0.at_m[axis]);
            (way < 1.0).then(|| Receiver { at_m: [0, 1, 2].map(at_m), normal: bright.0.normal_of(bright.1), sides: 1 })
        };
        Some(Self { sample_side: pairs[0].0.0, in_front: pairs.iter().map(in_front).collect::<Option<_>>()? })
    }

    /// Its light in front of what cuts it off, the mean over those points.
    pub fn relit(&self, scene: &Scene, light_points: &LightPoints, light: [&[Bands]; GROUPS]) -> Relit {
        let mut mean = Relit {
            sample_side: self.sample_side,
            light: [[0.0; BANDS]; GROUPS],
            by_source: [SourceLight::NONE; SOURCES_MAX],
        };
        let share = 1.0 / f32_from_u32(u32_from(self.in_front.len()));
        for receiver in &self.in_front {
            let found = scene.light_at(receiver, light_points, light, 1.0, &[]);
            for (mean, found) in mean.light.iter_mut().zip(&found.by_group) {
                for band in 0..BANDS {
                    mean[band] += share * f32_nearest(found[band]);
                }
            }
            for (mean, found) in mean.by_source.iter_mut().zip(&found.by_source) {
                mean.unoccluded += share * found.unoccluded;
                mean.received += share * found.received;
            }
        }
        mean
    }
}

/// Share of the way from the bright to the dark sample side of each pair, just above their surface, up to what stands there; 1 where
/// nothing does.
fn ways(scene: &Scene, pairs: &[(u32, u32)]) -> Vec<f32> {
    let lifted_m =
        |sample_side: u32| Receiver::of(&scene.layout.samples[index(sample_side) / 2]).lifted_m(index(sample_side) % 2);
    let mut stack = Stack::new();
    let mut ways = Vec::with_capacity(pairs.len());
    for some in pairs.chunks(LANES) {
        let mut packet = Packet::idle();
        for (lane, &(dark, bright)) in some.iter().enumerate() {
            let from_m = lifted_m(bright);
            packet.set_ray(lane, from_m, sub(lifted_m(dark), from_m), 1.0);
        }
        let hits = closest_through(&scene.bvh, &scene.mesh, &packet, &mut stack);
        ways.extend((0..some.len()).map(|lane| hits.t.0[lane].min(1.0)));
    }
    ways
}

#[cfg(test)]
mod tests {
    use super::super::super::light::BANDS;
    use super::super::super::mesh::{Material, Mesh};
    use super::super::super::target::cube;
    use super::super::batch::trace;
    use super::super::refine::traced_samples;
    use super::super::{BakeSettings, STEADY, settled};
    use super::*;

    const LOW_M: [f32; 3] = [-0.33, 0.0, -0.29];
    const HIGH_M: [f32; 3] = [0.37, 0.6, 0.41];

    /// Some faces of a crate on a floor of 6 m, under an even sky.
    fn crate_on_floor(double_sided: bool, is_there: impl Fn(usize) -> bool) -> Scene {
        let mut mesh = Mesh::default();
        mesh.materials.push(Material { double_sided: false, ..Material::plain("floor", [0.5; 3]) });
        mesh.materials.push(Material { double_sided, ..Material::plain("crate", [0.5; 3]) });
        mesh.append_quad(0, [[-3.0, 0.0, 3.0], [3.0, 0.0, 3.0], [3.0, 0.0, -3.0], [-3.0, 0.0, -3.0]], [1.0, 1.0]);
        for (_, corners_m) in cube(LOW_M, HIGH_M, false).into_iter().enumerate().filter(|(face, _)| is_there(*face)) {
            mesh.append_quad(1, corners_m, [1.0, 1.0]);
        }
        Scene::new("crate", mesh, [1.0; BANDS]).unwrap()
    }

    /// Irradiance of the floor 1 cm beside the crate, and of the crate 1 cm above the floor, all around it: as a share of that by 4,096
    /// rays from there.
    fn beside(scene: &Scene) -> [Vec<f64>; 2] {
        let bake = scene.bake(&BakeSettings::ROOM, &|_| {});
        let light_points = LightPoints::new(scene, 16, 4_096);
        let share = |from_m: [f32; 3], direction: [f32; 3]| {
            let hit = trace(scene, &[from_m], &[direction], &[])[0];
            let light = scene.layout.triangles[index(hit.triangle)].around(hit.weights[0], hit.weights[1]);
            let baked: f32 = light.iter().map(|&(sample, weight)| bake.irradiance[2 * sample][1] * weight).sum();
            let at_m = [0, 1, 2].map(|axis| from_m[axis] + hit.t * direction[axis]);
            let receiver = Receiver { at_m, normal: direction.map(|along| -along), sides: 1 };
            f64::from(baked)
                / scene.light_at(&receiver, &light_points, [&bake.irradiance, &[]], 1.0, &[]).by_group[STEADY][1]
        };
        let mut found = [Vec::new(), Vec::new()];
        for (axis, step) in [0, 2].into_iter().flat_map(|axis| (0..20_u32).map(move |step| (axis, step))) {
            let across = 2 - axis;
            let mut at_m = [0.0, 0.01, 0.0];
            at_m[axis] = LOW_M[axis] + (f32_from_u32(step) + 0.5) / 20.0 * (HIGH_M[axis] - LOW_M[axis]);
            for (wall_m, outwards) in [(LOW_M[across], -1.0), (HIGH_M[across], 1.0)] {
                at_m[across] = wall_m + 0.01 * outwards;
                found[0].push(share(at_m, [0.0, -1.0, 0.0]));
                let mut inwards = [0.0; 3];
                inwards[across] = -outwards;
                found[1].push(share(at_m, inwards));
            }
        }
        found
    }

    #[test]
    fn floor_and_crate_are_as_bright_where_they_meet_as_rays_from_there_find() {
        let scenes = [crate_on_floor(true, |face| face != 2), crate_on_floor(false, |_| true)];
        for shares in scenes.iter().flat_map(beside) {
            let mean = shares.iter().sum::<f64>() / 80.0;
            // Between dark and bright samples the floor would have half of its light.
            assert!(shares.len() == 80 && (mean - 1.0).abs() < 0.05, "{mean}");
            shares.iter().for_each(|share| assert!((share - 1.0).abs() < 0.15, "{share}"));
        }
    }

    #[test]
    fn only_sample_sides_that_hardly_any_light_reaches_are_cut_off() {
        // A crate without a bottom; a fence; a shelter of two walls and a roof; crates that lack a side, and a lid.
        let cases: [(fn(usize) -> bool, usize); 5] = [
            (|face| face != 2, 48),
            (|face| face == 0, 0),
            (|face| matches!(face, 0 | 1 | 3), 0),
            (|face| !matches!(face, 2 | 4), 0),
            (|face| !matches!(face, 2 | 3), 0),
        ];
        for (albedo, (is_there, expected)) in [0.5, 0.8].into_iter().flat_map(|albedo| cases.map(|case| (albedo, case)))
        {
            let mut scene = crate_on_floor(true, is_there);
            scene.layout.samples.iter_mut().for_each(|sample| sample.albedo = [albedo; BANDS]);
            let traced = traced_samples(&scene, &BakeSettings::ROOM, &|_| {});
            let light: Vec<f32> = settled(&scene, &traced, &[], 0).iter().map(|light| light[1]).collect();
            let at_m = |sample_side: u32| scene.layout.samples[index(sample_side) / 2].position_m;
            let is_within = |[x, _, z]: [f32; 3]| LOW_M[0] < x && x < HIGH_M[0] && LOW_M[2] < z && z < HIGH_M[2];
            let all = cut_off(&scene, &light, &traced.buried);
            let on_floor = all.iter().filter(|found| at_m(found.sample_side)[1] == 0.0);
            let found = on_floor.inspect(|found| {
                assert!(is_within(at_m(found.sample_side)));
                assert!(found.in_front.iter().all(|receiver| !is_within(receiver.at_m)));
            });
            assert_eq!(found.count(), expected, "albedo {albedo}");
        }
    }
}
