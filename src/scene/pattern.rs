//! Procedural textures: masonry, ground, roofs, leaves. They tile without a seam and have detail at every scale. Draws are keyed, so the
//! same number always gives the same picture.

use super::cut_out::CutOut;
use super::texture::{Texture, Wrap};
use crate::draw::DrawKey;
use crate::num::{index, low_u8, low_u32, u8_clipped};

/// Edge of a picture.
const EDGE: u32 = 512;

/// Stones laid in courses.
#[derive(Clone, Copy, Debug)]
pub struct Masonry {
    /// Tells it from others.
    pub number: u64,
    /// Courses in the picture.
    pub courses: u32,
    /// Stones in a course.
    pub stones: u32,
    /// sRGB of the stones.
    pub stone: [i32; 3],
    /// sRGB of the joints.
    pub joint: [i32; 3],
    /// Half the width of a joint in texels.
    pub joint_px: u32,
    /// How much stones differ, in code values.
    pub spread: i32,
    /// Grain within a stone, in code values.
    pub grain: i32,
}

/// Stones in courses, every other course shifted by half a stone.
pub fn masonry(wall: &Masonry) -> Texture {
    let key = DrawKey::root(wall.number).with(0x6D61_736F);
    let (course_px, stone_px) = (EDGE / wall.courses, EDGE / wall.stones);
    painted(|x, y| {
        let course = y / course_px;
        let shifted = (x + if course % 2 == 1 { stone_px / 2 } else { 0 }) % EDGE;
        let stone = shifted / stone_px;
        let (in_x, in_y) = (shifted % stone_px, y % course_px);
        let edge_px = in_x.min(stone_px - 1 - in_x).min(in_y).min(course_px - 1 - in_y);
        let grain = cloud(key.with(1), x, y) * wall.grain / 128;
        if edge_px < wall.joint_px {
            return wall.joint.map(|code| code + grain / 2);
        }
        let tint = draw(key.with(2), u64::from(course) << 32 | u64::from(stone), 2 * wall.spread + 1) - wall.spread;
        // Worn edges are a little darker than the middle.
        let wear = if edge_px < 2 * wall.joint_px + 2 { -14 } else { 0 };
        wall.stone.map(|code| code + tint + grain + wear)
    })
}

/// Ground or plaster: clouds and grains about one colour, with stains of the given code values.
pub fn ground(number: u64, colour: [i32; 3], grain: i32, stains: i32) -> Texture {
    let key = DrawKey::root(number).with(0x6772_6F75);
    painted(|x, y| {
        let speck = draw(key.with(3), u64::from(x) << 32 | u64::from(y), 2 * grain + 1) - grain;
        let stain = cloud(key.with(4), x, y) * stains / 128;
        colour.map(|code| code + speck + stain)
    })
}

/// A coffered ceiling: four by four coffers with frames, steps and a boss in each.
pub fn coffers() -> Texture {
    let key = DrawKey::root(7).with(0x636F_6666);
    painted(|x, y| {
        let middle = |at: u32| i32::try_from(at % 128).expect("below 128") - 64;
        let (dx, dy) = (middle(x), middle(y));
        let ring = dx.abs().max(dy.abs());
        let boss = dx * dx + dy * dy;
        let shade = match (ring, boss) {
            (55.., _) => 38,
            (51.., _) => -50,
            (41.., _) => 12,
            (38.., _) => -62,
            (_, ..120 | 196..324) => 64,
            _ => -28,
        };
        [168, 146, 112].map(|code| code + shade + cloud(key, x, y) / 8)
    })
}

/// Stripes of two colours, eight of each.
pub fn stripes(pair: [[i32; 3]; 2]) -> Texture {
    let key = DrawKey::root(8).with(0x7374_7269);
    painted(|x, y| pair[index(x / 32 % 2)].map(|code| code + cloud(key, x, y) / 16))
}

/// Rows of round-ended roof tiles, sixteen by sixteen.
pub fn roof(number: u64) -> Texture {
    let key = DrawKey::root(number).with(0x726F_6F66);
    painted(|x, y| {
        let row = y / 32;
        let shifted = (x + 16 * (row % 2)) % EDGE;
        let in_tile = |at: u32| i32::try_from(at % 32).expect("below 32");
        let (dx, dy) = (in_tile(shifted) - 16, in_tile(y));
        let tint = draw(key, u64::from(row) << 32 | u64::from(shifted / 32), 50) - 25;
        // The lower end is a half circle; outside it the tile below is in shadow.
        let below = dy > 20 && dx * dx + (dy - 20) * (dy - 20) > 140;
        let shade = if below { -70 } else { 30 - dx.abs() * 2 - (32 - dy) / 3 };
        [150, 84, 62].map(|code| code + tint + shade + cloud(key.with(1), x, y) / 8)
    })
}

