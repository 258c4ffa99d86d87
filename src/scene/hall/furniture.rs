//! Furniture of the hall: benches, an altar on steps, urns under the windows, banners, doors. The rear third of the nave stays free for
//! walking.

use super::super::build::{Builder, Opening, Wall, profile};
use super::plan::{BAY_M, BAYS, COLUMN_M, HALF_LENGTH_M, HALF_WALL_M, HallMaterials, OUTER_M, SPRING_M};
use crate::num::f32_from_i32;

pub(super) fn build(builder: &mut Builder, stuff: &HallMaterials) {
    for row in 0..15 {
        let z_m = -21.0 + 1.35 * f32_from_i32(row);
        for x_m in [-4.9, 1.1] {
            bench(builder, stuff, [x_m, x_m + 3.8], z_m);
        }
    }
    altar(builder, stuff);
    for bay in 0..BAYS {
        let z_m = BAY_M * f32_from_i32(bay) - HALF_LENGTH_M + 0.5 * BAY_M;
        for side in [-1.0, 1.0] {
            urn(builder, stuff, [side * (OUTER_M - 0.75), 0.0, z_m]);
        }
    }
    for line in 1..BAYS {
        for side in [-1.0_f32, 1.0] {
            banner(builder, stuff, side, BAY_M * f32_from_i32(line) - HALF_LENGTH_M, line % 2 == 0);
        }
    }
}

/// A bench that looks along -z: two ends, seat, back, a board below.
fn bench(builder: &mut Builder, stuff: &HallMaterials, [x0, x1]: [f32; 2], z: f32) {
    for x in [x0, 0.5 * (x0 + x1) - 0.03, x1 - 0.06] {
        builder.block(stuff.wood, [x, 0.0, z - 0.02], [x + 0.06, 0.62, z + 0.46]);
        builder.block(stuff.wood, [x - 0.01, 0.62, z + 0.38], [x + 0.07, 1.02, z + 0.5]);
    }
    builder.block(stuff.wood, [x0, 0.42, z], [x1, 0.46, z + 0.44]);
    builder.block(stuff.wood, [x0, 0.56, z + 0.42], [x1, 0.94, z + 0.46]);
    builder.block(stuff.wood, [x0, 0.94, z + 0.38], [x1, 0.99, z + 0.5]);
    builder.block(stuff.wood, [x0, 0.12, z + 0.36], [x1, 0.34, z + 0.39]);
}

/// Three steps, a table, six candlesticks.
fn altar(builder: &mut Builder, stuff: &HallMaterials) {
    for step in 0..3 {
        let (inset_m, low_m) = (0.4 * f32_from_i32(step), 0.16 * f32_from_i32(step));
        let surface = stuff.slabs[usize::from(step == 1)];
        builder.block(surface, [-5.0 + inset_m, low_m, -29.2], [5.0 - inset_m, low_m + 0.16, -23.6 - inset_m]);
    }
    builder.block(stuff.column, [-1.6, 0.48, -27.4], [1.6, 1.42, -26.5]);
    builder.block(stuff.moulding, [-1.75, 1.42, -27.5], [1.75, 1.54, -26.4]);
    let stick = profile(
        [0.11, 0.10, 0.03, 0.025, 0.04, 0.025, 0.02, 0.05, 0.0],
        [0.0, 0.03, 0.06, 0.2, 0.24, 0.28, 0.5, 0.54, 0.56],
    );
    for number in 0..6 {
        let x_m = -1.5 + 0.6 * f32_from_i32(number);
        builder.turned(stuff.lead, [x_m, 1.54, -27.1], &stick, 16);
    }
}

/// A marble urn on a pedestal.
fn urn(builder: &mut Builder, stuff: &HallMaterials, [x, _, z]: [f32; 3]) {
    for (half_m, low_m, high_m) in [(0.36, 0.0, 0.12), (0.29, 0.12, 0.78), (0.34, 0.78, 0.88)] {
        builder.block(stuff.moulding, [x - half_m, low_m, z - half_m], [x + half_m, high_m, z + half_m]);
    }
    let outline = profile(
        [0.17, 0.17, 0.10, 0.06, 0.07, 0.16, 0.23, 0.27, 0.27, 0.22, 0.17, 0.17, 0.24, 0.26, 0.22, 0.0],
        [0.0, 0.04, 0.07, 0.13, 0.17, 0.22, 0.30, 0.40, 0.50, 0.58, 0.63, 0.67, 0.72, 0.74, 0.75, 0.70],
    );
    builder.turned(stuff.column, [x, 0.88, z], &outline, 24);
}

/// A banner on the wall over a column, on a rod.
fn banner(builder: &mut Builder, stuff: &HallMaterials, side: f32, z: f32, is_first: bool) {
    let out = -side;
    let x_m = side * (COLUMN_M - HALF_WALL_M);
    let wall = Wall { origin_m: [x_m, 0.0, 0.0], along: [0.0, 0.0, 1.0], out: [out, 0.0, 0.0] };
    builder.on_wall(stuff.wood, &wall, [z - 0.5, z + 0.5], [7.0, 7.05], [-0.22, -0.17]);
    let (low_m, high_m) = (SPRING_M + 0.55, 7.0);
    // Seen from the nave its left is at greater z on the right-hand side, at lesser z on the left-hand side.
    let [left, right] = if side > 0.0 { [z - 0.42, z + 0.42] } else { [z + 0.42, z - 0.42] };
    let corners_m = [[left, low_m], [right, low_m], [right, high_m], [left, high_m]].map(|[s, y]| wall.at(s, y, -0.19));
    builder.picture(stuff.banners[usize::from(is_first)], corners_m);
}

/// A double door behind an opening: boards, rails, a gap between the leaves.
pub(super) fn door(builder: &mut Builder, stuff: &HallMaterials, wall: &Wall, opening: &Opening, depth_m: f32) {
    let [low, high] = opening.span();
    builder.face(stuff.wood, wall, [low, high], [0.0, opening.top_m()], depth_m);
    let middle_m = opening.middle_m;
    for [from, to] in [[low, middle_m - 0.01], [middle_m + 0.01, high]] {
        for rail in 0..5 {
            let y = f32_from_i32(rail) * 1.0 + 0.05;
            builder.on_wall(stuff.wood, wall, [from, to], [y, y + 0.16], [depth_m - 0.05, depth_m]);
        }
        for stile in [from, to - 0.16, 0.5 * (from + to) - 0.08] {
            builder.on_wall(stuff.wood, wall, [stile, stile + 0.16], [0.0, opening.top_m()], [depth_m - 0.06, depth_m]);
        }
    }
}
