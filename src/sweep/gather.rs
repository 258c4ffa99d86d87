//! All cells as one table: factors, replicates, configuration, figures. The same bytes whichever way the cells ran.

use std::collections::BTreeMap;

use serde_json::json;
use toml::Value;

use super::cells::{Cell, Cells, shown};
use super::parquet;
use super::record::{CellRecord, unit_of};
pub use super::table::{ColumnValues, Role, Table, TableColumn};
use crate::error::Error;
use crate::num::f64_from_i64;

impl Table {
    /// The table of those cells that have a record, in the order of the sweep.
    pub fn new(cells: &Cells, records: &BTreeMap<String, CellRecord>, sweep_text: &str) -> Self {
        let rows: Vec<(&Cell, &CellRecord)> =
            cells.cells.iter().filter_map(|cell| Some((cell, records.get(&cell.name)?))).collect();
        let text =
            |of: &dyn Fn(&(&Cell, &CellRecord)) -> Option<String>| ColumnValues::Text(rows.iter().map(of).collect());
        let mut columns = vec![
            column("cell", Role::Name, text(&|(cell, _)| Some(cell.name.clone()))),
            column("status", Role::Name, text(&|(_, record)| Some(status(record).to_owned()))),
        ];
        for (number, name) in cells.factors.iter().enumerate() {
            let values: Vec<Option<Value>> = rows.iter().map(|(cell, _)| cell.shown.get(number).cloned()).collect();
            columns.push(column(name, Role::Factor, typed(&values)));
        }
        if cells.cells.iter().any(|cell| cell.trajectory.is_some()) {
            columns.push(column("trajectory", Role::Replicate, text(&|(cell, _)| cell.trajectory.clone())));
        }
        let whole = |of: &dyn Fn(&Cell) -> Option<u64>| {
            ColumnValues::Whole(
                rows.iter().map(|(cell, _)| of(cell).and_then(|number| i64::try_from(number).ok())).collect(),
            )
        };
        for (name, of) in [("die", (|cell| cell.die) as fn(&Cell) -> Option<u64>), ("seed", |cell| cell.seed)] {
            if cells.cells.iter().any(|cell| of(cell).is_some()) {
                columns.push(column(name, Role::Replicate, whole(&of)));
            }
        }
        columns.extend(config_columns(&rows));
        columns.extend(figure_columns(&rows));
        let described: Vec<_> = columns
            .iter()
            .map(|column| json!({"name": column.name, "unit": column.unit, "role": column.role.name(), "type": column.values.kind()}))
            .collect();
        let metadata = BTreeMap::from([
            ("sensel.columns".to_owned(), json!(described).to_string()),
            ("sensel.version".to_owned(), env!("CARGO_PKG_VERSION").to_owned()),
            ("sensel.sources".to_owned(), super::cells::SOURCES.to_owned()),
            ("sensel.sweep".to_owned(), sweep_text.to_owned()),
            ("sensel.scenario".to_owned(), cells.shared().recorded_text()),
        ]);
        Self { rows: rows.len(), columns, metadata }
    }

    /// A column by its name.
    pub fn column(&self, name: &str) -> Option<&TableColumn> {
        self.columns.iter().find(|column| column.name == name)
    }

    /// As a Parquet file.
    pub fn to_parquet(&self) -> Result<Vec<u8>, Error> {
        parquet::bytes(self).map_err(|error| Error::Run(format!("the Parquet file cannot be made: {error}")))
    }

    /// As CSV (RFC 4180 with line feeds): names, then a line a cell. What is not there is empty.
    pub fn to_csv(&self) -> String {
        let mut text = self.columns.iter().map(|column| quoted(&column.name)).collect::<Vec<_>>().join(",");
        text.push('\n');
        for row in 0..self.rows {
            let fields: Vec<String> = self.columns.iter().map(|column| quoted(&column.values.text(row))).collect();
            text.push_str(&fields.join(","));
            text.push('\n');
        }
        text
    }
}

fn column(name: &str, role: Role, values: ColumnValues) -> TableColumn {
    let unit = if matches!(values, ColumnValues::Number(_) | ColumnValues::Whole(_)) { unit_of(name) } else { "" };
    TableColumn { name: name.to_owned(), unit: unit.to_owned(), role, values }
}

fn status(record: &CellRecord) -> &'static str {
    if record.error.is_some() { "failed" } else { "done" }
}

fn quoted(field: &str) -> String {
    if field.contains([',', '"', '\n', '\r']) {
        format!("\"{}\"", field.replace('"', "\"\""))
    } else {
        field.to_owned()
    }
}

/// The narrowest type that holds all values.
fn typed(values: &[Option<Value>]) -> ColumnValues {
    let all = |is: fn(&Value) -> bool| values.iter().flatten().all(is);
    if all(Value::is_bool) {
        return ColumnValues::Flag(values.iter().map(|value| value.as_ref()?.as_bool()).collect());
    }
    if all(Value::is_integer) {
        return ColumnValues::Whole(values.iter().map(|value| value.as_ref()?.as_integer()).collect());
    }
    if all(|value| value.is_integer() || value.is_float()) {
        let number = |value: &Value| value.as_float().or_else(|| value.as_integer().map(f64_from_i64));
        return ColumnValues::Number(values.iter().map(|value| number(value.as_ref()?)).collect());
    }
    ColumnValues::Text(values.iter().map(|value| value.as_ref().map(shown)).collect())
}

/// Keys that some cell sets: seed and die stand in columns of their own.
fn config_columns(rows: &[(&Cell, &CellRecord)]) -> Vec<TableColumn> {
    let mut by_key: BTreeMap<&str, Vec<Option<Value>>> = BTreeMap::new();
    for (row, (cell, _)) in rows.iter().enumerate() {
        for (key, value) in &cell.set {
            by_key.entry(key).or_insert_with(|| vec![None; rows.len()])[row] = Some(value.clone());
        }
    }
    let is_own = |key: &str| matches!(key, "seed" | "sensor.die");
    by_key
        .into_iter()
        .filter(|(key, _)| !is_own(key))
        .map(|(key, values)| column(&format!("config.{key}"), Role::Config, typed(&values)))
        .collect()
}

fn figure_columns(rows: &[(&Cell, &CellRecord)]) -> Vec<TableColumn> {
    let names: std::collections::BTreeSet<&String> =
        rows.iter().flat_map(|(_, record)| record.figures.keys()).collect();
    names
        .into_iter()
        .map(|name| {
            let values = rows.iter().map(|(_, record)| record.figures.get(name).copied().flatten()).collect();
            column(name, Role::Figure, ColumnValues::Number(values))
        })
        .collect()
}
