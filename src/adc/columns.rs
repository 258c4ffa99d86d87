//! Fields of the converter and of its columns.

use super::kickback::Kickback;
use super::linear::LinearKernel;
use super::params::AdcParams;
use super::ramp::RampLevels;
use crate::rtl_simulator::SharedRtlSimulator;

/// The column converters, with everything that does not depend on the signal done beforehand.
#[derive(Clone, Debug, PartialEq)]
pub struct Converter {
    pub(super) params: AdcParams,
    pub(super) ramp_levels: RampLevels,
    pub(super) kickback: Option<Kickback>,
    pub(super) pedestal_nv: i64,
    /// Of equal steps, many columns at a time.
    pub(super) kernel: Option<LinearKernel>,
    /// Whether the kernel alone converts: no delays, no kickback.
    pub(super) is_plain: bool,
    pub(super) is_clocked: bool,
    /// What converts in place of the clocked rung's own counters.
    pub(super) verilog: Option<SharedRtlSimulator>,
}

/// The converters of one camera's die: each column with its own comparator.
#[derive(Clone, Debug, PartialEq)]
pub struct Columns<'a> {
    pub(super) converter: &'a Converter,
    /// Delay of each column in `adc_clk`; empty where all are 0.
    pub(super) delays_clk: Vec<u32>,
    /// Array columns of those that are converted; none where all are.
    pub(super) array_columns: Option<Vec<usize>>,
}
