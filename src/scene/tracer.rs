//! Rays against triangles, eight at a time. Enters: packets of rays. Leaves: the nearest hit of each, or whether anything
//! is in the way.
//!
//! Edge functions are Pluecker products relative to the ray's origin: for the two triangles at an edge they are exact
//! negatives, and zero belongs to both, so no ray slips between them; at corners a slack of a few micrometres closes what
//! rounding opens. Boxes are widened by more than their rounding. Of equal
//! distances the triangle of lowest index wins, so the answer is a function of the triangles and the ray alone.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::bvh::{Bvh, DEPTH_MAX, Leaf, Node};
use super::lanes::{F8, LANES, M8, V8, add3, cross3, dot3, splat3, sub3};
use crate::num::index;
use crate::simd::{Kernel, dispatch};

/// Eight rays. A lane whose `t_max` is below its `t_min` is idle.
#[derive(Clone, Copy, Debug)]
pub struct Packet {
    /// Origins in metres.
    pub origin_m: V8,
    /// Directions; distances along them are in units of their length. Corners are closed for lengths up to 1.
    pub direction: V8,
    /// Least distance that counts.
    pub t_min: F8,
    /// Greatest distance that counts.
    pub t_max: F8,
}

/// No triangle.
pub const MISS: u32 = u32::MAX;

/// The nearest hit of each lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hits {
    /// Distance in units of the direction's length; the packet's `t_max` where nothing was hit.
    pub t: F8,
    /// Triangle of the scene, or `MISS`.
    pub triangle: [u32; LANES],
    /// Weight of the second corner.
    pub u: F8,
    /// Weight of the third corner.
    pub v: F8,
}

/// A box grows by this share of its distances: each slab distance carries three roundings (2^-24 each, the reciprocal's
/// included), on both the near and the far side.
const SLAB_GROWTH: f32 = 1.0 + 8.0 * f32::EPSILON;

/// Directions closer to zero than this are moved away from it, so that slabs need no rule for infinities. Over a scene of
/// 10 km the ray bends by 1e-14 m, which is below the rounding of its own coordinates.
const DIRECTION_MIN: f32 = 1e-18;

struct Prepared {
    packet: Packet,
    inverse: V8,
    /// Which axes most of the rays walk downwards; decides the order of children only.
    down: [bool; 3],
}

#[inline(always)]
fn prepare(packet: Packet) -> Prepared {
    let mut inverse = [F8::splat(0.0); 3];
    let mut down = [false; 3];
    for axis in 0..3 {
        for lane in 0..LANES {
            let d = packet.direction[axis].0[lane];
            let away = if d < 0.0 { -DIRECTION_MIN } else { DIRECTION_MIN };
            inverse[axis].0[lane] = 1.0 / if d.abs() < DIRECTION_MIN { away } else { d };
        }
        down[axis] = packet.direction[axis].0[0] < 0.0;
    }
    Prepared { packet, inverse, down }
}

/// Entry distance of each lane, and which lanes enter before their `t_max`.
#[inline(always)]
fn slabs(ray: &Prepared, corners_m: &[[f32; 3]; 2], t_max: F8) -> (F8, M8) {
    let (mut near, mut far) = (ray.packet.t_min, t_max);
    for axis in 0..3 {
        let a = (F8::splat(corners_m[0][axis]) - ray.packet.origin_m[axis]) * ray.inverse[axis];
        let b = (F8::splat(corners_m[1][axis]) - ray.packet.origin_m[axis]) * ray.inverse[axis];
        near = a.lesser(b).greater(near);
        far = a.greater(b).lesser(far);
    }
    (near, near.at_most(far * F8::splat(SLAB_GROWTH)))
}

