//! The charge of every pixel, in electrons, after the pixel's effects and before conversion.

use super::state::{Capture, Chain, ROWS_PER_CHUNK, RowTimes};
use crate::parallel::over_chunks;
use crate::plane::Plane;

impl Chain {
    /// Electrons of each pixel of the window at the sense node before conversion to a voltage, by the same draws as
    /// `capture`: shot noise, dark charge, full well and all other selected effects on charge are in, conversion gain, kTC and
    /// read noise are not. Pixels that binning joins stand apart; the first reading's, where there are two.
    pub fn electrons(&self, photons: &Plane<f32>, capture: Capture<'_>, times: &[RowTimes]) -> Plane<f32> {
        let input = self.input_without_converters(photons, capture, times);
        let (first_row, first_column) = self.window_origin();
        let mut electrons = Plane::filled(photons.size(), 0.0_f32);
        let width = photons.width_px();
        let chunk = |number: usize, rows: &mut [f32]| {
            let mut buffers = self.buffers(width);
            for (offset, row_e) in rows.chunks_exact_mut(width).enumerate() {
                let array_row = first_row + number * ROWS_PER_CHUNK + offset;
                self.load(&input, array_row, &mut buffers);
                self.readings[0].sense(self.timed_row_of(&input, array_row), self.die_seed, &mut buffers);
                row_e.copy_from_slice(&buffers.values[first_column..]);
            }
        };
        over_chunks(electrons.values_mut(), width * ROWS_PER_CHUNK, chunk);
        electrons
    }
}
