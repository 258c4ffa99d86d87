//! Images of lamps in mirrors. Enters: a mesh, an eye, a lamp. Leaves: where a mirror's triangle shows the lamp to the eye.
//!
//! A mirror of smooth normals shows a point where the bisector of the ways to the eye and to it is the interpolated normal: two equations
//! for two weights of the corners, solved by Newton's method (Mitchell and Hanrahan 1992, "Illumination from curved reflectors").

use glam::DVec3;

use super::lit::is_exact_mirror;
use super::mesh::{Mesh, unit_normal};
use crate::num::index;

/// Lamps times triangles of mirrors from which on none are looked for in mirrors: a glance takes some nanoseconds, so a tenth of a second a
/// render.
const PAIRS_MAX: usize = 1 << 24;
/// A plane mirror shows the whole scene once more: of so many, the greatest, images are looked for through them as well.
const PLANES_MAX: usize = 2;
/// And of none smaller than this.
const PLANE_LEAST_M2: f64 = 0.01;
/// Square of the sine of two normals, and metres, by which triangles of one plane may differ.
const PLANE_SINE2: f64 = 1e-8;
const PLANE_OFF_M: f64 = 1e-4;

/// Pieces of one lamp touch.
#[derive(Clone, Debug, PartialEq)]
pub struct Lamp {
    /// Middle of the box that holds it, metres.
    pub middle_m: DVec3,
    /// Half of each of the box's sides.
    pub half_m: [DVec3; 3],
    /// Corners of its triangles.
    pub corners_m: Vec<DVec3>,
}

/// A triangle of a mirror.
#[derive(Clone, Copy, Debug)]
pub struct Mirror {
    corners_m: [DVec3; 3],
    normals: [DVec3; 3],
    plane: DVec3,
    is_double_sided: bool,
}

/// Weights of the second and third corner of a triangle.
pub type Weights = [f64; 2];

/// A scene's lamps, and curved mirrors that may show them; or all of that as a plane mirror shows it.
#[derive(Clone, Debug, Default)]
pub struct World {
    /// Triangles that reflect without a lobe.
    pub mirrors: Vec<Mirror>,
    /// What shines, and after that what plane mirrors show of it.
    pub lamps: Vec<Lamp>,
    /// How many are not shown by (further) mirrors.
    pub own: usize,
    /// The plane mirror that shows all this.
    shown_by: Option<Plane>,
}

/// The mirrors of a scene and what may shine in them.
#[derive(Clone, Debug, Default)]
pub struct Glints {
    /// As it is seen, and as each plane mirror shows it.
    pub worlds: Vec<World>,
}

/// A plane through the points whose product with the normal is `offset_m`.
#[derive(Clone, Copy, Debug)]
struct Plane {
    normal: DVec3,
    offset_m: f64,
    is_double_sided: bool,
}

impl World {
    /// Whether an eye is on the side of the mirror that shows it.
    pub fn is_seen_from(&self, eye_m: DVec3) -> bool {
        self.shown_by.is_none_or(|plane| plane.is_double_sided || plane.normal.dot(eye_m) > plane.offset_m)
    }
}

