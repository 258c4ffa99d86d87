//! The tree over triangles. Enters: triangles. Leaves: flat arrays that the packet tracer walks.
//!
//! Built by `obvhs` (locally ordered clustering, then reinsertion and leaf collapse) through its parts that read no clock.
//! Which tree comes out changes only the speed: hits depend on the triangles alone.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::leaf_collapser::collapse;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::bvh2::{Bvh2, node::Bvh2Node};
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};

use crate::num::{index, u32_from};

/// Triangles that a leaf may hold.
const LEAF_TRIANGLES_MAX: u32 = 4;

/// Cost of a box test in units of a triangle test, as the collapse of leaves weighs them.
const BOX_COST: f32 = 1.5;

/// Share of nodes that the optimiser tries to reinsert in each pass.
const REINSERTION_SHARE: f32 = 0.15;

/// Deepest tree that the tracer's stack can walk; far above what the builder makes of any real scene.
pub const DEPTH_MAX: usize = 96;

/// Two children with their boxes: a cache line and a third, read together. The first child is the one that lies lower along
/// the axis on which their centres differ most.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Node {
    /// Least corner, greatest corner of each child.
    pub boxes_m: [[[f32; 3]; 2]; 2],
    /// Index of the child's node, or of its first triangle.
    pub first: [u32; 2],
    /// Triangles of a leaf; 0 for an inner node.
    pub count: [u32; 2],
    /// The axis that tells the children apart, 0 to 2.
    pub axis: u32,
}

/// A triangle in leaf order.
#[derive(Clone, Copy, Debug)]
#[repr(C)]
pub struct Leaf {
    /// Corners.
    pub corners_m: [[f32; 3]; 3],
    /// Its index in the scene.
    pub triangle: u32,
    /// How far an edge function may be on the wrong side and still count, for rays of unit direction.
    pub slack: f32,
    /// Whether it may have holes.
    pub cut_out: bool,
}

/// Flat tree.
#[derive(Clone, Debug)]
pub struct Bvh {
    /// Inner nodes; the root is the first. A scene of few triangles is one node with one leaf.
    pub nodes: Vec<Node>,
    /// Triangles in leaf order.
    pub leaves: Vec<Leaf>,
}

impl Bvh {
    /// Builds the tree. Corners must be finite and there must be at least one triangle.
    pub fn build(triangles_m: &[[[f32; 3]; 3]]) -> Self {
        Self::build_with_cut_outs(triangles_m, &|_| false)
    }

    /// Builds the tree and marks those triangles that may have holes.
    pub fn build_with_cut_outs(triangles_m: &[[[f32; 3]; 3]], is_cut_out: &dyn Fn(u32) -> bool) -> Self {
        assert!(!triangles_m.is_empty(), "a tree needs a triangle");
        let boxes: Vec<Aabb> = triangles_m.iter().map(bounds).collect();
        let order: Vec<u32> = (0..u32_from(boxes.len())).collect();
        let mut tree = PlocBuilder::with_capacity(boxes.len()).build(
            PlocSearchDistance::Medium,
            &boxes,
            order,
            SortPrecision::U64,
            2,
        );
        let mut optimizer = ReinsertionOptimizer::default();
        optimizer.run(&mut tree, REINSERTION_SHARE, None);
        collapse(&mut tree, LEAF_TRIANGLES_MAX, BOX_COST);
        optimizer.run(&mut tree, REINSERTION_SHARE, None);
        let flat = Self { nodes: flatten(&tree), leaves: leaves(&tree, triangles_m, is_cut_out) };
        assert!(flat.depth() < DEPTH_MAX, "the tree is deeper than the tracer's stack");
        flat
    }

    /// Levels of inner nodes.
    fn depth(&self) -> usize {
        let mut deepest = 0;
        let mut stack = vec![(0_u32, 1_usize)];
        while let Some((node, depth)) = stack.pop() {
            deepest = deepest.max(depth);
            let node = &self.nodes[index(node)];
            for child in 0..2 {
                if node.count[child] == 0 && node.first[child] != 0 {
                    stack.push((node.first[child], depth + 1));
                }
            }
        }
        deepest
    }
}

