//! Plane mirrors: coplanar triangles of smooth metal.

use std::collections::BTreeMap;

use super::mesh::{Material, Mesh, is_exact_mirror};
use super::samples::Layout;
use super::vectors::{area_m2, dot};
use crate::num::{i64_half_even, index};

/// Mirrors at most, the largest ones.
const MIRRORS_MAX: usize = 8;

/// Smaller ones light too little.
const AREA_MIN_M2: f64 = 0.02;

/// Triangles are coplanar if their normals and distances from the origin agree to the nearest of these steps, to unit length and to the
/// metre. Mirrors that rounding takes apart only take longer.
const STEPS: f64 = 1e3;

/// Plane mirrors of a scene.
#[derive(Clone, Debug, Default)]
pub struct PlaneMirrors {
    /// All of them, the largest first.
    pub all: Vec<PlaneMirror>,
    /// Triangles that are part of one, in rising order, and its number.
    of_triangles: Vec<(u32, usize)>,
}

/// A plane that reflects within a box.
#[derive(Clone, Copy, Debug)]
pub struct PlaneMirror {
    /// Unit normal.
    pub normal: [f32; 3],
    /// Distance from the origin along the normal.
    offset_m: f32,
    is_two_sided: bool,
    /// Least and greatest coordinates of its corners.
    bounds_m: [[f32; 3]; 2],
}

impl PlaneMirrors {
    /// Of a mesh.
    pub fn of(mesh: &Mesh, layout: &Layout) -> Self {
        let is_smooth: Vec<bool> = mesh.materials.iter().map(is_smooth_metal).collect();
        let mut planes = BTreeMap::<_, (f64, Vec<u32>)>::new();
        for (triangle, shade) in (0_u32..).zip(&layout.triangles).filter(|(_, shade)| is_smooth[index(shade.material)])
        {
            let corners_m = mesh.corners_m(index(triangle));
            let [x, y, z] = shade.normal;
            let plane = [x, y, z, dot(shade.normal, corners_m[0])].map(|part| i64_half_even(STEPS * f64::from(part)));
            let (area, triangles) =
                planes.entry((plane, mesh.materials[index(shade.material)].double_sided)).or_default();
            *area += f64::from(area_m2(corners_m));
            triangles.push(triangle);
        }
        let mut planes: Vec<(f64, Vec<u32>)> = planes.into_values().filter(|(area, _)| *area >= AREA_MIN_M2).collect();
        planes.sort_by(|(a, _), (b, _)| b.total_cmp(a));
        planes.truncate(MIRRORS_MAX);
        let all = planes.iter().map(|(_, triangles)| PlaneMirror::of(mesh, layout, triangles)).collect();
        let numbered = |(number, (_, triangles)): (usize, (f64, Vec<u32>))| {
            triangles.into_iter().map(move |triangle| (triangle, number))
        };
        let mut of_triangles: Vec<_> = planes.into_iter().enumerate().flat_map(numbered).collect();
        of_triangles.sort_unstable();
        Self { all, of_triangles }
    }

    /// Number of the mirror that a triangle is part of.
    pub fn of_triangle(&self, triangle: u32) -> Option<usize> {
        let found = self.of_triangles.binary_search_by_key(&triangle, |&(of, _)| of);
        found.ok().map(|entry| self.of_triangles[entry].1)
    }
}

fn is_smooth_metal(material: &Material) -> bool {
    is_exact_mirror([material.roughness, material.metallic]) && material.maps.roughness_metallic.is_none()
}

impl PlaneMirror {
    fn of(mesh: &Mesh, layout: &Layout, triangles: &[u32]) -> Self {
        let shade = &layout.triangles[index(triangles[0])];
        let corners = || triangles.iter().flat_map(|&triangle| mesh.corners_m(index(triangle)));
        let [x, y, z] = [0, 1, 2].map(|axis| {
            let along = corners().map(|corner| corner[axis]);
            along.fold([f32::MAX, f32::MIN], |[low, high], along| [low.min(along), high.max(along)])
        });
        Self {
            normal: shade.normal,
            offset_m: dot(shade.normal, mesh.corners_m(index(triangles[0]))[0]),
            is_two_sided: mesh.materials[index(shade.material)].double_sided,
            bounds_m: [0, 1].map(|end| [x[end], y[end], z[end]]),
        }
    }

