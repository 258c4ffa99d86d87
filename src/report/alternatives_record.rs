//! What extraction on the sensor saves: raw pictures, features, both, and rows every Nth frame side by side, from one run.

use serde::{Deserialize, Serialize};

/// The table.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Alternatives {
    /// One a way of sending.
    pub rows: Vec<Alternative>,
    /// Ways of sending that this sensor and link cannot do.
    pub left_out: Vec<LeftOut>,
    /// Features of a camera's frame that all rows are computed with.
    pub features: u64,
    /// Host whose energy and time stand in the rows: `host.model`.
    pub host: String,
}

/// One way of sending.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Alternative {
    /// "raw", "features", "both", "both, rows every 4th frame".
    pub name: String,
    /// Whether the run sent this.
    pub is_run: bool,
    /// Power of all sensors from the analog rail.
    pub analog_mw: f64,
    /// From the digital rail.
    pub digital_mw: f64,
    /// From the rail of the port.
    pub io_mw: f64,
    /// The sum of the three.
    pub power_mw: f64,
    /// Everything that is sent by all cameras, headers and checks with it.
    pub link_mbit_per_s: f64,
    /// From the middle of the exposure to the last bit of the frame's last packet: of what the run sent that of its slowest frame, else of
    /// features that are spread evenly.
    pub latency_us: f64,
    /// From the middle of the exposure to the pose; none without a host.
    pub pose_us: Option<f64>,
    /// Energy of the host a frame of the rig; none without a host.
    pub host_mj_per_frame: Option<f64>,
    /// Whether the extractor keeps up; none where the sensor extracts nothing.
    pub keeps_up: Option<bool>,
    /// Position error of the run; none for ways that it did not send.
    pub ate_m: Option<f64>,
}

/// A way of sending that cannot be.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct LeftOut {
    /// As in `Alternative`.
    pub name: String,
    /// Why.
    pub reason: String,
}

impl Alternatives {
    /// Reasons for what the rows do not have, by path in a report.
    pub fn reasons(&self) -> Vec<(&'static str, &'static str)> {
        let lacks = |is_absent: fn(&Alternative) -> bool| self.rows.iter().any(is_absent);
        let mut reasons = Vec::new();
        if lacks(|row| row.pose_us.is_none()) {
            reasons.push(("alternatives.rows.pose_us", "host.model is none"));
            reasons.push(("alternatives.rows.host_mj_per_frame", "host.model is none"));
        }
        if lacks(|row| row.keeps_up.is_none()) {
            reasons.push(("alternatives.rows.keeps_up", "the sensor extracts nothing in this row"));
        }
        if lacks(|row| row.ate_m.is_none()) {
            reasons.push(("alternatives.rows.ate_m", "the run did not send this, or its error is not measurable"));
        }
        reasons
    }

    /// The table as lines of text.
    pub fn text(&self) -> String {
        let mut text = format!(
            "{:<28} {:>9} {:>9} {:>9} {:>9} {:>10} {:>11} {:>11} {:>8} {:>9} {:>8}\n",
            "what is sent",
            "analog mW",
            "digital",
            "io",
            "total mW",
            "Mbit/s",
            "latency us",
            "pose us",
            "host mJ",
            "keeps up",
            "ATE mm"
        );
        let number =
            |value: Option<f64>, decimals: usize| value.map_or("-".to_owned(), |value| format!("{value:.decimals$}"));
        for row in &self.rows {
            let mark = if row.is_run { " *" } else { "" };
            let keeps_up = row.keeps_up.map_or("-", |keeps_up| if keeps_up { "yes" } else { "no" });
            text += &format!(
                "{:<28} {:>9.3} {:>9.3} {:>9.3} {:>9.3} {:>10.3} {:>11.1} {:>11} {:>8} {:>9} {:>8}\n",
                format!("{}{mark}", row.name),
                row.analog_mw,
                row.digital_mw,
                row.io_mw,
                row.power_mw,
                row.link_mbit_per_s,
                row.latency_us,
                number(row.pose_us, 1),
                number(row.host_mj_per_frame, 2),
                keeps_up,
                number(row.ate_m.map(|ate_m| 1e3 * ate_m), 2),
            );
        }
        for LeftOut { name, reason } in &self.left_out {
            text += &format!("{name:<28} not possible: {reason}\n");
        }
        text + &format!("  (* what this scenario sends; {} features per frame; host {})\n", self.features, self.host)
    }
}
