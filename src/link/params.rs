//! Parameters of the link: checks the values of a config.

use super::raw::RawKind;
use crate::error::Error;
use crate::text::named;
use crate::units::FrameIndex;

named! {
    /// What a frame carries.
    pub enum Mode {
        /// The codes of all rows.
        Frames = "frames",
        /// Feature packets only.
        Features = "features",
        /// Codes and features; codes only every so many frames where `LinkParams::frames_every` says so.
        Both = "both",
    }
}

impl Mode {
    /// Whether rows of codes are sent, of every frame or of some.
    pub fn sends_codes(self) -> bool {
        matches!(self, Self::Frames | Self::Both)
    }

    /// Whether feature packets are sent.
    pub fn sends_features(self) -> bool {
        matches!(self, Self::Features | Self::Both)
    }
}

named! {
    /// What happens where a row is converted and the row FIFO in front of the link is full.
    pub enum WhenFull {
        /// It never happens: a configuration in which it could is refused with the line length that is accepted.
        Refuse = "refuse",
        /// The readout stalls, all its registers held, until the oldest row has left.
        Stall = "stall",
    }
}

/// What the link is set to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinkParams {
    /// Data lanes, 1 to 4.
    pub lanes: u32,
    /// Double-data-rate clock: every lane carries two bits per clock.
    pub frequency_hz: u64,
    /// What a frame carries.
    pub mode: Mode,
    /// Container of a code; `None` takes the smallest that holds the codes.
    pub format: Option<RawKind>,
    /// In mode `Both`, frames 0, N, 2 N, ... carry rows and the others features alone; 1: every frame carries both.
    pub frames_every: u32,
    /// Every row's packet follows a line-start packet with the row's number, counted from 1.
    pub line_sync: bool,
    /// Rows that wait for the link or are on it, 1 to 65,535.
    pub fifo_rows: u32,
    /// What happens where those are full.
    pub when_full: WhenFull,
}

/// Slowest clock of D-PHY's high-speed mode: 80 Mbit/s a lane.
const FREQUENCY_HZ_MIN: u64 = 40_000_000;
/// Fastest clock of D-PHY 2.1 over the standard channel: 4.5 Gbit/s a lane.
const FREQUENCY_HZ_MAX: u64 = 2_250_000_000;
/// Line numbers and heights are 16-bit numbers.
const ROWS_MAX: u32 = 65_535;

impl LinkParams {
    /// A link of this speed: the smallest container, rows in every frame of a mode that sends them, no line-start packets, and a FIFO
    /// of one row; a link that would fill it is refused.
    pub const fn new(lanes: u32, frequency_hz: u64, mode: Mode) -> Self {
        let (format, when_full) = (None, WhenFull::Refuse);
        Self { lanes, frequency_hz, mode, format, frames_every: 1, line_sync: false, fifo_rows: 1, when_full }
    }

    /// The same, after its ranges are checked. Fails on a value out of range, by key, with an accepted value.
    pub fn checked(self) -> Result<Self, Error> {
        if !(1..=4).contains(&self.lanes) {
            return Err(Error::key("link.lanes", self.lanes, "use 1 to 4"));
        }
        if !(FREQUENCY_HZ_MIN..=FREQUENCY_HZ_MAX).contains(&self.frequency_hz) {
            let reason =
                format!("out of range; use {FREQUENCY_HZ_MIN} to {FREQUENCY_HZ_MAX} (D-PHY's double-data-rate clock)");
            return Err(Error::key("link.frequency_hz", self.frequency_hz, reason));
        }
        if self.frames_every == 0 {
            return Err(Error::key("link.frames_every", 0, "use 1 (rows in every frame) or more"));
        }
        if self.frames_every > 1 && self.mode != Mode::Both {
            let reason = "counts frames that carry rows beside features; use link.mode = \"both\", or 1";
            return Err(Error::key("link.frames_every", self.frames_every, reason));
        }
        if !(1..=ROWS_MAX).contains(&self.fifo_rows) {
            return Err(Error::key("link.fifo_rows", self.fifo_rows, format!("use 1 to {ROWS_MAX} rows")));
        }
        if self.line_sync && !self.mode.sends_codes() {
            let reason = "line-start packets number rows, which this mode does not send; use false";
            return Err(Error::key("link.line_sync", true, reason));
        }
        Ok(self)
    }

    /// Whether this frame carries rows of codes.
    pub fn sends_codes_in(&self, frame: FrameIndex) -> bool {
        self.mode.sends_codes() && frame.0.is_multiple_of(self.frames_every)
    }

    /// The container for codes of this depth, if it holds them. Fails on a depth that no container has, or a `format` that is narrower.
    pub fn raw_kind(&self, bits: u32) -> Result<RawKind, Error> {
        let smallest = RawKind::smallest(bits)?;
        match self.format {
            Some(kind) if kind.bits() < smallest.bits() => {
                let reason = format!("codes have {bits} bits; use {} or wider", smallest.name());
                Err(Error::key("link.format", kind.name(), reason))
            }
            Some(kind) => Ok(kind),
            None => Ok(smallest),
        }
    }
}
