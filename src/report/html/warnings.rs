//! Warnings of the run, above all figures.

use super::parts::section;
use crate::report::html::text::escaped;
use crate::report::record::Report;

/// A section with one item a warning; empty without any.
pub(super) fn warnings(report: &Report) -> String {
    if report.warnings.is_empty() {
        return String::new();
    }
    let items: String = report.warnings.iter().map(|text| format!("<li>{}</li>", escaped(text))).collect();
    section("Warnings", "The run went on; check these before you use its figures.", &format!("<ul>{items}</ul>"))
}
