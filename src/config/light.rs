//! From the light's keys to its spectrum, level, sky and flicker.

use super::check::{member, one_of, within};
use super::scenario::{Scenario, Scene as SceneKeys};
use crate::error::Error;
use crate::num::f64_from_u64;
use crate::scene::file_units::{FileUnits, UpAxis};
use crate::scene::flicker::{Flicker, Waveform};
use crate::scene::light::BLACKBODY_K;
use crate::scene::sky::{Sky, SkyKind};
use crate::scene::{BakeCost, Illuminant};
use crate::text::named;

/// Greatest values of `scene.bake_rays_max` and `scene.bake_memory_mb_max`.
const RAYS_MOST: u64 = 10_000_000_000_000;
const MEGABYTES_MOST: u64 = 1_000_000;

named! {
    /// How much light there is.
    pub enum LightLevel {
        /// All light is scaled by one factor, to `scene.illuminance_lux`.
        Scaled = "scaled",
        /// As lamps and sky state it.
        Absolute = "absolute",
    }
}

named! {
    /// How light is baked.
    pub enum BakeKind {
        /// Over all bounces, by as many rays as the scene affords.
        Full = "full",
        /// Over all bounces, by few rays.
        Draft = "draft",
        /// Over all bounces, by a quarter of the rays of `draft`.
        Sketch = "sketch",
        /// Only what lamps and sky send straight.
        Direct = "direct",
    }
}

/// How light is baked, and what that may cost.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct BakeLimits {
    /// Over all bounces or not, and by how many rays.
    pub kind: BakeKind,
    /// Most that a bake may take.
    pub most: BakeCost,
}

impl BakeLimits {
    /// Refuses a bake before its first ray. Fails on more rays or memory than allowed.
    pub fn check(&self, cost: BakeCost) -> Result<(), Error> {
        let follows = self.kind != BakeKind::Direct;
        let direct = if follows { ", or set scene.bake = \"direct\", which needs far fewer" } else { "" };
        let reason = |needed: u64, unit: &str, key: &str, most: u64| {
            // No key takes more than its own maximum.
            if needed > most {
                let simpler = if follows { "set scene.bake = \"direct\" or simplify" } else { "simplify" };
                return format!(
                    "this scene's light takes {needed} {unit}, more than {key} can allow ({most}); {simpler} the scene"
                );
            }
            format!("this scene's light takes {needed} {unit}; set {key} = {needed} or more{direct}")
        };
        if cost.rays > self.most.rays {
            let key = "scene.bake_rays_max";
            return Err(Error::key(key, self.most.rays, reason(cost.rays, "rays", key, RAYS_MOST)));
        }
        if cost.bytes > self.most.bytes {
            let (key, needed) = ("scene.bake_memory_mb_max", cost.bytes.div_ceil(1_000_000));
            return Err(Error::key(key, self.most.bytes / 1_000_000, reason(needed, "MB", key, MEGABYTES_MOST)));
        }
        Ok(())
    }
}

impl SceneKeys {
    /// What the coordinates of its file mean. Fails on values out of range.
    pub fn file_units(&self) -> Result<FileUnits, Error> {
        let metres = within("scene.scale", self.scale, 1e-6..=1e6, "1e-6 to 1e6")?;
        Ok(FileUnits { metres, up: one_of("scene.up", &self.up, &[("y", UpAxis::Y), ("z", UpAxis::Z)])? })
    }
}

impl Scenario {
    /// The light's spectrum and its level in lux. Fails on an unknown name, two spectra, or a level that is not above 0 and at most
    /// 200,000.
    pub fn light(&self) -> Result<(Illuminant, f64), Error> {
        let scene = &self.scene;
        let illuminant = match (&scene.illuminant, scene.blackbody_k) {
            (Some(name), None) => member("scene.illuminant", name, &Illuminant::ALL, Illuminant::name)?,
            (None, Some(kelvin)) => {
                let range = BLACKBODY_K[0]..=BLACKBODY_K[1];
                Illuminant::Blackbody(within("scene.blackbody_k", kelvin, range, "1000 to 20000")?)
            }
            (Some(name), Some(_)) => {
                let reason = "stands beside scene.blackbody_k; use exactly one of the two";
                return Err(Error::key("scene.illuminant", name, reason));
            }
            (None, None) => {
                let reason = "use a name, such as \"D65\", or scene.blackbody_k";
                return Err(Error::key("scene.illuminant", "nothing", reason));
            }
        };
        let would_do = "1e-6 to 200,000 (starlight 0.001, office 500, direct sun 100,000)";
        let lux = within("scene.illuminance_lux", scene.illuminance_lux, 1e-6..=200_000.0, would_do)?;
        Ok((illuminant, lux))
    }

