//! Formats values for the page: three significant digits and a readable unit.

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

/// Two significant digits, for values that hang on a constant that is known to a factor only.
pub(super) fn rough(value: f64) -> String {
    let size = value.abs();
    if !(size > 0.0) {
        return digits(value);
    }
    let rounded = two_digits(value);
    match rounded.abs() {
        tiny if tiny < 0.000_999_5 => format!("{rounded:.1e}"),
        small if small < 0.009_95 => format!("{rounded:.4}"),
        small if small < 0.0995 => format!("{rounded:.3}"),
        low if low < 0.995 => format!("{rounded:.2}"),
        low if low < 9.95 => format!("{rounded:.1}"),
        _ => grouped(rounded),
    }
}

/// As `rough`, where the value may be off by this factor of 2 or more each way; three digits otherwise.
pub(super) fn digits_within(value: f64, factor: f64) -> String {
    if factor >= 2.0 { rough(value) } else { digits(value) }
}

/// "1.2 mW" with as many digits as the factor allows.
pub(super) fn si_within(value: f64, unit: &str, factor: f64) -> String {
    let (number, unit) = si_parts(if factor >= 2.0 { two_digits(value) } else { value }, unit);
    let number = if factor >= 2.0 { number.parse().map_or(number.clone(), rough) } else { number };
    format!("{number}\u{a0}{unit}")
}

fn two_digits(value: f64) -> f64 {
    if value == 0.0 {
        return 0.0;
    }
    let unit = libm::pow(10.0, libm::floor(libm::log10(value.abs())) - 1.0);
    (value / unit).round_ties_even() * unit
}

/// A whole number with thin spaces between groups of three digits.
pub(super) fn grouped(value: f64) -> String {
    let plain = format!("{:.0}", value.abs());
    let mut text = String::from(if value < 0.0 { "\u{2212}" } else { "" });
    for (at, digit) in plain.chars().enumerate() {
        // Four digits read well as they are.
        if at > 0 && plain.len() > 4 && (plain.len() - at) % 3 == 0 {
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
    fn what_is_known_to_a_factor_has_two_digits() {
        for (value, text) in [
            (4.567, "4.6"),
            (45.67, "46"),
            (456.7, "460"),
            (0.0456, "0.046"),
            (9.97, "10"),
            (0.0, "0"),
            (-1.26, "-1.3"),
        ] {
            assert_eq!(rough(value), text, "{value}");
        }
        assert_eq!((digits_within(4.567, 1.5), digits_within(4.567, 2.0)), ("4.57".to_owned(), "4.6".to_owned()));
        assert_eq!(si_within(4.567e-5, "J", 3.0), "46\u{a0}\u{b5}J");
        assert_eq!(si_within(4.567e-4, "J", 3.0), "460\u{a0}\u{b5}J");
    }

    #[test]
    fn long_numbers_are_grouped() {
        assert_eq!(grouped(1234.0), "1234");
        assert_eq!(grouped(1_234_567.0), "1\u{202f}234\u{202f}567");
        assert_eq!(percent(1.0), "100\u{a0}%");
        assert_eq!(percent(0.9987), "99.9\u{a0}%");
    }
}
