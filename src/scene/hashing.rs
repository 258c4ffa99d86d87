//! A hash of floating-point values by their bits.

pub(super) fn hash_floats(hasher: &mut blake3::Hasher, values: &[f32]) {
    let bytes: Vec<u8> = values.iter().flat_map(|value| value.to_le_bytes()).collect();
    hasher.update(&bytes);
}
