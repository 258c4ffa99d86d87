//! Holes in surfaces, as in leaves and lattices. Decides from 8-bit coverage (alpha) and a threshold whether a ray passes at texture
//! coordinates.
//!
//! glTF's alpha mode MASK: a point is either there or not. Coverage is taken at full resolution, bilinear; antialiasing is left to the rays
//! of a pixel, which fall on and beside the edge. BLEND: a ray passes by chance, as often as coverage says, by a draw that the hit point
//! decides (hashed alpha testing, Wyman and McGuire, I3D 2017), so that the mean over rays is the blend, in any order of surfaces.
//! Panes pass rays by chance too, by transmission and Fresnel's reflectance; a ray that they stop is mirrored (`lit/gloss`).

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
    rule: Rule,
}

/// What coverage means. Of 0 to 255.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Rule {
    /// Below this is a hole.
    Least(f32),
    /// Times this over 255, the share of rays that is stopped.
    Share(f32),
    /// Times this over 255, the share of what Fresnel lets in that passes.
    Pane(f32),
}

/// Reflectance of a dielectric of index 1.5 at normal incidence.
pub const DIELECTRIC_F0: f32 = 0.04;

/// What a pane reflects at a cosine to its normal (Schlick).
pub fn pane_reflectance(cos: f32) -> f32 {
    let short = 1.0 - if cos < 1.0 { cos } else { 1.0 };
    DIELECTRIC_F0 + (1.0 - DIELECTRIC_F0) * (short * short) * (short * short) * short
}

impl CutOut {
    /// Takes row-major coverage, the top row first. Panics unless there are width times height codes, at least one.
    pub fn new(width: u32, height: u32, coverage: Vec<u8>, wrap: [Wrap; 2], cutoff: f32) -> Self {
        assert!(!coverage.is_empty() && coverage.len() == index(width) * index(height), "a picture needs its texels");
        Self { width, height, coverage, wrap, rule: Rule::Least(255.0 * cutoff) }
    }

    /// As `new`, but coverage times `alpha` is the share of rays that is stopped.
    pub fn blended(width: u32, height: u32, coverage: Vec<u8>, wrap: [Wrap; 2], alpha: f32) -> Self {
        Self { rule: Rule::Share(alpha), ..Self::new(width, height, coverage, wrap, 0.0) }
    }

    /// A thin pane: of the light that Fresnel's reflectance leaves, the share `transmission` times the picture passes straight on
    /// (KHR_materials_transmission without a volume).
    pub fn pane(width: u32, height: u32, picture: Vec<u8>, wrap: [Wrap; 2], transmission: f32) -> Self {
        Self { rule: Rule::Pane(transmission), ..Self::new(width, height, picture, wrap, 0.0) }
    }

    /// The share of what is not reflected that a pane lets pass at texture coordinates; none where it is no pane.
    pub fn transmission(&self, uv: [f32; 2]) -> Option<f32> {
        match self.rule {
            Rule::Pane(transmission) => Some(self.coverage(uv) * transmission * (1.0 / 255.0)),
            Rule::Least(_) | Rule::Share(_) => None,
        }
    }

    /// Whether there is a hole at texture coordinates (glTF: origin top left, v downwards), for a ray at a cosine to the normal. `draw`,
    /// from 0 to 1 and below 1, decides where a share passes.
    #[inline]
    pub fn is_open(&self, uv: [f32; 2], cos: impl FnOnce() -> f32, draw: impl FnOnce() -> f32) -> bool {
        let coverage = self.coverage(uv);
        match self.rule {
            Rule::Least(least) => coverage < least,
            Rule::Share(alpha) => coverage * alpha <= 255.0 * draw(),
            Rule::Pane(transmission) => 255.0 * draw() < coverage * transmission * (1.0 - pane_reflectance(cos())),
        }
    }

    fn coverage(&self, uv: [f32; 2]) -> f32 {
        let (x0, x1, fx) = neighbours(uv[0], self.width, self.wrap[0]);
        let (y0, y1, fy) = neighbours(uv[1], self.height, self.wrap[1]);
        let at = |x: usize, y: usize| f32::from(self.coverage[y * index(self.width) + x]);
        let above = at(x0, y0) + (at(x1, y0) - at(x0, y0)) * fx;
        let below = at(x0, y1) + (at(x1, y1) - at(x0, y1)) * fx;
        above + (below - above) * fy
    }

