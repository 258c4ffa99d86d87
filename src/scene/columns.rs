//! A room with striped columns around its middle, without files, for the browser and for shutters: a camera that turns sees upright edges
//! pass at all times. Its pictures are a sixteenth as large as those of `box_room`, so that it is made in a moment.

use super::box_room::{GREATEST_M, LEAST_M, Pattern, luminous_ceiling, pattern, textured_quad};
use super::mesh::Mesh;
use super::target::cube;
use crate::draw::DrawKey;
use crate::num::{index, low_u8, low_u32, u8_clipped, u64_from};

/// Texels along a metre: 16 mm each, what a pixel of 320 columns over a right angle sees at 2.5 m.
const TEXELS_PER_M: u32 = 64;

/// Middles of the columns on the floor, x and z. They leave 1.5 m around the origin to the camera.
const COLUMNS_M: [[f32; 2]; 10] = [
    [-2.2, -1.9],
    [-0.7, -1.9],
    [0.7, -1.9],
    [2.2, -1.9],
    [2.4, 0.0],
    [2.2, 1.9],
    [0.7, 1.9],
    [-0.7, 1.9],
    [-2.2, 1.9],
    [-2.4, 0.0],
];

/// Half the width of a column.
const HALF_M: f32 = 0.15;

/// Top of the columns: below the lamp, which lights all of them.
const TOP_M: f32 = 2.6;

/// Widths of a stripe in texels: 5 to 10 cm.
const STRIPE_TEXELS: [u32; 2] = [3, 6];

/// Makes the room. Another seed gives other patterns on the same walls.
pub fn columns(seed: u64) -> Mesh {
    let mut mesh = Mesh::default();
    let key = DrawKey::root(seed).with(0x636F_6C75);
    let mut face = 0;
    let mut append = |mesh: &mut Mesh, corners_m, pattern: Pattern| {
        textured_quad(mesh, key.with(u64_from(face)), face, (corners_m, TEXELS_PER_M, pattern));
        face += 1;
    };
    for corners_m in cube(LEAST_M, GREATEST_M, true) {
        append(&mut mesh, corners_m, pattern);
    }
    for [x_m, z_m] in COLUMNS_M {
        let [least_m, greatest_m] =
            [([-HALF_M; 2], 0.0), ([HALF_M; 2], TOP_M)].map(|([x, z], y)| [x_m + x, y, z_m + z]);
        for (side, corners_m) in cube(least_m, greatest_m, false).into_iter().enumerate() {
            // The floor covers what stands on it.
            if side != 2 {
                append(&mut mesh, corners_m, stripes);
            }
        }
    }
    luminous_ceiling(&mut mesh);
    mesh
}

/// Upright stripes, light and dark in turn, of many greys.
fn stripes(key: DrawKey, width: u32, height: u32) -> Vec<[u8; 3]> {
    let drawn = |number: u64, from: u32, to: u32| from + low_u32(key.with(number).0 >> 16) % (to - from + 1);
    let mut row = Vec::with_capacity(index(width));
    let mut number = 0;
    while row.len() < index(width) {
        let bright = if number % 2 == 0 { drawn(2 * number, 170, 245) } else { drawn(2 * number, 15, 70) };
        let grey = [u8_clipped(i32::from(low_u8(bright))); 3];
        let texels = drawn(2 * number + 1, STRIPE_TEXELS[0], STRIPE_TEXELS[1]);
        row.extend((0..texels).map(|_| grey));
        number += 1;
    }
    row.truncate(index(width));
    (0..height).flat_map(|_| row.iter().copied()).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn stripes_stand_upright_and_change_from_light_to_dark() {
        let (width, height) = (64, 9);
        let picture = stripes(DrawKey::root(3), width, height);
        let rows: Vec<&[[u8; 3]]> = picture.chunks(index(width)).collect();
        assert!(rows.iter().all(|row| *row == rows[0]) && rows.len() == index(height));
        let edges = rows[0].windows(2).filter(|pair| pair[0][0].abs_diff(pair[1][0]) >= 100).count();
        // 64 texels in stripes of 3 to 6: 10 to 21 edges.
        assert!((10..=21).contains(&edges), "{edges}");
    }

    #[test]
    fn columns_leave_the_camera_its_room() {
        for [x_m, z_m] in COLUMNS_M {
            assert!((x_m * x_m + z_m * z_m).sqrt() - HALF_M * 2.0_f32.sqrt() > 1.5, "{x_m}, {z_m}");
        }
    }
}
