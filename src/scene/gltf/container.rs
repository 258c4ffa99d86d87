//! The container of a glTF file. Reads the JSON with every index in range, the binary chunk, and what the `gltf` crate does not expose.

use std::borrow::Cow;
use std::collections::BTreeMap;

use gltf::json::Image;
use gltf::json::accessor::sparse::{Indices, Sparse, Values};
use gltf::json::accessor::{ComponentType, IndexComponentType};
use gltf::json::extensions::scene::khr_lights_punctual::{Light, Type};
use gltf::json::validation::{Checked, USize64};
use serde::Deserialize;
use serde::de::IgnoredAny;

/// Extensions that are read. Any other one that a file requires is refused by name, unless it only adds to the look of materials.
const READ: [&str; 7] = [
    "EXT_mesh_gpu_instancing",
    "KHR_lights_punctual",
    "KHR_materials_emissive_strength",
    "KHR_materials_transmission",
    "KHR_materials_unlit",
    "KHR_mesh_quantization",
    "KHR_texture_transform",
];

/// Extensions that hold geometry or pictures in a form that is not read, and what makes a file without them.
const REMEDIES: [(&str, &str); 5] = [
    ("KHR_draco_mesh_compression", "export the file without mesh compression (in Blender: Data, Compression off)"),
    ("EXT_meshopt_compression", "write the file without mesh compression (gltfpack without -c and -cc)"),
    ("KHR_meshopt_compression", "write the file without mesh compression (gltfpack without -c and -cc)"),
    ("KHR_texture_basisu", "write its textures as PNG or JPEG (gltfpack without -tc)"),
    ("EXT_texture_webp", "write its textures as PNG or JPEG"),
];

/// Whether a file without this extension shows the same surfaces, if not in the same look.
fn is_look(name: &str) -> bool {
    let starts = ["KHR_materials_", "EXT_materials_", "ADOBE_materials_", "MSFT_materials_"];
    starts.iter().any(|start| name.starts_with(start)) || matches!(name, "KHR_xmp_json_ld" | "KHR_animation_pointer")
}

/// Why a file cannot be read without an extension, and what to do.
fn refusal(name: &str) -> String {
    match REMEDIES.iter().find(|(known, _)| *known == name) {
        Some((_, remedy)) => format!("it needs the extension {name}, which is not read; {remedy}"),
        None => format!("it requires the extension {name}; use a file without it, or with one of {}", READ.join(", ")),
    }
}

/// A file taken apart.
pub struct Container<'a> {
    /// Its JSON, checked.
    pub document: gltf::Document,
    /// Its binary chunk; empty where it has none.
    pub binary: &'a [u8],
    /// Instancing of each node: accessor by attribute.
    pub instancing: Vec<Option<BTreeMap<String, usize>>>,
    /// Extensions that the file uses, that no material names, and that are not read.
    pub ignored: Vec<String>,
    /// Names of extensions of each material that are not read.
    pub unread: Vec<Vec<String>>,
}

/// The parts of the JSON that the `gltf` crate does not expose.
#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
struct Outline {
    asset: Asset,
    extensions_used: Vec<String>,
    extensions_required: Vec<String>,
    nodes: Vec<Extended<NodeExtensions>>,
    materials: Vec<Extended<Names>>,
    textures: Vec<OutlineTexture>,
    meshes: Vec<OutlineMesh>,
    accessors: Vec<OutlineAccessor>,
}

/// Versions are text, as in "2.0". A file that names the version that a reader needs at least may have any other.
#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
struct Asset {
    version: String,
    min_version: Option<String>,
}

impl Asset {
    /// Refuses what a reader of glTF 2.0 cannot read.
    fn check(&self) -> Result<(), String> {
        let needed = self.min_version.as_ref().unwrap_or(&self.version);
        if needed.is_empty() {
            return Err("it names no glTF version; 2.0 is read".to_owned());
        }
        let is_read = if self.min_version.is_some() { needed == "2.0" } else { needed.starts_with("2.") };
        let shown: String = needed.chars().take(VERSION_CHARS_MAX).collect();
        if is_read { Ok(()) } else { Err(format!("it is of glTF version {shown:?}; 2.0 is read")) }
    }
}

/// Something with extensions.
#[derive(Deserialize, Default)]
#[serde(default)]
struct Extended<E> {
    extensions: E,
}

type Names = BTreeMap<String, IgnoredAny>;

