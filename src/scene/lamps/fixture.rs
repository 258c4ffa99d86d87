//! Lamps that a scenario adds. Converts position, shape, lumens and colour temperature to emissive triangles with luminance in cd/m^2.

use serde::{Deserialize, Serialize};

use super::super::bulb::Bulb;
use super::super::chance::frame;
use super::super::geometry::Scene;
use super::super::light::{BLACKBODY_K, Illuminant};
use super::super::mesh::{Material, Mesh, Vertex, pushed};
use super::super::vectors::unit;
use crate::error::Error;
use crate::num::{f32_from_u32, f32_nearest, index, u32_from};

/// A lamp: a ball, or a rectangle that shines to one side. It gives the same luminance in every direction (Lambert).
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(deny_unknown_fields)]
pub struct Lamp {
    /// Its middle.
    pub position_m: [f32; 3],
    /// Radius of a ball, 0.001 to 100.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub radius_m: Option<f32>,
    /// Edges of a rectangle, 0.001 to 100 each. Exactly one of this and `radius_m`.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub size_m: Option<[f32; 2]>,
    /// Where a rectangle shines to; down if not given. Need not have unit length.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub direction: Option<[f32; 3]>,
    /// Luminous flux, 1e-6 to 1e9.
    pub flux_lm: f64,
    /// Colour temperature of a black body, 1000 to 20000; the scene's own illuminant if not given.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cct_k: Option<f64>,
    /// Whether `[scene.flicker]` acts on it.
    #[serde(default = "yes")]
    pub flickers: bool,
}

const fn yes() -> bool {
    true
}

/// Balls up to this radius light surfaces as a point of their intensity does.
const BULB_RADIUS_MAX_M: f32 = 0.1;

/// Steps along the edge of an octahedron's face: 8 * 8 * 8 = 512 triangles a ball. Its mesh is as bright as a sphere within 0.7 % in
/// every direction.
const BALL_STEPS: u32 = 8;

impl Lamp {
    /// Checks the numbers. Fails on a number out of range, both shapes or none. `number` counts from 0.
    pub fn check(&self, number: usize) -> Result<(), Error> {
        let refuse = |key: &str, value: String, would_do: &str| {
            Err(Error::key("scene.lamp", value, format!("{key} of lamp {number} (from 0): {would_do}")))
        };
        if !self.position_m.iter().all(|x| x.is_finite() && x.abs() < 1e6) {
            return refuse("position_m", format!("{:?}", self.position_m), "use finite metres below 1e6");
        }
        let edge = |edge: f32| (0.001..=100.0).contains(&edge);
        match (self.radius_m, self.size_m) {
            (Some(radius), None) if edge(radius) => {}
            (Some(radius), None) => return refuse("radius_m", radius.to_string(), "use 0.001 to 100"),
            (None, Some(size)) if size.iter().all(|&side| edge(side)) => {}
            (None, Some(size)) => return refuse("size_m", format!("{size:?}"), "use 0.001 to 100 each"),
            _ => return refuse("radius_m", "".to_owned(), "use exactly one of radius_m and size_m"),
        }
        if let Some(direction) = self.direction.filter(|_| self.size_m.is_none()) {
            let would_do = "a ball shines to all sides; add size_m, or leave it out";
            return refuse("direction", format!("{direction:?}"), would_do);
        }
        if let Some(direction) = self.direction.filter(|&direction| unit(direction).is_none()) {
            return refuse("direction", format!("{direction:?}"), "use three finite numbers, not all 0");
        }
        if !(1e-6..=1e9).contains(&self.flux_lm) {
            return refuse("flux_lm", self.flux_lm.to_string(), "use 1e-6 to 1e9");
        }
        match self.cct_k.filter(|kelvin| !(BLACKBODY_K[0]..=BLACKBODY_K[1]).contains(kelvin)) {
            Some(kelvin) => refuse("cct_k", kelvin.to_string(), "use 1000 to 20000"),
            None => Ok(()),
        }
    }

    /// Adds its triangles, and a material that gives its flux over their area: M = flux / area, L = M / pi.
    fn append_to(&self, mesh: &mut Mesh, name: String, illuminant: Illuminant) {
        let plain = Material::plain(&name, [0.0; 3]);
        let bulb = self.radius_m.filter(|&radius_m| radius_m <= BULB_RADIUS_MAX_M);
        let bulb = bulb.map(|radius_m| Bulb { centre_m: self.position_m, radius_m, cone: None });
        let material = pushed(&mut mesh.materials, Material { double_sided: false, bulb, ..plain });
        let first = mesh.triangles.len();
        if let Some(radius_m) = self.radius_m {
            append_ball(mesh, material, self.position_m, radius_m);
        } else {
            let size_m = self.size_m.expect("a lamp was checked to have a shape");
            append_rectangle(mesh, material, self.position_m, size_m, self.direction.unwrap_or([0.0, -1.0, 0.0]));
        }
        let luminance = self.flux_lm / (std::f64::consts::PI * mesh.area_from_m2(first));
        let colour = self.cct_k.map_or([1.0; 4], |kelvin| illuminant.lux_equivalents_of_blackbody(kelvin));
        mesh.materials[index(material)].emission = colour.map(|band| f32_nearest(band * luminance));
    }
}

