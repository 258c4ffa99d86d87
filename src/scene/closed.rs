//! Closed surfaces of two-sided material: no light reaches their insides, so they are taken for one-sided.
//!
//! Editors export materials as two-sided unless told otherwise. A bake spends rays on the inside of every crate, and takes samples of
//! the floor under the crate for dark places in the open, since nothing tells an unlit room from the inside of a thing.

use super::mesh::{Material, Mesh, area_m2, pushed};
use crate::num::{index, u32_from};

/// Least volume of a closed surface over the power 3/2 of its area (a ball has 0.094): below it, rounding decides the sign.
const VOLUME_MIN: f64 = 1e-9;

/// Marks one-sided the opaque surfaces that are closed, have their fronts outside and hold no lamp. No ray changes what it brings.
///
/// A surface is what is connected at equal positions of corners. It is closed where as many triangles run along each edge one way as
/// the other way.
pub fn make_closed_surfaces_one_sided(mesh: &mut Mesh) {
    let stops_light =
        |material: &Material| material.cut_out.is_none() && material.transmission <= 0.0 && !material.is_emissive();
    if !mesh.materials.iter().any(|material| material.double_sided && stops_light(material)) {
        return;
    }
    let place_of = places(mesh);
    let corners = |triangle: usize| mesh.triangles[triangle].map(|corner| place_of[index(corner)]);
    let mut roots: Vec<u32> = (0..u32_from(mesh.vertices.len())).collect();
    for triangle in 0..mesh.triangles.len() {
        let [a, b, c] = corners(triangle);
        join(&mut roots, a, b);
        join(&mut roots, a, c);
    }
    let mut surfaces: Vec<Option<Surface>> = vec![None; mesh.vertices.len()];
    let mut root_of = Vec::with_capacity(mesh.triangles.len());
    let mut edges = Vec::with_capacity(3 * mesh.triangles.len());
    for triangle in 0..mesh.triangles.len() {
        let [a, b, c] = corners(triangle);
        let root = root(&mut roots, a);
        root_of.push(root);
        edges.extend([(a, b), (b, c), (c, a)].map(|(from, to)| (from.min(to), from.max(to), from < to)));
        let material = &mesh.materials[index(mesh.material_of[triangle])];
        let surface = surfaces[index(root)].get_or_insert_with(|| Surface::at(mesh.corners_m(triangle)[0]));
        surface.add(mesh.corners_m(triangle));
        surface.stops_light &= stops_light(material);
    }
    edges.sort_unstable();
    for edge in edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)) {
        let forward = edge.iter().filter(|(_, _, is_forward)| *is_forward).count();
        if 2 * forward != edge.len() {
            let root = root(&mut roots, edge[0].0);
            surfaces[index(root)].iter_mut().for_each(|surface| surface.stops_light = false);
        }
    }
    let lamps_m = lamp_corners_m(mesh);
    let is_hidden: Vec<bool> = surfaces
        .iter()
        .map(|surface| surface.as_ref().is_some_and(|surface| surface.hides_its_inside(&lamps_m)))
        .collect();
    mark(mesh, |triangle| is_hidden[index(root_of[triangle])]);
}

/// What the triangles of a surface say together.
#[derive(Clone, Debug)]
struct Surface {
    origin_m: [f32; 3],
    low_m: [f32; 3],
    high_m: [f32; 3],
    /// Six times the volume within, above 0 with the fronts outside.
    six_volumes_m3: f64,
    area_m2: f64,
    /// Whether it is opaque, does not shine and, as far as is known, is closed.
    stops_light: bool,
}

impl Surface {
    fn at(origin_m: [f32; 3]) -> Self {
        Self { origin_m, low_m: origin_m, high_m: origin_m, six_volumes_m3: 0.0, area_m2: 0.0, stops_light: true }
    }

