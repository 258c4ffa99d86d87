//! Interface to an RTL simulation of the sensor's Verilog, for the rung `rtl`. Rows of comparator crossings become codes; words of a
//! picture become feature records, counts and clocks. `files` builds and runs the simulator; this module only declares the calls.

use std::fmt;
use std::sync::{Arc, Mutex};

use rtl_models::cds::CdsConfig;
use rtl_models::extractor_rows::ExtractorHost;
use rtl_models::fx_back::{FxBackConfig, FxCounts, FxSettings};

use crate::error::Error;

/// Request to convert one row.
#[derive(Clone, Copy, Debug)]
pub struct RowRequest<'a> {
    /// Every column's counter.
    pub cds: CdsConfig,
    /// Steps of the signal ramp.
    pub signal_steps: u32,
    /// Steps of the reset ramp; 0 where there is none.
    pub reset_steps: u32,
    /// First step of the reset ramp at which each column's comparator is high, or `rtl_models::NEVER`; empty without that ramp.
    pub reset_clk: &'a [u32],
    /// The same of the signal ramp.
    pub signal_clk: &'a [u32],
}

/// Request to extract features from one picture.
#[derive(Clone, Copy, Debug)]
pub struct FrameRequest<'a> {
    /// Hardware parameters.
    pub hardware: FxBackConfig,
    /// Its registers.
    pub settings: FxSettings,
    /// The threshold that an adaptive one has come to.
    pub threshold: u16,
    /// Words of the pipeline, row by row.
    pub pixels: &'a [u16],
}

/// Result of a picture besides its records.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameResult {
    /// Counts when everything had left.
    pub counts: FxCounts,
    /// Clocks in which no pixel could be taken, until `end_clk`.
    pub not_ready_clk: u64,
    /// The threshold of the next picture.
    pub threshold: u16,
    /// The first clock in which the next one's first pixel could enter.
    pub end_clk: u64,
}

/// A Verilog simulator with the sensor's blocks.
pub trait RtlSimulator: fmt::Debug + Send + Sync {
    /// Each column's code. Fails where the simulator cannot be built, or stopped.
    fn row(&self, asked: &RowRequest<'_>) -> Result<Vec<u16>, Error>;

    /// A picture through the extractor; records leave to `around`.
    fn frame(&self, asked: &FrameRequest<'_>, around: &mut dyn ExtractorHost) -> Result<FrameResult, Error>;
}

/// A simulator shared by parallel row conversions, which cannot return errors one by one: it keeps the first failure for the
/// caller.
#[derive(Clone, Debug)]
pub struct SharedRtlSimulator(Arc<SharedState>);

#[derive(Debug)]
struct SharedState {
    simulator: Arc<dyn RtlSimulator>,
    failure: Mutex<Option<Error>>,
}

impl SharedRtlSimulator {
    /// A simulator that has not failed.
    pub fn new(simulator: Arc<dyn RtlSimulator>) -> Self {
        Self(Arc::new(SharedState { simulator, failure: Mutex::new(None) }))
    }

    /// The simulator.
    pub fn rtl_simulator(&self) -> &dyn RtlSimulator {
        &*self.0.simulator
    }

    /// Each column's code; zeros after a failure.
    pub fn row(&self, asked: &RowRequest<'_>) -> Vec<u16> {
        match self.0.simulator.row(asked) {
            Ok(codes) => codes,
            Err(error) => {
                self.0.failure.lock().expect("nobody panics while it is held").get_or_insert(error);
                vec![0; asked.signal_clk.len()]
            }
        }
    }

    /// The first failure since this was last asked.
    pub fn check(&self) -> Result<(), Error> {
        self.0.failure.lock().expect("nobody panics while it is held").take().map_or(Ok(()), Err)
    }
}

/// Equal means the same instance.
impl PartialEq for SharedRtlSimulator {
    fn eq(&self, other: &Self) -> bool {
        Arc::ptr_eq(&self.0, &other.0)
    }
}
