//! Parameters of the readout: checks the values of a config that need no other stage.
//!
//! Names follow sensors' registers: HTS and VTS as in OmniVision's and Sony's drivers, coarse and fine integration time as in
//! MIPI CCS, staggered exposures as in Sony's DOL (digital overlap) readout.

use crate::error::{Error, check_clock, within};
use crate::text::named;

named! {
    /// Whether rows are exposed together or one after another.
    pub enum Shutter {
        /// All rows end their exposure together and wait for their readout.
        Global = "global",
        /// Each row ends its exposure when it is read.
        Rolling = "rolling",
    }
}

/// How the exposure is given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ExposureSetting {
    /// In us, 0 to 1e9; rounded to whole lines (half to even), at least the shortest exposure.
    Us(f64),
    /// In whole lines, at least the shortest exposure.
    Lines(u32),
}

/// How the length of a frame is given.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum FrameLength {
    /// VTS: lines of a frame, blanking included, 1 to 2^24. Datasheet or driver.
    Lines(u32),
    /// Frames a second; VTS is `pixel_rate / (HTS fps)`, rounded half to even.
    RateHz(f64),
}

named! {
    /// What an exposure does that is longer than its frame less the margin.
    pub enum LongExposure {
        /// It is an error that names the shortest VTS that is accepted.
        Refuse = "refuse",
        /// The frame grows to exposure + margin, as drivers of IMX219 raise VTS for a long exposure.
        ExtendFrame = "extend_frame",
    }
}

/// How many exposures a frame has.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Hdr {
    /// One.
    None,
    /// Several of falling length, read line by line in turn (Sony DOL).
    MultiExposure {
        /// Exposures a frame, 2 to 4.
        exposures: u32,
        /// Each exposure over the next shorter one, 1.001 to 1024.
        ratio: f64,
    },
    /// One, whose charge is read at two conversion gains, one after the other.
    DualGain,
}

impl Hdr {
    /// Exposures a frame.
    pub fn exposures(self) -> u32 {
        match self {
            Self::None | Self::DualGain => 1,
            Self::MultiExposure { exposures, .. } => exposures,
        }
    }

    /// Conversions of a row's charge within its line.
    pub fn conversions(self) -> u32 {
        match self {
            Self::None | Self::MultiExposure { .. } => 1,
            Self::DualGain => 2,
        }
    }
}

/// What starts a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Trigger {
    /// The end of the frame before.
    Free,
    /// A pulse that comes to all cameras at once.
    External {
        /// From pulse to pulse in ns.
        period_ns: u64,
        /// From the clock edge that sees the pulse to the frame's first clock, in `pix_clk`.
        delay_clk: u32,
    },
}

/// Control pulses of a line in `pix_clk`, beside the converter's settling and ramps. 0 where settling holds them already.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Pulses {
    /// Reset of the floating diffusions, before the reset level settles.
    pub reset_clk: u32,
    /// Transfer gate open, before the signal settles.
    pub transfer_clk: u32,
    /// Counters copied into the row's output memory, after the ramp.
    pub latch_clk: u32,
}

impl Pulses {
    /// All of them.
    pub fn total_clk(self) -> u64 {
        u64::from(self.reset_clk) + u64::from(self.transfer_clk) + u64::from(self.latch_clk)
    }
}

/// How the array is read. `Schedule::new` checks it against array, converter and link.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadoutParams {
    /// Whether rows are exposed together.
    pub shutter: Shutter,
    /// Line length in `pix_clk` clocks, blanking included, 1 to 2^24. Datasheet or driver (HTS).
    pub hts: u32,
    /// Frame length.
    pub frame: FrameLength,
    /// Frequency of `pix_clk` in Hz, 1e3 to 1e11; HTS VTS fps.
    pub pixel_rate_hz: u64,
    /// Exposure asked for; with several exposures the longest.
    pub exposure: ExposureSetting,
    /// Fine integration time in `pix_clk`, added to the whole lines, below HTS.
    pub exposure_fine_clk: u32,
    /// Lines of a frame that no exposure can use. Datasheet or driver (4 to 25 in known drivers).
    pub exposure_margin_lines: u32,
    /// Shortest exposure in lines, 0 to 65535.
    pub exposure_lines_min: u32,
    /// What an exposure beyond the frame does.
    pub long_exposure: LongExposure,
    /// Part of the array that is read; `None`: all of it.
    pub window: Option<Window>,
    /// What x, y, width and height of a window must be multiples of, 1 to 64.
    pub window_step: u32,
    /// Pixels of each direction that become one: 1, 2 or 4.
    pub binning: u32,
    /// How they become one.
    pub binning_mode: BinningMode,
    /// Side of the colour mosaic's period in pixels, 1 (monochrome) to 4: only pixels of one mosaic phase are binned.
    pub mosaic_px: u32,
    /// Exposures of a frame.
    pub hdr: Hdr,
    /// Optical-black rows that are read before the picture's, each a line a slot, 0 to 64.
    pub black_rows: u32,
    /// Serial lanes from the columns' memory to the output, 0: parallel, takes no time; to 65536.
    pub lanes: u32,
    /// Bits a second of each of these lanes.
    pub lane_clock_hz: u64,
    /// Pulses of a line.
    pub pulses: Pulses,
    /// What starts a frame.
    pub trigger: Trigger,
    /// By camera: how much later than the first its frames (free) or its trigger (external) come, in ns. Beyond the list: 0.
    pub sync_skew_ns: Vec<u64>,
    /// By camera: deviation of its clock from `pixel_rate_hz` in 1e-9, within 1e6. Beyond the list: 0.
    pub clock_ppb: Vec<i64>,
    /// Exposure and gain written in frame n act in frame n + this, 0 to 8.
    pub register_latency_frames: u32,
    /// Automatic exposure, where it is on.
    pub auto: Option<AutoExposureParams>,
}

