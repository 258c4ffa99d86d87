//! A large hall with columns and arches: a scene of 30 by 60 m and 12 m high, y up, the floor at 0, its long axis along z. Its pictures are
//! marble, tiles, wood and cloth.
//!
//! A nave of 13 m between two rows of ten round arches on marble columns, a coffered vault over it, groin-vaulted aisles beside it,
//! light through tall windows in the aisles and a clerestory. Proportions are those of an early Renaissance basilica at two thirds
//! of its size: bays of 6 m, columns of 4.4 m and 0.46 m radius (a ratio of 9.6 to the diameter below, about Vitruvius' Corinthian
//! order).

mod furniture;
mod plan;

use super::build::{Builder, Opening, Wall, profile, strip};
use super::mesh::{Mesh, Vertex};
use super::pattern::{Masonry, coffers, ground, masonry};
use super::texture::Texture;
use super::vectors::unit;
use crate::num::f32_from_i32;
use plan::{
    BAY_M, BAYS, COLUMN_M, CORNICE_M, HALF_LENGTH_M, HALF_WALL_M, HallMaterials, OUTER_M, SAGITTA_M, SPRING_M, STRING_M,
};

/// Pictures on the surfaces of the hall.
#[derive(Clone, Debug)]
pub struct HallPictures {
    /// Columns and slabs.
    pub marble: Texture,
    /// Floor of the aisles.
    pub tiles: Texture,
    /// Benches and doors.
    pub wood: Texture,
    /// Banners.
    pub cloth: [Texture; 2],
}

/// Makes the hall.
pub fn hall(pictures: HallPictures) -> Mesh {
    let mut builder = Builder::default();
    let stuff = stuff(&mut builder, pictures);
    floor(&mut builder, &stuff);
    for side in [-1.0, 1.0] {
        arcade(&mut builder, &stuff, side);
        outer_wall(&mut builder, &stuff, side);
    }
    for bay in 0..BAYS {
        let z_m = BAY_M * f32_from_i32(bay) - HALF_LENGTH_M;
        nave_vault(&mut builder, &stuff, z_m);
        for side in [-1.0, 1.0] {
            groin_vault(&mut builder, &stuff, side, z_m);
        }
    }
    for line in 0..=BAYS {
        let z_m = BAY_M * f32_from_i32(line) - HALF_LENGTH_M;
        rib(&mut builder, &stuff, z_m);
        for side in [-1.0, 1.0] {
            column(&mut builder, &stuff, [side * COLUMN_M, 0.0, z_m]);
            transverse_arch(&mut builder, &stuff, side, z_m);
        }
    }
    for end in [-1.0, 1.0] {
        end_wall(&mut builder, &stuff, end);
    }
    furniture::build(&mut builder, &stuff);
    builder.mesh
}

fn stuff(builder: &mut Builder, pictures: HallPictures) -> HallMaterials {
    let (stone, joint) = ([204, 194, 172], [150, 140, 120]);
    let ashlar = Masonry { number: 21, courses: 8, stones: 4, stone, joint, joint_px: 2, spread: 12, grain: 26 };
    let marble = pictures.marble;
    let light = builder.surface("light slabs", [0.85, 0.83, 0.80], Some(marble.clone()), 1.7);
    let dark = builder.surface("dark slabs", [0.20, 0.23, 0.22], Some(marble.clone()), 1.7);
    let [first, second] = pictures.cloth.map(Some);
    HallMaterials {
        stone: builder.surface("ashlar", [0.9; 3], Some(masonry(&ashlar)), 4.0),
        plaster: builder.surface("plaster", [0.9; 3], Some(ground(22, [214, 206, 190], 7, 34)), 3.0),
        moulding: builder.surface("mouldings", [0.9; 3], Some(ground(23, [196, 186, 166], 9, 30)), 1.5),
        column: builder.surface("marble", [0.88, 0.80, 0.74], Some(marble), 2.0),
        slabs: [builder.polished(light, 0.3), builder.polished(dark, 0.3)],
        tiles: builder.surface("tiles", [0.85; 3], Some(pictures.tiles), 2.4),
        wood: builder.surface("wood", [0.75; 3], Some(pictures.wood), 1.2),
        coffers: builder.surface("coffers", [0.9; 3], Some(coffers()), 4.0),
        banners: [
            builder.surface("banner 1", [0.80, 0.34, 0.28], first, 1.0),
            builder.surface("banner 2", [0.30, 0.42, 0.70], second, 1.0),
        ],
        lead: builder.surface("lead", [0.10, 0.10, 0.11], None, 1.0),
        pane: builder.glowing("panes", [0.94, 1.0, 1.12]),
    }
}

