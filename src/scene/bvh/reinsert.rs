//! Moves nodes of the binary tree to where rays are expected to meet least surface (Meister and Bittner 2018, "Parallel reinsertion for
//! bounding volume hierarchy optimization").

use super::cluster::LEVELS_MAX;
use super::tree::{Below, Node, Tree};
use crate::num::{index, u32_from};

/// Passes, and the share of nodes that the first one tries, those of the largest boxes; the others try a third, a fifth, ... of it.
const PASSES: usize = 6;
const FIRST_SHARE: usize = 7;

/// Nodes that are tried as a new sibling at most: twenty times the usual number. Where many large boxes overlap, all of them would be.
const TRIED_MAX: usize = 1000;

/// Improves a tree. Its levels stay within `LEVELS_MAX`: a pass that makes it deeper is undone and is the last.
pub fn reinsert(mut tree: Tree) -> Tree {
    let mut parents = parents(&tree);
    for pass in 0..PASSES {
        let before = tree.clone();
        improve(&mut tree, &mut parents, before.nodes.len() / (FIRST_SHARE * (2 * pass + 1)));
        if levels(&parents) > LEVELS_MAX {
            return before;
        }
    }
    tree
}

/// A better insertion point for a node.
#[derive(Clone, Copy, Debug)]
struct Move {
    /// By how much the sum of half surfaces falls.
    gain_m2: f32,
    node: usize,
    /// The node that becomes its sibling.
    to: usize,
}

/// Of each node; the root's means nothing.
fn parents(tree: &Tree) -> Vec<u32> {
    let mut parents = vec![0; tree.nodes.len()];
    for node in 0..tree.nodes.len() {
        tell_children(tree, &mut parents, node);
    }
    parents
}

/// Nodes from the root to the deepest leaf, both counted.
fn levels(parents: &[u32]) -> usize {
    let mut levels = vec![0_u32; parents.len()];
    levels[0] = 1;
    let mut above = Vec::new();
    for mut node in 1..parents.len() {
        while levels[node] == 0 {
            above.push(node);
            node = index(parents[node]);
        }
        let mut level = levels[node];
        while let Some(node) = above.pop() {
            level += 1;
            levels[node] = level;
        }
    }
    levels.into_iter().max().map_or(0, index)
}

fn improve(tree: &mut Tree, parents: &mut [u32], count: usize) {
    // Parents stood before their children at first, so that the largest are among the first.
    let first = 1..tree.nodes.len().min(2 * count + 2);
    let mut largest: Vec<(f32, usize)> = first.map(|node| (tree.half_area_m2(node), node)).collect();
    if count < largest.len() {
        largest.select_nth_unstable_by(count, |a, b| b.0.total_cmp(&a.0));
        largest.truncate(count);
    }
    let mut open = Vec::new();
    let mut moves: Vec<Move> =
        largest.into_iter().filter_map(|(_, node)| best_move(tree, parents, node, &mut open)).collect();
    moves.sort_unstable_by(|a, b| b.gain_m2.total_cmp(&a.gain_m2).then(a.node.cmp(&b.node)));
    // Moves that share a node would spoil each other's gain. An earlier move may have brought the new sibling below the node itself.
    let mut touched = vec![false; tree.nodes.len()];
    for Move { node, to, .. } in moves {
        let near = [node, sibling(node), index(parents[node]), to, index(parents[to])];
        if near.iter().all(|&node| !touched[node]) && !is_within(parents, to, node) {
            near.into_iter().for_each(|node| touched[node] = true);
            carry_out(tree, parents, node, to);
        }
    }
}

/// Whether a node is another one or below it.
fn is_within(parents: &[u32], mut node: usize, other: usize) -> bool {
    while node != 0 && node != other {
        node = index(parents[node]);
    }
    node == other
}

/// The other node of a pair. The root has none; pairs begin at odd indices.
const fn sibling(node: usize) -> usize {
    ((node - 1) ^ 1) + 1
}

