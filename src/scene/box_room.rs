//! A furnished room without files, for tests, the browser and a fresh install. Generates, from a seed, a scene of 6 by 3 by 5 m, floor at y
//! = 0, rich in corners at every scale, lit by a lamp in the ceiling.

use super::geometry::Scene;
use super::light::BANDS;
use super::mesh::{Material, Mesh, pushed};
use super::target::cube;
use super::texture::{Texture, Wrap};
use crate::draw::DrawKey;
use crate::num::{f32_from_u32, index, low_u8, low_u32, u8_clipped, u32_from, u32_truncated_f32, u64_from};

/// Least corner of the room in metres.
pub const LEAST_M: [f32; 3] = [-3.0, 0.0, -2.5];
/// Greatest corner of the room in metres.
pub const GREATEST_M: [f32; 3] = [3.0, 3.0, 2.5];

/// Texels along a metre of wall at the finest level: 4 mm each, so a VGA pixel at 2 m is about one texel.
const TEXELS_PER_M: u32 = 256;

/// Makes the codes of a picture of a width and height.
pub(super) type Pattern = fn(DrawKey, u32, u32) -> Vec<[u8; 3]>;

/// Boxes of furniture: least and greatest corner. They keep clear of the middle, where the camera moves.
const FURNITURE_M: [[[f32; 3]; 2]; 6] = [
    [[-2.9, 0.0, -2.4], [-1.9, 0.9, -1.6]],
    [[1.7, 0.0, -2.45], [2.9, 1.9, -1.9]],
    [[-2.95, 0.0, 1.2], [-2.2, 1.4, 2.4]],
    [[1.9, 0.0, 1.3], [2.9, 0.75, 2.4]],
    [[-0.5, 0.0, -2.45], [0.6, 0.5, -1.9]],
    [[2.2, 0.75, 1.6], [2.6, 1.1, 2.0]],
];

/// A luminous ceiling of 5 by 4 m, 2 cm below the ceiling proper, shining down: walls get light that is of the order of the floor's.
const LAMP_M: [[f32; 3]; 2] = [[-2.5, 2.98, -2.0], [2.5, 2.98, 2.0]];

/// Makes the room. Another seed gives other patterns on the same walls.
pub fn box_room(seed: u64) -> Scene {
    let mut mesh = Mesh::default();
    let key = DrawKey::root(seed).with(0x0062_6F78);
    for (face, corners_m) in cube(LEAST_M, GREATEST_M, true).into_iter().enumerate() {
        textured_quad(&mut mesh, key.with(u64_from(face)), face, (corners_m, TEXELS_PER_M, pattern));
    }
    for (number, [least_m, greatest_m]) in FURNITURE_M.into_iter().enumerate() {
        for (face, corners_m) in cube(least_m, greatest_m, false).into_iter().enumerate() {
            if face != 2 {
                let face = 6 + 6 * number + face;
                textured_quad(&mut mesh, key.with(u64_from(face)), face, (corners_m, TEXELS_PER_M, pattern));
            }
        }
    }
    luminous_ceiling(&mut mesh);
    Scene::new("box", mesh, [0.0; BANDS]).expect("the room has triangles")
}

/// Puts the lamp under the ceiling.
pub(super) fn luminous_ceiling(mesh: &mut Mesh) {
    let glowing = Material { emission: [1.0; BANDS], double_sided: false, ..Material::plain("lamp", [0.0; 3]) };
    let lamp = pushed(&mut mesh.materials, glowing);
    let [[x0, y, z0], [x1, _, z1]] = LAMP_M;
    mesh.append_quad(lamp, [[x0, y, z0], [x1, y, z0], [x1, y, z1], [x0, y, z1]], [1.0, 1.0]);
}

/// A face of the room with a picture by a pattern, at the given texels per metre.
pub(super) fn textured_quad(
    mesh: &mut Mesh,
    key: DrawKey,
    face: usize,
    (corners_m, texels_per_m, pattern): ([[f32; 3]; 4], u32, Pattern),
) {
    let edge_m = |a: [f32; 3], b: [f32; 3]| {
        // Edges run along the axes, so the sum of the coordinates' differences is the length.
        (a[0] - b[0]).abs() + (a[1] - b[1]).abs() + (a[2] - b[2]).abs()
    };
    let texels = |length_m: f32| u32_truncated_f32(length_m * f32_from_u32(texels_per_m)).max(8);
    let width = texels(edge_m(corners_m[0], corners_m[1]));
    let height = texels(edge_m(corners_m[1], corners_m[2]));
    let codes = pattern(key, width, height);
    let texture = Some(pushed(&mut mesh.textures, Texture::from_srgb(width, height, &codes, [Wrap::Clamp; 2])));
    let plain = Material::plain(&format!("face {face}"), [0.85; 3]);
    let material = pushed(&mut mesh.materials, Material { texture, double_sided: false, ..plain });
    mesh.append_quad(material, corners_m, [1.0, 1.0]);
}

