//! How a picture moves. Enters: a camera, its motion, what it sees. Leaves: velocities at the corners of blocks of pixels, and how those of
//! points change on their ways.

use super::passes::collected;
use super::ride::{Change, Corners, Riding, SIDE, Velocities};
use super::sums::{greater, lesser};
use crate::num::{f32_from_u32, f64_from_usize, index, u32_from, u32_truncated_f32};
use crate::scene::lanes::LANES;
use crate::simd::dispatch;

/// Instants of an exposure between which turns are seen to change, and the one that blocks stand at.
const INSTANTS: [f32; 3] = [1.0 / 64.0, 63.0 / 64.0, 0.5];

/// Most that the velocities of neighbouring corners may differ by along both axes together, in sides of a block: from 2 on, the map
/// over half of an exposure may fold.
const APART_MAX: f32 = 1.0;

/// A corner of a block.
#[derive(Clone, Copy, Debug)]
struct Corner {
    at_px: [f32; 2],
    /// How samples go along.
    near_px: [f32; 2],
    /// How what is infinitely far moves, and how that changes over the exposure.
    far_px: [f32; 2],
    drift_px: [f32; 2],
}

/// How the picture moves at the corners of blocks, some of which lie beyond it.
pub struct Grid {
    /// Blocks beyond each side of the picture.
    pub margins: [usize; 2],
    /// Blocks in a row, and rows of them, with those.
    pub blocks: [usize; 2],
    /// Blocks within the picture.
    within: [usize; 2],
    /// Of these, row by row.
    corners: Vec<Corner>,
    /// Most of the surfaces' velocities along either axis, in pixels an exposure.
    pub most_px: [f32; 2],
    /// The most that the way of a point bends, and that its bend does, over an exposure, in pixels.
    pub bends_px: [f32; 2],
    /// Rays that it took.
    pub rays: usize,
}

fn difference(a: [f32; 2], b: [f32; 2]) -> [f32; 2] {
    [a[0] - b[0], a[1] - b[1]]
}

fn length([x, y]: [f32; 2]) -> f32 {
    (x * x + y * y).sqrt()
}

impl Grid {
    /// Of a picture of so many columns and rows; none where nothing has a bearing.
    pub fn of(riding: &Riding, size_px: [usize; 2]) -> Option<Self> {
        let within = size_px.map(|size| size.div_ceil(SIDE));
        let (across, count) = (within[0] + 1, (within[0] + 1) * (within[1] + 1));
        let place = |number: usize| {
            let at = number.min(count - 1);
            let at = [at % across, at / across];
            // Beyond the picture there is nothing to see.
            [0, 1].map(|axis| f32_from_u32(u32_from((at[axis] * SIDE).min(size_px[axis] - 1))))
        };
        let packet = |packet: usize| {
            let at_px = std::array::from_fn(|lane| place(packet * LANES + lane));
            let at = INSTANTS.map(|t| dispatch(Corners { riding, at_px, t }));
            std::array::from_fn::<_, LANES, _>(|lane| corner(at_px[lane], at.map(|lanes| lanes[lane])))
        };
        let mut corners = collected(count.div_ceil(LANES), packet).concat();
        corners.truncate(count);
        let corners = filled(&corners, place)?;
        let most = |axis: usize| corners.iter().map(|corner| corner.near_px[axis].abs()).fold(0.0, greater);
        let most_px = [most(0), most(1)];
        // Samples go half of the motion either way.
        let margins = most_px.map(|most| index(u32_truncated_f32(0.5 * most)).div_ceil(SIDE) + 1);
        let blocks = [0, 1].map(|axis| within[axis] + 2 * margins[axis]);
        let (bends_px, rays) = ([0.0; 2], INSTANTS.len() * count);
        let mut grid = Self { margins, blocks, within, corners, most_px, bends_px, rays };
        grid.bends_px = grid.bends();
        grid.smooth();
        Some(grid)
    }