#[derive(Deserialize, Default)]
#[serde(default)]
struct OutlineTexture {
    source: Option<u64>,
    extensions: Names,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct OutlineMesh {
    primitives: Vec<OutlinePrimitive>,
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct OutlinePrimitive {
    attributes: BTreeMap<String, usize>,
    extensions: Names,
}

#[derive(Deserialize, Default)]
#[serde(default, rename_all = "camelCase")]
struct OutlineAccessor {
    buffer_view: Option<u64>,
    sparse: Option<IgnoredAny>,
}

impl Outline {
    /// The first extension without which something is missing.
    fn missing(&self) -> Option<&str> {
        let required = self.extensions_required.iter().map(String::as_str);
        let unread = required.filter(|name| !READ.contains(name) && !is_look(name));
        let picture = |texture: &&OutlineTexture| texture.source.is_none();
        let pictures = self.textures.iter().filter(picture).flat_map(|texture| texture.extensions.keys());
        let has_bytes = |number: &usize| {
            self.accessors.get(*number).is_none_or(|it| it.buffer_view.is_some() || it.sparse.is_some())
        };
        let packed = |it: &&OutlinePrimitive| it.attributes.get("POSITION").is_some_and(|number| !has_bytes(number));
        let primitives = self.meshes.iter().flat_map(|mesh| &mesh.primitives);
        let packed = primitives.filter(packed).flat_map(|primitive| primitive.extensions.keys());
        let known = |name: &&str| REMEDIES.iter().any(|(known, _)| known == name);
        unread.chain(pictures.chain(packed).map(String::as_str).filter(known)).next()
    }
}

#[derive(Deserialize, Default)]
#[serde(default)]
struct NodeExtensions {
    #[serde(rename = "EXT_mesh_gpu_instancing")]
    instancing: Option<Instancing>,
}

#[derive(Deserialize)]
struct Instancing {
    attributes: BTreeMap<String, usize>,
}

/// Objects of a file's JSON at most: one takes up to 300 bytes, however few it has in the file.
const OBJECTS_MAX: usize = 1_000_000;

/// Characters of a version at most that a reason repeats.
const VERSION_CHARS_MAX: usize = 20;

/// Characters of a reason at most: the crate names every fault of a file.
const REASON_CHARS_MAX: usize = 400;

/// Refuses JSON that would take far more memory than the file.
fn judge(json: &[u8]) -> Result<(), String> {
    let objects = json.iter().filter(|&&byte| byte == b'{').count();
    if objects > OBJECTS_MAX {
        return Err(format!("its JSON has {objects} objects; use {OBJECTS_MAX} or fewer"));
    }
    Ok(())
}

fn not_gltf(error: &impl std::fmt::Display) -> String {
    let words = error.to_string();
    let shortened: String = words.chars().take(REASON_CHARS_MAX).collect();
    let rest = if shortened.len() < words.len() { " ..." } else { "" };
    format!("its JSON is not glTF 2.0: {shortened}{rest}")
}

pub fn open(bytes: &[u8]) -> Result<Container<'_>, String> {
    // JSON may begin with a byte order mark.
    let bytes = bytes.strip_prefix(b"\xef\xbb\xbf").unwrap_or(bytes);
    let is_text = bytes.iter().find(|byte| !byte.is_ascii_whitespace()) == Some(&b'{');
    let (json, binary) = if is_text { (bytes, &[][..]) } else { chunks(bytes)? };
    judge(json)?;
    let outline: Outline = serde_json::from_slice(json).map_err(|error| not_gltf(&error))?;
    outline.asset.check()?;
    if let Some(missing) = outline.missing() {
        return Err(refusal(missing));
    }
    let is_unread = |name: &String| !READ.contains(&name.as_str());
    let unread_of = |material: Extended<Names>| material.extensions.into_keys().filter(is_unread).collect();
    let unread: Vec<Vec<String>> = outline.materials.into_iter().map(unread_of).collect();
    let used = outline.extensions_used.into_iter().chain(outline.extensions_required);
    let mut ignored: Vec<String> =
        used.filter(|name| is_unread(name) && !unread.iter().flatten().any(|it| it == name)).collect();
    ignored.dedup();
    let instancing = outline.nodes.into_iter().map(|node| node.extensions.instancing.map(|it| it.attributes)).collect();
    Ok(Container { document: document(json)?, binary, instancing, ignored, unread })
}

/// The JSON, every index in it within range, everything there that the crate takes for granted.
fn document(json: &[u8]) -> Result<gltf::Document, String> {
    let refuse = |error: gltf::Error| not_gltf(&error);
    let json = &*with_targets_only(json)?;
    let mut root = gltf::Gltf::from_slice_without_validation(json).map_err(refuse)?.document.into_json();
    // Judged above, with more of them known than to the crate.
    root.extensions_required.clear();
    // The crate's own validation looks attributes up before it has checked them.
    let mut attributes = root.meshes.iter().flat_map(|mesh| &mesh.primitives).flat_map(|p| p.attributes.values());
    if let Some(bad) = attributes.find(|accessor| accessor.value() >= root.accessors.len()) {
        return Err(format!("an attribute names accessor {bad} of {}", root.accessors.len()));
    }
    let has_source = |image: &Image| image.uri.is_some() || (image.buffer_view.is_some() && image.mime_type.is_some());
    if let Some(number) = root.images.iter().position(|image| !has_source(image)) {
        return Err(format!("image {number} has neither a uri nor a bufferView with a mimeType"));
    }
    let lights = root.extensions.iter().flat_map(|known| &known.khr_lights_punctual);
    let mut lights = lights.flat_map(|known| &known.lights);
    let is_open = |light: &Light| light.type_ == Checked::Valid(Type::Spot) && light.spot.is_none();
    if let Some(number) = lights.position(is_open) {
        return Err(format!("light {number} is a spot without a cone"));
    }
    if !root.buffer_views.is_empty() {
        let without_bytes = |it: &&mut gltf::json::Accessor| it.buffer_view.is_none() && it.sparse.is_none();
        root.accessors.iter_mut().filter(without_bytes).for_each(|it| it.sparse = Some(nothing_replaced()));
    }
    gltf::Document::from_json(root).map_err(refuse)
}

/// The JSON without channels of animations that name no node, as those of KHR_animation_pointer do: the format allows them, the crate not.
fn with_targets_only(json: &[u8]) -> Result<Cow<'_, [u8]>, String> {
    #[derive(Deserialize, Default)]
    #[serde(default)]
    struct Animated {
        animations: Vec<Channels>,
    }
    #[derive(Deserialize)]
    struct Channels {
        channels: Vec<BTreeMap<String, serde_json::Value>>,
    }
    let is_aimed = |target: Option<&serde_json::Value>| target.is_some_and(|target| target.get("node").is_some());
    // What is no animation is refused below, in the crate's words.
    let animated: Animated = serde_json::from_slice(json).unwrap_or_default();
    let mut channels = animated.animations.iter().flat_map(|animation| &animation.channels);
    if channels.all(|channel| is_aimed(channel.get("target"))) {
        return Ok(Cow::Borrowed(json));
    }
    let mut root: serde_json::Value = serde_json::from_slice(json).map_err(|error| not_gltf(&error))?;
    for animation in root["animations"].as_array_mut().into_iter().flatten() {
        if let Some(channels) = animation["channels"].as_array_mut() {
            channels.retain(|channel| is_aimed(channel.get("target")));
        }
    }
    serde_json::to_vec(&root).map(Cow::Owned).map_err(|error| not_gltf(&error))
}

