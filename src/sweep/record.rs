//! What a cell leaves behind: its figures by name, in one small record with a checksum. It holds no picture.

use std::collections::BTreeMap;

use serde::{Deserialize, Serialize};
use serde_json::Value;

use super::signal::SignalSum;
use crate::report::Report;

/// Parts of a report that hold figures.
const SECTIONS: [&str; 7] = ["bandwidth", "cameras_alone", "energy", "features", "link", "timing", "tracking"];

/// Of two figures with one last part, the one outside this part is meant.
const SECOND: &str = "cameras_alone.";

/// Figures of the picture of the run itself.
const SCENARIO: [&str; 4] = ["duration_s", "path_m", "render_variance_ratio", "samples_per_pixel"];

/// Objects within these parts whose numbers are figures too.
const INNER: [&str; 3] = ["energy.blocks", "energy.rails", "timing.extractor"];

/// What was measured on this machine and is no figure.
const MEASURED: [&str; 2] = ["tracking.ms_per_frame", "timing.waterfall.measured_host_us"];

/// A finished or failed cell.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CellRecord {
    /// The cell's name.
    pub cell: String,
    /// Why it failed, if it did.
    pub error: Option<String>,
    /// Figures by name; none where one could not be measured.
    pub figures: BTreeMap<String, Option<f64>>,
    /// What this machine needed. No other part of the record depends on the machine.
    pub cost: CellCost,
}

/// What a cell cost.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct CellCost {
    /// Processor time of the whole cell.
    pub cpu_s: f64,
    /// Of it, rendering and loading photons.
    pub photons_s: f64,
    /// Of it, by stage behind the lens.
    pub stages_s: BTreeMap<String, f64>,
}

impl CellRecord {
    /// The figures of a run's report.
    pub fn of_report(cell: &str, report: &Report, signal: &SignalSum, cost: CellCost) -> Self {
        let value = serde_json::to_value(report).expect("a report has a JSON form");
        let mut figures = BTreeMap::new();
        for section in SECTIONS {
            collect(section, &value[section], &mut figures);
        }
        for name in SCENARIO {
            put(format!("scenario.{name}"), &value["scenario"][name], &mut figures);
        }
        figures.insert("scenario.mean_signal_share".to_owned(), signal.mean_share());
        figures.insert("scenario.mean_signal_e".to_owned(), signal.mean_e());
        figures.insert("scenario.saturated_share".to_owned(), signal.saturated_share());
        Self { cell: cell.to_owned(), error: None, figures, cost }
    }

    /// The record of a cell that failed.
    pub fn of_error(cell: &str, error: String) -> Self {
        Self { cell: cell.to_owned(), error: Some(error), ..Self::default() }
    }

    /// As bytes: the hash of what follows, then JSON.
    pub fn to_bytes(&self) -> Vec<u8> {
        let text = serde_json::to_string(self).expect("a record has a JSON form");
        format!("{}\n{text}\n", blake3::hash(text.as_bytes()).to_hex()).into_bytes()
    }

    /// The record that `to_bytes` wrote; none where the bytes are damaged or those of another form.
    pub fn from_bytes(bytes: &[u8]) -> Option<Self> {
        let (hash, rest) = std::str::from_utf8(bytes).ok()?.split_once('\n')?;
        let text = rest.strip_suffix('\n')?;
        if blake3::hash(text.as_bytes()).to_hex().as_str() != hash {
            return None;
        }
        serde_json::from_str(text).ok()
    }
}

fn put(name: String, value: &Value, figures: &mut BTreeMap<String, Option<f64>>) {
    if MEASURED.contains(&name.as_str()) {
        return;
    }
    match value {
        Value::Number(number) => {
            figures.insert(name, number.as_f64());
        }
        Value::Null => {
            figures.insert(name, None);
        }
        Value::Array(ends) if name.contains("_interval") && ends.len() == 2 => {
            for (end, value) in ["low", "high"].iter().zip(ends) {
                put(format!("{name}.{end}"), value, figures);
            }
        }
        _ => {}
    }
}

fn collect(path: &str, value: &Value, figures: &mut BTreeMap<String, Option<f64>>) {
    let Value::Object(parts) = value else { return };
    for (key, value) in parts {
        let name = format!("{path}.{key}");
        if INNER.contains(&name.as_str()) {
            collect(&name, value, figures);
        } else {
            put(name, value, figures);
        }
    }
}

