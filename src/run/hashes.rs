//! Hashes of the bytes of each stage: what "the same run" means.

use crate::compute::Feature;
use crate::plane::Plane;
use crate::tracker::TrackedFrame;

// Planes enter the hashes as they lie in memory, which is little-endian bytes.
const _: () = assert!(cfg!(target_endian = "little"), "supported targets are little-endian");

/// Running hashes over all frames and cameras, in their order.
#[derive(Default)]
pub struct StageHashes {
    photons: blake3::Hasher,
    codes: blake3::Hasher,
    features: blake3::Hasher,
    poses: blake3::Hasher,
}

impl StageHashes {
    /// Adds the pictures of one camera's frame. Numbers enter as little-endian bytes.
    pub fn add(&mut self, photons: &Plane<f32>, codes: &Plane<u16>) {
        self.photons.update(bytemuck::cast_slice(photons.values()));
        self.codes.update(bytemuck::cast_slice(codes.values()));
    }

    /// Adds the features of one camera's frame.
    pub fn add_features(&mut self, features: &[Feature]) {
        for feature in features {
            self.features.update(&feature.x.to_le_bytes());
            self.features.update(&feature.y.to_le_bytes());
            self.features.update(&feature.score.to_le_bytes());
            self.features.update(&[feature.angle.to_bits(), feature.octave]);
            self.features.update(&feature.descriptor);
        }
    }

    /// Adds the tracker's answer to a frame: its pose to the last bit, and what it rests on.
    pub fn add_pose(&mut self, tracked: &TrackedFrame) {
        let mut take = |bytes: &[u8]| {
            self.poses.update(bytes);
        };
        take(tracked.status.name().as_bytes());
        take(&[u8::from(tracked.keyframe), u8::from(tracked.loop_closed)]);
        if let Some(pose) = tracked.world_from_body {
            let numbers = pose.rotation.to_array().into_iter().chain(pose.translation_m.to_array());
            numbers.for_each(|number| take(&number.to_le_bytes()));
        }
        for number in [tracked.innovation_px, tracked.single_picture_sigma_m].into_iter().flatten() {
            take(&number.to_le_bytes());
        }
        for inlier in &tracked.inliers {
            let numbers = [inlier.camera.0, inlier.feature, inlier.landmark];
            numbers.into_iter().for_each(|number| take(&number.to_le_bytes()));
        }
    }

    /// The hashes so far, hexadecimal: photons, codes, features, poses.
    pub fn hex(&self) -> [String; 4] {
        [&self.photons, &self.codes, &self.features, &self.poses].map(|hasher| hasher.finalize().to_hex().to_string())
    }
}
