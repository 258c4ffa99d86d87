//! Whether the extractor keeps up with the readout, and which settings let it.

use super::sensor::SensorSetup;
use crate::compute::ExtractorParams;
use crate::num::{f64_from_u64, u64_truncated};
use crate::report::record::ExtractorClocks;

/// Engines that an extractor can have.
const ENGINES_MAX: u32 = 4;
/// Fastest clock that a remedy names, and the step to which it is rounded.
const REMEDY_HZ_MAX: u64 = 1_000_000_000;
const REMEDY_STEP_HZ: u64 = 100_000;

impl SensorSetup {
    /// The extractor's clocks with so many features spread evenly over the picture; none where the sensor extracts nothing.
    pub fn keep_up(&self, features: u64) -> Option<ExtractorClocks> {
        let clocks = self.extractor_clocks(features)?;
        // A readout that stands still for the link makes the frame longer.
        let stalled_s = self.flow_of(features).map_or(0.0, |flow| self.link.seconds(flow.stalled));
        let required = clocks.required_clk() + u64_truncated((stalled_s * f64_from_u64(self.compute_hz)).ceil());
        let counted = ExtractorClocks {
            required,
            queue_most: Some(clocks.queue_most),
            required_mean: f64_from_u64(required),
            frames_over: u64::from(required > self.extractor_clk_available()),
            ..ExtractorClocks::default()
        };
        Some(self.judged(counted, features))
    }

    /// The same with verdict and remedy; the clocks are those of a frame with so many features.
    pub(super) fn judged(&self, counted: ExtractorClocks, features: u64) -> ExtractorClocks {
        let keeps_up = counted.frames_over == 0;
        ExtractorClocks {
            available: self.extractor_clk_available(),
            clock_hz: self.compute_hz,
            keeps_up,
            queue_depth: self.extractor.fifo_depth,
            remedy: if keeps_up { String::new() } else { self.remedy(counted.required, features) },
            ..counted
        }
    }

    /// Settings with which a frame passes that needs so many clocks now. A change is judged by evenly spread features, whose clocks are
    /// scaled to the ones that were counted.
    fn remedy(&self, required_clk: u64, features: u64) -> String {
        let even_clk = |extractor: &ExtractorParams, hz: u64| self.even_clocks(extractor, hz, features).required_clk();
        let scale = f64_from_u64(required_clk) / f64_from_u64(even_clk(&self.extractor, self.compute_hz).max(1));
        let passes = |extractor: &ExtractorParams, hz: u64| {
            let needed_clk = u64_truncated((scale * f64_from_u64(even_clk(extractor, hz))).ceil());
            needed_clk <= self.clk_available(hz)
        };
        let mut remedies = Vec::new();
        let ratio = f64_from_u64(required_clk) / f64_from_u64(self.extractor_clk_available().max(1));
        let mut hz = u64_truncated(ratio * f64_from_u64(self.compute_hz)).div_ceil(REMEDY_STEP_HZ) * REMEDY_STEP_HZ;
        while hz <= REMEDY_HZ_MAX && !passes(&self.extractor, hz) {
            hz = (hz + hz / 50).div_ceil(REMEDY_STEP_HZ) * REMEDY_STEP_HZ;
        }
        if hz <= REMEDY_HZ_MAX {
            remedies.push(format!("compute.clock_hz = {hz} or more"));
        }
        let engines = (self.extractor.engines + 1..=ENGINES_MAX)
            .find(|&engines| passes(&ExtractorParams { engines, ..self.extractor }, self.compute_hz));
        remedies.extend(engines.map(|engines| format!("compute.engines = {engines}")));
        remedies.push(
            "a lower compute.target_features (0 sets no limit) or compute.per_cell, or a longer frame".to_owned(),
        );
        remedies.join(", or ")
    }

    /// What to tell a user before any picture is known, where the extractor can need more clocks than a frame has: with the expected
    /// features, or with as many as its cells hold.
    pub fn extractor_warning(&self) -> Option<String> {
        let most = self.extractor.features_max(self.size);
        for (features, word) in [(self.extractor.features_expected(self.size), "needs"), (most, "can need")] {
            let clocks = self.keep_up(features)?;
            if !clocks.keeps_up {
                let ExtractorClocks { required, available, remedy, .. } = clocks;
                return Some(format!(
                    "the extractor {word} {required} clocks of the {available} that a frame has, with {features} features; use {remedy}"
                ));
            }
        }
        None
    }
}
