//! Cholesky factorisation and solution of a sparse symmetric system of 7 x 7 blocks.
//!
//! Nodes are eliminated by least degree (ties: the lower number), so a chain with few loops fills with few blocks. A
//! node that stands still takes no part.

use std::collections::BTreeSet;

use nalgebra::SVector;

use crate::tracker::lie::Matrix7;

/// Seven unknowns of a node: linear, angular, scale.
pub type Vector7 = SVector<f64, 7>;

/// Not a free node.
const HELD: usize = usize::MAX;

/// One column of the lower triangle: its diagonal, and the blocks below by rising row.
#[derive(Clone, Debug)]
struct BlockColumn {
    diagonal: Matrix7,
    below: Vec<(usize, Matrix7)>,
}

/// The system, in the order of elimination.
#[derive(Clone, Debug)]
pub struct BlockSystem {
    /// Index of each node in the order of elimination.
    elimination_index: Vec<usize>,
    columns: Vec<BlockColumn>,
    rhs: Vec<Vector7>,
}

impl BlockSystem {
    /// An empty system whose pattern holds the links and their fill.
    pub fn new(held: &[bool], links: &[(usize, usize)]) -> Self {
        let mut near: Vec<BTreeSet<usize>> = vec![BTreeSet::new(); held.len()];
        for &(a, b) in links.iter().filter(|&&(a, b)| a != b && !held[a] && !held[b]) {
            near[a].insert(b);
            near[b].insert(a);
        }
        let mut elimination_index = vec![HELD; held.len()];
        let mut waiting: BTreeSet<(usize, usize)> =
            (0..held.len()).filter(|&node| !held[node]).map(|node| (near[node].len(), node)).collect();
        let mut patterns: Vec<Vec<usize>> = Vec::new();
        while let Some((_, node)) = waiting.pop_first() {
            elimination_index[node] = patterns.len();
            let later: Vec<usize> = near[node].iter().copied().collect();
            for &a in &later {
                waiting.remove(&(near[a].len(), a));
                near[a].remove(&node);
                near[a].extend(later.iter().copied().filter(|&b| b != a));
                waiting.insert((near[a].len(), a));
            }
            patterns.push(later);
        }
        let column = |pattern: &Vec<usize>| {
            let mut rows: Vec<usize> = pattern.iter().map(|&node| elimination_index[node]).collect();
            rows.sort_unstable();
            BlockColumn {
                diagonal: Matrix7::zeros(),
                below: rows.into_iter().map(|row| (row, Matrix7::zeros())).collect(),
            }
        };
        let columns: Vec<BlockColumn> = patterns.iter().map(column).collect();
        let rhs = vec![Vector7::zeros(); columns.len()];
        Self { elimination_index, columns, rhs }
    }

    /// Blocks below the diagonal, fill included.
    pub fn factor_blocks(&self) -> usize {
        self.columns.iter().map(|column| column.below.len()).sum()
    }

    /// All numbers to zero; the pattern stays.
    pub fn clear(&mut self) {
        for column in &mut self.columns {
            column.diagonal = Matrix7::zeros();
            column.below.iter_mut().for_each(|(_, block)| *block = Matrix7::zeros());
        }
        self.rhs.iter_mut().for_each(|rhs| *rhs = Vector7::zeros());
    }

    /// Adds to a node's right-hand side.
    pub fn add_rhs(&mut self, node: usize, rhs: &Vector7) {
        if self.elimination_index[node] != HELD {
            self.rhs[self.elimination_index[node]] += rhs;
        }
    }

    /// Adds the block in the row of one node and the column of another, and so its transpose in the other triangle.
    pub fn add_block(&mut self, row: usize, column: usize, block: &Matrix7) {
        let (a, b) = (self.elimination_index[row], self.elimination_index[column]);
        if a == HELD || b == HELD {
            return;
        }
        if a == b {
            self.columns[a].diagonal += block;
            return;
        }
        let (low, high, block) = if a > b { (b, a, *block) } else { (a, b, block.transpose()) };
        let below = &mut self.columns[low].below;
        let found = below.binary_search_by_key(&high, |(row, _)| *row).expect("the pattern holds every link");
        below[found].1 += block;
    }

    /// Decouples the scale of every node.
    pub fn rest_scale(&mut self) {
        self.columns.iter_mut().for_each(|column| column.diagonal[(6, 6)] += 1.0);
    }

