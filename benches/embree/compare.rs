//! Compares two tracers' answers to the same rays: how many agree, and which do not.

use glam::DVec3;
use sensel::scene::lanes::LANES;
use sensel::scene::tracer::{Hits, MISS, Packet};

use super::rays::Answers;

/// Distances are equal when they differ by less than this share.
pub const EQUAL: f64 = 1e-5;

/// Or by less than this: a coordinate of some metres has 32 bits to say where it is, which are 5e-7 m apart. It counts below 0.1 m.
const EQUAL_M: f64 = 1e-6;

fn equal(t: f64, other_t: f64) -> bool {
    near(t, other_t, EQUAL_M)
}

fn near(t: f64, other_t: f64, apart_m: f64) -> bool {
    (t - other_t).abs() <= (EQUAL * other_t).max(apart_m)
}

/// What became of the rays.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Comparison {
    pub rays: usize,
    pub hits: usize,
    /// Equal distances on different triangles.
    pub ties: usize,
    /// Distances that are not equal, but ours is that of the exact ray (64 bits) on its triangle, and theirs is not nearer.
    pub ours_is_right: usize,
    /// All others.
    pub wrong: usize,
}

/// Compares all rays. Says the first wrong ones on the error output.
pub fn compare(triangles_m: &[[[f32; 3]; 3]], packets: &[Packet], hits: &[Hits], theirs: &Answers) -> Comparison {
    let mut found = Comparison::default();
    for (number, (packet, hit)) in packets.iter().zip(hits).enumerate() {
        for lane in 0..LANES {
            let (ours, other) = (hit.triangle[lane], theirs.triangle[number * LANES + lane]);
            let (t, other_t) = (f64::from(hit.t.0[lane]), f64::from(theirs.t[number * LANES + lane]));
            found.rays += 1;
            found.hits += usize::from(ours != MISS);
            if (ours == MISS && other == MISS) || (ours != MISS && other != MISS && equal(t, other_t)) {
                found.ties += usize::from(ours != other);
            } else if ours != MISS
                && is_right(triangles_m[usize::try_from(ours).expect("an index")], packet, lane, t)
                && (ours == other || other == MISS || t < other_t)
            {
                found.ours_is_right += 1;
            } else {
                if found.wrong < 5 {
                    eprintln!("packet {number} lane {lane}: ours {ours} at {t}, theirs {other} at {other_t}");
                }
                found.wrong += 1;
            }
        }
    }
    found
}

/// Whether the exact ray meets the triangle's plane at this distance, at a point of the triangle or at most so far beside it.
fn is_right(corners_m: [[f32; 3]; 3], packet: &Packet, lane: usize, t: f64) -> bool {
    let corners_m = corners_m.map(|corner| DVec3::from_array(corner.map(f64::from)));
    let of =
        |row: &[sensel::scene::lanes::Floats; 3]| DVec3::from_array([0, 1, 2].map(|axis| f64::from(row[axis].0[lane])));
    let (origin_m, direction) = (of(&packet.origin_m), of(&packet.direction));
    let normal = (corners_m[1] - corners_m[0]).cross(corners_m[2] - corners_m[0]);
    let exact = normal.dot(corners_m[0] - origin_m) / normal.dot(direction);
    let at_m = origin_m + direction * exact;
    let beside =
        |from: DVec3, to: DVec3| (to - from).cross(at_m - from).dot(normal) / ((to - from).length() * normal.length());
    let inside =
        (0..3).all(|corner| beside(corners_m[corner], corners_m[(corner + 1) % 3]) > -(EQUAL * exact).max(EQUAL_M));
    // A plane seen at a grazing angle, and moved by a coordinate's rounding, is met that much earlier or later.
    let grazing = normal.dot(direction).abs() / (normal.length() * direction.length());
    near(t, exact, EQUAL_M / grazing) && inside
}
