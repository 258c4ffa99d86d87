//! FAST-9/16 with its score and strict non-maximum suppression. Enters: an 8-bit picture. Leaves: corners, by rows.
//!
//! A pixel is a corner at threshold t if nine neighbouring pixels of the 16 on a circle of radius 3 are all brighter than
//! the centre plus t, or all darker than the centre minus t (Rosten and Drummond 2006). The score is the largest such t.
//! Brightest arc minimum and darkest arc maximum are found by a network of 8-bit minima and maxima without branches, so a
//! row is one vector loop; rows in which a block of pixels cannot hold a corner skip it after a short test.

use crate::num::{index, u32_from};
use crate::plane::Plane;
use crate::simd::{Kernel, dispatch};

/// A corner of the picture after non-maximum suppression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Corner {
    /// Column.
    pub x_px: u32,
    /// Row.
    pub y_px: u32,
    /// The largest threshold at which it is still a corner, in DN.
    pub score: u8,
}

/// Pixels at each edge that cannot be corners: the radius of the circle.
pub(crate) const BORDER_PX: usize = 3;
/// The circle, clockwise from straight below, as (column, row) offsets plus the border.
pub(crate) const CIRCLE: [(usize, usize); 16] = [
    (3, 6),
    (4, 6),
    (5, 5),
    (6, 4),
    (6, 3),
    (6, 2),
    (5, 1),
    (4, 0),
    (3, 0),
    (2, 0),
    (1, 1),
    (0, 2),
    (0, 3),
    (0, 4),
    (1, 5),
    (2, 6),
];
/// Pixels tested together before the network runs.
const BLOCK_PX: usize = 32;
/// One value for each pixel tested together.
type Block = [u8; BLOCK_PX];

/// Corners of a picture, by rows, then columns: score at least `threshold` and above all eight neighbours' scores.
///
/// Equal neighbours suppress each other, and so no corner of score 0 survives. Pictures under 7 pixels a side have none.
/// Its slow twin is the definition itself, in `tests/compute.rs`.
pub fn fast9(picture: &Plane<u8>, threshold: u8) -> Vec<Corner> {
    if picture.width_px() <= 2 * BORDER_PX || picture.height_px() <= 2 * BORDER_PX {
        return Vec::new();
    }
    dispatch(Detect { picture, threshold })
}

struct Detect<'a> {
    picture: &'a Plane<u8>,
    threshold: u8,
}

impl Kernel for Detect<'_> {
    type Output = Vec<Corner>;

    #[inline(always)]
    fn run(self) -> Vec<Corner> {
        let (width, height) = (self.picture.width_px(), self.picture.height_px());
        // Three rows of scores turn over; a row without scores is all zero, as the rows outside the border are.
        let mut scores = [vec![0_u8; width], vec![0_u8; width], vec![0_u8; width]];
        let mut peaks = vec![0_u8; width];
        let mut corners = Vec::new();
        for y in BORDER_PX..=height - BORDER_PX {
            scores.rotate_left(1);
            let [above, middle, below] = &mut scores;
            if y < height - BORDER_PX {
                let rows = std::array::from_fn(|row| self.picture.row(y + row - BORDER_PX));
                score_row(rows, self.threshold, below);
            } else {
                below.fill(0);
            }
            if y > BORDER_PX {
                suppress(above, middle, below, &mut peaks);
                collect(&peaks, y - 1, &mut corners);
            }
        }
        corners
    }
}

/// Scores of the middle one of seven rows; 0 where there is no corner.
#[inline(always)]
fn score_row(rows: [&[u8]; 7], threshold: u8, scores: &mut [u8]) {
    let mut x = 0;
    let inner = scores.len() - 2 * BORDER_PX;
    while x + BLOCK_PX <= inner {
        score_block(rows, x, threshold, scores);
        x += BLOCK_PX;
    }
    if x == inner {
        return;
    }
    if inner >= BLOCK_PX {
        // The last block overlaps the one before; both give the same scores.
        score_block(rows, inner - BLOCK_PX, threshold, scores);
    } else {
        for x in 0..inner {
            let circle = CIRCLE.map(|(dx, dy)| rows[dy][x + dx]);
            scores[x + BORDER_PX] = score(circle, rows[BORDER_PX][x + BORDER_PX], threshold);
        }
    }
}

