//! Draws the line-time budget of a sensor: the spans of a line with its slack, and two frames over time and rows. The
//! result is a table for a terminal, or a stand-alone SVG that follows light and dark.

mod lines;
mod picture;
mod spans;

pub use spans::{BandKind, LineBudget, RowBand, TimingDiagram};

impl TimingDiagram {
    /// The budgets and spans as a table for a terminal.
    pub fn text(&self) -> String {
        let mut text = String::from("line budget                 time       needs   slack\n");
        for budget in &self.budgets {
            let limits = if budget.limits { "  decides" } else { "" };
            let LineBudget { name, time_us, needed_hts, slack_us, .. } = budget;
            text += &format!("  {name:<16} {time_us:12.3} us  HTS {needed_hts:<6} {slack_us:.3} us{limits}\n");
        }
        for (title, phases) in [("within a line", &self.timing.line), ("within a frame", &self.timing.frame)] {
            text += &format!("{title}\n");
            for phase in phases {
                let (lane, name) = (&phase.lane, &phase.name);
                text += &format!("  {lane:<16} {name:<14} {:12.3} to {:12.3} us\n", phase.start_us, phase.end_us);
            }
        }
        text
    }

    /// The picture.
    pub fn svg(&self) -> String {
        picture::svg(self)
    }

    /// The demand that decides, in words.
    pub(super) fn limit(&self) -> String {
        match self.budgets.iter().find(|budget| budget.limits) {
            Some(budget) if budget.needed_hts == self.hts => {
                format!("The {} decides and fills the line.", budget.name)
            }
            Some(budget) => format!(
                "The {} decides: HTS {} suffices, {} is set, {:.3} \u{b5}s are left.",
                budget.name, budget.needed_hts, self.hts, budget.slack_us
            ),
            None => "Nothing fills the line.".to_owned(),
        }
    }
}
