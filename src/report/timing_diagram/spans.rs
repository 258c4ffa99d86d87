//! Spans of a frame's timing diagram.

use super::super::record::Timing;

/// What is drawn.
#[derive(Clone, Debug, PartialEq)]
pub struct TimingDiagram {
    /// Of the sensor, for a person.
    pub name: String,
    /// Size, depth, shutter.
    pub mode: String,
    /// Line length in pixel clocks.
    pub hts: u64,
    /// Frame length in lines, in effect.
    pub vts: u64,
    /// Pixel clock.
    pub pixel_rate_hz: u64,
    /// What a line must hold, in the order of the data.
    pub budgets: Vec<LineBudget>,
    /// Exposures and readouts in time over rows.
    pub bands: Vec<RowBand>,
    /// Readout and link below them, from the start of the same frame.
    pub lanes: Vec<crate::report::record::Phase>,
    /// Rows of the picture.
    pub rows: u32,
    /// Lines from the first row's read to the last row's.
    pub rows_lines: u64,
    /// Longest exposure in effect.
    pub exposure_lines: u64,
    /// Longest exposure of this frame.
    pub exposure_lines_max: u64,
    /// Times and spans as in the report.
    pub timing: Timing,
}

/// A demand on a line.
#[derive(Clone, Debug, PartialEq)]
pub struct LineBudget {
    /// "pixels", "conversion", "shift out", "packet".
    pub name: String,
    /// Its own time.
    pub time_us: f64,
    /// Shortest HTS that is accepted.
    pub needed_hts: u64,
    /// What the line has beyond it.
    pub slack_us: f64,
    /// Whether it is the one that decides.
    pub limits: bool,
}

/// What a band of time over rows shows.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum BandKind {
    /// Rows gather light.
    Exposure {
        /// Of several exposures a frame, the longest first.
        slot: usize,
    },
    /// Rows are sampled and converted.
    Readout,
}

/// A span of the first and of the last row; rows between lie on straight lines between them.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RowBand {
    /// What it shows.
    pub kind: BandKind,
    /// Of which frame; frame 1 starts at 0 us.
    pub frame: u32,
    /// Start and end of the first row.
    pub first_us: [f64; 2],
    /// Start and end of the last row.
    pub last_us: [f64; 2],
}
