//! Irradiance of every sample, once for a scene. Enters: a scene. Leaves: irradiance in the scene's own units on both sides of
//! each sample, direct and after all bounces.
//!
//! Lamps are aimed at, at the same points from every sample; sky and bounces come from cosine-weighted rays whose hits are
//! kept as a sparse matrix, and the bounces are iterated on that matrix until nothing changes any more, so no bounce is cut off. Every
//! ray is drawn by a key of its sample, so the result does not depend on threads.

pub(super) mod rays;
mod store;

use super::Scene;
use super::chance::in_chunks;
use crate::num::{f32_nearest, f64_from_usize, index};
use rays::{DARK, Gathered, SKY};
use std::sync::atomic::{AtomicUsize, Ordering};

/// Version of the method and of the stored form: part of the key, so a stale bake is never taken.
pub const BAKE_VERSION: u32 = 1;

/// How many rays a bake spends. Noise falls with the root of the count; time grows in proportion.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BakeSettings {
    /// Cosine-weighted rays from each side of a sample on a grid. A multiple of 8.
    pub grid_rays: usize,
    /// The same for samples on vertices of small triangles. A multiple of 8.
    pub vertex_rays: usize,
    /// Points on lamps that samples on grids aim at.
    pub grid_lamp_rays: usize,
    /// Points on lamps that samples on vertices aim at.
    pub vertex_lamp_rays: usize,
}

impl BakeSettings {
    /// Clean pictures of rooms.
    pub const ROOM: Self = Self { grid_rays: 256, vertex_rays: 64, grid_lamp_rays: 192, vertex_lamp_rays: 96 };

    /// Enough for tests and a first look.
    pub const DRAFT: Self = Self { grid_rays: 64, vertex_rays: 32, grid_lamp_rays: 64, vertex_lamp_rays: 32 };
}

/// Baked irradiance of a scene: pi times the mean radiance over the hemisphere, in the scene's own units.
#[derive(Clone, Debug, PartialEq)]
pub struct Bake {
    pub(super) key: [u8; 32],
    /// Side 0, then side 1 of each sample.
    pub(super) irradiance: Vec<[f32; 3]>,
}

/// Samples of a unit of parallel work.
const CHUNK: usize = 128;

/// The iteration ends when no sample changes by more than this share of the greatest irradiance.
const CONVERGED_SHARE: f32 = 1e-5;

/// Bounces at most. With the greatest albedo, 0.9 everywhere, what is left after them is 0.9^200 = 7e-10 of the light.
const BOUNCES_MAX: usize = 200;

impl Bake {
    /// The same irradiance at every sample, for targets that are lit evenly.
    pub(super) fn even(scene: &Scene, irradiance: f32) -> Self {
        Self {
            key: scene.bake_key(&BakeSettings::ROOM),
            irradiance: vec![[irradiance; 3]; 2 * scene.layout.samples.len()],
        }
    }

    /// Bakes a scene. `progress` is told the share done, from any thread.
    pub(super) fn of(scene: &Scene, settings: &BakeSettings, progress: &(dyn Fn(f64) + Sync)) -> Self {
        let samples = scene.layout.samples.len();
        let lamp_points = [settings.vertex_lamp_rays, settings.grid_lamp_rays].map(|count| scene.lamps.points(count));
        let done = AtomicUsize::new(0);
        let gathered: Vec<Vec<Gathered>> = in_chunks(samples, CHUNK, |range| {
            let count = range.len();
            let chunk = range.map(|sample| rays::gather(scene, settings, &lamp_points, sample)).collect();
            let before = done.fetch_add(count, Ordering::Relaxed);
            progress(0.95 * f64_from_usize(before + count) / f64_from_usize(samples.max(1)));
            chunk
        });
        let gathered: Vec<Gathered> = gathered.into_iter().flatten().collect();
        let irradiance = settled(scene, &gathered);
        progress(1.0);
        Self { key: scene.bake_key(settings), irradiance }
    }
}

/// Iterates the bounces: next = direct + mean of (albedo times irradiance) over the places its rays met.
fn settled(scene: &Scene, gathered: &[Gathered]) -> Vec<[f32; 3]> {
    let albedo: Vec<[f32; 3]> = scene.layout.samples.iter().map(|sample| sample.albedo).collect();
    let first: Vec<[f32; 3]> = gathered.iter().flat_map(|sample| sample.direct).collect();
    let mut now = first.clone();
    for _ in 0..BOUNCES_MAX {
        let exitance: Vec<[f32; 3]> = now
            .iter()
            .enumerate()
            .map(|(place, light)| [0, 1, 2].map(|band| light[band] * albedo[place / 2][band]))
            .collect();
        let next: Vec<[f32; 3]> = in_chunks(gathered.len(), CHUNK, |range| {
            range
                .flat_map(|sample| gathered[sample].bounced(&first[2 * sample..2 * sample + 2], &exitance))
                .collect::<Vec<_>>()
        })
        .into_iter()
        .flatten()
        .collect();
        let (mut change, mut greatest) = (0.0_f32, 0.0_f32);
        for (a, b) in now.iter().zip(&next) {
            for band in 0..3 {
                change = change.max((a[band] - b[band]).abs());
                greatest = greatest.max(b[band]);
            }
        }
        now = next;
        if change <= CONVERGED_SHARE * greatest {
            break;
        }
    }
    now
}

impl Gathered {
    /// Irradiance of both sides after one more bounce.
    fn bounced(&self, direct: &[[f32; 3]], exitance: &[[f32; 3]]) -> [[f32; 3]; 2] {
        let half = self.met.len() / 2;
        [0, 1].map(|side| {
            let mut sum = [0.0_f64; 3];
            for &place in &self.met[side * half..(side + 1) * half] {
                if place != DARK && place != SKY {
                    for band in 0..3 {
                        sum[band] += f64::from(exitance[index(place)][band]);
                    }
                }
            }
            [0, 1, 2].map(|band| f32_nearest(f64::from(direct[side][band]) + sum[band] / f64_from_usize(half)))
        })
    }
}
