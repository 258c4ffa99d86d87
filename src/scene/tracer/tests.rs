//! The tracer against its slow twin, at edges, at ties and through holes. Enters: rooms and random rays (distances in metres).

use super::*;
use crate::draw::DrawKey;
use crate::num::{f32_nearest, f64_from_usize, u64_from};
use crate::scene::box_room::box_room;
use crate::scene::chance::pair;

/// The slow twin: every ray against every triangle, in the order of the list.
fn closest_by_trying_all<H: Holes>(bvh: &Bvh, holes: &H, packet: &Packet) -> Hits {
    let mut leaves = bvh.leaves.clone();
    leaves.sort_by_key(|leaf| leaf.triangle);
    let nothing = Floats::splat(0.0);
    let mut hits = Hits { t: packet.t_max, triangle: [MISS; LANES], u: nothing, v: nothing };
    for leaf in &leaves {
        take::<H, false>(packet, holes, leaf, &mut hits);
    }
    hits
}

fn between(low: f64, high: f64, uniform: f64) -> f32 {
    f32_nearest(low + (high - low) * uniform)
}

fn random_packet(key: DrawKey) -> Packet {
    let zero = Floats::splat(0.0);
    let mut packet = Packet { origin_m: [zero; 3], direction: [zero; 3], t_min: zero, t_max: Floats::splat(f32::MAX) };
    for lane in 0..LANES {
        for axis in 0..3 {
            let [a, b] = pair(key, u64_from(lane * 3 + axis));
            packet.origin_m[axis].0[lane] = between(-1.0, 1.0, a) + if axis == 1 { 1.5 } else { 0.0 };
            packet.direction[axis].0[lane] = between(-1.0, 1.0, b);
        }
    }
    packet
}

#[test]
fn the_tree_finds_what_trying_all_triangles_finds_bit_for_bit() {
    let scene = box_room(3);
    let mut hit = 0;
    for case in 0..250 {
        let mut packet = random_packet(DrawKey::root(11).with(case));
        if case % 3 == 0 {
            // Directions along an axis, and through it exactly: the hard case of slabs.
            packet.direction[usize::try_from(case % 9 / 3).unwrap()] = Floats::splat(0.0);
        }
        let fast = closest(&scene.bvh, &packet, &mut Stack::new());
        assert_eq!(fast, closest_by_trying_all(&scene.bvh, &NoHoles, &packet), "case {case}");
        let any = blocked(&scene.bvh, &packet, &mut Stack::new());
        for lane in 0..LANES {
            assert_eq!(any[lane], fast.triangle[lane] != MISS, "case {case} lane {lane}");
            hit += usize::from(any[lane]);
        }
    }
    assert!(hit > 3_000, "{hit} hits");
}

#[test]
fn no_ray_leaves_a_closed_room_not_even_at_edges_and_corners() {
    let scene = box_room(3);
    let corners: Vec<[f32; 3]> = scene.mesh.vertices.iter().map(|vertex| vertex.position_m).collect();
    let mut tried = 0;
    for case in 0..2_000_u64 {
        let mut packet = random_packet(DrawKey::root(12).with(case));
        for lane in 0..LANES {
            // At a point of an edge of some face, or (weight 0) exactly at a vertex of the room.
            let number = (index(u32::try_from(case).unwrap()) * LANES + lane) % 24;
            let next = number / 4 * 4 + (number + 1) % 4;
            let weight = if case % 5 == 0 { 0.0 } else { f64_from_usize(lane) / f64_from_usize(LANES - 1) };
            let toward: [f32; 3] = std::array::from_fn(|axis| {
                let at = between(f64::from(corners[number][axis]), f64::from(corners[next][axis]), weight);
                at - packet.origin_m[axis].0[lane]
            });
            let direction = crate::scene::mesh::unit(toward).unwrap();
            for axis in 0..3 {
                packet.direction[axis].0[lane] = direction[axis];
            }
        }
        let hits = closest(&scene.bvh, &packet, &mut Stack::new());
        assert!(!hits.triangle.contains(&MISS), "case {case}: {hits:?}");
        tried += LANES;
    }
    assert_eq!(tried, 32_000);
}

#[test]
fn of_equal_hits_the_lowest_triangle_wins() {
    let wall = [[-1.0, -1.0, 2.0], [1.0, -1.0, 2.0], [0.0, 1.0, 2.0]];
    let bvh = Bvh::build(&[[[5.0, 5.0, 5.0], [6.0, 5.0, 5.0], [5.0, 6.0, 5.0]], wall, wall, wall]);
    let zero = Floats::splat(0.0);
    let direction = [zero, zero, Floats::splat(1.0)];
    let packet = Packet { origin_m: [zero; 3], direction, t_min: zero, t_max: Floats::splat(2.0) };
    assert_eq!(closest(&bvh, &packet, &mut Stack::new()).triangle, [1; LANES]);
}

#[test]
fn a_tree_of_one_triangle_is_walked_to_its_end() {
    let bvh = Bvh::build(&[[[-1.0, -1.0, 2.0], [1.0, -1.0, 2.0], [0.0, 1.0, 2.0]]]);
    let zero = Floats::splat(0.0);
    let mut packet = Packet {
        origin_m: [zero; 3],
        direction: [zero, zero, Floats::splat(1.0)],
        t_min: zero,
        t_max: Floats::splat(f32::MAX),
    };
    packet.direction[2].0[3] = -1.0;
    let hits = closest(&bvh, &packet, &mut Stack::new());
    for lane in 0..LANES {
        assert_eq!(hits.triangle[lane], if lane == 3 { MISS } else { 0 }, "lane {lane}");
    }
}

/// Holes in a pattern that only the arguments decide: stripes of corner weight, on every other triangle wholly open.
struct Stripes;

impl Holes for Stripes {
    fn is_open(&self, triangle: u32, u: f32, v: f32) -> bool {
        assert!(triangle.is_multiple_of(2), "whole triangles are never asked about");
        triangle.is_multiple_of(4) || (8.0 * (u + 0.5 * v)).rem_euclid(2.0) < 1.0
    }
}

#[test]
fn rays_pass_holes_and_meet_what_lies_behind() {
    let scene = box_room(3);
    let triangles = 0..scene.mesh.triangles.len();
    let corners_m: Vec<_> = triangles.map(|triangle| scene.mesh.corners_m(triangle)).collect();
    let bvh = Bvh::build_with_cut_outs(&corners_m, &|triangle| triangle.is_multiple_of(2));
    let (mut changed, mut passed) = (0, 0);
    for case in 0..250 {
        let packet = random_packet(DrawKey::root(13).with(case));
        let fast = closest_through(&bvh, &Stripes, &packet, &mut Stack::new());
        assert_eq!(fast, closest_by_trying_all(&bvh, &Stripes, &packet), "case {case}");
        let any = blocked_through(&bvh, &Stripes, &packet, &mut Stack::new());
        let whole = closest(&bvh, &packet, &mut Stack::new());
        assert_eq!(whole, closest(&scene.bvh, &packet, &mut Stack::new()), "flags alone change nothing, case {case}");
        for lane in 0..LANES {
            assert_eq!(any[lane], fast.triangle[lane] != MISS, "case {case} lane {lane}");
            changed += usize::from(fast.triangle[lane] != whole.triangle[lane]);
            passed += usize::from(!any[lane]);
        }
    }
    assert!(changed > 500 && passed > 100 && changed > passed, "{changed} rays pass a hole, {passed} leave the room");
}
