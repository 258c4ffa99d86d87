//! Horizontal bars as a table, so that they are read by eye, by screen reader and at any width.

use std::fmt::Write as _;

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

/// All bars share one linear scale from 0 to the greatest value or whisker.
pub(super) fn bars(caption: &str, bars: &[Bar]) -> String {
    let end = |bar: &Bar| bar.whisker.map_or(bar.value, |(_, high)| greater(bar.value, high));
    let full = bars.iter().map(end).fold(0.0, greater);
    let percent = |value: f64| if full > 0.0 { lesser(100.0 * value / full, 100.0) } else { 0.0 };
    let mut html = format!("<table class=\"bars\"><caption>{}</caption><tbody>", escaped(caption));
    for bar in bars {
        let length = percent(bar.value);
        write!(html, "<tr><th scope=\"row\">{}</th><td><div class=\"bar\">", escaped(&bar.label))
            .expect(super::parts::TEXT);
        write!(html, "<i style=\"width:{length:.2}%\"></i>").expect(super::parts::TEXT);
        if let Some((low, high)) = bar.whisker {
            let (left, right) = (percent(low), percent(high));
            write!(html, "<b style=\"left:{left:.2}%;width:{:.2}%\"></b>", right - left).expect(super::parts::TEXT);
        }
        write!(html, "</div></td><td class=\"num\">{}</td></tr>", escaped(&bar.text)).expect(super::parts::TEXT);
    }
    html.push_str("</tbody></table>");
    html
}
