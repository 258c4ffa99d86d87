//! Draws the line-time budget of a sensor: the spans of a line with its slack, and two frames over time and rows. The
//! result is a table for a terminal, or a stand-alone SVG that follows light and dark.

mod lines;
mod picture;

use std::fmt::Write as _;

use crate::report::record::Timing;

/// Why writing into a `String` is expected to work.
const TEXT: &str = "writing to a string cannot fail";

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
    pub budgets: Vec<Budget>,
    /// Exposures and readouts in time over rows.
    pub bands: Vec<Band>,
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
pub struct Budget {
    /// "pixels", "conversion", "shift out", "packet".
    pub name: String,
    /// Its own time.
    pub time_us: f64,
    /// Shortest HTS that would do.
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
pub struct Band {
    /// What it shows.
    pub kind: BandKind,
    /// Of which frame; frame 1 starts at 0 us.
    pub frame: u32,
    /// Start and end of the first row.
    pub first_us: [f64; 2],
    /// Start and end of the last row.
    pub last_us: [f64; 2],
}

impl TimingDiagram {
    /// The budgets and spans as a table for a terminal.
    pub fn text(&self) -> String {
        let mut text = String::from("line budget                 time       needs   slack\n");
        for budget in &self.budgets {
            let limits = if budget.limits { "  decides" } else { "" };
            let Budget { name, time_us, needed_hts, slack_us, .. } = budget;
            writeln!(text, "  {name:<16} {time_us:12.3} us  HTS {needed_hts:<6} {slack_us:.3} us{limits}").expect(TEXT);
        }
        for (title, phases) in [("within a line", &self.timing.line), ("within a frame", &self.timing.frame)] {
            writeln!(text, "{title}").expect(TEXT);
            for phase in phases {
                let (lane, name) = (&phase.lane, &phase.name);
                writeln!(text, "  {lane:<16} {name:<14} {:12.3} to {:12.3} us", phase.start_us, phase.end_us)
                    .expect(TEXT);
            }
        }
        text
    }

    /// The picture.
    pub fn svg(&self) -> String {
        picture::svg(self)
    }

    /// The demand that decides, in words.
    fn limit(&self) -> String {
        match self.budgets.iter().find(|budget| budget.limits) {
            Some(budget) if budget.needed_hts == self.hts => {
                format!("The {} decides and fills the line.", budget.name)
            }
            Some(budget) => format!(
                "The {} decides: HTS {} would do, {} is set, {:.3} \u{b5}s are left.",
                budget.name, budget.needed_hts, self.hts, budget.slack_us
            ),
            None => "Nothing fills the line.".to_owned(),
        }
    }
}