/// A checker of slabs in the nave, marble under the columns, tiles in the aisles.
fn floor(builder: &mut Builder, stuff: &HallMaterials) {
    let slab_m = 0.8;
    for row in 0..75 {
        for column in 0..16 {
            let (x, z) = (f32_from_i32(column - 8) * slab_m, f32_from_i32(row) * slab_m - HALF_LENGTH_M);
            let kind = stuff.slabs[usize::from((row + column) % 2 == 1)];
            builder.level(kind, [x, x + slab_m], [z, z + slab_m], 0.0);
        }
    }
    let ends = [-HALF_LENGTH_M, HALF_LENGTH_M];
    for side in [-1.0_f32, 1.0] {
        builder.level(stuff.slabs[0], strip(side, 6.4, 7.6), ends, 0.0);
        builder.level(stuff.tiles, strip(side, 7.6, OUTER_M), ends, 0.0);
    }
}

/// The wall on the columns: arches, clerestory, mouldings.
fn arcade(builder: &mut Builder, stuff: &HallMaterials, side: f32) {
    let wall = |x_m: f32, out: f32| Wall { origin_m: [x_m, 0.0, 0.0], along: [0.0, 0.0, 1.0], out: [out, 0.0, 0.0] };
    let nave = wall(side * (COLUMN_M - HALF_WALL_M), -side);
    let aisle = wall(side * (COLUMN_M + HALF_WALL_M), side);
    for bay in 0..BAYS {
        let z_m = BAY_M * f32_from_i32(bay) - HALF_LENGTH_M;
        let (span, middle_m) = ([z_m, z_m + BAY_M], z_m + 0.5 * BAY_M);
        let arch = Opening { middle_m, half_m: 2.45, sill_m: SPRING_M, spring_m: SPRING_M, rise_m: 2.45 };
        builder.pierced([stuff.stone, stuff.moulding], &nave, span, [SPRING_M, STRING_M], &arch, 2.0 * HALF_WALL_M);
        builder.pierced([stuff.stone, stuff.moulding], &aisle, span, [SPRING_M, STRING_M], &arch, 0.0);
        builder.archivolt(stuff.moulding, &nave, &arch, 0.36, 0.06);
        builder.archivolt(stuff.moulding, &nave, &arch, 0.14, 0.11);
        let light = Opening { middle_m, half_m: 0.9, sill_m: 7.95, spring_m: 8.75, rise_m: 0.9 };
        builder.pierced([stuff.stone, stuff.plaster], &nave, span, [STRING_M, CORNICE_M], &light, HALF_WALL_M);
        window(builder, stuff, &nave, &light, HALF_WALL_M);
    }
    let ends = [-HALF_LENGTH_M, HALF_LENGTH_M];
    builder.on_wall(stuff.moulding, &nave, ends, [STRING_M - 0.15, STRING_M], [-0.16, 0.0]);
    builder.on_wall(stuff.moulding, &nave, ends, [STRING_M - 0.22, STRING_M - 0.15], [-0.09, 0.0]);
    builder.on_wall(stuff.moulding, &nave, ends, [CORNICE_M - 0.18, CORNICE_M + 0.1], [-0.34, 0.0]);
    builder.on_wall(stuff.moulding, &nave, ends, [CORNICE_M - 0.48, CORNICE_M - 0.36], [-0.10, 0.0]);
    for tooth in 0..150 {
        let z_m = f32_from_i32(tooth) * 0.4 - HALF_LENGTH_M + 0.1;
        let heights = [CORNICE_M - 0.36, CORNICE_M - 0.18];
        builder.on_wall(stuff.moulding, &nave, [z_m, z_m + 0.2], heights, [-0.2, 0.0]);
    }
    for line in 0..=BAYS {
        let z_m = BAY_M * f32_from_i32(line) - HALF_LENGTH_M;
        builder.on_wall(stuff.plaster, &nave, [z_m - 0.35, z_m + 0.35], [STRING_M, CORNICE_M - 0.48], [-0.12, 0.0]);
    }
}

