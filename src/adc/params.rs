//! Parameters of the column converters. Enters: numbers of a config. Leaves: the same, checked, and what follows from them.

use crate::error::Error;
use crate::num::{f64_from_i64, i64_half_even};
use crate::pixel::{above, within};
use crate::units::Clocks;

/// Correlated double sampling: how the reset level is taken off the signal.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Cds {
    /// Not at all: one sample, one conversion.
    None,
    /// On a capacitor before the converter: two samples, one conversion.
    Analog,
    /// By converting the reset level first and counting on from it: two samples, two conversions.
    Digital,
}

impl Cds {
    /// All kinds.
    pub const ALL: [Self; 3] = [Self::None, Self::Analog, Self::Digital];

    /// The name in configs and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Analog => "analog",
            Self::Digital => "digital",
        }
    }

    /// The kind of this name.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| Error::Unknown {
            what: "kind of double sampling",
            name: name.to_owned(),
            known: Self::ALL.map(Self::name).join(", "),
        })
    }

    /// Whether reset and signal are both sampled.
    pub fn is_double(self) -> bool {
        match self {
            Self::None => false,
            Self::Analog | Self::Digital => true,
        }
    }
}

/// Shape of the ramp.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Ramp {
    /// Equal steps.
    Linear,
}

impl Ramp {
    /// The name in configs and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Linear => "linear",
        }
    }

    /// The shape of this name.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        if name == Self::Linear.name() {
            return Ok(Self::Linear);
        }
        Err(Error::Unknown { what: "ramp", name: name.to_owned(), known: Self::Linear.name().to_owned() })
    }
}

/// What the column converters are. `check` says whether the values are in range.
#[derive(Clone, Debug, PartialEq)]
pub struct AdcParams {
    /// Depth in bits, 1 to 16.
    pub bits: u32,
    /// Frequency of `adc_clk` in Hz, 1e3 to 1e11: one ramp step and count a clock.
    pub clock_hz: u64,
    /// Span of the ramp at gain 1 in uV; divided by the gain 100 to 1e7 (10 V), and at least 1 nV a code.
    pub full_scale_uv: f64,
    /// Analog gain by the ramp's slope, above 0 to 1000: the ramp spans `full_scale_uv / gain`.
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
}

impl AdcParams {
    /// Refuses values out of range, naming key, value and what would do.
    pub fn check(&self) -> Result<(), Error> {
        within("sensor.adc.bits", self.bits.into(), 1.0, 16.0)?;
        if !(1_000..=100_000_000_000).contains(&self.clock_hz) {
            return Err(Error::key("sensor.adc.clock_hz", self.clock_hz, "out of range; 1 kHz to 100 GHz would do"));
        }
        above("sensor.adc.gain", self.gain, 0.0, 1000.0)?;
        let least_uv = self.gain * 100.0;
        within("sensor.adc.full_scale_uv", self.full_scale_uv, least_uv, self.gain * 1e7)?;
        let code_max = self.code_max();
        within("sensor.adc.black_level_dn", self.black_level_dn.into(), 0.0, code_max.into())?;
        within("sensor.adc.column_offset_uv", self.column_offset_uv, 0.0, 1e6)?;
        within("sensor.adc.column_offset_residual_uv", self.column_offset_residual_uv, 0.0, 1e6)?;
        within("sensor.adc.column_gain_sigma", self.column_gain_sigma, 0.0, 0.15)?;
        within("sensor.adc.reset_counts", self.reset_counts.into(), 0.0, 65_536.0)?;
        within("sensor.adc.settle_reset_us", self.settle_reset_us, 0.0, 1e6)?;
        within("sensor.adc.settle_signal_us", self.settle_signal_us, 0.0, 1e6)
    }

    /// Greatest code, 2^bits - 1.
    pub fn code_max(&self) -> u32 {
        (1 << self.bits) - 1
    }

    /// Span of the ramp in nV, gain included, rounded half-even.
    pub fn span_nv(&self) -> i64 {
        i64_half_even(1000.0 * self.full_scale_uv / self.gain)
    }

    /// One LSB in uV at the ADC's input.
    pub fn lsb_uv(&self) -> f64 {
        f64_from_i64(self.span_nv()) / (1000.0 * f64_from_i64(1 << self.bits))
    }

    /// Settling of a row in seconds: both samples where both are taken.
    pub fn settling_s(&self) -> f64 {
        let reset_us = if self.cds.is_double() { self.settle_reset_us } else { 0.0 };
        1e-6 * (reset_us + self.settle_signal_us)
    }

    /// Counts of a row's reset conversion; only digital double sampling converts the reset level.
    pub fn reset_counts_used(&self) -> u32 {
        match self.cds {
            Cds::Digital => self.reset_counts,
            Cds::None | Cds::Analog => 0,
        }
    }

    /// `adc_clk` clocks in which the ramp runs for a row.
    pub fn ramp_clk(&self) -> Clocks {
        Clocks(u64::from(self.reset_counts_used()) + (1 << self.bits))
    }
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
