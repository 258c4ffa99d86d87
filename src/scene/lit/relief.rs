//! Surfaces with maps beside their base colour: emission texel by texel, and the light of a mapped normal.
//!
//! The bake knows the light of the smooth normal, and which part of it each of the strongest sources sends. Under a mapped normal a
//! source's part goes as the cosine to its middle. The rest counts as even over the hemisphere: a plane that is tilted by an
//! angle a sees the share (1 + cos a) / 2 of it.

use super::super::lanes::{Floats, LANES, Mask};
use super::super::light::{BANDS, Bands};
use super::super::maps::{mapped_normal, tangent_space};
use super::super::texture::{Footprint, Texture};
use super::super::vectors::{dot, unit};
use super::data::LitScene;
use super::shadows::{Relief, Shadows};
use super::surface::by_band;
use crate::num::index;

/// Texels of the maps of a triangle where rays met it.
pub struct MapTexels {
    /// What the emission is multiplied by.
    pub emission: Option<[Floats; BANDS]>,
    /// Of the normal map.
    pub normals: Option<[Bands; LANES]>,
}

impl MapTexels {
    /// Of a triangle without maps.
    pub const NONE: Self = Self { emission: None, normals: None };
}

impl LitScene {
    /// What the maps of a triangle have within a footprint on its base colour, from which the lanes differ by how far they are shifted.
    #[inline(always)]
    pub fn map_texels(
        &self,
        (triangle, colour): (u32, &Texture),
        uv: &[Floats; 2],
        (shift_texels, footprint): (&[Floats; 2], &Footprint),
        lanes: Mask,
    ) -> MapTexels {
        let mesh = &self.scene.mesh;
        let maps = mesh.materials[index(mesh.material_of[index(triangle)])].maps;
        // A loop, so that the kernel has the code of one texture.
        let mut texels = [None; 2];
        let textures = [maps.emission.map(|(texture, _)| texture), maps.normal.map(|(texture, _)| texture)];
        for (texels, texture) in texels.iter_mut().zip(textures) {
            let Some(texture) = texture else { continue };
            let texture = &mesh.textures[index(texture)];
            let (from, to) = (colour.size(), texture.size());
            let shift = [0, 1].map(|axis| shift_texels[axis] * Floats::splat(to[axis] / from[axis]));
            *texels = Some(texture.over_alike(uv, &shift, &footprint.on(colour, texture), lanes));
        }
        let [emission, normals] = texels;
        MapTexels { emission: emission.map(|texels| by_band(&texels)), normals }
    }

    /// The normals where a ray met a triangle, from a texel of its normal map.
    pub fn relief(&self, triangle: u32, at: [f32; 2], direction: [f32; 3], texel: Bands) -> Relief {
        let mesh = &self.scene.mesh;
        let scale =
            mesh.materials[index(mesh.material_of[index(triangle)])].maps.normal.map_or(0.0, |(_, scale)| scale);
        let face = self.face(triangle);
        let smooth = self.smooth_normal(triangle, at).unwrap_or(face.normal());
        let mapped = mapped_normal(smooth, &face.slopes(), tangent_space(texel, scale));
        let side = if dot(face.normal(), direction) > 0.0 { -1.0 } else { 1.0 };
        Relief { smooth: smooth.map(|x| x * side), mapped: mapped.map(|x| x * side) }
    }

    /// Unit normal between those of a triangle's corners.
    pub(super) fn smooth_normal(&self, triangle: u32, [u, v]: [f32; 2]) -> Option<[f32; 3]> {
        let corners = self.scene.mesh.triangles[index(triangle)];
        let [a, b, c] = corners.map(|corner| self.scene.mesh.vertices[index(corner)].normal);
        unit([0, 1, 2].map(|axis| a[axis] * (1.0 - u - v) + b[axis] * u + c[axis] * v))
    }

    /// Lux by band that a hit on a mapped normal has more than the bake gives the smooth one, beside what rays to the sources of
    /// `asked`, a bit each, find.
    pub fn light_on_relief(
        &self,
        shadows: &Shadows,
        (around, at_m): (&[(usize, f32); 3], [f32; 3]),
        relief: &Relief,
        asked: u32,
        lamp_level: f32,
    ) -> Bands {
        let mut added = [0.0; BANDS];
        let mut even = self.irradiance_of(*around, lamp_level);
        for &(sample_side, weight) in around {
            for light in shadows.on_normal_maps(sample_side) {
                let level = if shadows.flickers(light.source) { lamp_level } else { 1.0 };
                let lux = light.light.received * weight * level;
                let is_asked = asked >> light.source & 1 != 0;
                let change = if is_asked { 0.0 } else { shadows.tilted(light.source, at_m, relief) - 1.0 };
                for (band, &colour) in shadows.colour(light.source).iter().enumerate() {
                    even[band] -= colour * lux;
                    added[band] += colour * lux * change;
                }
            }
        }
        let loss = 0.5 * (dot(relief.smooth, relief.mapped) - 1.0);
        for band in 0..BANDS {
            added[band] += if even[band] > 0.0 { even[band] * loss } else { 0.0 };
        }
        added
    }
}
