//! Power of the sensor's blocks over the lines that are shown, in mW: means over spans of the line, from the energy model with every pixel
//! at 0.4 of the greatest code.

use super::signals::{Recorder, SignalId, SignalKind, Value};
use crate::num::u64_half_even;
use crate::report::energy_record::LinePower;

/// Spans begin at whole nanoseconds of the line.
pub const CLOCK_HZ: u64 = 1_000_000_000;

#[derive(Debug)]
pub struct PowerSignals {
    /// One a block, in the order of the spans' blocks.
    blocks: Vec<SignalId>,
    total: SignalId,
    line: LinePower,
}

impl PowerSignals {
    /// Adds a real signal a block, and their sum. Before the first line that is shown they stand at 0.
    pub fn add(recorder: &mut Recorder, line: LinePower) -> Self {
        let names =
            line.spans.first().map_or_else(Vec::new, |span| span.blocks_mw.iter().map(|(name, _)| name).collect());
        let mut add = |name: &str| recorder.add("power", &format!("{name}_mw"), SignalKind::Real, Value::Real(0.0));
        let blocks = names.into_iter().map(&mut add).collect();
        let total = add("total");
        Self { blocks, total, line }
    }

    /// Adds a line; `at_ps` converts nanoseconds of it to time.
    pub fn show(&self, recorder: &mut Recorder, at_ps: &dyn Fn(u64) -> u64) {
        for span in &self.line.spans {
            let time_ps = at_ps(u64_half_even(1e3 * span.start_us));
            let mut total_mw = 0.0;
            for (&signal, (_, &mw)) in self.blocks.iter().zip(span.blocks_mw.iter()) {
                recorder.set(signal, time_ps, Value::Real(to_picowatts(mw)));
                total_mw += mw;
            }
            recorder.set(self.total, time_ps, Value::Real(to_picowatts(total_mw)));
        }
    }
}

/// Rounds to picowatts, so that equal powers that were summed over different spans do not differ in the last bit: that is no change.
fn to_picowatts(mw: f64) -> f64 {
    (mw * 1e9).round_ties_even() / 1e9
}
