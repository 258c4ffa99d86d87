//! Optical-black rows and the black clamp. Enters: the rows' codes. Leaves: what is added to all codes of the frame.
//!
//! Optical-black rows lie behind metal: they gather dark charge and all noise of the chain, and no light. They are read before the
//! picture; with the clamp on, their mean code is moved to the black level, so that dark signal and offsets that drift with
//! temperature or die leave the picture.

use super::{Chain, Shot};
use crate::events::Events;
use crate::num::{index, low_u16, u64_from};

/// Rows behind metal.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct BlackRows {
    /// How many.
    pub rows: u32,
    /// Row of the array at which they begin, which names their draws: beyond the picture's rows.
    pub first_row: u32,
    /// Whether their mean is moved to the black level.
    pub clamp: bool,
}

/// Adds a whole number to codes, clipped at both ends.
pub(super) fn shift_row(codes: &mut [u16], shift_dn: i32, code_max: u32) {
    if shift_dn == 0 {
        return;
    }
    let most = i32::try_from(code_max).expect("a code has at most 16 bits");
    for code in codes {
        *code = low_u16((i32::from(*code) + shift_dn).clamp(0, most).cast_unsigned());
    }
}

impl Chain {
    /// Reads the optical-black rows of an exposure, and gives what the clamp adds to the codes of each reading.
    pub(super) fn black_shifts_dn(&self, shot: &Shot<'_>, events: &mut Events) -> Vec<i32> {
        let mut shifts_dn = vec![0; self.readings.len()];
        if self.black.rows == 0 {
            return shifts_dn;
        }
        let mut buffers = self.buffers(shot.photons.width_px());
        let mut codes = vec![0; buffers.values.len()];
        let read = self.layout.as_ref().map_or_else(|| (0..codes.len()).collect(), super::Layout::read_columns);
        let mut sums_dn = vec![0_u64; self.readings.len()];
        for row in 0..self.black.rows {
            let at = self.at(shot.capture, index(self.black.first_row + row), shot.times[0]);
            for (number, sum_dn) in sums_dn.iter_mut().enumerate() {
                buffers.values.fill(0.0);
                self.gather(at, &mut buffers);
                self.readings[number].sense(at, self.die_seed, &mut buffers);
                self.read_once(number, at, shot, &mut buffers, &mut codes, events);
                *sum_dn += read.iter().map(|&column| u64::from(codes[column])).sum::<u64>();
            }
        }
        if self.black.clamp {
            let count = u64::from(self.black.rows) * u64_from(read.len());
            for ((shift_dn, sum_dn), reading) in shifts_dn.iter_mut().zip(sums_dn).zip(&self.readings) {
                let mean_dn = (sum_dn + count / 2) / count; // Halves up.
                let mean_dn = i32::try_from(mean_dn).expect("a mean of codes has at most 16 bits");
                let black_dn = i32::try_from(reading.parameters.adc.black_level_dn).expect("at most 16 bits");
                *shift_dn = black_dn - mean_dn;
            }
        }
        shifts_dn
    }
}