    /// Bytes that identify these holes, for content keys.
    pub fn hash_into(&self, hasher: &mut blake3::Hasher) {
        let (number, kind): (f32, &[u8]) = match self.rule {
            Rule::Least(least) => (least, b""),
            Rule::Share(alpha) => (alpha, b"share"),
            Rule::Pane(transmission) => (transmission, b"pane"),
        };
        for number in [self.width, self.height, number.to_bits()] {
            hasher.update(&number.to_le_bytes());
        }
        hasher.update(kind);
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
    let texel_index = |at: i32| {
        let inside = if wrap == Wrap::Repeat { at.rem_euclid(count) } else { at.clamp(0, count - 1) };
        usize::try_from(inside).unwrap_or(0)
    };
    (texel_index(first), texel_index(first + 1), (x - f32_from_i32(first)).clamp(0.0, 1.0))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn is_hole(cut_out: &CutOut, uv: [f32; 2]) -> bool {
        cut_out.is_open(uv, || panic!("no angle"), || panic!("no draw"))
    }

    /// How many of 1000 evenly spaced draws pass a pane at a cosine.
    fn passed(pane: &CutOut, cos: impl Fn() -> f32) -> f64 {
        let is_open = |draw: &i32| pane.is_open([0.3, 0.7], &cos, || f32_from_i32(*draw) / 1000.0);
        crate::num::f64_from_usize((0..1000).filter(is_open).count())
    }

    #[test]
    fn holes_lie_where_coverage_is_low_and_end_half_way_between_texels() {
        // Left texel a hole, right one surface: the edge for a cutoff of a half is at the middle.
        let cut_out = CutOut::new(2, 1, vec![0, 255], [Wrap::Clamp; 2], 0.5);
        for (u, is_open) in [(0.0, true), (0.25, true), (0.49, true), (0.51, false), (0.75, false), (1.0, false)] {
            assert_eq!(is_hole(&cut_out, [u, 0.5]), is_open, "{u}");
        }
    }

    #[test]
    fn coverage_as_a_share_stops_so_many_draws() {
        for (code, alpha, share) in [(0, 1.0, 0.0), (255, 1.0, 1.0), (255, 0.25, 0.25), (51, 1.0, 0.2), (51, 0.5, 0.1)]
        {
            let pane = CutOut::blended(1, 1, vec![code], [Wrap::Repeat; 2], alpha);
            let stopped = 1000.0 - passed(&pane, || panic!("no angle"));
            // Both ends are exact: nothing stops no draw, and all is all. Elsewhere rounding may decide one.
            assert!((stopped - 1000.0 * share).abs() <= if share % 1.0 == 0.0 { 0.0 } else { 1.0 });
        }
    }

    #[test]
    fn a_pane_passes_what_it_does_not_reflect() {
        // Schlick at 60 degrees: 0.04 + 0.96 / 32.
        for (code, factor, cos, share) in
            [(255, 1.0, 1.0, 0.96), (255, 1.0, 0.5, 0.93), (255, 1.0, 0.0, 0.0), (51, 0.5, 1.0, 0.096)]
        {
            let pane = CutOut::pane(1, 1, vec![code], [Wrap::Repeat; 2], factor);
            let passed = passed(&pane, || cos);
            assert!((passed - 1000.0 * share).abs() <= 1.0, "{code} {factor} {cos}: {passed}");
        }
    }

    #[test]
    fn every_wrap_stays_within_the_picture_for_wild_coordinates() {
        let mut tried = 0;
        for wrap in [Wrap::Repeat, Wrap::Mirror, Wrap::Clamp] {
            for (code, is_open) in [(0, true), (255, false)] {
                let cut_out = CutOut::new(3, 5, vec![code; 15], [wrap; 2], 0.5);
                for u in [-1e9, -7.3, -1.0, -0.0, 0.0, 0.999_999_94, 1.0, 2.5, 1e9, f32::MAX] {
                    assert_eq!(is_hole(&cut_out, [u, -u]), is_open, "{wrap:?} at {u}");
                    tried += 1;
                }
            }
        }
        assert_eq!(tried, 60);
    }
}
