//! Parameters of the column converters as a config gives them. Their check and what follows from them are in `derived`.

use crate::pixel::SampledLevels;
use crate::text::named;

named! {
    /// Correlated double sampling: how the reset level is taken off the signal.
    pub enum Cds {
        /// Not at all: one sample, one conversion.
        None = "none",
        /// On a capacitor before the converter: two samples, one conversion.
        Analog = "analog",
        /// By converting the reset level first and counting on from it: two samples, two conversions.
        Digital = "digital",
    }
}

impl Cds {
    /// What is sampled and what is converted.
    pub fn samples(self) -> SampledLevels {
        match self {
            Self::None => SampledLevels::Signal,
            Self::Analog => SampledLevels::Difference,
            Self::Digital => SampledLevels::Both,
        }
    }

    /// Whether reset and signal are both sampled.
    pub fn is_double(self) -> bool {
        self.samples().is_double()
    }
}

named! {
    /// Shape of the ramp.
    pub enum Ramp {
        /// Equal steps.
        Linear = "linear",
        /// Straight between given points.
        Piecewise = "piecewise",
        /// Every level given.
        Table = "table",
    }
}

named! {
    /// Code of the counters: what flips when they step.
    pub enum Counter {
        /// Weighted bits; a step flips two of them on average.
        Binary = "binary",
        /// One bit a step.
        Gray = "gray",
    }
}

named! {
    /// Where a column's count is made.
    pub enum Counting {
        /// A counter in each column runs down with the reset ramp and up with the signal's.
        UpDown = "up_down",
        /// One counter serves all columns, each of which latches it at its crossings and subtracts.
        Latch = "latch",
    }
}

/// What the column converters are. `check` says whether the values are in range.
#[derive(Clone, Debug, PartialEq)]
pub struct AdcParams {
    /// Depth in bits, 1 to 16.
    pub bits: u32,
    /// Frequency of `adc_clk` in Hz, 1e3 to 1e11: one ramp step and count per clock.
    pub clock_hz: u64,
    /// Span of the ramp at gain 1 in uV; divided by the gain 100 to 1e7 (10 V), and at least 1 nV a code.
    pub full_scale_uv: f64,
    /// Analog gain by the ramp's slope, 0.001 to 1000: the ramp spans `full_scale_uv / gain`.
    pub gain: f64,
    /// Code of a dark pixel in DN, 0 to 2^bits - 1.
    pub black_level_dn: u32,
    /// Sigma of the columns' offsets before double sampling in uV, 0 to 1e6.
    pub column_offset_uv: f64,
    /// Sigma of what double sampling leaves of them in uV, 0 to 1e6.
    pub column_offset_residual_uv: f64,
    /// Sigma of the columns' gains relative to their mean, 0 to 0.15.
    pub column_gain_sigma: f64,
    /// Counts of the reset conversion of digital double sampling, 0 to 65536.
    pub reset_counts: u32,
    /// Settling of the column before the reset sample in us, 0 to 1e6.
    pub settle_reset_us: f64,
    /// Settling of the column before the signal sample in us, 0 to 1e6.
    pub settle_signal_us: f64,
    /// How the reset level is taken off.
    pub cds: Cds,
    /// Shape of the ramp.
    pub ramp: Ramp,
    /// Of a piecewise ramp: [share of the counts, share of the span], both rising from above 0 to below 1; at most 64.
    pub ramp_points: Vec<[f64; 2]>,
    /// Of a table ramp: its levels 1 to 2^bits - 1 in uV at gain 1, not falling.
    pub ramp_table_uv: Vec<f64>,
    /// Greatest deviation of the ramp from its shape in LSB, in the middle of a bow, -64 to 64.
    pub ramp_inl_lsb: f64,
    /// Time constant of the ramp's start in adc_clk clocks, 0 to 1e4: after k clocks the ramp is (1 - exp(-k / constant)) x constant
    /// clocks behind.
    pub ramp_settling_clk: f64,
    /// Noise of the ramp in uV, one draw per conversion, shared by the row's columns, 0 to 1e6.
    pub ramp_noise_uv: f64,
    /// Jitter of adc_clk against the ramp in ps, one draw per conversion and column, 0 to 1e6.
    pub ramp_jitter_ps: f64,
    /// Amplitude of the supply's ripple at the ADC's input in uV, rejection included, 0 to 1e6.
    pub supply_ripple_uv: f64,
    /// Frequency of that ripple in Hz, 1 to 1e9.
    pub supply_ripple_hz: f64,
    /// Noise of the comparator in uV, one draw per conversion and column, besides the read noise, 0 to 1e6.
    pub comparator_noise_uv: f64,
    /// Clocks from the ramp's passing of a level to the comparator's output transition, 0 to 1000.
    pub comparator_delay_clk: u32,
    /// Sigma of that delay over the columns of the die in clocks, 0 to 100.
    pub comparator_delay_sigma_clk: f64,
    /// Step on the shared ramp, in uV, when a comparator flips, -1e4 to 1e4.
    pub kickback_uv: f64,
    /// Clocks in which that step decays to a half, 1 to 1024.
    pub kickback_decay_clk: u32,
    /// Noise that all columns of a row share in uV, one draw per row and frame, 0 to 1e6.
    pub row_noise_uv: f64,
    /// Sigma of the rows' offsets over the die in uV, 0 to 1e6.
    pub row_offset_uv: f64,
    /// Noise that all rows of a column share in uV, one draw per column and frame, 0 to 1e6.
    pub column_noise_uv: f64,
    /// Load of a column line in pF, 0.01 to 100.
    pub column_capacitance_pf: f64,
    /// Bias current of a column's source follower in uA, 0 to 1000; 0: it settles in any time.
    pub column_bias_ua: f64,
    /// Overdrive of the source follower in V, 0.01 to 2: its transconductance is 2 bias / overdrive.
    pub column_overdrive_v: f64,
    /// Code of the counters.
    pub counter: Counter,
    /// Where the counting is done.
    pub counting: Counting,
    /// Columns that share one converter, 1 to 64: a row takes as many conversions.
    pub columns_per_adc: u32,
    /// Width of a converter's layout in um, 0 to 1000; 0: not checked against the pixel pitch.
    pub pitch_um: f64,
    /// Sides of the array that carry converters, 1 or 2.
    pub sides: u32,
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The converter of the default sensor.
    pub(crate) fn paper_adc() -> AdcParams {
        AdcParams {
            bits: 10,
            clock_hz: 480_000_000,
            full_scale_uv: 110_000.0,
            gain: 1.0,
            black_level_dn: 64,
            column_offset_uv: 200.0,
            column_offset_residual_uv: 20.0,
            column_gain_sigma: 0.001,
            reset_counts: 128,
            settle_reset_us: 2.0,
            settle_signal_us: 3.0,
            cds: Cds::Digital,
            ramp: Ramp::Linear,
            ramp_points: Vec::new(),
            ramp_table_uv: Vec::new(),
            ramp_inl_lsb: 0.0,
            ramp_settling_clk: 0.0,
            ramp_noise_uv: 0.0,
            ramp_jitter_ps: 0.0,
            supply_ripple_uv: 0.0,
            supply_ripple_hz: 100000.0,
            comparator_noise_uv: 0.0,
            comparator_delay_clk: 0,
            comparator_delay_sigma_clk: 0.0,
            kickback_uv: 0.0,
            kickback_decay_clk: 4,
            row_noise_uv: 0.0,
            row_offset_uv: 0.0,
            column_noise_uv: 0.0,
            column_capacitance_pf: 1.0,
            column_bias_ua: 0.0,
            column_overdrive_v: 0.2,
            counter: Counter::Binary,
            counting: Counting::UpDown,
            columns_per_adc: 1,
            pitch_um: 0.0,
            sides: 1,
        }
    }