fn bounds(corners_m: &[[f32; 3]; 3]) -> Aabb {
    let [a, b, c] = corners_m.map(Vec3A::from_array);
    Aabb::new(a.min(b).min(c), a.max(b).max(c))
}

/// An edge function is twice a triple product of (point of the edge, edge, direction). Its factors carry half an epsilon of
/// rounding each, and its two products and three sums as much again: together below 8 epsilon times the distance of the ray's
/// origin times the length of the edge. In metres that moves an edge by 4 epsilon of the scene's extent: 3 um in a room.
fn leaves(tree: &Bvh2, triangles_m: &[[[f32; 3]; 3]], is_cut_out: &dyn Fn(u32) -> bool) -> Vec<Leaf> {
    let root = tree.nodes[0].aabb();
    let extent_m = (root.max - root.min).to_array().into_iter().fold(0.0, |sum, edge| sum + edge);
    let leaf = |&triangle: &u32| {
        let corners_m = triangles_m[index(triangle)];
        let edge_m = (0..3).fold(0.0_f32, |longest, corner| {
            let (from, to) = (corners_m[corner], corners_m[(corner + 1) % 3]);
            let apart = (from[0] - to[0]).abs() + (from[1] - to[1]).abs() + (from[2] - to[2]).abs();
            if apart > longest { apart } else { longest }
        });
        let slack = 8.0 * f32::EPSILON * extent_m * edge_m;
        Leaf { corners_m, triangle, slack, cut_out: is_cut_out(triangle) }
    };
    tree.primitive_indices.iter().map(leaf).collect()
}

/// The axis on which the centres of two boxes differ most, and whether the second one is the lower there.
fn order(boxes_m: &[[[f32; 3]; 2]; 2]) -> (u32, bool) {
    let (mut axis, mut widest) = (0, 0.0_f32);
    for candidate in 0..3 {
        let [left, right] = boxes_m.map(|corners_m| corners_m[0][candidate] + corners_m[1][candidate]);
        if (right - left).abs() > widest.abs() {
            (axis, widest) = (u32_from(candidate), right - left);
        }
    }
    (axis, widest < 0.0)
}

fn flatten(tree: &Bvh2) -> Vec<Node> {
    let corners = |node: &Bvh2Node| [node.aabb().min.to_array(), node.aabb().max.to_array()];
    let root = &tree.nodes[0];
    if root.is_leaf() {
        // Both children are the one leaf: what is met twice is met once.
        let boxes_m = [corners(root); 2];
        return vec![Node { boxes_m, first: [root.first_index; 2], count: [root.prim_count; 2], axis: 0 }];
    }
    let mut nodes = Vec::with_capacity(tree.nodes.len() / 2 + 1);
    nodes.push(None);
    // Depth first, so that a walk down the near side reads neighbouring lines.
    let mut open = vec![(0_usize, 0_usize)];
    while let Some((source, place)) = open.pop() {
        let first = index(tree.nodes[source].first_index);
        let boxes_m = [corners(&tree.nodes[first]), corners(&tree.nodes[first + 1])];
        let (axis, swapped) = order(&boxes_m);
        let mut flat = Node { boxes_m, first: [0; 2], count: [0; 2], axis };
        for child in 0..2 {
            let source = first + if swapped { 1 - child } else { child };
            let node = &tree.nodes[source];
            flat.boxes_m[child] = corners(node);
            flat.count[child] = node.prim_count;
            flat.first[child] = node.first_index;
            if !node.is_leaf() {
                flat.first[child] = u32_from(nodes.len());
                open.push((source, nodes.len()));
                nodes.push(None);
            }
        }
        nodes[place] = Some(flat);
    }
    nodes.into_iter().map(|node| node.expect("every place that was opened was filled")).collect()
}