impl Glints {
    /// Finds both; nothing in a scene without lamps.
    pub fn of(mesh: &Mesh) -> Self {
        let is_mirror: Vec<bool> =
            mesh.materials.iter().map(|material| material.gloss().is_some() && is_exact_mirror(material)).collect();
        let of_triangle = |triangle: usize| Mirror {
            corners_m: mesh.corners_m(triangle).map(wide),
            normals: mesh.triangles[triangle].map(|corner| wide(mesh.vertices[index(corner)].normal)),
            plane: wide(unit_normal(mesh.corners_m(triangle)).expect("a mesh keeps no triangle without area")),
            is_double_sided: mesh.materials[index(mesh.material_of[triangle])].double_sided,
        };
        let mut mirrors: Vec<Mirror> = (0..mesh.triangles.len())
            .filter(|&triangle| is_mirror[index(mesh.material_of[triangle])])
            .map(of_triangle)
            .collect();
        let mut lamps = lamps(mesh);
        if lamps.is_empty() {
            return Self::default();
        }
        let planes = planes(&mirrors);
        mirrors.retain(|mirror| !planes.iter().any(|plane| plane.holds(mirror)));
        let own = lamps.len();
        for plane in &planes {
            for number in 0..own {
                lamps.push(plane.lamp(&lamps[number]));
            }
        }
        if mirrors.len().saturating_mul(lamps.len()) > PAIRS_MAX {
            mirrors.clear();
        }
        let seen = World { mirrors, lamps, own, shown_by: None };
        let shown = |plane: &Plane| World {
            mirrors: seen.mirrors.iter().map(|mirror| plane.mirror(mirror)).collect(),
            lamps: seen.lamps.iter().map(|lamp| plane.lamp(lamp)).collect(),
            own,
            shown_by: Some(*plane),
        };
        let mut worlds: Vec<World> = planes.iter().map(shown).collect();
        worlds.insert(0, seen);
        Self { worlds }
    }
}

/// The greatest planes that flat triangles of mirrors lie in.
fn planes(mirrors: &[Mirror]) -> Vec<Plane> {
    let mut planes: Vec<(f64, Plane)> = Vec::new();
    for mirror in mirrors.iter().filter(|mirror| mirror.is_flat()) {
        let [a, b, c] = mirror.corners_m;
        let area_m2 = 0.5 * (b - a).cross(c - a).length();
        if let Some(number) = planes.iter().position(|(_, plane)| plane.holds(mirror)) {
            planes[number].0 += area_m2;
        } else if planes.len() < PLANES_TRIED {
            // Scenes of many small flat mirrors have no great one.
            let (normal, is_double_sided) = (mirror.plane, mirror.is_double_sided);
            planes.push((area_m2, Plane { normal, offset_m: normal.dot(a), is_double_sided }));
        }
    }
    planes.retain(|(area_m2, _)| *area_m2 > PLANE_LEAST_M2);
    planes.sort_by(|a, b| b.0.total_cmp(&a.0));
    planes.truncate(PLANES_MAX);
    planes.into_iter().map(|(_, plane)| plane).collect()
}

/// Planes that are told apart.
const PLANES_TRIED: usize = 64;

impl Plane {
    /// Whether a triangle lies in it.
    fn holds(&self, mirror: &Mirror) -> bool {
        let near = |corner_m: &DVec3| (self.normal.dot(*corner_m) - self.offset_m).abs() < PLANE_OFF_M;
        let along = |normal: &DVec3| self.normal.cross(*normal).length_squared() < PLANE_SINE2;
        mirror.corners_m.iter().all(near) && mirror.normals.iter().all(along)
    }

    fn turned(&self, direction: DVec3) -> DVec3 {
        direction - self.normal * (2.0 * self.normal.dot(direction))
    }

    fn place_m(&self, place_m: DVec3) -> DVec3 {
        place_m - self.normal * (2.0 * (self.normal.dot(place_m) - self.offset_m))
    }

    fn lamp(&self, lamp: &Lamp) -> Lamp {
        Lamp {
            middle_m: self.place_m(lamp.middle_m),
            half_m: lamp.half_m.map(|half_m| self.turned(half_m)),
            corners_m: lamp.corners_m.iter().map(|corner_m| self.place_m(*corner_m)).collect(),
        }
    }

    fn mirror(&self, mirror: &Mirror) -> Mirror {
        Mirror {
            corners_m: mirror.corners_m.map(|corner_m| self.place_m(corner_m)),
            normals: mirror.normals.map(|normal| self.turned(normal)),
            plane: self.turned(mirror.plane),
            is_double_sided: mirror.is_double_sided,
        }
    }
}

fn wide(vector: [f32; 3]) -> DVec3 {
    DVec3::from_array(vector.map(f64::from))
}

