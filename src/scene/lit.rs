//! A scene with its light in absolute units. Computes the exitance toward a ray.
//!
//! Light is carried as lux-equivalents a band: the exitance (or pi times radiance) that white light of the illuminant has at
//! the same number of lux. A white surface under 1 lux of the illuminant has exitance (1, 1, 1, 1).

mod data;
mod gloss;
mod identity;
mod object_light;
mod relief;
mod shadow_rays;
mod shadows;
mod slopes;
mod surface;

pub use data::{ExitanceBounds, Face, LitScene};
pub use gloss::{Facet, REFLECTIONS_MAX};
pub use object_light::{LightSteps, ObjectLight};
pub use relief::MapTexels;
pub use shadows::{Relief, Shadows, SourceBounds};
pub use surface::{OnTriangle, by_band, by_lane};

use std::sync::{Arc, OnceLock};

use glam::DVec3;

use super::bake::light_points::LightPoints;
use super::bake::rays::Receiver;
use super::bake::{Bake, BakeSettings};
use super::flicker::Flicker;
use super::geometry::Scene;
use super::light::{BANDS, Bands, Illuminant, luminance};
use super::mesh::Material;
use super::texture::Footprint;
use super::vectors::dot;
use crate::error::Error;
use crate::num::{f32_nearest, greater, index};
use crate::units::Span;
use data::{NO_CONE, PAINT_WITHOUT_TEXTURE, Paint};

/// Rays from the point that `illuminance_lux` is given at. Their noise scales the whole picture: 65,536 of them, stratified,
/// leave well under 0.1 %.
const METER_RAYS: usize = 65_536;
/// Points on lamps that it sends shadow rays to.
const METER_LAMP_RAYS: usize = 4_096;

impl Scene {
    /// Scales a bake so that a horizontal plane at `at_m` (its upper side) has `illuminance_lux`.
    /// Fails on a bake of another scene; no light at that point; a negative or endless illuminance.
    pub fn lit(
        self,
        bake: &Bake,
        at_m: DVec3,
        illuminance_lux: f64,
        illuminant: Illuminant,
    ) -> Result<LitScene, Error> {
        self.check_bake(bake)?;
        if !(illuminance_lux.is_finite() && illuminance_lux >= 0.0) {
            return Err(Error::key("scene.illuminance_lux", illuminance_lux, "use a finite number of at least 0"));
        }
        let metered = self.horizontal_irradiance(bake, at_m);
        let own_lux = luminance(metered);
        if own_lux <= 0.0 {
            let reason = format!(
                "no light reaches a level plane at ({:.2}, {:.2}, {:.2}) m, where it is to be set",
                at_m.x, at_m.y, at_m.z
            );
            return Err(Error::key("scene.illuminance_lux", illuminance_lux, reason));
        }
        let mut lit = LitScene::scaled(self, bake, illuminance_lux / own_lux, illuminant);
        lit.illuminance_lux = illuminance_lux;
        Ok(lit)
    }

    /// Takes a bake without scaling: radiances of the scene are cd/m^2, so that lamps' lumens give lux. `at_m` is where the illuminance is
    /// measured that `LitScene::illuminance_lux` returns.
    /// Fails on a bake of another scene.
    pub fn lit_absolutely(self, bake: &Bake, at_m: DVec3, illuminant: Illuminant) -> Result<LitScene, Error> {
        self.check_bake(bake)?;
        let illuminance_lux = luminance(self.horizontal_irradiance(bake, at_m));
        let mut lit = LitScene::scaled(self, bake, 1.0, illuminant);
        lit.illuminance_lux = illuminance_lux;
        Ok(lit)
    }

    fn check_bake(&self, bake: &Bake) -> Result<(), Error> {
        let flickering = if self.flickering.is_empty() { 0 } else { bake.irradiance.len() };
        if bake.irradiance.len() != 2 * self.layout.samples.len() || bake.flickering.len() != flickering {
            return Err(Error::Run(format!("the bake is not of scene '{}'", self.name)));
        }
        Ok(())
    }

    /// Irradiance of the upper side of a horizontal plane, in the scene's own units, at the lamps' mean.
    fn horizontal_irradiance(&self, bake: &Bake, at_m: DVec3) -> [f64; BANDS] {
        let (position_m, up) = (at_m.to_array().map(f32_nearest), [0.0, 1.0, 0.0]);
        let light_points = LightPoints::new(self, METER_LAMP_RAYS, METER_RAYS);
        let baked = [bake.irradiance.as_slice(), bake.flickering.as_slice()];
        let receiver = Receiver { at_m: position_m, normal: up, sides: 1 };
        let [steady, flickering] = self.light_at(&receiver, &light_points, baked, 1.0, &[]).by_group;
        std::array::from_fn(|band| steady[band] + flickering[band])
    }

