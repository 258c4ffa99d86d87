//! Row arbiter, twin of `verilog/fx_rows.sv`. Chooses the octave that advances in this clock, and reports the slot taken and what it
//! completes. Columns and rows are pixels of their octave.

use crate::flips;
pub use crate::fx_config::DRAIN;
use crate::fx_config::FxFrontConfig;

/// The row that wants to start.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Request {
    /// A row waits for `row_ok`.
    pub req: bool,
    /// Its octave.
    pub octave: u32,
    /// Its number; the octave's height for the virtual row.
    pub row: u32,
    /// It is the virtual row.
    pub is_virtual: bool,
}

/// The raster slot that the arbiter has reached.
#[derive(Clone, Copy, Debug, Default)]
pub(crate) struct RasterSlot {
    pub(crate) first: bool,
    pub(crate) last: bool,
    pub(crate) real_pixel: bool,
    pub(crate) real_column: bool,
    pub(crate) whole: bool,
    pub(crate) peak: bool,
    pub(crate) half: bool,
    pub(crate) half_scale: bool,
    pub(crate) column: u32,
    pub(crate) address: u32,
}

/// The arbiter's registers.
#[derive(Clone, Debug)]
pub(crate) struct FxRows {
    config: FxFrontConfig,
    octave: u32,
    column: u32,
    row_0: u32,
    virtual_row: bool,
    drain: u32,
    pub(crate) toggles: u64,
}

impl FxRows {
    pub(crate) fn new(config: FxFrontConfig) -> Self {
        Self { config, octave: 0, column: 0, row_0: 0, virtual_row: false, drain: 0, toggles: 0 }
    }

    fn row(&self) -> u32 {
        self.row_0 >> self.octave
    }

    pub(crate) fn draining(&self) -> bool {
        self.drain != 0
    }

    fn end_column(&self) -> bool {
        self.column == self.config.width_of(self.octave)
    }

    fn goes_deeper(&self) -> bool {
        self.row() & 1 == 1 && self.config.built(self.octave + 1)
    }

    pub(crate) fn request(&self) -> Request {
        let row = if self.virtual_row { self.config.height_of(self.octave) } else { self.row() };
        let req = self.column == 0 && !self.draining();
        Request { req, octave: self.octave, row, is_virtual: self.virtual_row }
    }

    /// A real slot of octave 0: it needs a pixel.
    fn wants_pixel(&self) -> bool {
        !self.end_column() && !self.draining() && !self.virtual_row && self.octave == 0
    }

    pub(crate) fn in_ready(&self, row_ok: bool) -> bool {
        self.wants_pixel() && (self.column != 0 || row_ok)
    }

    pub(crate) fn enable(&self, in_valid: bool, row_ok: bool) -> bool {
        self.draining() || ((self.column != 0 || row_ok) && (in_valid || !self.wants_pixel()))
    }

    pub(crate) fn slot(&self) -> RasterSlot {
        let (x, row, draining) = (self.column, self.row(), self.draining());
        let real_column = !self.end_column() && !draining;
        let real_pixel = real_column && !self.virtual_row;
        RasterSlot {
            first: x == 0 && !draining,
            last: self.end_column() && !draining,
            real_pixel,
            real_column,
            whole: real_pixel && x >= 6 && row >= 6,
            peak: x >= 7 && (self.virtual_row || row >= 7) && !draining,
            half: real_pixel && x & 1 == 1 && self.goes_deeper(),
            half_scale: self.octave != 0,
            column: x,
            address: self.config.base_of(self.octave) + x,
        }
    }

    pub(crate) fn reset(&mut self) {
        *self = Self { toggles: self.toggles, ..Self::new(self.config) };
    }

    /// One enabled clock.
    pub(crate) fn tick(&mut self) {
        let before = (self.octave, self.column, self.row_0, self.virtual_row, self.drain);
        if self.draining() {
            self.drain -= 1;
        } else if self.end_column() {
            self.column = 0;
            self.next_row();
        } else {
            self.column += 1;
        }
        self.toggles += flips(before.0, self.octave) + flips(before.1, self.column) + flips(before.2, self.row_0);
        self.toggles += flips(before.3.into(), self.virtual_row.into()) + flips(before.4, self.drain);
    }

    fn next_row(&mut self) {
        let last_row = self.row() + 1 == self.config.height_of(self.octave);
        if last_row && !self.virtual_row {
            self.virtual_row = true;
            return;
        }
        self.virtual_row = false;
        if self.goes_deeper() {
            self.octave += 1;
        } else {
            self.octave = 0;
            let frame_end = self.row_0 + 1 == self.config.height;
            self.row_0 = if frame_end { 0 } else { self.row_0 + 1 };
            self.drain = if frame_end { DRAIN } else { 0 };
        }
    }
}