/// Boxes about the emissive triangles that hang together by corners at equal places.
fn lamps(mesh: &Mesh) -> Vec<Lamp> {
    let glowing: Vec<usize> = (0..mesh.triangles.len())
        .filter(|&triangle| mesh.materials[index(mesh.material_of[triangle])].is_emissive())
        .collect();
    // Every corner with its place's bits; equal places follow each other.
    let mut corners: Vec<([u32; 3], usize)> = Vec::with_capacity(3 * glowing.len());
    for (number, &triangle) in glowing.iter().enumerate() {
        corners.extend(mesh.corners_m(triangle).map(|place_m| (place_m.map(|x| (x + 0.0).to_bits()), number)));
    }
    corners.sort_unstable();
    let mut root: Vec<usize> = (0..glowing.len()).collect();
    for pair in corners.windows(2).filter(|pair| pair[0].0 == pair[1].0) {
        let [a, b] = [root_of(&mut root, pair[0].1), root_of(&mut root, pair[1].1)];
        root[a.max(b)] = a.min(b);
    }
    let mut pieces: Vec<Vec<DVec3>> = vec![Vec::new(); glowing.len()];
    for (place_m, number) in corners {
        let corners_m = &mut pieces[root_of(&mut root, number)];
        let corner_m = wide(place_m.map(f32::from_bits));
        // Equal places follow each other.
        if corners_m.last() != Some(&corner_m) {
            corners_m.push(corner_m);
        }
    }
    let lamp = |corners_m: Vec<DVec3>| {
        let [mut least, mut greatest] = [corners_m[0]; 2];
        for corner_m in &corners_m {
            (least, greatest) = (least.min(*corner_m), greatest.max(*corner_m));
        }
        let half_m = (greatest - least) * 0.5;
        Lamp { middle_m: (least + greatest) * 0.5, half_m: DVec3::AXES.map(|axis| axis * half_m), corners_m }
    };
    pieces.into_iter().filter(|corners_m| !corners_m.is_empty()).map(lamp).collect()
}

fn root_of(root: &mut [usize], mut of: usize) -> usize {
    while root[of] != of {
        root[of] = root[root[of]];
        of = root[of];
    }
    of
}

/// Steps of Newton's method at most: from within a triangle of a smooth mesh three or four do.
const STEPS_MAX: usize = 8;
/// Square of the sine that a reflected ray may miss its aim by.
const MISS2_MAX: f64 = 1e-20;
/// How far beyond its triangle an image may be looked for, in weights.
const BEYOND_MAX: f64 = 1.0;
/// Difference of weights for slopes.
const DIFFERENCE: f64 = 1e-6;

/// How much farther from the middle than its corners' a triangle's reflected rays may go, and what they go on by beyond its rim.
const CONE_WIDER: f64 = 1.5;
const CONE_ROOM: f64 = 0.02;

/// About where the rays from an eye go on that a triangle reflects.
#[derive(Clone, Copy, Debug)]
pub struct Cone {
    from_m: DVec3,
    axis: DVec3,
    /// Length of what unit vectors differ from the axis by.
    radius: f64,
    size_m: f64,
}

impl Cone {
    /// Whether a lamp's middle may lie in it.
    pub fn may_meet(&self, lamp: &Lamp) -> bool {
        let way_m = lamp.middle_m - self.from_m;
        let distance_m = way_m.length();
        let radius = self.radius + self.size_m / distance_m;
        // Not a number, of a lamp at the mirror, may meet.
        !((way_m / distance_m - self.axis).length_squared() > radius * radius)
    }
}

impl Mirror {
    fn is_flat(&self) -> bool {
        self.normals.iter().all(|normal| self.plane.cross(*normal).length_squared() < PLANE_SINE2)
    }