    /// Brings the velocities that samples follow nearer to their mean, as far as the map is never to fold.
    fn smooth(&mut self) {
        let across = self.within[0] + 1;
        let mut most = 0.0_f32;
        for (number, corner) in self.corners.iter().enumerate() {
            for other in [number + 1, number + across] {
                let is_beside = other < self.corners.len() && (other == number + across || other % across > 0);
                if is_beside {
                    let [x, y] = difference(self.corners[other].near_px, corner.near_px);
                    most = greater(most, x.abs() + y.abs());
                }
            }
        }
        let side = f32_from_u32(u32_from(SIDE));
        let kept = APART_MAX * side / greater(most, APART_MAX * side);
        let per = 1.0 / f32_from_u32(u32_from(self.corners.len()));
        let mean = [0, 1].map(|axis| self.corners.iter().map(|corner| corner.near_px[axis] * per).sum::<f32>());
        for corner in &mut self.corners {
            for axis in 0..2 {
                corner.near_px[axis] = mean[axis] + (corner.near_px[axis] - mean[axis]) * kept;
            }
        }
    }

    /// A corner; beyond the picture the one at its rim.
    fn at(&self, corner: [usize; 2]) -> &Corner {
        let [column, row] = [0, 1].map(|axis| corner[axis].saturating_sub(self.margins[axis]).min(self.within[axis]));
        &self.corners[row * (self.within[0] + 1) + column]
    }

    /// Velocities that samples follow at the corners of a block.
    pub fn velocities_px(&self, [x, y]: [usize; 2]) -> [[f32; 2]; 4] {
        [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[right, down]| self.at([x + right, y + down]).near_px)
    }

    /// Place of a corner in the picture, in pixels.
    pub fn place_px(&self, corner: [usize; 2]) -> [f32; 2] {
        [0, 1]
            .map(|axis| f32_from_u32(u32_from(corner[axis] * SIDE)) - f32_from_u32(u32_from(self.margins[axis] * SIDE)))
    }

    /// How velocities change on ways through a block; beyond the picture as at its rim.
    pub fn change(&self, block: [usize; 2]) -> Change {
        let [x, y] =
            [0, 1].map(|axis| block[axis].clamp(self.margins[axis], self.margins[axis] + self.within[axis] - 1));
        let [from, right, down, both] =
            [[0, 0], [1, 0], [0, 1], [1, 1]].map(|[more_x, more_y]| self.at([x + more_x, y + more_y]));
        // A picture may end with a pixel of a block.
        let side = |axis: usize| greater(both.at_px[axis] - from.at_px[axis], 1.0);
        let growth = [0, 1].map(|axis| {
            let [from, right, down, both] = [from, right, down, both].map(|corner| corner.far_px[axis]);
            [0.5 * (right - from + both - down) / side(0), 0.5 * (down - from + both - right) / side(1)]
        });
        let drift_px = [0, 1].map(|axis| {
            0.25 * (from.drift_px[axis] + right.drift_px[axis] + down.drift_px[axis] + both.drift_px[axis])
        });
        Change { growth, drift_px }
    }

    /// How far the picture moves over the exposure, in pixels, in the mean.
    pub fn speed_px(&self) -> f64 {
        let sum: f64 = self.corners.iter().map(|corner| f64::from(length(corner.near_px))).sum();
        sum / f64_from_usize(self.corners.len())
    }

    fn bends(&self) -> [f32; 2] {
        let mut most = [0.0; 2];
        for row in 0..self.within[1] {
            for column in 0..self.within[0] {
                let block = [column + self.margins[0], row + self.margins[1]];
                let change = self.change(block);
                let once = change.bend_px(self.at(block).near_px);
                let twice = difference(change.bend_px(once), change.drift_px);
                most = [greater(most[0], length(once)), greater(most[1], length(twice))];
            }
        }
        most
    }
}

fn corner(at_px: [f32; 2], [early, late, amid]: [Option<Velocities>; 3]) -> Option<Corner> {
    let (early, late, Velocities { near_px, far_px }) = (early?, late?, amid?);
    let per = 1.0 / (INSTANTS[1] - INSTANTS[0]);
    let drift_px = difference(late.far_px, early.far_px).map(|change| change * per);
    Some(Corner { at_px, near_px, far_px, drift_px })
}

