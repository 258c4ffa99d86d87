//! Closed surfaces of two-sided material: no light reaches their insides, so they are taken for one-sided.
//!
//! Editors export materials as two-sided unless told otherwise. A bake spends rays on the inside of every crate, and takes samples of
//! the floor under the crate for dark ones in the open, since nothing tells an unlit room from the inside of a thing.

use glam::DVec3;

use super::mesh::{Material, Mesh, pushed};
use crate::num::{index, u32_from};

/// Least volume of a closed surface over the power 3/2 of its area (a ball has 0.094): below it, rounding decides the sign.
const VOLUME_MIN: f64 = 1e-9;

/// Pairs of boxes that are compared, at most: about a second. Beyond that surfaces stay as they are.
const TRIED_MAX: usize = 320_000_000;
/// What a triangle's solid angle counts as.
const TRIED_PER_TRIANGLE: usize = 16;

/// Marks one-sided the opaque surfaces that are closed, have their fronts outside and hold no other surface: what holds something is a
/// room that a camera may stand in.
///
/// A surface is what is connected at equal positions of corners. It is closed where as many triangles run along each edge one way as
/// the other way.
pub fn make_closed_surfaces_one_sided(mesh: &mut Mesh) {
    let stops_light =
        |material: &Material| material.cut_out.is_none() && material.transmission <= 0.0 && !material.is_emissive();
    if !mesh.materials.iter().any(|material| material.double_sided && stops_light(material)) {
        return;
    }
    let surfaces = surfaces(mesh, stops_light);
    let mut tried = 0;
    let mut is_hidden = vec![false; mesh.triangles.len()];
    for (number, surface) in surfaces.iter().enumerate() {
        if surface.is_closed && !surface.holds_any(mesh, &surfaces, number, &mut tried) {
            surface.triangles.iter().for_each(|&triangle| is_hidden[index(triangle)] = true);
        }
    }
    mark(mesh, |triangle| is_hidden[triangle]);
}

/// Triangles that are connected.
#[derive(Clone, Debug)]
struct Surface {
    triangles: Vec<u32>,
    low_m: DVec3,
    high_m: DVec3,
    /// Whether it is opaque, closed, does not shine, and has its fronts outside.
    is_closed: bool,
}

/// All surfaces, by their least coordinate along x.
fn surfaces(mesh: &Mesh, stops_light: impl Fn(&Material) -> bool) -> Vec<Surface> {
    let welded = welded_vertices(mesh);
    let corners = |triangle: usize| mesh.triangles[triangle].map(|corner| welded[index(corner)]);
    let mut roots: Vec<u32> = (0..u32_from(mesh.vertices.len())).collect();
    for triangle in 0..mesh.triangles.len() {
        let [a, b, c] = corners(triangle);
        join(&mut roots, a, b);
        join(&mut roots, a, c);
    }
    let mut by_root: Vec<(u32, u32)> = (0..mesh.triangles.len())
        .map(|triangle| (root(&mut roots, corners(triangle)[0]), u32_from(triangle)))
        .collect();
    by_root.sort_unstable();
    let surface = |own: &[(u32, u32)]| {
        let triangles: Vec<u32> = own.iter().map(|&(_, triangle)| triangle).collect();
        let (mut low_m, mut high_m) = (DVec3::INFINITY, DVec3::NEG_INFINITY);
        for corner_m in triangles.iter().flat_map(|&triangle| corners_m(mesh, triangle)) {
            (low_m, high_m) = (low_m.min(corner_m), high_m.max(corner_m));
        }
        let material = |&triangle: &u32| &mesh.materials[index(mesh.material_of[index(triangle)])];
        let is_closed = triangles.iter().map(material).all(&stops_light)
            && is_balanced(triangles.iter().map(|&triangle| corners(index(triangle))))
            && has_its_fronts_outside(triangles.iter().map(|&triangle| corners_m(mesh, triangle)), low_m);
        Surface { triangles, low_m, high_m, is_closed }
    };
    let mut surfaces: Vec<Surface> = by_root.chunk_by(|a, b| a.0 == b.0).map(surface).collect();
    surfaces.sort_by(|a, b| a.low_m.x.total_cmp(&b.low_m.x));
    surfaces
}

fn corners_m(mesh: &Mesh, triangle: u32) -> [DVec3; 3] {
    mesh.corners_m(index(triangle)).map(|corner_m| DVec3::from(corner_m.map(f64::from)))
}

/// Whether as many triangles run along each edge one way as the other way.
fn is_balanced(triangles: impl Iterator<Item = [u32; 3]>) -> bool {
    let ways = triangles.flat_map(|[a, b, c]| [(a, b), (b, c), (c, a)]);
    let mut edges: Vec<(u32, u32, bool)> = ways.map(|(from, to)| (from.min(to), from.max(to), from < to)).collect();
    edges.sort_unstable();
    edges.chunk_by(|a, b| (a.0, a.1) == (b.0, b.1)).all(|edge| {
        let forward = edge.iter().filter(|(_, _, is_forward)| *is_forward).count();
        2 * forward == edge.len()
    })
}

/// Whether the triangles, which make a closed surface, have a volume behind them. Numbers stay small around a point `near_m` them.
fn has_its_fronts_outside(triangles: impl Iterator<Item = [DVec3; 3]>, near_m: DVec3) -> bool {
    let (mut volume_m3, mut area_m2) = (0.0, 0.0);
    for corners_m in triangles {
        let [a, b, c] = corners_m.map(|corner_m| corner_m - near_m);
        volume_m3 += a.dot(b.cross(c)) / 6.0;
        area_m2 += 0.5 * (b - a).cross(c - a).length();
    }
    volume_m3 > VOLUME_MIN * area_m2 * area_m2.sqrt()
}

