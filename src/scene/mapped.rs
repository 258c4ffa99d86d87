//! What the maps of a material say of a triangle or of all of it: emission, and the most gloss that there is anywhere.

use super::light::{BANDS, Bands, luminance};
use super::mesh::{Material, Mesh};
use super::texture::Footprint;
use crate::num::{f32_from_u32, index};

/// Points along each side of a triangle at which its emission is looked up.
const EMISSION_STEPS: u32 = 8;

impl Mesh {
    /// Mean radiance of a triangle.
    pub fn emission_of(&self, triangle: usize) -> Bands {
        let material = &self.materials[index(self.material_of[triangle])];
        let Some((texture, factors)) = material.maps.emission else { return material.emission };
        let texture = &self.textures[index(texture)];
        let [a, b, c] = self.triangles[triangle].map(|corner| self.vertices[index(corner)].uv);
        let [width, height] = texture.size();
        let texels2 = 0.5 * ((b[0] - a[0]) * (c[1] - a[1]) - (b[1] - a[1]) * (c[0] - a[0])).abs() * width * height;
        let steps = f32_from_u32(EMISSION_STEPS);
        let texels = texels2.sqrt() / steps;
        let mut sum = [0.0; BANDS];
        let mut points = 0_u32;
        // Middles of the small triangles that parallels to its sides cut it into: those that stand as it does, and those between.
        for (row, column) in
            (0..EMISSION_STEPS).flat_map(|row| (0..EMISSION_STEPS - row).map(move |column| (row, column)))
        {
            for third in [1.0_f32, 2.0] {
                let [u, v] = [column, row].map(|step| (f32_from_u32(step) + third / 3.0) / steps);
                if u + v < 1.0 {
                    let uv = [0, 1].map(|axis| a[axis] + (b[axis] - a[axis]) * u + (c[axis] - a[axis]) * v);
                    let colour = texture.colour(uv, texels);
                    (0..BANDS).for_each(|band| sum[band] += colour[band]);
                    points += 1;
                }
            }
        }
        std::array::from_fn(|band| sum[band] / f32_from_u32(points) * factors[band])
    }

    /// Radiance at weights of a triangle's second and third corner.
    #[inline]
    pub(super) fn emission_at(&self, triangle: u32, [u, v]: [f32; 2]) -> Bands {
        let material = &self.materials[index(self.material_of[index(triangle)])];
        let Some((texture, factors)) = material.maps.emission else { return material.emission };
        let [a, b, c] = self.triangles[index(triangle)].map(|corner| self.vertices[index(corner)].uv);
        let uv = [0, 1].map(|axis| a[axis] + (b[axis] - a[axis]) * u + (c[axis] - a[axis]) * v);
        let colour = self.textures[index(texture)].over(uv, &Footprint::POINT);
        std::array::from_fn(|band| colour[band] * factors[band])
    }

    /// Whether a triangle emits light, beyond the last code of its map.
    pub(super) fn is_emissive(&self, triangle: usize) -> bool {
        let emission = luminance(self.emission_of(triangle).map(f64::from));
        match self.materials[index(self.material_of[triangle])].maps.emission {
            None => emission > 0.0,
            Some((_, factors)) => emission > luminance(factors.map(f64::from)) / 4096.0,
        }
    }

    /// The least roughness and the greatest metallic of a material anywhere.
    pub(super) fn glossiest(&self, material: &Material) -> [f32; 2] {
        let Some((texture, factors)) = material.maps.roughness_metallic else {
            return [material.roughness, material.metallic];
        };
        let [least, greatest] = self.textures[index(texture)].range();
        [factors[0] * least[1], factors[1] * greatest[2]]
    }

    /// Greatest radiance of a material anywhere.
    pub(super) fn greatest_emission(&self, material: &Material) -> Bands {
        let Some((texture, factors)) = material.maps.emission else { return material.emission };
        let [_, greatest] = self.textures[index(texture)].range();
        std::array::from_fn(|band| factors[band] * greatest[band])
    }
}
