//! A figure by the levels of one factor, apart for the levels of another: means, and ratios between paired cells, with their intervals.

use super::digits::digits;
use super::file::PlotRequest;
use super::levels::{Levels, by_rest, figures, levels};
use super::record::label;
use super::table::{Role, Table};
use crate::error::Error;
use crate::statistics::MeanEstimate;

/// One picture and table of a report.
#[derive(Clone, Debug, PartialEq)]
pub struct Interaction {
    /// Full name of the figure.
    pub figure: String,
    /// The factor along the axis.
    pub by: String,
    /// The other factor.
    pub split: Option<String>,
    /// Levels of the one along the axis.
    pub levels: Vec<String>,
    /// One entry a level of the other factor.
    pub series: Vec<LevelMeans>,
    /// Whether the picture's axis of the figure is logarithmic.
    pub y_log: bool,
    /// The level that ratios are taken against.
    pub base: Option<String>,
}

/// The means at one level of the other factor.
#[derive(Clone, Debug, PartialEq)]
pub struct LevelMeans {
    /// The other factor and its level; empty without one.
    pub name: String,
    /// One mean a level of the axis.
    pub means: Vec<Option<MeanEstimate>>,
    /// Geometric mean of the ratios of paired cells to those of the base level.
    pub ratios: Vec<Option<MeanEstimate>>,
}

impl Interaction {
    /// Takes it from a table. Fails on a factor or level that the table does not have.
    pub fn of(table: &Table, figure: &str, plot: &PlotRequest) -> Result<Self, Error> {
        let factors: Vec<&String> =
            table.columns.iter().filter(|column| is_level(column.role)).map(|column| &column.name).collect();
        let known = |key: &str, name: &str| {
            if factors.iter().any(|factor| *factor == name) {
                return Ok(());
            }
            let known = factors.iter().map(|name| name.as_str()).collect::<Vec<_>>().join(", ");
            Err(Error::Unknown { what: "factor", name: format!("{name} (report.picture.{key})"), known })
        };
        known("by", &plot.by)?;
        plot.split.iter().try_for_each(|split| known("split", split))?;
        let along = levels(table, &plot.by);
        let names: Vec<String> = along.iter().map(|(name, _, _)| name.clone()).collect();
        let base = plot.base.as_ref().map(super::cells::shown);
        if let Some(base) = base.as_ref().filter(|base| !names.contains(base)) {
            let name = format!("{base} (report.picture.base)");
            return Err(Error::Unknown { what: "level", name, known: names.join(", ") });
        }
        let apart = plot.split.as_ref().map_or_else(
            || vec![(String::new(), None, (0..table.rows).collect())],
            |split| {
                levels(table, split).into_iter().map(|(name, at, rows)| (format!("{split} {name}"), at, rows)).collect()
            },
        );
        let values = figures(table, figure);
        let one = |(name, _, rows): &(String, Option<f64>, Vec<usize>)| {
            let is_in: std::collections::BTreeSet<usize> = rows.iter().copied().collect();
            series(table, &plot.by, name, (&along, base.as_ref()), &|row| values[row].filter(|_| is_in.contains(&row)))
        };
        let series = apart.iter().map(one).collect();
        let (figure, by, split) = (figure.to_owned(), plot.by.clone(), plot.split.clone());
        Ok(Self { figure, by, split, levels: names, series, y_log: plot.y_log, base })
    }

    /// Name of its files.
    pub fn file_name(&self) -> String {
        let split = self.split.as_ref().map_or_else(String::new, |split| format!("_and_{split}"));
        let name = format!("{}_by_{}{split}", self.figure, self.by);
        name.chars().map(|c| if c.is_ascii_alphanumeric() { c } else { '_' }).collect()
    }

    /// The figure with its unit.
    pub fn label(&self) -> String {
        label(&self.figure)
    }

    /// As Markdown: one table of means, and one of ratios where there is a base.
    pub fn markdown(&self) -> String {
        let means = self.table(|series| &series.means);
        let mut text = format!("**{}**, mean with its 95 % interval:\n\n{means}", self.label());
        if let Some(base) = &self.base {
            let ratios = self.table(|series| &series.ratios);
            text.push_str(&format!(
                "\nRatio to {} = {base}, geometric mean over pairs with its 95 % interval:\n\n{ratios}",
                self.by
            ));
        }
        text
    }

    fn table(&self, of: impl Fn(&LevelMeans) -> &Vec<Option<MeanEstimate>>) -> String {
        let name = |series: &LevelMeans| if series.name.is_empty() { "all".to_owned() } else { series.name.clone() };
        let heads: Vec<String> = self.series.iter().map(name).collect();
        let mut text = format!("| {} | {} |\n|{}\n", self.by, heads.join(" | "), "---|".repeat(1 + heads.len()));
        for (at, level) in self.levels.iter().enumerate() {
            let cells: Vec<String> = self.series.iter().map(|series| shown(of(series)[at].as_ref())).collect();
            text.push_str(&format!("| {level} | {} |\n", cells.join(" | ")));
        }
        text
    }
}

