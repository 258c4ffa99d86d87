//! The part of a picture that one pixel sees: the exact area that a polygon covers of each pixel of the picture, and means over it.

use glam::DVec2;

use crate::num::{f64_from_usize, i64_truncated, index, u32_truncated};
use crate::scene::images::Picture;
use crate::scene::light::BANDS;
use crate::units::Size;

/// Area of a polygon, whichever way round it runs (Gauss's formula, from the first corner so that far corners cost no digits).
pub(super) fn area(polygon: &[DVec2]) -> f64 {
    let Some(&origin) = polygon.first() else { return 0.0 };
    let twice: f64 = polygon.windows(2).map(|pair| (pair[0] - origin).perp_dot(pair[1] - origin)).sum();
    0.5 * twice.abs()
}

/// The part of a polygon within the picture (Sutherland and Hodgman 1974; exact for convex ones, as pixels are).
pub(super) fn clipped(polygon: &[DVec2], size: Size) -> Vec<DVec2> {
    let (width, height) = (f64::from(size.width_px), f64::from(size.height_px));
    let mut polygon = polygon.to_vec();
    let is_inside = |at: &DVec2| at.x >= 0.0 && at.y >= 0.0 && at.x <= width && at.y <= height;
    if polygon.iter().all(is_inside) {
        return polygon;
    }
    // Coordinates along an inner normal: at least 0 inside.
    let sides: [&dyn Fn(DVec2) -> f64; 4] = [&|at| at.x, &|at| width - at.x, &|at| at.y, &|at| height - at.y];
    for depth in sides {
        let mut kept = Vec::with_capacity(polygon.len() + 1);
        for (number, &to) in polygon.iter().enumerate() {
            let from = polygon[(number + polygon.len() - 1) % polygon.len()];
            let (before, after) = (depth(from), depth(to));
            if (before < 0.0) != (after < 0.0) {
                kept.push(from + (to - from) * (before / (before - after)));
            }
            if after >= 0.0 {
                kept.push(to);
            }
        }
        polygon = kept;
    }
    // Rounding of a crossing may leave it outside by its last digits.
    polygon.into_iter().map(|at| at.clamp(DVec2::ZERO, DVec2::new(width, height))).collect()
}

/// The same area with its width and height brought up to one pixel of the picture where they are less; none where they are not.
pub(super) fn widened(quad: &[DVec2; 4]) -> Option<[DVec2; 4]> {
    let [top_left, top_right, bottom_left, bottom_right] = *quad;
    let across = 0.5 * ((top_right - top_left) + (bottom_right - bottom_left));
    let down = 0.5 * ((bottom_left - top_left) + (bottom_right - top_right));
    let [wider, higher] = [across, down].map(|edge| crate::num::greater(1.0, 1.0 / edge.length()));
    if wider == 1.0 && higher == 1.0 || !(wider.is_finite() && higher.is_finite()) {
        return None;
    }
    let centre = 0.25 * (top_left + top_right + bottom_left + bottom_right);
    let twist = 0.25 * (top_left - top_right - bottom_left + bottom_right);
    let (half_across, half_down) = (0.5 * wider * across, 0.5 * higher * down);
    Some([
        centre - half_across - half_down + twist,
        centre + half_across - half_down - twist,
        centre - half_across + half_down - twist,
        centre + half_across + half_down + twist,
    ])
}

/// How much of each pixel of a rectangle of the picture a polygon covers.
#[derive(Debug, Default)]
pub(super) struct Coverage {
    first: [usize; 2],
    columns: usize,
    /// Row by row, with two columns more for what accumulates beyond the last.
    areas: Vec<f64>,
    total: f64,
}

