//! Hidden samples: places inside closed geometry. Replaces the light of each such sample with that of a visible sample.
//!
//! Without this the floor is darker around everything that stands on it, as far as the next sample. The backs of one-sided surfaces are
//! never seen, so a place that meets them is hidden. Backs of two-sided surfaces, and things a few millimetres above, may be seen: a place
//! that meets hardly anything else is hidden if something stands between it and all its neighbours in the open, and these are lit more.

use super::super::geometry::Scene;
use super::super::light::luminance;
use super::super::samples::{Layout, ShadeTriangle};
use super::super::tracer::{Stack, blocked_through};
use super::super::vectors::sub;
use super::fan::{GROUPS, LIFT_M, idle, set_ray};
use super::rays::{Burial, CLOSE_M};
use super::refine::TracedSamples;
use crate::num::{f32_from_u32, index, u32_from};

/// A place is hidden if its direct light is at most this share of its neighbour's: half of it arrives at a place right
/// under the edge of a box.
const LIGHT_SHARE_MAX: f64 = 0.75;
/// What stands this near to a place, in distances to its neighbour, stands right there.
const AT_PLACE: f32 = 1.0 / 64.0;

/// Pairs of each hidden place and a neighbour in the open. A place is twice a sample plus its side.
pub fn stand_ins(scene: &Scene, traced: &TracedSamples) -> Vec<(u32, u32)> {
    let burial = &traced.burial;
    let mut lux = vec![0.0; burial.len()];
    for group in 0..GROUPS {
        let direct = traced.direct(group, burial.len());
        lux.iter_mut().zip(&direct).for_each(|(lux, light)| *lux += luminance(light.map(f64::from)));
    }
    let (mut is_walled_off, mut is_seen) = (vec![false; burial.len()], vec![false; burial.len()]);
    let mut stack = Stack::new();
    for triangle in &scene.layout.triangles {
        cells(triangle, |corners| {
            for side in 0..2 {
                let places = corners.map(|sample| 2 * sample + side);
                let are = |wanted: Burial| places.into_iter().filter(move |&place| burial[place] == wanted);
                let of_shells = || are(Burial::Within).chain(are(Burial::Beside));
                for (open, place) in are(Burial::Open).flat_map(|open| of_shells().map(move |place| (open, place))) {
                    let is_darker = lux[place] <= LIGHT_SHARE_MAX * lux[open];
                    let is_beside = burial[place] == Burial::Beside;
                    if is_darker && is_between(scene, [open, place], is_beside, &mut stack) {
                        is_walled_off[place] = true;
                    } else {
                        is_seen[place] = true;
                    }
                }
            }
        });
    }
    let is_hidden = |place: usize| burial[place] == Burial::Buried || is_walled_off[place] && !is_seen[place];
    open_neighbours(&scene.layout, is_hidden)
}

/// Pairs of a hidden place and a neighbour that is not. The first cell in the order of the triangles decides.
pub fn open_neighbours(layout: &Layout, is_hidden: impl Fn(usize) -> bool) -> Vec<(u32, u32)> {
    let mut found: Vec<Option<u32>> = vec![None; 2 * layout.samples.len()];
    for triangle in &layout.triangles {
        cells(triangle, |corners| {
            for side in 0..2 {
                let places = corners.map(|sample| 2 * sample + side);
                let Some(open) = places.into_iter().find(|&place| !is_hidden(place)) else { continue };
                for place in places.into_iter().filter(|&place| is_hidden(place)) {
                    found[place].get_or_insert(u32_from(open));
                }
            }
        });
    }
    let pairs = found.into_iter().enumerate();
    pairs.filter_map(|(place, open)| Some((u32_from(place), open?))).collect()
}

