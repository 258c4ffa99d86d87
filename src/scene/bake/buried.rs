//! Hidden samples: places inside closed geometry. Replaces the light of each such sample with that of a visible sample.
//!
//! Without this the floor is darker around everything that stands on it, as far as the next sample.

#![allow(clippy::needless_range_loop, reason = "lanes of several arrays run in step")]

use super::super::geometry::Scene;
use super::super::lanes::LANES;
use super::super::samples::{Layout, ShadeTriangle};
use super::super::tracer::{Stack, blocked_through};
use super::super::vectors::sub;
use super::fan::{Place, idle, set_ray};
use crate::num::{f32_from_u32, index, u32_from};

/// A place with less than this share of its neighbour's light, and geometry between the two, lies in something that light hardly
/// enters. Under a crate without a bottom it is up to 7 %, what rays find at samples beyond the crate's foot; where a side is missing, 15 %
/// and more.
const SHUT_OFF_SHARE: f32 = 0.1;

/// Pairs of a buried place and its neighbour in the open. A place is twice a sample plus its side.
pub fn stand_ins(layout: &Layout, is_buried: impl Fn(usize) -> bool) -> Vec<(u32, u32)> {
    let mut found: Vec<Option<u32>> = vec![None; 2 * layout.samples.len()];
    for triangle in &layout.triangles {
        cells(triangle, |corners| {
            for side in 0..2 {
                let places = corners.map(|sample| 2 * sample + side);
                let Some(open) = places.into_iter().find(|&place| !is_buried(place)) else { continue };
                for place in places.into_iter().filter(|&place| is_buried(place)) {
                    // The first cell in the order of the triangles decides.
                    found[place].get_or_insert(u32_from(open));
                }
            }
        });
    }
    let pairs = found.into_iter().enumerate();
    pairs.filter_map(|(place, open)| Some((u32_from(place), open?))).collect()
}

/// Pairs of a dark place and a bright neighbour of its cell, for places that geometry cuts off from all their bright neighbours: the
/// floor in a crate of two-sided material without a bottom. `light` is that of each place without what comes straight from single
/// sources, whose shadows may be as dark and are traced.
pub fn shut_off(scene: &Scene, light: &[f32]) -> Vec<(u32, u32)> {
    let mut pairs = Vec::new();
    for triangle in &scene.layout.triangles {
        let sides = scene.layout.samples[index(triangle.samples[0])].sides();
        cells(triangle, |corners| {
            for side in 0..sides {
                let places = corners.map(|sample| 2 * sample + side);
                let brightest = places.into_iter().fold(places[0], |a, b| if light[b] > light[a] { b } else { a });
                let is_dark = |&place: &usize| light[place] < SHUT_OFF_SHARE * light[brightest];
                pairs.extend(places.into_iter().filter(is_dark).map(|place| (u32_from(place), u32_from(brightest))));
            }
        });
    }
    pairs.sort_unstable();
    pairs.dedup();
    let is_blocked = blocked(scene, &pairs);
    let checked: Vec<_> = pairs.into_iter().zip(is_blocked).collect();
    let by_dark = checked.chunk_by(|((a, _), _), ((b, _), _)| a == b);
    by_dark.filter(|own| own.iter().all(|&(_, is_blocked)| is_blocked)).map(|own| own[0].0).collect()
}

/// Whether anything stands between the two places of each pair, just above their surface.
fn blocked(scene: &Scene, pairs: &[(u32, u32)]) -> Vec<bool> {
    let lifted_m = |place: u32| {
        let (sample, side) = (index(place) / 2, index(place) % 2);
        Place::of(&scene.layout.samples[sample]).lifted_m(side)
    };
    let mut stack = Stack::new();
    let mut blocked = Vec::with_capacity(pairs.len());
    for some in pairs.chunks(LANES) {
        let mut packet = idle();
        for (lane, &(dark, bright)) in some.iter().enumerate() {
            let from_m = lifted_m(dark);
            set_ray(&mut packet, lane, from_m, sub(lifted_m(bright), from_m), 1.0);
        }
        blocked.extend_from_slice(&blocked_through(&scene.bvh, &scene.mesh, &packet, &mut stack)[..some.len()]);
    }
    blocked
}

