//! Six line buffers and their 7x7 window, twin of `verilog/fx_window.sv`. Converts an octave's pixels in raster order to the circle of
//! radius 3, its centre, one column and 2x2 pixels.

use crate::flips_of_words;

/// Oldest column of each of the window's rows that any block looks at.
const OLDEST: [usize; 7] = [2, 1, 0, 0, 0, 1, 2];
/// The circle, clockwise from straight below, as (column, row) of the window.
pub(crate) const CIRCLE: [(usize, usize); 16] = [
    (3, 6),
    (4, 6),
    (5, 5),
    (6, 4),
    (6, 3),
    (6, 2),
    (5, 1),
    (4, 0),
    (3, 0),
    (2, 0),
    (1, 1),
    (0, 2),
    (0, 3),
    (0, 4),
    (1, 5),
    (2, 6),
];

/// The window's registers and the word that the line buffers have read.
#[derive(Debug)]
pub(crate) struct FxWindow<'a> {
    lines: &'a mut [[u16; 6]],
    older: [u16; 6],
    /// Columns 0 to 6; the eighth stays 0 and makes a row one register of a vector unit.
    rows: [[u16; 8]; 7],
    pub(crate) toggles: u64,
}

impl<'a> FxWindow<'a> {
    pub(crate) fn new(lines: &'a mut [[u16; 6]]) -> Self {
        Self { lines, older: [0; 6], rows: [[0; 8]; 7], toggles: 0 }
    }

    pub(crate) fn circle(&self) -> [u16; 16] {
        CIRCLE.map(|(column, row)| self.rows[row][column])
    }

    pub(crate) fn centre(&self) -> u16 {
        self.rows[3][3]
    }

    /// Column 3, from above.
    pub(crate) fn middle(&self) -> [u16; 7] {
        self.rows.map(|row| row[3])
    }

    /// 2x2 at the lower right, by rows.
    pub(crate) fn newest(&self) -> [u16; 4] {
        [self.rows[5][5], self.rows[5][6], self.rows[6][5], self.rows[6][6]]
    }

    /// Columns 4, 5 and 6, each from above.
    pub(crate) fn right(&self) -> [[u16; 7]; 3] {
        [4, 5, 6].map(|column| self.rows.map(|row| row[column]))
    }

    /// One enabled clock: reads for one slot, takes and writes back the pixel of the slot before.
    pub(crate) fn tick(&mut self, read: Option<usize>, write: Option<usize>, pixel: u16) {
        let [a, b, c, d, e, f] = self.older;
        let column = [a, b, c, d, e, f, pixel];
        for ((row, &entering), &oldest) in self.rows.iter_mut().zip(&column).zip(&OLDEST) {
            let before = *row;
            let [_, b, c, d, e, f, g, _] = before;
            *row = [b, c, d, e, f, g, entering, 0];
            row[..oldest].fill(0);
            self.toggles += flips_of_words(&before, row);
        }
        if let Some(address) = read {
            self.older = self.lines[address];
        }
        if let Some(address) = write {
            self.lines[address] = [b, c, d, e, f, pixel];
        }
    }
}
