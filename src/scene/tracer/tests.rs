//! The tracer against its slow twin, at edges, at ties and through holes. Distances are in metres.

use super::block::{Candidate, take};
use super::*;
use crate::draw::DrawKey;
use crate::num::{f32_nearest, f64_from_usize, u32_from, u64_from};
use crate::scene::box_room::box_room;
use crate::scene::bvh::TriangleBlock;
use crate::scene::chance::pair;

/// The slow twin: every ray by itself against every triangle, in the order of the list, without boxes and without spans.
fn closest_by_trying_all(bvh: &Bvh, holes: &dyn Holes, packet: &Packet) -> Hits {
    let slots = |block: &TriangleBlock| usize::try_from(block.present.count_ones() / 8).unwrap();
    let mut entries: Vec<_> =
        bvh.blocks.iter().flat_map(|block| (0..slots(block)).map(move |slot| (block, slot))).collect();
    entries.sort_by_key(|(block, slot)| block.triangle[*slot]);
    let triangles = entries.iter().map(|(block, slot)| block.triangle[*slot]);
    assert!(triangles.eq(0..u32_from(entries.len())), "each triangle is in one place");
    let zero = Floats::splat(0.0);
    let mut all = Hits { t: packet.t_max, triangle: [MISS; LANES], u: zero, v: zero };
    for lane in 0..LANES {
        let alone = alone(packet, lane);
        let (mask, course) = Courses::of(&alone).take().unwrap();
        let rays = Rays::of(&alone, mask, course);
        let mut hits = Hits { t: rays.t_max, ..all };
        for &(block, slot) in &entries {
            let corners = block::relative_corners(&rays, block);
            let candidate = Candidate { block, slot, corners: &corners, pad_m: bvh.pad_m };
            take::<true>(&rays, &Search::new(holes, false), &candidate, &mut hits);
        }
        copy_lane(&hits, lane, &mut all, lane);
    }
    all
}

/// A packet of one ray; the other lanes are idle, and hold what is no ray at all.
fn alone(packet: &Packet, lane: usize) -> Packet {
    let nonsense = Floats::splat(f32::NAN);
    let (origin_m, direction) = ([nonsense; 3], [nonsense; 3]);
    let mut alone = Packet { origin_m, direction, t_min: Floats::splat(0.0), t_max: Floats::splat(-1.0) };
    copy_ray(packet, lane, &mut alone, lane);
    alone
}

fn copy_ray(from: &Packet, source: usize, to: &mut Packet, lane: usize) {
    for axis in 0..3 {
        to.origin_m[axis].0[lane] = from.origin_m[axis].0[source];
        to.direction[axis].0[lane] = from.direction[axis].0[source];
    }
    to.t_min.0[lane] = from.t_min.0[source];
    to.t_max.0[lane] = from.t_max.0[source];
}

fn copy_lane(from: &Hits, source: usize, to: &mut Hits, lane: usize) {
    to.t.0[lane] = from.t.0[source];
    to.triangle[lane] = from.triangle[source];
    to.u.0[lane] = from.u.0[source];
    to.v.0[lane] = from.v.0[source];
}

fn bits(hits: &Hits) -> [[u32; LANES]; 4] {
    [hits.t.0.map(f32::to_bits), hits.triangle, hits.u.0.map(f32::to_bits), hits.v.0.map(f32::to_bits)]
}

/// Triangles of all sizes around a point, every fifth a needle a thousand times longer than wide.
fn soup(key: DrawKey, count: usize, position_m: f64) -> Vec<[[f32; 3]; 3]> {
    let one = |number: usize| {
        let size = 0.6 / f64_from_usize(1 + number % 9);
        let key = key.with(u64_from(number));
        [0, 1, 2].map(|corner| {
            [0, 1, 2].map(|axis| {
                let [at, apart] = [pair(key, axis)[0], pair(key, u64_from(3 + 3 * corner) + axis)[1]];
                let thin = if number.is_multiple_of(5) && corner == 1 { 0.001 } else { 1.0 };
                let start = pair(key, 3 + axis)[1];
                between(position_m - 1.0, position_m + 1.0, at) + between(-size, size, start + thin * (apart - start))
            })
        })
    };
    (0..count).map(one).collect()
}

