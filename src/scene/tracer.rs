//! Intersects rays with triangles, sixteen at a time: the nearest hit of each ray, or whether anything is in the way.
//!
//! The edge functions are those of Woop, Benthin and Wald, "Watertight Ray/Triangle Intersection" (JCGT 2013): corners are sheared into the
//! plane across the ray, each alone, so neighbours see the same corners; there an edge function's sign is never wrong, only zero, and
//! zero belongs to both sides. Boxes are padded by more than the shear's rounding, and a hit lies within its triangle's box as the
//! ray's own slabs see it, so the traversal may skip whatever they rule out. Of equal distances the triangle of lowest index wins.
//! So a hit is a function of the triangles and the ray alone: other rays of the packet, the order and the tree do not change it.

mod block;
mod packet;
mod rays;

use super::bvh::{Bvh, IS_BLOCK, Node, OPEN_MAX};
use super::lanes::{Eight, Floats, LANES, Mask};
use crate::num::index;
use crate::simd::{Kernel, dispatch};
use block::Search;
pub use packet::{Hits, Holes, MISS, NoHoles, Packet, come_near};
use rays::{Courses, Rays};

/// Nodes still to be traversed. One stack serves many packets, because clearing it costs more than a short traversal.
pub struct Stack {
    /// Children by node and slot.
    children: [u32; OPEN_MAX],
    /// No ray enters before this.
    entries: [f32; OPEN_MAX],
}

impl Stack {
    /// An empty one.
    #[inline(always)]
    pub fn new() -> Self {
        Self { children: [0; OPEN_MAX], entries: [0.0; OPEN_MAX] }
    }
}

impl Default for Stack {
    fn default() -> Self {
        Self::new()
    }
}

struct Walk<'a> {
    bvh: &'a Bvh,
    search: Search<'a>,
    packet: &'a Packet,
    stack: &'a mut Stack,
}

impl Kernel for Walk<'_> {
    type Output = Hits;

    #[inline(always)]
    fn run(self) -> Hits {
        let Self { bvh, search, packet, stack } = self;
        let mut hits = Hits { t: packet.t_max, triangle: [MISS; LANES], u: Floats::splat(0.0), v: Floats::splat(0.0) };
        let mut courses = Courses::of(packet);
        while let Some((mask, course)) = courses.take() {
            let rays = Rays::of(packet, mask, course);
            let mut found = Hits { t: rays.t_max, ..hits };
            if rays.shared {
                descend::<true>(bvh, &search, &rays, stack, &mut found);
            } else {
                descend::<false>(bvh, &search, &rays, stack, &mut found);
            }
            hits = Hits { t: mask.select(found.t, hits.t), ..found };
        }
        hits
    }
}

/// Walks the tree, nearer children first. A child is looked at by the whole packet, then by its rays, when its turn comes.
#[inline(always)]
fn descend<const SHARED: bool>(bvh: &Bvh, search: &Search, rays: &Rays, stack: &mut Stack, hits: &mut Hits) {
    let mut t_most = hits.t.most();
    let (mut node_index, mut depth) = (0, 0);
    loop {
        depth = enter(&bvh.nodes[index(node_index)], node_index, rays, t_most, stack, depth);
        loop {
            if depth == 0 {
                return;
            }
            depth -= 1;
            if stack.entries[depth] > t_most {
                continue;
            }
            let (node, slot) = (stack.children[depth] >> 3, index(stack.children[depth] & 7));
            let parent = &bvh.nodes[index(node)];
            if !any_enters(rays, parent, slot, hits.t) {
                continue;
            }
            let child = parent.child[slot];
            if child & IS_BLOCK == 0 {
                node_index = child;
                break;
            }
            if block::meet::<SHARED>(rays, search, &bvh.blocks[index(child ^ IS_BLOCK)], bvh.pad_m, hits) {
                t_most = hits.t.most();
            }
        }
    }
}

/// Puts those children of a node on the stack that any ray may enter before `t_most`, the nearest on top. A lane's distances to
/// planes never leave those of the span, because rounding is monotone; so no ray loses a hit by what the others do.
#[inline(always)]
fn enter(node: &Node, node_index: u32, rays: &Rays, t_most: f32, stack: &mut Stack, depth: usize) -> usize {
    let span = &rays.span;
    let (mut entry, mut exit) = (Eight::splat(span.t_min), Eight::splat(t_most));
    for axis in 0..3 {
        let down = rays.down[axis] & 1;
        let [slow, fast] = [Eight::splat(span.inverse[axis][0]), Eight::splat(span.inverse[axis][1])];
        let ahead = Eight(node.planes_m[axis][down]) - Eight::splat(span.entry_m[axis]);
        entry = (ahead * slow).lesser(ahead * fast).greater(entry);
        let ahead = Eight(node.planes_m[axis][1 - down]) - Eight::splat(span.exit_m[axis]);
        exit = (ahead * slow).greater(ahead * fast).lesser(exit);
    }
    let mut entered = entry.at_most(exit).bytes();
    let mut top = depth;
    while entered != 0 {
        let slot = entered.trailing_zeros() / 8;
        entered &= !(0xFF << (8 * slot));
        let at = entry.0[index(slot)];
        let mut hole = top;
        while hole > depth && stack.entries[hole - 1] < at {
            stack.entries[hole] = stack.entries[hole - 1];
            stack.children[hole] = stack.children[hole - 1];
            hole -= 1;
        }
        stack.entries[hole] = at;
        stack.children[hole] = node_index << 3 | slot;
        top += 1;
    }
    top
}

/// Whether any ray enters a child's box before its own nearest hit.
#[inline(always)]
fn any_enters(rays: &Rays, node: &Node, slot: usize, t_max: Floats) -> bool {
    let (mut near, mut far) = (rays.t_min, t_max);
    for axis in 0..3 {
        let down = rays.down[axis] & 1;
        let first = Floats::splat(node.planes_m[axis][down][slot]) - rays.origin_m[axis];
        let second = Floats::splat(node.planes_m[axis][1 - down][slot]) - rays.origin_m[axis];
        near = (first * rays.inverse[axis]).greater(near);
        far = (second * rays.inverse[axis]).lesser(far);
    }
    near.at_most(far).any()
}

/// The nearest hit of each ray.
pub fn closest(bvh: &Bvh, packet: &Packet, stack: &mut Stack) -> Hits {
    closest_through(bvh, &NoHoles, packet, stack)
}

/// The nearest hit of each ray that is no hole.
pub fn closest_through(bvh: &Bvh, holes: &dyn Holes, packet: &Packet, stack: &mut Stack) -> Hits {
    dispatch(Walk { bvh, search: Search::new(holes, false), packet, stack })
}

/// Which rays meet anything that is no hole between their limits.
pub fn blocked_through(bvh: &Bvh, holes: &dyn Holes, packet: &Packet, stack: &mut Stack) -> Mask {
    dispatch(Walk { bvh, search: Search::new(holes, true), packet, stack }).met()
}

#[cfg(test)]
mod tests;
