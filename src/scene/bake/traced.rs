//! The traced rays of a bake's samples, and the light of all sample sides that follows from them.

use super::super::chance::in_chunks;
use super::super::light::{BANDS, Bands};
use super::cells::NODES;
use super::gathered::{Gathered, HitLists};
use super::sources::{Source, SourceLight};
use crate::num::index;

/// Units whose results are held until they are put among those of all: enough for all threads, and little beside the rest.
pub const CHUNKS_TOGETHER: usize = 128;

/// A sample whose light is a weighted mean of its cell's nodes.
#[derive(Clone, Copy, Debug)]
pub struct Stencil {
    /// Its number.
    pub sample: u32,
    /// Samples of the nodes.
    pub nodes: [u32; NODES],
    /// Their weights.
    pub weights: [f32; NODES],
}

/// Traced rays of all samples that were chosen, and how the rest follows from them.
#[derive(Clone, Debug, Default)]
pub struct TracedSamples {
    /// The traced samples.
    pub gathered: Vec<Gathered>,
    /// What their rays met.
    pub hits: HitLists,
    /// Whether a sample side lies within something closed.
    pub buried: Vec<bool>,
    /// The sources that are told apart.
    pub sources: Vec<Source>,
    /// What is interpolated.
    pub stencils: Vec<Stencil>,
}

impl TracedSamples {
    /// Samples whose rays were traced.
    #[cfg(test)]
    pub fn samples(&self) -> usize {
        let mut all: Vec<u32> =
            self.gathered.iter().flat_map(|chunk| &chunk.sample_sides).map(|sample_side| sample_side / 2).collect();
        all.dedup();
        all.len()
    }

    /// Direct light of a group at every sample side.
    pub fn direct(&self, group: usize, sample_sides: usize) -> Vec<Bands> {
        let mut light = vec![[0.0; BANDS]; sample_sides];
        for chunk in &self.gathered {
            chunk.put(&chunk.direct[group], &mut light);
        }
        interpolate(&self.stencils, &mut light);
        light
    }

    /// What one of the strongest sources sends to every sample side.
    pub fn by_source(&self, source: usize, sample_sides: usize) -> Vec<SourceLight> {
        let mut light = vec![[0.0; 2]; sample_sides];
        self.gathered.iter().for_each(|chunk| chunk.put(&chunk.by_source[source], &mut light));
        interpolate(&self.stencils, &mut light);
        light.into_iter().map(|[unoccluded, received]| SourceLight { unoccluded, received }).collect()
    }

    /// Drops what the rays met, once no further bounce is asked for: most of the memory of a bake.
    pub fn drop_hits(&mut self) {
        self.hits = HitLists::default();
        self.gathered.iter_mut().for_each(Gathered::drop_looks);
    }

    /// Light of a group at every sample side after one more bounce.
    pub fn bounced(&self, group: usize, exitance: &[Bands]) -> Vec<Bands> {
        let mut light = vec![[0.0; BANDS]; exitance.len()];
        for chunks in self.gathered.chunks(CHUNKS_TOGETHER) {
            let values = in_chunks(chunks.len(), 1, |range| chunks[range.start].bounced(&self.hits, group, exitance));
            chunks.iter().zip(&values).for_each(|(chunk, values)| chunk.put(values, &mut light));
        }
        interpolate(&self.stencils, &mut light);
        light
    }
}

/// Fills in the light of samples that follow from others. Weights of second degree are below zero in places: light never is.
pub fn interpolate<const N: usize>(stencils: &[Stencil], light: &mut [[f32; N]]) {
    for stencil in stencils {
        for side in 0..2 {
            let mut mixed = [0.0; N];
            for (&node, &weight) in stencil.nodes.iter().zip(&stencil.weights) {
                let known = &light[2 * index(node) + side];
                for band in 0..N {
                    mixed[band] += known[band] * weight;
                }
            }
            light[2 * index(stencil.sample) + side] = mixed.map(|value: f32| value.max(0.0));
        }
    }
}
