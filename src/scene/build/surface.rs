//! A surface's look, and the builder's parts.

use super::super::mesh::Mesh;

/// A material and how large its picture is.
#[derive(Clone, Copy, Debug)]
pub struct Surface {
    /// Material of the mesh.
    pub material: u32,
    /// Width of the picture in metres.
    pub tile_m: f32,
}

/// A mesh under construction.
#[derive(Debug, Default)]
pub struct Builder {
    /// What stands.
    pub mesh: Mesh,
}

/// Texture coordinates by the world's axes, in the plane that the normal is nearest to: neighbours in one plane share their picture.
pub fn world_uv(at_m: [f32; 3], normal: [f32; 3], tile_m: f32) -> [f32; 2] {
    let [x, y, z] = at_m.map(|coordinate| coordinate / tile_m);
    let [nx, ny, nz] = normal.map(f32::abs);
    if ny >= nx && ny >= nz {
        [x, z]
    } else if nx >= nz {
        [z, -y]
    } else {
        [x, -y]
    }
}
