//! A table with typed columns.

use crate::num::f64_from_i64;
use crate::text::named;
use std::collections::BTreeMap;

/// Values of a column, one a row.
#[derive(Clone, Debug, PartialEq)]
pub enum ColumnValues {
    /// Text.
    Text(Vec<Option<String>>),
    /// Whole numbers.
    Whole(Vec<Option<i64>>),
    /// Numbers.
    Number(Vec<Option<f64>>),
    /// Yes or no.
    Flag(Vec<Option<bool>>),
}

named! {
    /// What a column is for.
    pub enum Role {
        /// Names a row.
        Name = "name",
        /// Is varied.
        Factor = "factor",
        /// Repeats.
        Replicate = "replicate",
        /// A key of the configuration that differs between cells.
        Config = "config",
        /// A result.
        Figure = "figure",
    }
}

/// One column.
#[derive(Clone, Debug, PartialEq)]
pub struct TableColumn {
    /// Its name.
    pub name: String,
    /// Its unit; "" where it has none to state.
    pub unit: String,
    /// What it is for.
    pub role: Role,
    /// One value per row.
    pub values: ColumnValues,
}

/// A gathered sweep.
#[derive(Clone, Debug, PartialEq)]
pub struct Table {
    /// In the order of the file.
    pub columns: Vec<TableColumn>,
    /// Number of rows.
    pub rows: usize,
    /// Of the whole file, by name.
    pub metadata: BTreeMap<String, String>,
}

impl ColumnValues {
    pub(super) fn kind(&self) -> &'static str {
        match self {
            Self::Text(_) => "string",
            Self::Whole(_) => "int64",
            Self::Number(_) => "double",
            Self::Flag(_) => "boolean",
        }
    }

    /// A row's value as text; empty where there is none. Numbers have their shortest exact form.
    pub fn text(&self, row: usize) -> String {
        match self {
            Self::Text(all) => all[row].clone().unwrap_or_default(),
            Self::Whole(all) => all[row].map_or_else(String::new, |value| value.to_string()),
            Self::Number(all) => all[row].map_or_else(String::new, |value| format!("{value:?}")),
            Self::Flag(all) => all[row].map_or_else(String::new, |value| value.to_string()),
        }
    }

    /// A row's value as a number, where it is one.
    pub fn number(&self, row: usize) -> Option<f64> {
        match self {
            Self::Whole(all) => all[row].map(f64_from_i64),
            Self::Number(all) => all[row],
            Self::Text(_) | Self::Flag(_) => None,
        }
    }
}
