//! Which nodes of a binary tree become the wide nodes and the blocks: the choice of least expected cost (Ylitie, Karras and Laine 2017,
//! "Efficient incoherent ray traversal on GPUs through compressed wide BVHs", section 3.2).

use super::tree::{Below, Tree};
use crate::num::u32_from;

/// Children of a node.
pub const CHILDREN: usize = 8;

/// Triangles of a block.
pub const BLOCK: usize = 8;

/// What a node of the binary tree costs at least, with all below it, and how. The costs of a wide node and of a block are the chance that
/// a ray meets them: both test eight boxes or triangles at a time. So whatever fits a block becomes one.
#[derive(Clone, Copy)]
struct Choice {
    /// With one, two, ... slots in the wide node above.
    cost: [f32; CHILDREN],
    /// How many of those slots its first child has; 0 where one slot fewer costs no more.
    first_has: [u8; CHILDREN],
    /// If it becomes a wide node: how many of that node's slots its first child has.
    first_has_within: u8,
    /// Triangles below.
    triangles: u32,
    /// Whether it becomes a block.
    is_block: bool,
}

/// The choice for each node of a tree.
pub struct Choices<'a> {
    tree: &'a Tree,
    choices: Vec<Choice>,
}

impl<'a> Choices<'a> {
    /// Weighs a tree from its leaves up, which must hold a triangle each.
    pub fn new(tree: &'a Tree) -> Self {
        let mut choices = vec![leaf(0.0); tree.nodes.len()];
        for node in parents_first(tree).into_iter().rev() {
            let area_m2 = tree.half_area_m2(node);
            choices[node] = tree
                .pair(node)
                .map_or_else(|| leaf(area_m2), |below| inner(area_m2, below.map(|child| &choices[child])));
        }
        Self { tree, choices }
    }

    /// Whether a node becomes a block.
    pub fn is_block(&self, node: usize) -> bool {
        self.choices[node].is_block
    }

    /// Children of a node that becomes a wide one.
    pub fn children(&self, node: usize) -> Vec<usize> {
        let mut found = Vec::with_capacity(CHILDREN);
        let mut open = vec![(node, self.choices[node].first_has_within, CHILDREN)];
        while let Some((node, first_has, slots)) = open.pop() {
            let below = self.tree.pair(node).expect("only inner nodes share out slots");
            for (child, mut slots) in below.into_iter().zip([usize::from(first_has), slots - usize::from(first_has)]) {
                let first_has = &self.choices[child].first_has;
                while slots > 1 && first_has[slots - 1] == 0 {
                    slots -= 1;
                }
                if slots == 1 {
                    found.push(child);
                } else {
                    open.push((child, first_has[slots - 1], slots));
                }
            }
        }
        found
    }

    /// Triangles below a node.
    pub fn triangles(&self, node: usize) -> Vec<u32> {
        let mut found = Vec::with_capacity(BLOCK);
        let mut open = vec![node];
        while let Some(node) = open.pop() {
            match self.tree.nodes[node].below {
                Below::Triangle(triangle) => found.push(triangle),
                Below::Pair(_) => open.extend(self.tree.pair(node).into_iter().flatten().rev()),
            }
        }
        found
    }
}

fn leaf(area_m2: f32) -> Choice {
    Choice { cost: [area_m2; CHILDREN], first_has: [0; CHILDREN], first_has_within: 0, triangles: 1, is_block: true }
}

fn inner(area_m2: f32, [first, second]: [&Choice; 2]) -> Choice {
    // The best way to share out some slots between the two.
    let shared = |slots: usize| {
        let mut best = (f32::INFINITY, 1);
        for (has, own) in (1..slots).zip(1..) {
            let cost = first.cost[has - 1] + second.cost[slots - has - 1];
            if cost < best.0 {
                best = (cost, own);
            }
        }
        best
    };
    let (below, first_has_within) = shared(CHILDREN);
    let triangles = first.triangles + second.triangles;
    let is_block = triangles <= u32_from(BLOCK);
    let alone = if is_block { area_m2 } else { area_m2 + below };
    let (mut cost, mut first_has) = ([alone; CHILDREN], [0; CHILDREN]);
    for slots in 2..=CHILDREN {
        let (shared, has) = shared(slots);
        let is_less = shared < cost[slots - 2];
        cost[slots - 1] = if is_less { shared } else { cost[slots - 2] };
        first_has[slots - 1] = if is_less { has } else { 0 };
    }
    Choice { cost, first_has, first_has_within, triangles, is_block }
}

