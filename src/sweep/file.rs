//! What a sweep file says: a scenario, factors, replicates. Unknown keys are refused with their line.

use serde::{Deserialize, Serialize};
use toml::Table;

use crate::config::suggest;
use crate::config::tree::Tree;
use crate::error::Error;
use crate::report::Report;
use crate::sweep::record::{CellCost, CellRecord};
use crate::sweep::signal::SignalSum;

/// Most samples of a random design, and most values of a factor.
const MANY: u32 = 1_000_000;

/// A sweep file.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct SweepFile {
    /// The scenario that all cells start from: a name, a folder or a file beside the sweep file.
    pub scenario: String,
    /// Keys of the scenario that all cells share.
    #[serde(default)]
    pub set: Table,
    /// "grid" (all combinations), "list" (the cells of `[[cell]]`), "random", "latin_hypercube" or "sobol".
    #[serde(default = "grid")]
    pub method: String,
    /// Points of "random", "latin_hypercube" and "sobol".
    pub samples: Option<u32>,
    /// Names the draws of the points.
    #[serde(default = "one")]
    pub seed: u64,
    /// Replicates: sensor seeds, as a count from 1 on or as a list.
    pub seeds: Option<Numbers>,
    /// Replicates: dies, as a count from 1 on or as a list.
    pub dies: Option<Numbers>,
    /// Whether every cell also tracks its packets without the IMU (figures `cameras_alone.*`).
    #[serde(default)]
    pub cameras_alone: bool,
    /// Replicates: trajectories, each a name and its keys.
    #[serde(default)]
    pub trajectory: Vec<NamedLevel>,
    /// What is varied.
    #[serde(default)]
    pub factor: Vec<Factor>,
    /// Points of a list.
    #[serde(default)]
    pub cell: Vec<NamedLevel>,
    /// What the report shows.
    #[serde(default)]
    pub report: ReportOptions,
}

fn grid() -> String {
    "grid".to_owned()
}

const fn one() -> u64 {
    1
}

/// What the report shows.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ReportOptions {
    /// Title of the page.
    pub title: Option<String>,
    /// Figures with effects and differences; not given: pose error, jitter, power, link rate and features.
    #[serde(default)]
    pub figures: Vec<String>,
    /// Pairs of figures whose front is drawn, both wanted small.
    #[serde(default)]
    pub fronts: Vec<[String; 2]>,
    /// Figures drawn by the levels of one factor, apart for those of another; each is a picture and a table as files too.
    #[serde(default)]
    pub picture: Vec<PlotRequest>,
}

/// A picture of a report.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlotRequest {
    /// The figure.
    pub figure: String,
    /// The factor along the axis.
    pub by: String,
    /// A factor whose levels are drawn apart.
    pub split: Option<String>,
    /// A level of `by`: ratios of paired cells to it are told as well.
    pub base: Option<toml::Value>,
    /// Whether the figure's axis is logarithmic.
    #[serde(default)]
    pub y_log: bool,
}

/// A count from 1 on, or a list.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(untagged, expecting = "expected a count, as in seeds = 8, or a list, as in seeds = [1, 5]")]
pub enum Numbers {
    /// 1 to this number.
    Count(u32),
    /// These.
    List(Vec<u64>),
}

impl Numbers {
    /// The numbers themselves.
    pub fn list(&self) -> Vec<u64> {
        match self {
            Self::Count(count) => (1..=u64::from(*count)).collect(),
            Self::List(list) => list.clone(),
        }
    }
}

/// What is varied: a key over `values` or from `low` to `high`, or named levels of several keys each.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Factor {
    /// Name in tables and pictures.
    pub name: String,
    /// Key of the scenario.
    pub key: Option<String>,
    /// Its values.
    pub values: Option<Vec<toml::Value>>,
    /// Least value of a range.
    pub low: Option<f64>,
    /// Greatest value of a range.
    pub high: Option<f64>,
    /// Values of a range in a grid.
    pub steps: Option<u32>,
    /// How a range is divided: "linear" or "log".
    #[serde(default = "linear")]
    pub spacing: String,
    /// Whether values of a range are whole numbers.
    #[serde(default)]
    pub whole: bool,
    /// Levels of several keys each.
    #[serde(default)]
    pub level: Vec<NamedLevel>,
}

fn linear() -> String {
    "linear".to_owned()
}

/// A name for values of several keys.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NamedLevel {
    /// Name in tables and pictures.
    pub name: String,
    /// Keys of the scenario and their values, as in `set = { "sensor.adc.bits" = 8 }`.
    #[serde(default)]
    pub set: Table,
}

impl SweepFile {
    /// Reads a sweep file's text. Fails on no TOML, an unknown key, a method, range or count that cannot be; with file, line and key.
    pub fn parse(file: &str, text: &str) -> Result<Self, Error> {
        let tree = Tree::parse(file, text)?;
        let value = toml::Value::Table(tree.values().clone());
        let sweep: Self = serde_path_to_error::deserialize(value).map_err(|error| {
            let path = error.path().to_string();
            let message = error.inner().message().to_owned();
            suggest::explain(&tree, &path, &message)
        })?;
        sweep.check().map_err(|error| match tree.locate(error) {
            // A key that is not written has no line.
            Error::Config { line: 0, key, value, reason, .. } => {
                Error::Config { file: file.to_owned(), line: 0, key, value, reason }
            }
            other => other,
        })?;
        Ok(sweep)
    }

