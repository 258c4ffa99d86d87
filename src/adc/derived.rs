//! Checks of the converter's parameters, and the times and levels that follow from them.

use super::params::{AdcParams, Cds, Counter, Counting, Ramp};
use super::ramp::RampLevels;
use super::sample::Sample;
use super::span::{GAIN_LEAST, GAIN_MOST};
use crate::error::{Error, check_clock, within};
use crate::num::{f64_from_i64, f64_from_u64, i64_half_even, low_u16};
use crate::pixel::{PixelParams, SampleSigmas};
use crate::units::Clocks;
use rtl_models::cds::CdsConfig;

impl AdcParams {
    /// Refuses values out of range, naming key, value and an accepted value.
    pub fn check(&self) -> Result<(), Error> {
        within("sensor.adc.bits", self.bits.into(), 1.0, 16.0)?;
        check_clock("sensor.adc.clock_hz", self.clock_hz)?;
        within("sensor.adc.gain", self.gain, GAIN_LEAST, GAIN_MOST)?;
        self.check_span()?;
        let code_max = self.code_max();
        within("sensor.adc.black_level_dn", self.black_level_dn.into(), 0.0, code_max.into())?;
        within("sensor.adc.column_offset_uv", self.column_offset_uv, 0.0, 1e6)?;
        within("sensor.adc.column_offset_residual_uv", self.column_offset_residual_uv, 0.0, 1e6)?;
        within("sensor.adc.column_gain_sigma", self.column_gain_sigma, 0.0, 0.15)?;
        within("sensor.adc.reset_counts", self.reset_counts.into(), 0.0, 65_536.0)?;
        within("sensor.adc.settle_reset_us", self.settle_reset_us, 0.0, 1e6)?;
        within("sensor.adc.settle_signal_us", self.settle_signal_us, 0.0, 1e6)?;
        self.check_rarer()
    }

    /// The same for what most converters leave at zero.
    fn check_rarer(&self) -> Result<(), Error> {
        within("sensor.adc.ramp_inl_lsb", self.ramp_inl_lsb, -64.0, 64.0)?;
        within("sensor.adc.ramp_settling_clk", self.ramp_settling_clk, 0.0, 10000.0)?;
        within("sensor.adc.ramp_noise_uv", self.ramp_noise_uv, 0.0, 1000000.0)?;
        within("sensor.adc.ramp_jitter_ps", self.ramp_jitter_ps, 0.0, 1000000.0)?;
        within("sensor.adc.supply_ripple_uv", self.supply_ripple_uv, 0.0, 1000000.0)?;
        within("sensor.adc.supply_ripple_hz", self.supply_ripple_hz, 1.0, 1000000000.0)?;
        within("sensor.adc.comparator_noise_uv", self.comparator_noise_uv, 0.0, 1000000.0)?;
        within("sensor.adc.comparator_delay_clk", self.comparator_delay_clk.into(), 0.0, 1000.0)?;
        within("sensor.adc.comparator_delay_sigma_clk", self.comparator_delay_sigma_clk, 0.0, 100.0)?;
        within("sensor.adc.kickback_uv", self.kickback_uv, -10000.0, 10000.0)?;
        within("sensor.adc.kickback_decay_clk", self.kickback_decay_clk.into(), 1.0, 1024.0)?;
        within("sensor.adc.row_noise_uv", self.row_noise_uv, 0.0, 1000000.0)?;
        within("sensor.adc.row_offset_uv", self.row_offset_uv, 0.0, 1000000.0)?;
        within("sensor.adc.column_noise_uv", self.column_noise_uv, 0.0, 1000000.0)?;
        within("sensor.adc.column_capacitance_pf", self.column_capacitance_pf, 0.01, 100.0)?;
        within("sensor.adc.column_bias_ua", self.column_bias_ua, 0.0, 1000.0)?;
        within("sensor.adc.column_overdrive_v", self.column_overdrive_v, 0.01, 2.0)?;
        within("sensor.adc.columns_per_adc", self.columns_per_adc.into(), 1.0, 64.0)?;
        within("sensor.adc.pitch_um", self.pitch_um, 0.0, 1000.0)?;
        within("sensor.adc.sides", self.sides.into(), 1.0, 2.0)?;
        RampLevels::new(self).map(|_| ())
    }

    /// Whether a converter finds room above the columns that share it. Fails where it does not; the error names the sharing that is
    /// accepted.
    pub fn check_pitch(&self, pixel: &PixelParams) -> Result<(), Error> {
        let one_um = pixel.pitch_um * f64::from(self.sides);
        let room_um = f64::from(self.columns_per_adc) * one_um;
        if self.pitch_um <= room_um {
            return Ok(());
        }
        let needed = (self.pitch_um / one_um).ceil();
        let reason = if needed <= 64.0 {
            format!(
                "{} columns of {} um on {} side(s) leave {room_um} um; use columns_per_adc = {needed}",
                self.columns_per_adc, pixel.pitch_um, self.sides
            )
        } else {
            format!("64 columns, the most that share a converter, leave {} um; use fewer", 64.0 * one_um)
        };
        Err(Error::key("sensor.adc.pitch_um", self.pitch_um, reason))
    }