fn parents_first(tree: &Tree) -> Vec<usize> {
    let mut found = vec![0];
    let mut seen = 0;
    while let Some(&node) = found.get(seen) {
        found.extend(tree.pair(node).into_iter().flatten());
        seen += 1;
    }
    found
}

#[cfg(test)]
mod tests {
    use glam::Vec3A;

    use super::super::cluster::cluster;
    use super::super::tree::Bounds;
    use super::*;
    use crate::draw::DrawKey;
    use crate::num::{f32_nearest, u64_from};
    use crate::scene::chance::pair;

    /// The least cost of a node and all below it in one slot, by trying every set of at most eight nodes as its children.
    fn by_trying_all(tree: &Tree, node: usize) -> f32 {
        let Some(below) = tree.pair(node).filter(|_| leaves(tree, node) > BLOCK) else {
            return tree.half_area_m2(node);
        };
        let sets = sets(tree, below[0])
            .into_iter()
            .flat_map(|first| sets(tree, below[1]).into_iter().map(move |second| [&first[..], &second[..]].concat()));
        let cost = |set: Vec<usize>| set.into_iter().map(|child| by_trying_all(tree, child)).sum::<f32>();
        tree.half_area_m2(node) + sets.filter(|set| set.len() <= CHILDREN).map(cost).fold(f32::INFINITY, f32::min)
    }

    /// All sets of nodes that stand for a node.
    fn sets(tree: &Tree, node: usize) -> Vec<Vec<usize>> {
        let mut found = vec![vec![node]];
        if let Some([first, second]) = tree.pair(node) {
            for a in sets(tree, first) {
                found.extend(sets(tree, second).into_iter().map(|b| [&a[..], &b[..]].concat()));
            }
        }
        found
    }

    fn leaves(tree: &Tree, node: usize) -> usize {
        tree.pair(node).map_or(1, |below| below.map(|child| leaves(tree, child)).iter().sum())
    }

    /// The cost of what the choices say: a node, its children and all below them.
    fn of_choices(choices: &Choices<'_>, node: usize) -> f32 {
        let area_m2 = choices.tree.half_area_m2(node);
        if choices.is_block(node) {
            assert!(choices.triangles(node).len() <= BLOCK);
            return area_m2;
        }
        let children = choices.children(node);
        assert!((2..=CHILDREN).contains(&children.len()));
        area_m2 + children.into_iter().map(|child| of_choices(choices, child)).sum::<f32>()
    }

    #[test]
    fn no_other_choice_costs_less() {
        let mut wide = 0;
        for case in 0..60_u64 {
            let count = 2 + usize::try_from(case % 15).unwrap();
            let boxes: Vec<Bounds> = (0..count)
                .map(|n| {
                    let key = DrawKey::root(31).with(case).with(u64_from(n));
                    let ([x, y], [z, size]) = (pair(key, 0), pair(key, 1));
                    let least_m = Vec3A::new(f32_nearest(x), f32_nearest(y), f32_nearest(z));
                    Bounds { least_m, greatest_m: least_m + f32_nearest(0.5 * size * size) }
                })
                .collect();
            let tree = cluster(&boxes);
            let choices = Choices::new(&tree);
            let [least, own, said] = [by_trying_all(&tree, 0), of_choices(&choices, 0), choices.choices[0].cost[0]];
            assert!(
                (own - least).abs() <= 1e-5 * least && (said - least).abs() <= 1e-5 * least,
                "{case}: {own}, {least}"
            );
            wide += usize::from(!choices.is_block(0));
        }
        assert!(wide > 25, "{wide} trees with wide nodes");
    }
}
