//! Materials and pictures of a glTF file. Enters: its JSON and binary chunk. Leaves: checked materials and textures.

use std::io::Cursor;

use gltf::material::AlphaMode;
use gltf::texture::WrappingMode;
use image::{ImageFormat, ImageReader, Limits};

use super::super::light::with_infrared;
use super::super::mesh::Material;
use super::super::texture::{Texture, Wrap};
use super::accessor::Buffer;
use crate::num::u32_from;

/// Edge of a picture at most.
const EDGE_PX_MAX: u32 = 8_192;
/// Texels of all pictures together at most: 400 MB as they are kept.
const TEXELS_MAX: u64 = 1 << 26;

/// Whether light passes: alpha below a half where the file turns alpha on, or glass by the name that its converter left.
pub fn is_clear(material: &gltf::Material<'_>) -> bool {
    let alpha = material.pbr_metallic_roughness().base_color_factor()[3];
    let by_alpha = match material.alpha_mode() {
        AlphaMode::Opaque => false,
        AlphaMode::Mask => alpha < material.alpha_cutoff().unwrap_or(0.5),
        AlphaMode::Blend => alpha < 0.5,
    };
    let extras: Option<serde_json::Value> =
        material.extras().as_ref().and_then(|extras| serde_json::from_str(extras.get()).ok());
    let kind = extras.as_ref().and_then(|extras| extras.get("source_bsdf")).and_then(|kind| kind.as_str());
    by_alpha || kind == Some("dielectric")
}

/// One material; numbers outside their range are brought into it.
pub fn read(material: &gltf::Material<'_>) -> Material {
    let pbr = material.pbr_metallic_roughness();
    let [r, g, b, _] = pbr.base_color_factor();
    let strength = material.emissive_strength().unwrap_or(1.0);
    let sound = |value: f32, most: f32| if value.is_finite() { value.clamp(0.0, most) } else { 0.0 };
    Material {
        name: material.name().unwrap_or("").to_owned(),
        base_colour: with_infrared([r, g, b].map(|band| sound(band, 1.0))),
        texture: pbr.base_color_texture().map(|info| u32_from(info.texture().index())),
        emission: with_infrared(material.emissive_factor().map(|band| sound(band * strength, 1e12))),
        metallic: sound(pbr.metallic_factor(), 1.0),
        roughness: sound(pbr.roughness_factor(), 1.0),
        cut_out: None,
        double_sided: material.double_sided(),
    }
}

/// All textures of the file, in its order. Pictures that no base colour uses are not decoded: one texel stands in their place.
pub fn textures(document: &gltf::Document, buffer: &Buffer<'_>) -> Result<Vec<Texture>, String> {
    let mut used = vec![false; document.textures().len()];
    for material in document.materials() {
        if let Some(info) = material.pbr_metallic_roughness().base_color_texture() {
            used[info.texture().index()] = true;
        }
    }
    let mut texels = 0;
    let mut textures = Vec::with_capacity(used.len());
    for texture in document.textures() {
        let sampler = texture.sampler();
        let wrap = [sampler.wrap_s(), sampler.wrap_t()].map(|mode| match mode {
            WrappingMode::Repeat => Wrap::Repeat,
            WrappingMode::MirroredRepeat => Wrap::Mirror,
            WrappingMode::ClampToEdge => Wrap::Clamp,
        });
        textures.push(if used[texture.index()] {
            picture(&texture.source(), buffer, wrap, &mut texels)
                .map_err(|reason| format!("image {}: {reason}", texture.source().index()))?
        } else {
            Texture::from_srgb(1, 1, &[[255; 3]], wrap)
        });
    }
    Ok(textures)
}

/// Decodes a picture whose size was taken from its header and found bearable.
fn picture(
    source: &gltf::Image<'_>,
    buffer: &Buffer<'_>,
    wrap: [Wrap; 2],
    texels: &mut u64,
) -> Result<Texture, String> {
    let gltf::image::Source::View { view, .. } = source.source() else {
        return Err("it lies outside the file; a .glb with everything embedded would do".to_owned());
    };
    let bytes = buffer.view(&view)?;
    let reader = || {
        let reader = ImageReader::new(Cursor::new(bytes)).with_guessed_format().map_err(|error| error.to_string())?;
        match reader.format() {
            Some(ImageFormat::Png | ImageFormat::Jpeg) => Ok(reader),
            _ => Err("it is neither PNG nor JPEG".to_owned()),
        }
    };
    let (width, height) = reader()?.into_dimensions().map_err(|error| error.to_string())?;
    *texels += u64::from(width) * u64::from(height);
    if width.max(height) > EDGE_PX_MAX || *texels > TEXELS_MAX || width.min(height) == 0 {
        return Err(format!(
            "{width} x {height} px; up to {EDGE_PX_MAX} an edge and {TEXELS_MAX} texels in all would do"
        ));
    }
    let mut decoder = reader()?;
    let mut limits = Limits::default();
    (limits.max_image_width, limits.max_image_height) = (Some(EDGE_PX_MAX), Some(EDGE_PX_MAX));
    decoder.limits(limits);
    let picture = decoder.decode().map_err(|error| error.to_string())?.into_rgb8();
    let codes: Vec<[u8; 3]> = picture.pixels().map(|pixel| pixel.0).collect();
    Ok(Texture::from_srgb(picture.width(), picture.height(), &codes, wrap))
}
