//! Optical-black rows and the black clamp. Enters: the rows' codes. Leaves: what is added to all codes of the frame.
//!
//! Optical-black rows lie behind metal: they gather dark charge and all noise of the chain, and no light. They are read before the
//! picture; with the clamp on, their mean code is moved to the black level, so that dark signal and offsets that drift with
//! temperature or die leave the picture.

use super::{Capture, Chain, RowBuffers, RowTimes};
use crate::events::Events;
use crate::num::{index, low_u16, u32_from};
use crate::plane::Plane;

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
    pub(super) fn black_shifts_dn(
        &self,
        capture: Capture<'_>,
        photons: &Plane<f32>,
        times: RowTimes,
        events: &mut Events,
    ) -> Vec<i32> {
        let mut shifts_dn = vec![0; self.readings.len()];
        if self.black.rows == 0 {
            return shifts_dn;
        }
        let width = photons.width_px();
        let (dark, mut codes) = (vec![0.0; width], vec![0; width]);
        let mut sums = vec![0_u64; self.readings.len()];
        let mut buffers = RowBuffers::new(width, self.samples(), 1);
        for row in 0..self.black.rows {
            let row = index(self.black.first_row + row);
            self.gather(&dark, capture, row, times, &mut buffers);
            let charge_e = buffers.values.clone();
            for (number, sum) in sums.iter_mut().enumerate() {
                buffers.values.copy_from_slice(&charge_e);
                let at = self.at(capture, row, times);
                self.read_once(number, at, &shifts_dn, &mut buffers, &mut codes, events);
                *sum += codes.iter().map(|&code| u64::from(code)).sum::<u64>();
            }
        }
        if self.black.clamp {
            let count = u64::from(self.black.rows) * u64::from(u32_from(width));
            for ((shift_dn, sum), reading) in shifts_dn.iter_mut().zip(sums).zip(&self.readings) {
                let mean_dn = (sum + count / 2) / count; // Halves up.
                let mean_dn = i32::try_from(mean_dn).expect("a mean of codes has at most 16 bits");
                let black_dn = i32::try_from(reading.parameters.adc.black_level_dn).expect("at most 16 bits");
                *shift_dn = black_dn - mean_dn;
            }
        }
        shifts_dn
    }
}
