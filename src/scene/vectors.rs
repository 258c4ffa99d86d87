//! Products, lengths and normals of vectors with three coordinates.

use crate::num::f32_nearest;

/// Scalar product.
#[inline(always)]
pub fn dot(a: [f32; 3], b: [f32; 3]) -> f32 {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Difference.
#[inline(always)]
pub fn sub(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// A direction as a mirror of a unit normal reflects it.
#[inline]
pub fn mirrored(direction: [f32; 3], normal: [f32; 3]) -> [f32; 3] {
    let along = 2.0 * dot(direction, normal);
    sub(direction, [along * normal[0], along * normal[1], along * normal[2]])
}

/// Mean of three values with these weights.
#[inline(always)]
pub fn weighted<const N: usize>([a, b, c]: [[f32; N]; 3], weights: [f32; 3]) -> [f32; N] {
    std::array::from_fn(|k| a[k] * weights[0] + b[k] * weights[1] + c[k] * weights[2])
}

/// Vector product.
#[inline]
pub fn cross(a: [f32; 3], b: [f32; 3]) -> [f32; 3] {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// Unit vector along a vector, none for one that is zero or not finite.
#[inline]
pub fn unit([x, y, z]: [f32; 3]) -> Option<[f32; 3]> {
    let (x, y, z) = (f64::from(x), f64::from(y), f64::from(z));
    let length = (x * x + y * y + z * z).sqrt();
    let is_known = length.is_finite() && length > 0.0;
    is_known.then(|| [f32_nearest(x / length), f32_nearest(y / length), f32_nearest(z / length)])
}

/// Unit normal of a triangle, none without area.
pub fn unit_normal(corners_m: [[f32; 3]; 3]) -> Option<[f32; 3]> {
    let [a, b, c] = corners_m;
    let normal = cross(sub(b, a), sub(c, a));
    // Below this the area is under 1e-18 m^2 and the direction mostly rounding.
    (dot(normal, normal) > 1e-36).then(|| unit(normal)).flatten()
}

/// Area of a triangle in square metres.
pub fn area_m2(corners_m: [[f32; 3]; 3]) -> f32 {
    let [a, b, c] = corners_m;
    let normal = cross(sub(b, a), sub(c, a));
    0.5 * dot(normal, normal).sqrt()
}