    /// Luminance that the upper side of a level plane has straight from lamps and sky, in the scene's own units.
    pub fn direct_light_at(&self, at_m: DVec3) -> f64 {
        let (position_m, up) = (at_m.to_array().map(f32_nearest), [0.0, 1.0, 0.0]);
        let light_points = LightPoints::new(self, 256, 1_024);
        let receiver = Receiver { at_m: position_m, normal: up, sides: 1 };
        let [steady, flickering] = self.light_at(&receiver, &light_points, [&[], &[]], 1.0, &[]).by_group;
        luminance(steady) + luminance(flickering)
    }

    /// The scene with the same irradiance everywhere, and no other light: photometric targets.
    pub fn evenly_lit(self, illuminance_lux: f64, illuminant: Illuminant) -> LitScene {
        let bake = Bake::even(&self, 1.0);
        let mut lit = LitScene::scaled(self, &bake, illuminance_lux, illuminant);
        (lit.illuminance_lux, lit.shadows) = (illuminance_lux, None);
        lit
    }

    /// Bakes and lights at once.
    /// Fails as `lit` does.
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
        let mut cones = Vec::new();
        let mut cone_of = |material: &Material| match material.bulb.and_then(|bulb| bulb.cone) {
            None => NO_CONE,
            Some(cone) => {
                cones.push(cone);
                crate::num::u32_from(cones.len() - 1)
            }
        };
        let paint = |(number, material): (u32, &Material)| Paint {
            cone: cone_of(material),
            base_colour: material.base_colour,
            glow_lux: scaled(
                material.maps.emission.map_or(material.emission, |(_, factors)| factors),
                pi * lux_per_unit,
            ),
            texture: material.texture.unwrap_or(PAINT_WITHOUT_TEXTURE),
            double_sided: material.double_sided,
            flickers: scene.flickers(number),
            glossy: gloss::keeps_images(&scene.mesh, material),
        };
        let shadows = Shadows::of(&scene, bake, lux_per_unit).map(Arc::new);
        let paints: Vec<Paint> = (0_u32..).zip(&scene.mesh.materials).map(paint).collect();
        Self {
            illuminant,
            irradiance_lux: bake.irradiance.iter().map(|&light| scaled(light, lux_per_unit)).collect(),
            flickering_lux: bake.flickering.iter().map(|&light| scaled(light, lux_per_unit)).collect(),
            flicker: None,
            lux_per_radiance: pi * lux_per_unit,
            illuminance_lux: 0.0,
            bounces: bake.bounces,
            sky_lux: scaled(scene.sky, pi * lux_per_unit),
            faces: surface::faces(&scene.mesh, &scene.layout, &slopes::of(&scene.mesh), &paints, shadows.as_deref())
                .into(),
            shadows,
            paints,
            cones,
            has_textures: scene.mesh.materials.iter().any(|material| material.texture.is_some()),
            gloss: scene.mesh.materials.iter().map(|material| gloss::glossiest(&scene.mesh, material)).collect(),
            bounds: OnceLock::new(),
            content: OnceLock::new(),
            scene: Arc::new(scene),
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

    /// Lets those of the scene's lamps flicker that it marks. Without this they shine at their mean.
    #[must_use]
    pub fn with_flicker(self, flicker: Flicker) -> Self {
        Self { flicker: Some(flicker), bounds: OnceLock::new(), content: OnceLock::new(), ..self }
    }

    /// Lets no shadow be traced: edges are as sharp as the bake's samples, and objects cast no shadows.
    #[must_use]
    pub fn with_baked_shadows(self) -> Self {
        let shadows = self.shadows.map(|shadows| Arc::new(shadows.untraced()));
        Self { shadows, bounds: OnceLock::new(), content: OnceLock::new(), ..self }
    }

    /// Exitance of the environment beyond all surfaces, towards where a ray that leaves along `direction` came from, in lux-equivalents.
    #[inline]
    pub fn sky_lux(&self, direction: [f32; 3]) -> Bands {
        match &self.scene.environment {
            None => self.sky_lux,
            Some(environment) => environment.radiance(direction).map(|band| band * f32_nearest(self.lux_per_radiance)),
        }
    }

    /// Lets all light of a target that is lit evenly flicker.
    #[must_use]
    pub fn all_flickering(mut self, flicker: Flicker) -> Self {
        self.content = OnceLock::new();
        let dark = vec![[0.0; BANDS]; self.irradiance_lux.len()];
        self.flickering_lux = std::mem::replace(&mut self.irradiance_lux, dark);
        self.with_flicker(flicker)
    }

    /// Illuminance of a horizontal plane where the light was set (or, where lamps and sky state it, measured), at the lamps' mean.
    pub fn illuminance_lux(&self) -> f64 {
        self.illuminance_lux
    }

    /// What the light is, in words, for the report.
    pub fn describe_light(&self) -> String {
        let reach = if self.bounces { "after all bounces" } else { "direct light only: no bounces" };
        self.flicker
            .map_or_else(|| reach.to_owned(), |flicker| format!("{reach}; lamps flicker: {}", flicker.describe()))
    }

    /// Mean level of the lamps that flicker over a span of run time; 1 is their mean over all time.
    pub fn lamp_level(&self, span: Span) -> f32 {
        self.flicker.map_or(1.0, |flicker| flicker.level(span))
    }

    /// Least and greatest level of any span.
    pub fn lamp_level_bounds(&self) -> [f32; 2] {
        self.flicker.map_or([1.0; 2], |flicker| flicker.bounds())
    }

    /// Least and greatest level of any span of this length.
    pub fn lamp_level_bounds_over(&self, length_s: f64) -> [f64; 2] {
        self.flicker.map_or([1.0; 2], |flicker| flicker.bounds_over(length_s))
    }

    /// Whether light was followed over surfaces, so that no point is dark that another one lights.
    pub fn has_bounces(&self) -> bool {
        self.bounces
    }

    /// Whether a ray can come back black: from the back of a surface that has one side only, or from beyond all surfaces.
    pub fn may_be_black(&self) -> bool {
        let [sky_least, _] = self.sky_bounds();
        let is_dark_beyond = match &self.scene.environment {
            None => self.sky_lux.contains(&0.0),
            Some(_) => sky_least.contains(&0.0),
        };
        is_dark_beyond || self.has_dark_backs()
    }

    /// Whether a surface has one side only.
    pub fn has_dark_backs(&self) -> bool {
        self.paints.iter().any(|paint| !paint.double_sided)
    }

    /// Whether the same light is seen at any time.
    pub fn is_steady(&self) -> bool {
        self.flicker.is_none()
    }

    /// Light that leaves a hit towards where the ray came from, in lux-equivalents a band, as if all of it were reflected diffusely (what
    /// keeps an image: `facet`). `u` and `v` weigh the second and third corner; `footprint` is the ray's area on the texture;
    /// `direction` has unit length; `lamp_level` is that of the lamps that flicker over the ray's stratum of time. Shadows are as sharp as
    /// the bake's samples.
    #[inline(always)]
    pub fn exitance_lux(
        &self,
        triangle: u32,
        [u, v]: [f32; 2],
        direction: [f32; 3],
        footprint: &Footprint,
        lamp_level: f32,
    ) -> Bands {
        let shade = &self.scene.layout.triangles[index(triangle)];
        let back = dot(shade.normal, direction) > 0.0;
        let paint = &self.paints[index(shade.material)];
        if back && !paint.double_sided {
            return [0.0; BANDS];
        }
        let irradiance = self.irradiance_of(surface::on_side(shade.around(u, v), back), lamp_level);
        let albedo = self.albedo(triangle, paint, [u, v], footprint);
        let glow_level = self.glow_level(paint, direction, lamp_level);
        let glow = self.glow_lux(triangle, paint, [u, v], footprint);
        let mut light = [0.0; BANDS];
        for band in 0..BANDS {
            light[band] = irradiance[band] * albedo[band] + glow[band] * glow_level;
        }
        light
    }

    /// Level of a surface's own light towards where a ray that leaves along `direction` came from, over its emission.
    #[inline(always)]
    fn glow_level(&self, paint: &Paint, direction: [f32; 3], lamp_level: f32) -> f32 {
        let level = if paint.flickers { lamp_level } else { 1.0 };
        match self.cones.get(index(paint.cone)) {
            None => level,
            Some(cone) => level * cone.share(direction.map(|x| -x)),
        }
    }

    /// Lux-equivalents between three sample sides.
    #[inline(always)]
    fn irradiance_of(&self, around: [(usize, f32); 3], lamp_level: f32) -> Bands {
        let mut irradiance = [0.0_f32; BANDS];
        for (sample_side, weight) in around {
            let light = self.irradiance_lux[sample_side];
            for band in 0..BANDS {
                irradiance[band] += light[band] * weight;
            }
        }
        if !self.flickering_lux.is_empty() {
            for (sample_side, weight) in around {
                let light = self.flickering_lux[sample_side];
                for band in 0..BANDS {
                    irradiance[band] += light[band] * (weight * lamp_level);
                }
            }
        }
        irradiance
    }

    /// Emitted lux-equivalents at a point, averaged over the footprint on its base colour.
    #[inline(always)]
    fn glow_lux(&self, triangle: u32, paint: &Paint, [u, v]: [f32; 2], footprint: &Footprint) -> Bands {
        let mesh = &self.scene.mesh;
        let shade = &self.scene.layout.triangles[index(triangle)];
        let Some((texture, _)) = mesh.materials[index(shade.material)].maps.emission else { return paint.glow_lux };
        let texture = &mesh.textures[index(texture)];
        let footprint =
            mesh.textures.get(index(paint.texture)).map_or(*footprint, |colour| footprint.on(colour, texture));
        let colour = texture.over(shade.uv_at(u, v), &footprint);
        std::array::from_fn(|band| paint.glow_lux[band] * colour[band])
    }

    /// Reflectance at a point, averaged over the footprint.
    #[inline(always)]
    fn albedo(&self, triangle: u32, paint: &Paint, [u, v]: [f32; 2], footprint: &Footprint) -> Bands {
        let mesh = &self.scene.mesh;
        if paint.texture == PAINT_WITHOUT_TEXTURE && mesh.colours.is_empty() {
            return paint.base_colour;
        }
        let w = 1.0 - u - v;
        let mut colour = [1.0; BANDS];
        if paint.texture != PAINT_WITHOUT_TEXTURE {
            let uv = self.scene.layout.triangles[index(triangle)].uv_at(u, v);
            colour = mesh.textures[index(paint.texture)].over(uv, footprint);
        }
        if let Some(of_vertices) = mesh.colour_at(triangle, [w, u, v]) {
            for band in 0..BANDS {
                colour[band] *= of_vertices[band];
            }
        }
        let mut albedo = paint.base_colour;
        for band in 0..BANDS {
            albedo[band] *= colour[band];
        }
        albedo
    }

    /// Least and greatest exitance of the environment. A sky that is the same everywhere has no least: closed rooms have one.
    fn sky_bounds(&self) -> [[f64; BANDS]; 2] {
        match &self.scene.environment {
            None => [[f64::MAX; BANDS], self.sky_lux.map(f64::from)],
            Some(environment) => [environment.least(), environment.greatest()]
                .map(|corner| corner.map(|band| f64::from(band) * self.lux_per_radiance)),
        }
    }

    /// Bounds on the light that leaves any surface, from each triangle's own irradiance and reflectance: no rendered pixel lies outside
    /// (weights of an interpolation are within 0..1 up to rounding).
    pub fn exitance_bounds(&self) -> ExitanceBounds {
        *self.bounds.get_or_init(|| self.found_exitance_bounds())
    }

    fn found_exitance_bounds(&self) -> ExitanceBounds {
        let mesh = &self.scene.mesh;
        let ranges: Vec<[Bands; 2]> = mesh
            .materials
            .iter()
            .map(|material| {
                let range = material.texture.map_or([[1.0; BANDS]; 2], |texture| mesh.textures[index(texture)].range());
                range.map(|corner| std::array::from_fn(|band| corner[band] * material.base_colour[band]))
            })
            .collect();
        let per_unit = self.lux_per_radiance;
        let glow = |material| mesh.greatest_emission(material).map(|band| f32_nearest(f64::from(band) * per_unit));
        let glows: Vec<Bands> = mesh.materials.iter().map(glow).collect();
        let [sky_least, sky_greatest] = self.sky_bounds();
        let mut bounds = ExitanceBounds { least: sky_least, greatest: [0.0; BANDS], emitted: sky_greatest };
        let levels = self.lamp_level_bounds().map(f64::from);
        for (triangle, shade) in (0_u32..).zip(&self.scene.layout.triangles) {
            let mut range = ranges[index(shade.material)];
            if let Some([a, b, c]) = mesh.corner_colours(triangle) {
                for band in 0..BANDS {
                    range[0][band] *= a[band].min(b[band]).min(c[band]);
                    range[1][band] *= a[band].max(b[band]).max(c[band]);
                }
            }
            let glow_level = if self.scene.flickers(shade.material) { levels[1] } else { 1.0 };
            let glow = glows[index(shade.material)].map(|glow| f64::from(glow) * glow_level);
            for (back, sample) in shade.sides() {
                let sample_side = 2 * sample + back;
                let light = self.irradiance_lux[sample_side];
                let flickering = self.flickering_lux.get(sample_side).copied().unwrap_or([0.0; BANDS]);
                let shadows =
                    self.shadows.as_ref().map_or([[0.0; BANDS]; 2], |shadows| shadows.changes(sample_side, levels[1]));
                for band in 0..BANDS {
                    let [least, greatest] = [0, 1].map(|end| {
                        let light = f64::from(light[band]) + f64::from(flickering[band]) * levels[end];
                        let light = greater(light + shadows[end][band], 0.0);
                        f64::from(range[end][band]) * light
                    });
                    if glow.iter().all(|&glow| glow == 0.0)
                        || mesh.materials[index(shade.material)].maps.emission.is_some()
                    {
                        bounds.least[band] = crate::num::lesser(bounds.least[band], least);
                        bounds.greatest[band] = crate::num::greater(bounds.greatest[band], greatest);
                    }
                    if glow[band] > 0.0 {
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
