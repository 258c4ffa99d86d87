//! KHR_lights_punctual. Enters: lights without size. Leaves: small lamps of the same intensity, because only what has a size can be
//! seen and has soft shadows.

use glam::{DMat4, DVec3};
use gltf::khr_lights_punctual::{Kind, Light};

use super::super::light::with_infrared;
use super::super::mesh::{Material, Vertex};
use super::node::Reader;
use crate::num::{f32_nearest, f64_from_usize, u32_from};

/// Radius of the lamps: a small bulb.
const RADIUS_M: f64 = 0.03;

/// Rings and sectors of a bulb. Its area seen from afar is within 3 % of a sphere's, which its radiance makes up for.
const RINGS: usize = 8;
/// Sectors.
const SECTORS: usize = 12;

/// Puts a lamp where a light is. Units: glTF's candela and nits go together, so a lamp of intensity I and radius r has the radiance
/// I / (pi r^2).
pub fn place(reader: &mut Reader<'_>, light: &Light<'_>, world_from_node: DMat4) {
    let intensity = f64::from(light.intensity());
    if !(intensity.is_finite() && intensity > 0.0) {
        reader.notes.add("lights without intensity are left out");
        return;
    }
    let centre_m = world_from_node.w_axis.truncate();
    let forward = -world_from_node.z_axis.truncate().normalize_or(DVec3::NEG_Z);
    let radiance = intensity / (std::f64::consts::PI * RADIUS_M * RADIUS_M);
    let colour = light.color().map(|band| if band.is_finite() { band.clamp(0.0, 1.0) } else { 1.0 });
    let emission = with_infrared(colour.map(|band| f32_nearest(f64::from(band) * radiance)));
    let plain = Material::plain(light.name().unwrap_or("light"), [0.0; 3]);
    let material = Material { emission, double_sided: false, ..plain };
    match light.kind() {
        Kind::Point => {
            reader.notes.add(format!("point lights are bulbs of {RADIUS_M} m radius"));
            let material = reader.push(material);
            bulb(reader, material, centre_m);
        }
        Kind::Spot { .. } => {
            reader.notes.add(format!(
                "spot lights are discs of {RADIUS_M} m radius that shine by the cosine, without the edge of their cone"
            ));
            let material = reader.push(material);
            disc(reader, material, centre_m, forward);
        }
        Kind::Directional => {
            reader.notes.add("directional lights are not read; the sun of the scenario's sky would do");
        }
    }
}

fn narrow(vector: DVec3) -> [f32; 3] {
    vector.to_array().map(f32_nearest)
}

fn bulb(reader: &mut Reader<'_>, material: u32, centre_m: DVec3) {
    let mut vertices = Vec::new();
    for ring in 0..=RINGS {
        let (sine, cosine) = libm::sincos(std::f64::consts::PI * f64_from_usize(ring) / f64_from_usize(RINGS));
        for sector in 0..SECTORS {
            let (across, along) =
                libm::sincos(std::f64::consts::TAU * f64_from_usize(sector) / f64_from_usize(SECTORS));
            let normal = DVec3::new(sine * along, cosine, sine * across);
            let position_m = narrow(centre_m + RADIUS_M * normal);
            vertices.push(Vertex { position_m, normal: narrow(normal), uv: [0.0; 2] });
        }
    }
    let mut triangles = Vec::new();
    for ring in 0..RINGS {
        for sector in 0..SECTORS {
            let [a, b] = [sector, (sector + 1) % SECTORS].map(|sector| u32_from(ring * SECTORS + sector));
            let [c, d] = [a, b].map(|upper| upper + u32_from(SECTORS));
            triangles.extend([[a, b, c], [b, d, c]]);
        }
    }
    // A light beyond the range of coordinates lights nothing; everything else about a bulb is sound.
    if reader.mesh.append(material, &vertices, &triangles).is_err() {
        reader.notes.add("a light farther than 1e6 m is left out");
    }
}

fn disc(reader: &mut Reader<'_>, material: u32, centre_m: DVec3, forward: DVec3) {
    let (across, beside) = forward.any_orthonormal_pair();
    let rim = (0..SECTORS).map(|sector| {
        let (sine, cosine) = libm::sincos(std::f64::consts::TAU * f64_from_usize(sector) / f64_from_usize(SECTORS));
        centre_m + RADIUS_M * (across * cosine + beside * sine)
    });
    let vertex = |at: DVec3| Vertex { position_m: narrow(at), normal: narrow(forward), uv: [0.0; 2] };
    let vertices: Vec<Vertex> = std::iter::once(centre_m).chain(rim).map(vertex).collect();
    let sides = u32_from(SECTORS);
    let triangles: Vec<[u32; 3]> = (0..sides).map(|side| [0, 1 + side, 1 + (side + 1) % sides]).collect();
    if reader.mesh.append(material, &vertices, &triangles).is_err() {
        reader.notes.add("a light farther than 1e6 m is left out");
    }
}
