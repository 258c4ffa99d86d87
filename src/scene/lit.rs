//! A scene with its light in absolute units. Enters: a scene, its bake, lux at a point. Leaves: exitance toward a ray.
//!
//! Light is carried as lux-equivalents a band: the exitance (or pi times radiance) that white light of the illuminant has at
//! so many lux. A white surface under 1 lux of the illuminant has exitance (1, 1, 1).

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

mod gloss;
mod slopes;

pub use gloss::{BOUNCES_MAX, Facet};

use glam::DVec3;

use super::bake::rays::{bounce_rays, fan, lamp_light};
use super::bake::{Bake, BakeSettings};
use super::light::{BANDS, Bands, Illuminant, luminance};
use super::mesh::{Gloss, dot};
use super::texture::Footprint;
use super::{Scene, samples::ShadeTriangle};
use crate::error::Error;
use crate::num::{f32_nearest, index};
use crate::units::Span;

/// Rays from the point that `illuminance_lux` is given at. Their noise scales the whole picture: 65,536 of them, stratified,
/// leave well under 0.1 %.
const METER_RAYS: usize = 65_536;
/// Points on lamps that it aims at.
const METER_LAMP_RAYS: usize = 4_096;

/// Least and greatest light that leaves a scene's surfaces, in lux-equivalents a band.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ExitanceBounds {
    /// Least of any reflecting surface (and of the sky, where the scene is open to it).
    pub least: [f64; BANDS],
    /// Greatest of any reflecting surface.
    pub greatest: [f64; BANDS],
    /// Greatest of lamps and sky; 0 without.
    pub emitted: [f64; BANDS],
}

/// A scene under light.
#[derive(Clone, Debug)]
pub struct LitScene {
    scene: Scene,
    illuminant: Illuminant,
    /// Lux-equivalents; side 0, then side 1 of each sample.
    irradiance_lux: Vec<Bands>,
    /// Lux-equivalents of each material's own light.
    emission_lux: Vec<Bands>,
    sky_lux: Bands,
    /// Texels for a metre in the world along u and v, a triangle; empty without textures.
    slopes: Vec<[[f32; 3]; 2]>,
    /// What of each material keeps an image.
    gloss: Vec<Option<Gloss>>,
}

impl Scene {
    /// Scales a bake so that a horizontal plane at `at_m` (its upper side) has `illuminance_lux`.
    ///
    /// # Errors
    /// A bake of another scene; no light at that point; a negative or endless illuminance.
    pub fn lit(
        self,
        bake: &Bake,
        at_m: DVec3,
        illuminance_lux: f64,
        illuminant: Illuminant,
    ) -> Result<LitScene, Error> {
        if bake.irradiance.len() != 2 * self.layout.samples.len() {
            return Err(Error::Run(format!("the bake is not of scene '{}'", self.name)));
        }
        if !(illuminance_lux.is_finite() && illuminance_lux >= 0.0) {
            return Err(Error::key("scene.illuminance_lux", illuminance_lux, "a finite number of at least 0 would do"));
        }
        let metered = self.horizontal_irradiance(bake, at_m);
        let own_lux = luminance(metered);
        if own_lux <= 0.0 {
            let reason =
                format!("no light reaches ({:.2}, {:.2}, {:.2}) m, where it is to be set", at_m.x, at_m.y, at_m.z);
            return Err(Error::key("scene.illuminance_lux", illuminance_lux, reason));
        }
        Ok(LitScene::scaled(self, bake, illuminance_lux / own_lux, illuminant))
    }

    /// Irradiance of the upper side of a horizontal plane, in the scene's own units.
    fn horizontal_irradiance(&self, bake: &Bake, at_m: DVec3) -> [f64; BANDS] {
        let (at, up) = (at_m.to_array().map(f32_nearest), [0.0, 1.0, 0.0]);
        let lamps = lamp_light(self, at, up, &self.lamps.points(METER_LAMP_RAYS))[0];
        let mut met = Vec::with_capacity(METER_RAYS);
        let seen = bounce_rays(self, at, up, &fan(METER_RAYS), &mut met);
        let mut bounced = [0.0; BANDS];
        for place in met.into_iter().map(index) {
            if let Some(light) = bake.irradiance.get(place) {
                for band in 0..BANDS {
                    let albedo = self.layout.samples[place / 2].albedo[band];
                    bounced[band] += f64::from(light[band]) * f64::from(albedo);
                }
            }
        }
        std::array::from_fn(|band| lamps[band] + seen[band] + bounced[band] / crate::num::f64_from_usize(METER_RAYS))
    }

    /// The scene with the same irradiance everywhere, and no other light: photometric targets.
    pub fn evenly_lit(self, illuminance_lux: f64, illuminant: Illuminant) -> LitScene {
        let bake = Bake::even(&self, 1.0);
        LitScene::scaled(self, &bake, illuminance_lux, illuminant)
    }

    /// Bakes and lights at once.
    ///
    /// # Errors
    /// As `lit`.
    pub fn baked_and_lit(
        self,
        settings: &BakeSettings,
        at_m: DVec3,
        illuminance_lux: f64,
        illuminant: Illuminant,
    ) -> Result<LitScene, Error> {
        let bake = self.bake(settings, &|_| {});
        self.lit(&bake, at_m, illuminance_lux, illuminant)
    }
}

