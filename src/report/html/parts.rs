//! What pages share: the document, its sections and tables, and the pictures that a report shows.

use maud::{DOCTYPE, Markup, PreEscaped, Render, html};

use super::super::record::Report;
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

/// A whole page in the reports' style.
pub(crate) fn document(title: &str, body: Markup) -> Markup {
    html! {
        (DOCTYPE)
        html lang="en" {
            head {
                meta charset="utf-8";
                meta name="viewport" content="width=device-width, initial-scale=1";
                title { (title) }
                (style(include_str!("style.css")))
            }
            body { (body) }
        }
    }
}

/// A style sheet inside the page. Not escaped, since browsers decode no character references in it; must not contain `</style`.
pub(crate) fn style(css: &str) -> Markup {
    html! { style { (PreEscaped(css)) } }
}

/// A script inside the page. Not escaped, for the same reason; must not contain `</script`.
pub(crate) fn script(code: &str) -> Markup {
    html! { script { (PreEscaped(code)) } }
}

/// A section with its heading and a sentence that says what it shows.
pub(crate) fn section(heading: &str, lead: &str, content: Markup) -> Markup {
    html! { section { h2 { (heading) } p.soft { (lead) } (content) } }
}

/// Two parts side by side where the screen is wide enough.
pub(crate) fn pair(left: Markup, right: Markup) -> Markup {
    html! { div.pair { (left) (right) } }
}

/// Head of a column.
pub(super) enum Head<'a> {
    Text(&'a str),
    /// Aligned with numbers below it.
    Number(&'a str),
    Nameless,
}

impl Render for Head<'_> {
    fn render(&self) -> Markup {
        match self {
            Self::Text(name) => html! { th scope="col" { (name) } },
            Self::Number(name) => html! { th.num scope="col" { (name) } },
            Self::Nameless => html! { td {} },
        }
    }
}

/// A table that scrolls where the page is too narrow.
pub(super) struct Table<'a> {
    /// For screen readers.
    pub label: Option<&'a str>,
    pub class: Option<&'a str>,
    pub heads: &'a [Head<'a>],
    pub rows: Markup,
}

impl Render for Table<'_> {
    fn render(&self) -> Markup {
        html! {
            div.scroll tabindex="0" role=[self.label.map(|_| "region")] aria-label=[self.label] {
                table class=[self.class] {
                    thead { tr { @for head in self.heads { (head) } } }
                    tbody { (self.rows) }
                }
            }
        }
    }
}

/// A table without label and class.
pub(super) fn table(heads: &[Head<'_>], rows: Markup) -> Markup {
    Table { label: None, class: None, heads, rows }.render()
}

/// A paragraph with the reason why a figure has no value, if there is one.
pub(super) fn reason(report: &Report, path: &str) -> Markup {
    html! {
        @if let Some(reason) = report.not_measurable.get(path) {
            p.note { "Not measured: " (reason) "." }
        }
    }
}