/// Adds a ball that lies within its sphere.
pub fn append_ball(mesh: &mut Mesh, material: u32, middle_m: [f32; 3], radius_m: f32) {
    let mut vertices = Vec::new();
    let mut triangles = Vec::new();
    for face in 0..8_u32 {
        let sign = |axis: u32| if face >> axis & 1 == 0 { 1.0_f32 } else { -1.0 };
        let base = u32_from(vertices.len());
        for row in 0..=BALL_STEPS {
            for column in 0..=(BALL_STEPS - row) {
                let third = BALL_STEPS - row - column;
                let at = [sign(0) * f32_from_u32(column), sign(1) * f32_from_u32(row), sign(2) * f32_from_u32(third)];
                let normal = unit(at).expect("a point of an octahedron is not its middle");
                let position_m = std::array::from_fn(|axis| middle_m[axis] + radius_m * normal[axis]);
                vertices.push(Vertex { position_m, normal, uv: [0.0; 2] });
            }
        }
        let vertex = |column: u32, row: u32| base + row * (2 * BALL_STEPS + 3 - row) / 2 + column;
        for row in 0..BALL_STEPS {
            for column in 0..(BALL_STEPS - row) {
                // The mesh turns each triangle to its normals.
                triangles.push([vertex(column, row), vertex(column + 1, row), vertex(column, row + 1)]);
                if column + row + 1 < BALL_STEPS {
                    triangles.push([vertex(column + 1, row), vertex(column + 1, row + 1), vertex(column, row + 1)]);
                }
            }
        }
    }
    mesh.append(material, vertices, &triangles).expect("a ball of checked numbers is sound");
}

fn append_rectangle(mesh: &mut Mesh, material: u32, middle_m: [f32; 3], size_m: [f32; 2], direction: [f32; 3]) {
    let normal = unit(direction).expect("a lamp's direction was checked");
    let [along, across] = frame(normal);
    let corner = |a: f32, b: f32| -> [f32; 3] {
        std::array::from_fn(|axis| middle_m[axis] + 0.5 * (a * size_m[0] * along[axis] + b * size_m[1] * across[axis]))
    };
    let corners_m = [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)];
    mesh.append_quad(material, corners_m, [1.0, 1.0]);
}

impl Scene {
    /// The scene with lamps, whose lumens are in cd/m^2 of its emissive surfaces.
    pub fn with_lamps(self, lamps: &[Lamp], illuminant: Illuminant) -> Result<Self, Error> {
        if lamps.is_empty() {
            return Ok(self);
        }
        let (mut mesh, mut flickering) = (self.mesh, self.flickering);
        for (number, lamp) in lamps.iter().enumerate() {
            lamp.check(number)?;
            lamp.append_to(&mut mesh, format!("lamp {number}"), illuminant);
        }
        if !flickering.is_empty() {
            flickering.extend(lamps.iter().map(|lamp| lamp.flickers));
        }
        let rebuilt = Self::new(&self.name, mesh, self.sky)?;
        Ok(Self { environment: self.environment, flickering, viewpoints: self.viewpoints, ..rebuilt })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::scene::light::BANDS;
    use crate::scene::vectors::{area_m2, unit_normal};

    fn lamp() -> Lamp {
        let (position_m, radius_m) = ([0.0, 1.0, 0.0], Some(0.05));
        Lamp { position_m, radius_m, size_m: None, direction: None, flux_lm: 800.0, cct_k: None, flickers: true }
    }

    fn flux_of(lamp: &Lamp) -> f64 {
        let mut mesh = Mesh::default();
        lamp.append_to(&mut mesh, "l".to_owned(), Illuminant::D65);
        let emission = f64::from(mesh.materials[0].emission[1]);
        let mut sum = 0.0;
        for piece in 0..mesh.triangles.len() {
            sum += f64::from(area_m2(mesh.corners_m(piece))) * std::f64::consts::PI * emission;
            // All triangles look away from the middle.
            let corners = mesh.corners_m(piece);
            let normal = unit_normal(corners).unwrap();
            let out: f32 = (0..3).map(|axis| (corners[0][axis] - lamp.position_m[axis]) * normal[axis]).sum();
            assert!(out > -1e-6, "{out}");
        }
        sum
    }

    #[test]
    fn a_lamp_gives_its_lumens_whatever_its_shape() {
        let flat = Lamp { radius_m: None, size_m: Some([0.6, 1.2]), direction: Some([1.0, -2.0, 0.5]), ..lamp() };
        for lamp in [lamp(), flat] {
            // One rounding to f32 of the luminance.
            assert!((flux_of(&lamp) / 800.0 - 1.0).abs() < 1e-6);
        }
    }

    #[test]
    fn warm_lamps_are_redder_and_have_more_infrared() {
        let mut mesh = Mesh::default();
        Lamp { cct_k: Some(2700.0), ..lamp() }.append_to(&mut mesh, "l".to_owned(), Illuminant::D65);
        let [red, green, blue, infrared] = mesh.materials[0].emission;
        assert!(infrared > red && red > green && green > blue, "{:?}", mesh.materials[0].emission);
        assert_eq!(BANDS, 4);
    }

    #[test]
    fn bad_lamps_are_refused_by_key() {
        let mut tried = 0;
        for (bad, key) in [
            (Lamp { position_m: [f32::NAN; 3], ..lamp() }, "position_m"),
            (Lamp { radius_m: Some(0.0), ..lamp() }, "radius_m"),
            (Lamp { radius_m: None, ..lamp() }, "radius_m"),
            (Lamp { size_m: Some([1.0; 2]), ..lamp() }, "radius_m"),
            (Lamp { radius_m: None, size_m: Some([1.0, -1.0]), ..lamp() }, "size_m"),
            (Lamp { direction: Some([0.0, 1.0, 0.0]), ..lamp() }, "direction"),
            (Lamp { flux_lm: 0.0, ..lamp() }, "flux_lm"),
            (Lamp { cct_k: Some(500.0), ..lamp() }, "cct_k"),
        ] {
            let error = bad.check(2).unwrap_err().to_string();
            assert!(error.contains("scene.lamp") && error.contains(&format!("{key} of lamp 2")), "{error}");
            tried += 1;
        }
        assert_eq!(tried, 8);
    }
}
