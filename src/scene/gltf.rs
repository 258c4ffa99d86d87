//! glTF binary files. Enters: the bytes of a `.glb`. Leaves: a scene, or why not.
//!
//! Read: nested nodes, triangle primitives, positions, normals, the first texture coordinates, base colour with texture,
//! emission, sidedness, embedded PNG and JPEG, cameras. Left out, and why it does no harm: metallic and roughness act as
//! diffuse (see `scene`); transparent materials (alpha below a half, or marked dielectric) are dropped, so light passes;
//! animation, skins and emissive textures are ignored. A file may be hostile: every offset, count and index is checked
//! before it is used.

mod accessor;
mod material;
pub mod picture;

use glam::{DMat3, DMat4, DQuat, DVec3};
use gltf::mesh::Mode;
use gltf::{Node, Primitive, Semantic};

use super::mesh::{Mesh, Vertex};
use super::{Scene, Surroundings, Viewpoint};
use crate::error::Error;
use crate::num::{f32_nearest, index, u32_from};
use crate::pose::Pose;
use accessor::Buffer;

/// Nodes may be nested this deep.
const DEPTH_MAX: usize = 64;

/// Triangles of a scene at most, so that a small file that names one mesh a million times ends with an error.
const TRIANGLES_MAX: usize = 20_000_000;

impl Scene {
    /// Reads a binary glTF file as it is: no sky, lamps as strong as it says. `name` is what the user calls it.
    ///
    /// # Errors
    /// `Error::Content` with the file's name, what is wrong with it and where.
    pub fn from_glb(name: &str, bytes: &[u8]) -> Result<Self, Error> {
        Self::from_glb_in(name, bytes, &Surroundings::default())
    }
}

/// Geometry and cameras of a file.
pub(super) fn mesh_of(name: &str, bytes: &[u8]) -> Result<(Mesh, Vec<Viewpoint>), Error> {
    read(bytes).map_err(|reason| Error::Content { file: name.to_owned(), reason })
}

fn read(bytes: &[u8]) -> Result<(Mesh, Vec<Viewpoint>), String> {
    let (json, binary) = chunks(bytes)?;
    let document = document(json)?;
    let buffer = Buffer { binary };
    let mut mesh = Mesh { textures: material::textures(&document, &buffer)?, ..Mesh::default() };
    let mut clear = Vec::new();
    for material in document.materials() {
        clear.push(material::is_clear(&material));
        mesh.materials.push(material::read(&material));
    }
    // Primitives without a material get the last one: glTF's default is white and dull.
    mesh.materials.push(super::mesh::Material::plain("default", [1.0; 3]));
    clear.push(false);
    let mut reader = Reader { buffer, clear, mesh, viewpoints: Vec::new() };
    let scene = document.default_scene().or_else(|| document.scenes().next()).ok_or("it has no scene")?;
    for node in scene.nodes() {
        reader.node(&node, DMat4::IDENTITY, 0)?;
    }
    Ok((reader.mesh, reader.viewpoints))
}

/// The JSON part, every index in it within range.
fn document(json: &[u8]) -> Result<gltf::Document, String> {
    let refuse = |error: gltf::Error| format!("its JSON is not glTF 2.0: {error}");
    let root = gltf::Gltf::from_slice_without_validation(json).map_err(refuse)?.document.into_json();
    // The crate's own validation looks attributes up before it has checked them.
    let mut attributes = root.meshes.iter().flat_map(|mesh| &mesh.primitives).flat_map(|p| p.attributes.values());
    if let Some(bad) = attributes.find(|accessor| accessor.value() >= root.accessors.len()) {
        return Err(format!("an attribute names accessor {bad} of {}", root.accessors.len()));
    }
    gltf::Document::from_json(root).map_err(refuse)
}

/// The JSON and the binary chunk of a container.
fn chunks(bytes: &[u8]) -> Result<(&[u8], &[u8]), String> {
    if !bytes.starts_with(b"glTF") {
        return Err("it is not a binary glTF file (a .glb starts with 'glTF')".to_owned());
    }
    let word = |at: usize| {
        let word =
            bytes.get(at..at + 4).ok_or_else(|| format!("it ends within its header, after {} bytes", bytes.len()))?;
        Ok::<_, String>(index(u32::from_le_bytes(word.try_into().expect("four bytes were taken"))))
    };
    if word(4)? != 2 {
        return Err(format!("it is of version {}; version 2 would do", word(4)?));
    }
    let mut found: [Option<&[u8]>; 2] = [None, None];
    let mut at = 12_usize;
    while at < bytes.len() {
        let (length, kind) = (word(at)?, word(at + 4)?);
        let end = (at + 8).checked_add(length).filter(|&end| end <= bytes.len());
        let end = end.ok_or_else(|| {
            format!("it is cut off: a chunk at byte {at} has {length} bytes, the file {}", bytes.len())
        })?;
        let place = match kind {
            0x4E4F_534A => Some(0),
            0x004E_4942 => Some(1),
            _ => None,
        };
        if let Some(place) = place {
            found[place] = Some(&bytes[at + 8..end]);
        }
        at = end;
    }
    let json = found[0].ok_or("it has no JSON chunk")?;
    Ok((json, found[1].unwrap_or(&[])))
}

