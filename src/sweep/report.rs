//! What a gathered sweep says: effects, differences under equal draws, fronts, and how much each factor matters.

use std::collections::BTreeMap;

use rand::RngExt;

use super::file::{PlotRequest, ReportOptions};
use super::html;
use super::interaction::Interaction;
use super::levels::{by_rest, figures, levels};
use super::record::find_figure;
use super::table::{Role, Table};
pub use super::verdicts::{FactorEffect, FigureReport, FrontPoint, LevelDifference, PointVerdict};
use crate::draw::DrawKey;
use crate::error::Error;
use crate::num::f64_from_usize;
use crate::statistics::{MeanEstimate, mean, standard_error};

/// Figures with effects where a sweep file names none.
const FIGURES: [&str; 6] = [
    "tracking.ate_m",
    "tracking.jitter_d2_m",
    "tracking.tracked_fraction",
    "features.median_tracked",
    "energy.power_mw",
    "bandwidth.link_bits_per_s",
];

/// Pareto fronts where a sweep file names none.
const FRONTS: [[&str; 2]; 2] = [["energy.power_mw", "tracking.ate_m"], ["bandwidth.link_bits_per_s", "tracking.ate_m"]];

/// Resamples of the replicates that say how sure it is that a point is on a front.
const RESAMPLES: u64 = 400;

/// The page of a gathered sweep. Fails on a figure that no cell has; a sweep without a finished cell.
pub fn page(title: &str, options: &ReportOptions, table: &Table, verdicts: &[PointVerdict]) -> Result<String, Error> {
    let known = figure_names(table);
    if known.is_empty() {
        return Err(Error::Run("no cell is finished; run the sweep first".to_owned()));
    }
    let full = |key: &str, asked: &str| full_name(&known, key, asked);
    let usual = |names: &[&str]| {
        names.iter().filter(|name| known.iter().any(|one| one == *name)).map(|name| (*name).to_owned()).collect()
    };
    let figures: Vec<String> = if options.figures.is_empty() {
        usual(&FIGURES)
    } else {
        options.figures.iter().map(|asked| full("report.figures", asked)).collect::<Result<_, _>>()?
    };
    let fronts: Vec<[String; 2]> = if options.fronts.is_empty() {
        let is_known = |pair: &&[&str; 2]| pair.iter().all(|name| known.iter().any(|one| one == name));
        FRONTS.iter().filter(is_known).map(|pair| pair.map(str::to_owned)).collect()
    } else {
        let of = |pair: &[String; 2]| Ok([full("report.fronts", &pair[0])?, full("report.fronts", &pair[1])?]);
        options.fronts.iter().map(of).collect::<Result<_, Error>>()?
    };
    let reports: Vec<FigureReport> = figures.iter().map(|figure| figure_report(table, figure)).collect();
    let fronts: Vec<([String; 2], Vec<FrontPoint>)> =
        fronts.into_iter().map(|pair| (pair.clone(), front(table, [&pair[0], &pair[1]]))).collect();
    let pictures = interactions(options, table)?;
    Ok(html::page(title, table, &reports, (&fronts, &pictures), verdicts))
}

/// The pictures that a sweep file asks for. Fails on a figure, factor or level that no cell has.
pub fn interactions(options: &ReportOptions, table: &Table) -> Result<Vec<Interaction>, Error> {
    let known = figure_names(table);
    let one = |plot: &PlotRequest| Interaction::of(table, &full_name(&known, "report.picture", &plot.figure)?, plot);
    options.picture.iter().map(one).collect()
}

fn figure_names(table: &Table) -> Vec<String> {
    let figures = table.columns.iter().filter(|column| column.role == Role::Figure);
    figures.map(|column| column.name.clone()).collect()
}

fn full_name(known: &[String], key: &str, asked: &str) -> Result<String, Error> {
    find_figure(asked, known.iter()).cloned().map_err(|near| Error::Unknown {
        what: "figure",
        name: format!("{asked} ({key})"),
        known: near.join(", "),
    })
}

/// Effects and differences of one figure.
pub fn figure_report(table: &Table, figure: &str) -> FigureReport {
    let factors: Vec<&str> = names(table, Role::Factor);
    FigureReport {
        figure: figure.to_owned(),
        effects: factors.iter().map(|factor| effect(table, factor, figure)).collect(),
        differences: factors.iter().flat_map(|factor| differences(table, factor, figure)).collect(),
    }
}

fn names(table: &Table, role: Role) -> Vec<&str> {
    table.columns.iter().filter(|column| column.role == role).map(|column| column.name.as_str()).collect()
}

fn effect(table: &Table, factor: &str, figure: &str) -> FactorEffect {
    let values = figures(table, figure);
    let levels: Vec<(String, Option<f64>, Vec<f64>)> = levels(table, factor)
        .into_iter()
        .map(|(name, position, rows)| (name, position, rows.into_iter().filter_map(|row| values[row]).collect()))
        .collect();
    let first_order = first_order(&levels.iter().map(|(_, _, values)| values.as_slice()).collect::<Vec<_>>());
    let levels = levels
        .into_iter()
        .filter_map(|(name, position, values)| Some((name, position, MeanEstimate::of(&values)?)))
        .collect();
    FactorEffect { factor: factor.to_owned(), levels, first_order }
}

