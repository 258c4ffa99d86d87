//! Uniform numbers in 0..1 and random unit vectors for the scene's integrals, from keys.

use crate::draw::DrawKey;
use crate::num::{f32_nearest, f64_from_u64, low_u32};
use crate::parallel::collected;

/// Two uniform numbers in 0..1 (32 bits each) of one draw of a key's stream.
#[inline]
pub fn pair(key: DrawKey, draw: u64) -> [f64; 2] {
    let bits = key.with(draw).0;
    [low_u32(bits), low_u32(bits >> 32)].map(|word| (f64_from_u64(word.into()) + 0.5) / 4_294_967_296.0)
}

/// Two unit vectors that form a right-handed frame with a unit normal (Duff et al., "Building an Orthonormal Basis, Revisited", JCGT
/// 6(1), 2017).
pub fn frame(normal: [f32; 3]) -> [[f32; 3]; 2] {
    let [x, y, z] = normal;
    let sign = 1.0_f32.copysign(z);
    let a = -1.0 / (sign + z);
    let b = x * y * a;
    [[1.0 + sign * x * x * a, sign * b, -sign * x], [b, sign + y * y * a, -y]]
}

/// A direction around +z with density cos / pi, from two uniform numbers (Malley's method).
pub fn cosine_direction([along, around]: [f64; 2]) -> [f32; 3] {
    let radius = along.sqrt();
    let (sin, cos) = libm::sincos(2.0 * std::f64::consts::PI * around);
    [radius * cos, radius * sin, (1.0 - along).sqrt()].map(f32_nearest)
}

/// A direction given around +z, turned to stand around a unit normal.
#[inline]
pub fn turned([x, y, z]: [f32; 3], [s, t]: &[[f32; 3]; 2], normal: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|axis| s[axis] * x + t[axis] * y + normal[axis] * z)
}

/// Work on a list in fixed chunks, on all cores where the feature is on; results are in order, independent of scheduling.
pub fn in_chunks<T: Send>(count: usize, chunk: usize, work: impl Fn(std::ops::Range<usize>) -> T + Sync) -> Vec<T> {
    let range = |number: usize| number * chunk..((number + 1) * chunk).min(count);
    collected(count.div_ceil(chunk), |number| work(range(number)))
}