impl Surface {
    /// Whether another surface lies within it, by the middle of that one's box. `surfaces` are by their least x; `tried` counts
    /// work.
    fn holds_any(&self, mesh: &Mesh, surfaces: &[Self], own: usize, tried: &mut usize) -> bool {
        let first = surfaces.partition_point(|other| other.low_m.x < self.low_m.x);
        let others = surfaces.iter().enumerate().skip(first).take_while(|(_, other)| other.low_m.x <= self.high_m.x);
        others.filter(|&(number, _)| number != own).any(|(_, other)| {
            let is_in_box = self.low_m.cmple(other.low_m).all() && other.high_m.cmple(self.high_m).all();
            *tried += 1 + if is_in_box { TRIED_PER_TRIANGLE * self.triangles.len() } else { 0 };
            *tried > TRIED_MAX || (is_in_box && self.winding_number(mesh, 0.5 * (other.low_m + other.high_m)) > 0.5)
        })
    }

    /// How often the surface goes around a point: 1 within, 0 outside (the sum of the triangles' solid angles: van Oosterom and Strackee,
    /// IEEE Transactions on Biomedical Engineering 30, 1983).
    fn winding_number(&self, mesh: &Mesh, at_m: DVec3) -> f64 {
        let mut solid_angle_sr = 0.0;
        for &triangle in &self.triangles {
            let [a, b, c] = corners_m(mesh, triangle).map(|corner_m| corner_m - at_m);
            let [la, lb, lc] = [a, b, c].map(DVec3::length);
            let below = la * lb * lc + a.dot(b) * lc + b.dot(c) * la + c.dot(a) * lb;
            solid_angle_sr += 2.0 * libm::atan2(a.dot(b.cross(c)), below);
        }
        solid_angle_sr / (4.0 * std::f64::consts::PI)
    }
}

/// Of each vertex the first one at its position, which stands for all of them.
fn welded_vertices(mesh: &Mesh) -> Vec<u32> {
    // Adding 0 makes -0 and 0 equal.
    let bits = |vertex: u32| mesh.vertices[index(vertex)].position_m.map(|x| (x + 0.0).to_bits());
    let mut order: Vec<u32> = (0..u32_from(mesh.vertices.len())).collect();
    order.sort_unstable_by_key(|&vertex| (bits(vertex), vertex));
    let mut welded = vec![0; order.len()];
    for same in order.chunk_by(|&a, &b| bits(a) == bits(b)) {
        same.iter().for_each(|&vertex| welded[index(vertex)] = same[0]);
    }
    welded
}

/// The root of a welded vertex's tree in a disjoint-set forest; paths are halved on the way.
fn root(roots: &mut [u32], mut vertex: u32) -> u32 {
    while roots[index(vertex)] != vertex {
        roots[index(vertex)] = roots[index(roots[index(vertex)])];
        vertex = roots[index(vertex)];
    }
    vertex
}

fn join(roots: &mut [u32], a: u32, b: u32) {
    let [a, b] = [a, b].map(|vertex| root(roots, vertex));
    roots[index(a.max(b))] = a.min(b);
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
            *material = *copies[number].get_or_insert_with(|| {
                let copy = Material { double_sided: false, ..mesh.materials[number].clone() };
                pushed(&mut mesh.materials, copy)
            });
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
    fn a_room_stays_two_sided_and_what_stands_in_it_or_under_a_table_does_not() {
        let mut mesh = Mesh::default();
        let cuboid = |mesh: &mut Mesh, low_m: [f32; 3], high_m: [f32; 3]| {
            let material = pushed(&mut mesh.materials, Material::plain("part", [0.5; 3]));
            for corners_m in cube(low_m, high_m, false) {
                mesh.append_quad(material, corners_m, [1.0; 2]);
            }
        };
        cuboid(&mut mesh, [-4.0; 3], [4.0; 3]);
        cuboid(&mut mesh, CORNER_M, CORNER_M.map(|x| x + 1.0));
        // An arch of three cuboids that meet at corners, with a crate under it: within its box, and not within it.
        cuboid(&mut mesh, [-3.0, 0.0, 0.0], [-2.5, 1.0, 1.0]);
        cuboid(&mut mesh, [-1.0, 0.0, 0.0], [-0.5, 1.0, 1.0]);
        cuboid(&mut mesh, [-2.5, 1.0, 0.0], [-1.0, 1.5, 1.0]);
        cuboid(&mut mesh, [-2.0, 0.0, 0.25], [-1.5, 0.5, 0.75]);
        make_closed_surfaces_one_sided(&mut mesh);
        assert_eq!(sides(&mesh), [true, false, false, false, false, false]);
        assert_eq!(surfaces(&mesh, |_| true).len(), 4);
    }

    #[test]
    fn the_winding_number_is_one_within_and_nought_outside() {
        let mut mesh = Mesh::default();
        with_faces(&mut mesh, CORNER_M, false, 6);
        let [cube] = surfaces(&mesh, |_| true).try_into().unwrap();
        let corner_m = DVec3::from(CORNER_M.map(f64::from));
        for (share, expected) in [(0.5, 1.0), (0.01, 1.0), (-0.01, 0.0), (1.5, 0.0)] {
            let found = cube.winding_number(&mesh, corner_m + DVec3::splat(share));
            assert!((found - expected).abs() < 1e-9, "{share}: {found}");
        }
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
