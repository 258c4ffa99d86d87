//! The tracer against Embree, ray by ray: same triangles, same rays. Distances must be equal to 1e-5; where they are not, the ray in 64
//! bits
//! decides, and it must decide for ours. Needs `g++` and Debian's `libembree-dev`; without them the tests fail.
#![cfg(feature = "outside")]

#[path = "../benches/embree/compare.rs"]
mod compare;
#[path = "../benches/embree/rays.rs"]
#[allow(clippy::module_inception, reason = "the bench that shares these files has this name")]
mod rays;

use std::path::Path;
use std::process::Command;

use compare::{Comparison, compare};
use rays::{Peer, bathroom, idle, primary_rays, set, triangles_m};
use sensel::draw::DrawKey;
use sensel::num::{f32_nearest, f64_from_usize, low_u32, u64_from};
use sensel::scene::box_room::box_room;
use sensel::scene::bvh::Bvh;
use sensel::scene::lanes::LANES;
use sensel::scene::tracer::{Hits, Packet, Stack, closest};
use sensel::simd::{Level, level, limit};

const SEED: u64 = 41;

/// Hits of all rays, which every level must give bit for bit.
fn ours(bvh: &Bvh, packets: &[Packet]) -> Vec<Hits> {
    let _turn = crate::common::LEVEL.lock().expect("no test has failed while it held the level");
    let best = level();
    let trace = || -> Vec<Hits> {
        let mut stack = Stack::new();
        packets.iter().map(|packet| closest(bvh, packet, &mut stack)).collect()
    };
    let hits = trace();
    for lower in [Level::Baseline, Level::Avx2] {
        limit(lower);
        for (number, (one, other)) in hits.iter().zip(trace()).enumerate() {
            assert_eq!(bits(one), bits(&other), "packet {number} at {lower:?}");
        }
    }
    limit(best);
    hits
}

fn bits(hits: &Hits) -> [[u32; LANES]; 4] {
    [hits.t.0.map(f32::to_bits), hits.triangle, hits.u.0.map(f32::to_bits), hits.v.0.map(f32::to_bits)]
}

/// Asks both sides. Embree is asked for its robust mode, because its fast one may slip between two triangles.
fn judged(name: &str, triangles_m: &[[[f32; 3]; 3]], packets: &[Packet]) -> Comparison {
    let folder = Path::new(env!("CARGO_TARGET_TMPDIR")).join(format!("rays-{name}-{}", std::process::id()));
    let peer = Peer::new(&folder, triangles_m, packets).unwrap_or_else(|reason| panic!("{reason}"));
    let command = peer.command(1, &["medium", "robust"]);
    let output = Command::new(&command[0]).args(&command[1..]).output().expect("the program was just built");
    assert!(output.status.success(), "{}", String::from_utf8_lossy(&output.stderr));
    let theirs = peer.answers().expect("it wrote its answers");
    std::fs::remove_dir_all(&folder).expect("the folder is this test's own");
    let found = compare(triangles_m, packets, &ours(&Bvh::build(triangles_m), packets), &theirs);
    println!("{name}, seed {SEED}: {found:?}");
    found
}

/// A number of -1..1.
fn symmetric(key: DrawKey, number: usize) -> f64 {
    f64::from(low_u32(key.with(u64_from(number)).0 & 0xFF_FFFF)) / 8_388_608.0 - 1.0
}

fn vector(key: DrawKey, scale: f64) -> [f64; 3] {
    [0, 1, 2].map(|axis| scale * symmetric(key, axis))
}

/// Packets of single rays and of bundles, through all of space and along the axes.
fn wild_rays(key: DrawKey, count: usize, centre_m: [f64; 3], reach_m: f64) -> Vec<Packet> {
    let one = |number: usize| {
        let mut packet = idle();
        let key = key.with(u64_from(number));
        let (origin, toward) = (vector(key.with(1), reach_m), vector(key.with(2), 1.0));
        for lane in 0..LANES {
            let own = key.with(u64_from(100 + lane));
            // Every third packet starts at one point, every third is a bundle of neighbours, every third goes all ways.
            let from = if number.is_multiple_of(3) { origin } else { vector(own.with(1), reach_m) };
            let spread = if number % 3 == 2 { 1.0 } else { 0.05 };
            let apart = vector(own.with(2), spread);
            let mut direction = [0, 1, 2].map(|axis| toward[axis] * (1.0 - spread) + apart[axis]);
            if number % 4 == 3 {
                // Along one axis, exactly, up or down; zeros of both signs.
                let axis = number / 4 % 3;
                direction = [0, 1, 2]
                    .map(|other| if other == axis { direction[axis].signum() } else { 0.0 * direction[other] });
            }
            let length = direction.iter().map(|part| part * part).sum::<f64>().sqrt();
            let origin_m = [0, 1, 2].map(|axis| f32_nearest(centre_m[axis] + from[axis]));
            set(&mut packet, lane, origin_m, direction.map(|part| f32_nearest(part / length)));
        }
        packet
    };
    (0..count).map(one).collect()
}

/// Triangles of all sizes anywhere in a cube of 2 m.
fn soup(key: DrawKey, count: usize) -> Vec<[[f32; 3]; 3]> {
    let one = |number: usize| {
        let key = key.with(u64_from(number));
        let size = 1.0 / f64_from_usize(1 + number % 60);
        let centre = vector(key.with(1), 1.0);
        [2, 3, 4].map(|corner| {
            let apart = vector(key.with(corner), size);
            [0, 1, 2].map(|axis| f32_nearest(centre[axis] + apart[axis]))
        })
    };
    (0..count).map(one).collect()
}

#[test]
fn the_furnished_room_lies_where_embree_sees_it() {
    let found = judged("bathroom", &triangles_m(&bathroom()), &primary_rays());
    assert_eq!((found.rays, found.wrong), (6 * 640 * 480, 0), "{found:?}");
    // The room is closed but for its window.
    assert!(found.hits > found.rays * 9 / 10, "{found:?}");
    // Two right answers may lie 1e-5 to either side of the exact one; nobody needs that often.
    assert!(found.ours_is_right * 100_000 < found.rays, "{found:?}");
}

#[test]
fn the_box_and_rays_of_all_ways_agree_with_embree() {
    let scene = box_room(SEED);
    let packets = wild_rays(DrawKey::root(SEED), 6_000, [0.0, 1.5, 0.0], 1.0);
    let found = judged("box", &triangles_m(&scene), &packets);
    assert_eq!((found.rays, found.hits, found.wrong), (96_000, 96_000, 0), "{found:?}");
}

#[test]
fn soups_of_triangles_agree_with_embree() {
    let mut hits = 0;
    for (number, count) in [1, 3, 40, 1_000, 30_000].into_iter().enumerate() {
        let key = DrawKey::root(SEED).with(u64_from(number));
        let packets = wild_rays(key.with(7), 3_000, [0.0; 3], 1.5);
        let found = judged(&format!("soup-{count}"), &soup(key, count), &packets);
        assert_eq!((found.rays, found.wrong), (48_000, 0), "{count} triangles: {found:?}");
        assert!(found.ours_is_right * 1_000 < found.rays, "{count} triangles: {found:?}");
        hits += found.hits;
    }
    assert!(hits > 50_000, "{hits} hits");
}
