//! Where the pictures of a material lie on its surfaces.

use gltf::json::extensions::texture::TextureTransform;
use serde::Deserialize;

/// Where on a surface its pictures lie.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Placing {
    pub set: u32,
    /// Rows of the matrix of KHR_texture_transform.
    rows: [[f32; 3]; 2],
}

impl Placing {
    /// The first set as it is.
    pub const UNMOVED: Self = Self { set: 0, rows: [[1.0, 0.0, 0.0], [0.0, 1.0, 0.0]] };

    /// Of any texture but that of normals.
    pub fn of_texture(info: &gltf::texture::Info<'_>) -> Self {
        let unmoved = Self { set: info.tex_coord(), ..Self::UNMOVED };
        info.texture_transform().map_or(unmoved, |moved| {
            let set = moved.tex_coord().unwrap_or(info.tex_coord());
            Self::moved(set, moved.offset(), moved.rotation(), moved.scale())
        })
    }

    /// Of a texture of normals, whose KHR_texture_transform the crate leaves as JSON.
    pub fn of_normals(info: &gltf::material::NormalTexture<'_>) -> Self {
        let unmoved = Self { set: info.tex_coord(), ..Self::UNMOVED };
        let moved = info.extension_value("KHR_texture_transform");
        let Some(moved) = moved.and_then(|moved| TextureTransform::deserialize(moved).ok()) else { return unmoved };
        Self::moved(moved.tex_coord.unwrap_or(unmoved.set), moved.offset.0, moved.rotation.0, moved.scale.0)
    }

    /// KHR_texture_transform: translation times rotation times scale; v points down, so positive angles turn counter-clockwise.
    fn moved(set: u32, [x, y]: [f32; 2], rotation: f32, [sx, sy]: [f32; 2]) -> Self {
        let (sine, cosine) = libm::sincosf(rotation);
        Self { set, rows: [[cosine * sx, sine * sy, x], [-sine * sx, cosine * sy, y]] }
    }

    /// Of a material: that of the first of its textures that are read.
    pub fn of_material(material: &gltf::Material<'_>) -> Self {
        let pbr = material.pbr_metallic_roughness();
        let of_texture = |info: gltf::texture::Info<'_>| Self::of_texture(&info);
        let of_colour = pbr.base_color_texture().map(of_texture);
        let of_normals = || material.normal_texture().map(|info| Self::of_normals(&info));
        let of_others = || pbr.metallic_roughness_texture().or(material.emissive_texture()).map(of_texture);
        of_colour.or_else(of_normals).or_else(of_others).unwrap_or(Self::UNMOVED)
    }

    /// Texture coordinates of a vertex of the file.
    pub fn of(&self, [u, v]: [f32; 2]) -> [f32; 2] {
        self.rows.map(|[a, b, c]| a * u + b * v + c)
    }
}