/// No replacement of an accessor's zeros. The format lets an accessor have neither a view nor a sparse part, the crate does not.
fn nothing_replaced() -> Sparse {
    let view = gltf::json::Index::new(0);
    let component_type = Checked::Valid(IndexComponentType(ComponentType::U8));
    let (extensions, extras) = (None, None);
    let indices = Indices { buffer_view: view, byte_offset: USize64(0), component_type, extensions, extras };
    let values = Values { buffer_view: view, byte_offset: USize64(0), extensions: None, extras: None };
    Sparse { count: USize64(0), indices, values, extensions: None, extras: None }
}

/// The JSON and the binary chunk of a container.
fn chunks(bytes: &[u8]) -> Result<(&[u8], &[u8]), String> {
    if !bytes.starts_with(b"glTF") {
        return Err("it is not a glTF file (a .glb starts with 'glTF', a .gltf with '{')".to_owned());
    }
    let word = |at: usize| match bytes.get(at..).and_then(<[u8]>::first_chunk) {
        Some(word) => Ok(crate::num::index(u32::from_le_bytes(*word))),
        None => Err(format!("it ends within its header, after {} bytes", bytes.len())),
    };
    if word(4)? != 2 {
        return Err(format!("it is of version {}; use version 2", word(4)?));
    }
    if word(8)? > bytes.len() {
        return Err(format!("it is cut off: its header says {} bytes, it has {}", word(8)?, bytes.len()));
    }
    let (mut json, mut binary, mut at) = (None, &[][..], 12_usize);
    while at < bytes.len() {
        let (length, kind) = (word(at)?, word(at + 4)?);
        let Some(end) = (at + 8).checked_add(length).filter(|&end| end <= bytes.len()) else {
            return Err(format!("it is cut off: a chunk at byte {at} has {length} bytes, the file {}", bytes.len()));
        };
        match kind {
            0x4E4F_534A => json = Some(&bytes[at + 8..end]),
            0x004E_4942 => binary = &bytes[at + 8..end],
            _ => {}
        }
        at = end;
    }
    Ok((json.ok_or("it has no JSON chunk")?, binary))
}
