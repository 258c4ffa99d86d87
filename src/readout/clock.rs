//! A camera's clock. Computes the clock at which each frame starts, and the run time in seconds of any clock.
//!
//! Clocks are integers of the camera's own crystal. Its frequency is rational, `rate (10^9 + ppb) / 10^9`; only the last
//! division, into seconds, rounds.

use super::params::{ReadoutParams, Trigger};
use crate::num::{f64_from_i64, f64_from_u64, index};
use crate::units::{CameraIndex, Clocks, FrameIndex};

/// Parts in a billion of one.
const BILLION: i64 = 1_000_000_000;
/// Nanoseconds of a second times parts of one.
const NANO_PARTS: u128 = 1_000_000_000_000_000_000;

/// A span in whole clocks of `pix_clk` of one camera, counted from that camera's first clock. `end >= start`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ClockSpan {
    /// First instant.
    pub start: Clocks,
    /// Last instant.
    pub end: Clocks,
}

impl ClockSpan {
    /// Length.
    pub fn length(self) -> Clocks {
        Clocks(self.end.0 - self.start.0)
    }

    /// Twice the middle, which is exact: a middle may lie half-way between two clocks.
    pub fn twice_middle(self) -> Clocks {
        Clocks(self.start.0 + self.end.0)
    }
}

/// When frames start, and the duration of a clock.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct FrameClock {
    rate_hz: u64,
    ppb: i64,
    frame_clk: u64,
    trigger: Trigger,
    skew_ns: u64,
}

impl FrameClock {
    /// The clock of a camera with frames of the given clocks.
    pub fn new(params: &ReadoutParams, camera: CameraIndex, frame_clk: Clocks) -> Self {
        let of = index(camera.0);
        Self {
            rate_hz: params.pixel_rate_hz,
            ppb: params.clock_ppb.get(of).copied().unwrap_or(0),
            frame_clk: frame_clk.0,
            trigger: params.trigger,
            skew_ns: params.sync_skew_ns.get(of).copied().unwrap_or(0),
        }
    }

    /// First clock of a frame: as many frames of clocks as went before, or the first edge at or after the trigger's pulse, and
    /// the delay.
    pub fn frame_start(&self, frame: FrameIndex) -> Clocks {
        match self.trigger {
            Trigger::Free => Clocks(u64::from(frame.0) * self.frame_clk),
            Trigger::External { period_ns, delay_clk } => {
                // Below 1e6 frames of 1e11 ns, 1e11 Hz and 1.001e9: under 1.1e37, in range of 128 bits.
                let pulse_ns = u128::from(frame.0) * u128::from(period_ns) + u128::from(self.skew_ns);
                let edge = (pulse_ns * u128::from(self.rate_hz) * self.parts()).div_ceil(NANO_PARTS);
                Clocks(
                    u64::try_from(edge).expect("a run of a million frames has less than 2^64 clocks")
                        + u64::from(delay_clk),
                )
            }
        }
    }

    /// From frame to frame in seconds, mean where a trigger's pulses fall between clocks.
    pub fn frame_time_s(&self) -> f64 {
        match self.trigger {
            Trigger::Free => self.length_s(Clocks(self.frame_clk)),
            Trigger::External { period_ns, .. } => 1e-9 * f64_from_u64(period_ns),
        }
    }

    /// Frames a second.
    pub fn fps(&self) -> f64 {
        match self.trigger {
            Trigger::Free => self.frequency_hz() / f64_from_u64(self.frame_clk),
            Trigger::External { period_ns, .. } => 1e9 / f64_from_u64(period_ns),
        }
    }

    /// The instant of a clock in run time. A free camera's first clock comes its skew after the run's start; a triggered
    /// camera counts from the run's start.
    pub fn instant_s(&self, clock: Clocks) -> f64 {
        let start_s = if self.trigger == Trigger::Free { 1e-9 * f64_from_u64(self.skew_ns) } else { 0.0 };
        start_s + self.length_s(clock)
    }

    /// Clocks in seconds.
    pub fn length_s(&self, clocks: Clocks) -> f64 {
        f64_from_u64(clocks.0) / self.frequency_hz()
    }

    /// Shortest period of an external trigger in ns that leaves room for a whole frame between any two pulses.
    pub fn shortest_period_ns(&self) -> u64 {
        let period = (u128::from(self.frame_clk) * NANO_PARTS).div_ceil(u128::from(self.rate_hz) * self.parts());
        u64::try_from(period).expect("a frame of at most 2^40 clocks at 1 kHz or more")
    }

    fn frequency_hz(&self) -> f64 {
        let rate_hz = f64_from_u64(self.rate_hz);
        rate_hz + rate_hz * f64_from_i64(self.ppb) * 1e-9
    }

    /// Billionths of a nominal clock's frequency.
    fn parts(&self) -> u128 {
        u128::try_from(BILLION + self.ppb).expect("a clock is off by at most a thousandth")
    }
}
