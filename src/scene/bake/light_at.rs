//! The light of a single receiver, from rays and from the baked light around it.

use super::super::geometry::Scene;
use super::super::light::{BANDS, Bands};
use super::blockers::Blocker;
use super::light_points::LightPoints;
use super::rays::{ByGroup, GROUPS, Receiver, bounce_rays};
use super::secondary::SecondarySources;
use super::shadow_rays::shadow_ray_light;
use super::sources::{SOURCES_MAX, SourceLight};
use crate::num::{f64_from_usize, index};

/// Light of one side of a receiver.
#[derive(Clone, Debug)]
pub struct LightAt {
    /// Irradiance, steady and flickering.
    pub by_group: ByGroup<f64>,
    /// What of it the strongest sources send.
    pub by_source: [SourceLight; SOURCES_MAX],
    /// Share of light from all around, by its cosine, that objects take.
    pub hidden: f64,
}

impl Scene {
    /// Light of the first side of a receiver, from lamps and sky by `light_points` and from the surfaces around, of which `baked` is the
    /// irradiance (steady, flickering; the latter may be empty). Radiances of the scene count `per_unit` times. Objects in the way are
    /// black.
    pub(in crate::scene) fn light_at(
        &self,
        receiver: &Receiver,
        light_points: &LightPoints,
        baked: [&[Bands]; GROUPS],
        per_unit: f64,
        blockers: &[Blocker],
    ) -> LightAt {
        let receivers = std::slice::from_ref(receiver);
        let [by_shadow_rays, _] = shadow_ray_light(self, receivers, light_points, blockers)[0];
        let [rays, _] = &bounce_rays(self, receivers, &light_points.fan, &SecondarySources::default(), blockers)[0];
        let mut bounced = [[0.0; BANDS]; GROUPS];
        let mut add = |sample_side: usize, weight: Bands| {
            let albedo = self.layout.samples[sample_side / 2].albedo;
            for (sum, baked) in bounced.iter_mut().zip(baked) {
                let Some(light) = baked.get(sample_side) else { continue };
                for band in 0..BANDS {
                    sum[band] += f64::from(light[band]) * f64::from(albedo[band]) * f64::from(weight[band]);
                }
            }
        };
        rays.met.iter().for_each(|&sample_side| add(index(sample_side), [1.0; BANDS]));
        rays.weighted.iter().for_each(|hit| add(index(hit.sample_side), hit.weight()));
        let count = f64_from_usize(light_points.fan.len().max(1));
        let by_group = std::array::from_fn(|group| {
            let of = |band: usize| {
                per_unit * (by_shadow_rays.all[group][band] + rays.seen[group][band]) + bounced[group][band] / count
            };
            std::array::from_fn(of)
        });
        LightAt { by_group, by_source: by_shadow_rays.by_source, hidden: f64_from_usize(rays.blocked) / count }
    }
}