/// Looks for the insertion point of greatest gain, from the node's own sibling up through its ancestors' siblings, by branch and bound.
fn best_move(tree: &Tree, parents: &[u32], node: usize, open: &mut Vec<(f32, usize)>) -> Option<Move> {
    let (own, own_m2) = (&tree.nodes[node].bounds, tree.half_area_m2(node));
    let parent = index(parents[node]);
    let mut best = Move { gain_m2: 0.0, node, to: node };
    // What is saved where the node leaves: its parent, and what the ancestors shrink by.
    let mut saved_m2 = tree.half_area_m2(parent);
    let mut rest = tree.nodes[sibling(node)].bounds;
    let (mut beside, mut ancestor) = (sibling(node), parent);
    let mut tried = 0;
    loop {
        open.clear();
        open.push((saved_m2, beside));
        while tried < TRIED_MAX
            && let Some((saved_m2, to)) = open.pop()
        {
            tried += 1;
            // Below this insertion point at least the node's own surface is added.
            if saved_m2 - own_m2 <= best.gain_m2 {
                continue;
            }
            let gain_m2 = saved_m2 - tree.nodes[to].bounds.union(own).half_area_m2();
            if gain_m2 > best.gain_m2 && to != sibling(node) {
                best = Move { gain_m2, node, to };
            }
            if let Some(pair) = tree.pair(to) {
                let saved_m2 = gain_m2 + tree.half_area_m2(to);
                open.extend(pair.map(|child| (saved_m2, child)));
            }
        }
        if ancestor != parent {
            rest = rest.union(&tree.nodes[beside].bounds);
            saved_m2 += tree.half_area_m2(ancestor) - rest.half_area_m2();
        }
        if ancestor == 0 || tried == TRIED_MAX {
            return (best.to != node).then_some(best);
        }
        (beside, ancestor) = (sibling(ancestor), index(parents[ancestor]));
    }
}

/// The node's sibling takes the place of their parent; the pair's entries become the children of `to`, which it takes in beside the node.
fn carry_out(tree: &mut Tree, parents: &mut [u32], node: usize, to: usize) {
    let (beside, parent) = (sibling(node), index(parents[node]));
    let bounds = tree.nodes[to].bounds.union(&tree.nodes[node].bounds);
    tree.nodes[parent] = tree.nodes[beside];
    tree.nodes[beside] = tree.nodes[to];
    tree.nodes[to] = Node { bounds, below: Below::Pair(u32_from(node.min(beside))) };
    for node in [parent, beside, to] {
        tell_children(tree, parents, node);
    }
    refit_above(tree, parents, parent);
    refit_above(tree, parents, to);
}

fn tell_children(tree: &Tree, parents: &mut [u32], node: usize) {
    for child in tree.pair(node).into_iter().flatten() {
        parents[child] = u32_from(node);
    }
}

/// Fits the boxes of a node's ancestors, up to the first that stays as it is.
fn refit_above(tree: &mut Tree, parents: &[u32], mut node: usize) {
    while node != 0 {
        node = index(parents[node]);
        let [first, second] = tree.pair(node).expect("a parent has children");
        let bounds = tree.nodes[first].bounds.union(&tree.nodes[second].bounds);
        if bounds == tree.nodes[node].bounds {
            return;
        }
        tree.nodes[node].bounds = bounds;
    }
}

#[cfg(test)]
mod tests {
    use glam::Vec3A;

    use super::super::cluster::cluster;
    use super::super::tree::Bounds;
    use super::*;
    use crate::draw::DrawKey;
    use crate::num::{f32_from_u32, f32_nearest, u64_from};
    use crate::scene::chance::pair;

    fn cube(middle_m: Vec3A, half_m: f32) -> Bounds {
        Bounds { least_m: middle_m - half_m, greatest_m: middle_m + half_m }
    }

    /// Boxes about one middle, each a little larger than the one before.
    fn nested(count: u32) -> Vec<Bounds> {
        (1..=count).map(|size| cube(Vec3A::ZERO, f32_from_u32(size))).collect()
    }

