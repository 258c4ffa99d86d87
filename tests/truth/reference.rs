//! Slow and independent ways to the same answers: every triangle tried in f64, the lens's formula written out, random pixels.

use glam::{DVec2, DVec3};
use sensel::draw::DrawKey;
use sensel::num::{index, low_u32};
use sensel::optics::lens::{Lens, Mapping};
use sensel::scene::mesh::Mesh;
use sensel::units::Size;

/// The nearest triangle along a ray.
pub struct Hit {
    pub range_m: f64,
    pub triangle: usize,
    /// Unit normal on the side that is seen, in the world.
    pub normal: DVec3,
    /// Least barycentric weight: how far from the triangle's edge it is met, unless its neighbour lies in the same plane.
    pub margin: f64,
}

/// Möller and Trumbore's test of every triangle ("Fast, minimum storage ray-triangle intersection", 1997).
pub fn first_hit(mesh: &Mesh, origin_m: DVec3, direction: DVec3) -> Option<Hit> {
    let mut nearest: Option<Hit> = None;
    for triangle in 0..mesh.triangles.len() {
        let [a, b, c] = mesh.corners_m(triangle).map(|corner| DVec3::from_array(corner.map(f64::from)));
        let (ab, ac) = (b - a, c - a);
        let p = direction.cross(ac);
        let determinant = ab.dot(p);
        let from_a = origin_m - a;
        let u = from_a.dot(p) / determinant;
        let q = from_a.cross(ab);
        let v = direction.dot(q) / determinant;
        let range_m = ac.dot(q) / determinant;
        // Edges count as inside, so that the diagonal of a quadrangle is no gap.
        let is_hit = determinant != 0.0 && u >= -1e-12 && v >= -1e-12 && u + v <= 1.0 + 1e-12 && range_m > 0.0;
        if is_hit && nearest.as_ref().is_none_or(|nearest| range_m < nearest.range_m) {
            let normal = ab.cross(ac).normalize();
            let normal = if normal.dot(direction) > 0.0 { -normal } else { normal };
            nearest = Some(Hit { range_m, triangle, normal, margin: u.min(v).min(1.0 - u - v) });
        }
    }
    nearest
}

/// OpenCV's radial-tangential formula, written from its documentation.
pub fn distorted_px(lens: &Lens, point_in_camera: DVec3) -> Option<DVec2> {
    if point_in_camera.z <= 0.0 {
        return None;
    }
    let (x, y) = (point_in_camera.x / point_in_camera.z, point_in_camera.y / point_in_camera.z);
    // Beyond 60 degrees off the axis these tests look at nothing, and the polynomial would fold.
    if x * x + y * y > 3.0 {
        return None;
    }
    let i = lens.intrinsics;
    let Mapping::Radtan(d) = &lens.mapping else { panic!("the reference knows radtan only") };
    let r2 = x * x + y * y;
    let radial = 1.0 + d.k1 * r2 + d.k2 * r2 * r2;
    let x_distorted = x * radial + 2.0 * d.p1 * x * y + d.p2 * (r2 + 2.0 * x * x);
    let y_distorted = y * radial + d.p1 * (r2 + 2.0 * y * y) + 2.0 * d.p2 * x * y;
    Some(DVec2::new(i.fx_px * x_distorted + i.cx_px, i.fy_px * y_distorted + i.cy_px))
}

/// Pixels by chance.
pub struct RandomPixels {
    key: DrawKey,
    size: Size,
    number: u64,
}

impl RandomPixels {
    /// A failure is repeated by its seed.
    pub fn new(seed: u64, size: Size) -> Self {
        println!("pixels by seed {seed}");
        Self { key: DrawKey::root(seed), size, number: 0 }
    }
}

impl Iterator for RandomPixels {
    type Item = (usize, usize);

    fn next(&mut self) -> Option<(usize, usize)> {
        let bits = self.key.with(self.number).0;
        self.number += 1;
        Some((index(low_u32(bits >> 32) % self.size.width_px), index(low_u32(bits) % self.size.height_px)))
    }
}
