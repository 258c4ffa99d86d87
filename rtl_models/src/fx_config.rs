//! How much hardware the extractor has, for its front and for its back, and the picture that it takes.

/// Rows and columns around a corner that its patch and the smoothing kernel need.
pub const PATCH_MARGIN_PX: u32 = 16;

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
    /// Entries of a cell's list, 1 to 4.
    pub per_cell: u32,
    /// Rows of the ring, 2^6 or 2^7; cells of 64 need 2^7.
    pub ring_log2: u32,
    /// Engines, 1 to 4.
    pub engines: u32,
    /// Entries of the queue before the engines, 1 to 64.
    pub fifo_depth: u32,
    /// Bits of a descriptor, 64 to 256, whole bytes.
    pub desc_bits: u32,
    /// The rotationally symmetric pattern.
    pub symmetric: bool,
    /// Fit positions to sixteenths of a pixel.
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
        rule((1..=4).contains(&self.per_cell), "a cell's list has 1 to 4 entries")?;
        rule((6..=7).contains(&self.ring_log2), "the ring has 64 or 128 rows")?;
        rule(self.cell_log2 < self.ring_log2, "cells of 64 pixels need a ring of 128 rows")?;
        rule((1..=4).contains(&self.engines), "there are 1 to 4 engines")?;
        rule((1..=64).contains(&self.fifo_depth), "the queue has 1 to 64 entries")?;
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

/// Enabled clocks from a raster slot to what it completes.
pub const FRONT_LATENCY: u32 = 6;
/// Least side of an octave above 0: one pixel with a whole patch.
pub const OCTAVE_SIDE_MIN: u32 = 33;

/// What the front is built with and set to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FxFrontConfig {
    /// Columns for which there is memory; compile-time in Verilog.
    pub max_width: u32,
    /// Bits of a pixel, 8 to 16; compile-time.
    pub pix_bits: u32,
    /// Octaves for which there is memory, 1 to 4; compile-time.
    pub octaves: u32,
    /// Corners are ranked by Harris; compile-time.
    pub harris: bool,
    /// Columns of octave 0, 7 to `max_width`.
    pub width: u32,
    /// Rows of octave 0, 7 to 65535.
    pub height: u32,
}

impl FxFrontConfig {
    /// What the hardware needs to work as described; the sentence says which rule is broken.
    pub fn check(&self) -> Result<(), &'static str> {
        let rule = |holds: bool, sentence| if holds { Ok(()) } else { Err(sentence) };
        rule((8..=16).contains(&self.pix_bits), "pixels have 8 to 16 bits")?;
        rule((1..=4).contains(&self.octaves), "there are 1 to 4 octaves")?;
        rule((16..1 << 15).contains(&self.max_width), "line buffers hold 16 to 2^15 - 1 columns")?;
        rule((7..=self.max_width).contains(&self.width), "a row has 7 pixels to those of the line buffers")?;
        rule((7..1 << 16).contains(&self.height), "a picture has 7 to 65535 rows")
    }

    /// Columns of an octave.
    pub const fn width_of(&self, octave: u32) -> u32 {
        self.width >> octave
    }

    /// Rows of an octave.
    pub const fn height_of(&self, octave: u32) -> u32 {
        self.height >> octave
    }

    /// Whether the octave is worked on.
    pub const fn built(&self, octave: u32) -> bool {
        let large = self.width_of(octave) >= OCTAVE_SIDE_MIN && self.height_of(octave) >= OCTAVE_SIDE_MIN;
        octave == 0 || (octave < self.octaves && large)
    }

    /// First word of an octave in memories of all octaves.
    pub const fn base_of(&self, octave: u32) -> u32 {
        line_words_of(self.max_width, octave)
    }

    /// Slots of a frame, an enabled clock each, with those that drain.
    pub fn frame_slots(&self) -> u64 {
        let of = |octave| u64::from(self.width_of(octave) + 1) * u64::from(self.height_of(octave) + 1);
        (0..self.octaves).filter(|&octave| self.built(octave)).map(of).sum::<u64>() + u64::from(DRAIN)
    }

    /// Bits of the front's memories: six pixels, two differences and a rank a column of each octave, and a half-scale row.
    pub const fn memory_bits(&self) -> u64 {
        let word = 8 * self.pix_bits + if self.harris { 16 } else { 0 };
        let half_row = if self.octaves > 1 { self.max_width / 2 * self.pix_bits } else { 0 };
        (line_words_of(self.max_width, self.octaves) * word + half_row) as u64
    }
}

const fn line_words_of(max_width: u32, octaves: u32) -> u32 {
    let (mut words, mut octave) = (0, 0);
    while octave < octaves {
        words += max_width >> octave;
        octave += 1;
    }
    words
}

/// Words of the memories that hold a row of each octave.
pub const fn line_words(max_width: u32, octaves: u32) -> usize {
    line_words_of(max_width, octaves) as usize
}

/// Empty slots after a frame, in which the last ones leave.
pub const DRAIN: u32 = 7;
