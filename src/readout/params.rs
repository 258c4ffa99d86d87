//! Parameters of the readout. Enters: numbers of a config. Leaves: the same, checked for what needs no other stage.

use crate::error::Error;
use crate::pixel::above;

/// Whether rows are exposed together or one after another.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum Shutter {
    /// All rows end their exposure together and wait for their readout.
    Global,
    /// Each row ends its exposure when it is read.
    Rolling,
}

impl Shutter {
    /// Both shutters.
    pub const ALL: [Self; 2] = [Self::Global, Self::Rolling];

    /// The name in configs and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::Global => "global",
            Self::Rolling => "rolling",
        }
    }

    /// The shutter of this name.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|shutter| shutter.name() == name).ok_or_else(|| Error::Unknown {
            what: "shutter",
            name: name.to_owned(),
            known: Self::ALL.map(Self::name).join(", "),
        })
    }
}

/// How the array is read. `Schedule::new` checks it against array, converter and link.
#[derive(Clone, Debug, PartialEq)]
pub struct ReadoutParams {
    /// Whether rows are exposed together.
    pub shutter: Shutter,
    /// Line length in `pix_clk` clocks, blanking included, 1 to 2^24. Datasheet or driver (HTS).
    pub hts: u32,
    /// Frame length in lines, blanking included, 1 to 2^24. Datasheet or driver (VTS).
    pub vts: u32,
    /// Frequency of `pix_clk` in Hz, 1e3 to 1e11; HTS VTS fps.
    pub pixel_rate_hz: u64,
    /// Exposure asked for in us, above 0 to 1e9; rounded to whole lines.
    pub exposure_us: f64,
    /// Lines of a frame that no exposure can use, 0 to VTS - 1. Datasheet or driver (4 to 25 in known drivers).
    pub exposure_margin_lines: u32,
}

impl ReadoutParams {
    /// Refuses values out of range, naming key, value and what would do.
    pub fn check(&self) -> Result<(), Error> {
        for (key, value) in [("sensor.readout.hts", self.hts), ("sensor.readout.vts", self.vts)] {
            if !(1..=1 << 24).contains(&value) {
                return Err(Error::key(key, value, "out of range; 1 to 16777216 would do"));
            }
        }
        if !(1_000..=100_000_000_000).contains(&self.pixel_rate_hz) {
            return Err(Error::key(
                "sensor.readout.pixel_rate_hz",
                self.pixel_rate_hz,
                "out of range; 1 kHz to 100 GHz would do",
            ));
        }
        if self.exposure_margin_lines >= self.vts {
            let reason = format!("out of range; less than sensor.readout.vts = {} would do", self.vts);
            return Err(Error::key("sensor.readout.exposure_margin_lines", self.exposure_margin_lines, reason));
        }
        above("sensor.readout.exposure_us", self.exposure_us, 0.0, 1e9)
    }
}
