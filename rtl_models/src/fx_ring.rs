//! Ring buffer of smoothed rows, twin of `verilog/fx_ring.sv`. Reads 27 pixels of one column, two clocks after the request.

use crate::flips;
use crate::fx_config::FxBackConfig;

/// Rows and columns of a patch.
pub const SIDE: usize = 27;
/// One column of a patch, top pixel first.
pub type Column = [u16; SIDE];

/// A pixel that is written.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RingWrite {
    /// Octave of the pixel.
    pub octave: usize,
    /// Column.
    pub x_px: u16,
    /// Row, numbered on over frames.
    pub row_number: u16,
    /// Value.
    pub pixel: u16,
}

/// A column that is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RingRead {
    /// Octave of the column.
    pub octave: usize,
    /// Column.
    pub x_px: u16,
    /// Topmost row, numbered on over frames.
    pub row_number: u16,
}

/// The ring and its two output registers; the pixels are borrowed, `FxBackConfig::ring_pixels` of them.
#[derive(Debug)]
pub struct FxRing<'a> {
    pixels: &'a mut [u16],
    /// Words of a bank, and of the octaves before each.
    words: usize,
    starts: [usize; 4],
    rows: usize,
    read: Option<Column>,
    column: Option<Column>,
    last: Column,
    toggles: u64,
}

impl<'a> FxRing<'a> {
    /// A ring with what the memory holds. Panics on another size than the config's.
    pub fn new(config: &FxBackConfig, pixels: &'a mut [u16]) -> Self {
        assert_eq!(pixels.len(), config.ring_pixels(), "a bank has a word for each column of each octave");
        let mut words = 0;
        let starts = core::array::from_fn(|octave| {
            let start = words;
            words += config.ring_words(octave);
            start
        });
        Self {
            pixels,
            words,
            starts,
            rows: 1 << config.ring_log2,
            read: None,
            column: None,
            last: [0; SIDE],
            toggles: 0,
        }
    }

    /// Forgets what is being read; the memory stays.
    pub fn reset(&mut self) {
        (self.read, self.column) = (None, None);
    }

    /// The column on the output.
    pub fn column(&self) -> Option<&Column> {
        self.column.as_ref()
    }

    /// Bits of the column register that flipped; before the first column it holds zeros.
    pub fn toggles(&self) -> u64 {
        self.toggles
    }

    /// A row's pixels from a column on, as so many clocks write them.
    pub(crate) fn write_row<T: Copy + Into<u16>>(&mut self, octave: usize, x_px: usize, row_number: u16, row: &[T]) {
        let start = usize::from(row_number) % self.rows * self.words + self.starts[octave] + x_px;
        let stored = &mut self.pixels[start..start + row.len()];
        stored.iter_mut().zip(row).for_each(|(stored, &pixel)| *stored = pixel.into());
    }

    /// One rising edge.
    pub fn tick(&mut self, write: Option<RingWrite>, read: Option<RingRead>) {
        self.column = self.read.take();
        if let Some(column) = &self.column {
            let changes = self.last.iter().zip(column).map(|(&a, &b)| flips(a.into(), b.into()));
            self.toggles += changes.sum::<u64>();
            self.last = *column;
        }
        let address = |rows: usize, row: usize, octave: usize, x_px: u16| {
            row % rows * self.words + self.starts[octave] + usize::from(x_px)
        };
        if let Some(read) = read {
            let pixel =
                |row| self.pixels[address(self.rows, usize::from(read.row_number) + row, read.octave, read.x_px)];
            self.read = Some(core::array::from_fn(pixel));
        }
        if let Some(write) = write {
            self.pixels[address(self.rows, usize::from(write.row_number), write.octave, write.x_px)] = write.pixel;
        }
    }
}
