//! Reads glTF files (`.glb` or `.gltf`) into a scene, with notes on what was left out or repaired.
//!
//! Read: nested nodes and instances (EXT_mesh_gpu_instancing), triangles, strips and fans, dense, sparse and quantized accessors,
//! positions, normals (flat where there are none), any set of texture coordinates with KHR_texture_transform, base colour with PNG
//! or JPEG pictures from the file, from `data:` URIs or from its folder, maps of normals, metallic-roughness and emission, thin
//! transmission, vertex colours, coverage (alpha), sidedness, lights, cameras, and what the first animation moves rigidly, as separate
//! parts. Left out, each with a note: materials' other extensions, other animations, scale and morph weights of the first, skins, morph
//! targets, points and lines. Transparent materials (no alpha, or marked dielectric) are dropped, so light passes.
//! A file may be hostile: every offset, count and index is checked before it is used, and no allocation is larger than a
//! scene may be.

mod accessor;
mod animation;
mod buffers;
mod container;
mod content;
mod lights;
mod material;
mod node;
mod pictures;
mod placing;
mod reader;

use super::Surroundings;
use super::animation::JointChain;
use super::closed::make_closed_surfaces_one_sided;
use super::file_units::FileUnits;
use super::geometry::{MovingScene, Scene};
use super::mesh::Mesh;
use super::source::Read;
use crate::error::Error;
use buffers::Buffers;
pub(super) use content::Content;
pub use content::Notes;

impl Scene {
    /// Reads a binary glTF file that needs no others, unchanged: no sky, lamps as strong as stated. `name` is its name in messages. Gives
    /// `Error::Content` with the file's name, what is wrong with it and where.
    pub fn from_glb(name: &str, bytes: &[u8]) -> Result<Self, Error> {
        Self::from_gltf_in(name, bytes, &FileUnits::default(), &Surroundings::default(), &|file| {
            Err(Error::content(file, "is outside the file; use a .glb with everything embedded"))
        })
    }

    /// Reads a glTF file, binary or not, and puts it into its surroundings. `read` takes paths as the scenario does: those of the
    /// file's own folder are put before names in it.
    pub fn from_gltf_in(
        name: &str,
        bytes: &[u8],
        units: &FileUnits,
        surroundings: &Surroundings,
        read: Read<'_>,
    ) -> Result<Self, Error> {
        let content = content_in(name, bytes, units, read)?;
        let mut mesh = content.mesh;
        if mesh.triangles.is_empty() && !content.moving.is_empty() {
            let reason = "its animation moves all of it; use it as a [[scene.object]] in a scene that stands";
            return Err(Error::content(name, reason));
        }
        surroundings.furnish(&mut mesh);
        make_closed_surfaces_one_sided(&mut mesh);
        let mut scene = Self::new(name, mesh, super::light::with_infrared(surroundings.sky))?;
        (scene.viewpoints, scene.notes) = (content.viewpoints, content.notes);
        scene.moving = moving_scenes(content.moving)?;
        Ok(scene)
    }

    /// Reads a glTF file as an object: the part that stands in it, if there is one, and those that its animation moves. The first part
    /// has the notes.
    pub fn parts_from_gltf(
        name: &str,
        bytes: &[u8],
        units: &FileUnits,
        read: Read<'_>,
    ) -> Result<Vec<MovingScene>, Error> {
        let content = content_in(name, bytes, units, read)?;
        let mut parts = moving_scenes(content.moving)?;
        if parts.is_empty() || !content.mesh.triangles.is_empty() {
            let mut mesh = content.mesh;
            make_closed_surfaces_one_sided(&mut mesh);
            let shape = Self::new(name, mesh, Default::default())?;
            parts.insert(0, MovingScene { name: name.to_owned(), chain: JointChain::default(), shape });
        }
        parts[0].shape.notes = content.notes;
        Ok(parts)
    }
}

fn content_in(name: &str, bytes: &[u8], units: &FileUnits, read: Read<'_>) -> Result<Content, Error> {
    let folder = name.rsplit_once('/').map_or(String::new(), |(folder, _)| format!("{folder}/"));
    let read = |file: &str| read(&format!("{folder}{file}"));
    content(bytes, units, &read).map_err(|reason| Error::content(name, reason))
}

fn moving_scenes(parts: Vec<content::MovingPart>) -> Result<Vec<MovingScene>, Error> {
    let scene = |content::MovingPart { name, chain, mut mesh }| {
        make_closed_surfaces_one_sided(&mut mesh);
        Ok(MovingScene { shape: Scene::new(&name, mesh, Default::default())?, name, chain })
    };
    parts.into_iter().map(scene).collect()
}

fn content(bytes: &[u8], units: &FileUnits, read: Read<'_>) -> Result<Content, String> {
    let container = container::open(bytes)?;
    let (mut mesh, mut notes) = (Mesh::default(), Notes::default());
    for name in &container.ignored {
        notes.add(format!("the extension {name} is not read"));
    }
    let buffers = Buffers::of(&container.document, container.binary, read)?;
    let tracks = animation::read(&container.document, &buffers, &mut notes)?;
    let kinds = material::read_all(&container.document, &buffers, read, &container.unread, &mut mesh, &mut notes)?;
    let scene =
        container.document.default_scene().or_else(|| container.document.scenes().next()).ok_or("it has no scene")?;
    let mut reader = reader::Reader::new(&container, &buffers, kinds, mesh, tracks, notes);
    for node in scene.nodes() {
        reader.node(&node, &node::NodeTransform::root(units.world_from_file()), 0)?;
    }
    Ok(reader.content())
}
