//! The bounding volume hierarchy over triangles: flat arrays that the packet tracer traverses.
//!
//! A binary tree is built and improved, then widened to nodes of eight children and leaves of a block of triangles, each in arrays that fit
//! registers.
//! Which tree comes out changes only the speed: hits depend on the triangles alone.

mod cluster;
mod reinsert;
mod tree;
mod widen;

use glam::{DVec3, Vec3A};

use self::cluster::{LEVELS_MAX, cluster};
use self::reinsert::reinsert;
use self::tree::{Bounds, Tree};
use self::widen::Choices;
pub use self::widen::{BLOCK, CHILDREN};
use crate::num::{f32_nearest, index, u32_from};

/// Nodes that a traversal may have open: all children but one on every level.
pub const OPEN_MAX: usize = LEVELS_MAX * (CHILDREN - 1) + 1;

/// Marks a child that is a block.
pub const IS_BLOCK: u32 = 1 << 31;

/// Eight children with their boxes, side by side.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct Node {
    /// Of each axis the least and the greatest coordinates. A missing child has a box that no ray enters.
    pub planes_m: [[[f32; CHILDREN]; 2]; 3],
    /// Node, or block with `IS_BLOCK` set.
    pub child: [u32; CHILDREN],
}

/// Triangles of a leaf, side by side. Beyond the last one it is repeated.
#[derive(Clone, Copy, Debug)]
#[repr(C, align(32))]
pub struct TriangleBlock {
    /// Of each corner each coordinate.
    pub corners_m: [[[f32; BLOCK]; 3]; 3],
    /// Their unit normals. Rounded from 64 bits, so that needles have one too.
    pub normal: [[f32; BLOCK]; 3],
    /// Their indices in the scene.
    pub triangle: [u32; BLOCK],
    /// A byte for each triangle, set for those that are.
    pub present: u64,
    /// One bit for each triangle that may have holes.
    pub cut_out: u32,
    /// One bit for each triangle whose back cameras do not see.
    pub culled: u32,
}

/// Flat tree.
#[derive(Clone, Debug)]
pub struct Bvh {
    /// Inner nodes; the root is the first.
    pub nodes: Vec<Node>,
    /// Leaves.
    pub blocks: Vec<TriangleBlock>,
    /// How far each triangle's box reaches beyond it.
    pub pad_m: f32,
}

impl Bvh {
    /// Builds the tree. Corners must be finite and there must be at least one triangle.
    pub fn build(triangles_m: &[[[f32; 3]; 3]]) -> Self {
        Self::build_with_cut_outs(triangles_m, &|_| false)
    }

    /// Builds the tree and marks those triangles that may have holes.
    pub fn build_with_cut_outs(triangles_m: &[[[f32; 3]; 3]], is_cut_out: &dyn Fn(u32) -> bool) -> Self {
        assert!(!triangles_m.is_empty(), "a tree needs a triangle");
        let pad_m = pad_m(triangles_m);
        let boxes: Vec<Bounds> = triangles_m.iter().map(|corners_m| bounds(corners_m, pad_m)).collect();
        let tree = reinsert(cluster(&boxes));
        let mut flat = Self { nodes: Vec::new(), blocks: Vec::new(), pad_m };
        flat.fill(&tree, &|triangles| block(triangles, triangles_m, is_cut_out));
        flat
    }

    /// Marks triangles whose backs cameras do not see.
    pub fn mark_culled(&mut self, is_culled: &dyn Fn(u32) -> bool) {
        for block in &mut self.blocks {
            for slot in 0..BLOCK {
                block.culled |= u32::from(is_culled(block.triangle[slot])) << slot;
            }
        }
    }

    /// Bytes of nodes and triangles.
    pub fn bytes(&self) -> usize {
        size_of_val(self.nodes.as_slice()) + size_of_val(self.blocks.as_slice())
    }

