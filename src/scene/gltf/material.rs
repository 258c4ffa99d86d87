//! Reads materials and pictures of a glTF file: checked materials, textures, holes, and texture coordinates of each surface.

use std::collections::BTreeMap;

use gltf::image::Source;
use gltf::material::AlphaMode;
use gltf::texture::WrappingMode;

use super::super::cut_out::CutOut;
use super::super::light::with_infrared;
use super::super::mesh::{Material, Mesh};
use super::super::texture::Wrap;
use super::super::texture::picture::{Budget, Picture};
use super::buffers::{Buffers, fetched};
use super::content::{Files, Notes};
use crate::num::u32_from;

/// Where on a surface its picture lies.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placing {
    /// Set of texture coordinates.
    pub set: u32,
    /// Rows of the matrix of KHR_texture_transform.
    rows: [[f32; 3]; 2],
}

impl Placing {
    /// Texture coordinates of a vertex of the file.
    pub fn of(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        self.rows.map(|[a, b, c]| a * u + b * v + c)
    }
}

/// Properties of a material in the file beyond the material itself.
#[derive(Clone, Copy, Debug)]
pub struct MaterialMapping {
    /// Light passes: its triangles are left out.
    pub is_clear: bool,
    /// Of its picture.
    pub placing: Placing,
}

/// Whether light passes: alpha below a half where the file turns alpha on, or glass by the name that its converter left.
fn is_clear(material: &gltf::Material<'_>) -> bool {
    let alpha = material.pbr_metallic_roughness().base_color_factor()[3];
    let extras: Option<serde_json::Value> =
        material.extras().as_ref().and_then(|extras| serde_json::from_str(extras.get()).ok());
    let kind = extras.as_ref().and_then(|extras| extras.get("source_bsdf")).and_then(|kind| kind.as_str());
    cutoff(material).is_some_and(|cutoff| alpha < cutoff) || kind == Some("dielectric")
}

/// Coverage below which there is nothing, where the file turns alpha on.
fn cutoff(material: &gltf::Material<'_>) -> Option<f32> {
    match material.alpha_mode() {
        AlphaMode::Opaque => None,
        AlphaMode::Mask => Some(material.alpha_cutoff().unwrap_or(0.5)),
        AlphaMode::Blend => Some(0.5),
    }
}

/// Texture coordinates of the base colour.
fn placing(material: &gltf::Material<'_>) -> Placing {
    let unmoved = Placing { set: 0, rows: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] };
    let Some(info) = material.pbr_metallic_roughness().base_color_texture() else { return unmoved };
    let Some(moved) = info.texture_transform() else { return Placing { set: info.tex_coord(), ..unmoved } };
    // KHR_texture_transform: translation times rotation times scale; v points down, so positive angles turn counter-clockwise.
    let (sine, cosine) = libm::sincosf(moved.rotation());
    let ([x, y], [sx, sy]) = (moved.offset(), moved.scale());
    let rows = [[cosine * sx, sine * sy, x], [-sine * sx, cosine * sy, y]];
    Placing { set: moved.tex_coord().unwrap_or(info.tex_coord()), rows }
}

/// Reads all materials and the pictures that they use into a mesh. The last one is for primitives without: white and diffuse.
pub fn read_all(
    document: &gltf::Document,
    buffers: &Buffers<'_>,
    files: &Files<'_>,
    mesh: &mut Mesh,
    notes: &mut Notes,
) -> Result<Vec<MaterialMapping>, String> {
    let mut pictures = Pictures { buffers, files, budget: Budget::default(), textures: BTreeMap::new() };
    let mut kinds = Vec::new();
    for material in document.materials() {
        let is_clear = is_clear(&material);
        let mut read = plain(&material);
        if !is_clear {
            pictures.dress(&material, &mut read, mesh, notes)?;
            note_what_is_left_out(&material, notes);
        }
        mesh.materials.push(read);
        kinds.push(MaterialMapping { is_clear, placing: placing(&material) });
    }
    mesh.materials.push(Material::plain("default", [1.0; 3]));
    kinds.push(MaterialMapping {
        is_clear: false,
        placing: Placing { set: 0, rows: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] },
    });
    Ok(kinds)
}

