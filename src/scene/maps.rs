//! Maps of a material beside its base colour: normals, roughness and metallic, emission (glTF 2.0, 3.9), by the same texture coordinates.

use super::light::Bands;
use super::texture::{Footprint, Texture};
use super::vectors::{cross, dot, unit};

/// Textures of a material by kind, each with what its texels are multiplied by. A material that has any has a base colour texture too,
/// if only a white one: footprints are found on that.
#[derive(Clone, Copy, Debug, Default, PartialEq)]
pub struct Maps {
    /// Normals in tangent space, and the factor of their x and y.
    pub normal: Option<(u32, f32)>,
    /// Roughness in green and metallic in blue, and the factors of both. The material's own numbers are the means.
    pub roughness_metallic: Option<(u32, [f32; 2])>,
    /// Emission; the material's own is the mean.
    pub emission: Option<(u32, Bands)>,
}

impl Maps {
    /// Bytes that identify these maps, for content keys. Nothing without any.
    pub(super) fn hash_into(&self, hasher: &mut blake3::Hasher) {
        let mut add = |kind: &[u8], texture: u32, factors: &[f32]| {
            hasher.update(kind);
            hasher.update(&texture.to_le_bytes());
            super::hashing::hash_floats(hasher, factors);
        };
        if let Some((texture, scale)) = self.normal {
            add(b"normal", texture, &[scale]);
        }
        if let Some((texture, factors)) = self.roughness_metallic {
            add(b"roughness", texture, &factors);
        }
        if let Some((texture, factors)) = self.emission {
            add(b"emission", texture, &factors);
        }
    }

    /// Its textures, to be numbered anew.
    pub(super) fn textures_mut(&mut self) -> impl Iterator<Item = &mut u32> {
        let Self { normal, roughness_metallic, emission } = self;
        let [normal, emission] =
            [normal.as_mut().map(|(texture, _)| texture), emission.as_mut().map(|(texture, _)| texture)];
        let rough = roughness_metallic.as_mut().map(|(texture, _)| texture);
        [normal, rough, emission].into_iter().flatten()
    }
}

impl Footprint {
    /// The same on another picture that lies by the same texture coordinates.
    #[inline]
    #[must_use]
    pub fn on(&self, from: &Texture, to: &Texture) -> Self {
        let (from, to) = (from.size(), to.size());
        let scale = [to[0] / from[0], to[1] / from[1]];
        let scaled = |texels: [f32; 2]| [texels[0] * scale[0], texels[1] * scale[1]];
        Self {
            shift_texels: scaled(self.shift_texels),
            step_texels: scaled(self.step_texels),
            // A level of the finest texels adds nothing to what a look-up averages over (`texture/footprint`).
            area_texels2: 1.0 + (self.area_texels2 - 1.0) * scale[0] * scale[1],
            ..*self
        }
    }
}

/// A normal map's texel as a vector in tangent space; of any length above 0.
#[inline(always)]
pub(super) fn tangent_space(texel: Bands, scale: f32) -> [f32; 3] {
    let signed = |value: f32| 2.0 * value - 1.0;
    [signed(texel[0]) * scale, signed(texel[1]) * scale, signed(texel[2]).max(1e-3)]
}

/// The unit normal that a vector in tangent space stands for, on the side of the smooth unit normal. `slopes` are the gradients of the
/// texture coordinates in the triangle's plane. The tangent leads along rising u, the bitangent along falling v, which is up in a picture.
/// The smooth normal itself where the texture coordinates have no gradient.
#[inline(always)]
pub(super) fn mapped_normal(smooth: [f32; 3], slopes: &[[f32; 3]; 2], [x, y, z]: [f32; 3]) -> [f32; 3] {
    let along = cross(slopes[1], smooth);
    let handed = if dot(along, slopes[0]) < 0.0 { -1.0 } else { 1.0 };
    let Some(tangent) = unit(along.map(|axis| axis * handed)) else { return smooth };
    // With u to the right and v downwards on the front, u, up and the normal are right-handed.
    let up = cross(smooth, tangent).map(|axis| axis * -handed);
    let mut normal = [0.0; 3];
    for axis in 0..3 {
        normal[axis] = tangent[axis] * x + up[axis] * y + smooth[axis] * z;
    }
    unit(normal).unwrap_or(smooth)
}