/// Glass, and the lead that holds it.
fn window(builder: &mut Builder, stuff: &HallMaterials, wall: &Wall, opening: &Opening, depth_m: f32) {
    let [low, high] = opening.span();
    let heights = [opening.sill_m, opening.top_m()];
    builder.face(stuff.pane, wall, [low, high], heights, depth_m);
    let behind = [depth_m - 0.09, depth_m - 0.05];
    let uprights = 4;
    for upright in 1..uprights {
        let s = low + (high - low) * f32_from_i32(upright) / f32_from_i32(uprights);
        builder.on_wall(stuff.lead, wall, [s - 0.02, s + 0.02], heights, behind);
    }
    let mut y = heights[0] + 0.5;
    while y < heights[1] {
        builder.on_wall(stuff.lead, wall, [low, high], [y - 0.02, y + 0.02], behind);
        y += 0.5;
    }
}

/// The outer wall of an aisle: windows, pilasters, a plinth.
fn outer_wall(builder: &mut Builder, stuff: &HallMaterials, side: f32) {
    let wall = Wall { origin_m: [side * OUTER_M, 0.0, 0.0], along: [0.0, 0.0, 1.0], out: [-side, 0.0, 0.0] };
    for bay in 0..BAYS {
        let z_m = BAY_M * f32_from_i32(bay) - HALF_LENGTH_M;
        let middle_m = z_m + 0.5 * BAY_M;
        let tall = Opening { middle_m, half_m: 1.05, sill_m: 2.0, spring_m: 4.3, rise_m: 1.05 };
        builder.pierced([stuff.stone, stuff.plaster], &wall, [z_m, z_m + BAY_M], [0.0, STRING_M], &tall, 0.5);
        builder.archivolt(stuff.moulding, &wall, &tall, 0.22, 0.05);
        builder.on_wall(stuff.moulding, &wall, [middle_m - 1.25, middle_m + 1.25], [1.86, 2.0], [-0.16, 0.1]);
        window(builder, stuff, &wall, &tall, 0.5);
    }
    builder.on_wall(stuff.moulding, &wall, [-HALF_LENGTH_M, HALF_LENGTH_M], [0.0, 0.35], [-0.07, 0.0]);
    for line in 0..=BAYS {
        let z_m = BAY_M * f32_from_i32(line) - HALF_LENGTH_M;
        for (half_m, heights, out_m) in [
            (0.45, [0.0, 0.5], 0.3),
            (0.36, [0.5, 4.0], 0.22),
            (0.42, [4.0, 4.12], 0.28),
            (0.5, [4.12, SPRING_M], 0.34),
        ] {
            builder.on_wall(stuff.moulding, &wall, [z_m - half_m, z_m + half_m], heights, [-out_m, 0.0]);
        }
    }
}

/// The coffered vault over a bay of the nave: a part of a cylinder.
fn nave_vault(builder: &mut Builder, stuff: &HallMaterials, z_m: f32) {
    builder.patch(stuff.coffers, [28, 4], &|across, along| nave_point(across, z_m + BAY_M * along, 0.0, 4.0));
}