    /// Greatest code, 2^bits - 1.
    pub fn code_max(&self) -> u32 {
        (1 << self.bits) - 1
    }

    /// A column's counter as the hardware is told of it. One conversion has its black level in the pedestal alone.
    pub fn column(&self) -> CdsConfig {
        let black = if self.cds == Cds::Digital { low_u16(self.black_level_dn) } else { 0 };
        let (latch_mode, gray) = (self.counting == Counting::Latch, self.counter == Counter::Gray);
        CdsConfig { bits: self.bits, black, latch_mode, gray }
    }

    /// Span of the ramp in nV, gain included, rounded half-even.
    pub fn span_nv(&self) -> i64 {
        i64_half_even(1000.0 * self.full_scale_uv / self.gain)
    }

    /// One LSB in uV at the ADC's input.
    pub fn lsb_uv(&self) -> f64 {
        f64_from_i64(self.span_nv()) / (1000.0 * f64_from_i64(1 << self.bits))
    }

    /// Whether all steps of the ramp are equal.
    pub fn has_equal_steps(&self) -> bool {
        self.ramp == Ramp::Linear && self.ramp_inl_lsb == 0.0 && self.ramp_settling_clk == 0.0
    }

    /// The least step of the ramp in uV: one LSB where the ramp is finest.
    pub fn lsb_uv_min(&self) -> f64 {
        if self.has_equal_steps() {
            return self.lsb_uv();
        }
        f64_from_i64(self.ramp_levels().steps_nv().0) / 1000.0
    }

    /// Signal in uV beyond which the code of a column at its nominal reset level is the greatest.
    pub fn saturation_uv(&self) -> f64 {
        let above_black = self.code_max() - self.black_level_dn;
        if self.has_equal_steps() {
            return f64::from(above_black) * self.lsb_uv();
        }
        let (ramp, pedestal) = (self.ramp_levels(), self.pedestal_lsb());
        f64_from_i64(ramp.ramp_level_nv(pedestal + above_black) - ramp.ramp_level_nv(pedestal)) / 1000.0
    }

    fn ramp_levels(&self) -> RampLevels {
        RampLevels::new(self).expect("the parameters were checked")
    }

    /// Sigmas of a noise that each conversion has on its own. A difference is converted once.
    pub fn sigmas_of_conversions(&self, sigma_uv: f64) -> SampleSigmas {
        let reset_uv = if self.cds == Cds::Digital { sigma_uv } else { 0.0 };
        SampleSigmas { signal_uv: sigma_uv, reset_uv }
    }

    /// Settling of a row in seconds: both samples where both are taken, once for each column that shares a converter.
    pub fn settling_s(&self) -> f64 {
        1e-6 * f64::from(self.columns_per_adc) * (self.settle_reset_used_us() + self.settle_signal_us)
    }

    /// Settling before the reset sample in us, 0 where none is taken.
    pub fn settle_reset_used_us(&self) -> f64 {
        if self.cds.is_double() { self.settle_reset_us } else { 0.0 }
    }

    /// When a conversion's ramp starts, in seconds from the start of the row's readout: first the reset samples of all columns
    /// that share a converter, one after the other, each settled before its ramp; then the transfer, and their signals likewise.
    pub fn conversion_start_s(&self, sample: Sample, pass: u32) -> f64 {
        let clock_s = 1.0 / f64_from_u64(self.clock_hz);
        let reset_s = 1e-6 * self.settle_reset_used_us();
        let signal_s = 1e-6 * self.settle_signal_us;
        let reset_ramp_s = f64::from(self.reset_counts_used()) * clock_s;
        let signal_ramp_s = f64::from(self.code_max() + 1) * clock_s;
        let done = f64::from(pass);
        match sample {
            Sample::Reset => reset_s + done * (reset_s + reset_ramp_s),
            Sample::Signal => {
                f64::from(self.columns_per_adc) * (reset_s + reset_ramp_s)
                    + signal_s
                    + done * (signal_s + signal_ramp_s)
            }
        }
    }

    /// Counts of a row's reset conversion; only digital double sampling converts the reset level.
    pub fn reset_counts_used(&self) -> u32 {
        match self.cds {
            Cds::Digital => self.reset_counts,
            Cds::None | Cds::Analog => 0,
        }
    }

    /// Levels of the ramp that lie below a column without signal: the level at which the reset conversion finds it. A converted
    /// difference is at the black level; where both samples are converted, in the middle of the reset ramp, or lower where the
    /// black level is lower, so that the signal's ramp ends beyond the greatest code.
    pub fn pedestal_lsb(&self) -> u32 {
        match self.cds {
            Cds::None | Cds::Analog => self.black_level_dn,
            Cds::Digital => self.black_level_dn.min(self.reset_counts / 2),
        }
    }

    /// `adc_clk` clocks in which the ramp runs for a row: once for each column that shares a converter.
    pub fn ramp_clk(&self) -> Clocks {
        Clocks(u64::from(self.columns_per_adc) * (u64::from(self.reset_counts_used()) + (1 << self.bits)))
    }
}
