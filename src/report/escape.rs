//! Escapes text for pictures that are written as SVG of their own. Pages escape by their templates.

/// Text that is safe between tags and in quoted attributes.
pub(crate) fn escaped(text: &str) -> String {
    let mut safe = String::with_capacity(text.len());
    for letter in text.chars() {
        match letter {
            '&' => safe.push_str("&amp;"),
            '<' => safe.push_str("&lt;"),
            '>' => safe.push_str("&gt;"),
            '"' => safe.push_str("&quot;"),
            '\'' => safe.push_str("&#39;"),
            other => safe.push(other),
        }
    }
    safe
}

/// Adds a line of text to an SVG; `class` sets how it looks and where it is anchored.
pub(crate) fn svg_text(svg: &mut String, x_px: f64, y_px: f64, class: &str, words: &str) {
    *svg += &format!("<text x=\"{x_px:.1}\" y=\"{y_px:.1}\" class=\"{class}\">{}</text>\n", escaped(words));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn markup_in_names_stays_text() {
        assert_eq!(escaped("<a href=\"x\">&'"), "&lt;a href=&quot;x&quot;&gt;&amp;&#39;");
    }
}
