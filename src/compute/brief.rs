//! Rotated BRIEF. Computes up to 256 comparisons from a smoothed patch and its angle.
//!
//! Bit i is 1 where the first point of pair i is darker than the second (Calonder 2010). Pairs are turned by the corner's
//! angle, rounded to whole pixels. In hardware the plain pattern is 256 pairs and one rotator, the symmetric one 256 fixed
//! pairs and a rotation of bytes; here all turns are kept.

use std::sync::OnceLock;

use super::patch::{Patch, RADIUS_PX, STRIDE};
use super::pattern::{BYTES, PAIRS, pattern, symmetric_pattern, turned};
use super::word::Word;
use crate::words::Turns;

/// Pairs of points as offsets of their words in a patch.
type Offsets = [(u16, u16); PAIRS];

/// A pattern under all its rotations.
pub struct RotatedPattern {
    turns: Vec<Offsets>,
}

impl RotatedPattern {
    /// The plain pattern under 256 turns: built on first use from integers only.
    pub fn plain() -> &'static Self {
        static TABLE: OnceLock<RotatedPattern> = OnceLock::new();
        TABLE.get_or_init(|| {
            let pairs = pattern();
            let turn = |k| offsets(pairs.iter().map(|&(a, b)| (turned(a, k), turned(b, k))));
            Self { turns: (0..256).map(turn).collect() }
        })
    }

    /// The symmetric pattern under 32 turns.
    pub fn symmetric() -> &'static Self {
        static TABLE: OnceLock<RotatedPattern> = OnceLock::new();
        TABLE.get_or_init(|| Self { turns: (0..32).map(|k| offsets(symmetric_pattern(k).into_iter())).collect() })
    }

    /// The first `bytes` bytes of the descriptor of a patch, turned by the angle rounded down to the pattern's step; then zeros.
    #[inline(always)]
    pub fn describe<W: Word>(&self, patch: &Patch<W>, angle: Turns, bytes: usize) -> [u8; BYTES] {
        let turn = usize::from(angle.to_bits()) * self.turns.len() / 256;
        let mut descriptor = [0; BYTES];
        for (byte, pairs) in descriptor[..bytes].iter_mut().zip(self.turns[turn].as_chunks::<8>().0) {
            for (bit, &(a, b)) in pairs.iter().enumerate() {
                *byte |= u8::from(patch.at(a) < patch.at(b)) << bit;
            }
        }
        descriptor
    }
}

fn offsets(pairs: impl Iterator<Item = ((i32, i32), (i32, i32))>) -> Offsets {
    let mut offsets = [(0, 0); PAIRS];
    for (offset, (a, b)) in offsets.iter_mut().zip(pairs) {
        *offset = (patch_offset(a), patch_offset(b));
    }
    offsets
}

fn patch_offset((x, y): (i32, i32)) -> u16 {
    let centre = i32::try_from(RADIUS_PX).expect("a small constant");
    let stride = i32::try_from(STRIDE).expect("a small constant");
    assert!(x.abs() <= centre && y.abs() <= centre, "rotation keeps the radius");
    u16::try_from((y + centre) * stride + x + centre).expect("inside the patch")
}
