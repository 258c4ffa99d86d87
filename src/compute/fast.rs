//! FAST-9/16 with its score and strict non-maximum suppression. Finds the corners of a picture of words, row by row.
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
pub const BORDER_PX: usize = 3;
/// The circle, clockwise from straight below, as (column, row) offsets plus the border.
pub const CIRCLE: [(usize, usize); 16] = [
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

/// Scores of a row, 0 where there is no corner, and which of its blocks hold any.
struct ScoreRow<W> {
    scores: Vec<W>,
    holds: Vec<bool>,
}

impl<W: Word> Kernel for Detect<'_, W> {
    type Output = Vec<Corner>;

    #[inline(always)]
    fn run(self) -> Vec<Corner> {
        let (width, height) = (self.picture.width_px(), self.picture.height_px());
        let starts = block_starts(width);
        let empty = || ScoreRow { scores: vec![W::default(); width], holds: vec![false; starts.len().max(1)] };
        // Three rows of scores turn over; a row without scores is all zero, as the rows outside the border are.
        let mut rows = [empty(), empty(), empty()];
        let mut corners = Vec::new();
        for y in BORDER_PX..=height - BORDER_PX {
            rows.rotate_left(1);
            let [above, middle, below] = &mut rows;
            if y < height - BORDER_PX {
                let rows = std::array::from_fn(|row| self.picture.row(y + row - BORDER_PX));
                score_row(rows, &starts, self.threshold, below);
            } else {
                below.scores.fill(W::default());
            }
            if y > BORDER_PX {
                let rows = [&above.scores[..], &middle.scores[..], &below.scores[..]];
                if starts.is_empty() {
                    peaks_one_by_one(rows, y - 1, &mut corners);
                } else {
                    peaks(rows, &starts, &middle.holds, y - 1, &mut corners);
                }
            }
        }
        corners
    }
}

/// Where blocks begin, less the border; the last one overlaps the one before. Rows narrower than a block have none.
fn block_starts(width: usize) -> Vec<usize> {
    let inner = width - 2 * BORDER_PX;
    let mut starts: Vec<usize> = (0..inner / BLOCK_PX).map(|block| block * BLOCK_PX).collect();
    if inner > BLOCK_PX && !inner.is_multiple_of(BLOCK_PX) {
        starts.push(inner - BLOCK_PX);
    }
    starts
}

/// Scores of the middle one of seven rows.
#[inline(always)]
fn score_row<W: Word>(rows: [&[W]; 7], starts: &[usize], threshold: W, row: &mut ScoreRow<W>) {
    for (&x, holds) in starts.iter().zip(&mut row.holds) {
        let start = x + BORDER_PX;
        let scores: &mut Block<W> = (&mut row.scores[start..start + BLOCK_PX]).try_into().expect("cut to this length");
        if score_block(rows, x, threshold, scores) {
            *holds = true;
        } else if *holds {
            // What this row held three rows ago.
            scores.fill(W::default());
            *holds = false;
        }
    }
    if starts.is_empty() {
        for x in 0..row.scores.len() - 2 * BORDER_PX {
            let circle = CIRCLE.map(|(dx, dy)| rows[dy][x + dx]);
            row.scores[x + BORDER_PX] = score(circle, rows[BORDER_PX][x + BORDER_PX], threshold);
        }
    }
}