/// The samples that points of a triangle are interpolated between, cell by cell.
pub(super) fn cells(triangle: &ShadeTriangle, mut each: impl FnMut([usize; 3])) {
    if triangle.grid_steps == 0 {
        return each(triangle.samples.map(index));
    }
    let steps = f32_from_u32(triangle.grid_steps);
    for row in 0..triangle.grid_steps {
        for column in 0..(triangle.grid_steps - row) {
            // A point in the middle of each of a cell's two triangles.
            for share in [0.25, 0.75] {
                if share > 0.5 && column + row + 2 > triangle.grid_steps {
                    continue;
                }
                let [u, v] = [column, row].map(|at| (f32_from_u32(at) + share) / steps);
                each(triangle.around(u, v).map(|(sample, _)| sample));
            }
        }
    }
}

/// Gives each buried place the light of its neighbour.
pub fn fill<T: Copy>(light: &mut [T], stand_ins: &[(u32, u32)]) {
    for &(buried, open) in stand_ins {
        light[index(buried)] = light[index(open)];
    }
}

#[cfg(test)]
mod tests {
    use super::super::super::light::BANDS;
    use super::super::super::mesh::{Material, Mesh};
    use super::super::super::target::cube;
    use super::super::batch::trace;
    use super::super::refine::traced_samples;
    use super::super::{BakeSettings, settled};
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

    /// Irradiance of the floor 1 cm beside the crate, and of the crate 1 cm above the floor, all around it.
    fn beside(scene: &Scene) -> [Vec<f32>; 2] {
        let bake = scene.bake(&BakeSettings::ROOM, &|_| {});
        let seen = |from_m: [f32; 3], direction: [f32; 3]| -> f32 {
            let hit = trace(scene, &[from_m], &[direction], &[])[0];
            let light = scene.layout.triangles[index(hit.triangle)].around(hit.weights[0], hit.weights[1]);
            light.iter().map(|&(sample, weight)| bake.irradiance[2 * sample][1] * weight).sum()
        };
        let mut found = [Vec::new(), Vec::new()];
        for (axis, step) in [0, 2].into_iter().flat_map(|axis| (0..20_u32).map(move |step| (axis, step))) {
            let across = 2 - axis;
            let mut at_m = [0.0, 0.01, 0.0];
            at_m[axis] = LOW_M[axis] + (f32_from_u32(step) + 0.5) / 20.0 * (HIGH_M[axis] - LOW_M[axis]);
            for (wall_m, outwards) in [(LOW_M[across], -1.0), (HIGH_M[across], 1.0)] {
                at_m[across] = wall_m + 0.01 * outwards;
                found[0].push(seen(at_m, [0.0, -1.0, 0.0]));
                let mut inwards = [0.0; 3];
                inwards[across] = -outwards;
                found[1].push(seen(at_m, inwards));
            }
        }
        found
    }

    #[test]
    fn floor_and_crate_are_as_bright_where_they_meet_without_a_bottom_as_with_one() {
        let open = beside(&crate_on_floor(true, |face| face != 2));
        let closed = beside(&crate_on_floor(false, |_| true));
        for (open, closed) in open.iter().zip(&closed) {
            let mut sum = 0.0;
            // On the floor both take a sample's light for that of a place up to a step of 8 cm nearer to the wall; which sample differs.
            // Between dark and bright samples the floor would have half of its light.
            for (open, closed) in open.iter().zip(closed) {
                assert!((open / closed - 1.0).abs() < 0.1, "{open} {closed}");
                sum += open / closed;
            }
            assert!(open.len() == 80 && (sum / 80.0 - 1.0).abs() < 0.02, "{}", sum / 80.0);
        }
    }

    #[test]
    fn only_places_that_hardly_any_light_reaches_are_shut_off() {
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
            let at_m = |place: u32| scene.layout.samples[index(place) / 2].position_m;
            let is_within = |[x, _, z]: [f32; 3]| LOW_M[0] < x && x < HIGH_M[0] && LOW_M[2] < z && z < HIGH_M[2];
            let pairs = shut_off(&scene, &light);
            let on_floor = pairs.iter().filter(|(dark, _)| at_m(*dark)[1] == 0.0);
            let found =
                on_floor.inspect(|(dark, open)| assert!(is_within(at_m(*dark)) && !is_within(at_m(*open)))).count();
            assert_eq!(found, expected, "albedo {albedo}");
        }
    }
}
