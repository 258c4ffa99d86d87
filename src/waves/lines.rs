//! When the lines of chosen rows come. Enters: the schedule. Leaves: their starts in `pix_clk` from the frame's first clock, and which of
//! them follow each other without a line between.

use super::clocks::Frequency;
use crate::readout::{Schedule, Shutter};
use crate::units::RowIndex;

/// A row's line and exposure, in `pix_clk` from the first clock of its frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RowLine {
    /// Row of the picture.
    pub row: RowIndex,
    /// Row of the array.
    pub array_row: u32,
    /// Line within the readout, from that of the first row on.
    pub line: u32,
    /// First clock of the line.
    pub start_clk: u64,
    /// First and last instant of the exposure.
    pub exposure_clk: [u64; 2],
}

/// `pix_clk`.
pub fn pix_clk(schedule: &Schedule) -> Frequency {
    Frequency::hz(schedule.pixel_rate_hz())
}

/// The line of a row.
pub fn row_line(schedule: &Schedule, row: RowIndex) -> RowLine {
    let (line_clk, frame_clk) = (schedule.line_clk().0, schedule.frame_clk().0);
    let start_clk = frame_clk + u64::from(row.0) * line_clk;
    let end = if schedule.shutter() == Shutter::Rolling { start_clk } else { frame_clk };
    let exposure_clk = [end - schedule.exposure_lines() * line_clk, end];
    RowLine { row, array_row: row.0, line: row.0, start_clk, exposure_clk }
}

/// Chosen rows in groups whose lines follow each other; rows rise.
pub fn groups(lines: &[RowLine]) -> impl Iterator<Item = &[RowLine]> {
    lines.chunk_by(|before, after| after.line == before.line + 1)
}
