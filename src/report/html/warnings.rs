//! Warnings of the run, above all figures.

use maud::{Markup, html};

use super::parts::section;
use crate::report::record::Report;

/// A section with one item a warning; empty without any.
pub(super) fn warnings(report: &Report) -> Markup {
    if report.warnings.is_empty() {
        return Markup::default();
    }
    let list = html! { ul { @for warning in &report.warnings { li { (warning) } } } };
    section("Warnings", "The run went on; check these before you use its figures.", list)
}
