//! A street in a town: two rows of houses, 84 m long, 12.4 m from front to front. The mesh has y up, the roadway at 0 and its long axis
//! along z. Houses close both ends, so that no horizon is needed; above is the sky.
//!
//! Sizes are those of a central European inner town: ground floors of 3.7 m, upper floors of 3.1 m, roadway 7.2 m, pavements 2.6 m,
//! kerbs 0.12 m.

mod house;
mod plan;
mod verge;

use super::build::{Builder, Wall, strip};
use super::mesh::Mesh;
use super::pattern::{Masonry, ground, leaves, masonry, roof, stripes};
use super::texture::Texture;
use crate::num::f32_from_u32;
use plan::{END_M, FRONT_M, HALF_LENGTH_M, KERB_M, PAVEMENT_M, SIDE_M, StreetMaterials};

/// Makes the street.
pub fn street(wood: Texture) -> Mesh {
    let mut builder = Builder::default();
    let stuff = stuff(&mut builder, wood);
    surroundings(&mut builder, &stuff);
    verge::build(&mut builder, &stuff);
    builder.mesh
}

fn stuff(builder: &mut Builder, wood: Texture) -> StreetMaterials {
    let plaster = builder.surface("plaster", [0.85, 0.80, 0.66], Some(ground(31, [222, 218, 208], 9, 46)), 4.0);
    let (stone, joint) = ([158, 92, 72], [176, 168, 154]);
    let brick = Masonry { number: 32, courses: 32, stones: 8, stone, joint, joint_px: 1, spread: 26, grain: 30 };
    let (stone, joint) = ([158, 154, 146], [92, 88, 82]);
    let slabs = Masonry { number: 33, courses: 8, stones: 8, stone, joint, joint_px: 1, spread: 14, grain: 40 };
    let mut fronts = vec![plaster];
    for colour in [[0.80, 0.55, 0.40], [0.62, 0.70, 0.66], [0.86, 0.83, 0.78], [0.78, 0.62, 0.36], [0.60, 0.42, 0.40]] {
        fronts.push(builder.tinted(plaster, colour));
    }
    fronts.push(builder.surface("brick", [0.85; 3], Some(masonry(&brick)), 2.1));
    let wood = builder.surface("wood", [0.55; 3], Some(wood), 0.9);
    let awnings = [[[188, 44, 40], [232, 224, 208]], [[40, 84, 70], [228, 222, 206]]]
        .map(|pair| builder.surface("awning", [0.9; 3], Some(stripes(pair)), 1.0))
        .map(|cloth| builder.two_sided(cloth));
    let glass = builder.surface("glass", [0.035, 0.042, 0.05], None, 1.0);
    let iron = builder.surface("iron", [0.05, 0.055, 0.06], None, 1.0);
    StreetMaterials {
        trim: builder.surface("trim", [0.80, 0.77, 0.70], Some(ground(34, [226, 220, 208], 10, 30)), 2.0),
        plinth: builder.surface("plinth", [0.55, 0.53, 0.50], Some(ground(35, [205, 202, 196], 26, 50)), 2.0),
        glass: builder.polished(glass, 0.05),
        frame: builder.surface("frames", [0.82, 0.81, 0.78], None, 1.0),
        doors: [builder.tinted(wood, [0.50, 0.42, 0.36]), builder.tinted(wood, [0.20, 0.32, 0.28])],
        shutters: [[0.16, 0.30, 0.24], [0.34, 0.14, 0.12], [0.30, 0.36, 0.44]]
            .map(|colour| builder.tinted(wood, colour)),
        roofs: [36, 37].map(|number| builder.surface("roof", [0.9, 0.86, 0.82], Some(roof(number)), 3.2)),
        asphalt: builder.surface("asphalt", [0.30, 0.30, 0.31], Some(ground(38, [178, 178, 178], 40, 36)), 2.4),
        paint: builder.surface("paint", [0.72, 0.72, 0.70], Some(ground(39, [228, 228, 226], 18, 40)), 2.0),
        flags: builder.surface("flags", [0.62, 0.60, 0.57], Some(masonry(&slabs)), 3.2),
        kerb: builder.surface("kerb", [0.58, 0.57, 0.55], Some(ground(40, [205, 204, 200], 30, 30)), 1.0),
        bark: builder.surface("bark", [0.24, 0.19, 0.15], Some(ground(41, [190, 180, 170], 40, 60)), 0.8),
        lantern: builder.surface("lantern", [0.85, 0.84, 0.78], None, 1.0),
        leaves: [1, 2].map(|number| {
            let (picture, holes) = leaves(number);
            builder.cut_out("leaves", picture, holes)
        }),
        fronts,
        awnings,
        iron,
    }
}

