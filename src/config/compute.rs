//! Checks `[compute]` and converts it to the extractor's parameters.

use super::check::{member, one_of, within};
use super::scenario::Scenario;
use crate::compute::{ExtractorParams, Overflow, PairPattern, Rank, Smoothing};
use crate::error::Error;

impl Scenario {
    /// Clock of the extractor in Hz; none where it is the pixel clock. Fails on a frequency out of range.
    pub fn compute_hz(&self) -> Result<Option<u64>, Error> {
        let range = 1_000..=1_000_000_000;
        let of = |hz| within("compute.clock_hz", hz, range.clone(), "1000 to 1000000000");
        self.compute.clock_hz.map(of).transpose()
    }

    /// The extractor. Fails on values out of range, unknown names.
    pub fn extractor(&self) -> Result<ExtractorParams, Error> {
        let compute = &self.compute;
        one_of("compute.detector", &compute.detector, &[("fast9", ())])?;
        ExtractorParams {
            threshold: compute.threshold,
            target_features: compute.target_features,
            pipeline_bits: compute.pipeline_bits,
            smoothing: member("compute.smoothing", &compute.smoothing, &Smoothing::ALL, Smoothing::name)?,
            octaves: compute.octaves,
            cell_px: compute.cell_px,
            per_cell: compute.per_cell,
            rank: member("compute.rank", &compute.rank, &Rank::ALL, Rank::name)?,
            subpixel: compute.subpixel,
            angle_bits: compute.angle_bits,
            descriptor_bits: compute.descriptor_bits,
            pattern: member("compute.pattern", &compute.pattern, &PairPattern::ALL, PairPattern::name)?,
            engines: compute.engines,
            fifo_depth: compute.fifo_depth,
            overflow: member("compute.overflow", &compute.overflow, &Overflow::ALL, Overflow::name)?,
        }
        .checked()
    }
}
