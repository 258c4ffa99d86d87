//! Many runs: a design space as cells, each cell's figures, and what all figures together say. It touches no disk.

pub mod cells;
pub mod design;
mod digits;
pub mod file;
pub mod gather;
mod html;
pub mod interaction;
mod levels;
mod parquet;
pub mod picture;
pub mod record;
pub mod report;
pub mod signal;
pub mod specification;
mod table;
mod verdicts;

pub use cells::{Cell, Cells, SOURCES};
pub use file::SweepFile;
pub use record::CellRecord;