    #[test]
    fn gain_shortens_the_ramp_and_the_lsb_alike() {
        let doubled = AdcParams { gain: 2.0, ..paper_adc() };
        assert_eq!((paper_adc().span_nv(), doubled.span_nv()), (110_000_000, 55_000_000));
        assert_eq!(paper_adc().lsb_uv(), 2.0 * doubled.lsb_uv());
    }

    #[test]
    fn only_digital_double_sampling_spends_clocks_on_the_reset_level() {
        let clocks = Cds::ALL.map(|cds| AdcParams { cds, ..paper_adc() }.ramp_clk().0);
        assert_eq!(clocks, [1024, 1024, 1152]);
        let settling_us = Cds::ALL.map(|cds| 1e6 * AdcParams { cds, ..paper_adc() }.settling_s());
        assert_eq!(settling_us, [3.0, 5.0, 5.0]);
    }

    #[test]
    fn values_out_of_range_are_refused_by_key() {
        assert!(paper_adc().check().is_ok());
        let bad = [
            (AdcParams { bits: 0, ..paper_adc() }, "sensor.adc.bits = 0"),
            (AdcParams { bits: 17, ..paper_adc() }, "sensor.adc.bits = 17"),
            (AdcParams { black_level_dn: 1024, ..paper_adc() }, "sensor.adc.black_level_dn = 1024"),
            (AdcParams { gain: 0.0, ..paper_adc() }, "sensor.adc.gain = 0"),
            (AdcParams { full_scale_uv: 10.0, ..paper_adc() }, "sensor.adc.full_scale_uv = 10"),
            (AdcParams { clock_hz: 0, ..paper_adc() }, "sensor.adc.clock_hz = 0"),
        ];
        for (params, expected) in bad {
            let message = params.check().unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
    }
}
