//! Cells of the sample grids, over which irradiance may be interpolated: rectangles and right triangles of up to 8 by 8 steps.
//!
//! A cell has nodes at its corners, in the middle of its edges and, if it is a rectangle, in its middle. Lagrange polynomials
//! of second degree through the nodes give the weights of all its other samples.

use super::super::samples::ShadeTriangle;
use crate::num::f32_from_u32;

/// Steps along the edge of a cell at most.
const SIZE_MAX: u32 = 8;

/// Nodes of a cell at most.
pub const NODES: usize = 9;

/// Part of the grid of one triangle, in steps of that grid.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct GridCell {
    /// Triangle of the scene.
    pub triangle: u32,
    column: u32,
    row: u32,
    width: u32,
    height: u32,
    /// The half of a square that lies at the grid's slanted rim: its right angle is at (column, row), and its legs are equal.
    is_half: bool,
}

/// The samples at a cell's nodes.
#[derive(Clone, Copy, Debug)]
pub struct Nodes {
    samples: [u32; NODES],
    count: usize,
}

impl Nodes {
    /// The samples.
    pub fn samples(&self) -> &[u32] {
        &self.samples[..self.count]
    }

    /// One number for each node; the rest have no weight.
    pub const fn all(&self) -> &[u32; NODES] {
        &self.samples
    }
}

/// The greatest power of two below a number of steps.
fn first_part(steps: u32) -> u32 {
    if steps <= 1 { steps } else { 1 << (steps - 1).ilog2() }
}

/// Nodes along an edge.
fn nodes_along(steps: u32) -> ([u32; 3], u32) {
    if steps == 1 { ([0, 1, 0], 2) } else { ([0, steps / 2, steps], 3) }
}

/// Weights of the nodes along an edge, at a step.
fn weights_along(steps: u32, at: u32) -> [f32; 3] {
    let [steps_f, at, middle] = [steps, at, steps / 2].map(f32_from_u32);
    if steps == 1 {
        return [1.0 - at, at, 0.0];
    }
    let first = (at - middle) * (at - steps_f) / (middle * steps_f);
    let second = at * (at - steps_f) / (middle * (middle - steps_f));
    let third = at * (at - middle) / (steps_f * (steps_f - middle));
    [first, second, third]
}

impl GridCell {
    /// Appends the cells of a triangle's whole grid.
    pub fn append_grid(triangle: u32, steps: u32, cells: &mut Vec<Self>) {
        let mut open = vec![Self { triangle, column: 0, row: 0, width: steps, height: steps, is_half: true }];
        while let Some(cell) = open.pop() {
            // A half has a node in the middle of each edge, so its edges are powers of two.
            if cell.width.max(cell.height) > SIZE_MAX || (cell.is_half && !cell.width.is_power_of_two()) {
                cell.split(&mut open);
            } else {
                cells.push(cell);
            }
        }
    }

    /// Whether some samples are no nodes.
    pub fn has_inner(&self) -> bool {
        self.width > 2 || self.height > 2
    }

    /// Appends the parts that a cell with samples beside its nodes falls into.
    pub fn split(&self, parts: &mut Vec<Self>) {
        let Self { column, row, width, height, .. } = *self;
        if self.is_half {
            let first = first_part(width);
            let rest = width - first;
            parts.push(Self { width: first, height: rest, is_half: false, ..*self });
            parts.push(Self { row: row + rest, width: first, height: first, ..*self });
            parts.push(Self { column: column + first, width: rest, height: rest, ..*self });
            return;
        }
        let [wide, high] = [width, height]
            .map(|steps| if steps > 2 { [first_part(steps), steps - first_part(steps)] } else { [steps, 0] });
        for (down, high) in [(0, high[0]), (high[0], high[1])].into_iter().filter(|part| part.1 > 0) {
            for (right, wide) in [(0, wide[0]), (wide[0], wide[1])].into_iter().filter(|part| part.1 > 0) {
                parts.push(Self { column: column + right, row: row + down, width: wide, height: high, ..*self });
            }
        }
    }

    /// Steps from the cell's first corner to its nodes: the corners of a half first, then the middles of its edges; those of a rectangle
    /// by rows.
    fn node_steps(&self) -> ([[u32; 2]; NODES], usize) {
        let mut steps = [[0; 2]; NODES];
        if self.is_half {
            let (size, half) = (self.width, self.width / 2);
            let all = [[0, 0], [size, 0], [0, size], [half, 0], [half, half], [0, half]];
            steps[..6].copy_from_slice(&all);
            return (steps, if size == 1 { 3 } else { 6 });
        }
        let ((wide, columns), (high, rows)) = (nodes_along(self.width), nodes_along(self.height));
        let mut count = 0;
        for down in high.into_iter().zip(0..rows) {
            for right in wide.into_iter().zip(0..columns) {
                steps[count] = [right.0, down.0];
                count += 1;
            }
        }
        (steps, count)
    }

    /// The samples at the nodes.
    pub fn nodes(&self, shade: &ShadeTriangle) -> Nodes {
        let (steps, count) = self.node_steps();
        let mut samples = [self.sample(shade, steps[0]); NODES];
        for node in 1..count {
            samples[node] = self.sample(shade, steps[node]);
        }
        Nodes { samples, count }
    }

    fn sample(&self, shade: &ShadeTriangle, [right, down]: [u32; 2]) -> u32 {
        shade.grid_sample(self.column + right, self.row + down)
    }

