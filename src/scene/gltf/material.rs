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

/// Whether light passes: alpha below the cutoff, or none, where the file turns alpha on; or glass by the name that its converter left.
fn is_clear(material: &gltf::Material<'_>) -> bool {
    let alpha = material.pbr_metallic_roughness().base_color_factor()[3];
    let extras: Option<serde_json::Value> =
        material.extras().as_ref().and_then(|extras| serde_json::from_str(extras.get()).ok());
    let kind = extras.as_ref().and_then(|extras| extras.get("source_bsdf")).and_then(|kind| kind.as_str());
    let is_open = match material.alpha_mode() {
        AlphaMode::Opaque => false,
        AlphaMode::Mask => alpha < material.alpha_cutoff().unwrap_or(0.5),
        AlphaMode::Blend => alpha <= 0.0,
    };
    is_open || kind == Some("dielectric")
}

/// What alpha of a picture means.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Alpha {
    Ignored,
    /// Less of it is a hole.
    Least(f32),
    /// Times this, the share that is covered.
    Share(f32),
}

impl Alpha {
    fn of(material: &gltf::Material<'_>) -> Self {
        let alpha = material.pbr_metallic_roughness().base_color_factor()[3];
        let alpha = if alpha.is_finite() { alpha.clamp(0.0, 1.0) } else { 1.0 };
        match material.alpha_mode() {
            AlphaMode::Opaque => Self::Ignored,
            // What the factor takes from coverage, the cutoff must take as well.
            AlphaMode::Mask => {
                let cutoff = material.alpha_cutoff().unwrap_or(0.5);
                Self::Least(if alpha > 0.0 { cutoff / alpha } else { 0.0 })
            }
            AlphaMode::Blend => Self::Share(alpha),
        }
    }

    /// Tells it from others.
    fn key(self) -> (u8, u32) {
        match self {
            Self::Ignored => (0, 0),
            Self::Least(least) => (1, least.to_bits()),
            Self::Share(alpha) => (2, alpha.to_bits()),
        }
    }

    /// Whether anything is not wholly covered, and, if so, the holes.
    fn holes(self, [width, height]: [u32; 2], coverage: Vec<u8>, wrap: [Wrap; 2]) -> Option<CutOut> {
        let is_whole = coverage.iter().all(|&alpha| alpha == u8::MAX);
        match self {
            Self::Least(least) if !is_whole => Some(CutOut::new(width, height, coverage, wrap, least)),
            Self::Share(alpha) if !is_whole || alpha < 1.0 => {
                Some(CutOut::blended(width, height, coverage, wrap, alpha))
            }
            _ => None,
        }
    }
}

/// A material's name for messages.
pub fn called(material: &gltf::Material<'_>) -> String {
    match (material.name(), material.index()) {
        (Some(name), _) => format!("material '{name}'"),
        (None, Some(number)) => format!("material {number}"),
        (None, None) => "the default material".to_owned(),
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
    unread: &[Vec<String>],
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
            note_what_is_left_out(&material, unread, notes);
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
        culled: !material.double_sided(),
    }
}

/// Says what of a material has no effect. `unread`: names of extensions that are not read, by material.
fn note_what_is_left_out(material: &gltf::Material<'_>, unread: &[Vec<String>], notes: &mut Notes) {
    let whose = called(material);
    if material.unlit() {
        notes.add(format!("{whose} is unlit, and is lit like all others"));
    }
    let maps = [
        (material.normal_texture().is_some(), "normal"),
        (material.occlusion_texture().is_some(), "occlusion"),
        (
            material.pbr_metallic_roughness().metallic_roughness_texture().is_some(),
            "metallic-roughness (its factors count)",
        ),
    ];
    let names = maps.into_iter().filter(|(is_there, _)| *is_there).map(|(_, name)| name).collect::<Vec<_>>();
    if !names.is_empty() {
        notes.add(format!("{whose}: not read of its textures: {}", names.join(", ")));
    }
    let extensions = material.index().and_then(|number| unread.get(number)).filter(|names| !names.is_empty());
    if let Some(names) = extensions {
        notes.add(format!("{whose}: extensions not read: {}", names.join(", ")));
    }
}

/// Decodes pictures once for each texture and level of holes.
struct Pictures<'a, 'b> {
    buffers: &'a Buffers<'b>,
    files: &'a Files<'a>,
    budget: Budget,
    /// Texture and holes in the mesh, by texture of the file and what its alpha means.
    textures: BTreeMap<(usize, (u8, u32)), (u32, Option<u32>)>,
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
            let (texture, cut_out) = self.texture(&info.texture(), Alpha::of(material), mesh)?;
            (read.texture, read.cut_out) = (Some(texture), cut_out);
        } else if let Some(holes) = Alpha::of(material).holes([1, 1], vec![u8::MAX], [Wrap::Repeat; 2]) {
            mesh.cut_outs.push(holes);
            read.cut_out = Some(u32_from(mesh.cut_outs.len() - 1));
        }
        if read.cut_out.is_some() && material.alpha_mode() == AlphaMode::Blend {
            notes.add(format!("{} is blended: it stops as large a share of rays as its alpha says", called(material)));
        }
        if let Some(info) = material.emissive_texture().filter(|_| read.is_emissive()) {
            let mean = self.decoded(&info.texture())?.mean();
            for (band, mean) in read.emission.iter_mut().zip(with_infrared(mean)) {
                *band *= mean;
            }
            notes.add(format!("{}: its emissive texture is read as the mean of its texels", called(material)));
        }
        Ok(())
    }

    fn texture(
        &mut self,
        texture: &gltf::Texture<'_>,
        alpha: Alpha,
        mesh: &mut Mesh,
    ) -> Result<(u32, Option<u32>), String> {
        let key = (texture.index(), alpha.key());
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
        let least = match alpha {
            Alpha::Least(least) => crate::num::low_u8(crate::num::u32_truncated_f32((255.0 * least).clamp(0.0, 255.0))),
            _ => 0,
        };
        let holes = alpha.holes(picture.size_px, picture.alpha.clone(), wrap);
        if holes.is_some() {
            picture = picture.bled(least.max(1));
        }
        mesh.textures.push(picture.texture(wrap));
        let cut_out = holes.map(|holes| {
            mesh.cut_outs.push(holes);
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