/// Scores of a block, if one of its pixels may be a corner; else it says no and leaves them as they are.
///
/// Each pass is one loop with a long body over a fixed number of pixels, which compilers turn into one run of vectors.
#[inline(always)]
fn score_block<W: Word>(rows: [&[W]; 7], x: usize, threshold: W, scores: &mut Block<W>) -> bool {
    let mut circle: [&Block<W>; 16] = [block(rows[0], x); 16];
    for k in 0..16 {
        circle[k] = block(rows[CIRCLE[k].1], x + CIRCLE[k].0);
    }
    let centre = block(rows[BORDER_PX], x + BORDER_PX);
    // Every arc of nine holds one end of each diameter, so a corner differs from its centre on all of them.
    let mut above = W::default();
    for i in 0..BLOCK_PX {
        let (mut bright, mut dark) = (W::MAX, W::default());
        for k in 0..8 {
            bright = bright.min(circle[k][i].max(circle[k + 8][i]));
            dark = dark.max(circle[k][i].min(circle[k + 8][i]));
        }
        above = above | bright.less(centre[i]).max(centre[i].less(dark)).less(threshold);
    }
    if above == W::default() {
        return false;
    }
    for i in 0..BLOCK_PX {
        let mut values = [W::default(); 16];
        for k in 0..16 {
            values[k] = circle[k][i];
        }
        scores[i] = score(values, centre[i], threshold);
    }
    true
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
    // The 8-runs from odd indices, each with either of the two pixels next to it, are all sixteen arcs.
    let (mut low2, mut high2) = ([W::default(); 8], [W::default(); 8]);
    for k in 0..8 {
        low2[k] = circle[2 * k + 1].min(circle[(2 * k + 2) % 16]);
        high2[k] = circle[2 * k + 1].max(circle[(2 * k + 2) % 16]);
    }
    let (mut low4, mut high4) = ([W::default(); 8], [W::default(); 8]);
    for k in 0..8 {
        low4[k] = low2[k].min(low2[(k + 1) % 8]);
        high4[k] = high2[k].max(high2[(k + 1) % 8]);
    }
    let (mut bright, mut dark) = (W::default(), W::MAX);
    for k in 0..8 {
        let low8 = low4[k].min(low4[(k + 2) % 8]);
        let high8 = high4[k].max(high4[(k + 2) % 8]);
        let (before, after) = (circle[2 * k], circle[(2 * k + 9) % 16]);
        bright = bright.max(low8.min(before.max(after)));
        dark = dark.min(high8.max(before.min(after)));
    }
    bright.less(centre).max(centre.less(dark))
}

/// Corners of the middle one of three rows of scores: those above all eight neighbours. Blocks that hold no score are left out.
#[inline(always)]
fn peaks<W: Word>(rows: [&[W]; 3], starts: &[usize], holds: &[bool], y: usize, corners: &mut Vec<Corner>) {
    let mut done = 0;
    for (&x, _) in starts.iter().zip(holds).filter(|&(_, &holds)| holds) {
        let at = |row: usize, dx: usize| block(rows[row], x + BORDER_PX + dx - 1);
        let (middle, left, right) = (at(1, 1), at(1, 0), at(1, 2));
        let (upper, lower) = ([at(0, 0), at(0, 1), at(0, 2)], [at(2, 0), at(2, 1), at(2, 2)]);
        let mut above: Block<W> = [W::default(); BLOCK_PX];
        let mut any = W::default();
        for i in 0..BLOCK_PX {
            let rows = upper[0][i].max(upper[1][i]).max(upper[2][i]).max(lower[0][i].max(lower[1][i]).max(lower[2][i]));
            above[i] = middle[i].less(left[i].max(right[i]).max(rows));
            any = any | above[i];
        }
        if any != W::default() {
            // The last block overlaps the one before, whose corners are listed.
            for i in done.max(x) - x..BLOCK_PX {
                if above[i] > W::default() {
                    corners.push(corner(x + BORDER_PX + i, y, middle[i]));
                }
            }
        }
        done = x + BLOCK_PX;
    }
}

/// The same for rows that are narrower than a block.
#[inline(always)]
fn peaks_one_by_one<W: Word>(rows: [&[W]; 3], y: usize, corners: &mut Vec<Corner>) {
    for x in 1..rows[1].len() - 1 {
        let around = |row: usize| rows[row][x - 1].max(rows[row][x + 1]);
        let columns = rows[0][x].max(rows[2][x]);
        if rows[1][x] > around(0).max(around(1)).max(around(2)).max(columns) {
            corners.push(corner(x, y, rows[1][x]));
        }
    }
}

#[inline(always)]
fn corner<W: Word>(x: usize, y: usize, score: W) -> Corner {
    Corner { x_px: u32_from(x), y_px: u32_from(y), score: low_u16(score.number()) }
}

/// The unsuppressed arc difference around a pixel, for fits; 0 where the circle leaves the picture.
pub fn arc_difference_at<W: Word>(picture: &Plane<W>, x_px: u32, y_px: u32) -> W {
    let (x, y) = (index(x_px), index(y_px));
    let inside = |position_px: usize, side_px: usize| position_px >= BORDER_PX && position_px + BORDER_PX < side_px;
    if !inside(x, picture.width_px()) || !inside(y, picture.height_px()) {
        return W::default();
    }
    let circle = CIRCLE.map(|(dx, dy)| picture.at(x + dx - BORDER_PX, y + dy - BORDER_PX));
    arc_difference(circle, picture.at(x, y))
}
