//! Results of the rays of neighbouring samples, close together in memory: their direct light, and the sample sides that the rays met.

use super::super::geometry::Scene;
use super::super::light::{BANDS, Bands};
use super::fan::GROUPS;
use super::light_points::LightPoints;
use super::rays::{SideLight, WeightedHit, gather};
use super::secondary::SecondarySources;
use crate::num::{f32_nearest, f64_from_usize, greater, index, u32_from};

/// Random rays that are traced together, about: enough for packets of one direction, and few enough to stay in the cache.
const BATCH_RAYS: usize = 4_096;

/// Of some samples. Lists of all sample sides lie one behind another, because separate lists would take more memory than their entries.
#[derive(Clone, Debug, Default)]
pub struct Gathered {
    /// The sample sides that are lit.
    pub sample_sides: Vec<u32>,
    /// Light of lamps, sky and glowing surfaces at each sample side, by group; a group without any light in the scene is empty.
    pub direct: [Vec<Bands>; GROUPS],
    /// Luminance that the strongest sources send to each sample side: unoccluded, and received.
    pub by_source: Vec<Vec<[f32; 2]>>,
    /// Sum over the random rays of the light that each brought, and the sum of squares; empty where no sample is on a grid.
    by_chance: [Vec<[Bands; 2]>; GROUPS],
    /// Whether a sample side lies within something closed, as a floor does under a box that stands on it.
    pub buried: Vec<bool>,
    /// Rays of each sample side, and where its lists end, from where the first one's begin.
    looks: Vec<Looks>,
    met_from: usize,
    weighted_from: usize,
}

/// What random rays met: lists of sample sides, one behind another. Those of a whole scene are most of the memory of a bake, and in one
/// block, which goes back to the system.
#[derive(Clone, Debug, Default)]
pub struct HitLists {
    /// The sample side of every ray that met one and goes no further.
    met: Vec<u32>,
    /// Sample sides of which a share counts.
    weighted: Vec<WeightedHit>,
}

#[derive(Clone, Copy, Debug)]
struct Looks {
    rays: u32,
    met_end: u32,
    weighted_end: u32,
}

impl Gathered {
    /// Traces the rays of samples.
    pub fn of(
        scene: &Scene,
        light_points: &[LightPoints; 2],
        secondary: &[SecondarySources; 2],
        bounces: bool,
        samples: &[u32],
    ) -> (Self, HitLists) {
        let mut hits = HitLists::default();
        let mut all = Self { by_source: vec![Vec::new(); light_points[0].sources.len()], ..Self::default() };
        let is_on_grid = |&sample: &u32| scene.layout.samples[index(sample)].on_grid;
        let keeps_moments = samples.iter().any(is_on_grid);
        for alike in samples.chunk_by(|a, b| is_on_grid(a) == is_on_grid(b)) {
            let kind = usize::from(is_on_grid(&alike[0]));
            let (light_points, secondary) = (&light_points[kind], &secondary[kind]);
            let rays = if bounces { light_points.fan.len() } else { 0 };
            // Vertices have normals of all kinds: their rays have too little in common.
            let batch = if kind == 1 { (BATCH_RAYS / light_points.fan.len().max(1)).max(1) } else { 1 };
            for neighbours in alike.chunks(batch) {
                for (&sample, sides) in neighbours.iter().zip(gather(scene, light_points, secondary, neighbours)) {
                    let lit = scene.layout.samples[index(sample)].sides();
                    for (side, seen) in (0..).zip(&sides[..lit]) {
                        all.sample_sides.push(2 * sample + side);
                        if rays > 0 {
                            hits.met.extend_from_slice(&seen.bounced.met);
                            hits.weighted.extend_from_slice(&seen.bounced.weighted);
                        }
                        let [met_end, weighted_end] = [hits.met.len(), hits.weighted.len()].map(u32_from);
                        all.looks.push(Looks { rays: u32_from(rays), met_end, weighted_end });
                        all.push(seen, !scene.flickering.is_empty(), keeps_moments);
                    }
                }
            }
        }
        (all, hits)
    }