fn is_level(role: Role) -> bool {
    matches!(role, Role::Factor | Role::Replicate)
}

fn shown(estimate: Option<&MeanEstimate>) -> String {
    estimate.map_or("not measurable".to_owned(), with_ends)
}

/// A mean, and its interval where there is one.
pub(super) fn with_ends(value: &MeanEstimate) -> String {
    let ends = value.interval.map_or_else(String::new, |[low, high]| format!(" ({} to {})", digits(low), digits(high)));
    format!("{}{ends}", digits(value.mean))
}

fn series(
    table: &Table,
    by: &str,
    name: &str,
    (along, base): (&Levels, Option<&String>),
    value: &dyn Fn(usize) -> Option<f64>,
) -> LevelMeans {
    let of = |rows: &[usize]| rows.iter().filter_map(|&row| value(row)).collect::<Vec<f64>>();
    let means = along.iter().map(|(_, _, rows)| MeanEstimate::of(&of(rows))).collect();
    let by_rest = |rows: &[usize]| by_rest(table, by, rows, value);
    let base = along.iter().find(|(level, _, _)| Some(level) == base).map(|(_, _, rows)| by_rest(rows));
    let ratio = |rows: &[usize]| {
        let (base, own) = (base.as_ref()?, by_rest(rows));
        let pairs = own.iter().filter_map(|(rest, value)| Some((*value, *base.get(rest)?)));
        let logs: Vec<f64> = pairs
            .filter(|(value, base)| *value > 0.0 && *base > 0.0)
            .map(|(value, base)| libm::log(value / base))
            .collect();
        MeanEstimate::of(&logs).map(exponential)
    };
    let ratios = along.iter().map(|(_, _, rows)| ratio(rows)).collect();
    LevelMeans { name: name.to_owned(), means, ratios }
}

/// Of the mean of logarithms: the geometric mean. The ends go the same way.
fn exponential(logs: MeanEstimate) -> MeanEstimate {
    MeanEstimate {
        mean: libm::exp(logs.mean),
        interval: logs.interval.map(|ends| ends.map(libm::exp)),
        count: logs.count,
    }
}

#[cfg(test)]
mod tests {
    use std::collections::BTreeMap;

    use super::super::gather::{ColumnValues, TableColumn};
    use super::*;

    fn table() -> Table {
        let text = |all: &[&str]| ColumnValues::Text(all.iter().map(|text| Some((*text).to_owned())).collect());
        let column = |name: &str, role: Role, values: ColumnValues| TableColumn {
            name: name.to_owned(),
            unit: String::new(),
            role,
            values,
        };
        let whole = |all: &[i64]| ColumnValues::Whole(all.iter().copied().map(Some).collect());
        let numbers = ColumnValues::Number([1.0, 2.0, 4.0, 8.0, 2.0, 4.0, 2.0, 4.0].map(Some).to_vec());
        Table {
            columns: vec![
                column("bits", Role::Factor, whole(&[2, 2, 8, 8, 2, 2, 8, 8])),
                column("smoothing", Role::Factor, text(&["on", "on", "on", "on", "off", "off", "off", "off"])),
                column("seed", Role::Replicate, whole(&[1, 2, 1, 2, 1, 2, 1, 2])),
                column("tracking.ate_m", Role::Figure, numbers),
            ],
            rows: 8,
            metadata: BTreeMap::new(),
        }
    }

    fn plot() -> PlotRequest {
        PlotRequest {
            figure: "ate_m".to_owned(),
            by: "bits".to_owned(),
            split: Some("smoothing".to_owned()),
            base: Some(toml::Value::Integer(2)),
            y_log: false,
        }
    }

    #[test]
    fn ratios_are_taken_between_cells_of_one_seed() {
        let found = Interaction::of(&table(), "tracking.ate_m", &plot()).unwrap();
        assert_eq!(found.levels, ["2", "8"]);
        let of = |series: usize, level: usize| found.series[series].ratios[level].unwrap().mean;
        // On: 4 / 1 and 8 / 2. Off: 2 / 2 and 4 / 4. Logarithm and exponential leave a few units in the last place.
        assert!((of(0, 1) - 4.0).abs() < 1e-12 && (of(1, 1) - 1.0).abs() < 1e-12);
        assert_eq!(found.series[0].means[1].unwrap().mean, 6.0);
        assert!(found.markdown().contains("| 8 | 6.000"), "{}", found.markdown());
        assert_eq!(found.file_name(), "tracking_ate_m_by_bits_and_smoothing");
    }

    #[test]
    fn a_factor_or_level_that_is_not_there_is_refused_with_those_that_are() {
        let said = |plot: PlotRequest| Interaction::of(&table(), "tracking.ate_m", &plot).unwrap_err().to_string();
        assert!(said(PlotRequest { by: "bit".to_owned(), ..plot() }).contains("bits, smoothing, seed"));
        assert!(said(PlotRequest { base: Some(toml::Value::Integer(3)), ..plot() }).contains("2, 8"));
    }
}
