//! Texture density: for each triangle, the texels per metre in the world.

use super::super::mesh::Mesh;
use super::data::LitScene;
use crate::num::{f32_nearest, index};

/// Texels a metre at most: finer than any picture that is looked at.
const SLOPE_MAX: f64 = 1e7;

/// Gradients of the texture coordinates, in texels of the finest level a metre, in the triangle's plane; zero without a texture. Empty
/// where no material has one.
pub fn of(mesh: &Mesh) -> Vec<[[f32; 3]; 2]> {
    if mesh.materials.iter().all(|material| material.texture.is_none()) {
        return Vec::new();
    }
    (0..mesh.triangles.len()).map(|triangle| of_triangle(mesh, triangle)).collect()
}

fn of_triangle(mesh: &Mesh, triangle: usize) -> [[f32; 3]; 2] {
    let Some(texture) = mesh.materials[index(mesh.material_of[triangle])].texture else { return [[0.0; 3]; 2] };
    let size = mesh.textures[index(texture)].size();
    let corners = mesh.triangles[triangle].map(|corner| &mesh.vertices[index(corner)]);
    let [a, b, c] = corners.map(|vertex| glam::DVec3::from_array(vertex.position_m.map(f64::from)));
    let (to_b, to_c) = (b - a, c - a);
    let normal = to_b.cross(to_c);
    let area2 = normal.length_squared();
    // Weights of the second and third corner grow by one from the opposite edge to the corner.
    let (weight_b, weight_c) = (to_c.cross(normal) / area2, normal.cross(to_b) / area2);
    [0, 1].map(|axis| {
        let texels = |from: usize| f64::from(corners[from].uv[axis] - corners[0].uv[axis]) * f64::from(size[axis]);
        let slope = weight_b * texels(1) + weight_c * texels(2);
        let is_sound = slope.is_finite() && slope.abs().max_element() < SLOPE_MAX;
        if is_sound { slope.to_array().map(f32_nearest) } else { [0.0; 3] }
    })
}

impl LitScene {
    /// Texels of a triangle's texture in a metre, in the mean over directions; 0 without one.
    #[inline(always)]
    pub fn texels_per_m(&self, triangle: u32) -> f32 {
        self.scene.layout.triangles[index(triangle)].texels_per_m
    }

    /// Whether any surface has a texture: without one, no footprint is needed.
    #[inline(always)]
    pub fn has_textures(&self) -> bool {
        self.has_textures
    }
}
