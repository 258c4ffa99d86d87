//! Cache of rows of the die. Computes a row at its first use and returns the same row for the same key afterwards.
//!
//! A kept row is a pure function of its key and width, so keeping it changes no bit; it saves its computation in all later frames.
//! Every row of every frame is looked up here, so a look-up of a kept row takes no lock: kept rows are never removed.

use std::borrow::Cow;
use std::sync::OnceLock;
use std::sync::atomic::{AtomicUsize, Ordering};

use crate::draw::DrawKey;
use crate::num::u64_from;

/// Values kept at most; rows beyond are made anew each time.
const KEPT_VALUES_MAX: usize = 1 << 24;
/// Lists over which rows are spread by their keys, which are mixed well.
const LISTS: usize = 1024;

/// A memory of rows, dense or sparse.
pub(super) struct RowMemory<T> {
    lists: Vec<Link<T>>,
    values: AtomicUsize,
}

type Link<T> = OnceLock<Box<KeptRow<T>>>;

struct KeptRow<T> {
    name: (DrawKey, usize),
    row: Vec<T>,
    next: Link<T>,
}

impl<T> Default for RowMemory<T> {
    fn default() -> Self {
        Self { lists: (0..LISTS).map(|_| OnceLock::new()).collect(), values: AtomicUsize::new(0) }
    }
}

impl<T: Clone> RowMemory<T> {
    /// The row of this key and width; `make` must be a pure function of both.
    pub(super) fn row(&self, key: DrawKey, width: usize, make: impl FnOnce() -> Vec<T>) -> Cow<'_, [T]> {
        let name = (key, width);
        let list = usize::try_from(key.0 % u64_from(LISTS)).expect("lists are few");
        let end = match find(&self.lists[list], name) {
            Ok(row) => return Cow::Borrowed(row),
            Err(end) => end,
        };
        let row = make();
        // An empty row still takes an entry in its list.
        let size = row.len() + 1;
        if self.values.fetch_add(size, Ordering::Relaxed) + size > KEPT_VALUES_MAX {
            self.values.fetch_sub(size, Ordering::Relaxed);
            return Cow::Owned(row);
        }
        Cow::Borrowed(keep(end, Box::new(KeptRow { name, row, next: OnceLock::new() })))
    }
}

/// The row of this name in a list, or the list's end.
fn find<T>(list: &Link<T>, name: (DrawKey, usize)) -> Result<&[T], &Link<T>> {
    let mut link = list;
    while let Some(kept) = link.get() {
        if kept.name == name {
            return Ok(&kept.row);
        }
        link = &kept.next;
    }
    Err(link)
}

/// Puts a row at a list's end, wherever other threads have moved it meanwhile. One that made the same row leaves a second one behind,
/// which is never looked up.
fn keep<T>(end: &Link<T>, kept: Box<KeptRow<T>>) -> &[T] {
    let (mut link, mut left) = (end, Some(kept));
    loop {
        let at = link.get_or_init(|| left.take().expect("a row is put in one place"));
        if left.is_none() {
            return &at.row;
        }
        link = &at.next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_row_is_made_once_for_each_key_and_width() {
        let memory = RowMemory::default();
        let mut made = 0;
        // More keys than lists, so that lists hold several.
        for pass in 0..2 {
            for (key, width) in (0..3000).flat_map(|key| [(key, 4), (key, 5)]) {
                let row = memory.row(DrawKey::root(key), width, || {
                    made += 1;
                    vec![(key, width)]
                });
                assert_eq!(row[0], (key, width), "pass {pass}");
            }
        }
        assert_eq!(made, 6000);
    }

    #[test]
    fn threads_that_make_the_same_rows_see_the_same_values() {
        let memory = RowMemory::default();
        let all = || (0..2000).all(|key| memory.row(DrawKey::root(key), 1, || vec![key])[0] == key);
        let agreed = std::thread::scope(|scope| {
            let threads: Vec<_> = (0..4).map(|_| scope.spawn(all)).collect();
            threads.into_iter().filter_map(|thread| thread.join().ok()).filter(|&agreed| agreed).count()
        });
        assert_eq!(agreed, 4);
    }

    #[test]
    fn rows_beyond_the_bound_are_right_and_not_kept() {
        let memory = RowMemory::default();
        memory.values.store(KEPT_VALUES_MAX - 8, Ordering::Relaxed);
        for (key, width, kept) in [(1, 7, true), (2, 1, false), (1, 7, true)] {
            let row = memory.row(DrawKey::root(key), width, || vec![key; width]);
            assert_eq!((&row[..], matches!(row, Cow::Borrowed(_))), (&vec![key; width][..], kept));
        }
        assert_eq!(memory.values.load(Ordering::Relaxed), KEPT_VALUES_MAX);
    }
}