/// Correlation ratio of the classes, less what as many classes of pure noise would have; none where nothing varies.
fn first_order(classes: &[&[f64]]) -> Option<f64> {
    let all: Vec<f64> = classes.iter().flat_map(|class| class.iter().copied()).collect();
    let filled: Vec<&&[f64]> = classes.iter().filter(|class| !class.is_empty()).collect();
    let (count, groups) = (f64_from_usize(all.len()), f64_from_usize(filled.len()));
    if filled.len() < 2 || all.len() <= filled.len() {
        return None;
    }
    let middle = mean(&all);
    let squared = |value: f64| value * value;
    let total: f64 = all.iter().map(|value| squared(value - middle)).sum();
    let between: f64 = filled.iter().map(|class| f64_from_usize(class.len()) * squared(mean(class) - middle)).sum();
    // Omega squared (Hays 1963): unbiased to first order.
    let noise = (total - between) / (count - groups);
    (total > 0.0).then(|| crate::num::greater((between - (groups - 1.0) * noise) / (total + noise), 0.0))
}

fn differences(table: &Table, factor: &str, figure: &str) -> Vec<LevelDifference> {
    let values = figures(table, figure);
    let levels = levels(table, factor);
    let Some(((from, _, first), others)) = levels.split_first() else { return Vec::new() };
    let by_rest = |rows: &[usize]| by_rest(table, factor, rows, &|row| values[row]);
    let base = by_rest(first);
    let mut all = Vec::new();
    for (to, _, rows) in others {
        let other = by_rest(rows);
        let pairs: Vec<(f64, f64)> =
            base.iter().filter_map(|(rest, value)| Some((*value, *other.get(rest)?))).collect();
        let changes: Vec<f64> = pairs.iter().map(|(one, other)| other - one).collect();
        let Some(change) = MeanEstimate::of(&changes) else { continue };
        let (ones, twos): (Vec<f64>, Vec<f64>) = pairs.into_iter().unzip();
        let saving = match (standard_error(&ones), standard_error(&twos), standard_error(&changes)) {
            (Some(one), Some(two), Some(paired)) if paired > 0.0 => Some((one * one + two * two) / (paired * paired)),
            _ => None,
        };
        all.push(LevelDifference { factor: factor.to_owned(), from: from.clone(), to: to.clone(), change, saving });
    }
    all
}

/// Points of the design with both figures, and which of them are Pareto-optimal.
pub fn front(table: &Table, pair: [&str; 2]) -> Vec<FrontPoint> {
    let values = pair.map(|name| figures(table, name));
    let factors: Vec<&str> = names(table, Role::Factor);
    let mut points: Vec<(String, Vec<[f64; 2]>)> = Vec::new();
    let mut index_of: BTreeMap<String, usize> = BTreeMap::new();
    for row in 0..table.rows {
        let (Some(x), Some(y)) = (values[0][row], values[1][row]) else { continue };
        let shown =
            factors.iter().filter_map(|name| Some(format!("{name} = {}", table.column(name)?.values.text(row))));
        let name = shown.collect::<Vec<_>>().join(", ");
        let number = *index_of.entry(name.clone()).or_insert_with(|| {
            points.push((name, Vec::new()));
            points.len() - 1
        });
        points[number].1.push([x, y]);
    }
    let means: Vec<[f64; 2]> = points.iter().map(|(_, runs)| mean_of(runs)).collect();
    let on_front = front_of(&means);
    let mut counts = vec![0_u32; points.len()];
    for number in 0..RESAMPLES {
        let mut stream = DrawKey::root(1).with(number).stream();
        let drawn: Vec<[f64; 2]> = points
            .iter()
            .map(|(_, runs)| {
                mean_of(&runs.iter().map(|_| runs[stream.random_range(0..runs.len())]).collect::<Vec<_>>())
            })
            .collect();
        front_of(&drawn).into_iter().zip(&mut counts).for_each(|(is_on, count)| *count += u32::from(is_on));
    }
    points
        .into_iter()
        .zip(on_front.into_iter().zip(counts))
        .filter_map(|((name, runs), (is_on_front, count))| {
            let of = |axis: usize| MeanEstimate::of(&runs.iter().map(|run| run[axis]).collect::<Vec<_>>());
            let share_on_front = f64::from(count) / crate::num::f64_from_u64(RESAMPLES);
            Some(FrontPoint { name, figures: [of(0)?, of(1)?], is_on_front, share_on_front })
        })
        .collect()
}

fn mean_of(runs: &[[f64; 2]]) -> [f64; 2] {
    [0, 1].map(|axis| mean(&runs.iter().map(|run| run[axis]).collect::<Vec<_>>()))
}

fn front_of(points: &[[f64; 2]]) -> Vec<bool> {
    let beats = |a: &[f64; 2], b: &[f64; 2]| a[0] <= b[0] && a[1] <= b[1] && a != b;
    points.iter().map(|point| !points.iter().any(|other| beats(other, point))).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_front_holds_what_nothing_beats_in_both_figures() {
        let points = [[1.0, 5.0], [2.0, 2.0], [3.0, 1.0], [3.0, 3.0], [1.0, 6.0]];
        assert_eq!(front_of(&points), [true, true, true, false, false]);
    }

    #[test]
    fn a_factor_that_does_all_has_an_index_near_one_and_one_that_does_nothing_near_zero() {
        let class = |level: f64, spread: f64| -> Vec<f64> {
            (0..50).map(|k| level + spread * f64::from((k * 7919) % 101 - 50) / 50.0).collect()
        };
        let strong = [class(0.0, 0.1), class(1.0, 0.1), class(2.0, 0.1)];
        let weak = [class(1.0, 1.0), class(1.0, 1.0), class(1.0, 1.0)];
        let of = |classes: &[Vec<f64>]| first_order(&classes.iter().map(Vec::as_slice).collect::<Vec<_>>()).unwrap();
        assert!(of(&strong) > 0.98, "{}", of(&strong));
        assert!(of(&weak) < 0.05, "{}", of(&weak));
        assert_eq!(first_order(&[&[1.0, 1.0], &[1.0]]), None);
    }
}
