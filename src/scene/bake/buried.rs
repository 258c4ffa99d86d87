//! Buried samples: points inside closed geometry. Gives each buried sample side the light of its stand-in, a sample side of the same cell
//! that lies in the open.
//!
//! Without this the floor is darker around everything that stands on it, as far as the next sample.

use super::super::samples::{Layout, ShadeTriangle};
use crate::num::{f32_from_u32, index, u32_from};

/// Pairs of a buried sample side and its stand-in.
pub fn stand_ins(layout: &Layout, is_buried: impl Fn(usize) -> bool) -> Vec<(u32, u32)> {
    let mut found: Vec<Option<u32>> = vec![None; 2 * layout.samples.len()];
    for triangle in &layout.triangles {
        cells(triangle, |corners| {
            for side in 0..2 {
                let sample_sides = corners.map(|sample| 2 * sample + side);
                let Some(open) = sample_sides.into_iter().find(|&sample_side| !is_buried(sample_side)) else {
                    continue;
                };
                for sample_side in sample_sides.into_iter().filter(|&sample_side| is_buried(sample_side)) {
                    // The first cell in the order of the triangles decides.
                    found[sample_side].get_or_insert(u32_from(open));
                }
            }
        });
    }
    let pairs = found.into_iter().enumerate();
    pairs.filter_map(|(sample_side, open)| Some((u32_from(sample_side), open?))).collect()
}

/// The samples that points of a triangle are interpolated between, cell by cell.
pub(super) fn cells(triangle: &ShadeTriangle, mut each: impl FnMut([usize; 3])) {
    if triangle.grid_steps == 0 {
        return each(triangle.samples.map(index));
    }
    let steps = f32_from_u32(triangle.grid_steps);
    for row in 0..triangle.grid_steps {
        for column in 0..(triangle.grid_steps - row) {
            // A point in the middle of each of a cell's two triangles.
            for share in [0.25, 0.75] {
                if share > 0.5 && column + row + 2 > triangle.grid_steps {
                    continue;
                }
                let [u, v] = [column, row].map(|at| (f32_from_u32(at) + share) / steps);
                each(triangle.around(u, v).map(|(sample, _)| sample));
            }
        }
    }
}

/// Gives each buried sample side the light of its stand-in.
pub fn fill<T: Copy>(light: &mut [T], stand_ins: &[(u32, u32)]) {
    for &(buried, open) in stand_ins {
        light[index(buried)] = light[index(open)];
    }
}
