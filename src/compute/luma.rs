//! Grey from a mosaic. Converts codes behind colour filters to one grey code per pixel, half a pattern further right and down.
//!
//! The mean of as many neighbours as the pattern has pixels holds every filter as often as the pattern does, wherever it starts, so
//! flat colour gives flat grey. In hardware: a running sum over one pattern's rows and columns, and no multiplier.

use super::feature::Feature;
use crate::events::{Event, Events};
use crate::num::{low_u16, u32_from, u64_from};
use crate::plane::Plane;
use crate::words::PositionPx;

/// Mean over `pattern_px` (columns, rows) to the right of and below each pixel, rounded down; at the far edges the last whole
/// pattern is repeated. Panics on a picture smaller than its pattern.
pub(super) fn luma(codes: &Plane<u16>, pattern_px: (usize, usize), events: &mut Events) -> Plane<u16> {
    let (columns, rows) = pattern_px;
    let (width, height) = (codes.width_px(), codes.height_px());
    assert!(columns <= width && rows <= height && columns * rows > 0, "a picture holds its filters' pattern");
    let pixels = u64_from(width * height);
    let (wide, high) = (u64_from(columns - 1), u64_from(rows - 1));
    events.add(Event::LineBufferWrite, pixels * high.min(1));
    events.add(Event::LineBufferRead, pixels * high);
    events.add(Event::ComputeOp, pixels * (wide + high));
    let mut grey = Plane::filled(codes.size(), 0_u16);
    let count = u32_from(columns * rows);
    let mut sums = vec![0_u32; width];
    for y in 0..height {
        let top = y.min(height - rows);
        sums.fill(0);
        for row in top..top + rows {
            for (sum, &code) in sums.iter_mut().zip(codes.row(row)) {
                *sum += u32::from(code);
            }
        }
        for (x, grey) in grey.row_mut(y).iter_mut().enumerate() {
            let left = x.min(width - columns);
            let sum: u32 = sums[left..left + columns].iter().sum();
            *grey = low_u16(sum / count);
        }
    }
    grey
}

/// Moves features of the grey picture to where the light fell: half a pattern less half a pixel to the right and down.
pub(super) fn move_to_mosaic(features: &mut [Feature], pattern_px: (usize, usize)) {
    let half = |side_px: usize| PositionPx::saturating_from_num(side_px - 1) >> 1;
    let (right, down) = (half(pattern_px.0), half(pattern_px.1));
    for feature in features {
        feature.x = feature.x.saturating_add(right);
        feature.y = feature.y.saturating_add(down);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::Size;

    #[test]
    fn flat_colour_is_flat_grey_wherever_the_pattern_starts() {
        let pattern = [[100, 200], [200, 60]];
        let size = Size { width_px: 9, height_px: 7 };
        for (right, down) in [(0, 0), (1, 0), (0, 1), (1, 1)] {
            let code = |at: usize| pattern[(at / 9 + down) % 2][(at % 9 + right) % 2];
            let codes = Plane::from_values(size, (0..63).map(code).collect());
            let grey = luma(&codes, (2, 2), &mut Events::default());
            assert!(grey.values().iter().all(|&code| code == 140), "{grey:?}");
        }
    }

    #[test]
    fn one_filter_leaves_the_picture_and_its_features_as_they_are() {
        let size = Size { width_px: 5, height_px: 4 };
        let codes = Plane::from_values(size, (0..20).map(|code| code * 3000).collect());
        let mut events = Events::default();
        assert_eq!(luma(&codes, (1, 1), &mut events), codes);
        assert_eq!(events, Events::default());
        let (x, y) = (PositionPx::from_bits(33), PositionPx::MAX);
        let feature = Feature { x, y, score: 1, angle: crate::words::Turns::ZERO, octave: 0, descriptor: [0; 32] };
        let mut features = [feature, feature];
        move_to_mosaic(&mut features[..1], (1, 1));
        move_to_mosaic(&mut features[1..], (2, 4));
        assert_eq!(features[0], feature);
        assert_eq!((features[1].x, features[1].y), (PositionPx::from_bits(41), PositionPx::MAX));
    }
}
