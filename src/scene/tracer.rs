//! Rays against triangles, sixteen at a time. Enters: packets of rays. Leaves: the nearest hit of each, or whether anything
//! is in the way.
//!
//! Edge functions are Pluecker products relative to the ray's origin: for the two triangles at an edge they are exact
//! negatives, and zero belongs to both, so no ray slips between them; at corners a slack of a few micrometres closes what
//! rounding opens. Boxes are widened by more than their rounding. Of equal
//! distances the triangle of lowest index wins, so the answer is a function of the triangles and the ray alone.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use super::bvh::{Bvh, DEPTH_MAX, Leaf};
use super::lanes::{Floats, LANES, Mask, Vectors, add3, cross3, dot3, splat3, sub3};
use crate::num::index;
use crate::simd::{Kernel, dispatch};

/// Rays that walk together. A lane whose `t_max` is below its `t_min` is idle.
#[derive(Clone, Copy, Debug)]
pub struct Packet {
    /// Origins in metres.
    pub origin_m: Vectors,
    /// Directions; distances along them are in units of their length. Corners are closed for lengths up to 1.
    pub direction: Vectors,
    /// Least distance that counts.
    pub t_min: Floats,
    /// Greatest distance that counts.
    pub t_max: Floats,
}

/// Where cut-out triangles let rays through. It is asked only about triangles that the tree was told are cut out, and only about points
/// that would otherwise be hits; its answer must depend on its arguments alone.
pub trait Holes {
    /// Whether a ray passes the triangle at these weights of its second and third corner.
    fn is_open(&self, triangle: u32, u: f32, v: f32) -> bool;
}

/// Every triangle is whole.
#[derive(Clone, Copy, Debug)]
pub struct NoHoles;

impl Holes for NoHoles {
    #[inline(always)]
    fn is_open(&self, _: u32, _: f32, _: f32) -> bool {
        false
    }
}

/// No triangle.
pub const MISS: u32 = u32::MAX;

/// The nearest hit of each lane.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hits {
    /// Distance in units of the direction's length; the packet's `t_max` where nothing was hit.
    pub t: Floats,
    /// Triangle of the scene, or `MISS`.
    pub triangle: [u32; LANES],
    /// Weight of the second corner.
    pub u: Floats,
    /// Weight of the third corner.
    pub v: Floats,
}

/// A box grows by this share of its distances: each slab distance carries three roundings (2^-24 each, the reciprocal's
/// included), on both the near and the far side.
const SLAB_GROWTH: f32 = 1.0 + 8.0 * f32::EPSILON;

/// Directions closer to zero than this are moved away from it, so that slabs need no rule for infinities. Over a scene of
/// 10 km the ray bends by 1e-14 m, which is below the rounding of its own coordinates.
const DIRECTION_MIN: f32 = 1e-18;

struct Prepared {
    packet: Packet,
    inverse: Vectors,
    /// Which axes the first ray walks downwards; decides the order of children.
    down: [bool; 3],
    /// Whether all rays do as the first one.
    alike: bool,
}

#[inline(always)]
fn prepare(packet: Packet) -> Prepared {
    let mut inverse = [Floats::splat(0.0); 3];
    let mut down = [false; 3];
    let mut differing = 0;
    for axis in 0..3 {
        for lane in 0..LANES {
            let d = packet.direction[axis].0[lane];
            let away = if d < 0.0 { -DIRECTION_MIN } else { DIRECTION_MIN };
            inverse[axis].0[lane] = 1.0 / if d.abs() < DIRECTION_MIN { away } else { d };
        }
        down[axis] = packet.direction[axis].0[0] < 0.0;
        for lane in 0..LANES {
            differing |= u32::from((packet.direction[axis].0[lane] < 0.0) != down[axis]);
        }
    }
    Prepared { packet, inverse, down, alike: differing == 0 }
}

/// Entry distance of each lane, and which lanes enter before their `t_max`. Where all rays walk an axis the same way the nearer
/// plane is known beforehand; rounding is monotone, so both ways give the same distances.
#[inline(always)]
fn slabs<const ALIKE: bool>(ray: &Prepared, corners_m: &[[f32; 3]; 2], t_max: Floats) -> (Floats, Mask) {
    let (mut near, mut far) = (ray.packet.t_min, t_max);
    for axis in 0..3 {
        let down = ALIKE && ray.down[axis];
        let (first, second) = (corners_m[usize::from(down)][axis], corners_m[usize::from(!down)][axis]);
        let a = (Floats::splat(first) - ray.packet.origin_m[axis]) * ray.inverse[axis];
        let b = (Floats::splat(second) - ray.packet.origin_m[axis]) * ray.inverse[axis];
        if ALIKE {
            near = a.greater(near);
            far = b.lesser(far);
        } else {
            near = a.lesser(b).greater(near);
            far = a.greater(b).lesser(far);
        }
    }
    (near, near.at_most(far * Floats::splat(SLAB_GROWTH)))
}