    /// Where it sends what an eye sees in it; none where the eye sees no mirror.
    pub fn cone(&self, eye_m: DVec3) -> Option<Cone> {
        let [a, b, c] = self.corners_m;
        let from_m = (a + b + c) / 3.0;
        let rays = [self.away([0.0, 0.0], eye_m)?, self.away([1.0, 0.0], eye_m)?, self.away([0.0, 1.0], eye_m)?];
        let axis = (rays[0] + rays[1] + rays[2]).try_normalize()?;
        let radius2 = rays.iter().fold(0.0, |most, ray| crate::num::greater(most, (*ray - axis).length_squared()));
        let size_m = (a - from_m).length();
        Some(Cone { from_m, axis, radius: CONE_WIDER * radius2.sqrt() + CONE_ROOM, size_m })
    }

    /// The point of its plane with some weights.
    pub fn place_m(&self, [u, v]: Weights) -> DVec3 {
        let [a, b, c] = self.corners_m;
        a + (b - a) * u + (c - a) * v
    }

    /// Direction of the ray from the eye that is reflected there; none where the eye sees no mirror.
    fn away(&self, [u, v]: Weights, eye_m: DVec3) -> Option<DVec3> {
        let direction = (self.place_m([u, v]) - eye_m).try_normalize()?;
        let is_back = self.plane.dot(direction) > 0.0;
        if is_back && !self.is_double_sided {
            return None;
        }
        let [a, b, c] = self.normals;
        let normal = (a + (b - a) * u + (c - a) * v).try_normalize()?;
        Some(direction - normal * (2.0 * normal.dot(direction)))
    }

    /// What the reflected ray misses a target by, along two axes across the way to it.
    fn miss(&self, at: Weights, eye_m: DVec3, target_m: DVec3, axes: &[DVec3; 2]) -> Option<[f64; 2]> {
        let towards = (target_m - self.place_m(at)).try_normalize()?;
        let away = self.away(at, eye_m)?;
        // Far from the target the difference of unit vectors would bring a ray back that goes the other way.
        if away.dot(towards) < 0.0 {
            return None;
        }
        let apart = away - towards;
        Some([axes[0].dot(apart), axes[1].dot(apart)])
    }

    /// Where the eye sees a target in it, near some weights; none where it does not, or beyond its rim by more than the triangle.
    pub fn image_of(&self, target_m: DVec3, eye_m: DVec3, near: Weights) -> Option<Weights> {
        let middle_m = self.place_m([1.0 / 3.0; 2]);
        let (first, second) = (target_m - middle_m).try_normalize()?.any_orthonormal_pair();
        let axes = [first, second];
        let mut at = near;
        for _ in 0..STEPS_MAX {
            let [p, q] = self.miss(at, eye_m, target_m, &axes)?;
            if p * p + q * q < MISS2_MAX {
                return Some(at);
            }
            let [along_u, along_v] = [[DIFFERENCE, 0.0], [0.0, DIFFERENCE]].map(|[u, v]| {
                let [other_p, other_q] = self.miss([at[0] + u, at[1] + v], eye_m, target_m, &axes)?;
                Some([(other_p - p) / DIFFERENCE, (other_q - q) / DIFFERENCE])
            });
            let ([pu, qu], [pv, qv]) = (along_u?, along_v?);
            let determinant = pu * qv - pv * qu;
            if determinant == 0.0 {
                return None;
            }
            at[0] -= (p * qv - q * pv) / determinant;
            at[1] -= (q * pu - p * qu) / determinant;
            // Not a number is beyond, too.
            if !(beyond(at) <= BEYOND_MAX) {
                return None;
            }
        }
        None
    }
}

