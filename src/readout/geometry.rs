//! Which pixels of the array become which pixels of the picture. Computes the output size, and the array rows and columns behind every
//! output row and column.
//!
//! Rows are read from top to bottom. A binned picture takes pixels of one mosaic phase: with a period of p and a
//! binning of n, output row `R = b p + q` is made of the array rows `b n p + q + k p`, k = 0 to n - 1.

use super::params::ReadoutParams;
pub use super::params::{BinningMode, Window};
use crate::error::Error;
use crate::units::{RowIndex, Size};

/// The pixels that are read, and what becomes of them.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Geometry {
    array: Size,
    window: Window,
    binning: u32,
    mode: BinningMode,
    mosaic_px: u32,
}

impl Geometry {
    /// Checks window and binning against the array. Fails on a window beyond the array, off its steps, or no whole number of binned
    /// pixels; names key, value and an accepted value.
    pub fn new(array: Size, params: &ReadoutParams) -> Result<Self, Error> {
        for (key, side_px) in [("sensor.width", array.width_px), ("sensor.height", array.height_px)] {
            if side_px == 0 {
                return Err(Error::key(key, 0, "out of range; use 1 or more"));
            }
        }
        if ![1, 2, 4].contains(&params.binning) {
            return Err(Error::key("sensor.readout.binning", params.binning, "not known; use 1, 2 or 4"));
        }
        if !(1..=64).contains(&params.window_step) {
            return Err(Error::key("sensor.readout.window_step", params.window_step, "out of range; use 1 to 64"));
        }
        assert!((1..=4).contains(&params.mosaic_px), "mosaics have periods of 1 to 4 pixels");
        let whole = Window { x_px: 0, y_px: 0, width_px: array.width_px, height_px: array.height_px };
        let window = params.window.unwrap_or(whole);
        if params.window.is_some() {
            check_window(window, array, params.window_step)?;
        }
        let group_px = params.binning * params.mosaic_px;
        // A picture without binning may end inside a mosaic; a binned pixel may not.
        let is_whole = window.width_px.is_multiple_of(group_px) && window.height_px.is_multiple_of(group_px);
        if params.binning > 1 && !is_whole {
            let down = |side_px: u32| side_px / group_px * group_px;
            let reason = format!(
                "{} x {} pixels are not multiples of {group_px}; use a window of {} x {}",
                window.width_px,
                window.height_px,
                down(window.width_px),
                down(window.height_px)
            );
            return Err(Error::key("sensor.readout.binning", params.binning, reason));
        }
        Ok(Self { array, window, binning: params.binning, mode: params.binning_mode, mosaic_px: params.mosaic_px })
    }

    /// The whole array.
    pub fn array_size(&self) -> Size {
        self.array
    }

    /// What is read of it.
    pub fn window(&self) -> Window {
        self.window
    }

    /// Pixels of each direction that become one.
    pub fn binning(&self) -> u32 {
        self.binning
    }

    /// How they become one.
    pub fn mode(&self) -> BinningMode {
        self.mode
    }

    /// The picture.
    pub fn output_size(&self) -> Size {
        Size { width_px: self.window.width_px / self.binning, height_px: self.window.height_px / self.binning }
    }

    /// Lines that one exposure's rows need, a row of conversions each.
    pub fn reads(&self) -> u32 {
        match self.mode {
            BinningMode::Average => self.window.height_px,
            BinningMode::Charge | BinningMode::Skip => self.output_size().height_px,
        }
    }

    /// Conversions of a line.
    pub fn columns_read(&self) -> u32 {
        match self.mode {
            BinningMode::Average => self.window.width_px,
            BinningMode::Charge | BinningMode::Skip => self.output_size().width_px,
        }
    }

    /// Array rows of an output row, from the top.
    pub fn rows_of(&self, row: RowIndex) -> impl Iterator<Item = RowIndex> + use<> {
        self.members(row.0, self.window.y_px).map(RowIndex)
    }

    /// Array columns of an output column, from the left.
    pub fn columns_of(&self, column: u32) -> impl Iterator<Item = u32> + use<> {
        self.members(column, self.window.x_px)
    }

    /// The output row that an array row goes into, and its index among that row's array rows; none where it is not read.
    pub fn output_row(&self, array_row: RowIndex) -> Option<(RowIndex, u32)> {
        let inside = array_row.0.checked_sub(self.window.y_px).filter(|inside| *inside < self.window.height_px)?;
        let (period, group) = (self.mosaic_px, self.binning * self.mosaic_px);
        let (block, within) = (inside / group, inside % group);
        let member_index = within / period;
        if self.mode == BinningMode::Skip && member_index > 0 {
            return None;
        }
        Some((RowIndex(block * period + within % period), member_index))
    }

    /// The line, counted from the first of its exposure, in which an array row is read; none where it is not read.
    pub fn read_of(&self, array_row: RowIndex) -> Option<u32> {
        let (row, _) = self.output_row(array_row)?;
        Some(match self.mode {
            BinningMode::Average => array_row.0 - self.window.y_px,
            BinningMode::Charge | BinningMode::Skip => row.0,
        })
    }

    fn members(&self, output: u32, first: u32) -> impl Iterator<Item = u32> + use<> {
        let period = self.mosaic_px;
        let start = first + output / period * period * self.binning + output % period;
        let count = if self.mode == BinningMode::Skip { 1 } else { self.binning };
        (0..count).map(move |at| start + at * period)
    }
}