/// Whether something stands on the surface, or hangs closely above it, between two places on one side of it: only right at the second one,
/// or anywhere up to it.
fn is_between(scene: &Scene, places: [usize; 2], only_there: bool, stack: &mut Stack) -> bool {
    let mut packet = idle();
    let ends = [1.0 + AT_PLACE, if only_there { 1.0 - AT_PLACE } else { -1.0 }];
    for (lane, (lift_m, t_max)) in
        [(LIFT_M, ends[0]), (CLOSE_M, ends[0]), (LIFT_M, ends[1]), (CLOSE_M, ends[1])].into_iter().enumerate()
    {
        let [from, to] = places.map(|place| {
            let sample = &scene.layout.samples[place / 2];
            let lift_m = if place % 2 == 0 { lift_m } else { -lift_m };
            [0, 1, 2].map(|axis| sample.position_m[axis] + lift_m * sample.normal[axis])
        });
        set_ray(&mut packet, lane, from, sub(to, from), t_max);
    }
    let [low, high, low_before, high_before, ..] = blocked_through(&scene.bvh, &scene.mesh, &packet, stack);
    (low || high) && !low_before && !high_before
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
    use super::super::BakeSettings;
    use super::*;

    /// A floor under an even sky with a box on it that begins so high and has so many of its sides, the lowest one last.
    fn standing(from_m: f32, sides: usize, double_sided: bool) -> Scene {
        let mut mesh = Mesh::default();
        mesh.materials.push(Material { double_sided, ..Material::plain("white", [0.5; 3]) });
        mesh.append_quad(0, [[-1.5, 0.0, 1.5], [1.5, 0.0, 1.5], [1.5, 0.0, -1.5], [-1.5, 0.0, -1.5]], [1.0, 1.0]);
        let mut faces: Vec<_> = cube([-0.23, from_m, -0.31], [0.2, from_m + 0.5, 0.28], false).into_iter().collect();
        faces.sort_by_key(|corners_m| corners_m.iter().all(|corner| corner[1] == from_m));
        for corners_m in faces.into_iter().take(sides) {
            mesh.append_quad(0, corners_m, [1.0, 1.0]);
        }
        Scene::new("standing", mesh, [1.0; BANDS]).unwrap()
    }

    /// Light of the floor's upper side at places within 6 cm of the box.
    fn beside(scene: &Scene) -> Vec<f32> {
        let bake = scene.bake(&BakeSettings::ROOM, &|_| {});
        let at = |[x_m, z_m]: [f32; 2]| {
            // Halves of the floor, from the corner at (-1.5, 1.5).
            let [x, z] = [(x_m + 1.5) / 3.0, (1.5 - z_m) / 3.0];
            let (triangle, u, v) = if x >= z { (0, x - z, z) } else { (1, x, z - x) };
            let around = scene.layout.triangles[triangle].around(u, v);
            around.iter().fold(0.0, |sum, &(sample, weight)| sum + weight * bake.irradiance[2 * sample][1])
        };
        let mut light = Vec::new();
        for step in 0..24 {
            let along_m = -0.3 + 0.025 * f32_from_u32(step);
            let places = [[0.205, along_m], [0.25, along_m], [-0.235, along_m], [along_m, 0.285], [along_m, -0.35]];
            light.extend(places.map(at));
        }
        light
    }

    #[test]
    fn a_floor_is_no_darker_beside_two_sided_boxes() {
        let expected = beside(&standing(0.0, 6, false));
        let mut tried = 0;
        // Without its lower side, with it, a little above the floor and in it.
        for (from_m, sides) in [(0.0, 5), (0.0, 6), (0.003, 6), (-0.02, 6)] {
            let found = beside(&standing(from_m, sides, true));
            for (at, (found, expected)) in found.iter().zip(&expected).enumerate() {
                // Without all this it is 29 % darker. Through a gap of 3 mm light comes and goes, up to 3 % of it.
                let error = (found / expected - 1.0).abs();
                assert!(error < 0.03, "{from_m} m, {sides} sides, place {at}: {found} {expected}");
                tried += 1;
            }
        }
        assert_eq!(tried, 480);
    }
}
