//! Normal patterns of a die, kept between frames. Enters: a pattern's key. Leaves: its normals, one a column.
//!
//! A pattern is a pure function of its key, so keeping it changes no bit; it saves the draw in every frame but the first.

use std::collections::BTreeMap;
use std::sync::{Arc, RwLock};

use crate::draw::{DrawKey, fill_uniforms, normals};

/// Values kept at most, 64 MiB; rows beyond are drawn anew each time.
const KEPT_VALUES_MAX: usize = 1 << 24;

/// A memory of pattern rows.
#[derive(Default)]
pub struct Pattern {
    rows: RwLock<BTreeMap<u64, Arc<[f32]>>>,
}

impl Pattern {
    /// The standard normals of a row of the die. `uniforms` is room as long as the row.
    pub fn normals(&self, key: DrawKey, uniforms: &mut [u32]) -> Arc<[f32]> {
        let kept = self.rows.read().expect("no holder of this lock can panic").get(&key.0).cloned();
        if let Some(row) = kept.filter(|row| row.len() == uniforms.len()) {
            return row;
        }
        fill_uniforms(key, uniforms);
        let mut drawn = vec![0.0; uniforms.len()];
        normals(uniforms, &mut drawn);
        let drawn: Arc<[f32]> = drawn.into();
        let mut rows = self.rows.write().expect("no holder of this lock can panic");
        if (rows.len() + 1) * drawn.len() <= KEPT_VALUES_MAX {
            rows.insert(key.0, Arc::clone(&drawn));
        }
        drawn
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
