//! What the back of the extractor is built as, borrows, takes in and gives out; constants of its clock rules. Places are pixels
//! of an octave.

use crate::fx_cells::{CellList, Corner};
use crate::fx_dumps::Row;
use crate::fx_engine::{Engine, Record};
use crate::fx_fifo::{Candidate, Policy};

/// Rows and columns around a corner that its patch and the smoothing kernel need.
pub const PATCH_MARGIN_PX: u32 = 16;
/// Shortest time between two starts: the ring is read and the orientation found for one corner at a time.
pub const START_GAP_CLK: u32 = 40;
/// Clocks from a start until its corner has been read from the ring.
pub const LOADED_CLK: u32 = 27;
/// Clocks from a row's end to the first push of the dump that it triggers, the walker being idle.
pub const DUMP_CLK: u32 = 2;

/// Clocks from an engine's start until its record can leave.
pub const fn engine_clocks(desc_bits: u32) -> u32 {
    START_GAP_CLK + 3 + desc_bits
}

/// How much hardware there is, and the picture.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FxBackConfig {
    /// Widest picture.
    pub max_width: u32,
    /// Bits of a pixel, 8 to 16.
    pub pix_bits: u32,
    /// Octaves, 1 to 4.
    pub octaves: u32,
    /// Rank by the 16-bit Harris code and not by the score.
    pub harris: bool,
    /// Side of a cell, 2^4 to 2^6.
    pub cell_log2: u32,
    /// Places of a cell's list, 1 to 4.
    pub per_cell: u32,
    /// Rows of the ring, 2^6 or 2^7; cells of 64 need 2^7.
    pub ring_log2: u32,
    /// Engines, 1 to 4.
    pub engines: u32,
    /// Places of the queue before the engines, 1 to 64.
    pub fifo_depth: u32,
    /// Bits of a descriptor, 64 to 256, whole bytes.
    pub desc_bits: u32,
    /// The rotationally symmetric pattern.
    pub symmetric: bool,
    /// Fit places to sixteenths of a pixel.
    pub subpixel: bool,
    /// Width of the picture, 7 to `max_width`.
    pub width: u32,
    /// Height of the picture, 7 to 4096.
    pub height: u32,
}

impl FxBackConfig {
    /// What the hardware needs to work as described.
    pub fn check(&self) -> Result<(), &'static str> {
        let rule = |holds: bool, sentence| if holds { Ok(()) } else { Err(sentence) };
        rule((7..=4096).contains(&self.max_width), "the widest picture has 7 to 4096 columns")?;
        rule((8..=16).contains(&self.pix_bits), "pixels have 8 to 16 bits")?;
        rule((1..=4).contains(&self.octaves), "there are 1 to 4 octaves")?;
        rule((4..=6).contains(&self.cell_log2), "cells have 16, 32 or 64 pixels a side")?;
        rule((1..=4).contains(&self.per_cell), "a cell's list has 1 to 4 places")?;
        rule((6..=7).contains(&self.ring_log2), "the ring has 64 or 128 rows")?;
        rule(self.cell_log2 < self.ring_log2, "cells of 64 pixels need a ring of 128 rows")?;
        rule((1..=4).contains(&self.engines), "there are 1 to 4 engines")?;
        rule((1..=64).contains(&self.fifo_depth), "the queue has 1 to 64 places")?;
        rule((64..=256).contains(&self.desc_bits), "a descriptor has 64 to 256 bits")?;
        rule(self.desc_bits.is_multiple_of(8), "a descriptor has whole bytes")?;
        rule((7..=self.max_width).contains(&self.width), "pictures have 7 to max_width columns")?;
        rule((7..=4096).contains(&self.height), "pictures have 7 to 4096 rows")
    }

    /// Columns of an octave's widest picture.
    pub(crate) fn ring_words(&self, octave: usize) -> usize {
        if octave < small(self.octaves) { small(self.max_width) >> octave } else { 0 }
    }

    /// Cells across an octave's widest picture.
    pub(crate) fn cells(&self, octave: usize) -> usize {
        self.ring_words(octave).div_ceil(1 << self.cell_log2)
    }

    /// Lists that `FxBackMemory` must hold.
    pub fn lists(&self) -> usize {
        (0..4).map(|octave| 2 * self.cells(octave)).sum()
    }

    /// Pixels of the ring that `FxBackMemory` must hold.
    pub fn ring_pixels(&self) -> usize {
        (0..4).map(|octave| self.ring_words(octave)).sum::<usize>() << self.ring_log2
    }
}

pub(crate) fn small(count: u32) -> usize {
    usize::try_from(count).expect("counts of hardware are small")
}

/// What is borrowed: the block's memories and arrays.
#[derive(Debug)]
pub struct FxBackMemory<'a> {
    /// `FxBackConfig::lists` of them.
    pub lists: &'a mut [CellList],
    /// `FxBackConfig::ring_pixels` of them.
    pub ring: &'a mut [u16],
    /// `fifo_depth` of them.
    pub queue: &'a mut [Candidate],
    /// `engines` of them.
    pub engines: &'a mut [Engine],
}

/// Settings that hold still while pictures run.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FxSettings {
    /// Threshold; with a target where it begins, and the least.
    pub threshold: u16,
    /// What happens when the queue is full.
    pub policy: Policy,
    /// Corners with a patch to aim at in a frame; 0 keeps the threshold.
    pub target: u16,
    /// Bits of an angle, 1 to 8.
    pub angle_bits: u32,
}

/// Pins from the front, as they stand at the rising edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FxBackIn {
    /// Synchronous reset.
    pub rst: bool,
    /// Settings.
    pub settings: FxSettings,
    /// The front waits for `row_ok` of `request`.
    pub req: bool,
    /// The row that wants to start.
    pub request: Row,
    /// Octave of what stands.
    pub octave: usize,
    /// Arrival row of what stands.
    pub row: u32,
    /// A smoothed pixel: column, row, value.
    pub smoothed: Option<(u16, u16, u16)>,
    /// A corner.
    pub corner: Option<Corner>,
    /// The row's last outputs stand.
    pub row_end: bool,
    /// That row is virtual.
    pub row_end_virtual: bool,
    /// That row is the frame's last.
    pub frame_end: bool,
    /// The record that stands is taken.
    pub out_ready: bool,
}

/// Counts since reset; they wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FxCounts {
    /// Corners that came.
    pub corners: u32,
    /// Corners too near to an edge for a patch.
    pub without_patch: u32,
    /// Corners that fell off a list.
    pub unselected: u32,
    /// Candidates that a full queue gave up.
    pub dropped: u32,
    /// Candidates whose rows would have been overwritten.
    pub late: u32,
    /// Records that left.
    pub features: u32,
    /// Clocks in which a row wanted to start and could not.
    pub stalled: u32,
}

/// Bits that flipped since the twin was made.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FxBackToggles {
    /// The ring's column register.
    pub column: u64,
    /// Both moments.
    pub moments: u64,
    /// All engines' descriptors.
    pub descriptors: u64,
}

/// Pins that leave, after the rising edge; `row_ok` and `threshold` with the pins of that clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FxBackOut {
    /// The requested row may start.
    pub row_ok: bool,
    /// The threshold that the front uses.
    pub threshold: u16,
    /// A record stands.
    pub valid: bool,
    /// The registers of the engine whose turn it is.
    pub record: Record,
    /// Counts.
    pub counts: FxCounts,
}
