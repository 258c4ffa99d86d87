//! Figures as a person reads them.

/// Three significant digits, or a whole number.
pub fn digits(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 {
        "0".to_owned()
    } else if (1e-3..1e6).contains(&size) {
        let decimals = if size >= 100.0 {
            1
        } else if size >= 1.0 {
            3
        } else {
            5
        };
        format!("{value:.decimals$}")
    } else {
        format!("{value:.3e}")
    }
}
