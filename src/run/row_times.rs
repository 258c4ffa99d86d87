//! Row times of a window, and the merged codes of several readings.

use crate::effects::chain::RowTimes;
use crate::plane::Plane;
use crate::readout::{ClockSpan, HdrMerge, Schedule};
use crate::units::{FrameIndex, RowIndex, Span};

/// A span for every row of the window; rows that are not read take the last one's that is.
pub fn spans(schedule: &Schedule, of_row: impl Fn(RowIndex) -> Option<ClockSpan>) -> Vec<Span> {
    let window = schedule.geometry().window();
    let mut spans: Vec<Span> = Vec::new();
    for row in window.y_px..window.y_px + window.height_px {
        let span = of_row(RowIndex(row)).map(|span| schedule.span(span)).or_else(|| spans.last().copied());
        spans.push(span.expect("the window's first row is read"));
    }
    spans
}

/// Times of the window's rows, of which each is read so much later than scheduled (none where there are no numbers).
pub fn row_times(schedule: &Schedule, frame: FrameIndex, slot: usize, late_s: &[f64]) -> Vec<RowTimes> {
    let exposures = spans(schedule, |row| schedule.row_exposure_clk(frame, slot, row));
    let readouts = spans(schedule, |row| schedule.row_readout_clk(frame, slot, row));
    let times = |(row, (exposure, readout)): (usize, (&Span, &Span))| {
        let readout_s = readout.start_s + late_s.get(row).copied().unwrap_or(0.0);
        RowTimes { exposure_s: exposure.length_s(), storage_s: readout_s - exposure.end_s, readout_s }
    };
    exposures.iter().zip(&readouts).enumerate().map(times).collect()
}

/// How long each row of the window is exposed in each slot, in clocks.
pub fn slot_lengths_clk(schedule: &Schedule, frame: FrameIndex) -> Vec<Vec<u64>> {
    let window = schedule.geometry().window();
    let length_clk = |slot: usize, row: u32| {
        schedule.row_exposure_clk(frame, slot, RowIndex(window.y_px + row)).map_or(0, |span| span.end.0 - span.start.0)
    };
    let of_slot = |slot: usize| (0..window.height_px).map(|row| length_clk(slot, row)).collect();
    (0..schedule.slots().len()).map(of_slot).collect()
}

/// One picture of several readings.
pub fn merge_planes(merge: &HdrMerge, read: &[Plane<u16>]) -> Plane<u16> {
    let mut merged = Plane::filled(read[0].size(), 0_u16);
    for row in 0..merged.height_px() {
        let rows: Vec<&[u16]> = read.iter().map(|plane| plane.row(row)).collect();
        merge.merge_row(&rows, merged.row_mut(row));
    }
    merged
}
