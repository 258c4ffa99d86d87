//! Traces the rays of neighbouring receivers together, in order of direction: a packet whose rays go the same way traverses the tree once.
//! What a ray meets depends on the ray alone, so the order changes no bit.

use super::super::geometry::Scene;
use super::super::lanes::LANES;
use super::super::tracer::{Hits, MISS, Packet, Stack, closest_through};
use super::blockers::{Blocker, nearest};
use crate::num::{index, u32_from};

/// What a ray met.
#[derive(Clone, Copy, Debug)]
pub struct Hit {
    /// Distance in lengths of the direction.
    pub t: f32,
    /// Triangle of the scene, or `MISS`.
    pub triangle: u32,
    /// Weights of the second and third corner.
    pub weights: [f32; 2],
    /// Whether a moving object is nearer.
    pub is_blocked: bool,
}

impl Hit {
    const NONE: Self = Self { t: f32::MAX, triangle: MISS, weights: [0.0; 2], is_blocked: false };

    /// Of one lane.
    pub fn of(hits: &Hits, lane: usize) -> Self {
        let weights = [hits.u.0[lane], hits.v.0[lane]];
        Self { t: hits.t.0[lane], triangle: hits.triangle[lane], weights, is_blocked: false }
    }
}

/// What each ray met, in the order of the directions; ray `r` starts at origin `r % origins_m.len()`.
pub fn trace(scene: &Scene, origins_m: &[[f32; 3]], directions: &[[f32; 3]], blockers: &[Blocker]) -> Vec<Hit> {
    let mut hits = vec![Hit::NONE; directions.len()];
    let mut stack = Stack::new();
    for rays in by_direction(directions).chunks(LANES) {
        let mut packet = Packet::idle();
        for (lane, ray) in rays.iter().map(|&ray| index(ray)).enumerate() {
            packet.set_ray(lane, origins_m[ray % origins_m.len()], directions[ray], f32::MAX);
        }
        let found = closest_through(&scene.bvh, &scene.mesh, &packet, &mut stack);
        let nearest = nearest(blockers, &Packet { t_max: found.t, ..packet }, &mut stack);
        for (lane, &ray) in rays.iter().enumerate() {
            let is_blocked = nearest.0[lane] < found.t.0[lane];
            hits[index(ray)] = Hit { is_blocked, ..Hit::of(&found, lane) };
        }
    }
    hits
}

/// Cells that directions are sorted by: signs, the longest axis, and whether each other component is over half of that.
const CELLS: usize = 8 * 3 * 4;

fn cell([x, y, z]: [f32; 3]) -> usize {
    let signs = usize::from(x < 0.0) | usize::from(y < 0.0) << 1 | usize::from(z < 0.0) << 2;
    let (wide, high, deep) = (x.abs(), y.abs(), z.abs());
    let (axis, longest, others) = if wide >= high && wide >= deep {
        (0, wide, [high, deep])
    } else if high >= deep {
        (1, high, [deep, wide])
    } else {
        (2, deep, [wide, high])
    };
    let [first, second] = others.map(|component| usize::from(2.0 * component > longest));
    (signs * 3 + axis) * 4 + 2 * first + second
}

/// Numbers of the directions sorted by cell; within a cell they keep their order (a counting sort).
fn by_direction(directions: &[[f32; 3]]) -> Vec<u32> {
    let cells: Vec<usize> = directions.iter().map(|&direction| cell(direction)).collect();
    let mut starts = [0; CELLS + 1];
    cells.iter().for_each(|&cell| starts[cell + 1] += 1);
    for cell in 0..CELLS {
        starts[cell + 1] += starts[cell];
    }
    let mut sorted = vec![0; directions.len()];
    for (ray, cell) in (0..).zip(cells) {
        sorted[starts[cell]] = u32_from(ray);
        starts[cell] += 1;
    }
    sorted
}

#[cfg(test)]
mod tests {
    use super::super::super::box_room::box_room;
    use super::super::super::chance::pair;
    use super::*;
    use crate::draw::DrawKey;
    use crate::num::{f32_nearest, u64_from};

    #[test]
    fn a_ray_meets_the_same_in_a_batch_and_alone() {
        let scene = box_room(3);
        let number = |ray: usize, axis: usize| {
            let [a, _] = pair(DrawKey::root(31).with(u64_from(ray)), u64_from(axis));
            f32_nearest(2.0 * a - 1.0)
        };
        // Three origins by 50 directions, some of them along an axis.
        let origins_m: Vec<[f32; 3]> =
            (0..3).map(|origin| [number(origin, 3), 1.5 + 0.5 * number(origin, 4), number(origin, 5)]).collect();
        let direction = |ray: usize| {
            let mut direction = [0, 1, 2].map(|axis| number(ray, axis));
            if ray.is_multiple_of(7) {
                direction[ray % 3] = 0.0;
            }
            direction
        };
        let directions: Vec<[f32; 3]> = (0..150).map(direction).collect();
        let mut sorted = by_direction(&directions);
        let cells: Vec<usize> = sorted.iter().map(|&ray| cell(directions[index(ray)])).collect();
        assert!(cells.is_sorted() && cells[0] < cells[149]);
        let hits = trace(&scene, &origins_m, &directions, &[]);
        for ray in 0..150 {
            let alone = trace(&scene, &[origins_m[ray % 3]], &[directions[ray]], &[])[0];
            let bits = |hit: &Hit| (hit.t.to_bits(), hit.triangle, hit.weights.map(f32::to_bits), hit.is_blocked);
            assert_eq!(bits(&hits[ray]), bits(&alone), "ray {ray}");
            assert!(alone.triangle != MISS, "the room is closed");
        }
        sorted.sort_unstable();
        assert!(sorted.into_iter().eq(0..150), "each ray once");
    }
}
