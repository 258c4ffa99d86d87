//! House fronts: doors, shops, windows in reveals, sills, hoods, shutters, balconies, cornices and roofs; no two alike.

use super::super::build::{Builder, Opening, Surface, Wall};
use super::super::mesh::Vertex;
use super::super::vectors::unit;
use super::plan::{StreetMaterials, between, draw, fits};
use crate::draw::DrawKey;
use crate::num::{f32_from_u32, index, u64_from};

const GROUND_M: f32 = 3.7;
const FLOOR_M: f32 = 3.1;
/// Depth of windows behind the front.
const REVEAL_M: f32 = 0.22;
/// Depth of a house up to its ridge.
const RIDGE_M: f32 = 4.5;

struct House {
    wall: Wall,
    span: [f32; 2],
    storeys: u32,
    bays: u32,
    front: Surface,
    has_shop: bool,
    /// Rise of the windows' heads.
    rise_m: f32,
    shutters: Option<Surface>,
    has_hoods: bool,
    /// Storey with balconies, or one that it does not have.
    balcony: u32,
    key: DrawKey,
}

/// Fills a stretch of a wall with houses.
pub(super) fn row(builder: &mut Builder, stuff: &StreetMaterials, wall: &Wall, [from, to]: [f32; 2], number: u64) {
    let row_key = DrawKey::root(number).with(0x686F_7573);
    let count = fits(to - from, 8.2);
    let even_m = (to - from) / f32_from_u32(count);
    let edge = |house: u32| {
        let shift = if house == 0 || house == count { 0.0 } else { between(row_key, u64::from(house), -0.9, 0.9) };
        from + even_m * f32_from_u32(house) + shift
    };
    for house_number in 0..count {
        let key = row_key.with(u64::from(house_number)).with(1);
        let span = [edge(house_number), edge(house_number + 1)];
        let of = |field: u64, limit: u32| draw(key, field, limit);
        let fronts = u32::try_from(stuff.fronts.len()).expect("a few fronts");
        let house = House {
            wall: *wall,
            span,
            storeys: 2 + of(0, 3),
            bays: fits(span[1] - span[0], 2.8),
            // Neighbours differ: the colours of a row are gone through in steps.
            front: stuff.fronts[index((house_number * 3 + of(1, 2)) % fronts)],
            has_shop: of(2, 2) == 0,
            rise_m: [0.0, 0.0, 0.16, 0.5][index(of(3, 4))],
            shutters: (of(4, 5) < 2).then(|| stuff.shutters[index(of(5, 3))]),
            has_hoods: of(6, 2) == 0,
            balcony: 1 + of(7, 5),
            key,
        };
        build(builder, stuff, &house);
    }
}

fn build(builder: &mut Builder, stuff: &StreetMaterials, house: &House) {
    let bay_m = (house.span[1] - house.span[0]) / f32_from_u32(house.bays);
    let door = draw(house.key, 8, house.bays);
    for bay in 0..house.bays {
        let from = house.span[0] + bay_m * f32_from_u32(bay);
        let span = [from, from + bay_m];
        if bay == door {
            entrance(builder, stuff, house, span);
        } else if house.has_shop {
            shop(builder, stuff, house, span);
        } else {
            window(builder, stuff, house, span, 0);
        }
        for storey in 1..=house.storeys {
            window(builder, stuff, house, span, storey);
        }
    }
    let wall = &house.wall;
    for edge in [[house.span[0], house.span[0] + 0.3], [house.span[1] - 0.3, house.span[1]]] {
        builder.on_wall(stuff.plinth, wall, edge, [-0.12, GROUND_M], [-0.07, 0.0]);
    }
    for storey in 1..=house.storeys {
        let y = GROUND_M + FLOOR_M * f32_from_u32(storey - 1);
        builder.on_wall(stuff.trim, wall, house.span, [y - 0.1, y + 0.08], [-0.09, 0.0]);
    }
    quoins(builder, stuff, house);
    top(builder, stuff, house);
}

fn eaves_m(house: &House) -> f32 {
    GROUND_M + FLOOR_M * f32_from_u32(house.storeys)
}