/// Tiles, rectangles of all sizes and value noise: corners at every scale.
pub(super) fn pattern(key: DrawKey, width: u32, height: u32) -> Vec<[u8; 3]> {
    let tint: [i32; 3] = [0, 1, 2].map(|band| 215 + draw(key.with(1), band, 41));
    let (coarse, fine) =
        (Corners::<32, 3>::new(key.with(3), [width, height]), Corners::<8, 6>::new(key.with(4), [width, height]));
    let mut grey: Vec<u8> = Vec::with_capacity(index(width) * index(height));
    let mut row = vec![0; index(width)];
    for y in 0..height {
        for (tile, texels) in (0..).zip(row.chunks_mut(64)) {
            texels.fill(150 - 64 + 22 * draw(key.with(2), tile << 32 | u64::from(y / 64), 5));
        }
        coarse.add_row(y, &mut row);
        fine.add_row(y, &mut row);
        for value in &row {
            grey.push(u8_clipped(*value));
        }
    }
    let area = width * height;
    for (octave, edge) in [(0, 160), (1, 80), (2, 40), (3, 20), (4, 10)] {
        let octave_key = key.with(5).with(octave);
        // About a sixth of the face is covered by rectangles of each size.
        for number in 0..u64::from(area / (6 * edge * edge / 2)) {
            rectangle(octave_key.with(number), [width, height], edge, &mut grey);
        }
    }
    let colours: [[u8; 3]; 256] = std::array::from_fn(|value| {
        let value = i32::from(low_u8(u32_from(value))).clamp(8, 250);
        tint.map(|tint| u8_clipped(value * tint / 255))
    });
    let mut codes = Vec::with_capacity(grey.len());
    for value in grey {
        codes.push(colours[usize::from(value)]);
    }
    codes
}

fn rectangle(key: DrawKey, [width, height]: [u32; 2], edge: u32, grey: &mut [u8]) {
    let up_to = |number: u64, limit: u32| low_u32(key.with(number).0 >> 16) % limit.max(1);
    let (w, h) = (edge / 2 + up_to(0, edge / 2 + 1), edge / 2 + up_to(1, edge / 2 + 1));
    let (x0, y0) = (up_to(2, width), up_to(3, height));
    let value = low_u8(up_to(4, 256));
    for y in y0..(y0 + h).min(height) {
        let row = index(y) * index(width);
        grey[row + index(x0)..row + index((x0 + w).min(width))].fill(value);
    }
}

/// A draw of 0..limit.
fn draw(key: DrawKey, number: u64, limit: u32) -> i32 {
    i32::try_from(low_u32(key.with(number).0 >> 16) % limit).expect("limits here are small")
}

/// Draws of 0..256 at the corners of square cells of `CELL` texels: each once, although many texels lie between them.
struct Corners<const CELL: u32, const PART: i32> {
    across: usize,
    draws: Vec<i32>,
}

impl<const CELL: u32, const PART: i32> Corners<CELL, PART> {
    fn new(key: DrawKey, [width, height]: [u32; 2]) -> Self {
        let [across, down] = [width, height].map(|texels| texels / CELL + 2);
        let of_row = |y: u32| (0..across).map(move |x| draw(key, u64::from(x) << 32 | u64::from(y), 256));
        Self { across: index(across), draws: (0..down).flat_map(of_row).collect() }
    }

    /// Adds the `PART`th part of noise of 0..256, linear between the corners, to a row of texels.
    fn add_row(&self, y: u32, row: &mut [i32]) {
        let above = &self.draws[index(y / CELL) * self.across..];
        let below = &above[self.across..];
        let (whole, fy) = (const { CELL.cast_signed() }, (y % CELL).cast_signed());
        let mut left = above[0] * (whole - fy) + below[0] * fy;
        for (cell, texels) in row.chunks_mut(index(CELL)).enumerate() {
            let right = above[cell + 1] * (whole - fy) + below[cell + 1] * fy;
            for (fx, texel) in (0..).zip(texels) {
                *texel += (left * (whole - fx) + right * fx) / (whole * whole) / PART;
            }
            left = right;
        }
    }
}