    fn add(&mut self, corners_m: [[f32; 3]; 3]) {
        for corner_m in corners_m {
            for axis in 0..3 {
                self.low_m[axis] = self.low_m[axis].min(corner_m[axis]);
                self.high_m[axis] = self.high_m[axis].max(corner_m[axis]);
            }
        }
        let origin_m = glam::Vec3::from(self.origin_m).as_dvec3();
        let [a, b, c] = corners_m.map(|corner_m| glam::Vec3::from(corner_m).as_dvec3() - origin_m);
        self.six_volumes_m3 += a.dot(b.cross(c));
        self.area_m2 += f64::from(area_m2(corners_m));
    }

    /// Whether no light starts within. A lamp in the surface's box counts as within. `lamps_m` are sorted.
    fn hides_its_inside(&self, lamps_m: &[[f32; 3]]) -> bool {
        let holds =
            |at_m: &[f32; 3]| (0..3).all(|axis| self.low_m[axis] <= at_m[axis] && at_m[axis] <= self.high_m[axis]);
        let first = lamps_m.partition_point(|at_m| at_m[0] < self.low_m[0]);
        let mut beside = lamps_m[first..].iter().take_while(|at_m| at_m[0] <= self.high_m[0]);
        let least_m3 = VOLUME_MIN * self.area_m2 * self.area_m2.sqrt();
        self.stops_light && self.six_volumes_m3 / 6.0 > least_m3 && !beside.any(holds)
    }
}

/// A number for each vertex, the same for all at one position.
fn places(mesh: &Mesh) -> Vec<u32> {
    // Adding 0 makes -0 and 0 equal.
    let bits = |vertex: u32| mesh.vertices[index(vertex)].position_m.map(|x| (x + 0.0).to_bits());
    let mut order: Vec<u32> = (0..u32_from(mesh.vertices.len())).collect();
    order.sort_unstable_by_key(|&vertex| (bits(vertex), vertex));
    let mut place_of = vec![0; order.len()];
    for same in order.chunk_by(|&a, &b| bits(a) == bits(b)) {
        same.iter().for_each(|&vertex| place_of[index(vertex)] = same[0]);
    }
    place_of
}

/// The root of a place's tree in a disjoint-set forest; paths are halved on the way.
fn root(roots: &mut [u32], mut place: u32) -> u32 {
    while roots[index(place)] != place {
        roots[index(place)] = roots[index(roots[index(place)])];
        place = roots[index(place)];
    }
    place
}

fn join(roots: &mut [u32], a: u32, b: u32) {
    let [a, b] = [a, b].map(|place| root(roots, place));
    roots[index(a.max(b))] = a.min(b);
}

/// Corners of everything that shines, sorted.
fn lamp_corners_m(mesh: &Mesh) -> Vec<[f32; 3]> {
    let shines = |triangle: &usize| mesh.materials[index(mesh.material_of[*triangle])].is_emissive();
    let mut corners_m: Vec<_> =
        (0..mesh.triangles.len()).filter(shines).flat_map(|triangle| mesh.corners_m(triangle)).collect();
    corners_m.sort_unstable_by(|a, b| a[0].total_cmp(&b[0]));
    corners_m
}

