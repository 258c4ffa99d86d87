//! Many runs: a design space as cells, each cell's figures, and what all figures together say. It touches no disk.

pub mod cells;
pub mod design;
pub mod file;
pub mod gather;
mod html;
pub mod interaction;
mod parquet;
pub mod picture;
pub mod record;
pub mod report;
pub mod signal;
pub mod specification;
pub mod statistics;

pub use cells::{Cell, Cells};
pub use file::SweepFile;
pub use record::CellRecord;

/// Fingerprint of the code that decides a figure.
pub const SOURCES: &str = env!("SENSEL_FIGURE_SOURCES");
