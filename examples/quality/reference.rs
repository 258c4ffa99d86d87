//! The same method in floating point, an upper bound on the quality of every word length.
//!
//! FAST, suppression and the choice by cells are as in the fixed-point extractor, on values that keep all bits of the codes. The
//! picture is smoothed by a Gaussian of the triangle's width, angles are exact, and the pattern's points are turned exactly and
//! read between pixels.

use sensel::compute::blocks::{arc_difference_at, fitted_shift, responses};
use sensel::compute::{Corner, Extractor, ExtractorParams, PATCH_MARGIN_PX, fast9, pattern, to_bits};
use sensel::num::{f64_from_usize, index};
use sensel::plane::Plane;

use super::score::Features;
use super::views::Codes;

/// Bits of a word: twice those of the fixed-point extractor.
const BITS: u32 = 16;
/// Standard deviation of the triangle kernel (1 2 3 4 3 2 1) / 16.
const SIGMA_PX: f64 = 1.581;
/// Rows and columns of the smoothing kernel on either side.
const REACH: usize = 6;
const RADIUS_PX: f64 = 13.0;

pub fn features(codes: &Codes, params: &ExtractorParams) -> Features {
    let words = to_bits(&codes.plane, codes.bits, BITS);
    let smoothed = smooth(&words);
    let size = words.size();
    let margin = PATCH_MARGIN_PX;
    let inside = |position: u32, side: u32| position >= margin && position + margin < side;
    let mut cells: std::collections::BTreeMap<(u32, u32), Vec<Corner>> = std::collections::BTreeMap::new();
    let fine = ExtractorParams { pipeline_bits: BITS, threshold: params.threshold << (BITS - 8), ..*params };
    let extracted = Extractor::new(&fine).first_frame(&codes.plane, codes.bits).expect("views are large enough");
    for corner in fast9(&words, extracted.threshold) {
        if inside(corner.x_px, size.width_px) && inside(corner.y_px, size.height_px) {
            cells.entry((corner.y_px / params.cell_px, corner.x_px / params.cell_px)).or_default().push(corner);
        }
    }
    let pairs = pattern();
    let mut features = Vec::new();
    for mut cell in cells.into_values() {
        cell.sort_by_key(|corner| std::cmp::Reverse(corner.score));
        for corner in cell.iter().take(index(params.per_cell)) {
            features.push(describe(&words, &smoothed, corner, &pairs));
        }
    }
    features
}

fn describe(
    words: &Plane<u16>,
    smoothed: &Plane<f64>,
    corner: &Corner,
    pairs: &[((i32, i32), (i32, i32))],
) -> ([f64; 2], [u64; 4]) {
    assert!(arc_difference_at(words, corner.x_px, corner.y_px) > 0, "a corner differs from its surroundings");
    let (right, down) = fitted_shift(&responses(words, corner));
    let middle = [f64::from(corner.x_px), f64::from(corner.y_px)];
    let at = |dx: f64, dy: f64| between(smoothed, middle[0] + dx, middle[1] + dy);
    let (mut x_moment, mut y_moment) = (0.0, 0.0);
    for i in 0..27 * 27 {
        let (dx, dy) = (f64_from_usize(i % 27) - RADIUS_PX, f64_from_usize(i / 27) - RADIUS_PX);
        if dx * dx + dy * dy <= RADIUS_PX * RADIUS_PX {
            let value = at(dx, dy);
            x_moment += dx * value;
            y_moment += dy * value;
        }
    }
    let (sine, cosine) = libm::sincos(libm::atan2(y_moment, x_moment));
    let turned = |(x, y): (i32, i32)| {
        let (x, y) = (f64::from(x), f64::from(y));
        at(x * cosine - y * sine, x * sine + y * cosine)
    };
    let mut descriptor = [0; 4];
    for (bit, &(a, b)) in pairs.iter().enumerate() {
        descriptor[bit / 64] |= u64::from(turned(a) < turned(b)) << (bit % 64);
    }
    ([middle[0] + f64::from(right), middle[1] + f64::from(down)], descriptor)
}

/// Bilinear; the pattern stays within a corner's patch.
fn between(picture: &Plane<f64>, x: f64, y: f64) -> f64 {
    let (left, top) = (x.floor(), y.floor());
    let texel = |at: f64| index(sensel::num::u32_truncated(at));
    let value = |dx: usize, dy: usize| picture.at(texel(left) + dx, texel(top) + dy);
    let (right, down) = (x - left, y - top);
    (value(0, 0) * (1.0 - right) + value(1, 0) * right) * (1.0 - down)
        + (value(0, 1) * (1.0 - right) + value(1, 1) * right) * down
}

fn smooth(words: &Plane<u16>) -> Plane<f64> {
    let weights: Vec<f64> = (0..=2 * REACH)
        .map(|k| {
            let x = f64_from_usize(k) - f64_from_usize(REACH);
            libm::exp(-0.5 * x * x / (SIGMA_PX * SIGMA_PX))
        })
        .collect();
    let total: f64 = weights.iter().sum();
    let (width, height) = (words.width_px(), words.height_px());
    let near = |at: usize, k: usize, side: usize| (at + k).saturating_sub(REACH).min(side - 1);
    let mut across = Plane::filled(words.size(), 0.0_f64);
    for y in 0..height {
        let row = words.row(y);
        for (x, out) in across.row_mut(y).iter_mut().enumerate() {
            let tap = |(k, weight): (usize, &f64)| weight * f64::from(row[near(x, k, width)]);
            *out = weights.iter().enumerate().map(tap).sum::<f64>() / total;
        }
    }
    let mut both = across.clone();
    for y in 0..height {
        for (x, out) in both.row_mut(y).iter_mut().enumerate() {
            let tap = |(k, weight): (usize, &f64)| weight * across.at(x, near(y, k, height));
            *out = weights.iter().enumerate().map(tap).sum::<f64>() / total;
        }
    }
    both
}
