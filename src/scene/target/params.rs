//! Size, distance and surfaces of a target.

use super::super::geometry::Scene;
use super::super::light::BANDS;
use super::super::mesh::{Material, Mesh};
use crate::error::Error;

/// Half the edge of the cube that a flat field is: the camera stands at its centre.
pub(super) const HALF_EDGE_M: f32 = 2.0;

/// What a user said about a target; what is not said has a default that depends on the target.
#[derive(Clone, Debug, PartialEq)]
pub struct TargetRequest {
    /// Mean of light and dark; of a wedge, its lightest step. 0 to 1.
    pub reflectance: f64,
    /// Illuminance on the target, which the intensity of point sources is measured against.
    pub illuminance_lux: f64,
    /// Keys with their values, where the user gave one.
    pub sizes: Vec<(&'static str, Option<f64>)>,
}

impl TargetRequest {
    /// The value of a key, checked, or another one where the user gave none.
    pub(super) fn get(&self, key: &str, otherwise: f64, low: f64, high: f64) -> Result<f64, Error> {
        let given = self.sizes.iter().find(|(name, _)| *name == key).and_then(|(_, value)| *value);
        let value = given.unwrap_or(otherwise);
        if value >= low && value <= high {
            return Ok(value);
        }
        Err(Error::key(&format!("scene.{key}"), value, format!("out of range; use {low} to {high}")))
    }

    /// Refuses keys that this target does not read.
    pub(super) fn only(&self, target: &str, read: &[&str]) -> Result<(), Error> {
        for (key, value) in &self.sizes {
            if let Some(value) = value.filter(|_| !read.contains(key)) {
                let would_do = if read.is_empty() { "none of the target's sizes".to_owned() } else { read.join(", ") };
                let reason = format!("has no effect on the target \"{target}\", which reads {would_do}");
                return Err(Error::key(&format!("scene.{key}"), value, reason));
            }
        }
        Ok(())
    }
}

/// A Lambertian field of one reflectance in every direction: the inside of a cube around the origin. Light it with
/// `Scene::evenly_lit`, whose illuminance is that on the target's surface.
/// Fails on a reflectance outside 0..=1.
pub fn flat(reflectance: f64) -> Result<Scene, Error> {
    if !(0.0..=1.0).contains(&reflectance) {
        return Err(Error::key("scene.reflectance", reflectance, "use 0 to 1"));
    }
    let mut mesh = Mesh::default();
    mesh.materials.push(Material::plain("flat", [crate::num::f32_nearest(reflectance); 3]));
    for corners_m in cube([-HALF_EDGE_M; 3], [HALF_EDGE_M; 3], true) {
        mesh.append_quad(0, corners_m, [1.0, 1.0]);
    }
    Scene::new("flat", mesh, [0.0; BANDS])
}

/// The six faces of a box (-x, +x, -y, +y, -z, +z), each counter-clockwise seen from inside or from outside.
pub fn cube(least_m: [f32; 3], greatest_m: [f32; 3], inside: bool) -> [[[f32; 3]; 4]; 6] {
    let ([x0, y0, z0], [x1, y1, z1]) = (least_m, greatest_m);
    let outward = [
        [[x0, y0, z0], [x0, y0, z1], [x0, y1, z1], [x0, y1, z0]],
        [[x1, y0, z1], [x1, y0, z0], [x1, y1, z0], [x1, y1, z1]],
        [[x0, y0, z0], [x1, y0, z0], [x1, y0, z1], [x0, y0, z1]],
        [[x0, y1, z1], [x1, y1, z1], [x1, y1, z0], [x0, y1, z0]],
        [[x1, y0, z0], [x0, y0, z0], [x0, y1, z0], [x1, y1, z0]],
        [[x0, y0, z1], [x1, y0, z1], [x1, y1, z1], [x0, y1, z1]],
    ];
    if inside { outward.map(|[a, b, c, d]| [b, a, d, c]) } else { outward }
}
