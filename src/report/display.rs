//! Converts codes to eight-bit grey values near the curve of a display.

use crate::num::{low_u8, u32_truncated};
use crate::plane::Plane;

/// Black level off, then the square root of the share of the range that is left.
///
/// Panics on codes beyond their depth, and where the black level is the greatest code.
pub fn display_curve(codes: &Plane<u16>, bits: u32, black_level_dn: u32) -> Plane<u8> {
    assert!(black_level_dn < (1 << bits) - 1, "the black level is below the greatest code");
    let range_dn = f64::from((1_u32 << bits) - 1 - black_level_dn);
    let curve: Vec<u8> = (0..1_u32 << bits)
        .map(|code_dn| {
            let share = f64::from(code_dn.saturating_sub(black_level_dn)) / range_dn;
            low_u8(u32_truncated(255.0 * share.sqrt() + 0.5))
        })
        .collect();
    codes.map(|code_dn| curve[usize::from(code_dn)])
}
