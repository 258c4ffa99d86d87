//! Whether anything stands close to a part of a plane: there irradiance changes within a few samples, and is not interpolated.

use glam::DVec3;

use super::super::bvh::{BLOCK, Bvh, CHILDREN, IS_BLOCK, TriangleBlock};
use crate::num::{greater, index, lesser};

/// What rises less than this above a plane lies in it, in metres.
const FLAT_M: f64 = 1e-3;

/// A box in a plane.
#[derive(Clone, Copy, Debug)]
pub struct FlatBox {
    /// Least and greatest corner in metres.
    pub corners_m: [DVec3; 2],
    /// Unit normal of the plane on the side in question.
    pub normal: DVec3,
    /// A point of the plane.
    pub at_m: DVec3,
}

/// Whether a triangle that rises above the plane touches the box.
pub fn is_anything_near(bvh: &Bvh, part: &FlatBox) -> bool {
    let mut open = vec![0_u32];
    while let Some(node_or_block) = open.pop() {
        if node_or_block & IS_BLOCK != 0 {
            if touches(&bvh.blocks[index(node_or_block & !IS_BLOCK)], part) {
                return true;
            }
            continue;
        }
        let node = &bvh.nodes[index(node_or_block)];
        for child in 0..CHILDREN {
            let overlaps = (0..3).all(|axis| {
                let [low_m, high_m] = node.planes_m[axis].map(|side| f64::from(side[child]));
                low_m <= part.corners_m[1][axis] && high_m >= part.corners_m[0][axis]
            });
            if overlaps {
                open.push(node.child[child]);
            }
        }
    }
    false
}

/// Triangles beyond the last one repeat it.
fn touches(block: &TriangleBlock, part: &FlatBox) -> bool {
    let [low_m, high_m] = part.corners_m;
    let (middle_m, half_m) = (0.5 * (low_m + high_m), 0.5 * (high_m - low_m));
    (0..BLOCK).any(|slot| {
        let corners_m = [0, 1, 2]
            .map(|corner| DVec3::from_array([0, 1, 2].map(|axis| f64::from(block.corners_m[corner][axis][slot]))));
        let rises = corners_m.iter().any(|&corner_m| part.normal.dot(corner_m - part.at_m) > FLAT_M);
        let overlaps = |axis: usize| {
            let [a, b, c] = corners_m.map(|corner_m| corner_m[axis]);
            lesser(lesser(a, b), c) <= high_m[axis] && greater(greater(a, b), c) >= low_m[axis]
        };
        // The separating axes of the box and of the triangle's plane.
        let normal = (corners_m[1] - corners_m[0]).cross(corners_m[2] - corners_m[0]);
        let to_plane = normal.dot(middle_m - corners_m[0]).abs();
        rises && (0..3).all(overlaps) && to_plane <= normal.abs().dot(half_m)
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_lies_in_the_plane_or_behind_it_is_not_near() {
        let floor = [
            [[-9.0, 0.0, 9.0], [9.0, 0.0, 9.0], [9.0, 0.0, -9.0]],
            [[-9.0, 0.0, 9.0], [9.0, 0.0, -9.0], [-9.0, 0.0, -9.0]],
        ];
        let wall = [[2.0_f32, 0.0, -1.0], [2.0, 0.0, 1.0], [2.0, 1.0, 1.0]];
        // Its box covers everything, its plane passes 2 m above the floor.
        let roof = [[-9.0_f32, -7.0, 0.0], [9.0, 11.0, 9.0], [9.0, 11.0, -9.0]];
        let triangles_m = [floor[0], floor[1], wall, roof];
        let bvh = Bvh::build(&triangles_m);
        let near = |x_m: f64, up: f64, reach_m: f64| {
            let (at_m, reach_m) = (DVec3::new(x_m, 0.0, 0.0), DVec3::splat(reach_m));
            is_anything_near(
                &bvh,
                &FlatBox { corners_m: [at_m - reach_m, at_m + reach_m], normal: up * DVec3::Y, at_m },
            )
        };
        assert!(near(1.8, 1.0, 0.3));
        assert!(!near(1.8, 1.0, 0.1));
        assert!(!near(1.8, -1.0, 0.3));
        assert!(!near(0.0, 1.0, 0.9) && near(0.0, 1.0, 1.1));
    }
}
