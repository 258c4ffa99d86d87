//! Words and numbers of the page. Enters: values. Leaves: escaped text, three significant digits, a unit that reads
//! well.

pub(super) use crate::report::escape::escaped;

/// Factors with their prefixes, the greatest first.
const PREFIXES: [(f64, &str); 9] = [
    (1e12, "T"),
    (1e9, "G"),
    (1e6, "M"),
    (1e3, "k"),
    (1.0, ""),
    (1e-3, "m"),
    (1e-6, "\u{b5}"),
    (1e-9, "n"),
    (1e-12, "p"),
];

/// Number and prefixed unit, apart, so that the page can set them in different sizes.
pub(super) fn si_parts(value: f64, unit: &str) -> (String, String) {
    // Half a unit of the third digit below a power of ten already rounds up to it.
    let fits = |(factor, _): &&(f64, &str)| value.abs() >= factor * 0.9995;
    let (factor, prefix) = match PREFIXES.iter().find(fits) {
        Some(&found) => found,
        None if value == 0.0 => (1.0, ""),
        None => (1e-12, "p"),
    };
    (digits(value / factor), format!("{prefix}{unit}"))
}

/// "12.3 mm" of 0.0123 and "m".
pub(super) fn si(value: f64, unit: &str) -> String {
    let (number, unit) = si_parts(value, unit);
    format!("{number}\u{a0}{unit}")
}

/// Three significant digits without an exponent, for numbers from a thousandth up; smaller ones get an exponent.
pub(super) fn digits(value: f64) -> String {
    match value.abs() {
        0.0 => "0".to_owned(),
        size if size < 0.000_999_5 => format!("{value:.1e}"),
        size if size < 0.009_995 => format!("{value:.5}"),
        size if size < 0.099_95 => format!("{value:.4}"),
        size if size < 0.999_5 => format!("{value:.3}"),
        size if size < 9.995 => format!("{value:.2}"),
        size if size < 99.95 => format!("{value:.1}"),
        _ => grouped(value),
    }
}

/// A whole number with thin spaces between groups of three digits.
pub(super) fn grouped(value: f64) -> String {
    let plain = format!("{:.0}", value.abs());
    let mut text = String::from(if value < 0.0 { "\u{2212}" } else { "" });
    for (place, digit) in plain.chars().enumerate() {
        // Four digits read well as they are.
        if place > 0 && plain.len() > 4 && (plain.len() - place) % 3 == 0 {
            text.push('\u{202f}');
        }
        text.push(digit);
    }
    text
}

/// "98.7 %" of 0.987; a whole is "100 %".
pub(super) fn percent(share: f64) -> String {
    let number = 100.0 * share;
    if number == 0.0 || number >= 99.95 { format!("{number:.0}\u{a0}%") } else { format!("{number:.1}\u{a0}%") }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn numbers_read_well_at_any_size() {
        for (value, text) in [
            (0.0123, "12.3\u{a0}mm"),
            (0.000_999_6, "1.00\u{a0}mm"),
            (0.0, "0\u{a0}m"),
            (1234.0, "1.23\u{a0}km"),
            (3.21e-5, "32.1\u{a0}\u{b5}m"),
            (-0.5, "-500\u{a0}mm"),
            (2e-15, "0.00200\u{a0}pm"),
        ] {
            assert_eq!(si(value, "m").replace('\u{2212}', "-"), text, "{value}");
        }
    }

    #[test]
    fn long_numbers_are_grouped() {
        assert_eq!(grouped(1234.0), "1234");
        assert_eq!(grouped(1_234_567.0), "1\u{202f}234\u{202f}567");
        assert_eq!(percent(1.0), "100\u{a0}%");
        assert_eq!(percent(0.9987), "99.9\u{a0}%");
    }

    #[test]
    fn markup_in_names_stays_text() {
        assert_eq!(escaped("<a href=\"x\">&'"), "&lt;a href=&quot;x&quot;&gt;&amp;&#39;");
    }
}