/// A spray of leaves with holes between them.
pub fn leaves(number: u64) -> (Texture, CutOut) {
    let key = DrawKey::root(number).with(0x6C65_6166);
    let edge = i32::try_from(EDGE).expect("small");
    let mut codes = vec![[62_u8, 92, 36]; index(EDGE * EDGE)];
    let mut coverage = vec![0_u8; index(EDGE * EDGE)];
    for leaf in 0..240 {
        let of = |field: u64, limit: i32| draw(key.with(leaf), field, limit);
        let (cx, cy) = (24 + of(0, edge - 48), 24 + of(1, edge - 48));
        // A leaf's axis; its outline is an ellipse pinched to both ends.
        let (ax, ay) = (of(2, 61) - 30, of(3, 61) - 30);
        let length2 = (ax * ax + ay * ay).max(200);
        let tint = of(4, 60) - 30;
        for dy in -36..=36 {
            for dx in -36..=36 {
                let (along, across) = (dx * ax + dy * ay, dx * ay - dy * ax);
                let (u, v) = (along * 1000 / length2, across * 1000 / length2);
                let (x, y) = (cx + dx, cy + dy);
                let is_inside = (0..edge).contains(&x) && (0..edge).contains(&y);
                if u * u / 1000 + v.abs() * 2600 / 1000 > 1000 || !is_inside {
                    continue;
                }
                let rib = if v.abs() < 40 { 30 } else { v.abs() / 20 - 10 };
                let texel = usize::try_from(y * edge + x).expect("within the picture");
                codes[texel] = [66, 104, 38].map(|code| u8_clipped(code + tint + rib));
                coverage[texel] = 255;
            }
        }
    }
    let wrap = [Wrap::Clamp; 2];
    (Texture::from_srgb(EDGE, EDGE, &codes, wrap), CutOut::new(EDGE, EDGE, coverage, wrap, 0.5))
}

fn painted(code: impl Fn(u32, u32) -> [i32; 3]) -> Texture {
    let texels = (0..EDGE * EDGE).map(|at| code(at % EDGE, at / EDGE).map(u8_clipped)).collect::<Vec<_>>();
    Texture::from_srgb(EDGE, EDGE, &texels, [Wrap::Repeat; 2])
}

/// A draw of 0..limit.
fn draw(key: DrawKey, number: u64, limit: i32) -> i32 {
    let limit = u32::try_from(limit).expect("limits here are positive").max(1);
    i32::try_from(low_u32(key.with(number).0 >> 16) % limit).expect("limits here are small")
}

/// Noise of -128..=127 with detail from 64 down to 4 texels; it tiles.
fn cloud(key: DrawKey, x: u32, y: u32) -> i32 {
    noise(key, x, y, 64) / 2 + noise(key.with(1), x, y, 16) * 3 / 10 + noise(key.with(2), x, y, 4) / 5
}

/// Noise of -128..=127 with square cells of the given texels, linear between draws at the cells' corners; it tiles.
fn noise(key: DrawKey, x: u32, y: u32, cell: u32) -> i32 {
    let cells = EDGE / cell;
    let at = |x: u32, y: u32| {
        let corner = u64::from(x % cells) << 32 | u64::from(y % cells);
        i32::from(low_u8(low_u32(key.with(corner).0 >> 16) & 0xFF)) - 128
    };
    let (cx, cy) = (x / cell, y / cell);
    let whole = i32::try_from(cell).expect("cells are small");
    let [fx, fy] = [x % cell, y % cell].map(|part| i32::try_from(part).expect("cells are small"));
    let above = at(cx, cy) * (whole - fx) + at(cx + 1, cy) * fx;
    let below = at(cx, cy + 1) * (whole - fx) + at(cx + 1, cy + 1) * fx;
    (above * (whole - fy) + below * fy) / (whole * whole)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn leaves_are_about_half_holes_and_every_texel_agrees_with_its_hole() {
        let (picture, holes) = leaves(1);
        let uv = |at: u32| [at % 64, at / 64].map(|k| (crate::num::f32_from_u32(k) + 0.5) / 64.0);
        let open = (0..64 * 64).filter(|&at| holes.is_open(uv(at), || 1.0, || 0.0)).count();
        // 240 leaves of about 600 texels, overlapping: cover is between a fifth and four fifths.
        assert!((820..3280).contains(&open), "{open} of 4096 are holes");
        let mean = picture.mean();
        assert!(mean[1] > mean[0] && mean[1] > mean[2], "leaves are green: {mean:?}");
    }
}
