//! Half-scale pixels and their row buffer, twin of `verilog/fx_half.sv`. Averages 2x2 pixels of an octave to one pixel of the next: (a +
//! b + c + d + 2) >> 2.

use crate::words::{HalfScaleMean, rounded};

/// The row buffer and the pixel read from it. It has no other registers.
#[derive(Debug)]
pub(crate) struct FxHalf<'a> {
    row: &'a mut [u16],
    pixel: u16,
}

/// The mean of four pixels, rounded half up.
#[inline(always)]
pub(crate) fn mean_of_four(newest: [u16; 4]) -> u16 {
    let sum: u32 = newest.iter().map(|&pixel| u32::from(pixel)).sum();
    u16::try_from(rounded(HalfScaleMean::from_bits(sum))).expect("a mean of pixels")
}

impl<'a> FxHalf<'a> {
    pub(crate) fn new(row: &'a mut [u16]) -> Self {
        Self { row, pixel: 0 }
    }

    pub(crate) fn pixel(&self) -> u16 {
        self.pixel
    }

    /// One enabled clock.
    pub(crate) fn tick(&mut self, read: Option<usize>, write: Option<usize>, newest: [u16; 4]) {
        if let Some(address) = read {
            self.pixel = self.row[address];
        }
        if let Some(address) = write {
            self.row[address] = mean_of_four(newest);
        }
    }
}