/// Gives some triangles one-sided materials. A material whose triangles are all among them is changed, others are copied.
fn mark(mesh: &mut Mesh, is_one_sided: impl Fn(usize) -> bool) {
    let mut is_needed = vec![false; mesh.materials.len()];
    for (triangle, &material) in mesh.material_of.iter().enumerate() {
        is_needed[index(material)] |= !is_one_sided(triangle);
    }
    let mut copies: Vec<Option<u32>> = vec![None; mesh.materials.len()];
    for (triangle, material) in mesh.material_of.iter_mut().enumerate() {
        let number = index(*material);
        if !is_one_sided(triangle) || !mesh.materials[number].double_sided {
            continue;
        }
        if is_needed[number] {
            let copy = Material { double_sided: false, ..mesh.materials[number].clone() };
            *material = *copies[number].get_or_insert_with(|| pushed(&mut mesh.materials, copy));
        } else {
            mesh.materials[number].double_sided = false;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::target::cube;
    use super::*;

    const CORNER_M: [f32; 3] = [0.5, 0.0, -3.0];

    /// Faces of a cube of 1 m with a two-sided material, of which some are given.
    fn with_faces(mesh: &mut Mesh, corner_m: [f32; 3], inside_out: bool, faces: usize) -> u32 {
        let material = pushed(&mut mesh.materials, Material::plain("crate", [0.5; 3]));
        for corners_m in cube(corner_m, corner_m.map(|x| x + 1.0), inside_out).into_iter().take(faces) {
            mesh.append_quad(material, corners_m, [1.0; 2]);
        }
        material
    }

    fn sides(mesh: &Mesh) -> Vec<bool> {
        mesh.materials.iter().map(|material| material.double_sided).collect()
    }

    #[test]
    fn a_closed_surface_becomes_one_sided_and_one_that_light_can_enter_does_not() {
        for (inside_out, faces, expected) in [(false, 6, false), (false, 5, true), (true, 6, true)] {
            let mut mesh = Mesh::default();
            with_faces(&mut mesh, CORNER_M, inside_out, faces);
            make_closed_surfaces_one_sided(&mut mesh);
            assert_eq!(sides(&mesh), [expected], "{inside_out} {faces}");
        }
    }

    #[test]
    fn panes_holes_lamps_and_plates_without_a_volume_stay_two_sided() {
        let edits: [fn(&mut Material); 3] = [
            |material| material.transmission = 0.9,
            |material| material.cut_out = Some(0),
            |material| material.emission = [1.0; 4],
        ];
        for edit in edits {
            let mut mesh = Mesh::default();
            with_faces(&mut mesh, CORNER_M, false, 6);
            edit(&mut mesh.materials[0]);
            make_closed_surfaces_one_sided(&mut mesh);
            assert_eq!(sides(&mesh), [true]);
        }
        let mut plate = Mesh::default();
        let material = pushed(&mut plate.materials, Material::plain("leaf", [0.5; 3]));
        let [front, ..] = cube(CORNER_M, CORNER_M.map(|x| x + 1.0), false);
        plate.append_quad(material, front, [1.0; 2]);
        plate.append_quad(material, [front[0], front[3], front[2], front[1]], [1.0; 2]);
        make_closed_surfaces_one_sided(&mut plate);
        assert_eq!(sides(&plate), [true]);
    }

    #[test]
    fn a_room_with_a_lamp_in_it_stays_two_sided_and_what_stands_in_it_does_not() {
        let mut mesh = Mesh::default();
        let room = with_faces(&mut mesh, [-4.0; 3], false, 0);
        for corners_m in cube([-4.0; 3], [4.0; 3], false) {
            mesh.append_quad(room, corners_m, [1.0; 2]);
        }
        with_faces(&mut mesh, CORNER_M, false, 6);
        let lamp = with_faces(&mut mesh, [-1.0, 3.0, 0.0], false, 1);
        mesh.materials[index(lamp)].emission = [1.0; 4];
        make_closed_surfaces_one_sided(&mut mesh);
        assert_eq!(sides(&mesh), [true, false, true]);
    }

    #[test]
    fn surfaces_that_share_a_material_are_told_apart() {
        let mut mesh = Mesh::default();
        let shared = with_faces(&mut mesh, CORNER_M, false, 6);
        let open = with_faces(&mut mesh, [7.0; 3], false, 4);
        mesh.material_of.iter_mut().for_each(|material| *material = shared);
        make_closed_surfaces_one_sided(&mut mesh);
        assert_eq!(sides(&mesh), [true, true, false]);
        assert_eq!(mesh.material_of, [[2; 12].as_slice(), &[shared; 8]].concat());
        assert_eq!(mesh.materials[2].name, "crate");
        assert_ne!(open, 2);
    }
}
