//! Light that a geometry file does not state: adds the sky, panels and lamp strength of `[scene.surroundings]` to a mesh.

use serde::{Deserialize, Serialize};

use super::light::with_infrared;
use super::mesh::{Material, Mesh};
use crate::error::Error;
use crate::num::u32_from;

/// Light around and in a scene, in the units of its file: what counts is one against the other, because `Scene::lit` scales all.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Surroundings {
    /// Radiance of the sky beyond all surfaces, linear sRGB.
    #[serde(default)]
    pub sky: [f32; 3],
    /// Factor on the radiance of the file's own lamps.
    #[serde(default = "one")]
    pub lamps: f32,
    /// Glowing quadrangles added to the scene. One that fills a window makes light that comes through it quiet: aimed rays
    /// find it, which random rays to the sky hardly do.
    #[serde(default)]
    pub panels: Vec<Panel>,
}

/// A glowing quadrangle.
#[derive(Clone, Copy, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Panel {
    /// Corners in metres, counter-clockwise seen from where it shines to.
    pub corners_m: [[f32; 3]; 4],
    /// Linear sRGB.
    pub radiance: [f32; 3],
}

/// Name of the panels' material: daylight in a window, which never flickers.
pub const PANEL: &str = "panel";

const fn one() -> f32 {
    1.0
}

impl Default for Surroundings {
    fn default() -> Self {
        Self { sky: [0.0; 3], lamps: 1.0, panels: Vec::new() }
    }
}

impl Surroundings {
    /// Checks the numbers. Fails on a number that is negative or not finite, a panel without area.
    pub fn check(&self) -> Result<(), Error> {
        let refuse = |reason: String| Error::key("scene.surroundings", "", reason);
        let glows = self.panels.iter().flat_map(|panel| panel.radiance);
        if !self.sky.iter().copied().chain(glows).chain([self.lamps]).all(|value| value.is_finite() && value >= 0.0) {
            return Err(refuse("light is finite and at least 0".to_owned()));
        }
        let coordinates = self.panels.iter().flat_map(|panel| panel.corners_m).flatten();
        if !coordinates.into_iter().all(|x| x.is_finite() && x.abs() < 1e6) {
            return Err(refuse("corners of panels are finite and below 1e6 m".to_owned()));
        }
        for (number, panel) in self.panels.iter().enumerate() {
            let [a, b, c, _] = panel.corners_m;
            if super::vectors::unit_normal([a, b, c]).is_none() {
                return Err(refuse(format!("panel {number} has no area")));
            }
        }
        Ok(())
    }

    /// Puts lamps and panels into a mesh.
    pub(super) fn furnish(&self, mesh: &mut Mesh) {
        for material in &mut mesh.materials {
            material.emission = material.emission.map(|band| band * self.lamps);
        }
        for light in &mut mesh.distant {
            light.normal_irradiance = light.normal_irradiance.map(|band| band * self.lamps);
        }
        for panel in &self.panels {
            let plain = Material::plain(PANEL, [0.0; 3]);
            mesh.materials.push(Material { emission: with_infrared(panel.radiance), double_sided: false, ..plain });
            mesh.append_quad(u32_from(mesh.materials.len() - 1), panel.corners_m, [1.0, 1.0]);
        }
    }
}
