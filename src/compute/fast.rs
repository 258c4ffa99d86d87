//! FAST-9/16 with its score and strict non-maximum suppression. Enters: a picture of words. Leaves: corners, by rows.
//!
//! A pixel is a corner at threshold t if nine neighbouring pixels of the 16 on a circle of radius 3 are all brighter than
//! the centre plus t, or all darker than the centre minus t (Rosten and Drummond 2006). The score is the largest such t.
//! Brightest arc minimum and darkest arc maximum are found by a network of minima and maxima of words without branches, so a
//! row is one vector loop; rows in which a block of pixels cannot hold a corner skip it after a short test.

use super::word::Word;
use crate::num::{index, low_u16, u32_from};
use crate::plane::Plane;
use crate::simd::{Kernel, dispatch};

/// A corner of the picture after non-maximum suppression.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Corner {
    /// Column.
    pub x_px: u32,
    /// Row.
    pub y_px: u32,
    /// The largest threshold at which it is still a corner, in DN of the pipeline.
    pub score: u16,
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
type Block<W> = [W; BLOCK_PX];

/// Corners of a picture, by rows, then columns: score at least `threshold` and above all eight neighbours' scores.
///
/// Equal neighbours suppress each other, and so no corner of score 0 survives. Pictures under 7 pixels a side have none.
/// Its slow twin is the definition itself, in `tests/compute.rs`.
pub fn fast9<W: Word>(picture: &Plane<W>, threshold: W) -> Vec<Corner> {
    if picture.width_px() <= 2 * BORDER_PX || picture.height_px() <= 2 * BORDER_PX {
        return Vec::new();
    }
    dispatch(Detect { picture, threshold })
}

struct Detect<'a, W> {
    picture: &'a Plane<W>,
    threshold: W,
}

