//! What the back of the extractor is built as, borrows, takes in and gives out; constants of its clock rules. Positions are pixels
//! of an octave.

use crate::fx_cells::{CellList, ListedCorner};
use crate::fx_dumps::Row;
use crate::fx_engine::{Engine, Record};
use crate::fx_fifo::{Policy, QueuedCorner};

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

/// What is borrowed: the block's memories and arrays.
#[derive(Debug)]
pub struct FxBackMemory<'a> {
    /// `FxBackConfig::lists` of them.
    pub lists: &'a mut [CellList],
    /// `FxBackConfig::ring_pixels` of them.
    pub ring: &'a mut [u16],
    /// `fifo_depth` of them.
    pub queue: &'a mut [QueuedCorner],
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
    /// Octave of what is valid.
    pub octave: usize,
    /// Arrival row of what is valid.
    pub row: u32,
    /// A smoothed pixel: column, row, value.
    pub smoothed: Option<(u16, u16, u16)>,
    /// A corner.
    pub corner: Option<ListedCorner>,
    /// The row's last outputs are valid.
    pub row_end: bool,
    /// That row is virtual.
    pub row_end_virtual: bool,
    /// That row is the frame's last.
    pub frame_end: bool,
    /// The valid record is taken.
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
    /// A record is valid.
    pub valid: bool,
    /// The registers of the engine whose turn it is.
    pub record: Record,
    /// Counts.
    pub counts: FxCounts,
}
