//! Scalar coefficients of the Jacobians of rotations, as functions of the squared angle in rad^2.
//!
//! Below [`SERIES_ANGLE_RAD_MAX`] they are Taylor series, whose first dropped term is under 2^-53 of the first; above
//! it the closed forms, which cancel least where the angle is greatest.

/// The seam between series and closed forms, in radians. Just above it the worst closed form, `(a - sin a) / a^3`, keeps 0.16 of terms of
/// 1, so its relative error is some ten times 2^-53 = 1e-15, falling with a^-3.
pub const SERIES_ANGLE_RAD_MAX: f64 = 1.0;

/// Terms of a series: at the seam the first dropped one is below 1 / (17! / 6), 2e-14 of 2^-53 and less.
const TERMS: u32 = 10;

/// `(1 - cos a) / a^2`.
pub(super) fn versine(angle2: f64) -> f64 {
    if in_series(angle2) {
        return 0.5 * alternating(angle2, 2);
    }
    let half_sine = libm::sin(0.5 * angle2.sqrt());
    2.0 * half_sine * half_sine / angle2
}

/// `(a - sin a) / a^3`.
pub(super) fn lag(angle2: f64) -> f64 {
    if in_series(angle2) {
        return alternating(angle2, 3) / 6.0;
    }
    let angle = angle2.sqrt();
    (angle - libm::sin(angle)) / (angle2 * angle)
}

/// `(1 - (a / 2) cot(a / 2)) / a^2`, finite up to a full turn.
pub(super) fn cotangent(angle2: f64) -> f64 {
    if in_series(angle2) {
        // |B_2k| / (2k)! for k = 1..10; each is 1 / (4 pi^2) of the one before, so the first dropped one is 1e-16 of
        // the first.
        const C: [f64; 10] = [
            1.0 / 12.0,
            1.0 / 720.0,
            1.0 / 30_240.0,
            1.0 / 1_209_600.0,
            1.0 / 47_900_160.0,
            691.0 / 1_307_674_368_000.0,
            1.0 / 74_724_249_600.0,
            3_617.0 / 10_670_622_842_880_000.0,
            43_867.0 / 5_109_094_217_170_944_000.0,
            174_611.0 / 802_857_662_698_291_200_000.0,
        ];
        return C.iter().rev().fold(0.0, |sum, c| sum * angle2 + c);
    }
    let half = 0.5 * angle2.sqrt();
    (1.0 - half * libm::cos(half) / libm::sin(half)) / angle2
}

pub(super) fn in_series(angle2: f64) -> bool {
    angle2 < SERIES_ANGLE_RAD_MAX * SERIES_ANGLE_RAD_MAX
}

/// Sum over k of (-1)^k x^k n! / (n + 2k)!, from the inside out.
fn alternating(x: f64, n: u32) -> f64 {
    let mut sum = 1.0;
    for k in (0..TERMS).rev() {
        let above = f64::from(n + 2 * k);
        sum = 1.0 - x / ((above + 1.0) * (above + 2.0)) * sum;
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn series_and_closed_forms_agree_across_the_seam() {
        let functions: [fn(f64) -> f64; 3] = [versine, lag, cotangent];
        let (mut below, mut above) = (0, 0);
        for (number, function) in functions.iter().enumerate() {
            for step in 1..2_000_u32 {
                let gap = f64::from(step) * 1e-7;
                let (left, right) = (function(1.0 - gap), function(1.0 + gap));
                // The functions bend by less than 0.01 of their value over 1 rad^4, so their middle is the value at the
                // seam to 0.01 gap^2 < 4e-10 * gap; 2e-14 is more than the closed form's error, taken twice.
                let middle = 0.5 * (left + right);
                let at = function(1.0);
                assert!(
                    (middle / at - 1.0).abs() < 4e-14 + 0.1 * gap * gap,
                    "function {number}, gap {gap}: {middle} for {at}"
                );
                below += u32::from(in_series(1.0 - gap));
                above += u32::from(!in_series(1.0 + gap));
            }
        }
        assert_eq!((below, above), (3 * 1_999, 3 * 1_999));
    }
}