    /// The mirror with its normal on the side of a point; none where it shows the point its black back.
    pub fn facing(self, at_m: [f32; 3]) -> Option<Self> {
        let height_m = self.height_m(at_m);
        let turned = || Self { normal: self.normal.map(|along| -along), offset_m: -self.offset_m, ..self };
        if height_m > 0.0 { Some(self) } else { (height_m < 0.0 && self.is_two_sided).then(turned) }
    }

    /// Distance of a point from the plane, below 0 behind it.
    pub fn height_m(&self, at_m: [f32; 3]) -> f32 {
        dot(self.normal, at_m) - self.offset_m
    }

    /// Whether a point of the plane may be on the mirror.
    pub fn is_around(&self, at_m: [f32; 3]) -> bool {
        let [low, high] = self.bounds_m;
        (0..3).all(|axis| at_m[axis] > low[axis] - SLACK_M && at_m[axis] < high[axis] + SLACK_M)
    }
}

/// More than the rounding of a point of the plane.
const SLACK_M: f32 = 1e-3;

#[cfg(test)]
mod tests {
    use super::super::geometry::Scene;
    use super::super::light::BANDS;
    use super::super::target::cube;
    use super::*;

    fn metal(name: &str, roughness: f32) -> Material {
        Material { metallic: 1.0, roughness, double_sided: false, ..Material::plain(name, [0.9; 3]) }
    }

    #[test]
    fn coplanar_smooth_metal_is_one_mirror_and_nothing_else_is() {
        let materials = vec![metal("smooth", 0.0), metal("rough", 0.3), Material::plain("wall", [0.5; 3])];
        let mut mesh = Mesh { materials, ..Mesh::default() };
        let on_wall = |z_m: f32, high_m: f32| {
            [[0.0, 1.0, z_m], [0.0, 1.0, z_m - 1.0], [0.0, high_m, z_m - 1.0], [0.0, high_m, z_m]]
        };
        mesh.append_quad(0, on_wall(3.0, 2.0), [1.0; 2]);
        mesh.append_quad(0, on_wall(-1.0, 2.5), [1.0; 2]);
        mesh.append_quad(0, on_wall(1.0, 1.01), [1.0; 2]);
        for material in [1, 2] {
            cube([2.0; 3], [3.0; 3], false).into_iter().for_each(|face| mesh.append_quad(material, face, [1.0; 2]));
        }
        let scene = Scene::new("m", mesh, [0.0; BANDS]).unwrap();
        let [mirror] = scene.mirrors.all[..] else { panic!("{:?}", scene.mirrors.all) };
        assert!((mirror.height_m([1.5, 0.3, 0.2]) - 1.5).abs() < 1e-6 && mirror.normal == [1.0, 0.0, 0.0]);
        assert!(mirror.facing([1.5, 0.3, 0.2]).is_some() && mirror.facing([-1.5, 0.3, 0.2]).is_none());
        let two_sided = PlaneMirror { is_two_sided: true, ..mirror };
        assert_eq!(two_sided.facing([-1.5, 0.3, 0.2]).unwrap().normal, [-1.0, 0.0, 0.0]);
        assert!(mirror.is_around([0.0, 1.5, 2.0]) && !mirror.is_around([0.0, 2.6, 0.0]));
        let of: Vec<_> = (0..30).map(|triangle| scene.mirrors.of_triangle(triangle)).collect();
        assert!(of[..6].iter().all(|of| *of == Some(0)) && of[6..].iter().all(Option::is_none), "{of:?}");
    }

    #[test]
    fn a_thousand_facets_leave_eight_mirrors() {
        let mut mesh = Mesh::default();
        mesh.materials.push(metal("ball", 0.0));
        for facet in 0..1_000_u16 {
            let (sin, cos) = libm::sincosf(f32::from(facet) * 0.006);
            let high_m = 0.1 + f32::from(facet) * 1e-3;
            mesh.append_quad(
                0,
                [
                    [cos, 0.0, sin],
                    [cos, high_m, sin],
                    [0.99 * cos - 0.3 * sin, high_m, 0.99 * sin + 0.3 * cos],
                    [0.99 * cos - 0.3 * sin, 0.0, 0.99 * sin + 0.3 * cos],
                ],
                [1.0; 2],
            );
        }
        let scene = Scene::new("m", mesh, [0.0; BANDS]).unwrap();
        assert_eq!(scene.mirrors.all.len(), MIRRORS_MAX);
        assert!(scene.mirrors.of_triangle(1_999).is_some(), "the largest");
    }
}
