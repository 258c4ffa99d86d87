//! The sub-pixel position of a corner of a picture, in pixels, by the weighted centroid of FAST's differences.

use fixed::FixedI32;
use fixed::types::extra::U4;

use super::fast::{Corner, arc_difference_at};
use super::word::Word;
use crate::plane::Plane;
use crate::words::{EdgeDistancePx, PositionPx, ShiftPx};

/// From a pixel's edge to its centre.
const HALF_PX: EdgeDistancePx = EdgeDistancePx::lit("0.5");

/// The position of a corner of octave k in the full picture: as the fit moves it, or of the pixel's centre.
///
/// The centre of a half-scale pixel lies between four pixels, so a position is scaled about the picture's corner, which is half
/// a pixel before the first centre.
pub(crate) fn position<W: Word>(
    picture: &Plane<W>,
    corner: &Corner,
    octave: u8,
    fit: bool,
) -> (PositionPx, PositionPx) {
    let (right, down) = if fit { fitted_shift(&responses(picture, corner)) } else { (ShiftPx::ZERO, ShiftPx::ZERO) };
    (moved(corner.x_px, right, octave), moved(corner.y_px, down, octave))
}

/// A shift is within a pixel and corners are three pixels from the edge, so a position is never below zero.
fn moved(pixel: u32, shift: ShiftPx, octave: u8) -> PositionPx {
    let centre = EdgeDistancePx::wrapping_from_num(pixel).wrapping_add(HALF_PX);
    let from_edge = centre.checked_add_signed(shift.into()).expect("corners are three pixels from the edge");
    PositionPx::wrapping_from_num(from_edge.wrapping_shl(octave.into()).wrapping_sub(HALF_PX))
}

/// The arc difference at a corner and its eight neighbours, by rows; what the fit is made of.
pub fn responses<W: Word>(picture: &Plane<W>, corner: &Corner) -> [[i32; 3]; 3] {
    let at = |dx: u32, dy: u32| arc_difference_at(picture, corner.x_px + dx - 1, corner.y_px + dy - 1).number();
    [0, 1, 2].map(|dy| [0, 1, 2].map(|dx| i32::try_from(at(dx, dy)).expect("16 bits at most")))
}

/// Centroid of nine values under the weights (1 2 1) both ways, times 2.5, relative to the middle, rounded half up and clipped to
/// -1 to 15/16 of a pixel.
///
/// FAST's score is a minimum of differences: below a pixel it is flat at its top and falls like a tent, so a parabola through it locks
/// to whole pixels. The centroid moves with all nine values and has no case without an answer. Nine values see only part of a peak,
/// and so their centroid moves by two fifths of what the corner does; the factor was measured on photographs shifted by known parts
/// of a pixel (docs/extractor.md), not derived. If all nine are zero, the shift is zero.
pub fn fitted_shift(r: &[[i32; 3]; 3]) -> (ShiftPx, ShiftPx) {
    let column = |x: usize| r[0][x] + 2 * r[1][x] + r[2][x];
    let row = |y: usize| r[y][0] + 2 * r[y][1] + r[y][2];
    // Words of 16 bits give sums of 20 bits, and dividends of 26 bits and a sign.
    let sum = column(0) + 2 * column(1) + column(2);
    if sum <= 0 {
        return (ShiftPx::ZERO, ShiftPx::ZERO);
    }
    const PX: FixedI32<U4> = FixedI32::ONE;
    // Sixteenths: 16 x 2.5 slope / sum, rounded. The half is half of a divisor of twice the sum.
    let quotient = |slope: i32| {
        let shift = FixedI32::from_bits((80 * slope + sum).div_euclid(2 * sum));
        ShiftPx::wrapping_from_num(shift.clamp(PX.wrapping_neg(), PX.wrapping_sub(FixedI32::DELTA)))
    };
    (quotient(column(2) - column(0)), quotient(row(2) - row(0)))
}
