//! Hard cases of the tracer and the sky, against double-double arithmetic on rays and triangles of f32.

use sensel::num::{f32_nearest, f64_from_usize, index, lesser};
use sensel::scene::Environment;
use sensel::scene::bvh::Bvh;
use sensel::scene::lanes::{Floats, LANES};
use sensel::scene::tracer::{Hits, MISS, Packet, Stack, closest};

use super::double_double::{Vector, cross, dd, dot, minus, vector};
use super::table::{Case, Chance, Stage};

type Triangle = [[f32; 3]; 3];

pub fn run(stage: &mut Stage) {
    hard_triangles(stage);
    shared_edges(stage);
    flat_boxes(stage);
    poles(stage);
}

fn packet(rays: &[([f32; 3], [f32; 3])]) -> Packet {
    let zero = Floats::splat(0.0);
    let mut packet = Packet { origin_m: [zero; 3], direction: [zero; 3], t_min: zero, t_max: Floats::splat(f32::MAX) };
    for lane in 0..LANES {
        let (origin_m, direction) = rays[lane % rays.len()];
        for axis in 0..3 {
            packet.origin_m[axis].0[lane] = origin_m[axis];
            packet.direction[axis].0[lane] = direction[axis];
        }
    }
    packet
}

fn traced(bvh: &Bvh, rays: &[([f32; 3], [f32; 3])]) -> Hits {
    closest(bvh, &packet(rays), &mut Stack::new())
}

fn wide(v: [f32; 3]) -> Vector {
    vector(v.map(f64::from))
}

/// Where a ray of f32 meets a triangle of f32, exactly: distance, least distance in metres of that point to the three edges as the ray sees
/// them (negative outside), cosine to the normal, and how much longer than high the triangle is.
struct Truth {
    t: f64,
    margin_m: f64,
    cosine: f64,
    aspect: f64,
    reach_m: f64,
}

fn truth(triangle: &Triangle, (origin_m, direction): ([f32; 3], [f32; 3])) -> Truth {
    let (o, d) = (wide(origin_m), wide(direction));
    let corners = triangle.map(|corner| minus(wide(corner), o));
    let normal = cross(minus(corners[1], corners[0]), minus(corners[2], corners[0]));
    let (along, length) = (dot(normal, d), dot(d, d).sqrt());
    let area = dot(normal, normal).sqrt();
    let side = if along.high < 0.0 { -1.0 } else { 1.0 };
    let (mut margin_m, mut longest_m, mut reach_m) = (f64::INFINITY, 0.0, 0.0);
    for k in 0..3 {
        let (a, b) = (corners[k], corners[(k + 1) % 3]);
        // The signed volume over the edge's length across the ray is the distance of the ray from the edge.
        let edge = minus(b, a);
        let across = cross(edge, d);
        let across_length = dot(across, across).sqrt();
        let volume = dot(d, cross(a, b)) * dd(side);
        margin_m = lesser(margin_m, (volume / across_length).f64());
        longest_m = sensel::num::greater(longest_m, dot(edge, edge).sqrt().f64());
        reach_m = sensel::num::greater(reach_m, dot(a, a).sqrt().f64());
    }
    Truth {
        t: (dot(normal, corners[0]) / along).f64(),
        margin_m,
        cosine: (along.abs() / (area * length)).f64(),
        aspect: longest_m * longest_m / area.f64(),
        reach_m,
    }
}

/// Half an ulp of f32, relative.
const ROUND: f64 = 1.0 / 16_777_216.0;

