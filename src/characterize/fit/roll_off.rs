//! The roll-off of a lens from flat frames: bright and dark stacks behind the lens, before an even source.
//!
//! The signal, in 24 rings of equal area about the middle of the array, is fitted by 1 + a r^2 + b r^4 + c r^6 of the distance from it. The
//! rings' error is that of their pixels' response and noise. Distances become angles as a rectilinear lens of the given focal length maps
//! them.

use serde::Serialize;

use super::parameters::SIGMAS;
use crate::characterize::measure::StackSums;
use crate::num::{f64_from_u64, f64_from_usize, greater, index, u32_truncated};
use nalgebra::{Matrix4, Vector4};

/// Rings of equal area.
const RINGS: u32 = 24;
/// Steps of the table, evenly in the angle.
const STEPS: u32 = 12;

/// The share of light by angle.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct RollOffTable {
    /// Rows of the table: angle off the axis in degrees, share of the light on it.
    pub table: Vec<[f64; 2]>,
    /// 95 % interval of each share.
    pub intervals: Vec<[f64; 2]>,
    /// Greatest difference of a ring from the curve, as a share of the light on the axis.
    pub left_over: f64,
}

/// Of stacks that are free of defective pixels; `px_of_focal` is the focal length in pixels.
/// Fails on flats without light or saturated ones, and where the middle is too dark for a share.
pub fn roll_off(bright: &StackSums, dark: &StackSums, bits: u32, px_of_focal: f64) -> Result<RollOffTable, String> {
    let (lit, unlit) = (bright.means_dn(), dark.means_dn());
    let code_max = f64_from_u64((1 << bits) - 1);
    let brightest_dn = lit.iter().copied().fold(0.0, greater);
    if brightest_dn > 0.98 * code_max {
        return Err(format!("the flat is saturated ({brightest_dn:.1} of {code_max} DN); take it darker"));
    }
    let (width, height): (f64, f64) = (bright.size.width_px.into(), bright.size.height_px.into());
    let corner_px = 0.5 * libm::hypot(width, height);
    let square = |pixel: usize| {
        let columns = index(bright.size.width_px);
        let x = f64_from_usize(pixel % columns) + 0.5 - 0.5 * width;
        let y = f64_from_usize(pixel / columns) + 0.5 - 0.5 * height;
        (x * x + y * y) / (corner_px * corner_px)
    };
    let mut rings = vec![[0.0; 4]; index(RINGS)];
    for (pixel, (lit, unlit)) in lit.iter().zip(&unlit).enumerate() {
        let (at, signal) = (square(pixel), lit - unlit);
        let ring = &mut rings[index(u32_truncated(at * f64::from(RINGS)).min(RINGS - 1))];
        *ring = [ring[0] + 1.0, ring[1] + at, ring[2] + signal, ring[3] + signal * signal];
    }
    // Ring: mean square of the radius, mean signal, its variance from the pixels' spread. Few pixels lie in the outermost ones.
    let rings: Vec<[f64; 3]> = rings
        .into_iter()
        .filter(|ring| ring[0] > 3.0)
        .map(|[count, squared_radius, signal, squares]| {
            let mean = signal / count;
            [squared_radius / count, mean, greater(squares / count - mean * mean, f64::MIN_POSITIVE) / (count - 1.0)]
        })
        .collect();
    let mut normal = Matrix4::zeros();
    let mut right = Vector4::zeros();
    for &[squared_radius, signal, variance] in &rings {
        let row = powers(squared_radius);
        normal += row * row.transpose() / variance;
        right += row * (signal / variance);
    }
    let covariance = normal.try_inverse().ok_or("the flat has too few pixels for a curve")?;
    let curve = covariance * right;
    if !(curve[0] > SIGMAS * covariance[(0, 0)].sqrt()) || curve[0] < 1.0 {
        return Err(format!("the flat is only {:.2} DN above the dark one in its middle; use more light", curve[0]));
    }
    let share = |squared_radius: f64| {
        let row = powers(squared_radius);
        let share = row.dot(&curve) / curve[0];
        // The share's slope over the four coefficients.
        let slope = (row - Vector4::new(share, 0.0, 0.0, 0.0)) / curve[0];
        (share, (slope.transpose() * covariance * slope)[0].sqrt())
    };
    let widest = libm::atan(corner_px / px_of_focal);
    let (mut table, mut intervals) = (Vec::new(), Vec::new());
    for step in 0..=STEPS {
        let angle = widest * f64::from(step) / f64::from(STEPS);
        let radius = libm::tan(angle) * px_of_focal / corner_px;
        let (value, error) = share(radius * radius);
        table.push([angle.to_degrees(), greater(value, 0.0)]);
        intervals.push([value - SIGMAS * error, value + SIGMAS * error]);
    }
    let left_over = rings
        .iter()
        .map(|[squared_radius, signal, _]| (signal / curve[0] - share(*squared_radius).0).abs())
        .fold(0.0, greater);
    Ok(RollOffTable { table, intervals, left_over })
}

/// Powers of the square of a radius.
fn powers(square: f64) -> Vector4<f64> {
    Vector4::new(1.0, square, square * square, square * square * square)
}
