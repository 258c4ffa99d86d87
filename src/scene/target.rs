//! Photometric targets. Enters: a reflectance. Leaves: a scene that fills any view evenly.

use super::Scene;
use super::light::BANDS;
use super::mesh::{Material, Mesh};
use crate::error::Error;

/// Half the edge of the cube that a flat field is: the camera stands at its centre.
const HALF_EDGE_M: f32 = 2.0;

/// A Lambertian field of one reflectance in every direction: the inside of a cube around the origin. Light it with
/// `Scene::evenly_lit`, whose illuminance is that on the target's surface.
///
/// # Errors
/// A reflectance outside 0..=1.
pub fn flat(reflectance: f64) -> Result<Scene, Error> {
    if !(0.0..=1.0).contains(&reflectance) {
        return Err(Error::key("scene.reflectance", reflectance, "0 to 1 would do"));
    }
    let mut mesh = Mesh::default();
    // White is exactly white here: the bound on albedos is for scenes with bounces, and this one has none.
    mesh.materials.push(Material::plain("flat", [1.0; 3]));
    for corners_m in cube([-HALF_EDGE_M; 3], [HALF_EDGE_M; 3], true) {
        mesh.append_quad(0, corners_m, [1.0, 1.0]);
    }
    let mut scene = Scene::new("flat", mesh, [0.0; BANDS])?;
    scene.mesh.materials[0].base_colour = [crate::num::f32_nearest(reflectance); BANDS];
    Ok(scene)
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
