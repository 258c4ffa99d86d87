//! Horizontal bars as a table, so that they are read by eye, by screen reader and at any width.

use maud::{Markup, html};

use crate::num::{greater, lesser};

pub(super) struct Bar {
    pub label: String,
    /// Its length, any unit, at least 0.
    pub value: f64,
    /// Ends of the uncertainty whisker, in the same unit.
    pub whisker: Option<(f64, f64)>,
    /// The value in words.
    pub text: String,
}

impl Bar {
    /// A bar without a whisker.
    pub fn new(label: &str, value: f64, text: String) -> Self {
        Self { label: label.to_owned(), value, whisker: None, text }
    }
}

/// All bars share one linear scale from 0 to the greatest value or whisker.
pub(super) fn bars(caption: &str, bars: &[Bar]) -> Markup {
    let end = |bar: &Bar| bar.whisker.map_or(bar.value, |(_, high)| greater(bar.value, high));
    let full = bars.iter().map(end).fold(0.0, greater);
    let percent = |value: f64| if full > 0.0 { lesser(100.0 * value / full, 100.0) } else { 0.0 };
    let whisker = |(low, high): (f64, f64)| {
        let (left, right) = (percent(low), percent(high));
        format!("left:{left:.2}%;width:{:.2}%", right - left)
    };
    html! {
        table.bars {
            caption { (caption) }
            tbody {
                @for bar in bars {
                    tr {
                        th scope="row" { (bar.label) }
                        td {
                            div.bar {
                                i style=(format!("width:{:.2}%", percent(bar.value))) {}
                                @if let Some(ends) = bar.whisker { b style=(whisker(ends)) {} }
                            }
                        }
                        td.num { (bar.text) }
                    }
                }
            }
        }
    }
}