/// Corners relative to the origin round once, shears and products of the edge functions some seven times more: the position that the ray is
/// seen at is off by 16 roundings of the reach, so a ray that far inside must hit and that far outside must miss. The distance is a mean
/// of three depths by the edge functions, each of them off by those 16 roundings of the reach over the triangle's height; depths differ by
/// the longest side over the cosine: 16 (1 + aspect) / cosine roundings of the reach.
fn check(case: &mut Case, side: usize, triangle: &Triangle, ray: ([f32; 3], [f32; 3]), hits: &Hits, lane: usize) {
    let truth = truth(triangle, ray);
    let slack_m = 16.0 * ROUND * truth.reach_m;
    let is_hit = hits.triangle[lane] != MISS;
    let at = || format!("{triangle:?}, {ray:?}: t {} of {}, margin {:e} m", hits.t.0[lane], truth.t, truth.margin_m);
    if truth.margin_m.abs() > slack_m && truth.t > 0.0 {
        case.hold(side, is_hit == (truth.margin_m > 0.0), at);
    }
    if is_hit {
        let bound = 16.0 * ROUND * truth.reach_m * (1.0 + truth.aspect) / truth.cosine;
        case.see(side, (f64::from(hits.t.0[lane]) - truth.t).abs(), bound, at);
    }
}

/// A triangle of this size and shape at a position, and rays at points of it (three of four) and beside it, from a distance, leaning.
fn hard_triangles(stage: &mut Stage) {
    let case = stage.case(
        "a ray and one hard triangle",
        "intersection in double-double",
        "m",
        &[
            "plain",
            "grazing, 1e-1 to 1e-4 rad",
            "1e4 m off the origin",
            "0.1 mm",
            "needle, 1e3 : 1",
            "zero direction components",
        ],
    );
    let mut chance = Chance::new(801);
    for number in 0..6 * 250_usize {
        let side = number % 6;
        let size = if side == 3 { 1e-4 } else { chance.between(0.3, 2.0) };
        let centre = if side == 2 { 1e4 } else { 0.0 } * chance.direction();
        let (along, turn) = (chance.direction(), chance.direction());
        let across = along.cross(turn).normalize();
        let height = if side == 4 { 1e-3 } else { chance.between(0.3, 1.0) };
        let corner = |a: f64, b: f64| (centre + size * (a * along + b * height * across)).to_array().map(f32_nearest);
        let triangle = [corner(-0.5, 0.0), corner(0.5, 0.0), corner(chance.between(-0.5, 0.5), 1.0)];
        let bvh = Bvh::build(&[triangle]);
        let normal = along.cross(across);
        let rays: Vec<_> = (0..LANES)
            .map(|lane| {
                let (a, b) = (chance.between(-0.5, 0.5), chance.between(-0.1, 1.0));
                let target = centre + size * (a * along + b * height * across);
                let lean = if side == 1 { chance.decade(1e-4, 1e-1) } else { chance.between(0.5, 1.2) };
                let (flat, up) = (lean.cos_sin().0, lean.cos_sin().1);
                let way = (along * flat + normal * up).normalize();
                let from = target - way * if side == 3 { 0.01 } else { 2.0 };
                let direction = if side == 5 {
                    let axis = lane % 3;
                    let zero = if lane % 2 == 0 { 0.0 } else { -0.0 };
                    let mut direction = [zero; 3];
                    direction[axis] = if lane % 4 < 2 { 1.0 } else { -1.0 };
                    direction
                } else {
                    way.to_array().map(f32_nearest)
                };
                let origin =
                    if side == 5 { target - 2.0 * glam::DVec3::from_array(direction.map(f64::from)) } else { from };
                (origin.to_array().map(f32_nearest), direction)
            })
            .collect();
        let hits = traced(&bvh, &rays);
        for (lane, &ray) in rays.iter().enumerate() {
            check(case, side, &triangle, ray, &hits, lane);
        }
    }
}

trait CosSin {
    fn cos_sin(self) -> (f64, f64);
}

impl CosSin for f64 {
    fn cos_sin(self) -> (f64, f64) {
        let (sine, cosine) = libm::sincos(self);
        (cosine, sine)
    }
}