/// Blocks at both edges of the upper floors, long and short in turn.
fn quoins(builder: &mut Builder, stuff: &StreetMaterials, house: &House) {
    if draw(house.key, 9, 3) > 0 {
        return;
    }
    let (mut y, mut is_long) = (GROUND_M + 0.1, true);
    while y < eaves_m(house) - 0.5 {
        let length_m = if is_long { 0.5 } else { 0.32 };
        for [a, b] in [[house.span[0], house.span[0] + length_m], [house.span[1] - length_m, house.span[1]]] {
            builder.on_wall(stuff.trim, &house.wall, [a, b], [y, y + 0.36], [-0.05, 0.0]);
        }
        (y, is_long) = (y + 0.39, !is_long);
    }
}

/// A window of a storey (0: the ground floor) with all that belongs to it.
fn window(builder: &mut Builder, stuff: &StreetMaterials, house: &House, span: [f32; 2], storey: u32) {
    let (low_m, height_m) = match storey {
        0 => (0.0, GROUND_M),
        _ => (GROUND_M + FLOOR_M * f32_from_u32(storey - 1), FLOOR_M),
    };
    let has_balcony = storey == house.balcony && draw(house.key, 10, 2) == 0;
    let sill_m = low_m
        + match storey {
            _ if has_balcony => 0.2,
            0 => 1.2,
            _ => 0.9,
        };
    let spring_m = low_m + height_m - 0.5 - house.rise_m;
    let middle_m = 0.5 * (span[0] + span[1]);
    let opening = Opening { middle_m, half_m: 0.54, sill_m, spring_m, rise_m: house.rise_m };
    let wall = &house.wall;
    let heights = [if storey == 0 { -0.12 } else { low_m }, low_m + height_m];
    builder.pierced([house.front, stuff.trim], wall, span, heights, &opening, REVEAL_M);
    glazing(builder, stuff, wall, &opening, REVEAL_M);
    let [low, high] = opening.span();
    builder.on_wall(stuff.trim, wall, [low - 0.12, high + 0.12], [sill_m - 0.09, sill_m], [-0.13, 0.05]);
    if house.rise_m > 0.0 {
        builder.archivolt(stuff.trim, wall, &opening, 0.14, 0.05);
    } else {
        builder.on_wall(stuff.trim, wall, [low - 0.12, high + 0.12], [spring_m, spring_m + 0.16], [-0.05, 0.0]);
    }
    if house.has_hoods && storey > 0 {
        let y = opening.top_m() + 0.2;
        builder.on_wall(stuff.trim, wall, [low - 0.2, high + 0.2], [y, y + 0.09], [-0.2, 0.0]);
    }
    for side in [low - 0.12, high] {
        builder.on_wall(stuff.trim, wall, [side, side + 0.12], [sill_m, spring_m], [-0.05, 0.0]);
    }
    if let Some(shutters) = house.shutters.filter(|_| storey > 0) {
        shutter_pair(builder, shutters, wall, &opening);
    }
    if has_balcony {
        balcony(builder, stuff, wall, middle_m, low_m);
    }
}

/// Glass behind a frame with a cross.
fn glazing(builder: &mut Builder, stuff: &StreetMaterials, wall: &Wall, opening: &Opening, depth_m: f32) {
    let [low, high] = opening.span();
    let (sill, top) = (opening.sill_m, opening.top_m());
    builder.face(stuff.glass, wall, [low, high], [sill, top], depth_m);
    let behind = [depth_m - 0.06, depth_m - 0.01];
    let transom = sill + 0.68 * (top - sill);
    for (along, up) in [
        ([low, low + 0.06], [sill, top]),
        ([high - 0.06, high], [sill, top]),
        ([opening.middle_m - 0.04, opening.middle_m + 0.04], [sill, top]),
        ([low, high], [top - 0.06, top]),
        ([low, high], [transom - 0.04, transom + 0.04]),
    ] {
        builder.on_wall(stuff.frame, wall, along, up, behind);
    }
}