/// One material without its pictures; numbers outside their range are brought into it.
fn plain(material: &gltf::Material<'_>) -> Material {
    let pbr = material.pbr_metallic_roughness();
    let [r, g, b, _] = pbr.base_color_factor();
    let strength = material.emissive_strength().unwrap_or(1.0);
    let sound = |value: f32, most: f32| if value.is_finite() { value.clamp(0.0, most) } else { 0.0 };
    Material {
        name: material.name().unwrap_or("").to_owned(),
        base_colour: with_infrared([r, g, b].map(|band| sound(band, 1.0))),
        texture: None,
        cut_out: None,
        emission: with_infrared(material.emissive_factor().map(|band| sound(band * strength, 1e12))),
        bulb: None,
        metallic: sound(pbr.metallic_factor(), 1.0),
        roughness: sound(pbr.roughness_factor(), 1.0),
        double_sided: material.double_sided(),
    }
}

fn note_what_is_left_out(material: &gltf::Material<'_>, notes: &mut Notes) {
    if material.unlit() {
        notes.add("unlit materials are lit like all others");
    }
    if material.normal_texture().is_some() {
        notes.add("normal maps are not read: surfaces are as smooth as their vertices say");
    }
    if material.pbr_metallic_roughness().metallic_roughness_texture().is_some() {
        notes.add("metallic and roughness are read as factors, not from pictures");
    }
}

/// Decodes pictures once for each texture and level of holes.
struct Pictures<'a, 'b> {
    buffers: &'a Buffers<'b>,
    files: &'a Files<'a>,
    budget: Budget,
    /// Texture and holes in the mesh, by texture of the file and bits of the cutoff.
    textures: BTreeMap<(usize, u32), (u32, Option<u32>)>,
}

impl Pictures<'_, '_> {
    /// Gives a material its pictures.
    fn dress(
        &mut self,
        material: &gltf::Material<'_>,
        read: &mut Material,
        mesh: &mut Mesh,
        notes: &mut Notes,
    ) -> Result<(), String> {
        let pbr = material.pbr_metallic_roughness();
        if let Some(info) = pbr.base_color_texture() {
            // What the factor takes from coverage, the cutoff must take as well.
            let alpha = pbr.base_color_factor()[3];
            let least = cutoff(material).map(|cutoff| if alpha > 0.0 { cutoff / alpha } else { 0.0 });
            let (texture, cut_out) = self.texture(&info.texture(), least, mesh)?;
            (read.texture, read.cut_out) = (Some(texture), cut_out);
            if cut_out.is_some() && material.alpha_mode() == AlphaMode::Blend {
                notes.add("blended pictures are cut out where they cover less than a half");
            }
        }
        if let Some(info) = material.emissive_texture().filter(|_| read.is_emissive()) {
            let mean = self.decoded(&info.texture())?.mean();
            for (band, mean) in read.emission.iter_mut().zip(with_infrared(mean)) {
                *band *= mean;
            }
            notes.add("surfaces with a glowing picture glow evenly, with the picture's mean");
        }
        Ok(())
    }

    fn texture(
        &mut self,
        texture: &gltf::Texture<'_>,
        least: Option<f32>,
        mesh: &mut Mesh,
    ) -> Result<(u32, Option<u32>), String> {
        let key = (texture.index(), least.map_or(u32::MAX, f32::to_bits));
        if let Some(&known) = self.textures.get(&key) {
            return Ok(known);
        }
        let sampler = texture.sampler();
        let wrap = [sampler.wrap_s(), sampler.wrap_t()].map(|mode| match mode {
            WrappingMode::Repeat => Wrap::Repeat,
            WrappingMode::MirroredRepeat => Wrap::Mirror,
            WrappingMode::ClampToEdge => Wrap::Clamp,
        });
        let mut picture = self.decoded(texture)?;
        let holes = least.filter(|_| picture.alpha.iter().any(|&alpha| alpha < u8::MAX));
        if let Some(least) = holes {
            let code = crate::num::low_u8(crate::num::u32_truncated_f32((255.0 * least).clamp(0.0, 255.0)));
            picture = picture.bled(code.max(1));
        }
        mesh.textures.push(picture.texture(wrap));
        let cut_out = holes.map(|least| {
            let [width, height] = picture.size_px;
            mesh.cut_outs.push(CutOut::new(width, height, picture.alpha, wrap, least));
            u32_from(mesh.cut_outs.len() - 1)
        });
        let made = (u32_from(mesh.textures.len() - 1), cut_out);
        self.textures.insert(key, made);
        Ok(made)
    }

    fn decoded(&mut self, texture: &gltf::Texture<'_>) -> Result<Picture, String> {
        let image = texture.source();
        let named = |reason: String| format!("image {}: {reason}", image.index());
        match image.source() {
            Source::View { view, .. } => Picture::decoded(self.buffers.view(&view).map_err(named)?, &mut self.budget),
            Source::Uri { uri, .. } => Picture::decoded(&fetched(uri, self.files).map_err(named)?, &mut self.budget),
        }
        .map_err(named)
    }
}
