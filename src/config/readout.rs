//! From the readout's keys to its checked parameters. Ranges and relations between times are checked by `readout::Schedule`; here
//! are names, keys that exclude or need one another, and numbers by camera.

use super::check::{member, one_of, within};
use super::scenario::{PerCamera, Readout, Scenario};
use crate::error::Error;
use crate::num::{i64_half_even, u64_half_even};
use crate::readout::{
    AutoExposureParams, BinningMode, ExposureSetting, FrameLength, Hdr, LongExposure, MERGED_BITS_MAX, Pulses,
    ReadoutParams, Shutter, Trigger, Window,
};

impl Scenario {
    /// Sequencer. Fails on unknown names, keys that exclude one another, lists of another length than the rig.
    pub fn readout(&self) -> Result<ReadoutParams, Error> {
        let readout = &self.sensor.readout;
        one_of("sensor.readout.row_order", &readout.row_order, &[("top_to_bottom", ())])?;
        let cameras = self.cameras()?.len();
        let [x_px, y_px, width_px, height_px] = readout.window.unwrap_or_default();
        Ok(ReadoutParams {
            shutter: member("sensor.readout.shutter", &readout.shutter, &Shutter::ALL, Shutter::name)?,
            hts: readout.hts,
            frame: frame_length(readout)?,
            pixel_rate_hz: readout.pixel_rate_hz,
            exposure: exposure(readout)?,
            exposure_fine_clk: readout.exposure_fine_clk,
            exposure_margin_lines: readout.exposure_margin_lines,
            exposure_lines_min: readout.exposure_lines_min,
            long_exposure: member(
                "sensor.readout.long_exposure",
                &readout.long_exposure,
                &LongExposure::ALL,
                LongExposure::name,
            )?,
            window: readout.window.map(|_| Window { x_px, y_px, width_px, height_px }),
            window_step: readout.window_step,
            binning: readout.binning,
            binning_mode: member(
                "sensor.readout.binning_mode",
                &readout.binning_mode,
                &BinningMode::ALL,
                BinningMode::name,
            )?,
            mosaic_px: 1,
            hdr: hdr(readout)?,
            black_rows: self.black_rows()?.rows,
            lanes: readout.lanes,
            lane_clock_hz: readout.lane_clock_hz.unwrap_or(readout.pixel_rate_hz),
            pulses: Pulses {
                reset_clk: readout.reset_clk,
                transfer_clk: readout.transfer_clk,
                latch_clk: readout.latch_clk,
            },
            trigger: trigger(readout)?,
            sync_skew_ns: skews_ns(&readout.sync_skew_us, cameras)?,
            clock_ppb: deviations_ppb(&readout.clock_ppm, cameras)?,
            register_latency_frames: readout.register_latency_frames,
            auto: auto_exposure(readout)?,
        })
    }

    /// Depth to which merged codes are companded. Fails on written outside 8 to 16.
    pub fn hdr_bits(&self) -> Result<u32, Error> {
        let unwritten = self.sensor.adc.bits.clamp(8, MERGED_BITS_MAX);
        let bits = self.sensor.readout.hdr_bits.unwrap_or(unwritten);
        within("sensor.readout.hdr_bits", bits, 8..=MERGED_BITS_MAX, "8 to 16")
    }
}

fn frame_length(readout: &Readout) -> Result<FrameLength, Error> {
    match (readout.vts, readout.frame_rate_hz) {
        (Some(vts), None) => Ok(FrameLength::Lines(vts)),
        (None, Some(rate_hz)) => Ok(FrameLength::RateHz(rate_hz)),
        (Some(_), Some(rate_hz)) => {
            Err(Error::key("sensor.readout.frame_rate_hz", rate_hz, "vts is written too; use one of the two"))
        }
        (None, None) => Err(Error::key("sensor.readout.vts", "", "is missing; give it or frame_rate_hz")),
    }
}

fn exposure(readout: &Readout) -> Result<ExposureSetting, Error> {
    match (readout.exposure_us, readout.exposure_lines) {
        (Some(exposure_us), None) => Ok(ExposureSetting::Us(exposure_us)),
        (None, Some(lines)) => Ok(ExposureSetting::Lines(lines)),
        (Some(_), Some(lines)) => {
            let reason = "exposure_us is written too; use one of the two";
            Err(Error::key("sensor.readout.exposure_lines", lines, reason))
        }
        (None, None) => Err(Error::key("sensor.readout.exposure_us", "", "is missing; give it or exposure_lines")),
    }
}

fn hdr(readout: &Readout) -> Result<Hdr, Error> {
    let several = Hdr::MultiExposure { exposures: readout.hdr_exposures, ratio: readout.hdr_exposure_ratio };
    one_of(
        "sensor.readout.hdr",
        &readout.hdr,
        &[("none", Hdr::None), ("multi_exposure", several), ("dual_gain", Hdr::DualGain)],
    )
}

fn auto_exposure(readout: &Readout) -> Result<Option<AutoExposureParams>, Error> {
    let auto = AutoExposureParams {
        target_mean: readout.target_mean,
        delay_frames: readout.delay_frames,
        exposure_lines_max: readout.exposure_lines_max,
        gain_max: readout.gain_max,
    };
    auto.check()?;
    one_of("sensor.readout.exposure", &readout.exposure, &[("fixed", None), ("auto", Some(auto))])
}

fn trigger(readout: &Readout) -> Result<Trigger, Error> {
    let is_external = one_of("sensor.readout.trigger", &readout.trigger, &[("free", false), ("external", true)])?;
    match (is_external, readout.trigger_period_us) {
        (true, Some(period_us)) => {
            let key = "sensor.readout.trigger_period_us";
            let period_us = within(key, period_us, 1e-3..=1e8, "0.001 to 1e8")?;
            let period_ns = u64_half_even(1000.0 * period_us);
            Ok(Trigger::External { period_ns, delay_clk: readout.trigger_delay_clk })
        }
        (true, None) => {
            let reason = "is missing; give the time from pulse to pulse";
            Err(Error::key("sensor.readout.trigger_period_us", "", reason))
        }
        (false, Some(period_us)) => {
            let reason = "a free camera has no trigger; leave it out, or use trigger = external";
            Err(Error::key("sensor.readout.trigger_period_us", period_us, reason))
        }
        (false, None) if readout.trigger_delay_clk > 0 => {
            let reason = "a free camera has no trigger; use 0, or trigger = external";
            Err(Error::key("sensor.readout.trigger_delay_clk", readout.trigger_delay_clk, reason))
        }
        (false, None) => Ok(Trigger::Free),
    }
}

/// Rounded to whole nanoseconds.
fn skews_ns(skew_us: &PerCamera, cameras: usize) -> Result<Vec<u64>, Error> {
    let key = "sensor.readout.sync_skew_us";
    let would_do = "0 to 1,000,000 (where a camera comes first, later ones for the others)";
    let skew_ns = |skew_us| within(key, skew_us, 0.0..=1e6, would_do).map(|skew_us| u64_half_even(1000.0 * skew_us));
    skew_us.numbers(key, cameras)?.into_iter().map(skew_ns).collect()
}

/// Rounded to billionths.
fn deviations_ppb(ppm: &PerCamera, cameras: usize) -> Result<Vec<i64>, Error> {
    let key = "sensor.readout.clock_ppm";
    let ppb = |ppm| within(key, ppm, -1000.0..=1000.0, "-1000 to 1000").map(|ppm| i64_half_even(1000.0 * ppm));
    ppm.numbers(key, cameras)?.into_iter().map(ppb).collect()
}