/// A point of the nave's vault, or so far below it, at a share of its width.
fn nave_point(across: f32, z_m: f32, below_m: f32, tile_m: f32) -> Vertex {
    let half_m = COLUMN_M - HALF_WALL_M;
    let radius_m = (half_m * half_m + SAGITTA_M * SAGITTA_M) / (2.0 * SAGITTA_M);
    let half_rad = libm::asinf(half_m / radius_m);
    let angle_rad = half_rad * (2.0 * across - 1.0);
    let (sine, cosine) = libm::sincosf(angle_rad);
    let middle_m = CORNICE_M + SAGITTA_M - radius_m;
    let arm_m = radius_m - below_m;
    Vertex {
        position_m: [arm_m * sine, middle_m + arm_m * cosine, z_m],
        normal: [-sine, -cosine, 0.0],
        uv: [radius_m * angle_rad / tile_m, z_m / tile_m],
    }
}

/// A rib across the nave's vault.
fn rib(builder: &mut Builder, stuff: &HallMaterials, z_m: f32) {
    let (half_m, drop_m) = (0.35, 0.22);
    builder.patch(stuff.moulding, [28, 1], &|across, along| {
        nave_point(across, z_m + half_m * (2.0 * along - 1.0), drop_m, 1.5)
    });
    for face in [-1.0, 1.0] {
        builder.patch(stuff.moulding, [28, 1], &|across, up| {
            let point = nave_point(across, z_m + half_m * face, drop_m * (1.0 - up), 1.5);
            Vertex { normal: [0.0, 0.0, face], uv: [point.uv[0], 0.2 * up], ..point }
        });
    }
}

/// The groin vault over a bay of an aisle: two crossing barrels, in four sectors that meet in sharp groins.
fn groin_vault(builder: &mut Builder, stuff: &HallMaterials, side: f32, z_m: f32) {
    let (springing_m, rise_m) = (4.9, 2.1);
    let near_m = COLUMN_M + HALF_WALL_M;
    let middle_m = [side * 0.5 * (near_m + OUTER_M), z_m + 0.5 * BAY_M];
    let half_m = [0.5 * (OUTER_M - near_m), 0.5 * BAY_M];
    for (along, toward) in [(0, -1.0_f32), (0, 1.0), (1, -1.0), (1, 1.0)] {
        let across = 1 - along;
        builder.patch(stuff.plaster, [12, 10], &|s, t| {
            let reach_rad = std::f32::consts::FRAC_PI_2 * t;
            let (sine, cosine) = libm::sincosf(reach_rad * (2.0 * s - 1.0));
            let mut position_m = middle_m;
            position_m[along] += half_m[along] * toward * libm::sinf(reach_rad);
            position_m[across] += half_m[across] * sine;
            let mut normal = [0.0, -cosine / rise_m, 0.0];
            normal[2 * across] = -sine / half_m[across];
            let normal = unit(normal).unwrap_or([0.0, -1.0, 0.0]);
            let [x, z] = position_m;
            Vertex { position_m: [x, springing_m + rise_m * cosine, z], normal, uv: [x / 3.0, z / 3.0] }
        });
    }
}

/// An arch across an aisle, from a column to the outer wall.
fn transverse_arch(builder: &mut Builder, stuff: &HallMaterials, side: f32, z_m: f32) {
    let near_m = COLUMN_M + HALF_WALL_M;
    let middle_m = 0.5 * (near_m + OUTER_M);
    let arch = Opening { middle_m, half_m: 3.4, sill_m: SPRING_M, spring_m: SPRING_M, rise_m: 2.25 };
    for (face, depth_m) in [(-1.0, 0.7), (1.0, 0.0)] {
        let wall = Wall { origin_m: [0.0, 0.0, z_m + 0.35 * face], along: [side, 0.0, 0.0], out: [0.0, 0.0, face] };
        let span = [near_m, OUTER_M];
        builder.pierced([stuff.moulding, stuff.moulding], &wall, span, [SPRING_M, 7.0], &arch, depth_m);
    }
}

