//! Start times of the selected rows' lines, in `pix_clk` from the frame's first clock, grouped into runs of consecutive lines.

use super::clocks::Frequency;
use crate::readout::Schedule;
use crate::units::{FrameIndex, RowIndex};

/// A row's line and exposure, in `pix_clk` from the first clock of its frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RowLine {
    /// Row of the array, the first of those that are read together.
    pub array_row: u32,
    /// Line within the readout, from that of the first row on.
    pub line: u32,
    pub start_clk: u64,
    /// First and last instant of the exposure.
    pub exposure_clk: [u64; 2],
}

/// `pix_clk`, as the camera's own crystal has it.
pub fn pix_clk(schedule: &Schedule) -> Frequency {
    Frequency::hz(schedule.pixel_rate_hz())
}

pub fn row_line(schedule: &Schedule, frame: FrameIndex, row: RowIndex) -> RowLine {
    let array_row = schedule.geometry().rows_of(row).next().expect("a row of the picture is read");
    let zero_clk = schedule.frame_start_clk(frame).0;
    let read = schedule.row_readout_clk(frame, 0, array_row).expect("a row of the picture is read");
    let exposure = schedule.row_exposure_clk(frame, 0, array_row).expect("a row of the picture is read");
    let line = schedule.geometry().read_of(array_row).expect("a row of the picture is read");
    // An exposure ends with its frame at the earliest, and is shorter than a frame.
    let exposure_clk = [exposure.start.0 - zero_clk, exposure.end.0 - zero_clk];
    RowLine { array_row: array_row.0, line, start_clk: read.start.0 - zero_clk, exposure_clk }
}

/// Chosen rows in groups whose lines follow each other and whose array rows stand at one distance; rows rise.
pub fn groups(lines: &[RowLine]) -> Vec<Vec<RowLine>> {
    let mut groups: Vec<Vec<RowLine>> = Vec::new();
    for &line in lines {
        let joins = groups.last().is_some_and(|group| {
            let last = group[group.len() - 1];
            let step = |after: RowLine, before: RowLine| i64::from(after.array_row) - i64::from(before.array_row);
            let first_step = group.get(1).map_or(step(line, last), |second| step(*second, group[0]));
            line.line == last.line + 1 && step(line, last) == first_step && first_step > 0
        });
        match groups.last_mut() {
            Some(group) if joins => group.push(line),
            _ => groups.push(vec![line]),
        }
    }
    groups
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn rows_are_grouped_where_lines_follow_and_array_rows_step_evenly() {
        let line = |array_row, line| RowLine { array_row, line, start_clk: 0, exposure_clk: [0, 0] };
        let lines = [line(0, 0), line(2, 1), line(4, 2), line(5, 3), line(9, 5), line(8, 6)];
        let found: Vec<usize> = groups(&lines).iter().map(Vec::len).collect();
        assert_eq!(found, [3, 1, 1, 1]);
        assert!(groups(&[]).is_empty());
    }
}