    /// How the light's level is set. Fails on an unknown name.
    pub fn light_level(&self) -> Result<LightLevel, Error> {
        member("scene.light_level", &self.scene.light_level, &LightLevel::ALL, LightLevel::name)
    }

    /// Whether edges of shadows are traced by rays. Fails on an unknown name.
    pub fn traces_shadows(&self) -> Result<bool, Error> {
        one_of("scene.shadows", &self.scene.shadows, &[("traced", true), ("baked", false)])
    }

    /// How far light is followed. Fails on an unknown name, limits out of range.
    pub fn bake_limits(&self) -> Result<BakeLimits, Error> {
        let scene = &self.scene;
        let kind = member("scene.bake", &scene.bake, &BakeKind::ALL, BakeKind::name)?;
        let rays = within("scene.bake_rays_max", scene.bake_rays_max, 1e6..=f64_from_u64(RAYS_MOST), "1e6 to 1e13")?;
        let megabytes = within(
            "scene.bake_memory_mb_max",
            scene.bake_memory_mb_max,
            16.0..=f64_from_u64(MEGABYTES_MOST),
            "16 to 1,000,000",
        )?;
        let whole = crate::num::u64_truncated;
        Ok(BakeLimits { kind, most: BakeCost { rays: whole(rays), bytes: whole(1e6 * megabytes) } })
    }

    /// Sun and sky by code, if any. Fails on an unknown kind, numbers out of range, a pattern that does not go with the kind.
    pub fn sky(&self) -> Result<Option<Sky>, Error> {
        let keys = &self.scene.sky;
        let kinds = [("none", None), ("overcast", Some(SkyKind::Overcast)), ("clear", Some(SkyKind::Clear))];
        let kind = one_of("scene.sky.kind", &keys.kind, &kinds)?;
        let sun_elevation_deg = within("scene.sky.sun_elevation_deg", keys.sun_elevation_deg, 1.0..=90.0, "1 to 90")?;
        let sun_azimuth_deg = within("scene.sky.sun_azimuth_deg", keys.sun_azimuth_deg, -360.0..=360.0, "-360 to 360")?;
        let ground_reflectance =
            within("scene.sky.ground_reflectance", keys.ground_reflectance, 0.0..=0.9, "0 to 0.9")?;
        let Some(kind) = kind else { return Ok(None) };
        let (usual, range) = match kind {
            SkyKind::Overcast => (1, 1..=6),
            SkyKind::Clear => (12, 7..=15),
        };
        let would_do = format!("0, or {} to {} for this kind of sky,", range.start(), range.end());
        let wanted = if keys.cie_type == 0 { usual } else { keys.cie_type };
        let cie_type = within("scene.sky.cie_type", wanted, range, &would_do)?;
        Ok(Some(Sky { kind, cie_type, sun_elevation_deg, sun_azimuth_deg, ground_reflectance }))
    }

    /// How lamps flicker, if they do. Fails on an unknown waveform, numbers out of range.
    pub fn flicker(&self) -> Result<Option<Flicker>, Error> {
        let keys = &self.scene.flicker;
        let duty = keys.duty;
        within("scene.flicker.duty", duty, 1e-6..=1.0, "1e-6 to 1")?;
        let waveforms = [
            ("none", None),
            ("sine", Some(Waveform::Sine)),
            ("rectified_sine", Some(Waveform::RectifiedSine)),
            ("pwm", Some(Waveform::Pwm { duty })),
        ];
        let waveform = one_of("scene.flicker.waveform", &keys.waveform, &waveforms)?;
        let frequency_hz = within("scene.flicker.frequency_hz", keys.frequency_hz, 0.01..=1e7, "0.01 to 10,000,000")?;
        let modulation = within("scene.flicker.modulation", keys.modulation, 0.0..=1.0, "0 to 1")?;
        let phase_deg = within("scene.flicker.phase_deg", keys.phase_deg, -360.0..=360.0, "-360 to 360")?;
        Ok(waveform.map(|waveform| Flicker { waveform, frequency_hz, modulation, phase_deg }))
    }
}
