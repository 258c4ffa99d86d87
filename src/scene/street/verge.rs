//! Objects on the pavements (trees, lanterns, bollards, bins) and in the roadway. The leaves of each tree differ.

use super::super::build::{Builder, Surface, profile};
use super::super::chance::frame;
use super::super::vectors::unit;
use super::plan::{HALF_LENGTH_M, KERB_M, PAVEMENT_M, StreetMaterials, between, draw};
use crate::draw::DrawKey;
use crate::num::{f32_from_u32, index, u64_from};

/// From the middle of the street to trees and posts.
const POST_M: f32 = KERB_M + 0.75;

pub(super) fn build(builder: &mut Builder, stuff: &StreetMaterials) {
    let key = DrawKey::root(51).with(0x7472_6565);
    for (number, side) in [(0_u32, -1.0_f32), (1, 1.0)] {
        for tree_number in 0..6 {
            let shift_m = if side < 0.0 { 0.0 } else { 7.0 };
            let z_m = f32_from_u32(tree_number) * 14.0 - HALF_LENGTH_M + 5.0 + shift_m;
            let own = key.with(u64::from(number * 16 + tree_number));
            if z_m < HALF_LENGTH_M - 1.0 {
                tree(builder, stuff, [side * POST_M, PAVEMENT_M, z_m], own);
            }
            lantern(builder, stuff, [side * (KERB_M + 0.45), PAVEMENT_M, z_m + 7.0], side);
            bin(builder, stuff, [side * (KERB_M + 0.6), PAVEMENT_M, z_m + 5.2]);
        }
        for post in 0..20 {
            let z_m = f32_from_u32(post) * 1.5 - 5.0 - if post >= 10 { -10.0 } else { 12.0 };
            bollard(builder, stuff, [side * (KERB_M + 0.35), PAVEMENT_M, z_m]);
        }
    }
    for (x_m, z_m) in [(1.4, -14.0), (-1.2, 9.0), (0.8, 27.0)] {
        let lid =
            [[0.36, 0.0], [0.36, 0.006], [0.30, 0.006], [0.30, 0.002], [0.06, 0.002], [0.06, 0.006], [0.0, 0.006]];
        builder.turned(stuff.iron, [x_m, 0.0, z_m], &lid, 24);
    }
}

/// A small street tree: trunk, boughs, twigs, sprays of leaves.
fn tree(builder: &mut Builder, stuff: &StreetMaterials, foot: [f32; 3], key: DrawKey) {
    let height_m = between(key, 0, 2.3, 2.8);
    let fork = [foot[0] + between(key, 1, -0.12, 0.12), foot[1] + height_m, foot[2] + between(key, 2, -0.12, 0.12)];
    builder.limb(stuff.bark, [foot, fork], [0.17, 0.12], 10);
    let [x, y, z] = foot;
    builder.block(stuff.iron, [x - 0.5, y - 0.01, z - 0.5], [x + 0.5, y + 0.012, z + 0.5]);
    let crown = [fork[0], fork[1] + 1.7, fork[2]];
    for bough in 0..6_u32 {
        let own = key.with(100 + u64::from(bough));
        let angle_rad = std::f32::consts::TAU * (f32_from_u32(bough) + between(own, 0, -0.3, 0.3)) / 6.0;
        let (sine, cosine) = libm::sincosf(angle_rad);
        let (reach_m, up_m) = (between(own, 1, 0.7, 1.2), between(own, 2, 1.0, 1.9));
        let tip = [fork[0] + reach_m * cosine, fork[1] + up_m, fork[2] + reach_m * sine];
        builder.limb(stuff.bark, [fork, tip], [0.075, 0.03], 6);
        for twig in 0..3_u32 {
            let to =
                [0, 1, 2].map(|axis| tip[axis] + between(own, 10 + u64::from(3 * twig) + u64_from(axis), -0.7, 0.7));
            builder.limb(stuff.bark, [tip, to], [0.025, 0.008], 4);
        }
    }
    for spray in 0..170_u32 {
        let own = key.with(1_000 + u64::from(spray));
        let Some(away) = unit([0, 1, 2].map(|axis| between(own, u64_from(axis), -1.0, 1.0))) else { continue };
        // Most sprays are near the outside of the crown, where the light is.
        let reach = between(own, 3, 0.45, 1.0);
        let radii_m = [1.45, 1.55, 1.45];
        let middle = [0, 1, 2].map(|axis| crown[axis] + away[axis] * reach * radii_m[axis]);
        let leaning = [0, 1, 2].map(|axis| away[axis] + between(own, 4 + u64_from(axis), -0.7, 0.7));
        spray_card(builder, stuff.leaves[index(draw(own, 8, 2))], middle, leaning, between(own, 9, 0.34, 0.52));
    }
}

/// A square of leaves that faces along a direction.
fn spray_card(builder: &mut Builder, surface: Surface, middle_m: [f32; 3], facing: [f32; 3], half_m: f32) {
    let Some(normal) = unit(facing) else { return };
    let [across, up] = frame(normal);
    let corner = |a: f32, b: f32| [0, 1, 2].map(|k| middle_m[k] + (across[k] * a + up[k] * b) * half_m);
    builder.picture(surface, [corner(-1.0, -1.0), corner(1.0, -1.0), corner(1.0, 1.0), corner(-1.0, 1.0)]);
}

/// A lantern on a cast-iron post with an arm over the roadway.
fn lantern(builder: &mut Builder, stuff: &StreetMaterials, foot: [f32; 3], side: f32) {
    let post = profile(
        [0.16, 0.16, 0.11, 0.10, 0.12, 0.12, 0.065, 0.05, 0.07, 0.07, 0.045, 0.04, 0.06, 0.0],
        [0.0, 0.1, 0.16, 0.7, 0.74, 0.8, 0.9, 2.6, 2.64, 2.7, 2.76, 3.7, 3.74, 3.86],
    );
    builder.turned(stuff.iron, foot, &post, 16);
    let top = [foot[0], foot[1] + 3.6, foot[2]];
    let arm = [foot[0] - side * 0.7, foot[1] + 3.75, foot[2]];
    builder.limb(stuff.iron, [top, arm], [0.025, 0.02], 8);
    let glass = [[0.0, -0.44], [0.08, -0.43], [0.15, -0.2], [0.17, -0.1]];
    builder.turned(stuff.lantern, arm, &glass, 16);
    let hood = [[0.19, -0.1], [0.19, -0.07], [0.08, 0.02], [0.03, 0.04], [0.0, 0.08]];
    builder.turned(stuff.iron, arm, &hood, 16);
}

fn bollard(builder: &mut Builder, stuff: &StreetMaterials, foot: [f32; 3]) {
    let outline = profile(
        [0.09, 0.09, 0.06, 0.055, 0.075, 0.075, 0.06, 0.06, 0.0],
        [0.0, 0.06, 0.1, 0.74, 0.77, 0.8, 0.84, 0.88, 0.95],
    );
    builder.turned(stuff.iron, foot, &outline, 12);
}

fn bin(builder: &mut Builder, stuff: &StreetMaterials, foot: [f32; 3]) {
    let outline = [[0.18, 0.0], [0.2, 0.02], [0.22, 0.78], [0.235, 0.79], [0.235, 0.84], [0.2, 0.84], [0.0, 0.7]];
    builder.turned(stuff.shutters[0], foot, &outline, 16);
}