/// Open shutters with panels.
fn shutter_pair(builder: &mut Builder, surface: Surface, wall: &Wall, opening: &Opening) {
    let width_m = 0.5;
    for from in [opening.middle_m - opening.half_m - 0.12 - width_m, opening.middle_m + opening.half_m + 0.12] {
        let heights = [opening.sill_m, opening.spring_m];
        builder.on_wall(surface, wall, [from, from + width_m], heights, [-0.03, 0.0]);
        let mut y = heights[0] + 0.06;
        while y < heights[1] - 0.3 {
            builder.on_wall(surface, wall, [from + 0.05, from + width_m - 0.05], [y, y + 0.3], [-0.055, -0.03]);
            y += 0.42;
        }
    }
}

/// A slab with a railing.
fn balcony(builder: &mut Builder, stuff: &StreetMaterials, wall: &Wall, middle_m: f32, low_m: f32) {
    let (half_m, out_m) = (0.95, 0.8);
    let [low, high] = [middle_m - half_m, middle_m + half_m];
    builder.on_wall(stuff.trim, wall, [low, high], [low_m + 0.02, low_m + 0.16], [-out_m, 0.0]);
    for bracket in [low + 0.1, high - 0.22] {
        builder.on_wall(stuff.trim, wall, [bracket, bracket + 0.12], [low_m - 0.2, low_m + 0.02], [-0.5, 0.0]);
    }
    let rail = [low_m + 1.08, low_m + 1.12];
    builder.on_wall(stuff.iron, wall, [low, high], rail, [-out_m, -out_m + 0.04]);
    for side in [low, high - 0.04] {
        builder.on_wall(stuff.iron, wall, [side, side + 0.04], rail, [-out_m, 0.0]);
    }
    let mut s = low;
    while s < high {
        builder.on_wall(stuff.iron, wall, [s, s + 0.016], [low_m + 0.16, rail[0]], [-out_m + 0.01, -out_m + 0.026]);
        s += 0.17;
    }
    let mut depth_m = 0.1;
    while depth_m < out_m {
        for side in [low + 0.01, high - 0.026] {
            let behind = [-depth_m, -depth_m + 0.016];
            builder.on_wall(stuff.iron, wall, [side, side + 0.016], [low_m + 0.16, rail[0]], behind);
        }
        depth_m += 0.17;
    }
}

/// A house door: step, panels, a light over it.
fn entrance(builder: &mut Builder, stuff: &StreetMaterials, house: &House, span: [f32; 2]) {
    let middle_m = 0.5 * (span[0] + span[1]);
    let opening = Opening { middle_m, half_m: 0.62, sill_m: 0.0, spring_m: 2.45, rise_m: 0.62 };
    let depth_m = 0.32;
    builder.pierced([house.front, stuff.trim], &house.wall, span, [-0.12, GROUND_M], &opening, depth_m);
    builder.archivolt(stuff.trim, &house.wall, &opening, 0.2, 0.07);
    let wall = &house.wall;
    let [low, high] = opening.span();
    let leaf = stuff.doors[index(draw(house.key, 11, 2))];
    builder.face(leaf, wall, [low, high], [0.0, 2.3], depth_m);
    builder.face(stuff.glass, wall, [low, high], [2.3, opening.top_m()], depth_m);
    builder.on_wall(stuff.frame, wall, [low, high], [2.28, 2.38], [depth_m - 0.05, depth_m]);
    for [a, b] in [[low + 0.1, middle_m - 0.06], [middle_m + 0.06, high - 0.1]] {
        for [y0, y1] in [[0.2, 0.8], [0.95, 1.4], [1.55, 2.15]] {
            builder.on_wall(leaf, wall, [a, b], [y0, y1], [depth_m - 0.035, depth_m]);
        }
    }
    let handle = [middle_m + 0.03, middle_m + 0.06];
    builder.on_wall(stuff.iron, wall, handle, [1.0, 1.14], [depth_m - 0.09, depth_m - 0.03]);
    builder.on_wall(stuff.kerb, wall, [low - 0.2, high + 0.2], [-0.12, 0.02], [-0.36, depth_m]);
    for side in [low - 0.2, high] {
        builder.on_wall(stuff.trim, wall, [side, side + 0.2], [0.02, 2.45], [-0.07, 0.0]);
    }
}