/// Distances and corner weights of the lanes that meet the triangle within their limits.
#[inline(always)]
fn meet(packet: &Packet, leaf: &Leaf, t_max: F8) -> Option<(M8, F8, F8, F8)> {
    let [a, b, c] = leaf.corners_m.map(|corner| sub3(splat3(corner), packet.origin_m));
    let (ca, ab, bc) = (sub3(c, a), sub3(a, b), sub3(b, c));
    let weight_b = dot3(cross3(add3(c, a), ca), packet.direction);
    let weight_c = dot3(cross3(add3(a, b), ab), packet.direction);
    let weight_a = dot3(cross3(add3(b, c), bc), packet.direction);
    let zero = F8::splat(0.0);
    let least = weight_a.lesser(weight_b).lesser(weight_c);
    let greatest = weight_a.greater(weight_b).greater(weight_c);
    let sum = weight_a + weight_b + weight_c;
    let strictly = zero.at_most(least) | greatest.at_most(zero);
    // Around a corner rounding may put the ray outside every triangle by turns, so each is wider by its slack, unless it is
    // seen so nearly edge-on that the slack would decide where it is met.
    let (slack, minus) = (F8::splat(leaf.slack), F8::splat(-leaf.slack));
    let (broad, minus_broad) = (F8::splat(4.0 * leaf.slack), F8::splat(-4.0 * leaf.slack));
    let loosely = (minus.at_most(least) & broad.at_most(sum)) | (greatest.at_most(slack) & sum.at_most(minus_broad));
    let inside = strictly | loosely;
    if !inside.any() {
        return None;
    }
    let normal = cross3(ab, ca);
    let slope = dot3(normal, packet.direction);
    let height = dot3(normal, a);
    let mut t = zero;
    let mut share = zero;
    for lane in 0..LANES {
        t.0[lane] = height.0[lane] / slope.0[lane];
        share.0[lane] = 1.0 / sum.0[lane];
    }
    // A triangle seen exactly edge-on has slope 0 and gives an infinite or undefined t, which no comparison accepts.
    let within = inside & packet.t_min.at_most(t) & t.at_most(t_max);
    within.any().then_some((within, t, weight_b * share, weight_c * share))
}

/// Which child to walk first: the one that lies nearer along the axis on which the children's centres differ most.
#[inline(always)]
fn near_child(node: &Node, down: &[bool; 3]) -> usize {
    let mut widest = 0.0;
    let mut second_first = false;
    for axis in 0..3 {
        let [left, right] = node.boxes_m.map(|corners_m| corners_m[0][axis] + corners_m[1][axis]);
        let apart = right - left;
        if apart.abs() > widest {
            widest = apart.abs();
            second_first = (apart < 0.0) != down[axis];
        }
    }
    usize::from(second_first)
}

struct Walk<'a, const ANY: bool> {
    bvh: &'a Bvh,
    packet: &'a Packet,
}

impl<const ANY: bool> Kernel for Walk<'_, ANY> {
    type Output = Hits;

    #[inline(always)]
    fn run(self) -> Hits {
        walk::<ANY>(self.bvh, self.packet)
    }
}

#[inline(always)]
fn walk<const ANY: bool>(bvh: &Bvh, packet: &Packet) -> Hits {
    let ray = prepare(*packet);
    let mut hits = Hits { t: packet.t_max, triangle: [MISS; LANES], u: F8::splat(0.0), v: F8::splat(0.0) };
    let mut stack = [(0_u32, 0_u32, packet.t_min); DEPTH_MAX];
    let mut depth = 1;
    while depth > 0 {
        depth -= 1;
        let (first, count, entry) = stack[depth];
        if !entry.at_most(hits.t).any() {
            continue;
        }
        if count > 0 {
            for leaf in &bvh.leaves[index(first)..index(first + count)] {
                take::<ANY>(&ray.packet, leaf, &mut hits);
            }
            continue;
        }
        let node = &bvh.nodes[index(first)];
        let near = near_child(node, &ray.down);
        for child in [1 - near, near] {
            let (entry, enters) = slabs(&ray, &node.boxes_m[child], hits.t);
            if enters.any() {
                // Idle and missing lanes must not keep a subtree alive: their entry lies beyond every limit.
                stack[depth] = (node.first[child], node.count[child], enters.select(entry, F8::splat(f32::MAX)));
                depth += 1;
            }
        }
    }
    hits
}

#[inline(always)]
fn take<const ANY: bool>(packet: &Packet, leaf: &Leaf, hits: &mut Hits) {
    let Some((within, t, u, v)) = meet(packet, leaf, hits.t) else { return };
    let mut lower = [0; LANES];
    for lane in 0..LANES {
        lower[lane] = if leaf.triangle < hits.triangle[lane] { u32::MAX } else { 0 };
    }
    let wins = within & (t.below(hits.t) | (t.equal(hits.t) & M8(lower)));
    // A shadow ray is done with its first hit, so its lane falls idle.
    hits.t = wins.select(if ANY { F8::splat(f32::MIN) } else { t }, hits.t);
    hits.triangle = wins.select_u32([leaf.triangle; LANES], hits.triangle);
    hits.u = wins.select(u, hits.u);
    hits.v = wins.select(v, hits.v);
}

/// The nearest hit of each ray, for kernels that are dispatched themselves.
#[inline(always)]
pub fn closest_inline(bvh: &Bvh, packet: &Packet) -> Hits {
    walk::<false>(bvh, packet)
}

/// The nearest hit of each ray.
pub fn closest(bvh: &Bvh, packet: &Packet) -> Hits {
    dispatch(Walk::<false> { bvh, packet })
}

