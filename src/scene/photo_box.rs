//! A box room of photographs, for side-by-side runs with other simulators and trackers: a scene of 6 by 3 by 5 m with plane walls and a few
//! blocks. Every face shows one of five photographs; a lamp in the ceiling lights it.

use super::box_room::{GREATEST_M, LEAST_M};
use super::build::Builder;
use super::mesh::Mesh;
use super::target::cube;
use super::texture::Texture;

/// Blocks in the room: least corner, greatest corner, number of their picture.
const BLOCKS_M: [([f32; 3], [f32; 3], usize); 5] = [
    ([-2.9, 0.0, -2.4], [-1.9, 0.9, -1.6], 1),
    ([1.7, 0.0, -2.45], [2.9, 1.9, -1.9], 2),
    ([-2.95, 0.0, 1.2], [-2.2, 1.4, 2.4], 4),
    ([1.9, 0.0, 1.3], [2.9, 0.75, 2.4], 3),
    ([-0.5, 0.0, -2.45], [0.6, 0.5, -1.9], 0),
];

/// Makes the room. Pictures: floor, then those of the walls and the ceiling.
pub fn photo_box(pictures: [Texture; 5]) -> Mesh {
    let mut builder = Builder::default();
    let names = ["tiles", "marble", "wood", "wallpaper 1", "wallpaper 2"];
    let mut number = 0;
    let surfaces = pictures.map(|picture| {
        number += 1;
        builder.surface(names[number - 1], [0.85; 3], Some(picture), 1.5)
    });
    // -x, +x, floor, ceiling, -z, +z.
    for (face, picture) in cube(LEAST_M, GREATEST_M, true).into_iter().zip([3, 4, 0, 1, 1, 2]) {
        builder.quad(surfaces[picture], face);
    }
    for (least_m, greatest_m, picture) in BLOCKS_M {
        builder.block(surfaces[picture], least_m, greatest_m);
    }
    let lamp = builder.glowing("lamp", [1.0; 3]);
    let y = GREATEST_M[1] - 0.02;
    builder.quad(lamp, [[-2.5, y, -2.0], [2.5, y, -2.0], [2.5, y, 2.0], [-2.5, y, 2.0]]);
    builder.mesh
}
