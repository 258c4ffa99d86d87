//! Row arithmetic that effects share: one value per column, in the unit of the effect's domain.

use crate::simd::kernel;

kernel! {
    /// values += factor * draws.
    pub fn add_scaled<'a>(values: &'a mut [f32], draws: &'a [f32], factor: f32) {
        assert!(values.len() == draws.len(), "a value needs one draw");
        for (value, draw) in values.iter_mut().zip(draws) {
            *value += factor * draw;
        }
    }
}

kernel! {
    /// values *= 1 + sigma * pattern.
    pub fn scale_by_pattern<'a>(values: &'a mut [f32], pattern: &'a [f32], sigma: f32) {
        assert!(values.len() == pattern.len(), "a value needs one draw");
        for (value, pattern) in values.iter_mut().zip(pattern) {
            *value *= 1.0 + sigma * pattern;
        }
    }
}

kernel! {
    /// values *= factor.
    pub fn scale_all<'a>(values: &'a mut [f32], factor: f32) {
        for value in values {
            *value *= factor;
        }
    }
}

kernel! {
    /// values += offset.
    pub fn add_to_all<'a>(values: &'a mut [f32], offset: f32) {
        for value in values {
            *value += offset;
        }
    }
}

kernel! {
    /// Clips values at `most` from above; NaN stays.
    pub(super) fn clip_above<'a>(values: &'a mut [f32], most: f32) {
        for value in values {
            *value = if *value > most { most } else { *value };
        }
    }
}
