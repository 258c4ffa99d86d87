//! Boards with known edges: patches of known reflectance whose borders are edges of triangles.

use std::f64::consts::TAU;

use super::super::geometry::Scene;
use super::super::light::BANDS;
use super::super::mesh::{Material, Mesh, Vertex, pushed};
use super::params::TargetRequest;
use crate::error::Error;
use crate::num::{f32_nearest, f64_from_usize, index, lesser, u32_from, u32_truncated};

/// The keys that every board reads.
const BOARD_KEYS: [&str; 2] = ["target_distance_m", "target_size_m"];

/// Sides of the discs that point sources are.
const DISC_SIDES: usize = 24;

/// Most squares of a checkerboard.
const PATCHES_MAX: f64 = 250_000.0;

/// Most point sources: a render spends its most expensive samples on them.
const SOURCES_MAX: f64 = 2_500.0;

/// A board under construction: coordinates on it are metres from its middle, to the right and down as a level camera sees it.
#[derive(Debug)]
pub struct Board {
    mesh: Mesh,
    distance_m: f64,
    size_m: f64,
}

impl Board {
    /// A board, and the wall around it. `name` reads `more` keys besides `BOARD_KEYS`.
    fn new(name: &str, request: &TargetRequest, more: &[&str]) -> Result<Self, Error> {
        request.only(name, &[&BOARD_KEYS[..], more].concat())?;
        let distance_m = request.get("target_distance_m", 1.0, 0.01, 10_000.0)?;
        let size_m = request.get("target_size_m", 2.0 * distance_m, 0.001, 10_000.0)?;
        if !(0.0..=1.0).contains(&request.reflectance) {
            return Err(Error::key("scene.reflectance", request.reflectance, "use 0 to 1"));
        }
        let mut board = Self { mesh: Mesh::default(), distance_m, size_m };
        let around = board.patch_material(request.reflectance);
        let half_m = f32_nearest(4.0 * (distance_m + size_m));
        let mut faces = super::params::cube([-half_m; 3], [half_m; 3], true);
        // The wall that the board hangs on is in the board's plane, with a hole of the board's size; the other five close the room.
        faces.rotate_right(1);
        for corners_m in &faces[1..] {
            board.mesh.append_quad(around, *corners_m, [1.0, 1.0]);
        }
        let (h, far) = (0.5 * size_m, f64::from(half_m));
        board.frame(around, far, h);
        Ok(board)
    }

    /// A square with a square hole, by half their edges.
    fn frame(&mut self, material: u32, outer: f64, inner: f64) {
        self.rectangle(material, [-outer, -outer], [outer, -inner]);
        self.rectangle(material, [-outer, inner], [outer, outer]);
        self.rectangle(material, [-outer, -inner], [-inner, inner]);
        self.rectangle(material, [inner, -inner], [outer, inner]);
    }

    fn patch_material(&mut self, reflectance: f64) -> u32 {
        let material = Material::plain(&format!("{reflectance}"), [f32_nearest(reflectance); 3]);
        pushed(&mut self.mesh.materials, material)
    }

    fn point(&self, [x, y]: [f64; 2], before_m: f64) -> [f32; 3] {
        [f32_nearest(x), f32_nearest(y), f32_nearest(self.distance_m - before_m)]
    }

    /// Four corners in turn, the first two along the upper edge.
    fn patch(&mut self, material: u32, corners: [[f64; 2]; 4]) {
        // Seen against +z with y down, left to right along the top and back along the bottom is counter-clockwise from the other side.
        let [a, b, c, d] = corners.map(|corner| self.point(corner, 0.0));
        self.mesh.append_quad(material, [a, d, c, b], [1.0, 1.0]);
    }

    fn rectangle(&mut self, material: u32, [left, top]: [f64; 2], [right, bottom]: [f64; 2]) {
        self.patch(material, [[left, top], [right, top], [right, bottom], [left, bottom]]);
    }

    fn scene(self, name: &str) -> Result<Scene, Error> {
        Scene::new(name, self.mesh, [0.0; BANDS])
    }
}

/// Reflectances of light and dark about a mean.
fn light_and_dark(request: &TargetRequest, contrast: f64) -> Result<[f64; 2], Error> {
    let dark = 2.0 * request.reflectance / (1.0 + contrast);
    let light = dark * contrast;
    let most = (1.0 + contrast) / (2.0 * contrast);
    if request.reflectance <= most {
        return Ok([lesser(light, 1.0), dark]);
    }
    let reason = format!("with a contrast of {contrast} the light parts would reflect {light:.3}; use {most} or less");
    Err(Error::key("scene.reflectance", request.reflectance, reason))
}

/// A wall without any feature.
pub fn blank_wall(request: &TargetRequest) -> Result<Scene, Error> {
    let mut board = Board::new("blank_wall", request, &[])?;
    let h = 0.5 * board.size_m;
    board.rectangle(0, [-h, -h], [h, h]);
    board.scene("blank_wall")
}

/// ISO 12233: light to the left of an edge that leans to the right at its top for positive angles, dark to the right of it.
pub fn slanted_edge(request: &TargetRequest) -> Result<Scene, Error> {
    let mut board = Board::new("slanted_edge", request, &["target_angle_deg", "target_contrast"])?;
    let angle_deg = request.get("target_angle_deg", 5.0, -45.0, 45.0)?;
    let [light, dark] = light_and_dark(request, request.get("target_contrast", 4.0, 1.0, 10_000.0)?)?;
    let [light, dark] = [board.patch_material(light), board.patch_material(dark)];
    let h = 0.5 * board.size_m;
    let lean = h * libm::tan(angle_deg.to_radians());
    board.patch(light, [[-h, -h], [lean, -h], [-lean, h], [-h, h]]);
    board.patch(dark, [[lean, -h], [h, -h], [h, h], [-lean, h]]);
    board.scene("slanted_edge")
}