/// The unit that a figure's name ends in.
pub fn unit_of(name: &str) -> &'static str {
    const UNITS: [(&str, &str); 22] = [
        ("pj_per_frame", "pJ"),
        ("pj_per_pixel", "pJ/px"),
        ("bits_per_frame", "bit"),
        ("bits_per_s", "bit/s"),
        ("clocks_per_frame", "clocks"),
        ("us_per_frame", "us"),
        ("power_mw", "mW"),
        ("_mw", "mW"),
        ("_hz", "Hz"),
        ("fps", "Hz"),
        ("_us", "us"),
        ("_ms", "ms"),
        ("_s", "s"),
        ("_px", "px"),
        ("_dn", "DN"),
        ("_clk", "clocks"),
        ("_uv", "uV"),
        ("_deg", "deg"),
        ("_lux", "lx"),
        ("_k", "K"),
        ("_e", "e-"),
        ("_m", "m"),
    ];
    let name = name.strip_suffix(".low").or_else(|| name.strip_suffix(".high")).unwrap_or(name);
    if name.starts_with("energy.blocks.") || name.starts_with("energy.rails.") {
        return "pJ";
    }
    UNITS.iter().find(|(ending, _)| name.ends_with(ending)).map_or("1", |(_, unit)| unit)
}

/// A figure with its unit.
pub(super) fn label(figure: &str) -> String {
    match unit_of(figure) {
        "1" => figure.to_owned(),
        unit => format!("{figure} [{unit}]"),
    }
}

/// The full name of a figure that a user calls by its last part or by all of it.
pub fn find_figure<'a>(asked: &str, known: impl Iterator<Item = &'a String>) -> Result<&'a String, Vec<String>> {
    let known: Vec<&String> = known.collect();
    if let Some(&exact) = known.iter().find(|name| **name == asked) {
        return Ok(exact);
    }
    let ending = format!(".{asked}");
    let ends: Vec<&String> = known.iter().copied().filter(|name| name.ends_with(&ending)).collect();
    let first: Vec<&String> = ends.iter().copied().filter(|name| !name.starts_with(SECOND)).collect();
    match ends[..] {
        [one] => Ok(one),
        _ if first.len() == 1 => Ok(first[0]),
        [] => {
            let distance = |name: &&String| {
                let last = name.rsplit('.').next().unwrap_or(name);
                crate::config::suggest::edit_distance(asked, last)
            };
            let mut near = known;
            near.sort_by_key(|name| (distance(name), name.len()));
            Err(near.into_iter().take(6).cloned().collect())
        }
        _ => Err(ends.into_iter().cloned().collect()),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_record_comes_back_or_is_known_to_be_damaged() {
        let figures = BTreeMap::from([("tracking.ate_m".to_owned(), Some(0.1)), ("tracking.rpe_m".to_owned(), None)]);
        let record = CellRecord { cell: "ab".to_owned(), figures, ..CellRecord::default() };
        let bytes = record.to_bytes();
        assert_eq!(CellRecord::from_bytes(&bytes), Some(record));
        for at in 0..bytes.len() {
            let mut flipped = bytes.clone();
            flipped[at] ^= 1;
            assert_eq!(CellRecord::from_bytes(&flipped), None, "byte {at}");
            assert_eq!(CellRecord::from_bytes(&bytes[..at]), None, "cut to {at}");
        }
    }

    #[test]
    fn a_figure_is_found_by_its_last_part_and_an_unknown_one_names_its_nearest() {
        let known = ["tracking.ate_m", "tracking.rpe_m", "energy.power_mw", "energy.x.power_mw"].map(str::to_owned);
        assert_eq!(find_figure("ate_m", known.iter()).unwrap(), "tracking.ate_m");
        assert_eq!(find_figure("energy.power_mw", known.iter()).unwrap(), "energy.power_mw");
        assert_eq!(find_figure("power_mw", known.iter()).unwrap_err().len(), 2);
        let both = ["cameras_alone.ate_m", "tracking.ate_m"].map(str::to_owned);
        assert_eq!(find_figure("ate_m", both.iter()).unwrap(), "tracking.ate_m");
        assert_eq!(find_figure("ate_mm", known.iter()).unwrap_err()[0], "tracking.ate_m");
    }

    #[test]
    fn units_stand_in_the_names() {
        for (name, unit) in [
            ("tracking.ate_m", "m"),
            ("tracking.ate_interval_m.low", "m"),
            ("energy.power_mw", "mW"),
            ("energy.total_pj_per_frame", "pJ"),
            ("bandwidth.link_bits_per_s", "bit/s"),
            ("tracking.tracked_fraction", "1"),
            ("energy.blocks.adc", "pJ"),
        ] {
            assert_eq!(unit_of(name), unit, "{name}");
        }
    }
}