/// A bumpy sheet of triangles without a gap, its rim raised to a bowl: rays from inside at its edges and corners must meet something,
/// also where they only just pass over a ridge.
fn shared_edges(stage: &mut Stage) {
    let sides = &["along edges", "at corners", "grazing"];
    let case = stage.case("rays at edges and corners that triangles share", "a closed sheet", "leaks", sides);
    let mut chance = Chance::new(802);
    for number in 0..20_u32 {
        let scale = [1.0, 1e-3, 100.0, 1.0][index(number % 4)];
        let away_m = if number % 4 == 3 { 300.0 } else { 0.0 };
        let cells = 12_usize;
        let bumps: Vec<f64> = (0..(cells + 1) * (cells + 1)).map(|_| chance.between(-0.3, 0.3)).collect();
        let corner = |x: usize, y: usize| -> [f32; 3] {
            let is_rim = x.is_multiple_of(cells) || y.is_multiple_of(cells);
            let height = if is_rim { 50.0 } else { bumps[y * (cells + 1) + x] };
            [f64_from_usize(x), f64_from_usize(y), height].map(|a| f32_nearest(away_m + scale * a))
        };
        let mut triangles = Vec::new();
        for n in 0..cells * cells {
            let (x, y) = (n % cells, n / cells);
            let [a, b, c, d] = [corner(x, y), corner(x + 1, y), corner(x + 1, y + 1), corner(x, y + 1)];
            triangles.extend([[a, b, c], [a, c, d]]);
        }
        let bvh = Bvh::build(&triangles);
        for _ in 0..60 {
            let origin = {
                let grazing = chance.below(3) == 0;
                let height = if grazing { 0.5 } else { chance.between(1.0, 30.0) };
                [chance.between(2.0, 10.0), chance.between(2.0, 10.0), height].map(|a| f32_nearest(away_m + scale * a))
            };
            let mut kinds = [0; LANES];
            let rays: Vec<_> = (0..LANES)
                .map(|lane| {
                    let pick = |chance: &mut Chance| usize::try_from(3 + chance.below(7)).unwrap();
                    let (x, y) = (pick(&mut chance), pick(&mut chance));
                    let from = corner(x, y).map(f64::from);
                    let to = [corner(x + 1, y), corner(x, y + 1), corner(x + 1, y + 1)][lane % 3].map(f64::from);
                    let share = if lane % 4 == 0 { 0.0 } else { chance.unit() };
                    let direction =
                        [0, 1, 2].map(|k| f32_nearest(from[k] + share * (to[k] - from[k]) - f64::from(origin[k])));
                    let low = f64::from(origin[2]) - away_m < 0.6 * scale;
                    kinds[lane] = if low { 2 } else { usize::from(lane % 4 == 0) };
                    (origin, direction)
                })
                .collect();
            let hits = traced(&bvh, &rays);
            for (lane, ray) in rays.iter().enumerate() {
                case.hold(kinds[lane], hits.triangle[lane] != MISS, || format!("sheet {number}, {ray:?}"));
            }
        }
    }
}

/// Triangles in one plane have boxes without thickness, all equal ones boxes without size; rays along an axis divide by zero. Each ray
/// through the inside must hit at the plane's own distance, exactly: the coordinates are small dyadic numbers. Equal hits go to the
/// lowest triangle.
fn flat_boxes(stage: &mut Stage) {
    let sides = &["flat sheet", "many equal triangles", "rays in the plane"];
    let case = stage.case("trees with boxes of no thickness", "plane of dyadic coordinates", "m", sides);
    for axis in 0..3_usize {
        let (first, second) = ((axis + 1) % 3, (axis + 2) % 3);
        let at = |x: f32, y: f32| {
            let mut corner = [0.0; 3];
            (corner[axis], corner[first], corner[second]) = (0.25, x, y);
            corner
        };
        let steps: Vec<f32> = (0..16_u8).map(f32::from).collect();
        let mut sheet = Vec::new();
        for &x in &steps {
            for &y in &steps {
                let [a, b, c, d] = [at(x, y), at(x + 1.0, y), at(x + 1.0, y + 1.0), at(x, y + 1.0)];
                sheet.extend([[a, b, c], [a, c, d]]);
            }
        }
        let equal = vec![[at(0.0, 0.0), at(16.0, 0.0), at(0.0, 16.0)]; 40];
        for (side, triangles) in [(0, &sheet), (1, &equal)] {
            let bvh = Bvh::build(triangles);
            for n in 0..64_u8 {
                let (x, y) = (f32::from(n % 8) + 0.25, f32::from(n / 8) * 0.5 + 0.375);
                let (mut origin, mut direction) = (at(x, y), [0.0_f32; 3]);
                (origin[axis], direction[axis]) = if n % 2 == 0 { (-1.75, 1.0) } else { (2.25, -1.0) };
                let hits = traced(&bvh, &[(origin, direction)]);
                let error = f64::from((hits.t.0[0] - 2.0).abs());
                case.see(side, error, 0.0, || format!("axis {axis}, ({x}, {y}): {}", hits.t.0[0]));
                if side == 1 {
                    case.hold(1, hits.triangle[0] == 0, || format!("axis {axis}: triangle {}", hits.triangle[0]));
                }
                // Along the sheet itself: nothing to meet, and no number that is none.
                let mut along = [0.0; 3];
                along[first] = 1.0;
                let mut beside = at(-3.0, y);
                beside[axis] = 0.25;
                let hits = traced(&bvh, &[(beside, along)]);
                case.hold(2, hits.triangle[0] == MISS && !hits.t.0[0].is_nan(), || {
                    format!("axis {axis}: {:?}", hits.t.0[0])
                });
            }
        }
    }
}

