//! Emissive surfaces. Distributes the points that shadow rays are aimed at over emissive triangles.
//!
//! All samples of a bake aim at the same points. So neighbours differ only by visibility, not by random draws: light without
//! shadows is smooth, and a penumbra has as many steps as its lamp has points.

pub mod fixture;

use super::bulb::{Bulb, BulbPoint};
use super::bvh::Bvh;
use super::chance::{cosine_direction, frame, pair, turned};
use super::lanes::{Floats, LANES};
use super::light::{BANDS, Bands};
use super::mesh::{Material, Mesh};
use super::tracer::{MISS, Packet, Stack, closest};
use super::vectors::{area_m2, unit_normal};
use crate::draw::DrawKey;
use crate::num::{f32_nearest, f64_from_usize, index, u64_from};

/// Scenes in which more than this share of all area glows are lit by rays that happen to meet it, not by aimed ones.
const AIMED_AREA_SHARE_MAX: f64 = 0.1;

#[derive(Clone, Copy, Debug)]
struct Piece {
    corners_m: [[f32; 3]; 3],
    normal: [f32; 3],
    radiance: Bands,
    area_m2: f64,
    weight: f64,
    material: u32,
    /// Number of the lamp that it belongs to.
    lamp: u32,
}

/// A point on a lamp, seen from its front.
#[derive(Clone, Copy, Debug)]
pub struct LampPoint {
    /// Metres.
    pub position_m: [f32; 3],
    /// Unit length, the side that shines.
    pub normal: [f32; 3],
    /// In the scene's own units.
    pub radiance: Bands,
    /// Area that it represents.
    pub area_m2: f64,
    /// What shines there.
    pub material: u32,
    /// Number of the lamp: of pieces of one material that share corners.
    pub lamp: u32,
}

/// All lamps of a scene that shadow rays are aimed at: the shining pieces of each emissive material, lamp by lamp.
#[derive(Clone, Debug, Default)]
pub struct Lamps {
    groups: Vec<Vec<Piece>>,
    bulbs: Vec<Shining>,
    /// Whether a ray is aimed at the lamps of a material.
    aimed: Vec<bool>,
}

/// A bulb with its intensity: radiance times the mean over all directions of the area that is seen of a convex body, a quarter of its
/// surface (Cauchy).
#[derive(Clone, Copy, Debug)]
struct Shining {
    bulb: Bulb,
    intensity: [f64; BANDS],
    material: u32,
}

impl Lamps {
    /// Finds the emissive triangles. Empty where there are none, or where so much glows that aiming is pointless.
    pub fn of(mesh: &Mesh, bvh: &Bvh) -> Self {
        let (mut total_m2, mut glowing_m2) = (0.0, 0.0);
        let mut groups = vec![Vec::new(); mesh.materials.len()];
        let mut bulb_areas_m2 = vec![0.0; mesh.materials.len()];
        for triangle in 0..mesh.triangles.len() {
            let corners_m = mesh.corners_m(triangle);
            let area = f64::from(area_m2(corners_m));
            total_m2 += area;
            let number = index(mesh.material_of[triangle]);
            let material = &mesh.materials[number];
            if !mesh.is_emissive(triangle) {
                continue;
            }
            if material.bulb.is_some() {
                bulb_areas_m2[number] += area;
                continue;
            }
            glowing_m2 += area;
            let normal = unit_normal(corners_m).expect("a mesh keeps no triangle without area");
            let (radiance, material_number) = (mesh.emission_of(triangle), mesh.material_of[triangle]);
            let weight = area * super::light::luminance(radiance.map(f64::from));
            let front =
                Piece { corners_m, normal, radiance, area_m2: area, weight, material: material_number, lamp: 0 };
            let back = Piece { normal: normal.map(|x| -x), ..front };
            let sides = if material.double_sided { vec![front, back] } else { vec![front] };
            groups[number].extend(sides.into_iter().filter(|side| shines_out(side, mesh, bvh)));
        }
        groups.retain(|group| !group.is_empty());
        if glowing_m2 > AIMED_AREA_SHARE_MAX * total_m2 {
            groups.clear();
        }
        let mut lamps = 0;
        for group in &mut groups {
            lamps = number_lamps(group, lamps);
        }
        let shining = |(number, material): (u32, &Material)| {
            let (bulb, area_m2) = (material.bulb?, bulb_areas_m2[index(number)]);
            let intensity = material.emission.map(|band| f64::from(band) * 0.25 * area_m2);
            (area_m2 > 0.0).then_some(Shining { bulb, intensity, material: number })
        };
        let bulbs: Vec<Shining> = (0_u32..).zip(&mesh.materials).filter_map(shining).collect();
        let is_aimed = |material: &Material| material.is_emissive() && (material.bulb.is_some() || !groups.is_empty());
        let aimed = mesh.materials.iter().map(is_aimed).collect();
        Self { groups, bulbs, aimed }
    }

    /// Whether rays are aimed at the lamps of a material, so that random rays that hit them do not count.
    #[inline]
    pub fn are_aimed_at(&self, material: u32) -> bool {
        self.aimed[index(material)]
    }

    /// At least one point in each group, about `count` in all, the same for each group, stratified by power.
    pub fn points(&self, count: usize) -> Vec<LampPoint> {
        let mut points = Vec::with_capacity(count);
        let each = self.points_each(count);
        for (number, group) in self.groups.iter().enumerate() {
            spread(group, each, DrawKey::root(2).with(u64_from(number)), &mut points);
        }
        points
    }

