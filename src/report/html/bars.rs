//! Horizontal bars as a table, so that they are read by eye, by screen reader and at any width.

use crate::num::{greater, lesser};
use crate::report::html::text::escaped;

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
pub(super) fn bars(caption: &str, bars: &[Bar]) -> String {
    let end = |bar: &Bar| bar.whisker.map_or(bar.value, |(_, high)| greater(bar.value, high));
    let full = bars.iter().map(end).fold(0.0, greater);
    let percent = |value: f64| if full > 0.0 { lesser(100.0 * value / full, 100.0) } else { 0.0 };
    let mut html = format!("<table class=\"bars\"><caption>{}</caption><tbody>", escaped(caption));
    for bar in bars {
        let length = percent(bar.value);
        html += &format!("<tr><th scope=\"row\">{}</th><td><div class=\"bar\">", escaped(&bar.label));
        html += &format!("<i style=\"width:{length:.2}%\"></i>");
        if let Some((low, high)) = bar.whisker {
            let (left, right) = (percent(low), percent(high));
            html += &format!("<b style=\"left:{left:.2}%;width:{:.2}%\"></b>", right - left);
        }
        html += &format!("</div></td><td class=\"num\">{}</td></tr>", escaped(&bar.text));
    }
    html.push_str("</tbody></table>");
    html
}
