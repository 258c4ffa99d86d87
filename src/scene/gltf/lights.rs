//! KHR_lights_punctual: lights without size become small balls of the same intensity, because only what has a size can be seen and has
//! soft shadows.

use glam::{DMat4, DVec3};
use gltf::khr_lights_punctual::{Kind, Light};

use super::super::bulb::{Bulb, Cone};
use super::super::environment::Sun;
use super::super::lamps::fixture::append_ball;
use super::super::light::with_infrared;
use super::super::mesh::Material;
use super::pictures::share;
use super::reader::Reader;
use crate::num::{f32_nearest, index};

/// Radius of the lamps: a small bulb.
const RADIUS_M: f32 = 0.03;

/// Farthest position of a light along each axis; beyond it are no coordinates.
const POSITION_MAX_M: f64 = 0.9e6;

/// Directional lights at most: every sample aims rays at each.
const DISTANT_MAX: usize = 64;

/// Puts a lamp where a light is; a directional one shines from beyond all surfaces, in lux.
/// Units: glTF's candela and nits go together, so a ball of intensity I whose triangles have the area A,
/// a quarter of which is seen in the mean of all directions, has the radiance 4 I / A. Fails on more triangles than a scene may have.
pub fn append(reader: &mut Reader<'_>, light: &Light<'_>, world_from_node: DMat4) -> Result<(), String> {
    let intensity = f64::from(light.intensity());
    if !(intensity.is_finite() && intensity > 0.0) {
        reader.notes.add("lights without intensity are left out");
        return Ok(());
    }
    let colour = light.color().map(|band| f64::from(share(band)));
    let forward = -world_from_node.z_axis.truncate().normalize_or(DVec3::NEG_Z);
    let cone = match light.kind() {
        Kind::Point => {
            reader.notes.add(format!("point lights are balls of {RADIUS_M} m radius"));
            None
        }
        Kind::Spot { inner_cone_angle, outer_cone_angle } => {
            reader.notes.add(format!("spot lights are balls of {RADIUS_M} m radius that shine within their cone"));
            let axis = forward.to_array().map(f32_nearest);
            Some(Cone::new(axis, inner_cone_angle.into(), outer_cone_angle.into()))
        }
        Kind::Directional => {
            if reader.mesh.distant.len() >= DISTANT_MAX {
                reader.notes.add(format!("of the directional lights only the first {DISTANT_MAX} are read"));
                return Ok(());
            }
            reader.notes.add("directional lights are as wide as the sun, and are not seen themselves");
            let normal_irradiance = with_infrared(colour.map(|band| f32_nearest(band * intensity)));
            let direction = (-forward).to_array().map(f32_nearest);
            reader.mesh.distant.push(Sun { direction, normal_irradiance });
            return Ok(());
        }
    };
    let centre_m = world_from_node.w_axis.truncate();
    if !centre_m.to_array().iter().all(|x| x.abs() <= POSITION_MAX_M) {
        reader.notes.add("a light farther than 9e5 m is left out");
        return Ok(());
    }
    let centre_m = centre_m.to_array().map(f32_nearest);
    let plain = Material::plain(light.name().unwrap_or("light"), [0.0; 3]);
    let bulb = Some(Bulb { centre_m, radius_m: RADIUS_M, cone });
    let material = reader.push(Material { bulb, double_sided: false, ..plain });
    let first = reader.mesh.triangles.len();
    append_ball(&mut reader.mesh, material, centre_m, RADIUS_M);
    let area_m2 = reader.mesh.area_from_m2(first);
    if area_m2 <= 0.0 {
        reader.notes.add("a light too far away for its size is left out");
        return Ok(());
    }
    let radiance = 4.0 * intensity / area_m2;
    let emission = with_infrared(colour.map(|band| f32_nearest(band * radiance)));
    reader.mesh.materials[index(material)].emission = emission;
    Ok(())
}