    /// Every sample that is no node, with the weights of the nodes.
    pub fn each_inner(&self, shade: &ShadeTriangle, mut each: impl FnMut(u32, [f32; NODES])) {
        let (nodes, count) = self.node_steps();
        for down in 0..=self.height {
            let width = if self.is_half { self.width - down } else { self.width };
            for right in 0..=width {
                if !nodes[..count].contains(&[right, down]) {
                    each(self.sample(shade, [right, down]), self.weights([right, down]));
                }
            }
        }
    }

    fn weights(&self, [right, down]: [u32; 2]) -> [f32; NODES] {
        let mut weights = [0.0; NODES];
        if self.is_half {
            let size = f32_from_u32(self.width);
            let [b, c] = [right, down].map(|steps| f32_from_u32(steps) / size);
            let a = 1.0 - b - c;
            let six =
                [a * (2.0 * a - 1.0), b * (2.0 * b - 1.0), c * (2.0 * c - 1.0), 4.0 * a * b, 4.0 * b * c, 4.0 * c * a];
            weights[..6].copy_from_slice(&six);
            return weights;
        }
        let (wide, high) = (weights_along(self.width, right), weights_along(self.height, down));
        let (columns, rows) = (if self.width == 1 { 2 } else { 3 }, if self.height == 1 { 2 } else { 3 });
        for row in 0..rows {
            for column in 0..columns {
                weights[row * columns + column] = wide[column] * high[row];
            }
        }
        weights
    }

    /// Each node that is no corner, with the corners' weights in a linear interpolation.
    pub fn each_middle(&self, mut each: impl FnMut(usize, [(usize, f32); 4])) {
        if self.is_half {
            for (node, [a, b]) in [(3, [0, 1]), (4, [1, 2]), (5, [2, 0])] {
                each(node, [(a, 0.5), (b, 0.5), (a, 0.0), (b, 0.0)]);
            }
            return;
        }
        let (steps, count) = self.node_steps();
        let columns = if self.width == 1 { 2 } else { 3 };
        let corners = [0, columns - 1, count - columns, count - 1];
        for (node, [right, down]) in
            steps.into_iter().enumerate().take(count).filter(|(node, _)| !corners.contains(node))
        {
            let [x, y] =
                [(right, self.width), (down, self.height)].map(|(at, steps)| f32_from_u32(at) / f32_from_u32(steps));
            let shares = [(1.0 - x) * (1.0 - y), x * (1.0 - y), (1.0 - x) * y, x * y];
            each(node, [0, 1, 2, 3].map(|corner| (corners[corner], shares[corner])));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::{BTreeMap, BTreeSet};

    fn shade(grid_steps: u32) -> ShadeTriangle {
        let (normal, uv) = ([0.0, 1.0, 0.0], [[0.0; 2]; 3]);
        ShadeTriangle { normal, uv, samples: [0; 3], grid_steps, material: 0, texels_per_m: 0.0 }
    }

    /// Position of every sample in steps.
    fn positions(steps: u32) -> BTreeMap<u32, [f32; 2]> {
        let all = (0..=steps).flat_map(|row| (0..=steps - row).map(move |column| [column, row]));
        all.map(|at| (shade(steps).grid_sample(at[0], at[1]), at.map(f32_from_u32))).collect()
    }

    #[test]
    fn cells_cover_every_grid_and_reproduce_a_polynomial_of_second_degree() {
        let light = |[x, y]: [f32; 2]| 3.0 + 0.5 * x - 0.25 * y + 0.125 * x * y - 0.0625 * x * x + 0.03 * y * y;
        for steps in 1..=40 {
            let (shade, positions) = (shade(steps), positions(steps));
            let mut cells = Vec::new();
            GridCell::append_grid(0, steps, &mut cells);
            let mut covered = BTreeSet::new();
            while let Some(cell) = cells.pop() {
                let nodes = cell.nodes(&shade);
                covered.extend(nodes.samples().iter().copied());
                cell.each_inner(&shade, |sample, weights| {
                    let known = nodes.all().iter().map(|node| light(positions[node]));
                    let mixed: f32 = known.zip(weights).map(|(light, weight)| light * weight).sum();
                    let expected = light(positions[&sample]);
                    // Nine products of lights up to 60 and weights up to 1, each rounded by 2^-24 of them.
                    assert!((mixed - expected).abs() < 2e-4, "{cell:?} sample {sample}: {mixed} {expected}");
                    covered.insert(sample);
                });
                if cell.has_inner() {
                    cell.split(&mut cells);
                }
            }
            assert_eq!(covered.len(), positions.len(), "{steps} steps");
        }
    }

    #[test]
    fn middles_are_compared_with_a_linear_interpolation_of_the_corners() {
        let light = |[x, y]: [f32; 2]| 3.0 + 0.5 * x - 0.25 * y;
        let (shade, positions) = (shade(21), positions(21));
        let mut cells = Vec::new();
        GridCell::append_grid(0, 21, &mut cells);
        let mut tried = 0;
        for cell in cells {
            let nodes = cell.nodes(&shade);
            if cell.has_inner() {
                cell.each_middle(|node, corners| {
                    let mixed: f32 =
                        corners.iter().map(|&(corner, share)| share * light(positions[&nodes.samples()[corner]])).sum();
                    let expected = light(positions[&nodes.samples()[node]]);
                    assert!((mixed - expected).abs() < 1e-5, "{cell:?} node {node}: {mixed} {expected}");
                    tried += 1;
                });
            }
        }
        assert!(tried > 20);
    }
}