impl LitScene {
    fn scaled(scene: Scene, bake: &Bake, lux_per_unit: f64, illuminant: Illuminant) -> Self {
        let scaled = |value: Bands, factor: f64| value.map(|band| f32_nearest(f64::from(band) * factor));
        let pi = std::f64::consts::PI;
        Self {
            illuminant,
            irradiance_lux: bake.irradiance.iter().map(|&light| scaled(light, lux_per_unit)).collect(),
            emission_lux: scene.mesh.materials.iter().map(|m| scaled(m.emission, pi * lux_per_unit)).collect(),
            sky_lux: scaled(scene.sky, pi * lux_per_unit),
            slopes: slopes::of(&scene.mesh),
            gloss: scene.mesh.materials.iter().map(super::mesh::Material::gloss).collect(),
            scene,
        }
    }

    /// The geometry.
    pub fn scene(&self) -> &Scene {
        &self.scene
    }

    /// Spectrum of its white light.
    pub fn illuminant(&self) -> Illuminant {
        self.illuminant
    }

    /// Exitance of the sky in lux-equivalents.
    pub fn sky_lux(&self) -> Bands {
        self.sky_lux
    }

    /// Mean level of the lamps that flicker over a span of run time; 1 is their mean over all time.
    pub fn lamp_level(&self, _span: Span) -> f32 {
        1.0
    }

    /// Light that leaves a hit towards where the ray came from, in lux-equivalents a band, as if all of it were reflected diffusely (what
    /// keeps an image: `facet`). `u` and `v` weigh the second and third corner; `footprint` is what the ray stands for on the texture;
    /// `direction` has unit length; `_lamp_level` is that of the lamps that flicker over the ray's stratum of time (all lamps are steady).
    #[inline(always)]
    pub fn exitance_lux(
        &self,
        triangle: u32,
        [u, v]: [f32; 2],
        direction: [f32; 3],
        footprint: &Footprint,
        _lamp_level: f32,
    ) -> Bands {
        let shade = &self.scene.layout.triangles[index(triangle)];
        let back = dot(shade.normal, direction) > 0.0;
        let material = &self.scene.mesh.materials[index(shade.material)];
        if back && !material.double_sided {
            return [0.0; BANDS];
        }
        let mut irradiance = [0.0_f32; BANDS];
        for (sample, weight) in shade.around(u, v) {
            let light = self.irradiance_lux[2 * sample + usize::from(back)];
            for band in 0..BANDS {
                irradiance[band] += light[band] * weight;
            }
        }
        let albedo = self.albedo(shade, [u, v], footprint);
        let glow = &self.emission_lux[index(shade.material)];
        let mut light = [0.0; BANDS];
        for band in 0..BANDS {
            light[band] = irradiance[band] * albedo[band] + glow[band];
        }
        light
    }

    /// Reflectance at a point, averaged over the footprint.
    #[inline(always)]
    fn albedo(&self, shade: &ShadeTriangle, [u, v]: [f32; 2], footprint: &Footprint) -> Bands {
        let material = &self.scene.mesh.materials[index(shade.material)];
        let Some(texture) = material.texture else { return material.base_colour };
        let [a, b, c] = shade.uv;
        let w = 1.0 - u - v;
        let uv = [a[0] * w + b[0] * u + c[0] * v, a[1] * w + b[1] * u + c[1] * v];
        let colour = self.scene.mesh.textures[index(texture)].over(uv, footprint);
        let mut albedo = material.base_colour;
        for band in 0..BANDS {
            albedo[band] *= colour[band];
        }
        albedo
    }

    /// Bounds on the light that leaves any surface, from each triangle's own irradiance and reflectance: no rendered pixel lies outside
    /// (weights of an interpolation are within 0..1 up to rounding).
    pub fn exitance_bounds(&self) -> ExitanceBounds {
        let mesh = &self.scene.mesh;
        let ranges: Vec<[Bands; 2]> = mesh
            .materials
            .iter()
            .map(|material| {
                let range = material.texture.map_or([[1.0; BANDS]; 2], |texture| mesh.textures[index(texture)].range());
                range.map(|corner| std::array::from_fn(|band| corner[band] * material.base_colour[band]))
            })
            .collect();
        let mut bounds =
            ExitanceBounds { least: [f64::MAX; BANDS], greatest: [0.0; BANDS], emitted: self.sky_lux.map(f64::from) };
        for shade in &self.scene.layout.triangles {
            let range = &ranges[index(shade.material)];
            let glow = self.emission_lux[index(shade.material)].map(f64::from);
            for (back, sample) in sides_of(shade) {
                let light = self.irradiance_lux[2 * sample + back];
                for band in 0..BANDS {
                    let [least, greatest] = [0, 1].map(|end| f64::from(range[end][band]) * f64::from(light[band]));
                    if glow.iter().all(|&glow| glow == 0.0) {
                        bounds.least[band] = crate::num::lesser(bounds.least[band], least);
                        bounds.greatest[band] = crate::num::greater(bounds.greatest[band], greatest);
                    } else {
                        bounds.emitted[band] = crate::num::greater(bounds.emitted[band], greatest + glow[band]);
                    }
                }
            }
        }
        for band in 0..BANDS {
            bounds.least[band] = crate::num::lesser(bounds.least[band], bounds.greatest[band]);
        }
        self.widened_by_gloss(&mut bounds);
        bounds
    }
}

/// Every sample of a triangle with every side.
fn sides_of(shade: &ShadeTriangle) -> impl Iterator<Item = (usize, usize)> {
    let first = index(shade.samples[0]);
    let steps = index(shade.grid_steps);
    let grid = first..if steps > 0 { first + (steps + 1) * (steps + 2) / 2 } else { first };
    let corners = if steps > 0 { None } else { Some(shade.samples.map(index)) };
    grid.chain(corners.into_iter().flatten()).flat_map(|sample| [(0, sample), (1, sample)])
}