impl Coverage {
    /// Takes a polygon within the picture. Each edge adds, to the cells that it crosses and all to their right, the area between it and the
    /// cell's right side: signed, so that area outside cancels.
    pub fn set(&mut self, polygon: &[DVec2]) {
        let Some(&origin) = polygon.first() else {
            (self.columns, self.total) = (0, 0.0);
            self.areas.clear();
            return;
        };
        let (least, most) = polygon.iter().fold((origin, origin), |(least, most), &at| (least.min(at), most.max(at)));
        let whole = |value: f64| index(u32_truncated(value));
        self.first = [whole(least.x), whole(least.y)];
        let last = [whole(most.x.ceil()), whole(most.y.ceil())];
        self.columns = (last[0] - self.first[0]).max(1);
        let rows = (last[1] - self.first[1]).max(1);
        self.areas.clear();
        self.areas.resize(rows * (self.columns + 2), 0.0);
        let corner = DVec2::new(f64_from_usize(self.first[0]), f64_from_usize(self.first[1]));
        for (number, &to) in polygon.iter().enumerate() {
            let from = polygon[(number + polygon.len() - 1) % polygon.len()];
            self.edge(from - corner, to - corner);
        }
        self.total = 0.0;
        for row in self.areas.chunks_exact_mut(self.columns + 2) {
            let mut sum = 0.0;
            for cell in row.iter_mut() {
                sum += *cell;
                *cell = sum;
            }
            self.total += row[..self.columns].iter().sum::<f64>();
        }
    }

    fn edge(&mut self, from: DVec2, to: DVec2) {
        let (sign, upper, lower) = if from.y < to.y { (1.0, from, to) } else { (-1.0, to, from) };
        let height = lower.y - upper.y;
        if height <= 0.0 {
            return;
        }
        let slope = (lower.x - upper.x) / height;
        let rows = self.areas.len() / (self.columns + 2);
        let (mut y, mut x) = (upper.y, upper.x);
        for row in index(u32_truncated(upper.y))..rows {
            let end_y = lower.y.min(f64_from_usize(row + 1));
            if end_y <= y {
                break;
            }
            // The end itself is taken where it is reached, so that neighbouring edges meet without a gap.
            let end_x = if end_y == lower.y { lower.x } else { upper.x + slope * (end_y - upper.y) };
            self.piece(row, sign * (end_y - y), [x.min(end_x), x.max(end_x)]);
            (y, x) = (end_y, end_x);
        }
    }

    /// A piece of an edge within a row: its signed height, and the columns between which it runs.
    fn piece(&mut self, row: usize, height: f64, [left, right]: [f64; 2]) {
        let cells = &mut self.areas[row * (self.columns + 2)..][..self.columns + 2];
        let last_cell = self.columns;
        let cell_of = |x: f64| usize::try_from(i64_truncated(x)).unwrap_or(0).min(last_cell);
        let (first, last) = (cell_of(left), cell_of(right));
        for cell in first..=last {
            let from = if cell == first { left } else { f64_from_usize(cell) };
            let to = if cell == last { right } else { f64_from_usize(cell + 1) };
            let part = if first == last { height } else { height * ((to - from) / (right - left)) };
            let beside = 0.5 * (from + to) - f64_from_usize(cell);
            cells[cell] += part * (1.0 - beside);
            cells[cell + 1] += part * beside;
        }
    }

    /// Mean over the covered area of the weighted sum of a picture's channels.
    pub fn mean(&self, picture: &Picture, weights: &[f64; BANDS]) -> f64 {
        if self.total == 0.0 {
            return 0.0;
        }
        match picture.channels() {
            1 => self.sum(picture, [weights[0]]) / self.total,
            3 => self.sum(picture, [weights[0], weights[1], weights[2]]) / self.total,
            _ => self.sum(picture, *weights) / self.total,
        }
    }

    fn sum<const CHANNELS: usize>(&self, picture: &Picture, weights: [f64; CHANNELS]) -> f64 {
        let mut sums = [0.0; CHANNELS];
        let (width, height) = (index(picture.size().width_px), index(picture.size().height_px));
        let columns = self.columns.min(width.saturating_sub(self.first[0]));
        let rows = self.areas.chunks_exact(self.columns + 2).enumerate();
        for (row, areas) in rows.take(height.saturating_sub(self.first[1])) {
            let pixels = &picture.row(self.first[1] + row)[self.first[0] * CHANNELS..][..columns * CHANNELS];
            for (pixel, area) in pixels.chunks_exact(CHANNELS).zip(areas) {
                for channel in 0..CHANNELS {
                    sums[channel] += area * f64::from(pixel[channel]);
                }
            }
        }
        let mut sum = 0.0;
        for channel in 0..CHANNELS {
            sum += weights[channel] * sums[channel];
        }
        sum
    }
}
