//! A sample of a conversion, and the work that a row took.

/// Which of a row's conversions.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Sample {
    /// Of the reset level.
    Reset,
    /// Of the signal.
    Signal,
}

/// What a row's conversions took, over both samples.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RowWork {
    /// Counted clocks of all columns.
    pub counter_steps: u64,
    /// `adc_clk` clocks in which comparators waited for their crossing.
    pub comparator_clk: u64,
}