/// Edges of a triangle: from the first corner to the third, from the second to the first, from the third to the second. The
/// neighbour at an edge has its exact negative.
#[inline(always)]
fn edges(leaf: &Leaf) -> [[f32; 3]; 3] {
    let [a, b, c] = leaf.corners_m;
    [difference(c, a), difference(a, b), difference(b, c)]
}

#[inline(always)]
fn difference(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

#[inline(always)]
fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Distances and corner weights of the lanes that meet the triangle within their limits.
#[inline(always)]
fn meet(packet: &Packet, leaf: &Leaf, t_max: Floats) -> Option<(Mask, Floats, Floats, Floats)> {
    let [ca, ab, bc] = edges(leaf);
    let [a, b, c] = leaf.corners_m.map(|corner| sub3(splat3(corner), packet.origin_m));
    let weight_b = dot3(cross3(add3(c, a), splat3(ca)), packet.direction);
    let weight_c = dot3(cross3(add3(a, b), splat3(ab)), packet.direction);
    let weight_a = dot3(cross3(add3(b, c), splat3(bc)), packet.direction);
    let zero = Floats::splat(0.0);
    let least = weight_a.lesser(weight_b).lesser(weight_c);
    let greatest = weight_a.greater(weight_b).greater(weight_c);
    let sum = weight_a + weight_b + weight_c;
    let strictly = zero.at_most(least) | greatest.at_most(zero);
    // Around a corner rounding may put the ray outside every triangle by turns, so each is wider by its slack, unless it is
    // seen so nearly edge-on that the slack would decide where it is met.
    let (slack, minus) = (Floats::splat(leaf.slack), Floats::splat(-leaf.slack));
    let (broad, minus_broad) = (Floats::splat(4.0 * leaf.slack), Floats::splat(-4.0 * leaf.slack));
    let loosely = (minus.at_most(least) & broad.at_most(sum)) | (greatest.at_most(slack) & sum.at_most(minus_broad));
    let inside = strictly | loosely;
    if !inside.any() {
        return None;
    }
    let normal = splat3(cross(ab, ca));
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

/// What is still to be walked. One serves many packets, because clearing it costs more than a short walk.
pub struct Stack {
    /// First node or triangle, count of triangles.
    places: [(u32, u32); DEPTH_MAX],
    /// Where each ray enters.
    entries: [Floats; DEPTH_MAX],
}

impl Stack {
    /// An empty one.
    #[inline(always)]
    pub fn new() -> Self {
        Self { places: [(0, 0); DEPTH_MAX], entries: [Floats::splat(0.0); DEPTH_MAX] }
    }
}

impl Default for Stack {
    fn default() -> Self {
        Self::new()
    }
}

struct Walk<'a, H, const ANY: bool> {
    bvh: &'a Bvh,
    holes: &'a H,
    packet: &'a Packet,
    stack: &'a mut Stack,
}

impl<H: Holes, const ANY: bool> Kernel for Walk<'_, H, ANY> {
    type Output = Hits;

    #[inline(always)]
    fn run(self) -> Hits {
        walk::<H, ANY>(self.bvh, self.holes, self.packet, self.stack)
    }
}

#[inline(always)]
fn walk<H: Holes, const ANY: bool>(bvh: &Bvh, holes: &H, packet: &Packet, stack: &mut Stack) -> Hits {
    let ray = prepare(*packet);
    let mut hits = Hits { t: packet.t_max, triangle: [MISS; LANES], u: Floats::splat(0.0), v: Floats::splat(0.0) };
    if ray.alike {
        walk_down::<H, ANY, true>(bvh, holes, &ray, stack, &mut hits);
    } else {
        walk_down::<H, ANY, false>(bvh, holes, &ray, stack, &mut hits);
    }
    hits
}

