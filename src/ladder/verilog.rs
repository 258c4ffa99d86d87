//! Runs a part of a picture in the sensor's Verilog: its time, and the difference of its codes from the rung `clocked`.

use super::clocks::MeasuredCost;
use super::errors::CodeError;
use super::measure::LadderBench;
use super::reference::Reference;
use crate::error::Error;
use crate::fidelity::Rung;
use crate::num::{f64_from_usize, u32_from};
use crate::plane::Plane;
use crate::rtl_simulator::SharedRtlSimulator;
use crate::units::{RowIndex, Size};

/// Pixels that are converted at most: a column's ramp is some hundred clocks of a simulator that plays a million column clocks a second.
const PIXELS_MAX: usize = 16_384;

/// What a part of a picture did in Verilog.
pub(super) struct InVerilog {
    pub cost: MeasuredCost,
    /// The same part clock by clock in Rust.
    clocked: MeasuredCost,
    /// Conversions of a frame of one camera over those of the part.
    pub frame_over_part: f64,
    /// Against the rung `clocked`.
    pub codes: CodeError,
    rows: usize,
    of_rows: usize,
}

impl InVerilog {
    pub fn words(&self) -> String {
        let equal = if self.codes.max_dn == 0 { "all codes equal" } else { "CODES DIFFER" };
        format!(
            "{} of {} rows of the first picture in Verilog ({:.0} ms; {:.1} ms on clocked), {equal}; a frame's time is in \
             proportion, without the extractor, whose Verilog `run --rung rtl` runs",
            self.rows, self.of_rows, self.cost.work_ms, self.clocked.work_ms
        )
    }
}

/// Converts rows of the reference's first picture, evenly spread, on both rungs. Fails where there is no simulator, or it fails.
pub(super) fn measured(bench: &LadderBench<'_>, reference: &Reference) -> Result<InVerilog, Error> {
    let simulator = SharedRtlSimulator::new(bench.assets.rtl_simulator()?);
    let judged = &reference.judged[0];
    let (width, height) = (judged.codes.width_px(), judged.codes.height_px());
    let count = (PIXELS_MAX / width).clamp(1, height);
    let rows: Vec<RowIndex> = (0..count).map(|row| RowIndex(u32_from(row * height / count))).collect();
    let chain_on = |rung| bench.setup.first_chain().on_rung(rung);
    let (clocked, rtl) = (chain_on(Rung::Clocked), chain_on(Rung::Rtl).in_verilog(Some(&simulator)));
    let photons = &judged.truths[0].photons;
    // The first row builds the simulator where it was not built before.
    bench.setup.codes_at(&rtl, judged.id, photons, &rows[..1]);
    let (in_rust, clocked_cost) = bench.clocks.time(|| bench.setup.codes_at(&clocked, judged.id, photons, &rows));
    let (in_verilog, cost) = bench.clocks.time(|| bench.setup.codes_at(&rtl, judged.id, photons, &rows));
    simulator.check()?;
    let plane = |rows: Vec<Vec<u16>>| {
        let size = Size { width_px: u32_from(width), height_px: u32_from(rows.len()) };
        Plane::from_values(size, rows.concat())
    };
    let mut codes = CodeError::default();
    codes.add(&plane(in_verilog), &plane(in_rust));
    // Every slot of an exposure is converted; a second gain converts each once more, in the part as in the frame.
    let frame_over_part = f64_from_usize(height * judged.truths.len()) / f64_from_usize(rows.len());
    Ok(InVerilog { cost, clocked: clocked_cost, frame_over_part, codes, rows: rows.len(), of_rows: height })
}
