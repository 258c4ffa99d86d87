//! Lower bound on the distance from a box to a scene's surfaces.
//!
//! Branch and bound over the tree's boxes. A triangle lies no nearer to the box than its own box does, nor than its plane does
//! (the separating-axis test with four of its axes; Gottschalk et al., SIGGRAPH 1996).

use glam::DVec3;

use super::bvh::{BLOCK, Bvh, CHILDREN, IS_BLOCK, Node, TriangleBlock};
use crate::num::{greater, index, lesser};

/// A lower bound of the distance in metres between the box of these corners and any triangle; 0 where it may touch one.
pub fn distance_m(bvh: &Bvh, [low_m, high_m]: [DVec3; 2]) -> f64 {
    let mut nearest_m = f64::INFINITY;
    let mut open = vec![(0.0, 0_u32)];
    while let Some((at_least_m, node_or_block)) = open.pop() {
        if at_least_m >= nearest_m {
            continue;
        }
        if node_or_block & IS_BLOCK != 0 {
            nearest_m = lesser(nearest_m, to_block_m(&bvh.blocks[index(node_or_block & !IS_BLOCK)], [low_m, high_m]));
            continue;
        }
        let node = &bvh.nodes[index(node_or_block)];
        let first = open.len();
        for child in 0..CHILDREN {
            let away_m = to_child_m(node, child, [low_m, high_m]);
            if away_m < nearest_m {
                open.push((away_m, node.child[child]));
            }
        }
        // The nearest is looked at first.
        open[first..].sort_by(|a, b| b.0.total_cmp(&a.0));
    }
    nearest_m
}

/// Distance along one axis between two ranges; 0 where they overlap.
fn gap_m([low_m, high_m]: [f64; 2], [other_low_m, other_high_m]: [f64; 2]) -> f64 {
    greater(greater(other_low_m - high_m, low_m - other_high_m), 0.0)
}

/// Distance between two boxes, the other by its range along each axis.
fn box_gap_m([low_m, high_m]: [DVec3; 2], range_m: impl Fn(usize) -> [f64; 2]) -> f64 {
    let mut squares_m2 = 0.0;
    for axis in 0..3 {
        let away_m = gap_m([low_m[axis], high_m[axis]], range_m(axis));
        squares_m2 += away_m * away_m;
    }
    squares_m2.sqrt()
}

fn to_child_m(node: &Node, child: usize, corners_m: [DVec3; 2]) -> f64 {
    box_gap_m(corners_m, |axis| node.planes_m[axis].map(|side| f64::from(side[child])))
}

/// Triangles beyond the last one repeat it.
fn to_block_m(block: &TriangleBlock, [low_m, high_m]: [DVec3; 2]) -> f64 {
    let (middle_m, half_m) = (0.5 * (low_m + high_m), 0.5 * (high_m - low_m));
    let mut nearest_m = f64::INFINITY;
    for slot in 0..BLOCK {
        let corner_m =
            |corner: usize| DVec3::from_array([0, 1, 2].map(|axis| f64::from(block.corners_m[corner][axis][slot])));
        let corners_m = [0, 1, 2].map(corner_m);
        let away_m = box_gap_m([low_m, high_m], |axis| {
            let [a, b, c] = corners_m.map(|corner_m| corner_m[axis]);
            [lesser(lesser(a, b), c), greater(greater(a, b), c)]
        });
        let across = (corners_m[1] - corners_m[0]).cross(corners_m[2] - corners_m[0]);
        let normal = across.normalize_or_zero();
        // A box reaches along a direction as far as its half sides do.
        let to_plane_m = normal.dot(middle_m - corners_m[0]).abs() - normal.abs().dot(half_m);
        nearest_m = lesser(nearest_m, greater(away_m, to_plane_m));
    }
    nearest_m
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::DrawKey;
    use crate::num::f32_nearest;
    use rand::RngExt;

    /// Points of random triangles against random boxes: none is nearer than the bound, and for points (boxes without extent) the bound is
    /// within the triangles' own size of the truth.
    #[test]
    fn no_point_of_a_triangle_is_nearer_than_the_bound() {
        let seed = 8;
        let mut stream = DrawKey::root(seed).stream();
        let mut draw = |least: f64, most: f64| least + (most - least) * stream.random::<f64>();
        let triangles_m: Vec<[[f32; 3]; 3]> = (0..500)
            .map(|_| {
                let at = [draw(-5.0, 5.0), draw(-5.0, 5.0), draw(-5.0, 5.0)];
                [0, 1, 2].map(|_| at.map(|at| f32_nearest(at + draw(-0.5, 0.5))))
            })
            .collect();
        let bvh = Bvh::build(&triangles_m);
        let mut apart = 0;
        for case in 0..200 {
            let low_m = DVec3::new(draw(-8.0, 8.0), draw(-8.0, 8.0), draw(-8.0, 8.0));
            let size_m = if case % 2 == 0 { 0.0 } else { draw(0.0, 1.0) };
            let high_m = low_m + DVec3::splat(size_m);
            let bound_m = distance_m(&bvh, [low_m, high_m]);
            let mut truth_m = f64::INFINITY;
            for corners_m in &triangles_m {
                for _ in 0..4 {
                    let (u, v) = (draw(0.0, 0.5), draw(0.0, 0.5));
                    let corner = |at: usize| DVec3::from_array(corners_m[at].map(f64::from));
                    let point_m = corner(0) * (1.0 - u - v) + corner(1) * u + corner(2) * v;
                    truth_m = truth_m.min(point_m.distance(point_m.clamp(low_m, high_m)));
                }
            }
            assert!(bound_m <= truth_m + 1e-9, "seed {seed}, case {case}: {bound_m} for {truth_m}");
            // Four random points of a triangle under 1.8 m across leave some of it unseen.
            assert!(truth_m - bound_m < 1.8, "seed {seed}, case {case}: {bound_m} for {truth_m}");
            apart += usize::from(bound_m > 0.0);
        }
        assert!(apart > 100, "{apart} boxes lie apart from all triangles");
    }
}
