//! Sites of defects. Finds a row's defective columns, with a uniform for each, from the density and the share of clusters.
//!
//! Model: each pixel is a seed by its own draw; a share of the seeds takes its 2x2 neighbourhood (right, below, below right) with it.
//! The sites of a row follow from its seeds and those of the row above, so rows stay independent. The density of seeds is set
//! so that the density of defective pixels is the one that was asked for.

use std::borrow::Cow;

use super::die::Die;
use super::row_memory::RowMemory;
use crate::draw::{DrawKey, EffectNumber, fill_uniforms};
use crate::num::u64_half_even;
use crate::units::RowIndex;

/// A defective pixel of a row.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Site {
    pub(super) column: usize,
    /// The pixel's own draw, for the needs of its kind of defect.
    pub(super) uniform: u32,
}

/// Fields of the keys: seeds, clusters and the pixels' own draws. Other fields of a row's key are the reset sample's.
const SEEDS: u64 = 2;
const CLUSTERS: u64 = 3;
const OWN: u64 = 4;

/// Where one kind of defect is.
pub(super) struct DefectSites {
    number: EffectNumber,
    /// A uniform below this makes a seed.
    seed_below: u64,
    /// A uniform below this makes a cluster of a seed.
    cluster_below: u64,
    memory: RowMemory<Site>,
}

/// A probability as a bound on 32-bit uniforms.
fn below(probability: f64) -> u64 {
    u64_half_even(probability * 4_294_967_296.0)
}

impl DefectSites {
    /// `None` where the density is 0.
    pub(super) fn new(number: EffectNumber, ppm: f64, cluster_share: f64) -> Option<Self> {
        let (seed_below, cluster_below) = (below(seed_density(1e-6 * ppm, cluster_share)), below(cluster_share));
        (ppm > 0.0).then(|| Self { number, seed_below, cluster_below, memory: RowMemory::default() })
    }

    /// The row's defects from left to right. `uniforms` is room as long as the row.
    pub(super) fn sites(&self, die: Die, row: RowIndex, uniforms: &mut [u32]) -> Cow<'_, [Site]> {
        let key = die.key(self.number, row);
        self.memory.row(key, uniforms.len(), || self.find(die, row, key, uniforms))
    }

    fn find(&self, die: Die, row: RowIndex, key: DrawKey, uniforms: &mut [u32]) -> Vec<Site> {
        let mut defective = vec![false; uniforms.len()];
        let above = row.0.checked_sub(1).map(|row| die.key(self.number, RowIndex(row)));
        for (key, is_own) in [(Some(key), true), (above, false)] {
            let Some(key) = key else { continue };
            fill_uniforms(key.with(SEEDS), uniforms);
            let is_seed = |uniform: &u32| u64::from(*uniform) < self.seed_below;
            let seeds: Vec<usize> = uniforms.iter().enumerate().filter(|(_, u)| is_seed(u)).map(|(c, _)| c).collect();
            if seeds.is_empty() {
                continue;
            }
            fill_uniforms(key.with(CLUSTERS), uniforms);
            for column in seeds {
                let is_cluster = u64::from(uniforms[column]) < self.cluster_below;
                defective[column] |= is_own || is_cluster;
                if is_cluster && column + 1 < defective.len() {
                    defective[column + 1] = true;
                }
            }
        }
        if !defective.contains(&true) {
            return Vec::new();
        }
        fill_uniforms(key.with(OWN), uniforms);
        let columns = defective.iter().enumerate().filter(|(_, defective)| **defective);
        columns.map(|(column, _)| Site { column, uniform: uniforms[column] }).collect()
    }
}

/// Density s of seeds for which a pixel is defective with probability p: it is sound when it is no seed and none of the
/// three that could reach it is the seed of a cluster, (1 - s) (1 - s c)^3 = 1 - p. The left side falls with s, so halving
/// finds it, to 2^-60.
fn seed_density(defective: f64, cluster_share: f64) -> f64 {
    let (mut least, mut most) = (0.0, defective);
    for _ in 0..60 {
        let middle = 0.5 * (least + most);
        let reach = 1.0 - middle * cluster_share;
        if (1.0 - middle) * (reach * reach * reach) > 1.0 - defective { least = middle } else { most = middle }
    }
    most
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::units::CameraIndex;

    /// Defects of 256 rows of 1024, by row.
    fn all(ppm: f64, cluster_share: f64) -> Vec<Vec<usize>> {
        let defects = DefectSites::new(EffectNumber(999), ppm, cluster_share).unwrap();
        let die = Die { seed: 3, camera: CameraIndex(0) };
        let mut uniforms = vec![0; 1024];
        let row = |row| defects.sites(die, RowIndex(row), &mut uniforms).iter().map(|site| site.column).collect();
        (0..256).map(row).collect()
    }

    /// 262,144 pixels at 2 %: 5243 defects expected. Single ones are binomial, sigma 72; clusters of four have at most twice that.
    /// Of the first row and column, 0.5 % of the pixels, a cluster's far sides are cut: under 15 defects. 4.5 sigma.
    #[test]
    fn the_density_of_defective_pixels_is_the_one_asked_for() {
        for cluster_share in [0.0, 0.3, 1.0] {
            let count = all(20_000.0, cluster_share).iter().map(Vec::len).sum::<usize>();
            let sigma = 72.0 * (1.0 + cluster_share);
            let apart = (crate::num::f64_from_usize(count) - 5242.9).abs();
            println!("share {cluster_share}: {count} defects");
            assert!(apart < 4.5 * sigma + 15.0, "share {cluster_share}: {count}");
        }
    }

    #[test]
    fn with_clusters_only_every_defect_stands_in_a_full_square() {
        let rows = all(1000.0, 1.0);
        let is = |row: usize, column: usize| rows[row].contains(&column);
        let square = |row: usize, column: usize| {
            is(row, column) && is(row, column + 1) && is(row + 1, column) && is(row + 1, column + 1)
        };
        let mut tried = 0;
        for row in 1..255 {
            for &column in rows[row].iter().filter(|&&column| (1..1023).contains(&column)) {
                let corners = [(row, column), (row - 1, column), (row, column - 1), (row - 1, column - 1)];
                assert!(corners.iter().any(|&(row, column)| square(row, column)), "row {row}, column {column}");
                tried += 1;
            }
        }
        assert!(tried > 150, "only {tried} defects");
        let alone = all(1000.0, 0.0);
        let touching = |row: usize| alone[row].iter().filter(|&&column| alone[row].contains(&(column + 1))).count();
        // 262 defects, each with a right neighbour at 0.1 %: 0.26 expected; more than 4 come once in 6e5 dies.
        assert!((0..256).map(touching).sum::<usize>() <= 4);
    }
}
