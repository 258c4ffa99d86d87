//! Building blocks of generated scenes: slabs, blocks, smooth patches, turned columns, walls with openings. Texture coordinates continue
//! from piece to piece; round surfaces have smooth normals.

mod opening;
mod surface;

pub use opening::{Opening, Wall};

use super::cut_out::CutOut;
use super::light::with_infrared;
use super::mesh::{Material, Vertex, pushed};
use super::texture::Texture;
use super::vectors::{sub, unit, unit_normal};
use crate::num::{f32_from_u32, index};
pub use surface::{Builder, Surface, world_uv};

/// Points of a profile from the foot up, from its radii and its heights.
pub(super) fn profile<const N: usize>(radii_m: [f32; N], heights_m: [f32; N]) -> [[f32; 2]; N] {
    std::array::from_fn(|point| [radii_m[point], heights_m[point]])
}

/// What lies from `near` to `far` to the right of the middle, or, for a negative side, to the left.
pub(super) fn strip(side: f32, near: f32, far: f32) -> [f32; 2] {
    if side < 0.0 { [-far, -near] } else { [near, far] }
}

impl Builder {
    /// Adds a material that is seen from its front only. Its picture, if any, is `tile_m` wide.
    pub fn surface(&mut self, name: &str, colour: [f32; 3], picture: Option<Texture>, tile_m: f32) -> Surface {
        let texture = picture.map(|picture| pushed(&mut self.mesh.textures, picture));
        self.push(Material { texture, double_sided: false, ..Material::plain(name, colour) }, tile_m)
    }

    /// Adds a material with holes, seen from both sides.
    pub fn cut_out(&mut self, name: &str, picture: Texture, holes: CutOut) -> Surface {
        let texture = Some(pushed(&mut self.mesh.textures, picture));
        let cut_out = Some(pushed(&mut self.mesh.cut_outs, holes));
        self.push(Material { texture, cut_out, ..Material::plain(name, [1.0; 3]) }, 1.0)
    }

    /// Adds a surface that glows on its front and reflects nothing.
    pub fn glowing(&mut self, name: &str, radiance: [f32; 3]) -> Surface {
        let emission = with_infrared(radiance);
        self.push(Material { emission, double_sided: false, ..Material::plain(name, [0.0; 3]) }, 1.0)
    }

    /// Adds a material like another one, with the same picture, but of another colour.
    pub fn tinted(&mut self, surface: Surface, colour: [f32; 3]) -> Surface {
        let material = self.mesh.materials[index(surface.material)].clone();
        self.push(Material { base_colour: with_infrared(colour), ..material }, surface.tile_m)
    }

    /// Adds a material like another one, but polished to a roughness: 0 is a mirror.
    pub fn polished(&mut self, surface: Surface, roughness: f32) -> Surface {
        let material = self.mesh.materials[index(surface.material)].clone();
        self.push(Material { roughness, ..material }, surface.tile_m)
    }

    /// Adds a material like another one, but seen from both sides.
    pub fn two_sided(&mut self, surface: Surface) -> Surface {
        let material = self.mesh.materials[index(surface.material)].clone();
        self.push(Material { double_sided: true, ..material }, surface.tile_m)
    }

    fn push(&mut self, material: Material, tile_m: f32) -> Surface {
        Surface { material: pushed(&mut self.mesh.materials, material), tile_m }
    }

    fn add(&mut self, surface: Surface, vertices: &[Vertex], triangles: &[[u32; 3]]) {
        self.mesh.append(surface.material, vertices, triangles).expect("pieces made here are sound");
    }

    /// A flat quadrangle, counter-clockwise seen from its front; its picture lies by the world's axes.
    pub fn quad(&mut self, surface: Surface, corners_m: [[f32; 3]; 4]) {
        let [a, b, c, d] = corners_m;
        let Some(normal) = unit_normal([a, b, c]).or_else(|| unit_normal([a, c, d])) else { return };
        let vertices = corners_m.map(|at| Vertex { position_m: at, normal, uv: world_uv(at, normal, surface.tile_m) });
        self.add(surface, &vertices, &[[0, 1, 2], [0, 2, 3]]);
    }

    /// A level rectangle that is seen from above.
    pub fn level(&mut self, surface: Surface, [x0, x1]: [f32; 2], [z0, z1]: [f32; 2], y: f32) {
        self.quad(surface, [[x0, y, z1], [x1, y, z1], [x1, y, z0], [x0, y, z0]]);
    }

