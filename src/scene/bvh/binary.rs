//! The binary tree: locally ordered clustering (Meister and Bittner 2018, "Parallel locally-ordered clustering for bounding volume
//! hierarchy construction"), then reinsertion of nodes where they cost less, by `obvhs`.
//!
//! Its depth, and with it the time to build it, are bounded whatever the triangles. Of boxes within one another few choose each other
//! in a pass; so after many passes clusters are paired by their order. Reinsertion can make a chain of such boxes, and is then undone.

use glam::Vec3A;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::node::Bvh2Node;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;

use crate::num::{index, u32_from, u64_truncated};

/// Levels of the deepest tree. The optimiser's search can hold twice as many open nodes.
pub const LEVELS_MAX: usize = 96;

/// Passes in which clusters choose their partners. A pass adds a level, and 2^32 clusters are paired in 32 passes.
const CHOOSING_PASSES: usize = LEVELS_MAX - 33;

/// Neighbours on either side, in the order of their middles, among which a cluster chooses: in the first passes, which join most
/// triangles, and in the others.
const REACH: [usize; 2] = [1, 14];

/// Passes of the shorter reach.
const NEAR_PASSES: usize = 2;

/// Passes of the optimiser, and the share of nodes that it tries to reinsert in the first; in the others a third, a fifth, ... of it.
const REINSERTION_PASSES: u8 = 8;
const REINSERTION_SHARE: f32 = 0.15;

/// Builds the tree, of a triangle a leaf. There must be a box, and coordinates must be finite.
pub fn build(boxes: &[Aabb]) -> Bvh2 {
    let mut tree = cluster(boxes);
    let mut optimizer = ReinsertionOptimizer::default();
    for pass in 0..REINSERTION_PASSES {
        optimizer.run(&mut tree, REINSERTION_SHARE / f32::from(2 * pass + 1), Some(vec![1.0]));
        if levels(&tree) > LEVELS_MAX {
            return cluster(boxes);
        }
    }
    tree
}

/// Joins clusters that choose each other, pass by pass, until one is left.
fn cluster(boxes: &[Aabb]) -> Bvh2 {
    let mut tree = Bvh2::zeroed(boxes.len());
    tree.primitive_indices = (0..u32_from(boxes.len())).collect();
    let mut clusters: Vec<_> = by_place(boxes).iter().map(|&leaf| Bvh2Node::new(boxes[index(leaf)], 1, leaf)).collect();
    let mut unused = tree.nodes.len();
    let mut pass = 0;
    while clusters.len() > 1 {
        let partners = partners(&clusters, pass);
        let mut joined = Vec::with_capacity(clusters.len());
        for (place, &other) in partners.iter().enumerate() {
            if other == place || partners[other] != place {
                joined.push(clusters[place]);
            } else if place < other {
                unused -= 2;
                (tree.nodes[unused], tree.nodes[unused + 1]) = (clusters[place], clusters[other]);
                let bounds = clusters[place].aabb().union(clusters[other].aabb());
                joined.push(Bvh2Node::new(bounds, 0, u32_from(unused)));
            }
        }
        clusters = joined;
        pass += 1;
    }
    tree.nodes[0] = clusters[0];
    tree
}

