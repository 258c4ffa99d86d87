//! Surfaces that give light of their own. Enters: emissive triangles. Leaves: points on them, chosen by power.

use super::mesh::{Mesh, area_m2, unit_normal};
use crate::num::{f64_from_usize, index};

/// Lamps are cut until no piece gives more than this share of all light, so that strata of power are strata of place.
const PIECE_SHARE_MAX: f64 = 1.0 / 256.0;

/// Scenes in which more than this share of all area glows are lit by rays that happen to meet it, not by aimed ones.
const AIMED_AREA_SHARE_MAX: f64 = 0.1;

#[derive(Clone, Copy, Debug)]
struct Piece {
    corners_m: [[f32; 3]; 3],
    normal: [f32; 3],
    radiance: [f32; 3],
    double_sided: bool,
    area_m2: f64,
    weight: f64,
}

/// A point on a lamp.
#[derive(Clone, Copy, Debug)]
pub struct LampPoint {
    /// Metres.
    pub position_m: [f32; 3],
    /// Unit length.
    pub normal: [f32; 3],
    /// In the scene's own units.
    pub radiance: [f32; 3],
    /// Whether the back gives light as well.
    pub double_sided: bool,
    /// Inverse of the density with which this point was chosen.
    pub area_m2: f64,
}

/// All lamps of a scene that shadow rays are aimed at.
#[derive(Clone, Debug, Default)]
pub struct Lamps {
    pieces: Vec<Piece>,
    /// Running sum of weights after each piece.
    cumulative: Vec<f64>,
}

impl Lamps {
    /// Finds the emissive triangles. Empty where there are none, or where so much glows that aiming is pointless.
    pub fn of(mesh: &Mesh) -> Self {
        let (mut total_m2, mut glowing_m2) = (0.0, 0.0);
        let mut pieces = Vec::new();
        for triangle in 0..mesh.triangles.len() {
            let corners_m = mesh.corners_m(triangle);
            let area = f64::from(area_m2(corners_m));
            total_m2 += area;
            let material = &mesh.materials[index(mesh.material_of[triangle])];
            if material.is_emissive() {
                glowing_m2 += area;
                let normal = unit_normal(corners_m).expect("a mesh keeps no triangle without area");
                let luminance = super::light::luminance(material.emission.map(f64::from));
                pieces.push(Piece {
                    corners_m,
                    normal,
                    radiance: material.emission,
                    double_sided: material.double_sided,
                    area_m2: area,
                    weight: area * luminance,
                });
            }
        }
        if glowing_m2 > AIMED_AREA_SHARE_MAX * total_m2 {
            return Self::default();
        }
        let weight: f64 = pieces.iter().map(|piece| piece.weight).sum();
        let mut fine = Vec::new();
        for piece in pieces {
            cut(piece, weight * PIECE_SHARE_MAX, &mut fine);
        }
        let mut sum = 0.0;
        let cumulative = fine.iter().map(|piece| {
            sum += piece.weight;
            sum
        });
        Self { cumulative: cumulative.collect(), pieces: fine }
    }

    /// Whether rays are to be aimed.
    pub fn is_empty(&self) -> bool {
        self.pieces.is_empty()
    }

    /// The point at a share (0..1) of all light, and at `within` on the piece found there; its `area_m2` is for one ray of
    /// `rays`.
    pub fn point(&self, share: f64, within: [f64; 2], rays: usize) -> LampPoint {
        let total = *self.cumulative.last().expect("only scenes with lamps are asked");
        let number = self.cumulative.partition_point(|&sum| sum <= share * total).min(self.pieces.len() - 1);
        let piece = &self.pieces[number];
        // Uniform on a triangle: fold the unit square along its diagonal.
        let [mut u, mut v] = within.map(crate::num::f32_nearest);
        if u + v > 1.0 {
            (u, v) = (1.0 - u, 1.0 - v);
        }
        let [a, b, c] = piece.corners_m;
        let position_m = [0, 1, 2].map(|axis| a[axis] * (1.0 - u - v) + b[axis] * u + c[axis] * v);
        LampPoint {
            position_m,
            normal: piece.normal,
            radiance: piece.radiance,
            double_sided: piece.double_sided,
            area_m2: piece.area_m2 * total / (piece.weight * f64_from_usize(rays)),
        }
    }
}

fn cut(piece: Piece, weight_max: f64, out: &mut Vec<Piece>) {
    if piece.weight <= weight_max {
        out.push(piece);
        return;
    }
    let [a, b, c] = piece.corners_m;
    let middle = |p: [f32; 3], q: [f32; 3]| [0, 1, 2].map(|axis| 0.5 * (p[axis] + q[axis]));
    let (ab, bc, ca) = (middle(a, b), middle(b, c), middle(c, a));
    for corners_m in [[a, ab, ca], [ab, b, bc], [ab, bc, ca], [ca, bc, c]] {
        cut(Piece { corners_m, area_m2: piece.area_m2 / 4.0, weight: piece.weight / 4.0, ..piece }, weight_max, out);
    }
}
