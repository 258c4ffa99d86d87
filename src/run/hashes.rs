//! Hashes of the bytes of each stage: what "the same run" means.

use crate::compute::Feature;
use crate::plane::Plane;

// Planes enter the hashes as they lie in memory, which is little-endian bytes.
const _: () = assert!(cfg!(target_endian = "little"), "supported targets are little-endian");

/// Running hashes over all frames and cameras, in their order.
#[derive(Default)]
pub struct StageHashes {
    photons: blake3::Hasher,
    codes: blake3::Hasher,
    features: blake3::Hasher,
}

impl StageHashes {
    /// Adds one camera's frame. Numbers enter as little-endian bytes.
    pub fn add(&mut self, photons: &Plane<f32>, codes: &Plane<u16>, features: &[Feature]) {
        self.photons.update(bytemuck::cast_slice(photons.values()));
        self.codes.update(bytemuck::cast_slice(codes.values()));
        for feature in features {
            self.features.update(&feature.x_q4.to_le_bytes());
            self.features.update(&feature.y_q4.to_le_bytes());
            self.features.update(&feature.score.to_le_bytes());
            self.features.update(&[feature.angle, feature.octave]);
            self.features.update(&feature.descriptor);
        }
    }

    /// The hashes so far, hexadecimal: photons, codes, features.
    pub fn hex(&self) -> [String; 3] {
        [&self.photons, &self.codes, &self.features].map(|hasher| hasher.finalize().to_hex().to_string())
    }
}