fn check_window(window: Window, array: Size, step: u32) -> Result<(), Error> {
    let sides = [
        ("width", window.x_px, window.width_px, array.width_px),
        ("height", window.y_px, window.height_px, array.height_px),
    ];
    let refused = |reason: String| {
        let Window { x_px, y_px, width_px, height_px } = window;
        Err(Error::key("sensor.readout.window", format!("[{x_px}, {y_px}, {width_px}, {height_px}]"), reason))
    };
    for (name, start, length, most) in sides {
        if !start.is_multiple_of(step) || !length.is_multiple_of(step) || length == 0 {
            let start = start.min(most.saturating_sub(step)) / step * step;
            let length = (length.min(most - start) / step * step).max(step);
            return refused(format!("off the steps of {step} px; use {start} with a {name} of {length}"));
        }
        if start.checked_add(length).is_none_or(|end| end > most) {
            return refused(format!("the array's {name} is {most}; use start and {name} up to {most} together"));
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::readout::{ExposureSetting, Shutter};

    const ARRAY: Size = Size { width_px: 64, height_px: 48 };

    fn params() -> ReadoutParams {
        ReadoutParams::plain(Shutter::Rolling, 1000, 1000, 1_000_000, ExposureSetting::Lines(1))
    }

    fn window(x_px: u32, y_px: u32, width_px: u32, height_px: u32) -> Option<Window> {
        Some(Window { x_px, y_px, width_px, height_px })
    }

    #[test]
    fn every_array_row_of_the_window_goes_into_one_output_row_and_skipped_ones_into_none() {
        let mut tried = 0;
        for (binning, mosaic_px) in [(1, 1), (1, 2), (2, 1), (2, 2), (4, 1), (4, 2), (2, 4), (4, 3)] {
            for binning_mode in BinningMode::ALL {
                let window = window(2, 24, 48, 24);
                let params = ReadoutParams { window, binning, mosaic_px, binning_mode, ..params() };
                let geometry = Geometry::new(ARRAY, &params).unwrap();
                let mut seen = [0; 48];
                for row in (0..geometry.output_size().height_px).map(RowIndex) {
                    for (at, array_row) in geometry.rows_of(row).enumerate() {
                        assert_eq!(geometry.output_row(array_row), Some((row, u32::try_from(at).unwrap())));
                        assert_eq!(array_row.0 % mosaic_px, (24 + row.0 % mosaic_px) % mosaic_px, "one colour");
                        seen[crate::num::index(array_row.0)] += 1;
                        tried += 1;
                    }
                }
                let used: u32 = seen.iter().sum();
                assert!(seen.iter().all(|count| *count <= 1) && seen[..24].iter().all(|count| *count == 0));
                let skipping = binning_mode == BinningMode::Skip;
                assert_eq!(used, if skipping { 24 / binning } else { 24 });
                assert_eq!(geometry.reads(), if binning_mode == BinningMode::Average { 24 } else { 24 / binning });
            }
        }
        assert!(tried > 400, "only {tried} rows were tried");
    }

    #[test]
    fn lines_are_read_from_top_to_bottom_and_a_charge_bin_in_one_line() {
        let reads = |binning_mode, mosaic_px| -> Vec<Option<u32>> {
            let params = ReadoutParams { binning: 2, mosaic_px, binning_mode, ..params() };
            let geometry = Geometry::new(ARRAY, &params).unwrap();
            (0..8).map(|row| geometry.read_of(RowIndex(row))).collect()
        };
        let some = |lines: [u32; 8]| lines.map(Some).to_vec();
        assert_eq!(reads(BinningMode::Charge, 1), some([0, 0, 1, 1, 2, 2, 3, 3]));
        assert_eq!(reads(BinningMode::Charge, 2), some([0, 1, 0, 1, 2, 3, 2, 3]));
        assert_eq!(reads(BinningMode::Average, 2), some([0, 1, 2, 3, 4, 5, 6, 7]));
        assert_eq!(reads(BinningMode::Skip, 1)[..4], [Some(0), None, Some(1), None]);
    }

    #[test]
    fn windows_that_do_not_fit_are_refused_with_one_that_would_do() {
        let cases = [
            (window(0, 0, 63, 48), 2, 1, "a width of 62"),
            (window(1, 0, 32, 32), 2, 1, "off the steps of 2 px; use 0 with a width of 32"),
            (window(40, 0, 32, 32), 2, 1, "up to 64 together"),
            (window(0, u32::MAX - 1, 32, 32), 1, 1, "up to 48 together"),
            (window(0, 0, 32, 0), 2, 1, "a height of 2"),
            (window(0, 0, 32, 30), 2, 4, "use a window of 32 x 28"),
        ];
        for (window, window_step, binning, words) in cases {
            let params = ReadoutParams { window, window_step, binning, ..params() };
            let message = Geometry::new(ARRAY, &params).unwrap_err().to_string();
            assert!(message.contains(words), "{message}");
        }
        let odd = ReadoutParams { binning: 3, ..params() };
        assert!(Geometry::new(ARRAY, &odd).unwrap_err().to_string().contains("1, 2 or 4"));
    }
}