/// How far weights lie beyond their triangle; below zero within.
pub fn beyond([u, v]: Weights) -> f64 {
    let least = crate::num::lesser(u, v);
    crate::num::greater(-least, u + v - 1.0)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::DrawKey;

    fn drawn(key: DrawKey, from: u64) -> DVec3 {
        DVec3::from_array([0, 1, 2].map(|axis| 2.0 * key.with(from + axis).uniform() - 1.0))
    }

    /// A triangle across the third axis with the normals of something that bulges.
    fn bulging(key: DrawKey) -> Mirror {
        let corners_m = [0, 1, 2].map(|corner| {
            let place_m = drawn(key, 10 * corner);
            DVec3::new(place_m.x, place_m.y, 0.1 * place_m.z)
        });
        let plane = (corners_m[1] - corners_m[0]).cross(corners_m[2] - corners_m[0]).normalize();
        let plane = if plane.z < 0.0 { -plane } else { plane };
        let middle_m = (corners_m[0] + corners_m[1] + corners_m[2]) / 3.0;
        let normals = corners_m.map(|corner_m| (plane + 0.4 * (corner_m - middle_m)).normalize());
        Mirror { corners_m, normals, plane, is_double_sided: true }
    }

    #[test]
    fn where_a_lamp_is_seen_the_bisector_is_the_normal() {
        let (mut tried, mut within) = (0, 0);
        for case in 0..2_000 {
            let key = DrawKey::root(77).with(case);
            let mirror = bulging(key);
            let eye_m = DVec3::new(0.0, 0.0, 3.0) + drawn(key, 40);
            let lamp_m = DVec3::new(0.0, 0.0, 4.0) + 2.0 * drawn(key, 50);
            let Some([u, v]) = mirror.image_of(lamp_m, eye_m, [1.0 / 3.0; 2]) else { continue };
            let at_m = mirror.place_m([u, v]);
            let bisector = ((eye_m - at_m).normalize() + (lamp_m - at_m).normalize()).normalize();
            let [a, b, c] = mirror.normals;
            let normal = (a * (1.0 - u - v) + b * u + c * v).normalize();
            // The reflected ray's sine misses by 1e-10, the bisector by half of that, and some more where the angle is wide.
            assert!(bisector.cross(normal).length() < 1e-9, "{case}: {bisector} for {normal}");
            assert!(beyond([u, v]) <= BEYOND_MAX);
            let lamp = Lamp { middle_m: lamp_m, half_m: [DVec3::ZERO; 3], corners_m: Vec::new() };
            if beyond([u, v]) <= 0.0 {
                within += 1;
                assert!(mirror.cone(eye_m).unwrap().may_meet(&lamp), "{case}: the cone misses {u} {v}");
            }
            tried += 1;
        }
        assert!(tried > 500 && within > 100, "{tried} {within}");
    }

    #[test]
    fn pieces_that_touch_are_one_lamp_and_a_plane_mirror_shows_it_once_more() {
        use crate::scene::light::BANDS;
        use crate::scene::mesh::Material;
        let mut mesh = Mesh::default();
        mesh.materials.push(Material { emission: [1.0; BANDS], ..Material::plain("lamp", [0.0; 3]) });
        mesh.materials.push(Material { metallic: 1.0, roughness: 0.0, ..Material::plain("mirror", [1.0; 3]) });
        let square = |x: f32, z: f32| [[x, 0.0, z], [x + 1.0, 0.0, z], [x + 1.0, 1.0, z], [x, 1.0, z]];
        for x in [0.0, 1.0, 3.0] {
            mesh.append_quad(0, square(x, 1.0), [1.0, 1.0]);
        }
        mesh.append_quad(1, square(0.0, 5.0), [1.0, 1.0]);
        let glints = Glints::of(&mesh);
        assert_eq!(glints.worlds.len(), 2);
        let seen = &glints.worlds[0];
        // Two squares share an edge, one stands apart; the mirror has no triangle but its own plane's.
        assert_eq!((seen.own, seen.lamps.len(), seen.mirrors.len()), (2, 4, 0));
        let shown = seen.lamps.iter().map(|lamp| (lamp.middle_m, lamp.corners_m.len()));
        let expected = [(1.0, 1.0, 6), (3.5, 1.0, 4), (1.0, 9.0, 6), (3.5, 9.0, 4)];
        for ((middle_m, corners), (x, z, count)) in shown.zip(expected) {
            assert!((middle_m - DVec3::new(x, 0.5, z)).length() < 1e-6, "{middle_m}");
            assert_eq!(corners, count);
        }
        // What is seen through the mirror is what there is, turned over.
        assert!((glints.worlds[1].lamps[2].middle_m - seen.lamps[0].middle_m).length() < 1e-6);
    }
}