    /// Steps of all nodes (zero for held ones) under a damping relative to the diagonal; `None` where the system is not
    /// positive definite.
    pub fn solve(&self, damping: f64) -> Option<Vec<Vector7>> {
        let (mut columns, mut x) = (self.columns.clone(), self.rhs.clone());
        for column in &mut columns {
            for k in 0..7 {
                column.diagonal[(k, k)] *= 1.0 + damping;
            }
        }
        for k in 0..columns.len() {
            let factor = lower_factor(&columns[k].diagonal)?;
            columns[k].diagonal = factor;
            factor.solve_lower_triangular_mut(&mut x[k]);
            let mut below = std::mem::take(&mut columns[k].below);
            for (row, block) in &mut below {
                // L = A / factor^T: the transpose solves with the lower triangle.
                let mut transposed = block.transpose();
                factor.solve_lower_triangular_mut(&mut transposed);
                *block = transposed.transpose();
                let carried = *block * x[k];
                x[*row] -= carried;
            }
            for (a, (row, block)) in below.iter().enumerate() {
                columns[*row].diagonal -= block * block.transpose();
                for (later, other) in &below[a + 1..] {
                    let target = &mut columns[*row].below;
                    let found =
                        target.binary_search_by_key(later, |(row, _)| *row).expect("the pattern holds its fill");
                    target[found].1 -= other * block.transpose();
                }
            }
            columns[k].below = below;
        }
        for k in (0..columns.len()).rev() {
            let mut rhs = x[k];
            for (row, block) in &columns[k].below {
                rhs -= block.tr_mul(&x[*row]);
            }
            columns[k].diagonal.tr_solve_lower_triangular_mut(&mut rhs);
            x[k] = rhs;
        }
        let step = |&at: &usize| if at == HELD { Vector7::zeros() } else { x[at] };
        let steps: Vec<Vector7> = self.elimination_index.iter().map(step).collect();
        steps.iter().all(|step| step.iter().all(|number| number.is_finite())).then_some(steps)
    }
}

/// The lower Cholesky factor; `None` where a pivot does not stand clear of rounding.
fn lower_factor(matrix: &Matrix7) -> Option<Matrix7> {
    let mut lower = Matrix7::zeros();
    for i in 0..7 {
        for j in 0..=i {
            let mut sum = matrix[(i, j)];
            for k in 0..j {
                sum -= lower[(i, k)] * lower[(j, k)];
            }
            if i > j {
                lower[(i, j)] = sum / lower[(j, j)];
            } else if sum > 1e-14 * matrix[(i, i)].abs() && sum.is_finite() {
                lower[(i, i)] = sum.sqrt();
            } else {
                return None;
            }
        }
    }
    Some(lower)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::tracker::dense::solve_cholesky;

    /// A number in -1..1.
    fn number(n: usize, k: usize) -> f64 {
        f64::from(crate::num::u32_from((n * 7_919 + k * 104_729) % 2_003)) / 1_001.5 - 1.0
    }

    #[test]
    fn the_sparse_factor_gives_the_dense_solution_with_loops_and_held_nodes() {
        let nodes = 30;
        let mut held = vec![false; nodes];
        (held[0], held[17]) = (true, true);
        let mut links: Vec<(usize, usize)> = (1..nodes).map(|node| (node - 1, node)).collect();
        links.extend([(29, 2), (5, 21), (9, 14)]);
        let mut system = BlockSystem::new(&held, &links);
        let n = 7 * nodes;
        let (mut dense, mut rhs) = (vec![0.0; n * n], vec![0.0; n]);
        for (seed, &(a, b)) in links.iter().enumerate() {
            let by =
                |first: usize| Matrix7::from_fn(|i, j| number(seed + 1, first + 7 * i + j)) + Matrix7::identity() * 3.0;
            let (j_a, j_b) = (by(1), by(60));
            let blocks = [(a, a, j_a.tr_mul(&j_a)), (b, b, j_b.tr_mul(&j_b)), (b, a, j_b.tr_mul(&j_a))];
            for (row, column, block) in blocks {
                system.add_block(row, column, &block);
                for i in 0..7 {
                    for j in 0..7 {
                        dense[(7 * row + i) * n + 7 * column + j] += block[(i, j)];
                        if row != column {
                            dense[(7 * column + j) * n + 7 * row + i] += block[(i, j)];
                        }
                    }
                }
            }
            let node_rhs = Vector7::from_fn(|i, _| number(seed, i));
            system.add_rhs(b, &node_rhs);
            (0..7).for_each(|i| rhs[7 * b + i] += node_rhs[i]);
        }
        for node in (0..nodes).filter(|&node| held[node]) {
            for k in 7 * node..7 * node + 7 {
                (0..n).for_each(|other| (dense[k * n + other], dense[other * n + k]) = (0.0, 0.0));
                (dense[k * n + k], rhs[k]) = (1.0, 0.0);
            }
        }
        let steps = system.solve(0.0).expect("positive definite");
        assert!(solve_cholesky(&mut dense, &mut rhs));
        for (node, step) in steps.iter().enumerate() {
            for k in 0..7 {
                // A condition of some 1e4 times 2^-53 times steps below 10.
                assert!(
                    (step[k] - rhs[7 * node + k]).abs() < 1e-10,
                    "node {node}: {} for {}",
                    step[k],
                    rhs[7 * node + k]
                );
            }
        }
        // A chain of 28 free nodes in three parts needs 25 blocks; three loops fill no more than two rows of each.
        assert!(system.factor_blocks() < 70, "{}", system.factor_blocks());
    }

    #[test]
    fn a_system_that_nothing_holds_is_refused() {
        let mut system = BlockSystem::new(&[false, false], &[(0, 1)]);
        let one = Matrix7::identity();
        system.add_block(0, 0, &one);
        system.add_block(1, 1, &one);
        system.add_block(1, 0, &-one);
        assert!(system.solve(0.0).is_none());
    }
}
