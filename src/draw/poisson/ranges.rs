//! Ranges of the mean in which each way of computing a Poisson quantile is used.

/// The bits of a float as an integer: among positive floats the same order; negative ones stay below zero, and a positive NaN lies
/// above infinity.
#[inline(always)]
pub(super) const fn ordered(value: f32) -> i32 {
    value.to_bits().cast_signed()
}

/// Means from here on are served by the series, lower ones by summation.
pub(super) const SERIES_MEAN_MIN: f32 = 5.0;
/// Blocks whose means all lie from here on do with fewer terms.
pub(super) const BRIGHT_MEAN_MIN: f32 = 256.0;
/// Means from here on leave the range in which adding 1.5 * 2^23 rounds to an integer, and go to f64 one by one.
pub(super) const SERIES_MEAN_MAX: f32 = 4_194_304.0;

/// Adding and subtracting 1.5 * 2^23 rounds |x| <= 2^22 to the nearest integer without a cast.
pub(super) const ROUNDER: f32 = 12_582_912.0;