    /// Boxes at a corner that shrink over the range of 32 bits.
    fn ever_smaller(count: u32) -> Vec<Bounds> {
        let side = |n: u32| f32_nearest(libm::exp2(-f64::from(n) * 200.0 / f64::from(count)));
        (0..count).map(|n| cube(Vec3A::splat(0.5 * side(n)), 0.5 * side(n))).collect()
    }

    /// Small boxes, of which every `large_every`th spans them all.
    fn scattered(count: usize, large_every: usize) -> Vec<Bounds> {
        let middle_m = |n: usize| {
            let key = DrawKey::root(5).with(u64_from(n));
            let ([x, y], [z, _]) = (pair(key, 0), pair(key, 1));
            Vec3A::new(f32_nearest(x), f32_nearest(y), f32_nearest(z))
        };
        let half_m = |n: usize| if (n + 1).is_multiple_of(large_every) { 1.0 } else { 0.01 };
        (0..count).map(|n| cube(middle_m(n), half_m(n))).collect()
    }

    /// Every triangle once, boxes that just hold what is below, and no deeper than promised. Gives back the sum of half surfaces.
    fn checked(name: &str, boxes: &[Bounds], tree: &Tree) -> f64 {
        let levels = levels(&parents(tree));
        assert!(levels <= LEVELS_MAX && levels == tree.levels(), "{name}: {levels} levels");
        let mut found = vec![0; boxes.len()];
        let (mut area_m2, mut open) = (0.0, vec![0]);
        while let Some(node) = open.pop() {
            area_m2 += f64::from(tree.half_area_m2(node));
            let bounds = match tree.nodes[node].below {
                Below::Triangle(triangle) => {
                    found[index(triangle)] += 1;
                    boxes[index(triangle)]
                }
                Below::Pair(first) => {
                    open.extend([index(first), index(first) + 1]);
                    tree.nodes[index(first)].bounds.union(&tree.nodes[index(first) + 1].bounds)
                }
            };
            assert_eq!(tree.nodes[node].bounds, bounds, "{name}: node {node}");
        }
        assert!(found.iter().all(|&count| count == 1), "{name}");
        area_m2
    }

    #[test]
    fn moves_lessen_the_surface_and_keep_the_tree_whole() {
        let cases = [
            ("one", nested(1)),
            ("two", nested(2)),
            ("three", nested(3)),
            ("many within one another", nested(100_000)),
            ("ever smaller", ever_smaller(20_000)),
            ("equal", vec![cube(Vec3A::ZERO, 1.0); 5000]),
            ("far out", [1.0, 2.0, 3.0].map(|at| cube(Vec3A::splat(at * 1e38), 0.0)).to_vec()),
            ("scattered", scattered(5000, usize::MAX)),
            ("scattered among large ones", scattered(50_000, 10)),
        ];
        for (name, boxes) in cases {
            let tree = cluster(&boxes);
            let before_m2 = checked(name, &boxes, &tree);
            let after_m2 = checked(name, &boxes, &reinsert(tree));
            assert!(after_m2 <= before_m2 || name == "far out", "{name}: {before_m2} to {after_m2}");
            assert!(after_m2 < 0.98 * before_m2 || name != "scattered", "{before_m2} to {after_m2}");
        }
    }

    /// The sum of half surfaces falls by what a move promises, as long as it moves alone.
    #[test]
    fn a_move_gains_what_it_promises() {
        let boxes = scattered(300, 10);
        let tree = cluster(&boxes);
        let before_m2 = checked("before", &boxes, &tree);
        let parents = parents(&tree);
        let mut tried = 0;
        for node in 1..tree.nodes.len() {
            let Some(found) = best_move(&tree, &parents, node, &mut Vec::new()) else { continue };
            let (mut moved, mut parents) = (tree.clone(), parents.clone());
            carry_out(&mut moved, &mut parents, found.node, found.to);
            let gain_m2 = before_m2 - checked("after", &boxes, &moved);
            assert!((gain_m2 - f64::from(found.gain_m2)).abs() < 1e-4 * before_m2, "{found:?}: {gain_m2}");
            tried += 1;
        }
        assert!(tried > 50, "{tried} moves");
    }
}