/// ISO 14524's grey scale as upright bars from light on the left to dark on the right, equal steps of density.
pub fn grey_wedge(request: &TargetRequest) -> Result<Scene, Error> {
    let mut board = Board::new("grey_wedge", request, &["target_steps", "target_contrast"])?;
    let steps = index(u32_truncated(request.get("target_steps", 12.0, 2.0, 64.0)?));
    let contrast = request.get("target_contrast", 40.0, 1.0, 10_000.0)?;
    let h = 0.5 * board.size_m;
    let edge = |step: usize| h * (2.0 * f64_from_usize(step) / f64_from_usize(steps) - 1.0);
    for step in 0..steps {
        let share = f64_from_usize(step) / f64_from_usize(steps - 1);
        let material = board.patch_material(request.reflectance * libm::pow(contrast, -share));
        board.rectangle(material, [edge(step), -h], [edge(step + 1), h]);
    }
    board.scene("grey_wedge")
}

/// Squares of known size, whole ones only, centred; the board's rim is as light as the mean.
pub fn checkerboard(request: &TargetRequest) -> Result<Scene, Error> {
    let mut board = Board::new("checkerboard", request, &["target_square_m", "target_contrast"])?;
    let square_m = request.get("target_square_m", board.size_m / 8.0, 1e-5, board.size_m)?;
    let [light, dark] = light_and_dark(request, request.get("target_contrast", 10.0, 1.0, 10_000.0)?)?;
    let [light, dark] = [board.patch_material(light), board.patch_material(dark)];
    let count = whole(board.size_m, square_m, PATCHES_MAX)?;
    let (h, rim) = (0.5 * board.size_m, 0.5 * square_m * f64_from_usize(count));
    let at = |number: usize| square_m * f64_from_usize(number) - rim;
    for row in 0..count {
        for column in 0..count {
            let material = if (row + column) % 2 == 0 { light } else { dark };
            board.rectangle(material, [at(column), at(row)], [at(column + 1), at(row + 1)]);
        }
    }
    if rim < h {
        board.frame(0, h, rim);
    }
    board.scene("checkerboard")
}

/// How often a length fits, with room for rounding; few enough that the board can be made.
fn whole(size_m: f64, square_m: f64, most: f64) -> Result<usize, Error> {
    let count = (size_m / square_m + 1e-9).floor();
    if count * count > most {
        let least_m = size_m / most.sqrt();
        let reason = format!("too small for a board of {size_m} m; use {least_m} or more");
        return Err(Error::key("scene.target_square_m", square_m, reason));
    }
    Ok(index(u32_truncated(count)).max(1))
}

/// A grid of small discs of known intensity before a board of the stated reflectance.
pub fn point_sources(request: &TargetRequest) -> Result<Scene, Error> {
    let mut board = Board::new("point_sources", request, &["target_square_m", "target_point_m", "target_point_cd"])?;
    let step_m = request.get("target_square_m", board.size_m / 8.0, 1e-5, board.size_m)?;
    let point_m = request.get("target_point_m", step_m / 50.0, 1e-6, 0.9 * step_m)?;
    let intensity_cd = request.get("target_point_cd", 0.01, 0.0, 1e6)?;
    let h = 0.5 * board.size_m;
    board.rectangle(0, [-h, -h], [h, h]);
    let glow = board.patch_material(0.0);
    let side = f64_from_usize(DISC_SIDES);
    let radius_m = 0.5 * point_m;
    let area_m2 = 0.5 * side * radius_m * radius_m * libm::sin(TAU / side);
    // `evenly_lit` makes one unit of emission a luminance of as many cd/m^2 as there are lux.
    let emission = intensity_cd / (area_m2 * request.illuminance_lux);
    let material = &mut board.mesh.materials[index(glow)];
    (material.emission, material.double_sided) = ([f32_nearest(emission); BANDS], false);
    let count = whole(board.size_m, step_m, SOURCES_MAX)?;
    let middle = 0.5 * (f64_from_usize(count) - 1.0);
    for row in 0..count {
        for column in 0..count {
            let centre_m = [column, row].map(|number| step_m * (f64_from_usize(number) - middle));
            board.disc(glow, centre_m, radius_m);
        }
    }
    board.scene("point_sources")
}

impl Board {
    /// A disc a thousandth of the distance before the board, facing the rig.
    fn disc(&mut self, material: u32, [x, y]: [f64; 2], radius_m: f64) {
        let normal = [0.0, 0.0, -1.0];
        let rim = (0..DISC_SIDES).map(|side| {
            let (sine, cosine) = libm::sincos(TAU * f64_from_usize(side) / f64_from_usize(DISC_SIDES));
            [x + radius_m * cosine, y + radius_m * sine]
        });
        let vertex = |at| Vertex { position_m: self.point(at, 1e-3 * self.distance_m), normal, uv: [0.0; 2] };
        let vertices: Vec<_> = [[x, y]].into_iter().chain(rim).map(vertex).collect();
        let sides = u32_from(DISC_SIDES);
        let triangles: Vec<_> = (0..sides).map(|side| [0, 1 + side, 1 + (side + 1) % sides]).collect();
        self.mesh.append(material, vertices, &triangles).expect("a disc made here is sound");
    }
}