    /// A flat quadrangle with one whole picture on it, upright for corners that start at the bottom left.
    pub fn picture(&mut self, surface: Surface, corners_m: [[f32; 3]; 4]) {
        self.mesh.append_quad(surface.material, corners_m, [1.0, 1.0]);
    }

    /// A block along the axes.
    pub fn block(&mut self, surface: Surface, least_m: [f32; 3], greatest_m: [f32; 3]) {
        for corners_m in super::target::cube(least_m, greatest_m, false) {
            self.quad(surface, corners_m);
        }
    }

    /// A smooth patch of the given columns and rows: `at` takes two shares from 0 to 1.
    pub fn patch(&mut self, surface: Surface, [columns, rows]: [u32; 2], at: &dyn Fn(f32, f32) -> Vertex) {
        let mut vertices = Vec::new();
        for row in 0..=rows {
            for column in 0..=columns {
                let share = |number: u32, of: u32| f32_from_u32(number) / f32_from_u32(of);
                vertices.push(at(share(column, columns), share(row, rows)));
            }
        }
        let mut triangles = Vec::new();
        for row in 0..rows {
            for column in 0..columns {
                let a = row * (columns + 1) + column;
                let (b, c, d) = (a + 1, a + columns + 2, a + columns + 1);
                triangles.extend([[a, b, c], [a, c, d]]);
            }
        }
        self.add(surface, &vertices, &triangles);
    }

    /// A body of revolution about a vertical axis. The profile is radius and height from the foot up; where it turns by less than
    /// 40 degrees it is round, elsewhere it has an edge.
    pub fn turned(&mut self, surface: Surface, foot_m: [f32; 3], profile_m: &[[f32; 2]], sides: u32) {
        let outward = |from: [f32; 2], to: [f32; 2]| unit([to[1] - from[1], from[0] - to[0], 0.0]);
        let normals: Vec<_> = profile_m.windows(2).map(|pair| outward(pair[0], pair[1])).collect();
        // The picture runs once around in whole tiles, so that its seam closes.
        let widest_m = profile_m.iter().fold(0.0_f32, |widest, point| widest.max(point[0]));
        let around = (std::f32::consts::TAU * widest_m / surface.tile_m).round_ties_even().max(1.0);
        for (number, pair) in profile_m.windows(2).enumerate() {
            let Some(own) = normals[number] else { continue };
            let joined = |other: Option<&Option<[f32; 3]>>| match other {
                Some(Some(other)) if own[0] * other[0] + own[1] * other[1] > 0.766 => {
                    unit([own[0] + other[0], own[1] + other[1], 0.0]).unwrap_or(own)
                }
                _ => own,
            };
            let before = joined(number.checked_sub(1).and_then(|before| normals.get(before)));
            let after = joined(normals.get(number + 1));
            self.patch(surface, [sides, 1], &|turn, up| {
                let (sine, cosine) = libm::sincosf(std::f32::consts::TAU * turn);
                let ([radius, height], normal) = if up > 0.5 { (pair[1], after) } else { (pair[0], before) };
                Vertex {
                    position_m: [foot_m[0] + radius * cosine, foot_m[1] + height, foot_m[2] + radius * sine],
                    normal: [normal[0] * cosine, normal[1], normal[0] * sine],
                    uv: [around * turn, -(foot_m[1] + height) / surface.tile_m],
                }
            });
        }
    }

    /// A round bar between two points, open at its ends, that narrows from one radius to the other.
    pub fn limb(&mut self, surface: Surface, ends_m: [[f32; 3]; 2], radii_m: [f32; 2], sides: u32) {
        let [from_m, to_m] = ends_m;
        let Some(axis) = unit(sub(to_m, from_m)) else { return };
        let [across, beside] = super::chance::frame(axis);
        self.patch(surface, [sides, 1], &|turn, up| {
            let (sine, cosine) = libm::sincosf(std::f32::consts::TAU * turn);
            let normal = [0, 1, 2].map(|k| across[k] * cosine + beside[k] * sine);
            let radius = radii_m[0] + (radii_m[1] - radii_m[0]) * up;
            let position_m = [0, 1, 2].map(|k| from_m[k] + (to_m[k] - from_m[k]) * up + normal[k] * radius);
            Vertex { position_m, normal, uv: [turn, up] }
        });
    }
}
