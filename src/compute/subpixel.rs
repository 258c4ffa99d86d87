//! The sub-pixel place of a corner by a fixed-point quadratic fit. Enters: picture and corner. Leaves: sixteenths of a pixel.

use super::fast::{Corner, arc_difference_at};
use super::word::Word;
use crate::num::low_u16;
use crate::plane::Plane;

/// Steps of a place in one pixel.
pub const STEPS_PER_PX: u16 = 16;
/// A fit moves a place by at most half a pixel.
const HALF_PX_Q4: i32 = 8;

/// The place of a corner of octave k in the full picture's sixteenths: of the fitted peak, or of the pixel's centre.
///
/// The centre of a half-scale pixel lies between four pixels, so a place is scaled about the picture's corner, which is half
/// a pixel before the first centre.
pub(crate) fn place<W: Word>(picture: &Plane<W>, corner: &Corner, octave: u8, fit: bool) -> (u16, u16) {
    let (x_q4, y_q4) = if fit { offset_q4(&responses(picture, corner)) } else { (0, 0) };
    (moved(corner.x_px, x_q4, octave), moved(corner.y_px, y_q4, octave))
}

/// `offset_q4` is within half a pixel and corners are three pixels from the edge, so a place is never below zero.
fn moved(place_px: u32, offset_q4: i32, octave: u8) -> u16 {
    let half_q4 = HALF_PX_Q4.unsigned_abs();
    let whole_q4 = place_px * u32::from(STEPS_PER_PX) + half_q4;
    let from_edge_q4 = whole_q4.checked_add_signed(offset_q4).expect("corners are three pixels from the edge");
    low_u16((from_edge_q4 << octave) - half_q4)
}

/// The arc difference at a corner and its eight neighbours, by rows; what the fit is made of.
pub fn responses<W: Word>(picture: &Plane<W>, corner: &Corner) -> [[i32; 3]; 3] {
    let at = |dx: u32, dy: u32| arc_difference_at(picture, corner.x_px + dx - 1, corner.y_px + dy - 1).number();
    [0, 1, 2].map(|dy| [0, 1, 2].map(|dx| i32::try_from(at(dx, dy)).expect("16 bits at most")))
}

/// Peak of the least-squares quadratic through nine values, relative to the middle, in sixteenths, rounded half up.
///
/// Slopes and curvatures are sums over the three rows or columns, so that noise averages; the mixed term turns the axes of
/// ridges. Without a peak (curvature not negative in both directions) the place stays; beyond half a pixel it is clipped.
pub fn offset_q4(r: &[[i32; 3]; 3]) -> (i32, i32) {
    let column = |x: usize| r[0][x] + r[1][x] + r[2][x];
    let row = |y: usize| r[y][0] + r[y][1] + r[y][2];
    // With f = c + gx x + gy y + (hxx x^2 + 2 hxy x y + hyy y^2) / 2: six times each slope, three times each curvature ...
    let (gx6, gy6) = (column(2) - column(0), row(2) - row(0));
    let (hxx3, hyy3) = (column(0) - 2 * column(1) + column(2), row(0) - 2 * row(1) + row(2));
    // ... and four times the mixed curvature.
    let hxy4 = r[0][0] - r[0][2] - r[2][0] + r[2][2];
    // Peak: x = (hxy gy - hyy gx) / (hxx hyy - hxy^2), brought to the common factors 144 above and below.
    let (gx, gy) = (i64::from(gx6) * 2, i64::from(gy6) * 2);
    let (hxx, hyy, hxy) = (i64::from(hxx3) * 4, i64::from(hyy3) * 4, i64::from(hxy4) * 3);
    let determinant = hxx * hyy - hxy * hxy;
    if hxx >= 0 || hyy >= 0 || determinant <= 0 {
        return (0, 0);
    }
    let limit = i64::from(HALF_PX_Q4);
    let quotient = |above: i64| {
        let rounded = (above * i64::from(STEPS_PER_PX) * 2 + determinant).div_euclid(2 * determinant);
        i32::try_from(rounded.clamp(-limit, limit - 1)).expect("clipped to half a pixel")
    };
    (quotient(hxy * gy - hyy * gx), quotient(hxy * gx - hxx * gy))
}
