//! What all sections of the report share: their heading, colours, and the pictures they show.

use super::super::record::Report;
use super::text::escaped;
use crate::plane::Plane;

/// Frames to show.
#[derive(Clone, Debug, Default)]
pub struct FramePictures {
    /// In the order of the page; three to six look best.
    pub strip: Vec<FramePicture>,
    /// A picture of a row's conversions beside the page, by its relative path.
    pub waves: Option<String>,
}

/// One frame of a sensor with what was found in it.
#[derive(Clone, Debug)]
pub struct FramePicture {
    /// Codes brought to 8 bits.
    pub values: Plane<u8>,
    /// For a person: camera, frame and time.
    pub caption: String,
    /// Drawn over the frame.
    pub marks: Vec<Mark>,
}

/// A feature of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Mark {
    /// Column; pixel centres are integers.
    pub x_px: f64,
    /// Row; pixel centres are integers.
    pub y_px: f64,
    /// Whether the tracker used it.
    pub tracked: bool,
}

/// A section with its heading and a sentence that says what it shows.
pub(super) fn section(heading: &str, lead: &str, content: &str) -> String {
    format!("<section><h2>{}</h2><p class=\"soft\">{}</p>{content}</section>", escaped(heading), escaped(lead))
}

/// A table that scrolls where the page is too narrow. `heads` are its columns with | between, those of numbers with # in front, one
/// without a name empty; `label` is for screen readers. Label and class may be empty.
pub(super) fn table(label: &str, class: &str, heads: &str, rows: &str) -> String {
    let head = |name: &str| match name.strip_prefix('#') {
        Some(name) => format!("<th scope=\"col\" class=\"num\">{name}</th>"),
        None if name.is_empty() => "<td></td>".to_owned(),
        None => format!("<th scope=\"col\">{name}</th>"),
    };
    let heads: String = heads.split('|').map(head).collect();
    let region = if label.is_empty() { String::new() } else { format!(" role=\"region\" aria-label=\"{label}\"") };
    let class = if class.is_empty() { String::new() } else { format!(" class=\"{class}\"") };
    format!(
        "<div class=\"scroll\" tabindex=\"0\"{region}><table{class}><thead><tr>{heads}</tr></thead><tbody>{rows}</tbody></table></div>"
    )
}

/// A paragraph with the reason why a figure has no value, if there is one.
pub(super) fn reason(report: &Report, path: &str) -> String {
    match report.not_measurable.get(path) {
        Some(reason) => format!("<p class=\"note\">Not measured: {}.</p>", escaped(reason)),
        None => String::new(),
    }
}
