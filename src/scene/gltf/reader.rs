//! State of a walk over the nodes of a glTF file.

use super::super::geometry::Viewpoint;
use super::super::mesh::Mesh;
use super::buffers::Buffers;
use super::container::Container;
use super::content::Notes;
use super::material::MaterialMapping;

/// What is read so far.
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
}