struct Reader<'a> {
    buffer: Buffer<'a>,
    /// Which materials light passes.
    clear: Vec<bool>,
    mesh: Mesh,
    viewpoints: Vec<Viewpoint>,
}

impl Reader<'_> {
    fn node(&mut self, node: &Node<'_>, world_from_parent: DMat4, depth: usize) -> Result<(), String> {
        if depth > DEPTH_MAX {
            return Err(format!("its nodes are nested deeper than {DEPTH_MAX}, or in a circle"));
        }
        let own = node.transform().matrix();
        let parent_from_node = DMat4::from_cols_array_2d(&own.map(|column| column.map(f64::from)));
        let world_from_node = world_from_parent * parent_from_node;
        if !world_from_node.is_finite() {
            return Err(format!("node {} has a transform that is not finite", node.index()));
        }
        if let Some(mesh) = node.mesh() {
            for primitive in mesh.primitives() {
                let place = format!("mesh {} primitive {}", mesh.index(), primitive.index());
                self.primitive(&primitive, world_from_node).map_err(|reason| format!("{place}: {reason}"))?;
            }
        }
        if node.camera().is_some() {
            let name = node.name().unwrap_or("camera").to_owned();
            self.viewpoints.extend(viewpoint(name, world_from_node));
        }
        for child in node.children() {
            self.node(&child, world_from_node, depth + 1)?;
        }
        Ok(())
    }

    fn primitive(&mut self, primitive: &Primitive<'_>, world_from_node: DMat4) -> Result<(), String> {
        let material = primitive.material().index().unwrap_or(self.mesh.materials.len() - 1);
        if primitive.mode() != Mode::Triangles {
            return Err(format!("it is drawn as {:?}; triangles would do", primitive.mode()));
        }
        if self.clear[material] {
            return Ok(());
        }
        let positions = primitive.get(&Semantic::Positions).ok_or("it has no positions")?;
        let positions = self.buffer.floats::<3>(&positions)?;
        let triangles = self.triangles(primitive, positions.len())?;
        let normals = primitive.get(&Semantic::Normals).map(|a| self.buffer.floats::<3>(&a)).transpose()?;
        let uvs = primitive.get(&Semantic::TexCoords(0)).map(|a| self.buffer.floats::<2>(&a)).transpose()?;
        let turned = DMat3::from_mat4(world_from_node);
        // Cofactors turn normals, also of mirrored nodes, and exist where the inverse does not.
        let [x, y, z] = [turned.x_axis, turned.y_axis, turned.z_axis];
        let cofactors = DMat3::from_cols(y.cross(z), z.cross(x), x.cross(y));
        let wide = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
        let narrow = |v: DVec3| v.to_array().map(f32_nearest);
        let vertices: Vec<Vertex> = positions
            .iter()
            .enumerate()
            .map(|(number, &position)| {
                let normal = normals.as_ref().and_then(|normals| normals.get(number).copied()).unwrap_or([0.0; 3]);
                let uv = uvs.as_ref().and_then(|uvs| uvs.get(number).copied()).unwrap_or([0.0; 2]);
                let position_m = narrow(world_from_node.transform_point3(wide(position)));
                Vertex { position_m, normal: narrow(cofactors * wide(normal)), uv }
            })
            .collect();
        self.mesh.append(u32_from(material), &vertices, &triangles)
    }

    fn triangles(&self, primitive: &Primitive<'_>, vertices: usize) -> Result<Vec<[u32; 3]>, String> {
        let indices = match primitive.indices() {
            Some(accessor) => self.buffer.indices(&accessor)?,
            None => (0..u32_from(vertices)).collect(),
        };
        if indices.len() / 3 + self.mesh.triangles.len() > TRIANGLES_MAX {
            return Err(format!("the scene has more than {TRIANGLES_MAX} triangles"));
        }
        Ok(indices.chunks_exact(3).map(|corners| [corners[0], corners[1], corners[2]]).collect())
    }
}

/// glTF cameras look along -z with y up; ours look along +z with y down. None where the node's transform has no rotation.
fn viewpoint(name: String, world_from_node: DMat4) -> Option<Viewpoint> {
    let turned = DMat3::from_mat4(world_from_node);
    let z = -turned.z_axis.try_normalize()?;
    let x = (-turned.y_axis).cross(z).try_normalize()?;
    let rotation = DQuat::from_mat3(&DMat3::from_cols(x, z.cross(x), z)).normalize();
    Some(Viewpoint { name, world_from_camera: Pose::new(rotation, world_from_node.w_axis.truncate()) })
}

#[cfg(test)]
mod tests;
