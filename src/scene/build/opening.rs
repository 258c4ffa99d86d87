//! Walls with openings. Builds the wall around a window, door or arch, its reveal, and the mouldings along its arch.

use super::super::mesh::Vertex;
use super::super::target::cube;
use super::super::vectors::{dot, unit_normal};
use super::surface::{Builder, Surface, world_uv};
use crate::num::f32_from_u32;

/// A vertical plane: coordinates on it are metres along it, metres up, and metres behind its face.
#[derive(Clone, Copy, Debug)]
pub struct Wall {
    /// Where along it is 0, at height 0.
    pub origin_m: [f32; 3],
    /// Unit vector along it, horizontal.
    pub along: [f32; 3],
    /// Unit vector out of its face.
    pub out: [f32; 3],
}

/// An upright opening with a flat or round head.
#[derive(Clone, Copy, Debug)]
pub struct Opening {
    /// Middle, along the wall.
    pub middle_m: f32,
    /// Half of its width.
    pub half_m: f32,
    /// Height of its lower edge.
    pub sill_m: f32,
    /// Height where its head begins.
    pub spring_m: f32,
    /// Height of its head over that: half an ellipse, 0 for a lintel.
    pub rise_m: f32,
}

/// Pieces of a round head: of an arch, of a window.
const HEAD_PIECES: [u32; 2] = [24, 10];

impl Wall {
    /// A point of the wall.
    pub fn at(&self, along_m: f32, up_m: f32, behind_m: f32) -> [f32; 3] {
        let coordinate = |axis: usize| self.origin_m[axis] + self.along[axis] * along_m - self.out[axis] * behind_m;
        [coordinate(0), self.origin_m[1] + up_m, coordinate(2)]
    }

    /// A direction in the wall's plane, plus a part out of it.
    fn direction(&self, along: f32, up: f32, out: f32) -> [f32; 3] {
        [self.along[0] * along + self.out[0] * out, up, self.along[2] * along + self.out[2] * out]
    }
}

impl Opening {
    /// Points of the head from its low to its high end along the wall, with the unit normal that points into the opening.
    fn head(&self) -> Vec<([f32; 2], [f32; 2])> {
        if self.rise_m <= 0.0 {
            return self.span().map(|along| ([along, self.spring_m], [0.0, -1.0])).to_vec();
        }
        let pieces = HEAD_PIECES[usize::from(self.half_m < 0.8)];
        let point = |piece: u32| {
            let angle_rad = std::f32::consts::PI * f32_from_u32(piece) / f32_from_u32(pieces);
            let (sine, cosine) = libm::sincosf(angle_rad);
            let (x, y) = (-self.half_m * cosine, self.rise_m * sine);
            let normal = [cosine * self.rise_m, -sine * self.half_m];
            let length = (normal[0] * normal[0] + normal[1] * normal[1]).sqrt();
            ([self.middle_m + x, self.spring_m + y], normal.map(|part| part / length))
        };
        (0..=pieces).map(point).collect()
    }

    /// Its low and its high end along the wall.
    pub fn span(&self) -> [f32; 2] {
        [self.middle_m - self.half_m, self.middle_m + self.half_m]
    }

    /// Height of its highest point.
    pub fn top_m(&self) -> f32 {
        self.spring_m + self.rise_m
    }
}

impl Builder {
    /// A rectangle of a wall's face: along from and to, up from and to.
    pub fn face(&mut self, surface: Surface, wall: &Wall, [a, b]: [f32; 2], [low, high]: [f32; 2], behind_m: f32) {
        let mut corners_m = [[a, low], [b, low], [b, high], [a, high]].map(|[s, y]| wall.at(s, y, behind_m));
        // Counter-clockwise from the front, whichever way the wall runs.
        let normal = unit_normal([corners_m[0], corners_m[1], corners_m[2]]);
        if normal.is_some_and(|normal| dot(normal, wall.out) < 0.0) {
            corners_m.reverse();
        }
        self.quad(surface, corners_m);
    }

    /// A block on or in a wall: along, up, and from how far before the face (negative) to how far behind it.
    pub fn on_wall(&mut self, surface: Surface, wall: &Wall, along: [f32; 2], up: [f32; 2], behind: [f32; 2]) {
        let [p, q] = [wall.at(along[0], up[0], behind[0]), wall.at(along[1], up[1], behind[1])];
        let least: [f32; 3] = [0, 1, 2].map(|axis| p[axis].min(q[axis]));
        let greatest: [f32; 3] = [0, 1, 2].map(|axis| p[axis].max(q[axis]));
        // What touches the wall is never seen: the face that looks into it is left out.
        for corners_m in cube(least, greatest, false) {
            let normal = unit_normal([corners_m[0], corners_m[1], corners_m[2]]);
            if normal.is_none_or(|normal| dot(normal, wall.out) > -0.5) {
                self.quad(surface, corners_m);
            }
        }
    }