#[inline(always)]
fn score_block(rows: [&[u8]; 7], x: usize, threshold: u8, scores: &mut [u8]) {
    let mut circle: [&Block; 16] = [block(rows[0], x); 16];
    for k in 0..16 {
        circle[k] = block(rows[CIRCLE[k].1], x + CIRCLE[k].0);
    }
    let centre = block(rows[BORDER_PX], x + BORDER_PX);
    let start = x + BORDER_PX;
    let scores: &mut Block = (&mut scores[start..start + BLOCK_PX]).try_into().expect("cut to this length");
    // Every arc of nine holds one end of each diameter, so a corner differs from its centre on all of them.
    let mut bright = highest(circle[0], circle[8]);
    let mut dark = lowest(circle[0], circle[8]);
    for k in [2, 4, 6] {
        bright = lowest(&bright, &highest(circle[k], circle[k + 8]));
        dark = highest(&dark, &lowest(circle[k], circle[k + 8]));
    }
    if !any_above(&difference(&bright, &dark, centre), threshold) {
        scores.fill(0);
        return;
    }
    let best = arc_differences(&circle, centre);
    for i in 0..BLOCK_PX {
        scores[i] = if best[i] > threshold { best[i] - 1 } else { 0 };
    }
}

/// `arc_difference` of a block of pixels: the same network with a loop for every node, which compilers turn into vectors.
#[inline(always)]
fn arc_differences(circle: &[&Block; 16], centre: &Block) -> Block {
    let (mut low2, mut high2) = ([[0; BLOCK_PX]; 8], [[0; BLOCK_PX]; 8]);
    for k in 0..8 {
        low2[k] = lowest(circle[2 * k + 1], circle[(2 * k + 2) % 16]);
        high2[k] = highest(circle[2 * k + 1], circle[(2 * k + 2) % 16]);
    }
    let (mut low4, mut high4) = ([[0; BLOCK_PX]; 8], [[0; BLOCK_PX]; 8]);
    for k in 0..8 {
        low4[k] = lowest(&low2[k], &low2[(k + 1) % 8]);
        high4[k] = highest(&high2[k], &high2[(k + 1) % 8]);
    }
    let (mut bright, mut dark) = ([0; BLOCK_PX], [u8::MAX; BLOCK_PX]);
    for k in 0..8 {
        let low8 = lowest(&low4[k], &low4[(k + 2) % 8]);
        let high8 = highest(&high4[k], &high4[(k + 2) % 8]);
        let (before, after) = (circle[2 * k], circle[(2 * k + 9) % 16]);
        bright = highest(&bright, &lowest(&low8, &highest(before, after)));
        dark = lowest(&dark, &highest(&high8, &lowest(before, after)));
    }
    difference(&bright, &dark, centre)
}

#[inline(always)]
fn lowest(a: &Block, b: &Block) -> Block {
    let mut least = [0; BLOCK_PX];
    for i in 0..BLOCK_PX {
        least[i] = a[i].min(b[i]);
    }
    least
}

#[inline(always)]
fn highest(a: &Block, b: &Block) -> Block {
    let mut most = [0; BLOCK_PX];
    for i in 0..BLOCK_PX {
        most[i] = a[i].max(b[i]);
    }
    most
}

#[inline(always)]
fn difference(bright: &Block, dark: &Block, centre: &Block) -> Block {
    let mut found = [0; BLOCK_PX];
    for i in 0..BLOCK_PX {
        found[i] = bright[i].saturating_sub(centre[i]).max(centre[i].saturating_sub(dark[i]));
    }
    found
}

