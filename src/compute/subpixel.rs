//! The sub-pixel place of a corner by the weighted centroid of FAST's differences. Enters: picture and corner. Leaves: sixteenths
//! of a pixel.

use super::fast::{Corner, arc_difference_at};
use super::word::Word;
use crate::num::low_u16;
use crate::plane::Plane;

/// Steps of a place in one pixel.
pub const STEPS_PER_PX: u16 = 16;
/// Half a pixel, from its edge to its centre.
const HALF_PX_Q4: u32 = 8;
/// A fit moves a place by at most a pixel.
const PX_Q4: i32 = 16;

/// The place of a corner of octave k in the full picture's sixteenths: as the fit moves it, or of the pixel's centre.
///
/// The centre of a half-scale pixel lies between four pixels, so a place is scaled about the picture's corner, which is half
/// a pixel before the first centre.
pub(crate) fn place<W: Word>(picture: &Plane<W>, corner: &Corner, octave: u8, fit: bool) -> (u16, u16) {
    let (x_q4, y_q4) = if fit { offset_q4(&responses(picture, corner)) } else { (0, 0) };
    (moved(corner.x_px, x_q4, octave), moved(corner.y_px, y_q4, octave))
}

/// `offset_q4` is within a pixel and corners are three pixels from the edge, so a place is never below zero.
fn moved(place_px: u32, offset_q4: i32, octave: u8) -> u16 {
    let whole_q4 = place_px * u32::from(STEPS_PER_PX) + HALF_PX_Q4;
    let from_edge_q4 = whole_q4.checked_add_signed(offset_q4).expect("corners are three pixels from the edge");
    low_u16((from_edge_q4 << octave) - HALF_PX_Q4)
}

/// The arc difference at a corner and its eight neighbours, by rows; what the fit is made of.
pub fn responses<W: Word>(picture: &Plane<W>, corner: &Corner) -> [[i32; 3]; 3] {
    let at = |dx: u32, dy: u32| arc_difference_at(picture, corner.x_px + dx - 1, corner.y_px + dy - 1).number();
    [0, 1, 2].map(|dy| [0, 1, 2].map(|dx| i32::try_from(at(dx, dy)).expect("16 bits at most")))
}

/// Centroid of nine values under the weights (1 2 1) both ways, times 2.5, relative to the middle, in sixteenths, rounded half up and
/// clipped to within a pixel.
///
/// FAST's score is a least of differences: below a pixel it is flat at its top and bent like a tent, so a parabola through it holds
/// to whole pixels. The centroid moves with all nine values and has no case without an answer. Nine values see only part of a peak,
/// and so their centroid moves by two fifths of what the corner does; the factor was measured on photographs shifted by known parts
/// of a pixel (docs/extractor.md), not derived. Nothing but zeros stays in the middle.
pub fn offset_q4(r: &[[i32; 3]; 3]) -> (i32, i32) {
    let column = |x: usize| r[0][x] + 2 * r[1][x] + r[2][x];
    let row = |y: usize| r[y][0] + 2 * r[y][1] + r[y][2];
    // Words of 16 bits give sums of 20 bits, and dividends of 26 bits and a sign.
    let sum = column(0) + 2 * column(1) + column(2);
    if sum <= 0 {
        return (0, 0);
    }
    // 16 x 2.5 slope / sum, rounded: the half is half of a divisor of twice the sum.
    let quotient = |slope: i32| (80 * slope + sum).div_euclid(2 * sum).clamp(-PX_Q4, PX_Q4 - 1);
    (quotient(column(2) - column(0)), quotient(row(2) - row(0)))
}