/// A shop window under an awning.
fn shop(builder: &mut Builder, stuff: &StreetMaterials, house: &House, span: [f32; 2]) {
    let middle_m = 0.5 * (span[0] + span[1]);
    let half_m = 0.5 * (span[1] - span[0]) - 0.2;
    let opening = Opening { middle_m, half_m, sill_m: 0.55, spring_m: 2.75, rise_m: 0.0 };
    builder.pierced([house.front, stuff.trim], &house.wall, span, [-0.12, GROUND_M], &opening, 0.3);
    glazing(builder, stuff, &house.wall, &opening, 0.3);
    let wall = &house.wall;
    let [low, high] = [middle_m - half_m, middle_m + half_m];
    let leaf = stuff.doors[index(draw(house.key, 11, 2))];
    builder.on_wall(leaf, wall, [low - 0.1, high + 0.1], [2.95, 3.4], [-0.08, 0.0]);
    builder.on_wall(stuff.trim, wall, [low - 0.1, high + 0.1], [3.4, 3.47], [-0.14, 0.0]);
    builder.on_wall(leaf, wall, [low, high], [0.0, 0.5], [-0.05, 0.0]);
    let cloth = stuff.awnings[index(draw(house.key, 12, 2))];
    let out_m = between(house.key, 13, 0.9, 1.4);
    let upper = [wall.at(low, 2.92, -0.09), wall.at(high, 2.92, -0.09)];
    let edge = [wall.at(low, 2.4, -out_m), wall.at(high, 2.4, -out_m)];
    let hem = [wall.at(low, 2.2, -out_m), wall.at(high, 2.2, -out_m)];
    builder.picture(cloth, [edge[0], edge[1], upper[1], upper[0]]);
    builder.picture(cloth, [hem[0], hem[1], edge[1], edge[0]]);
    for arm in [low + 0.02, high - 0.02] {
        builder.limb(stuff.iron, [wall.at(arm, 2.3, 0.0), wall.at(arm, 2.38, -out_m)], [0.012; 2], 6);
    }
}

/// Cornice, gutter, roof, chimneys, and the walls that show over a lower neighbour.
fn top(builder: &mut Builder, stuff: &StreetMaterials, house: &House) {
    let (wall, eaves) = (&house.wall, eaves_m(house));
    builder.on_wall(stuff.trim, wall, house.span, [eaves - 0.34, eaves - 0.22], [-0.1, 0.0]);
    builder.on_wall(stuff.trim, wall, house.span, [eaves - 0.1, eaves + 0.1], [-0.42, 0.0]);
    let mut s = house.span[0] + 0.2;
    while s < house.span[1] - 0.15 {
        builder.on_wall(stuff.trim, wall, [s, s + 0.14], [eaves - 0.22, eaves - 0.1], [-0.34, 0.0]);
        s += 0.5;
    }
    let rise_m = between(house.key, 14, 2.2, 3.6);
    let roof = stuff.roofs[index(draw(house.key, 15, 2))];
    let slope_m = ((RIDGE_M + 0.4) * (RIDGE_M + 0.4) + rise_m * rise_m).sqrt();
    let lean = wall.out.map(|part| part * rise_m);
    let normal = unit([lean[0], RIDGE_M + 0.4, lean[2]]).expect("a roof has a slope");
    let [from, to] = house.span;
    builder.patch(roof, [4, 4], &|along, up| {
        let s = from + (to - from) * along;
        Vertex {
            position_m: wall.at(s, eaves + 0.1 + rise_m * up, -0.4 + (RIDGE_M + 0.4) * up),
            normal,
            uv: [s / roof.tile_m, -slope_m * up / roof.tile_m],
        }
    });
    for edge in [from, to] {
        builder.on_wall(house.front, wall, [edge - 0.01, edge + 0.01], [0.0, eaves], [0.05, RIDGE_M]);
    }
    for chimney in 0..draw(house.key, 16, 3) {
        let s = between(house.key, u64_from(20 + index(chimney)), from + 0.6, to - 1.2);
        let base = eaves + 0.1 + 0.7 * rise_m;
        builder.on_wall(stuff.fronts[stuff.fronts.len() - 1], wall, [s, s + 0.6], [base - 0.6, base + 1.5], [2.9, 3.4]);
        builder.on_wall(stuff.trim, wall, [s - 0.05, s + 0.65], [base + 1.5, base + 1.6], [2.85, 3.45]);
    }
}
