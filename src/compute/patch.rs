//! The 27 x 27 smoothed pixels around a corner, of which orientation and descriptor are made.

use super::fast::Corner;
use super::word::Word;
use crate::num::index;
use crate::plane::Plane;

/// Farthest pixel of a patch from its corner: that of the disc and of the pattern.
pub const RADIUS_PX: usize = 13;
/// Rows and columns of a patch.
pub const SIDE: usize = 2 * RADIUS_PX + 1;
/// Words from row to row, a power of two to keep offsets cheap; the last five of a row are 0.
pub(crate) const STRIDE: usize = 32;
/// Words in all: a power of two, so that any offset under it is inside.
pub(crate) const WORDS: usize = STRIDE * STRIDE;

/// A corner's surroundings.
pub struct Patch<W> {
    words: [W; WORDS],
}

impl<W: Word> Patch<W> {
    /// The patch around a corner of a picture. Panics where it leaves the picture.
    #[inline(always)]
    pub fn around(picture: &Plane<W>, corner: &Corner) -> Self {
        let mut words = [W::default(); WORDS];
        let (x, y) = (index(corner.x_px) - RADIUS_PX, index(corner.y_px) - RADIUS_PX);
        for (row, target) in words.as_chunks_mut::<STRIDE>().0.iter_mut().take(SIDE).enumerate() {
            let values: &[W; SIDE] = picture.row(y + row)[x..x + SIDE].try_into().expect("cut to this length");
            target[..SIDE].copy_from_slice(values);
        }
        Self { words }
    }

    /// Row by row, the last five words of each 0.
    #[inline(always)]
    pub(crate) fn rows(&self) -> &[[W; STRIDE]] {
        &self.words.as_chunks::<STRIDE>().0[..SIDE]
    }

    /// The word at an offset; the pairs of a rotated pattern are such offsets.
    #[inline(always)]
    pub(crate) fn at(&self, offset: u16) -> W {
        self.words[usize::from(offset) % WORDS]
    }
}