    /// Points in all bulbs, as many in each as in a group.
    pub fn bulb_points(&self, count: usize) -> Vec<BulbPoint> {
        let (mut points, each) = (Vec::new(), self.points_each(count));
        for shining in &self.bulbs {
            shining.bulb.points(each, shining.intensity, shining.material, &mut points);
        }
        points
    }

    /// Groups of lamps and bulbs, which have as many points each.
    pub fn groups(&self) -> usize {
        self.groups.len() + self.bulbs.len()
    }

    /// Greatest luminous intensity of each lamp and of each bulb, in the scene's units: a lamp's is that of all its pieces side by side.
    pub fn intensities(&self) -> (Vec<f64>, Vec<f64>) {
        let pieces = || self.groups.iter().flatten();
        let mut lamps = vec![0.0; pieces().map(|piece| index(piece.lamp) + 1).max().unwrap_or(0)];
        pieces().for_each(|piece| lamps[index(piece.lamp)] += piece.weight);
        let bulbs = self.bulbs.iter().map(|shining| super::light::luminance(shining.intensity)).collect();
        (lamps, bulbs)
    }

    fn points_each(&self, count: usize) -> usize {
        (count / self.groups().max(1)).max(1)
    }
}

/// Numbers the lamps of a group from a number on, and puts the pieces of each together: those that share corners, directly or by others.
/// Returns the number after the last.
fn number_lamps(pieces: &mut [Piece], first: u32) -> u32 {
    let mut first_at = std::collections::BTreeMap::new();
    // An earlier piece of each piece's lamp, itself for the first.
    let mut before: Vec<usize> = (0..pieces.len()).collect();
    let root = |before: &[usize], mut piece: usize| {
        while before[piece] != piece {
            piece = before[piece];
        }
        piece
    };
    for (number, piece) in pieces.iter().enumerate() {
        for corner_m in piece.corners_m {
            let other = *first_at.entry(corner_m.map(f32::to_bits)).or_insert(number);
            let [a, b] = [root(&before, number), root(&before, other)];
            before[a.max(b)] = a.min(b);
        }
    }
    let mut next = first;
    for number in 0..pieces.len() {
        let root = root(&before, number);
        if root == number {
            pieces[number].lamp = next;
            next += 1;
        } else {
            pieces[number].lamp = pieces[root].lamp;
        }
    }
    pieces.sort_by_key(|piece| piece.lamp);
    next
}

/// The inside of a closed bulb sends nothing out: rays that leave it all end on the same lamp.
fn shines_out(piece: &Piece, mesh: &Mesh, bvh: &Bvh) -> bool {
    let middle_m: [f32; 3] =
        [0, 1, 2].map(|axis| (piece.corners_m[0][axis] + piece.corners_m[1][axis] + piece.corners_m[2][axis]) / 3.0);
    let mut packet = Packet {
        origin_m: super::lanes::splat3(middle_m),
        direction: [Floats::splat(0.0); 3],
        // A ray leaves the plane of its piece at zero; a hundredth of the piece's size is beyond rounding.
        t_min: Floats::splat(f32_nearest(0.01 * piece.area_m2.sqrt())),
        t_max: Floats::splat(f32::MAX),
    };
    for lane in 0..LANES {
        let local = cosine_direction(pair(DrawKey::root(3), u64_from(lane)));
        let direction = turned(local, &frame(piece.normal), piece.normal);
        for axis in 0..3 {
            packet.direction[axis].0[lane] = direction[axis];
        }
    }
    let ends = closest(bvh, &packet, &mut Stack::new()).triangle;
    ends.into_iter().any(|end| end == MISS || !mesh.is_emissive(index(end)))
}

/// Names the draws of points within strata.
const STRATA: u64 = 0x7374_7261;

/// Points of one group: the piece by strata of power, the point in a piece by its own strata where it holds several.
fn spread(group: &[Piece], count: usize, key: DrawKey, points: &mut Vec<LampPoint>) {
    let total: f64 = group.iter().map(|piece| piece.weight).sum();
    let (mut number, mut before) = (0, 0.0);
    for point in 0..count {
        // Somewhere in its stratum: middles would fall into step with the order in which a regular lamp lists its triangles.
        let [within, _] = pair(key.with(STRATA), u64_from(point));
        let share = (f64_from_usize(point) + within) / f64_from_usize(count) * total;
        while number + 1 < group.len() && before + group[number].weight <= share {
            before += group[number].weight;
            number += 1;
        }
        let piece = &group[number];
        // A triangle that holds many points takes them along a low-discrepancy sequence, with a different shift for each triangle.
        let [a, b] = pair(key, u64_from(number));
        let [u, v] = [a + f64_from_usize(point) * 0.754_877_666_2, b + f64_from_usize(point) * 0.569_840_291];
        let [mut u, mut v] = [u - u.floor(), v - v.floor()].map(f32_nearest);
        // Uniform on a triangle: fold the unit square along its diagonal.
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let [a, b, c] = piece.corners_m;
        let position_m = [0, 1, 2].map(|axis| a[axis] * (1.0 - u - v) + b[axis] * u + c[axis] * v);
        let area_m2 = piece.area_m2 * total / (piece.weight * f64_from_usize(count));
        let Piece { normal, radiance, material, lamp, .. } = *piece;
        points.push(LampPoint { position_m, normal, radiance, area_m2, material, lamp });
    }
}
