//! The binary tree that the wide one is made from: boxes, nodes and what is asked of them.

use glam::Vec3A;

use crate::num::index;

/// A box.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Bounds {
    /// Its least coordinates.
    pub least_m: Vec3A,
    /// Its greatest coordinates.
    pub greatest_m: Vec3A,
}

impl Bounds {
    /// Holds nothing.
    pub const EMPTY: Self = Self { least_m: Vec3A::INFINITY, greatest_m: Vec3A::NEG_INFINITY };

    /// The least box around both.
    #[inline]
    #[must_use]
    pub fn union(self, other: &Self) -> Self {
        Self { least_m: self.least_m.min(other.least_m), greatest_m: self.greatest_m.max(other.greatest_m) }
    }

    /// Half its surface, to which the chance that a ray meets it is proportional.
    #[inline]
    pub fn half_area_m2(&self) -> f32 {
        let size_m = self.greatest_m - self.least_m;
        size_m.x * size_m.y + size_m.y * size_m.z + size_m.z * size_m.x
    }
}

/// A box and what is in it.
#[derive(Clone, Copy, Debug)]
pub struct Node {
    /// Around all below.
    pub bounds: Bounds,
    /// What is below.
    pub below: Below,
}

/// What is in a node.
#[derive(Clone, Copy, Debug)]
pub enum Below {
    /// This triangle.
    Triangle(u32),
    /// Two nodes: this one and the next.
    Pair(u32),
}

/// A tree of a triangle a leaf. The root is the first node; the others stand in pairs after it.
#[derive(Clone, Debug)]
pub struct Tree {
    /// Its nodes, one less than twice the triangles.
    pub nodes: Vec<Node>,
}

impl Tree {
    /// The two children of an inner node.
    #[inline]
    pub fn pair(&self, node: usize) -> Option<[usize; 2]> {
        match self.nodes[node].below {
            Below::Triangle(_) => None,
            Below::Pair(first) => Some([index(first), index(first) + 1]),
        }
    }

    /// Half the surface of a node's box.
    #[inline]
    pub fn half_area_m2(&self, node: usize) -> f32 {
        self.nodes[node].bounds.half_area_m2()
    }

    /// Nodes from the root to the deepest leaf, both counted.
    #[cfg(test)]
    pub fn levels(&self) -> usize {
        let mut deepest = 0;
        let mut open = vec![(0, 1)];
        while let Some((node, level)) = open.pop() {
            deepest = deepest.max(level);
            open.extend(self.pair(node).into_iter().flatten().map(|child| (child, level + 1)));
        }
        deepest
    }
}