    /// A wall's face between two distances along it and two heights with one opening in it, and the opening's reveal.
    pub fn pierced(
        &mut self,
        [face, reveal]: [Surface; 2],
        wall: &Wall,
        span: [f32; 2],
        heights: [f32; 2],
        opening: &Opening,
        depth_m: f32,
    ) {
        let [low, high] = opening.span();
        self.face(face, wall, [span[0], low], heights, 0.0);
        self.face(face, wall, [high, span[1]], heights, 0.0);
        self.face(face, wall, [low, high], [heights[0], opening.sill_m], 0.0);
        for pair in opening.head().windows(2) {
            let ([(a, _), (b, _)], top) = ([pair[0], pair[1]], heights[1]);
            self.piece(face, wall, [a, b, [b[0], top], [a[0], top]], 0.0);
        }
        self.reveal(reveal, wall, opening, depth_m);
    }

    /// A quadrangle of a wall's face by its corners.
    fn piece(&mut self, surface: Surface, wall: &Wall, corners: [[f32; 2]; 4], behind_m: f32) {
        let vertices = corners.map(|[s, y]| {
            let position_m = wall.at(s, y, behind_m);
            Vertex { position_m, normal: wall.out, uv: world_uv(position_m, wall.out, surface.tile_m) }
        });
        self.add(surface, &vertices, &[[0, 1, 2], [0, 2, 3]]);
    }

    /// The inside of an opening: jambs, head, and sill where it has one above the floor.
    fn reveal(&mut self, surface: Surface, wall: &Wall, opening: &Opening, depth_m: f32) {
        let ([low, high], &Opening { sill_m, spring_m, .. }) = (opening.span(), opening);
        let mut outline = vec![
            [([low, sill_m], [1.0, 0.0]), ([low, spring_m], [1.0, 0.0])],
            [([high, sill_m], [-1.0, 0.0]), ([high, spring_m], [-1.0, 0.0])],
            [([low, sill_m], [0.0, 1.0]), ([high, sill_m], [0.0, 1.0])],
        ];
        outline.extend(opening.head().windows(2).map(|pair| [pair[0], pair[1]]));
        self.strips(surface, wall, &outline, [0.0, depth_m]);
    }

    /// Strips at right angles to a wall along an outline of points with normals.
    fn strips(&mut self, surface: Surface, wall: &Wall, outline: &[[([f32; 2], [f32; 2]); 2]], behind: [f32; 2]) {
        let mut length_m = 0.0;
        for [(a, normal_a), (b, normal_b)] in outline {
            let step_m = ((b[0] - a[0]) * (b[0] - a[0]) + (b[1] - a[1]) * (b[1] - a[1])).sqrt();
            let vertex = |point: &[f32; 2], normal: &[f32; 2], depth_m: f32, run_m: f32| Vertex {
                position_m: wall.at(point[0], point[1], depth_m),
                normal: wall.direction(normal[0], normal[1], 0.0),
                uv: [depth_m / surface.tile_m, -run_m / surface.tile_m],
            };
            let vertices = [
                vertex(a, normal_a, behind[0], length_m),
                vertex(a, normal_a, behind[1], length_m),
                vertex(b, normal_b, behind[1], length_m + step_m),
                vertex(b, normal_b, behind[0], length_m + step_m),
            ];
            self.add(surface, &vertices, &[[0, 1, 2], [0, 2, 3]]);
            length_m += step_m;
        }
    }

    /// A flat band along an opening's head, `width_m` wide and `out_m` before the face, with its outer edge.
    pub fn archivolt(&mut self, surface: Surface, wall: &Wall, opening: &Opening, width_m: f32, out_m: f32) {
        let inner = opening.head();
        let outer = Opening { half_m: opening.half_m + width_m, rise_m: opening.rise_m + width_m, ..*opening }.head();
        for (near, far) in inner.windows(2).zip(outer.windows(2)) {
            self.piece(surface, wall, [near[0].0, near[1].0, far[1].0, far[0].0], -out_m);
        }
        let pieces = |points: &[([f32; 2], [f32; 2])], turn: f32| -> Vec<_> {
            let turned = |(at, normal): ([f32; 2], [f32; 2])| (at, normal.map(|part| part * turn));
            points.windows(2).map(|pair| [pair[0], pair[1]].map(turned)).collect()
        };
        self.strips(surface, wall, &pieces(&inner, 1.0), [-out_m, 0.0]);
        self.strips(surface, wall, &pieces(&outer, -1.0), [-out_m, 0.0]);
    }
}