/// Greatest HTS and greatest VTS: 24 bits.
pub(super) const LENGTH_MAX: u32 = 1 << 24;
/// Greatest frame in clocks: with it a million frames and more stay below 2^63 clocks.
pub(super) const FRAME_CLK_MAX: u64 = 1 << 40;

impl ReadoutParams {
    /// The plainest readout of these lengths: whole array, one exposure, own clock, no lanes, no pulses.
    pub fn plain(shutter: Shutter, hts: u32, vts: u32, pixel_rate_hz: u64, exposure: ExposureSetting) -> Self {
        Self {
            shutter,
            hts,
            frame: FrameLength::Lines(vts),
            pixel_rate_hz,
            exposure,
            exposure_fine_clk: 0,
            exposure_margin_lines: 0,
            exposure_lines_min: 1,
            long_exposure: LongExposure::Refuse,
            window: None,
            window_step: 1,
            binning: 1,
            binning_mode: BinningMode::Charge,
            mosaic_px: 1,
            hdr: Hdr::None,
            black_rows: 0,
            lanes: 0,
            lane_clock_hz: pixel_rate_hz,
            pulses: Pulses::default(),
            trigger: Trigger::Free,
            sync_skew_ns: Vec::new(),
            clock_ppb: Vec::new(),
            register_latency_frames: 2,
            auto: None,
        }
    }

    /// Refuses values out of range, naming key, value and an accepted value.
    pub fn check(&self) -> Result<(), Error> {
        within("sensor.readout.hts", self.hts.into(), 1.0, LENGTH_MAX.into())?;
        match self.frame {
            FrameLength::Lines(vts) => within("sensor.readout.vts", vts.into(), 1.0, LENGTH_MAX.into())?,
            FrameLength::RateHz(rate_hz) => within("sensor.readout.frame_rate_hz", rate_hz, 1e-6, 1e6)?,
        }
        check_clock("sensor.readout.pixel_rate_hz", self.pixel_rate_hz)?;
        if let ExposureSetting::Us(exposure_us) = self.exposure {
            within("sensor.readout.exposure_us", exposure_us, 0.0, 1e9)?;
        }
        within("sensor.readout.exposure_lines_min", self.exposure_lines_min.into(), 0.0, 65_535.0)?;
        within(
            "sensor.readout.exposure_margin_lines",
            self.exposure_margin_lines.into(),
            0.0,
            (LENGTH_MAX - 1).into(),
        )?;
        if self.exposure_fine_clk >= self.hts {
            let reason = format!("out of range; use 0 to {} (less than a line of hts clocks)", self.hts - 1);
            return Err(Error::key("sensor.readout.exposure_fine_clk", self.exposure_fine_clk, reason));
        }
        within("sensor.readout.lanes", self.lanes.into(), 0.0, 65_536.0)?;
        check_clock("sensor.readout.lane_clock_hz", self.lane_clock_hz)?;
        for (key, value) in [
            ("sensor.readout.reset_clk", self.pulses.reset_clk),
            ("sensor.readout.transfer_clk", self.pulses.transfer_clk),
            ("sensor.readout.latch_clk", self.pulses.latch_clk),
        ] {
            within(key, value.into(), 0.0, LENGTH_MAX.into())?;
        }
        within("sensor.readout.register_latency_frames", self.register_latency_frames.into(), 0.0, 8.0)?;
        self.check_exposures()?;
        self.check_sync()
    }

