//! State of a walk over the nodes of a glTF file.

use std::ops::Range;

use glam::DMat4;

use super::super::animation::JointChain;
use super::super::geometry::Viewpoint;
use super::super::mesh::Mesh;
use super::animation::Tracks;
use super::buffers::Buffers;
use super::container::Container;
use super::content::Notes;
use super::material::MaterialMapping;

pub struct Reader<'a> {
    pub(super) container: &'a Container<'a>,
    pub(super) buffers: &'a Buffers<'a>,
    /// One for each material of the mesh as it was before the first primitive.
    pub(super) kinds: Vec<MaterialMapping>,
    pub(super) mesh: Mesh,
    pub(super) viewpoints: Vec<Viewpoint>,
    pub(super) notes: Notes,
    /// Nodes that were met: a tree meets each once.
    pub(super) met: Vec<bool>,
    pub(super) flattened: usize,
    /// What the file's animation moves.
    pub(super) tracks: Tracks,
    /// Parts that it moves, with the numbers of their triangles.
    pub(super) parts: Vec<Part>,
}

#[derive(Clone, Debug)]
pub struct Part {
    pub(super) name: String,
    pub(super) chain: JointChain,
    pub(super) triangles: Vec<Range<usize>>,
}

#[derive(Clone, Debug)]
pub struct NodeTransform {
    /// In the world, where nothing is animated.
    pub(super) world_from_node: DMat4,
    /// In the part that moves it; in the world where none does.
    pub(super) part_from_node: DMat4,
    pub(super) part: Option<usize>,
}

impl NodeTransform {
    pub fn root(world_from_file: DMat4) -> Self {
        Self { world_from_node: world_from_file, part_from_node: world_from_file, part: None }
    }

    pub(super) fn child(&self, node_from_child: DMat4) -> Self {
        Self {
            world_from_node: self.world_from_node * node_from_child,
            part_from_node: self.part_from_node * node_from_child,
            part: self.part,
        }
    }
}