/// Whether each ray meets anything between its limits.
pub fn blocked(bvh: &Bvh, packet: &Packet) -> [bool; LANES] {
    dispatch(Walk::<true> { bvh, packet }).triangle.map(|triangle| triangle != MISS)
}

#[cfg(test)]
mod tests {
    use super::super::box_room::box_room;
    use super::super::chance::pair;
    use super::*;
    use crate::draw::DrawKey;
    use crate::num::{f32_nearest, f64_from_usize, u64_from};

    /// The slow twin: every ray against every triangle, in the order of the list.
    fn closest_by_trying_all(bvh: &Bvh, packet: &Packet) -> Hits {
        let mut leaves = bvh.leaves.clone();
        leaves.sort_by_key(|leaf| leaf.triangle);
        let nothing = F8::splat(0.0);
        let mut hits = Hits { t: packet.t_max, triangle: [MISS; LANES], u: nothing, v: nothing };
        for leaf in &leaves {
            take::<false>(packet, leaf, &mut hits);
        }
        hits
    }

    fn between(low: f64, high: f64, uniform: f64) -> f32 {
        f32_nearest(low + (high - low) * uniform)
    }

    fn random_packet(key: DrawKey) -> Packet {
        let zero = F8::splat(0.0);
        let mut packet = Packet { origin_m: [zero; 3], direction: [zero; 3], t_min: zero, t_max: F8::splat(f32::MAX) };
        for lane in 0..LANES {
            for axis in 0..3 {
                let [a, b] = pair(key, u64_from(lane * 3 + axis));
                packet.origin_m[axis].0[lane] = between(-1.0, 1.0, a) + if axis == 1 { 1.5 } else { 0.0 };
                packet.direction[axis].0[lane] = between(-1.0, 1.0, b);
            }
        }
        packet
    }

    #[test]
    fn the_tree_finds_what_trying_all_triangles_finds_bit_for_bit() {
        let scene = box_room(3);
        let mut hit = 0;
        for case in 0..500 {
            let mut packet = random_packet(DrawKey::root(11).with(case));
            if case % 3 == 0 {
                // Directions along an axis, and through it exactly: the hard case of slabs.
                packet.direction[usize::try_from(case % 9 / 3).unwrap()] = F8::splat(0.0);
            }
            let fast = closest(&scene.bvh, &packet);
            assert_eq!(fast, closest_by_trying_all(&scene.bvh, &packet), "case {case}");
            let any = blocked(&scene.bvh, &packet);
            for lane in 0..LANES {
                assert_eq!(any[lane], fast.triangle[lane] != MISS, "case {case} lane {lane}");
                hit += usize::from(any[lane]);
            }
        }
        assert!(hit > 3_000, "{hit} hits");
    }

    #[test]
    fn no_ray_leaves_a_closed_room_not_even_at_edges_and_corners() {
        let scene = box_room(3);
        let corners: Vec<[f32; 3]> = scene.mesh.vertices.iter().map(|vertex| vertex.position_m).collect();
        let mut tried = 0;
        for case in 0..4_000_u64 {
            let mut packet = random_packet(DrawKey::root(12).with(case));
            for lane in 0..LANES {
                // At a point of an edge of some face, or (weight 0) exactly at a vertex of the room.
                let number = (index(u32::try_from(case).unwrap()) * LANES + lane) % 24;
                let next = number / 4 * 4 + (number + 1) % 4;
                let weight = if case % 5 == 0 { 0.0 } else { f64_from_usize(lane) / 7.0 };
                let toward: [f32; 3] = std::array::from_fn(|axis| {
                    let at = between(f64::from(corners[number][axis]), f64::from(corners[next][axis]), weight);
                    at - packet.origin_m[axis].0[lane]
                });
                let direction = super::super::mesh::unit(toward).unwrap();
                for axis in 0..3 {
                    packet.direction[axis].0[lane] = direction[axis];
                }
            }
            let hits = closest(&scene.bvh, &packet);
            assert!(!hits.triangle.contains(&MISS), "case {case}: {hits:?}");
            tried += LANES;
        }
        assert_eq!(tried, 32_000);
    }

    #[test]
    fn of_equal_hits_the_lowest_triangle_wins() {
        let wall = [[-1.0, -1.0, 2.0], [1.0, -1.0, 2.0], [0.0, 1.0, 2.0]];
        let bvh = Bvh::build(&[[[5.0, 5.0, 5.0], [6.0, 5.0, 5.0], [5.0, 6.0, 5.0]], wall, wall, wall]);
        let zero = F8::splat(0.0);
        let direction = [zero, zero, F8::splat(1.0)];
        let packet = Packet { origin_m: [zero; 3], direction, t_min: zero, t_max: F8::splat(2.0) };
        assert_eq!(closest(&bvh, &packet).triangle, [1; LANES]);
    }
}