/// Ground and houses.
fn surroundings(builder: &mut Builder, stuff: &StreetMaterials) {
    builder.level(stuff.asphalt, [-KERB_M, KERB_M], [-END_M, END_M], 0.0);
    for side in [-1.0_f32, 1.0] {
        for end in [-1.0_f32, 1.0] {
            let across = strip(end, HALF_LENGTH_M, END_M);
            builder.level(stuff.asphalt, strip(side, KERB_M, SIDE_M), across, 0.0);
        }
        pavement(builder, stuff, strip(side, KERB_M, FRONT_M));
        let (x, lengths) = (side * FRONT_M, [-HALF_LENGTH_M, HALF_LENGTH_M]);
        let main = Wall { origin_m: [x, PAVEMENT_M, 0.0], along: [0.0, 0.0, 1.0], out: [-side, 0.0, 0.0] };
        house::row(builder, stuff, &main, lengths, if side < 0.0 { 1 } else { 2 });
        for end in [-1.0_f32, 1.0] {
            let corner =
                Wall { origin_m: [0.0, 0.0, end * HALF_LENGTH_M], along: [1.0, 0.0, 0.0], out: [0.0, 0.0, end] };
            house::row(builder, stuff, &corner, strip(side, FRONT_M, SIDE_M), if side < 0.0 { 3 } else { 4 });
            let closing = Wall { origin_m: [side * SIDE_M, 0.0, 0.0], along: [0.0, 0.0, 1.0], out: [-side, 0.0, 0.0] };
            house::row(builder, stuff, &closing, strip(end, HALF_LENGTH_M, END_M), 5);
        }
    }
    for end in [-1.0, 1.0] {
        let wall = Wall { origin_m: [0.0, 0.0, end * END_M], along: [1.0, 0.0, 0.0], out: [0.0, 0.0, -end] };
        house::row(builder, stuff, &wall, [-SIDE_M, SIDE_M], if end < 0.0 { 6 } else { 7 });
    }
    markings(builder, stuff);
}

/// A pavement with its kerb stones.
fn pavement(builder: &mut Builder, stuff: &StreetMaterials, [x0, x1]: [f32; 2]) {
    let kerb_m = 0.16;
    let (kerb, flags) =
        if x0 < 0.0 { ([x1 - kerb_m, x1], [x0, x1 - kerb_m]) } else { ([x0, x0 + kerb_m], [x0 + kerb_m, x1]) };
    builder.level(stuff.flags, flags, [-HALF_LENGTH_M, HALF_LENGTH_M], PAVEMENT_M);
    for stone in 0..84 {
        let z = f32_from_u32(stone) - HALF_LENGTH_M;
        builder.block(stuff.kerb, [kerb[0], -0.05, z + 0.006], [kerb[1], PAVEMENT_M, z + 0.994]);
    }
    for z in [-HALF_LENGTH_M, HALF_LENGTH_M] {
        builder.block(stuff.kerb, [x0, -0.05, z - 0.08], [x1, PAVEMENT_M - 0.002, z + 0.08]);
    }
}

/// A dashed line along the middle and a crossing.
fn markings(builder: &mut Builder, stuff: &StreetMaterials) {
    // Paint lies 4 mm above the asphalt: bodily, so that no two surfaces share a plane.
    for dash in 0..14 {
        let z = f32_from_u32(dash) * 6.0 - 41.0;
        if !(-3.5..3.5).contains(&(z + 1.5)) {
            builder.level(stuff.paint, [-0.07, 0.07], [z, z + 3.0], 0.004);
        }
    }
    for bar in 0..7 {
        let x = f32_from_u32(bar) - 3.25;
        builder.level(stuff.paint, [x, x + 0.5], [-1.6, 1.6], 0.004);
    }
}