/// A column: plinth, Attic base, shaft with entasis, bell capital, abacus.
fn column(builder: &mut Builder, stuff: &HallMaterials, [x, _, z]: [f32; 3]) {
    builder.block(stuff.moulding, [x - 0.66, 0.0, z - 0.66], [x + 0.66, 0.25, z + 0.66]);
    let base = profile(
        [0.60, 0.64, 0.655, 0.64, 0.60, 0.55, 0.52, 0.54, 0.56, 0.565, 0.55, 0.50, 0.46],
        [0.25, 0.28, 0.33, 0.38, 0.41, 0.43, 0.47, 0.52, 0.54, 0.58, 0.62, 0.64, 0.70],
    );
    builder.turned(stuff.moulding, [x, 0.0, z], &base, 32);
    // Entasis: the radius falls with the square of the height, from 0.46 to 0.40 m.
    let shaft = [0, 1, 2, 3, 4, 5, 6, 7, 8].map(|step| {
        let share = f32_from_i32(step) / 8.0;
        [0.46 - 0.06 * share * share, 0.70 + 2.9 * share]
    });
    builder.turned(stuff.column, [x, 0.0, z], &shaft, 32);
    let capital = profile(
        [0.40, 0.435, 0.445, 0.435, 0.40, 0.40, 0.42, 0.47, 0.55, 0.60, 0.60],
        [3.60, 3.62, 3.65, 3.68, 3.70, 3.78, 3.90, 4.02, 4.13, 4.18, 4.22],
    );
    builder.turned(stuff.moulding, [x, 0.0, z], &capital, 32);
    builder.block(stuff.moulding, [x - 0.62, 4.22, z - 0.62], [x + 0.62, SPRING_M, z + 0.62]);
}

/// An end of the hall: a portal and a great window in the nave, a window in each aisle.
fn end_wall(builder: &mut Builder, stuff: &HallMaterials, end: f32) {
    let wall = Wall { origin_m: [0.0, 0.0, end * HALF_LENGTH_M], along: [1.0, 0.0, 0.0], out: [0.0, 0.0, -end] };
    let nave = [-COLUMN_M, COLUMN_M];
    let portal = Opening { middle_m: 0.0, half_m: 1.7, sill_m: 0.0, spring_m: 3.3, rise_m: 1.7 };
    builder.pierced([stuff.stone, stuff.moulding], &wall, nave, [0.0, 6.4], &portal, 0.6);
    builder.archivolt(stuff.moulding, &wall, &portal, 0.45, 0.08);
    builder.archivolt(stuff.moulding, &wall, &portal, 0.18, 0.16);
    furniture::door(builder, stuff, &wall, &portal, 0.6);
    let great = Opening { middle_m: 0.0, half_m: 2.5, sill_m: 7.1, spring_m: 8.4, rise_m: 2.5 };
    builder.pierced([stuff.stone, stuff.plaster], &wall, nave, [6.4, CORNICE_M + SAGITTA_M + 0.1], &great, 0.5);
    builder.archivolt(stuff.moulding, &wall, &great, 0.35, 0.07);
    window(builder, stuff, &wall, &great, 0.5);
    builder.on_wall(stuff.moulding, &wall, nave, [6.3, 6.5], [-0.2, 0.0]);
    for side in [-1.0_f32, 1.0] {
        let aisle = strip(side, COLUMN_M, OUTER_M);
        let middle_m = side * 0.5 * (COLUMN_M + HALF_WALL_M + OUTER_M);
        let tall = Opening { middle_m, half_m: 1.05, sill_m: 2.0, spring_m: 4.3, rise_m: 1.05 };
        builder.pierced([stuff.stone, stuff.plaster], &wall, aisle, [0.0, STRING_M], &tall, 0.5);
        builder.archivolt(stuff.moulding, &wall, &tall, 0.22, 0.05);
        window(builder, stuff, &wall, &tall, 0.5);
    }
}
