//! Row arithmetic that effects share: one value a column, in the unit of the effect's domain.

use crate::simd::{Kernel, dispatch};

/// values += factor * draws.
pub fn add_scaled(values: &mut [f32], draws: &[f32], factor: f32) {
    assert!(values.len() == draws.len(), "a value needs one draw");
    dispatch(AddScaled { values, draws, factor });
}

/// values *= 1 + sigma * pattern.
pub fn scale_by_pattern(values: &mut [f32], pattern: &[f32], sigma: f32) {
    assert!(values.len() == pattern.len(), "a value needs one draw");
    dispatch(ScaleByPattern { values, pattern, sigma });
}

/// values *= factor.
pub fn scale_all(values: &mut [f32], factor: f32) {
    dispatch(ScaleAll { values, factor });
}

/// values += offset.
pub fn add_to_all(values: &mut [f32], offset: f32) {
    dispatch(AddToAll { values, offset });
}

/// Clips values at `most` from above; NaN stays.
pub(super) fn clip_above(values: &mut [f32], most: f32) {
    dispatch(ClipAbove { values, most });
}

struct AddScaled<'a> {
    values: &'a mut [f32],
    draws: &'a [f32],
    factor: f32,
}

impl Kernel for AddScaled<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (value, draw) in self.values.iter_mut().zip(self.draws) {
            *value += self.factor * draw;
        }
    }
}

struct ScaleByPattern<'a> {
    values: &'a mut [f32],
    pattern: &'a [f32],
    sigma: f32,
}

impl Kernel for ScaleByPattern<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for (value, pattern) in self.values.iter_mut().zip(self.pattern) {
            *value *= 1.0 + self.sigma * pattern;
        }
    }
}

struct ScaleAll<'a> {
    values: &'a mut [f32],
    factor: f32,
}

impl Kernel for ScaleAll<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for value in self.values {
            *value *= self.factor;
        }
    }
}

struct AddToAll<'a> {
    values: &'a mut [f32],
    offset: f32,
}

impl Kernel for AddToAll<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for value in self.values {
            *value += self.offset;
        }
    }
}

struct ClipAbove<'a> {
    values: &'a mut [f32],
    most: f32,
}

impl Kernel for ClipAbove<'_> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        for value in self.values {
            *value = if *value > self.most { self.most } else { *value };
        }
    }
}