#[inline(always)]
fn walk_down<H: Holes, const ANY: bool, const ALIKE: bool>(
    bvh: &Bvh,
    holes: &H,
    ray: &Prepared,
    stack: &mut Stack,
    hits: &mut Hits,
) {
    let mut depth = 0;
    let (mut first, mut count) = (0_u32, 0_u32);
    loop {
        if count == 0 {
            let node = &bvh.nodes[index(first)];
            let near = usize::from(ray.down[index(node.axis)]);
            let far = 1 - near;
            let (_, near_enters) = slabs::<ALIKE>(ray, &node.boxes_m[near], hits.t);
            let (far_entry, far_enters) = slabs::<ALIKE>(ray, &node.boxes_m[far], hits.t);
            let far_place = (node.first[far], node.count[far]);
            match (near_enters.any(), far_enters.any()) {
                (true, true) => {
                    // Idle and missing lanes must not keep a subtree alive: their entry lies beyond every limit.
                    stack.places[depth] = far_place;
                    stack.entries[depth] = far_enters.select(far_entry, Floats::splat(f32::MAX));
                    depth += 1;
                    (first, count) = (node.first[near], node.count[near]);
                    continue;
                }
                (true, false) => {
                    (first, count) = (node.first[near], node.count[near]);
                    continue;
                }
                (false, true) => {
                    (first, count) = far_place;
                    continue;
                }
                (false, false) => {}
            }
        } else {
            for leaf in &bvh.leaves[index(first)..index(first + count)] {
                take::<H, ANY>(&ray.packet, holes, leaf, hits);
            }
        }
        loop {
            if depth == 0 {
                return;
            }
            depth -= 1;
            if stack.entries[depth].at_most(hits.t).any() {
                break;
            }
        }
        (first, count) = stack.places[depth];
    }
}

#[inline(always)]
fn take<H: Holes, const ANY: bool>(packet: &Packet, holes: &H, leaf: &Leaf, hits: &mut Hits) {
    let Some((within, t, u, v)) = meet(packet, leaf, hits.t) else { return };
    let mut lower = [0; LANES];
    for lane in 0..LANES {
        lower[lane] = if leaf.triangle < hits.triangle[lane] { u32::MAX } else { 0 };
    }
    let mut wins = within & (t.below(hits.t) | (t.equal(hits.t) & Mask(lower)));
    if leaf.cut_out {
        wins = solid(holes, leaf.triangle, wins, &u, &v);
    }
    // A shadow ray is done with its first hit, so its lane falls idle.
    hits.t = wins.select(if ANY { Floats::splat(f32::MIN) } else { t }, hits.t);
    hits.triangle = wins.select_u32([leaf.triangle; LANES], hits.triangle);
    hits.u = wins.select(u, hits.u);
    hits.v = wins.select(v, hits.v);
}

/// The lanes among these that do not pass through a hole.
#[inline(never)]
fn solid<H: Holes>(holes: &H, triangle: u32, mut wins: Mask, u: &Floats, v: &Floats) -> Mask {
    for lane in 0..LANES {
        if wins.0[lane] != 0 && holes.is_open(triangle, u.0[lane], v.0[lane]) {
            wins.0[lane] = 0;
        }
    }
    wins
}

/// The nearest hit of each ray, for kernels that are dispatched themselves.
#[inline(always)]
pub fn closest_inline(bvh: &Bvh, packet: &Packet, stack: &mut Stack) -> Hits {
    closest_inline_through(bvh, &NoHoles, packet, stack)
}

/// The nearest hit of each ray that is no hole, for kernels that are dispatched themselves.
#[inline(always)]
pub fn closest_inline_through<H: Holes>(bvh: &Bvh, holes: &H, packet: &Packet, stack: &mut Stack) -> Hits {
    walk::<H, false>(bvh, holes, packet, stack)
}

/// The nearest hit of each ray.
pub fn closest(bvh: &Bvh, packet: &Packet, stack: &mut Stack) -> Hits {
    closest_through(bvh, &NoHoles, packet, stack)
}

/// The nearest hit of each ray that is no hole.
pub fn closest_through<H: Holes>(bvh: &Bvh, holes: &H, packet: &Packet, stack: &mut Stack) -> Hits {
    dispatch(Walk::<H, false> { bvh, holes, packet, stack })
}

/// Whether each ray meets anything between its limits.
pub fn blocked(bvh: &Bvh, packet: &Packet, stack: &mut Stack) -> [bool; LANES] {
    blocked_through(bvh, &NoHoles, packet, stack)
}

/// Whether each ray meets anything that is no hole between its limits.
pub fn blocked_through<H: Holes>(bvh: &Bvh, holes: &H, packet: &Packet, stack: &mut Stack) -> [bool; LANES] {
    dispatch(Walk::<H, true> { bvh, holes, packet, stack }).triangle.map(|triangle| triangle != MISS)
}

#[cfg(test)]
mod tests;