    fn check_exposures(&self) -> Result<(), Error> {
        if let Some(auto) = &self.auto {
            auto.check()?;
            if self.long_exposure == LongExposure::ExtendFrame {
                let reason = "an automatic exposure needs frames of one length; use refuse";
                return Err(Error::key("sensor.readout.long_exposure", "extend_frame", reason));
            }
        }
        let Hdr::MultiExposure { exposures, ratio } = self.hdr else { return Ok(()) };
        within("sensor.readout.hdr_exposures", exposures.into(), 2.0, 4.0)?;
        within("sensor.readout.hdr_exposure_ratio", ratio, 1.001, 1024.0)?;
        if self.shutter == Shutter::Global {
            let reason = "staggered exposures need a rolling shutter: a pixel stores one charge; use none";
            return Err(Error::key("sensor.readout.hdr", "multi_exposure", reason));
        }
        if self.exposure_lines_min == 0 {
            let reason = "staggered exposures are merged by their lengths, so none may be 0; use 1";
            return Err(Error::key("sensor.readout.exposure_lines_min", 0, reason));
        }
        if self.exposure_fine_clk > 0 {
            let reason = "staggered exposures are whole lines; use 0";
            return Err(Error::key("sensor.readout.exposure_fine_clk", self.exposure_fine_clk, reason));
        }
        Ok(())
    }

    fn check_sync(&self) -> Result<(), Error> {
        if let Trigger::External { period_ns, .. } = self.trigger
            && !(1..=100_000_000_000).contains(&period_ns)
        {
            let reason = "out of range; use 0.001 to 100000000";
            return Err(Error::key("sensor.readout.trigger_period_us", microseconds(period_ns), reason));
        }
        if let Some(&skew_ns) = self.sync_skew_ns.iter().find(|&&skew_ns| skew_ns > 1_000_000_000) {
            let reason = "out of range; use 0 to 1000000";
            return Err(Error::key("sensor.readout.sync_skew_us", microseconds(skew_ns), reason));
        }
        if let Some(&ppb) = self.clock_ppb.iter().find(|ppb| !(-1_000_000..=1_000_000).contains(*ppb)) {
            let ppm = 1e-3 * crate::num::f64_from_i64(ppb);
            return Err(Error::key("sensor.readout.clock_ppm", ppm, "out of range; use -1000 to 1000"));
        }
        Ok(())
    }
}

/// Nanoseconds as a user writes microseconds: exact, without trailing zeros.
pub(super) fn microseconds(time_ns: u64) -> String {
    let (whole, rest) = (time_ns / 1000, time_ns % 1000);
    if rest == 0 { format!("{whole}.0") } else { format!("{whole}.{rest:03}").trim_end_matches('0').to_owned() }
}

/// What the controller aims at and keeps to.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AutoExposureParams {
    /// Mean code to reach as a share of the greatest code, black level included; 0.001 to 0.99.
    pub target_mean: f64,
    /// Frames between the frame whose mean is known and the write that answers it, beyond the one in which it is read, 0 to 8.
    pub delay_frames: u32,
    /// Longest exposure in lines; `None`: the longest that the frame holds.
    pub exposure_lines_max: Option<u32>,
    /// Greatest gain of the ramp, at least the converter's own, to 1000.
    pub gain_max: f64,
}

/// Greatest mean code to aim at, as a share of the greatest code.
pub(super) const TARGET_MEAN_MAX: f64 = 0.99;

impl AutoExposureParams {
    /// Refuses values out of range, naming key, value and an accepted value.
    pub fn check(&self) -> Result<(), Error> {
        within("sensor.readout.target_mean", self.target_mean, 0.001, TARGET_MEAN_MAX)?;
        within("sensor.readout.gain_max", self.gain_max, 0.001, 1000.0)?;
        within("sensor.readout.delay_frames", self.delay_frames.into(), 0.0, 8.0)
    }
}

/// A part of the array in array pixels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Window {
    /// First column.
    pub x_px: u32,
    /// First row.
    pub y_px: u32,
    /// Columns.
    pub width_px: u32,
    /// Rows.
    pub height_px: u32,
}

named! {
    /// How several pixels become one.
    pub enum BinningMode {
        /// Their charges meet on a shared floating diffusion: one conversion of the sum, all their rows in one line.
        Charge = "charge",
        /// Each is converted individually, a line an array row, and codes are averaged behind the converters.
        Average = "average",
        /// Only the first of them is read.
        Skip = "skip",
    }
}
