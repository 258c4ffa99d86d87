//! Which nodes of a binary tree become the wide nodes and the blocks: the choice of least expected cost (Ylitie, Karras and Laine 2017,
//! "Efficient incoherent ray traversal on GPUs through compressed wide BVHs", section 3.2).

use obvhs::bvh2::Bvh2;

use crate::num::{index, u32_from};

/// Children of a node.
pub const CHILDREN: usize = 8;

/// Triangles of a block.
pub const BLOCK: usize = 8;

/// Cost of a block in units of a node: both test eight at a time.
const BLOCK_COST: f32 = 1.0;

/// What a node of the binary tree costs at least, with all below it, and how.
#[derive(Clone, Copy)]
struct Choice {
    /// With one, two, ... places in the wide node above.
    cost: [f32; CHILDREN],
    /// How many of those places its first child has. 0 where the node needs no more than the places before.
    first_has: [u8; CHILDREN],
    /// How many of its own places the first child has if it becomes a wide node.
    first_has_within: u8,
    /// Triangles below.
    triangles: u32,
    /// Whether it becomes a block.
    is_block: bool,
}

/// The choice for each node of a tree.
pub struct Choices<'a> {
    tree: &'a Bvh2,
    choices: Vec<Choice>,
}

impl<'a> Choices<'a> {
    /// Weighs a tree from its leaves up, which must hold a triangle each.
    pub fn new(tree: &'a Bvh2) -> Self {
        let mut choices = vec![leaf(0.0); tree.nodes.len()];
        for node in parents_first(tree).into_iter().rev() {
            let area_m2 = tree.nodes[node].aabb().half_area();
            choices[node] = pair(tree, node)
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
        while let Some((node, first_has, places)) = open.pop() {
            let below = pair(self.tree, node).expect("only inner nodes share out places");
            for (child, mut places) in below.into_iter().zip([usize::from(first_has), places - usize::from(first_has)])
            {
                let first_has = &self.choices[child].first_has;
                while places > 1 && first_has[places - 1] == 0 {
                    places -= 1;
                }
                if places == 1 {
                    found.push(child);
                } else {
                    open.push((child, first_has[places - 1], places));
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
            match pair(self.tree, node) {
                None => found.push(self.tree.primitive_indices[index(self.tree.nodes[node].first_index)]),
                Some([first, second]) => open.extend([second, first]),
            }
        }
        found
    }
}

fn leaf(area_m2: f32) -> Choice {
    let cost = [area_m2 * BLOCK_COST; CHILDREN];
    Choice { cost, first_has: [0; CHILDREN], first_has_within: 0, triangles: 1, is_block: true }
}

fn inner(area_m2: f32, [first, second]: [&Choice; 2]) -> Choice {
    // The best way to share out some places between the two.
    let shared = |places: usize| {
        let mut best = (f32::INFINITY, 1);
        for (has, own) in (1..places).zip(1..) {
            let cost = first.cost[has - 1] + second.cost[places - has - 1];
            if cost < best.0 {
                best = (cost, own);
            }
        }
        best
    };
    let (below, first_has_within) = shared(CHILDREN);
    let triangles = first.triangles + second.triangles;
    let is_block = triangles <= u32_from(BLOCK) && BLOCK_COST * area_m2 <= area_m2 + below;
    let alone = if is_block { BLOCK_COST * area_m2 } else { area_m2 + below };
    let (mut cost, mut first_has) = ([alone; CHILDREN], [0; CHILDREN]);
    for places in 2..=CHILDREN {
        let (shared, has) = shared(places);
        let is_less = shared < cost[places - 2];
        cost[places - 1] = if is_less { shared } else { cost[places - 2] };
        first_has[places - 1] = if is_less { has } else { 0 };
    }
    Choice { cost, first_has, first_has_within, triangles, is_block }
}

/// The two children of an inner node.
fn pair(tree: &Bvh2, node: usize) -> Option<[usize; 2]> {
    let first = index(tree.nodes[node].first_index);
    (!tree.nodes[node].is_leaf()).then_some([first, first + 1])
}

fn parents_first(tree: &Bvh2) -> Vec<usize> {
    let mut found = vec![0];
    let mut seen = 0;
    while let Some(&node) = found.get(seen) {
        found.extend(pair(tree, node).into_iter().flatten());
        seen += 1;
    }
    found
}
