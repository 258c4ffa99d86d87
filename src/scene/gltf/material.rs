//! Reads materials and pictures of a glTF file: checked materials, textures, holes, and texture coordinates of each surface.

use gltf::material::AlphaMode;

use super::super::light::with_infrared;
use super::super::mesh::{Material, Mesh};
use super::super::source::Read;
use super::buffers::Buffers;
use super::content::Notes;
use super::pictures::{Pictures, called, sound};
use super::placing::Placing;

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

/// Reads all materials and the pictures that they use into a mesh. The last one is for primitives without: white and diffuse.
pub fn read_all(
    document: &gltf::Document,
    buffers: &Buffers<'_>,
    read: Read<'_>,
    unread: &[Vec<String>],
    mesh: &mut Mesh,
    notes: &mut Notes,
) -> Result<Vec<MaterialMapping>, String> {
    let mut pictures = Pictures::new(buffers, read);
    let mut kinds = Vec::new();
    for material in document.materials() {
        let is_clear = is_clear(&material);
        let mut made = plain(&material);
        if !is_clear {
            pictures.dress(&material, &mut made, mesh, notes)?;
            note_what_is_left_out(&material, unread, notes);
        }
        mesh.materials.push(made);
        kinds.push(MaterialMapping { is_clear, placing: Placing::of_material(&material) });
    }
    // After all base colours, which matter most where pictures are many.
    for (number, material) in document.materials().enumerate().filter(|(number, _)| !kinds[*number].is_clear) {
        pictures.add_maps(&material, number, mesh, notes)?;
    }
    mesh.materials.push(Material::plain("default", [1.0; 3]));
    kinds.push(MaterialMapping { is_clear: false, placing: Placing::UNMOVED });
    Ok(kinds)
}

/// One material without its pictures; numbers outside their range are brought into it.
fn plain(material: &gltf::Material<'_>) -> Material {
    let pbr = material.pbr_metallic_roughness();
    let [r, g, b, _] = pbr.base_color_factor();
    let strength = material.emissive_strength().unwrap_or(1.0);
    Material {
        emission: with_infrared(material.emissive_factor().map(|band| sound(band * strength, 1e12))),
        metallic: sound(pbr.metallic_factor(), 1.0),
        roughness: sound(pbr.roughness_factor(), 1.0),
        double_sided: material.double_sided(),
        culled: !material.double_sided(),
        ..Material::plain(material.name().unwrap_or(""), [r, g, b].map(|band| sound(band, 1.0)))
    }
}

/// Says what of a material has no effect. `unread`: names of extensions that are not read, by material.
fn note_what_is_left_out(material: &gltf::Material<'_>, unread: &[Vec<String>], notes: &mut Notes) {
    let whose = called(material);
    if material.unlit() {
        notes.add(format!("{whose} is unlit, and is lit like all others"));
    }
    let extensions = material.index().and_then(|number| unread.get(number)).filter(|names| !names.is_empty());
    if let Some(names) = extensions {
        notes.add(format!("{whose}: extensions not read: {}", names.join(", ")));
    }
}