/// Triangles in the order of their boxes' middles along a Morton curve of 21 bits an axis.
fn by_place(boxes: &[Aabb]) -> Vec<u32> {
    let all = boxes.iter().fold(Aabb::empty(), |all, bounds| all.union(bounds));
    let per_cell = (Vec3A::splat(2_097_151.0) / (all.max - all.min)).as_dvec3();
    let code = |bounds: &Aabb| {
        let cells = (((bounds.min + bounds.max) * 0.5 - all.min).as_dvec3() * per_cell).to_array();
        // An axis without extent gives no number, which counts as 0.
        let [x, y, z] = cells.map(|cell| spread(u64_truncated(cell)));
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
fn partners(clusters: &[Bvh2Node], pass: usize) -> Vec<usize> {
    if pass >= CHOOSING_PASSES {
        return (0..clusters.len()).map(|place| (place ^ 1).min(clusters.len() - 1)).collect();
    }
    let reach = REACH[usize::from(pass >= NEAR_PASSES)];
    let mut least: Vec<(f32, usize)> = (0..clusters.len()).map(|place| (f32::INFINITY, place)).collect();
    for (place, cluster) in clusters.iter().enumerate() {
        for other in place + 1..clusters.len().min(place + reach + 1) {
            let area_m2 = cluster.aabb().union(clusters[other].aabb()).half_area();
            for (chooser, chosen) in [(place, other), (other, place)] {
                if area_m2 < least[chooser].0 {
                    least[chooser] = (area_m2, chosen);
                }
            }
        }
    }
    least.into_iter().map(|(_, partner)| partner).collect()
}

/// Nodes from the root to the deepest leaf, both counted.
fn levels(tree: &Bvh2) -> usize {
    let mut deepest = 0;
    let mut open = vec![(0, 1)];
    while let Some((node, level)) = open.pop() {
        deepest = deepest.max(level);
        if !tree.nodes[node].is_leaf() {
            let first = index(tree.nodes[node].first_index);
            open.extend([(first, level + 1), (first + 1, level + 1)]);
        }
    }
    deepest
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::num::{f32_from_u32, f32_nearest};

    /// Boxes about one middle, each a little larger than the one before.
    fn within_one_another(count: u32) -> Vec<Aabb> {
        (1..=count)
            .map(|size| Vec3A::new(1.0, 0.7, 0.2) * f32_from_u32(size))
            .map(|half| Aabb::new(-half, half))
            .collect()
    }

    /// Boxes about points that halve their distance from a corner, over the range of 32 bits.
    fn ever_smaller(count: u32) -> Vec<Aabb> {
        let side = |n: u32| f32_nearest(libm::exp2(-f64::from(n) * 200.0 / f64::from(count)));
        (0..count).map(|n| Aabb::new(Vec3A::ZERO, Vec3A::splat(side(n)))).collect()
    }

    /// Every triangle once, within the boxes of all nodes above it, and no deeper than promised.
    fn check(name: &str, boxes: &[Aabb]) {
        let tree = build(boxes);
        assert!(levels(&tree) <= LEVELS_MAX, "{name}: {} levels", levels(&tree));
        let mut found = vec![0; boxes.len()];
        let mut open = vec![(0, tree.nodes[0].aabb())];
        while let Some((node, above)) = open.pop() {
            let (at, first) = (tree.nodes[node].aabb(), index(tree.nodes[node].first_index));
            assert_eq!(above.union(at), *above, "{name}: node {node} reaches out of the one above");
            if tree.nodes[node].is_leaf() {
                let triangle = index(tree.primitive_indices[first]);
                assert_eq!(at, &boxes[triangle], "{name}: box of triangle {triangle}");
                found[triangle] += 1;
            } else {
                open.extend([(first, at), (first + 1, at)]);
            }
        }
        assert!(found.iter().all(|&count| count == 1), "{name}");
    }

    #[test]
    fn no_boxes_make_a_deep_tree() {
        check("one", &within_one_another(1));
        check("two", &within_one_another(2));
        check("many within one another", &within_one_another(100_000));
        check("many ever smaller", &ever_smaller(20_000));
        check("many that are equal", &vec![Aabb::new(Vec3A::ZERO, Vec3A::ONE); 5000]);
        check("far out", &[1.0_f32, 2.0, 3.0].map(|at| Aabb::new(Vec3A::splat(at * 1e38), Vec3A::splat(at * 1e38))));
    }

    #[test]
    fn clusters_are_paired_when_few_choose_each_other() {
        // Without pairs by order a pass joins one pair of every reach, and the tree has as many levels as passes.
        let tree = cluster(&within_one_another(100_000));
        assert!((CHOOSING_PASSES..=LEVELS_MAX).contains(&levels(&tree)), "{} levels", levels(&tree));
    }
}
