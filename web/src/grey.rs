//! Grey values as a canvas takes them.

/// Grey values as red, green, blue and opacity.
pub fn grey(values: &[u8]) -> Vec<u8> {
    values.iter().flat_map(|&value| [value, value, value, 255]).collect()
}
