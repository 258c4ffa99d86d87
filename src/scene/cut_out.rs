//! Holes in surfaces, as in leaves and lattices. Decides from 8-bit coverage (alpha) and a threshold whether a ray passes at texture
//! coordinates.
//!
//! glTF's alpha mode MASK: a point is either there or not. Coverage is taken at full resolution, bilinear; antialiasing is left to the rays
//! of a pixel, which fall on and beside the edge.

use super::texture::Wrap;
use crate::num::{f32_from_i32, f32_from_u32, i32_truncated_f32, index};

/// Coverage of a picture, and where it counts as surface.
#[derive(Clone, Debug, PartialEq)]
pub struct CutOut {
    width: u32,
    height: u32,
    /// 255 is surface; row-major, the top row first.
    coverage: Vec<u8>,
    wrap: [Wrap; 2],
    /// Coverage below this (0 to 255) is a hole.
    least: f32,
}

impl CutOut {
    /// Takes row-major coverage, the top row first. Panics unless there are width times height codes, at least one.
    pub fn new(width: u32, height: u32, coverage: Vec<u8>, wrap: [Wrap; 2], cutoff: f32) -> Self {
        assert!(!coverage.is_empty() && coverage.len() == index(width) * index(height), "a picture needs its texels");
        Self { width, height, coverage, wrap, least: 255.0 * cutoff }
    }

    /// Whether there is a hole at texture coordinates (glTF: origin top left, v downwards).
    pub fn is_open(&self, uv: [f32; 2]) -> bool {
        let (x0, x1, fx) = neighbours(uv[0], self.width, self.wrap[0]);
        let (y0, y1, fy) = neighbours(uv[1], self.height, self.wrap[1]);
        let at = |x: usize, y: usize| f32::from(self.coverage[y * index(self.width) + x]);
        let above = at(x0, y0) + (at(x1, y0) - at(x0, y0)) * fx;
        let below = at(x0, y1) + (at(x1, y1) - at(x0, y1)) * fx;
        above + (below - above) * fy < self.least
    }

    /// Bytes that identify these holes, for content keys.
    pub fn hash_into(&self, hasher: &mut blake3::Hasher) {
        for number in [self.width, self.height, self.least.to_bits()] {
            hasher.update(&number.to_le_bytes());
        }
        hasher.update(&self.wrap.map(|wrap| wrap as u8));
        hasher.update(&self.coverage);
    }
}

/// Two neighbouring texel indices along one axis and the weight of the second.
fn neighbours(coordinate: f32, count: u32, wrap: Wrap) -> (usize, usize, f32) {
    let folded = match wrap {
        Wrap::Repeat => coordinate - coordinate.floor(),
        Wrap::Mirror => {
            let period = coordinate - 2.0 * (coordinate * 0.5).floor();
            if period > 1.0 { 2.0 - period } else { period }
        }
        Wrap::Clamp => coordinate.clamp(0.0, 1.0),
    };
    let x = folded * f32_from_u32(count) - 0.5;
    let first = i32_truncated_f32(x.floor());
    let count = i32::try_from(count).unwrap_or(i32::MAX);
    let place = |at: i32| {
        let inside = if wrap == Wrap::Repeat { at.rem_euclid(count) } else { at.clamp(0, count - 1) };
        usize::try_from(inside).unwrap_or(0)
    };
    (place(first), place(first + 1), (x - f32_from_i32(first)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn holes_lie_where_coverage_is_low_and_end_half_way_between_texels() {
        // Left texel a hole, right one surface: the edge for a cutoff of a half is at the middle.
        let cut_out = CutOut::new(2, 1, vec![0, 255], [Wrap::Clamp; 2], 0.5);
        for (u, is_open) in [(0.0, true), (0.25, true), (0.49, true), (0.51, false), (0.75, false), (1.0, false)] {
            assert_eq!(cut_out.is_open([u, 0.5]), is_open, "{u}");
        }
    }

    #[test]
    fn every_wrap_stays_within_the_picture_for_wild_coordinates() {
        let mut tried = 0;
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for (code, is_open) in [(0, true), (255, false)] {
                let cut_out = CutOut::new(3, 5, vec![code; 15], [wrap; 2], 0.5);
                for u in [-1e9, -7.3, -1.0, -0.0, 0.0, 0.999_999_94, 1.0, 2.5, 1e9, f32::MAX] {
                    assert_eq!(cut_out.is_open([u, -u]), is_open, "{wrap:?} at {u}");
                    tried += 1;
                }
            }
        }
        assert_eq!(tried, 60);
    }
}
