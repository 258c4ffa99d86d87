//! Rows of the die that are kept between frames. Enters: a row's key and how to make it. Leaves: what was made, the same each time.
//!
//! What is kept is a pure function of its key and width, so keeping it changes no bit; it saves the making in every frame but the first.

use std::collections::BTreeMap;
use std::sync::{Arc, RwLock};

use crate::draw::DrawKey;

/// Values kept at most; rows beyond are made anew each time.
const KEPT_VALUES_MAX: usize = 1 << 24;

/// A memory of rows, dense or sparse.
pub(super) struct RowMemory<T> {
    kept: RwLock<Kept<T>>,
}

struct Kept<T> {
    rows: BTreeMap<(u64, usize), Arc<[T]>>,
    values: usize,
}

impl<T> Default for RowMemory<T> {
    fn default() -> Self {
        Self { kept: RwLock::new(Kept { rows: BTreeMap::new(), values: 0 }) }
    }
}

impl<T> RowMemory<T> {
    /// The row of this key and width; `make` must be a pure function of both.
    pub(super) fn row(&self, key: DrawKey, width: usize, make: impl FnOnce() -> Vec<T>) -> Arc<[T]> {
        let name = (key.0, width);
        let kept = self.kept.read().expect("no holder of this lock can panic").rows.get(&name).cloned();
        if let Some(row) = kept {
            return row;
        }
        let made: Arc<[T]> = make().into();
        let mut kept = self.kept.write().expect("no holder of this lock can panic");
        // An empty row still takes a place in the tree.
        let values = kept.values + made.len() + 1;
        if values <= KEPT_VALUES_MAX {
            kept.values = values;
            kept.rows.insert(name, Arc::clone(&made));
        }
        made
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_made_once_for_each_key_and_width() {
        let memory = RowMemory::default();
        let mut made = 0;
        for (key, width) in [(1, 4), (1, 4), (2, 4), (1, 5), (2, 4)] {
            let row = memory.row(DrawKey::root(key), width, || {
                made += 1;
                vec![(key, width)]
            });
            assert_eq!(row[0], (key, width));
        }
        assert_eq!(made, 3);
    }
}
