//! Rows of a table by the levels of a factor.

use std::collections::BTreeMap;

use super::table::{ColumnValues, Role, Table};
use crate::statistics::mean;

/// A factor with more values than this is cut into classes of equal numbers of cells.
const LEVELS_MAX: usize = 12;
/// These classes.
const CLASSES: usize = 6;
/// Levels of a factor: name, position on an axis where it is a number, rows.
pub type Levels = Vec<(String, Option<f64>, Vec<usize>)>;

pub fn figures(table: &Table, name: &str) -> Vec<Option<f64>> {
    match table.column(name).map(|column| &column.values) {
        Some(ColumnValues::Number(all)) => all.clone(),
        _ => vec![None; table.rows],
    }
}

/// Each row's level of a factor, in the order of the levels.
pub fn levels(table: &Table, factor: &str) -> Levels {
    let Some(column) = table.column(factor) else { return Vec::new() };
    let mut found: Vec<(String, Option<f64>, Vec<usize>)> = Vec::new();
    let mut index_of: BTreeMap<String, usize> = BTreeMap::new();
    for row in 0..table.rows {
        let text = column.values.text(row);
        let number = *index_of.entry(text.clone()).or_insert_with(|| {
            found.push((text, column.values.number(row), Vec::new()));
            found.len() - 1
        });
        found[number].2.push(row);
    }
    if found.iter().all(|(_, value, _)| value.is_some()) {
        found.sort_by(|a, b| a.1.unwrap_or(0.0).total_cmp(&b.1.unwrap_or(0.0)));
        if found.len() > LEVELS_MAX {
            return classes(&found);
        }
    }
    found
}

/// Neighbouring values together, in classes of about equal numbers of cells.
fn classes(found: &[(String, Option<f64>, Vec<usize>)]) -> Vec<(String, Option<f64>, Vec<usize>)> {
    let count = found.len();
    (0..CLASSES)
        .map(|class| {
            let part = &found[count * class / CLASSES..count * (class + 1) / CLASSES];
            let values: Vec<f64> = part.iter().filter_map(|(_, value, _)| *value).collect();
            let name = format!("{:.4} to {:.4}", values[0], values[values.len() - 1]);
            (name, Some(mean(&values)), part.iter().flat_map(|(_, _, rows)| rows.clone()).collect())
        })
        .collect()
}

/// Values of rows by everything else in them but one factor.
pub fn by_rest(
    table: &Table,
    factor: &str,
    rows: &[usize],
    value: &dyn Fn(usize) -> Option<f64>,
) -> BTreeMap<String, f64> {
    rows.iter().filter_map(|&row| Some((rest_of(table, factor, row), value(row)?))).collect()
}

/// Everything of a row but one factor and its figures.
fn rest_of(table: &Table, factor: &str, row: usize) -> String {
    let is_kept = |role: Role| matches!(role, Role::Factor | Role::Replicate);
    let kept = table.columns.iter().filter(|column| is_kept(column.role) && column.name != factor);
    kept.map(|column| column.values.text(row)).collect::<Vec<_>>().join("\u{1f}")
}