    /// Puts its hits behind those of others.
    pub fn append_hits(&mut self, mut hits: HitLists, all: &mut HitLists) {
        (self.met_from, self.weighted_from) = (all.met.len(), all.weighted.len());
        all.met.append(&mut hits.met);
        all.weighted.append(&mut hits.weighted);
    }

    fn push(&mut self, seen: &SideLight, flickers: bool, keeps_moments: bool) {
        for (group, light) in seen.direct.iter().enumerate().take(1 + usize::from(flickers)) {
            self.direct[group].push(light.map(f32_nearest));
            if keeps_moments {
                let moments = [seen.bounced.seen[group], seen.bounced.squares[group]];
                self.by_chance[group].push(moments.map(|moment| moment.map(f32_nearest)));
            }
        }
        for (all, light) in self.by_source.iter_mut().zip(&seen.by_source) {
            all.push([light.unoccluded, light.received]);
        }
        self.buried.push(seen.is_buried);
    }

    /// Drops what bounces and errors are found from.
    pub fn drop_looks(&mut self) {
        (self.looks, self.by_chance) = Default::default();
    }

    /// Puts a value of each of these sample sides among those of all.
    pub fn put<T: Copy>(&self, values: &[T], all: &mut [T]) {
        for (&sample_side, &value) in self.sample_sides.iter().zip(values) {
            all[index(sample_side)] = value;
        }
    }

    /// Whether a sample is on a grid, so that `standard_errors` are known.
    pub fn has_grid(&self) -> bool {
        !self.by_chance[0].is_empty()
    }

    /// Standard error of each sample side's irradiance after one more bounce of a group, if its rays were drawn without strata; of none
    /// without a grid.
    pub fn standard_errors(&self, hits: &HitLists, group: usize, exitance: &[Bands]) -> Vec<Bands> {
        let mut met_from = self.met_from;
        let mut errors = Vec::with_capacity(self.looks.len());
        for (moments, looks) in self.by_chance[group].iter().zip(&self.looks) {
            let met_end = self.met_from + index(looks.met_end);
            let [mut sum, mut squares] = moments.map(|moment| moment.map(f64::from));
            let rays = f64_from_usize(index(looks.rays).max(1));
            for &sample_side in &hits.met[met_from..met_end] {
                for band in 0..BANDS {
                    let light = f64::from(exitance[index(sample_side)][band]) / rays;
                    sum[band] += light;
                    squares[band] += light * light;
                }
            }
            errors.push(std::array::from_fn(|band| {
                f32_nearest(greater(squares[band] - sum[band] * sum[band] / rays, 0.0).sqrt())
            }));
            met_from = met_end;
        }
        errors
    }

    /// Irradiance of each sample side after one more bounce of a group.
    pub fn bounced(&self, hits: &HitLists, group: usize, exitance: &[Bands]) -> Vec<Bands> {
        let (mut met_from, mut weighted_from) = (self.met_from, self.weighted_from);
        let mut light = self.direct[group].clone();
        for (light, looks) in light.iter_mut().zip(&self.looks) {
            let met_end = self.met_from + index(looks.met_end);
            let weighted_end = self.weighted_from + index(looks.weighted_end);
            if looks.rays > 0 {
                let mut sum = [0.0_f64; BANDS];
                for &sample_side in &hits.met[met_from..met_end] {
                    for band in 0..BANDS {
                        sum[band] += f64::from(exitance[index(sample_side)][band]);
                    }
                }
                for hit in &hits.weighted[weighted_from..weighted_end] {
                    let weight = hit.weight();
                    for band in 0..BANDS {
                        sum[band] += f64::from(exitance[index(hit.sample_side)][band] * weight[band]);
                    }
                }
                let rays = f64_from_usize(index(looks.rays));
                *light = std::array::from_fn(|band| f32_nearest(f64::from(light[band]) + sum[band] / rays));
            }
            (met_from, weighted_from) = (met_end, weighted_end);
        }
        light
    }
}