/// Lets corners without a bearing move as the nearest that has one does.
fn filled(corners: &[Option<Corner>], place: impl Fn(usize) -> [f32; 2]) -> Option<Vec<Corner>> {
    let nearest = |at_px: [f32; 2]| {
        let mut best: Option<(f32, &Corner)> = None;
        for corner in corners.iter().flatten() {
            let apart = length(difference(corner.at_px, at_px));
            if best.is_none_or(|(least, _)| lesser(apart, least) < least) {
                best = Some((apart, corner));
            }
        }
        best.map(|(_, corner)| Corner { at_px, ..*corner })
    };
    let one = |(number, corner): (usize, &Option<Corner>)| corner.or_else(|| nearest(place(number)));
    corners.iter().enumerate().map(one).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn grid(near_px: impl Fn(usize, usize) -> [f32; 2]) -> Grid {
        let corner = |number: usize| {
            let (x, y) = (number % 4, number / 4);
            let at_px = [x, y].map(|place| f32_from_u32(u32_from(place * SIDE)));
            let far_px = [0.02 * at_px[0] + 3.0, -0.01 * at_px[0] + 0.04 * at_px[1]];
            Corner { at_px, near_px: near_px(x, y), far_px, drift_px: [0.5, -0.25] }
        };
        let corners = (0..16).map(corner).collect();
        let (margins, blocks, within) = ([1, 1], [5, 5], [3, 3]);
        Grid { margins, blocks, within, corners, most_px: [0.0; 2], bends_px: [0.0; 2], rays: 0 }
    }

    #[test]
    fn neighbours_never_part_so_far_that_blocks_fold() {
        // A panel that goes 84 px before a wall that goes 10.
        let mut folding = grid(|x, _| if x < 2 { [84.0, 1.0] } else { [10.0, 1.0] });
        folding.smooth();
        for block in 0..25 {
            let [from, right, down, both] = folding.velocities_px([block % 5, block / 5]);
            for [a, b] in [[from, right], [down, both], [from, down], [right, both]] {
                let [x, y] = difference(a, b);
                assert!(x.abs() + y.abs() <= 16.001, "{a:?} {b:?}");
            }
        }
        let speeds: Vec<f32> = folding.corners.iter().map(|corner| corner.near_px[0]).collect();
        assert!((speeds.iter().sum::<f32>() / 16.0 - 47.0).abs() < 1e-3 && speeds[0] - speeds[3] > 15.9, "{speeds:?}");
        // What is even enough stays.
        let mut even = grid(|x, y| [3.0 * f32_from_u32(u32_from(x)), f32_from_u32(u32_from(y))]);
        even.smooth();
        assert_eq!(even.velocities_px([2, 2])[3], [6.0, 2.0]);
    }

    #[test]
    fn ways_change_as_the_turn_does() {
        let grid = grid(|_, _| [4.0, 0.0]);
        for block in [[0, 0], [2, 3], [4, 4]] {
            let Change { growth, drift_px } = grid.change(block);
            let expected = [[0.02, 0.0], [-0.01, 0.04]];
            for (row, expected) in growth.iter().zip(expected) {
                assert!((0..2).all(|axis| (row[axis] - expected[axis]).abs() < 1e-6), "{growth:?}");
            }
            assert_eq!(drift_px, [0.5, -0.25]);
        }
        // 4 px through 0.02 and -0.01, and the drift; then that through the growth.
        let [once, twice] = grid.bends();
        assert!((once - length([0.58, -0.29])).abs() < 1e-5, "{once}");
        assert!((twice - length([0.02 * 0.58, -0.01 * 0.58 - 0.04 * 0.29])).abs() < 1e-5, "{twice}");
    }

    #[test]
    fn corners_without_a_bearing_move_as_the_nearest_does() {
        let grid = grid(|x, y| [f32_from_u32(u32_from(x)), f32_from_u32(u32_from(y))]);
        let place = |number: usize| grid.corners[number].at_px;
        let seen: Vec<Option<Corner>> =
            grid.corners.iter().enumerate().map(|(number, corner)| (number % 4 > 0).then_some(*corner)).collect();
        let all = filled(&seen, place).unwrap();
        assert_eq!((all[8].near_px, all[8].at_px), ([1.0, 2.0], [0.0, 32.0]));
        assert!(filled(&[None; 16], place).is_none());
    }
}
