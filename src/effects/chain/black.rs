//! Optical-black rows and the black clamp. Computes the offset that the clamp adds to all codes of the frame.
//!
//! Optical-black rows lie behind metal: they gather dark charge and all noise of the chain, and no light. They are read before the
//! picture; with the clamp on, their mean code is moved to the black level, so that dark signal and offsets that drift with
//! temperature or die leave the picture.

use super::layout::WindowLayout;
use super::row::{RowBuffers, TimedRow};
use super::state::{Chain, ExposureInput, RowTimes};
use crate::events::Events;
use crate::num::{index, u64_from};

impl Chain {
    /// Reads the optical-black rows of an exposure, counts the pixels of each effect, and gives what the clamp adds to the codes of
    /// each reading.
    pub(super) fn black_shifts_dn(&self, input: &ExposureInput<'_>, events: &mut Events, hits: &mut [u64]) -> Vec<i32> {
        let mut shifts_dn = vec![0; self.readings.len()];
        if self.black.rows == 0 {
            return shifts_dn;
        }
        let mut buffers = self.buffers(input.photons.width_px());
        let mut codes = vec![0; buffers.values.len()];
        let read = self.layout.as_ref().map_or_else(|| (0..codes.len()).collect(), WindowLayout::read_columns);
        let mut sums_dn = vec![0_u64; self.readings.len()];
        let together = self.layout.as_ref().map_or(1, WindowLayout::charge_rows_of_one);
        for row in 0..self.black.rows {
            let times = self.black_times(input, row);
            let array_rows = (0..together).map(|number| index(self.black.first_row + row * together + number));
            let rows: Vec<TimedRow> =
                array_rows.map(|array_row| self.timed_row(input.capture, array_row, times)).collect();
            for (number, sum_dn) in sums_dn.iter_mut().enumerate() {
                self.load_black(number, &rows, &mut buffers);
                self.read_once(number, rows[0], input, &mut buffers, &mut codes, events);
                *sum_dn += read.iter().map(|&column| u64::from(codes[column])).sum::<u64>();
            }
        }
        super::state::add(hits, &buffers.hits);
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

    /// Times of a black row: the picture's first row's, as many lines earlier as it is read before that one.
    fn black_times(&self, input: &ExposureInput<'_>, row: u32) -> RowTimes {
        let first = input.times[0];
        let line_s = input.times.iter().map(|times| times.readout_s - first.readout_s).find(|step_s| *step_s > 0.0);
        let lines = f64::from(self.black.rows - row);
        RowTimes { readout_s: first.readout_s - lines * line_s.unwrap_or(0.0), ..first }
    }

    /// Electrons of a black row at the sense node: of one array row, or of as many as the picture's charges come from.
    fn load_black(&self, number: usize, rows: &[TimedRow], buffers: &mut RowBuffers) {
        let load = |timed_row: TimedRow, buffers: &mut RowBuffers| {
            buffers.values.fill(0.0);
            self.gather(timed_row, buffers);
            self.readings[number].sense(timed_row, self.die_seed, buffers);
        };
        let Some(layout) = self.charge_binning() else {
            load(rows[0], buffers);
            return;
        };
        let mut sums_e = vec![0.0; buffers.values.len()];
        for &timed_row in rows {
            load(timed_row, buffers);
            layout.add_charges(&buffers.values, &mut sums_e);
        }
        buffers.values.copy_from_slice(&sums_e);
    }
}
