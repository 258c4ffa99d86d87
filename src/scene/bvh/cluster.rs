//! Builds the binary tree from its leaves: locally ordered clustering (Meister and Bittner 2018, "Parallel locally-ordered clustering
//! for bounding volume hierarchy construction").

use glam::Vec3A;

use super::tree::{Below, Bounds, Node, Tree};
use crate::num::{index, u32_from, u64_truncated};

/// Passes in which clusters choose their partners. Of boxes within one another few choose each other; later passes pair clusters by their
/// order.
const CHOOSING_PASSES: usize = 63;

/// Levels of the deepest tree: a pass adds one at most, and 2^32 clusters are paired in 32.
pub const LEVELS_MAX: usize = CHOOSING_PASSES + 32 + 1;

/// Neighbours on either side, in the order of their middles, among which a cluster chooses: in the first passes, which join most
/// triangles, and in the others.
const REACH: [usize; 2] = [1, 14];

/// Passes of the shorter reach.
const NEAR_PASSES: usize = 2;

/// Joins clusters that choose each other, pass by pass, until one is left. There must be a box, and coordinates must be finite.
pub fn cluster(boxes: &[Bounds]) -> Tree {
    let leaf = |triangle: u32| Node { bounds: boxes[index(triangle)], below: Below::Triangle(triangle) };
    let mut clusters: Vec<Node> = by_morton_code(boxes).into_iter().map(leaf).collect();
    let mut nodes = vec![clusters[0]; 2 * boxes.len() - 1];
    // From the end, so that parents stand before their children.
    let mut unused = nodes.len();
    let mut pass = 0;
    while clusters.len() > 1 {
        let partners = partners(&clusters, pass);
        let mut joined = Vec::with_capacity(clusters.len());
        for (cluster_index, &other) in partners.iter().enumerate() {
            if other == cluster_index || partners[other] != cluster_index {
                joined.push(clusters[cluster_index]);
            } else if cluster_index < other {
                unused -= 2;
                (nodes[unused], nodes[unused + 1]) = (clusters[cluster_index], clusters[other]);
                let bounds = clusters[cluster_index].bounds.union(&clusters[other].bounds);
                joined.push(Node { bounds, below: Below::Pair(u32_from(unused)) });
            }
        }
        clusters = joined;
        pass += 1;
    }
    nodes[0] = clusters[0];
    Tree { nodes }
}

/// Triangles in the order of their boxes' middles along a Morton curve of 21 bits an axis.
fn by_morton_code(boxes: &[Bounds]) -> Vec<u32> {
    let all = boxes.iter().fold(Bounds::EMPTY, Bounds::union);
    let per_cell = (Vec3A::splat(2_097_151.0) / (all.greatest_m - all.least_m)).as_dvec3();
    let code = |bounds: &Bounds| {
        let middle_m = (bounds.least_m + bounds.greatest_m) * 0.5;
        // An axis without extent gives no number, which counts as 0.
        let [x, y, z] =
            ((middle_m - all.least_m).as_dvec3() * per_cell).to_array().map(|cell| spread(u64_truncated(cell)));
        x | y << 1 | z << 2
    };
    let mut keyed: Vec<(u64, u32)> = boxes.iter().map(code).zip(0..).collect();
    keyed.sort_unstable();
    keyed.into_iter().map(|(_, triangle)| triangle).collect()
}

/// Each of the lower 21 bits followed by two zeros.
const fn spread(value: u64) -> u64 {
    let value = value & 0x1f_ffff;
    let value = (value | value << 32) & 0x001f_0000_0000_ffff;
    let value = (value | value << 16) & 0x001f_0000_ff00_00ff;
    let value = (value | value << 8) & 0x100f_00f0_0f00_f00f;
    let value = (value | value << 4) & 0x10c3_0c30_c30c_30c3;
    (value | value << 2) & 0x1249_2492_4924_9249
}

/// With whom each cluster joins least surface; itself where it has nobody.
fn partners(clusters: &[Node], pass: usize) -> Vec<usize> {
    if pass >= CHOOSING_PASSES {
        return (0..clusters.len()).map(|cluster_index| (cluster_index ^ 1).min(clusters.len() - 1)).collect();
    }
    let reach = REACH[usize::from(pass >= NEAR_PASSES)];
    let mut least = vec![(f32::INFINITY, 0); clusters.len()];
    for (cluster_index, cluster) in clusters.iter().enumerate() {
        for other in cluster_index + 1..clusters.len().min(cluster_index + reach + 1) {
            // Of equal surfaces the one whose indices differ in lower bits: both sides prefer the same, and equal boxes pair up.
            let cost = (cluster.bounds.union(&clusters[other].bounds).half_area_m2(), cluster_index ^ other);
            for chooser in [cluster_index, other] {
                if cost < least[chooser] {
                    least[chooser] = cost;
                }
            }
        }
    }
    least.into_iter().enumerate().map(|(cluster_index, (_, difference))| cluster_index ^ difference).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn equal_boxes_make_a_flat_tree_and_boxes_within_one_another_one_of_bounded_depth() {
        let half = |size: f32| Bounds { least_m: Vec3A::splat(-size), greatest_m: Vec3A::splat(size) };
        assert_eq!(cluster(&vec![half(1.0); 4096]).levels(), 13);
        let nested: Vec<_> = (1..=30_000_u16).map(|size| half(f32::from(size))).collect();
        // Without pairs by order a pass joins one pair of every reach, and the tree has as many levels as passes.
        let levels = cluster(&nested).levels();
        assert!((CHOOSING_PASSES..=LEVELS_MAX).contains(&levels), "{levels} levels");
    }
}