/// An even sky is even everywhere: four bilinear weights of f32 sum to 1 within 4 roundings, and each product rounds: 8 * 2^-24. A sky that
/// depends on the height alone has one value at each pole, whatever way it is looked at.
fn poles(stage: &mut Stage) {
    let sides = &["even sky", "pole from all ways", "across the seam"];
    let case = stage.case("environment map at its poles and its seam", "even and zonal skies", "relative", sides);
    let width = 64_u32;
    let even = Environment::from_texels("even", width, &vec![[0.7, 0.5, 0.25]; 64 * 32], 0.0).unwrap();
    let zonal: Vec<[f32; 3]> = (0..64 * 32_u16).map(|n| [0.1 + 0.01 * f32::from(n / 64); 3]).collect();
    let zonal = Environment::from_texels("zonal", width, &zonal, 30.0).unwrap();
    let mut chance = Chance::new(804);
    let unit = |chance: &mut Chance, kind: u64, up: f64| {
        let turn = chance.between(0.0, std::f64::consts::TAU);
        let slip = if kind == 0 { 0.0 } else { chance.decade(1e-30, 1e-7) };
        let (sine, cosine) = libm::sincos(turn);
        [slip * cosine, up, slip * sine].map(f32_nearest)
    };
    for kind in 0..600_u64 {
        let up = if kind % 2 == 0 { 1.0 } else { -1.0 };
        let pole = unit(&mut chance, kind % 5, up);
        let any = chance.direction().to_array().map(f32_nearest);
        for direction in [pole, any, [0.0, 0.0, 1.0], [-0.0, 0.0, 1.0], [f32::MIN_POSITIVE, 0.0, 1.0]] {
            let found = even.radiance(direction);
            for (band, exact) in [0.7, 0.5, 0.25].into_iter().enumerate() {
                let error = (f64::from(found[band]) / exact - 1.0).abs();
                // 0.7 itself is rounded to f32.
                case.see(0, error, 9.0 * ROUND, || format!("{direction:?}: {found:?}"));
            }
        }
        let expected = zonal.radiance([0.0, f32_nearest(up), 0.0])[0];
        let found = zonal.radiance(pole)[0];
        case.see(1, (f64::from(found) / f64::from(expected) - 1.0).abs(), 8.0 * ROUND, || format!("{pole:?}: {found}"));
        // Both sides of the meridian where the map begins: heights are equal, so values are.
        let (tilt, side) = libm::sincos(chance.between(-1.5, 1.5));
        let slip = chance.decade(1e-20, 1e-7);
        let turned = |slip: f64| {
            let (sine, cosine) = libm::sincos(30.0_f64.to_radians());
            // The seam lies behind, turned with the map.
            let (x, z) = (slip, side);
            [x * cosine - z * sine, tilt, x * sine + z * cosine].map(f32_nearest)
        };
        let (left, right) = (zonal.radiance(turned(-slip))[0], zonal.radiance(turned(slip))[0]);
        case.see(2, (f64::from(left) / f64::from(right) - 1.0).abs(), 8.0 * ROUND, || {
            format!("{tilt}: {left} {right}")
        });
    }
}