/// Neighbours on one way, from one point, from points a little apart, or rays of all ways; some along an axis exactly, some from a corner.
fn hard_packet(key: DrawKey, triangles_m: &[[[f32; 3]; 3]], position_m: f32) -> Packet {
    let mut packet = random_packet(key);
    let kind = key.0 % 8;
    for lane in 0..LANES {
        for axis in 0..3 {
            let (spread, apart) = (if kind < 4 { 0.02 } else { 1.0 }, if kind.is_multiple_of(4) { 0.0 } else { 0.01 });
            let own = packet.direction[axis].0[lane];
            packet.direction[axis].0[lane] = packet.direction[axis].0[0] + spread * own;
            let origin_m = packet.origin_m[axis].0[0] + apart * packet.origin_m[axis].0[lane];
            packet.origin_m[axis].0[lane] = position_m + origin_m;
            let corner_m = triangles_m[index(u32::try_from(key.0 % 31).unwrap()) % triangles_m.len()][lane % 3];
            if kind == 5 {
                packet.origin_m[axis].0[lane] = corner_m[axis];
            }
            if kind == 6 && axis != lane % 3 {
                packet.direction[axis].0[lane] = if lane % 2 == 0 { 0.0 } else { -0.0 };
                packet.origin_m[axis].0[lane] = corner_m[axis];
            }
        }
    }
    packet
}

#[test]
fn a_ray_meets_the_same_alone_and_in_any_company_at_every_level() {
    let (mut hits, mut tried) = (0, 0);
    for (number, position_m) in [0.0_f32, 0.0, 300.0, 1e5].into_iter().enumerate() {
        let key = DrawKey::root(21).with(u64_from(number));
        let triangles_m = soup(key, [1, 60, 200, 200][number], f64::from(position_m));
        let bvh = Bvh::build(&triangles_m);
        let packets: Vec<Packet> =
            (0..200).map(|case| hard_packet(key.with(1000 + case), &triangles_m, position_m)).collect();
        let mut stack = Stack::new();
        let first: Vec<Hits> = packets.iter().map(|packet| closest(&bvh, packet, &mut stack)).collect();
        for (case, packet) in packets.iter().enumerate() {
            assert_eq!(
                bits(&first[case]),
                bits(&closest_by_trying_all(&bvh, &NoHoles, packet)),
                "{position_m} m, case {case}"
            );
            // Each lane from another packet, and from another lane of it.
            let (mut mixed, mut expected) = (*packet, first[case]);
            for lane in 0..LANES {
                let (other, source) = ((case + 7 * lane) % packets.len(), (5 * lane + 3) % LANES);
                copy_ray(&packets[other], source, &mut mixed, lane);
                copy_lane(&first[other], source, &mut expected, lane);
                let one = closest(&bvh, &alone(packet, lane), &mut stack);
                let mut same = one;
                copy_lane(&first[case], lane, &mut same, lane);
                assert_eq!(bits(&one), bits(&same), "{position_m} m, case {case}, lane {lane} alone");
                hits += usize::from(one.triangle[lane] != MISS);
                tried += 1;
            }
            assert_eq!(bits(&expected), bits(&closest(&bvh, &mixed, &mut stack)), "{position_m} m, case {case}");
        }
    }
    println!("{hits} of {tried} rays hit");
    assert!(hits > 1_500 && tried == 12_800, "{hits} of {tried}");
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
        let any = blocked_through(&scene.bvh, &NoHoles, &packet, &mut Stack::new());
        for lane in 0..LANES {
            assert_eq!((any.0[lane] != 0), fast.triangle[lane] != MISS, "case {case} lane {lane}");
            hit += usize::from(any.0[lane] != 0);
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
            let direction = super::super::vectors::unit(toward).unwrap();
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

/// Boxes within one another give a deep tree of many nodes that a ray meets at once.
#[test]
fn triangles_about_one_point_are_met_as_by_trying_all() {
    let triangles_m: Vec<[[f32; 3]; 3]> = (1..3000_u16)
        .map(|size| {
            [[-1.0, -1.0, 0.1], [1.0, -1.0, -0.1], [0.0, 1.0, 0.1]].map(|corner| corner.map(|at| at * f32::from(size)))
        })
        .collect();
    let bvh = Bvh::build(&triangles_m);
    let mut hits = 0;
    for case in 0..50 {
        let packet = hard_packet(DrawKey::root(22).with(case), &triangles_m, 0.0);
        let fast = closest(&bvh, &packet, &mut Stack::new());
        assert_eq!(bits(&fast), bits(&closest_by_trying_all(&bvh, &NoHoles, &packet)), "case {case}");
        hits += fast.triangle.iter().filter(|&&triangle| triangle != MISS).count();
    }
    assert!(hits > 50, "{hits} hits");
}

/// Holes in a pattern that only the arguments decide: stripes of corner weight, on every other triangle wholly open.
struct Stripes;

impl Holes for Stripes {
    fn is_open(&self, triangle: u32, [u, v]: [f32; 2], _: &dyn Fn() -> f32) -> bool {
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
            assert_eq!((any.0[lane] != 0), fast.triangle[lane] != MISS, "case {case} lane {lane}");
            changed += usize::from(fast.triangle[lane] != whole.triangle[lane]);
            passed += usize::from(any.0[lane] == 0);
        }
    }
    assert!(changed > 500 && passed > 100 && changed > passed, "{changed} rays pass a hole, {passed} leave the room");
}