    /// Takes over a binary tree.
    fn fill(&mut self, tree: &Tree, block: &dyn Fn(&[u32]) -> TriangleBlock) {
        let choices = Choices::new(tree);
        self.nodes.push(EMPTY);
        // Depth first, so that a traversal of the near side reads neighbouring lines.
        let mut open = vec![(0_usize, 0_usize)];
        while let Some((source, node_index)) = open.pop() {
            let mut node = EMPTY;
            // A root that is a block is the only child of its node.
            let children = if choices.is_block(source) { vec![source] } else { choices.children(source) };
            for (slot, child) in children.into_iter().enumerate() {
                let bounds = &tree.nodes[child].bounds;
                for axis in 0..3 {
                    node.planes_m[axis][0][slot] = bounds.least_m[axis];
                    node.planes_m[axis][1][slot] = bounds.greatest_m[axis];
                }
                if choices.is_block(child) {
                    node.child[slot] = u32_from(self.blocks.len()) | IS_BLOCK;
                    self.blocks.push(block(&choices.triangles(child)));
                } else {
                    node.child[slot] = u32_from(self.nodes.len());
                    open.push((child, self.nodes.len()));
                    self.nodes.push(EMPTY);
                }
            }
            self.nodes[node_index] = node;
        }
    }
}

const EMPTY: Node =
    Node { planes_m: [[[f32::INFINITY; CHILDREN], [f32::NEG_INFINITY; CHILDREN]]; 3], child: [IS_BLOCK; CHILDREN] };

fn block(triangles: &[u32], triangles_m: &[[[f32; 3]; 3]], is_cut_out: &dyn Fn(u32) -> bool) -> TriangleBlock {
    assert!((1..=BLOCK).contains(&triangles.len()), "a leaf fills a block at most");
    let mut block = TriangleBlock {
        corners_m: [[[0.0; BLOCK]; 3]; 3],
        normal: [[0.0; BLOCK]; 3],
        triangle: [0; BLOCK],
        present: u64::MAX >> (8 * (BLOCK - triangles.len())),
        cut_out: 0,
        culled: 0,
    };
    for slot in 0..BLOCK {
        let triangle = triangles[slot.min(triangles.len() - 1)];
        block.triangle[slot] = triangle;
        block.cut_out |= u32::from(is_cut_out(triangle)) << slot;
        let normal = unit_normal(&triangles_m[index(triangle)]);
        for axis in 0..3 {
            block.normal[axis][slot] = normal[axis];
        }
        for corner in 0..3 {
            for axis in 0..3 {
                block.corners_m[corner][axis][slot] = triangles_m[index(triangle)][corner][axis];
            }
        }
    }
    block
}

/// Zero where the triangle has no area.
fn unit_normal(corners_m: &[[f32; 3]; 3]) -> [f32; 3] {
    let [a, b, c] = corners_m.map(|corner| DVec3::from_array(corner.map(f64::from)));
    (b - a).cross(c - a).normalize_or_zero().to_array().map(f32_nearest)
}

/// The tracer sees corners moved by its roundings: a corner's two coordinates across the ray carry one of the direction's ratio (2^-24
/// twice), one of a product and one of a difference each, and a slab's distance three more, each of the distance to the ray's
/// origin; together below 4 epsilon of it. Four times that serves origins as far outside the scene as it is wide. Far from the
/// coordinates' origin the pad itself must survive rounding.
fn pad_m(triangles_m: &[[[f32; 3]; 3]]) -> f32 {
    let (mut least, mut greatest) = (Vec3A::MAX, Vec3A::MIN);
    for &corner in triangles_m.iter().flatten() {
        (least, greatest) = (least.min(Vec3A::from_array(corner)), greatest.max(Vec3A::from_array(corner)));
    }
    let extent_m = (greatest - least).element_sum();
    let farthest_m = least.abs().max(greatest.abs()).max_element();
    f32::EPSILON * (16.0 * extent_m + 2.0 * farthest_m)
}

fn bounds(corners_m: &[[f32; 3]; 3], pad_m: f32) -> Bounds {
    let [a, b, c] = corners_m.map(Vec3A::from_array);
    let pad = Vec3A::splat(pad_m);
    Bounds { least_m: a.min(b).min(c) - pad, greatest_m: a.max(b).max(c) + pad }
}