#[inline(always)]
fn any_above(values: &Block, threshold: u8) -> bool {
    let mut above = 0;
    for value in values {
        above |= value.saturating_sub(threshold);
    }
    above != 0
}

#[inline(always)]
fn block(row: &[u8], x: usize) -> &Block {
    row[x..x + BLOCK_PX].try_into().expect("cut to this length")
}

/// The score of one pixel: the arcs' greatest difference less one where it is above the threshold, else 0.
#[inline(always)]
pub(crate) fn score(circle: [u8; 16], centre: u8, threshold: u8) -> u8 {
    let difference = arc_difference(circle, centre);
    if difference > threshold { difference - 1 } else { 0 }
}

/// The greatest, over all arcs of nine, of the least difference to the centre (brighter or darker), 0 if none differs.
#[inline(always)]
pub(crate) fn arc_difference(circle: [u8; 16], centre: u8) -> u8 {
    // The 8-runs from odd places, each with either of the two pixels next to it, are all sixteen arcs.
    let mut bright = 0;
    let mut dark = u8::MAX;
    let at = |k: usize| circle[k % 16];
    let low2: [u8; 8] = std::array::from_fn(|k| at(2 * k + 1).min(at(2 * k + 2)));
    let high2: [u8; 8] = std::array::from_fn(|k| at(2 * k + 1).max(at(2 * k + 2)));
    let low4: [u8; 8] = std::array::from_fn(|k| low2[k].min(low2[(k + 1) % 8]));
    let high4: [u8; 8] = std::array::from_fn(|k| high2[k].max(high2[(k + 1) % 8]));
    for k in 0..8 {
        let low8 = low4[k].min(low4[(k + 2) % 8]);
        let high8 = high4[k].max(high4[(k + 2) % 8]);
        let (before, after) = (at(2 * k), at(2 * k + 9));
        bright = bright.max(low8.min(before.max(after)));
        dark = dark.min(high8.max(before.min(after)));
    }
    bright.saturating_sub(centre).max(centre.saturating_sub(dark))
}

/// Keeps the scores that are above all eight neighbours.
#[inline(always)]
fn suppress(above: &[u8], middle: &[u8], below: &[u8], peaks: &mut [u8]) {
    let inner = middle.len() - 2;
    let (above, middle, below) = (&above[..inner + 2], &middle[..inner + 2], &below[..inner + 2]);
    let peaks = &mut peaks[1..=inner];
    for x in 0..inner {
        let sides = middle[x].max(middle[x + 2]);
        let rows = above[x].max(above[x + 1]).max(above[x + 2]).max(below[x].max(below[x + 1]).max(below[x + 2]));
        peaks[x] = if middle[x + 1] > sides.max(rows) { middle[x + 1] } else { 0 };
    }
}

#[inline(always)]
fn collect(peaks: &[u8], y: usize, corners: &mut Vec<Corner>) {
    for (start, part) in peaks.chunks(16).enumerate() {
        if part.iter().fold(0, |any, &score| any | score) == 0 {
            continue;
        }
        for (x, &score) in part.iter().enumerate().filter(|&(_, &score)| score > 0) {
            corners.push(Corner { x_px: u32_from(start * 16 + x), y_px: u32_from(y), score });
        }
    }
}

/// The unsuppressed arc difference around a pixel, for fits; 0 where the circle leaves the picture.
pub(crate) fn arc_difference_at(picture: &Plane<u8>, x_px: u32, y_px: u32) -> u8 {
    let (x, y) = (index(x_px), index(y_px));
    let inside = |place: usize, side: usize| place >= BORDER_PX && place + BORDER_PX < side;
    if !inside(x, picture.width_px()) || !inside(y, picture.height_px()) {
        return 0;
    }
    let circle = CIRCLE.map(|(dx, dy)| picture.at(x + dx - BORDER_PX, y + dy - BORDER_PX));
    arc_difference(circle, picture.at(x, y))
}