impl<W: Word> Kernel for Detect<'_, W> {
    type Output = Vec<Corner>;

    #[inline(always)]
    fn run(self) -> Vec<Corner> {
        let (width, height) = (self.picture.width_px(), self.picture.height_px());
        // Three rows of scores turn over; a row without scores is all zero, as the rows outside the border are.
        let zero = W::default();
        let mut scores = [vec![zero; width], vec![zero; width], vec![zero; width]];
        let mut peaks = vec![zero; width];
        let mut corners = Vec::new();
        for y in BORDER_PX..=height - BORDER_PX {
            scores.rotate_left(1);
            let [above, middle, below] = &mut scores;
            if y < height - BORDER_PX {
                let rows = std::array::from_fn(|row| self.picture.row(y + row - BORDER_PX));
                score_row(rows, self.threshold, below);
            } else {
                below.fill(zero);
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
fn score_row<W: Word>(rows: [&[W]; 7], threshold: W, scores: &mut [W]) {
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
fn score_block<W: Word>(rows: [&[W]; 7], x: usize, threshold: W, scores: &mut [W]) {
    let mut circle: [&Block<W>; 16] = [block(rows[0], x); 16];
    for k in 0..16 {
        circle[k] = block(rows[CIRCLE[k].1], x + CIRCLE[k].0);
    }
    let centre = block(rows[BORDER_PX], x + BORDER_PX);
    let start = x + BORDER_PX;
    let scores: &mut Block<W> = (&mut scores[start..start + BLOCK_PX]).try_into().expect("cut to this length");
    // Every arc of nine holds one end of each diameter, so a corner differs from its centre on all of them.
    let mut bright = highest(circle[0], circle[8]);
    let mut dark = lowest(circle[0], circle[8]);
    for k in [2, 4, 6] {
        bright = lowest(&bright, &highest(circle[k], circle[k + 8]));
        dark = highest(&dark, &lowest(circle[k], circle[k + 8]));
    }
    if !any_above(&difference(&bright, &dark, centre), threshold) {
        scores.fill(W::default());
        return;
    }
    let best = arc_differences(&circle, centre);
    for i in 0..BLOCK_PX {
        scores[i] = if best[i] > threshold { best[i].less(W::low(1)) } else { W::default() };
    }
}

/// `arc_difference` of a block of pixels: the same network with a loop for every node, which compilers turn into vectors.
#[inline(always)]
fn arc_differences<W: Word>(circle: &[&Block<W>; 16], centre: &Block<W>) -> Block<W> {
    let (mut low2, mut high2) = ([[W::default(); BLOCK_PX]; 8], [[W::default(); BLOCK_PX]; 8]);
    for k in 0..8 {
        low2[k] = lowest(circle[2 * k + 1], circle[(2 * k + 2) % 16]);
        high2[k] = highest(circle[2 * k + 1], circle[(2 * k + 2) % 16]);
    }
    let (mut low4, mut high4) = ([[W::default(); BLOCK_PX]; 8], [[W::default(); BLOCK_PX]; 8]);
    for k in 0..8 {
        low4[k] = lowest(&low2[k], &low2[(k + 1) % 8]);
        high4[k] = highest(&high2[k], &high2[(k + 1) % 8]);
    }
    let (mut bright, mut dark) = ([W::default(); BLOCK_PX], [W::MAX; BLOCK_PX]);
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
fn lowest<W: Word>(a: &Block<W>, b: &Block<W>) -> Block<W> {
    let mut least = [W::default(); BLOCK_PX];
    for i in 0..BLOCK_PX {
        least[i] = a[i].min(b[i]);
    }
    least
}

#[inline(always)]
fn highest<W: Word>(a: &Block<W>, b: &Block<W>) -> Block<W> {
    let mut most = [W::default(); BLOCK_PX];
    for i in 0..BLOCK_PX {
        most[i] = a[i].max(b[i]);
    }
    most
}

#[inline(always)]
fn difference<W: Word>(bright: &Block<W>, dark: &Block<W>, centre: &Block<W>) -> Block<W> {
    let mut found = [W::default(); BLOCK_PX];
    for i in 0..BLOCK_PX {
        found[i] = bright[i].less(centre[i]).max(centre[i].less(dark[i]));
    }
    found
}

#[inline(always)]
fn any_above<W: Word>(values: &Block<W>, threshold: W) -> bool {
    let mut most = W::default();
    for &value in values {
        most = most.max(value);
    }
    most > threshold
}

#[inline(always)]
fn block<W: Word>(row: &[W], x: usize) -> &Block<W> {
    row[x..x + BLOCK_PX].try_into().expect("cut to this length")
}

/// The score of one pixel: the arcs' greatest difference less one where it is above the threshold, else 0.
#[inline(always)]
fn score<W: Word>(circle: [W; 16], centre: W, threshold: W) -> W {
    let difference = arc_difference(circle, centre);
    if difference > threshold { difference.less(W::low(1)) } else { W::default() }
}

/// The greatest, over all arcs of nine, of the least difference to the centre (brighter or darker), 0 if none differs.
#[inline(always)]
pub fn arc_difference<W: Word>(circle: [W; 16], centre: W) -> W {
    // The 8-runs from odd places, each with either of the two pixels next to it, are all sixteen arcs.
    let mut bright = W::default();
    let mut dark = W::MAX;
    let at = |k: usize| circle[k % 16];
    let low2: [W; 8] = std::array::from_fn(|k| at(2 * k + 1).min(at(2 * k + 2)));
    let high2: [W; 8] = std::array::from_fn(|k| at(2 * k + 1).max(at(2 * k + 2)));
    let low4: [W; 8] = std::array::from_fn(|k| low2[k].min(low2[(k + 1) % 8]));
    let high4: [W; 8] = std::array::from_fn(|k| high2[k].max(high2[(k + 1) % 8]));
    for k in 0..8 {
        let low8 = low4[k].min(low4[(k + 2) % 8]);
        let high8 = high4[k].max(high4[(k + 2) % 8]);
        let (before, after) = (at(2 * k), at(2 * k + 9));
        bright = bright.max(low8.min(before.max(after)));
        dark = dark.min(high8.max(before.min(after)));
    }
    bright.less(centre).max(centre.less(dark))
}

/// Keeps the scores that are above all eight neighbours.
#[inline(always)]
fn suppress<W: Word>(above: &[W], middle: &[W], below: &[W], peaks: &mut [W]) {
    let inner = middle.len() - 2;
    let (above, middle, below) = (&above[..inner + 2], &middle[..inner + 2], &below[..inner + 2]);
    let peaks = &mut peaks[1..=inner];
    for x in 0..inner {
        let sides = middle[x].max(middle[x + 2]);
        let rows = above[x].max(above[x + 1]).max(above[x + 2]).max(below[x].max(below[x + 1]).max(below[x + 2]));
        peaks[x] = if middle[x + 1] > sides.max(rows) { middle[x + 1] } else { W::default() };
    }
}

#[inline(always)]
fn collect<W: Word>(peaks: &[W], y: usize, corners: &mut Vec<Corner>) {
    let none = W::default();
    for (start, part) in peaks.chunks(16).enumerate() {
        if part.iter().all(|&score| score == none) {
            continue;
        }
        for (x, &score) in part.iter().enumerate().filter(|&(_, &score)| score > none) {
            corners.push(Corner { x_px: u32_from(start * 16 + x), y_px: u32_from(y), score: low_u16(score.number()) });
        }
    }
}

/// The unsuppressed arc difference around a pixel, for fits; 0 where the circle leaves the picture.
pub fn arc_difference_at<W: Word>(picture: &Plane<W>, x_px: u32, y_px: u32) -> W {
    let (x, y) = (index(x_px), index(y_px));
    let inside = |place: usize, side: usize| place >= BORDER_PX && place + BORDER_PX < side;
    if !inside(x, picture.width_px()) || !inside(y, picture.height_px()) {
        return W::default();
    }
    let circle = CIRCLE.map(|(dx, dy)| picture.at(x + dx - BORDER_PX, y + dy - BORDER_PX));
    arc_difference(circle, picture.at(x, y))
}
