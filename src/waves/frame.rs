//! Frame signals from the schedule: frame number and start, `frame_valid`, the line being read, and the exposure of each selected row.

use super::lines::{RowLine, pix_clk, row_line};
use super::plan::WavePlan;
use super::signals::{Recorder, SignalId, SignalKind, Value};
use crate::units::RowIndex;

#[derive(Debug)]
pub struct FrameSignals {
    frame_valid: SignalId,
    line: SignalId,
    exposures: Vec<SignalId>,
}

impl FrameSignals {
    /// Adds the frame's signals. Those that stay as they are for the whole frame have their value already.
    pub fn add(recorder: &mut Recorder, plan: &WavePlan<'_>) -> Self {
        let (frame, schedule) = (plan.selection.frame, &plan.sensor.schedule);
        let start_clk = schedule.frame_start_clk(frame).0;
        recorder.add("frame", "number", SignalKind::Bits(32), Value::Bits(frame.0.into()));
        recorder.add("frame", "start_pix_clk", SignalKind::Bits(64), Value::Bits(start_clk));
        let frame_valid = recorder.add("frame", "frame_valid", SignalKind::Bits(1), Value::Bits(0));
        let line = recorder.add("frame", "line", SignalKind::Bits(24), Value::Unknown);
        let rows = plan.selection.rows.iter();
        let exposures =
            rows.map(|row| recorder.add("exposure", &format!("row_{}", row.0), SignalKind::Bits(1), Value::Bits(0)));
        Self { frame_valid, line, exposures: exposures.collect() }
    }

    /// Shows what the schedule says of the whole frame.
    pub fn show(&self, recorder: &mut Recorder, plan: &WavePlan<'_>) {
        let schedule = &plan.sensor.schedule;
        let of = |row| row_line(schedule, plan.selection.frame, row);
        let (first, last) = (of(RowIndex(0)), of(schedule.last_row()));
        recorder.set(self.frame_valid, at_ps(plan, first.start_clk), Value::Bits(1));
        recorder.set(self.frame_valid, at_ps(plan, last.start_clk + schedule.line_clk().0), Value::Bits(0));
        let lines = plan.groups.iter().flat_map(|group| &group.lines);
        for (&signal, line) in self.exposures.iter().zip(lines) {
            recorder.set(signal, at_ps(plan, line.exposure_clk[0]), Value::Bits(1));
            recorder.set(signal, at_ps(plan, line.exposure_clk[1]), Value::Bits(0));
        }
    }

    /// Shows the number of a line while it is read.
    pub fn line_shown(&self, recorder: &mut Recorder, plan: &WavePlan<'_>, line: &RowLine) {
        recorder.set(self.line, at_ps(plan, line.start_clk), Value::Bits(line.line.into()));
        recorder.set(self.line, at_ps(plan, line.start_clk + plan.sensor.schedule.line_clk().0), Value::Unknown);
    }
}

fn at_ps(plan: &WavePlan<'_>, clock: u64) -> u64 {
    plan.at_ps(clock, pix_clk(&plan.sensor.schedule), 0)
}
