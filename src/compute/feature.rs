//! A feature, and counts of an extracted frame.

use crate::words::{EdgeDistancePx, PositionPx, Turns, rounded};

/// A corner with its descriptor, as it leaves the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Feature {
    /// Column in the full picture (octave 0 pixels); pixel centres are whole.
    pub x: PositionPx,
    /// Row in the full picture (octave 0 pixels); pixel centres are whole.
    pub y: PositionPx,
    /// FAST score: the largest threshold at which the corner survives, in DN of the pipeline.
    pub score: u16,
    /// Orientation, from +x towards +y (down).
    pub angle: Turns,
    /// Half-scale octave, 0 is full size.
    pub octave: u8,
    /// Rotated BRIEF, bit i of the pattern in bit i % 8 of byte i / 8. Bits beyond the descriptor's length are zero.
    pub descriptor: [u8; 32],
}

impl Feature {
    /// Column in the full picture, in pixels.
    pub fn x_px(&self) -> f64 {
        self.x.into()
    }

    /// Row in the full picture, in pixels.
    pub fn y_px(&self) -> f64 {
        self.y.into()
    }

    /// The pixel (column, row) of the full picture whose area holds the position; a position on the seam between two belongs to the later
    /// one. The fit moves a position by up to a pixel of its octave, so the corner's own pixel is this one or a neighbour of it.
    pub fn pixel(&self) -> (u32, u32) {
        let nearest = |coordinate: PositionPx| rounded(EdgeDistancePx::from(coordinate));
        (nearest(self.x), nearest(self.y))
    }

    /// Number of descriptor bits in which two features differ.
    pub fn distance(&self, other: &Self) -> u32 {
        self.descriptor.iter().zip(&other.descriptor).map(|(a, b)| (a ^ b).count_ones()).sum()
    }
}

/// What the extractor counted in a frame, as its registers do.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct ExtractorCounts {
    /// Corners whose patches lie in the picture.
    pub corners: u64,
    /// Corners too near to an edge.
    pub without_patch: u64,
    /// Corners that found no entry in the list of their cell, or lost it.
    pub unselected: u64,
    /// Candidates dropped because the queue was full.
    pub dropped: u64,
    /// Candidates lost because their rows were overwritten.
    pub late: u64,
    /// Clocks in which a row was kept from starting by candidates that still needed the rows it overwrites.
    pub stalled_clk: u64,
    /// Clocks in which no pixel could enter.
    pub not_ready_clk: u64,
}

/// What a frame gave.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Extracted {
    /// Features in the order in which they leave.
    pub features: Vec<Feature>,
    /// The clock in which each is taken; clock 0 is the first in which the frame's first pixel could enter.
    pub out_clk: Vec<u64>,
    /// Further counts.
    pub counts: ExtractorCounts,
    /// The threshold that was used, in DN of the pipeline.
    pub threshold: u16,
    /// The first clock in which the next frame's first pixel could enter.
    pub end_clk: u64,
}

impl Extracted {
    /// Clocks until the frame is done with: its rows have run and its last feature has left.
    pub fn required_clk(&self) -> u64 {
        self.out_clk.last().map_or(self.end_clk, |last| self.end_clk.max(last + 1))
    }
}
