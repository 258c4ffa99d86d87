//! What a person reads: pose error, bits, joules, latency, and what the simulation cost in time.
//!
//! Computes figures from true and estimated poses, counts, times and the plan of a run, and writes `report.json` and
//! (feature `cli`) one self-contained page. It never reads a clock or a file and never simulates.

pub mod align;
pub mod alternatives_record;
pub mod associate;
pub mod bootstrap;
pub mod cameras_alone;
#[cfg(feature = "cli")]
pub(crate) mod chart;
pub mod compare;
pub mod display;
pub mod energy_record;
pub(crate) mod escape;
pub mod figures;
pub mod gates_record;
#[cfg(feature = "cli")]
pub mod html;
mod json;
#[cfg(feature = "cli")]
pub mod ladder_picture;
pub mod ladder_record;
pub mod latency_record;
pub mod link_record;
mod measurable;
pub mod ordered;
pub mod plan_record;
pub mod pose_series;
pub mod record;
pub mod spread;
pub mod timing_diagram;
pub mod tracking_record;

pub use display::display_curve;
pub use figures::{TrajectoryFigures, median, prediction_error_m, trajectory_figures};
pub use measurable::{Figure, NotMeasurable};
pub use ordered::Ordered;
pub use record::Report;
