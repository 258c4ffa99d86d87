//! Normal patterns of a die, kept between frames: one normal a column for a pattern's key.

use std::borrow::Cow;

use super::row_memory::RowMemory;
use crate::draw::{DrawKey, fill_uniforms, normals};

/// A memory of pattern rows.
#[derive(Default)]
pub struct Pattern {
    rows: RowMemory<f32>,
}

impl Pattern {
    /// The standard normals of a row of the die. `uniforms` is room as long as the row.
    pub fn normals(&self, key: DrawKey, uniforms: &mut [u32]) -> Cow<'_, [f32]> {
        self.rows.row(key, uniforms.len(), || {
            fill_uniforms(key, uniforms);
            let mut drawn = vec![0.0; uniforms.len()];
            normals(uniforms, &mut drawn);
            drawn
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_kept_row_equals_a_drawn_one_at_every_width() {
        let (pattern, key) = (Pattern::default(), DrawKey::root(3));
        for width in [7, 640, 641, 640, 7] {
            let mut uniforms = vec![0; width];
            let kept = pattern.normals(key, &mut uniforms);
            assert_eq!(kept, Pattern::default().normals(key, &mut uniforms), "width {width}");
        }
    }
}