    fn check(&self) -> Result<(), Error> {
        let draws = match self.method.as_str() {
            "grid" | "list" => false,
            "random" | "latin_hypercube" | "sobol" => true,
            other => {
                let reason = "unknown method; use grid, list, random, latin_hypercube or sobol";
                return Err(Error::key("method", other, reason));
            }
        };
        match (draws, self.samples) {
            (true, None) => {
                return Err(Error::key("samples", "", "is missing; this method needs it, as in samples = 64"));
            }
            (true, Some(count)) if count == 0 || count > MANY => {
                return Err(Error::key("samples", count, format!("out of range; use 1 to {MANY}")));
            }
            (false, Some(count)) => {
                return Err(Error::key("samples", count, "a grid or list has its own count; use steps or values"));
            }
            _ => {}
        }
        if self.method == "list" {
            if self.cell.is_empty() {
                return Err(Error::key("cell", "", "the list is empty; write at least one [[cell]] with name and set"));
            }
            if let Some(factor) = self.factor.first() {
                let reason = "a list has no factors; write [[cell]] tables, or use grid";
                return Err(Error::key("factor", &factor.name, reason));
            }
        } else if self.factor.is_empty() {
            let reason = "nothing is varied; write at least one [[factor]] with name, key and values";
            return Err(Error::key("factor", "", reason));
        } else if let Some(cell) = self.cell.first() {
            return Err(Error::key("cell", &cell.name, "only method = \"list\" has cells"));
        }
        for (key, numbers) in [("seeds", &self.seeds), ("dies", &self.dies)] {
            let Some(numbers) = numbers else { continue };
            let count = match numbers {
                Numbers::Count(count) => u64::from(*count),
                Numbers::List(list) => crate::num::u64_from(list.len()),
            };
            if count == 0 || count > u64::from(MANY) {
                return Err(Error::key(key, count, format!("out of range; use 1 to {MANY}, or leave the key out")));
            }
            if has_twins(&numbers.list()) {
                return Err(Error::key(key, "", "a number stands there twice; name each once"));
            }
        }
        for (number, factor) in self.factor.iter().enumerate() {
            factor.check(draws, number)?;
            check_column(number, &factor.name)?;
        }
        let names = |levels: &[NamedLevel]| levels.iter().map(|level| level.name.clone()).collect::<Vec<_>>();
        let factors: Vec<String> = self.factor.iter().map(|factor| factor.name.clone()).collect();
        for (key, names) in [("factor", factors), ("cell", names(&self.cell)), ("trajectory", names(&self.trajectory))]
        {
            if has_twins(&names) {
                return Err(Error::key(key, "", "two have one name; give each its own"));
            }
        }
        Ok(())
    }
}

/// Columns that a table has of itself.
const COLUMNS: [&str; 5] = ["cell", "status", "trajectory", "die", "seed"];

/// Refuses a factor whose column would have the name of another.
fn check_column(number: usize, name: &str) -> Result<(), Error> {
    let figures = CellRecord::of_report("", &Report::default(), &SignalSum::default(), CellCost::default()).figures;
    let is_taken = COLUMNS.contains(&name) || name.starts_with("config.") || figures.contains_key(name);
    if name.is_empty() || is_taken {
        let reason =
            if is_taken { "a column of the table has this name; use another" } else { "is empty; name the factor" };
        return Err(Error::key(&format!("factor.{number}.name"), name, reason));
    }
    Ok(())
}

fn has_twins<T: Ord + Clone>(all: &[T]) -> bool {
    let mut sorted = all.to_vec();
    sorted.sort();
    sorted.windows(2).any(|pair| pair[0] == pair[1])
}

impl Factor {
    /// Whether its values lie in a range.
    pub fn is_range(&self) -> bool {
        self.low.is_some() || self.high.is_some()
    }

    fn check(&self, draws: bool, number: usize) -> Result<(), Error> {
        let at = |key: &str| format!("factor.{number}.{key}");
        let refused = |key: &str, value: String, reason: &str| Err(Error::key(&at(key), value, reason));
        let given = [self.values.is_some(), self.is_range(), !self.level.is_empty()];
        if given.iter().filter(|is_given| **is_given).count() != 1 {
            return refused("values", String::new(), "give one of values, low with high, or [[factor.level]] tables");
        }
        if self.level.is_empty() == self.key.is_none() {
            return refused("key", String::new(), "values and ranges need a key; levels have keys of their own");
        }
        if self.values.as_ref().is_some_and(Vec::is_empty) {
            return refused("values", "[]".to_owned(), "the list is empty; name at least one value");
        }
        if has_twins(&self.level.iter().map(|level| level.name.clone()).collect::<Vec<_>>()) {
            return refused("level", String::new(), "two levels have one name; give each its own");
        }
        if !self.is_range() {
            let stray = [("steps", self.steps.is_some()), ("whole", self.whole), ("spacing", self.spacing != "linear")];
            let stray = stray.into_iter().find(|(_, is_given)| *is_given);
            return stray
                .map_or(Ok(()), |(key, _)| refused(key, String::new(), "belongs to a range; give low and high"));
        }
        let (Some(low), Some(high)) = (self.low, self.high) else {
            return refused("low", String::new(), "a range needs low and high");
        };
        if !(low.is_finite() && high.is_finite() && low < high) {
            return refused("high", high.to_string(), "must be greater than low, and both finite");
        }
        match self.spacing.as_str() {
            "linear" => {}
            "log" if low > 0.0 => {}
            "log" => return refused("low", low.to_string(), "must be above 0 with spacing = \"log\""),
            other => return refused("spacing", other.to_owned(), "unknown spacing; use linear or log"),
        }
        match (draws, self.steps) {
            (false, None) => refused("steps", String::new(), "a range in a grid needs steps, as in steps = 5"),
            (false, Some(steps)) if !(2..=MANY).contains(&steps) => {
                refused("steps", steps.to_string(), "out of range; use 2 to 1000000")
            }
            (true, Some(steps)) => refused("steps", steps.to_string(), "only a grid has steps; leave it out"),
            _ => Ok(()),
        }
    }
}
