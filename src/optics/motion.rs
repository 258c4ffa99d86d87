//! The camera's motion over a stratum of time: a rotation matrix and a position that are quadratic in time, for rays by the packet.

use glam::DMat3;

use crate::num::{f32_from_u32, f32_nearest, index, u32_from, u32_truncated_f32};
use crate::pose::Pose;
use crate::scene::lanes::{Floats, LANES, Vectors, unrolled};
use crate::scene::tracer::Packet;
use crate::units::Span;

/// Numbers of a pose: nine of the rotation matrix by columns, three of the translation in metres.
const NUMBERS: usize = 12;

/// `world_from_camera` over a span, as the parabola through start, middle and end. For a rotation by an angle d over the
/// span the worst entry is off by d^3 sqrt(3) / 216 (0.008 d^3): 8e-6 rad for 0.1 rad, under a hundredth of a pixel at 1,000 px.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Parabola {
    coefficients: [[f32; 3]; NUMBERS],
}

fn numbers(pose: &Pose) -> [f64; NUMBERS] {
    let matrix = DMat3::from_quat(pose.rotation).to_cols_array();
    let translation_m = pose.translation_m;
    let mut numbers = [0.0; NUMBERS];
    numbers[..9].copy_from_slice(&matrix);
    numbers[9..].copy_from_slice(&[translation_m.x, translation_m.y, translation_m.z]);
    numbers
}

impl Parabola {
    /// Through the poses at the start, the middle and the end of a span.
    pub fn through(span: Span, world_from_camera: &dyn Fn(f64) -> Pose) -> Self {
        let at = |t_s: f64| numbers(&world_from_camera(t_s));
        let start = at(span.start_s);
        // A single instant needs one pose.
        let (middle, end) = if span.length_s() > 0.0 { (at(span.middle_s()), at(span.end_s)) } else { (start, start) };
        let coefficients = std::array::from_fn(|number| {
            let (a, b, c) = (start[number], middle[number], end[number]);
            // A pose at rest is equal in every bit at all times of the span.
            if a.to_bits() == b.to_bits() && b.to_bits() == c.to_bits() {
                return [f32_nearest(a), 0.0, 0.0];
            }
            [a, -3.0 * a + 4.0 * b - c, 2.0 * a - 4.0 * b + 2.0 * c].map(f32_nearest)
        });
        Self { coefficients }
    }

    /// Poses at shares (0..1) of the span.
    #[inline(always)]
    fn at(&self, share: Floats) -> PacketPoses {
        let of = &self.coefficients;
        PacketPoses(unrolled!(N in 12 => {
            Floats::splat(of[N][0]) + share * (Floats::splat(of[N][1]) + share * Floats::splat(of[N][2]))
        }))
    }

    /// How the pose changes at a share of the span, over `spans` times the span.
    #[inline(always)]
    fn change_at(&self, share: f32, spans: f32) -> LanePose {
        let of = &self.coefficients;
        LanePose(unrolled!(N in 12 => (of[N][1] + (share + share) * of[N][2]) * spans))
    }

    fn is_still(&self) -> bool {
        self.coefficients.iter().all(|[_, b, c]| *b == 0.0 && *c == 0.0)
    }
}

/// The motion of the pixels of a packet.
#[derive(Clone, Copy, Debug)]
pub enum PacketMotion<'a> {
    /// One motion for all lanes.
    Shared(&'a Parabola),
    ByLane(&'a Parabolas),
}

impl PacketMotion<'_> {
    /// The pose at each lane's own share (0..1) of the span.
    #[inline(always)]
    pub fn at(&self, share: Floats) -> PacketPoses {
        match self {
            Self::Shared(parabola) => parabola.at(share),
            Self::ByLane(parabolas) => parabolas.at(share),
        }
    }

    /// How one lane's pose changes at its share of the span, over `spans` times the span.
    #[inline(always)]
    pub fn change_of(&self, lane: usize, share: f32, spans: f32) -> LanePose {
        match self {
            Self::Shared(parabola) => parabola.change_at(share, spans),
            Self::ByLane(parabolas) => parabolas.change_of(lane, share, spans),
        }
    }
}

/// One parabola a lane, side by side: neighbouring rows of a rolling shutter move differently.
#[derive(Clone, Debug)]
pub struct Parabolas {
    coefficients: [[Floats; 3]; NUMBERS],
}

impl Parabolas {
    /// Side by side.
    pub fn of(lanes: &[Parabola; LANES]) -> Self {
        let mut coefficients = [[Floats::splat(0.0); 3]; NUMBERS];
        for (lane, parabola) in lanes.iter().enumerate() {
            for (to, from) in coefficients.iter_mut().flatten().zip(parabola.coefficients.iter().flatten()) {
                to.0[lane] = *from;
            }
        }
        Self { coefficients }
    }

    /// The pose at each lane's own share (0..1) of the span.
    #[inline(always)]
    pub fn at(&self, share: Floats) -> PacketPoses {
        let of = &self.coefficients;
        PacketPoses(unrolled!(N in 12 => of[N][0] + share * (of[N][1] + share * of[N][2])))
    }

    /// How one lane's pose changes at its share of the span, over `spans` times the span.
    #[inline(always)]
    pub fn change_of(&self, lane: usize, share: f32, spans: f32) -> LanePose {
        let mut numbers = [0.0; NUMBERS];
        for (to, [_, b, c]) in numbers.iter_mut().zip(&self.coefficients) {
            *to = (b.0[lane] + (share + share) * c.0[lane]) * spans;
        }
        LanePose(numbers)
    }

    /// One lane's pose at its share of the span.
    fn pose_of(&self, lane: usize, share: f32) -> LanePose {
        let mut numbers = [0.0; NUMBERS];
        for (to, [a, b, c]) in numbers.iter_mut().zip(&self.coefficients) {
            *to = a.0[lane] + share * (b.0[lane] + share * c.0[lane]);
        }
        LanePose(numbers)
    }
}

/// One lane's pose, or how it changes: a matrix and a translation.
#[derive(Clone, Copy, Debug)]
pub struct LanePose([f32; NUMBERS]);

impl LanePose {
    /// The matrix's product with a vector of the camera.
    #[inline(always)]
    pub fn turned(&self, [x, y, z]: [f32; 3]) -> [f32; 3] {
        let m = &self.0;
        [m[0] * x + m[3] * y + m[6] * z, m[1] * x + m[4] * y + m[7] * z, m[2] * x + m[5] * y + m[8] * z]
    }

    /// The translation in metres, or how it changes.
    #[inline(always)]
    pub fn translation_m(&self) -> [f32; 3] {
        [self.0[9], self.0[10], self.0[11]]
    }
}

/// The pose of each lane of a packet.
#[derive(Clone, Copy, Debug)]
pub struct PacketPoses([Floats; NUMBERS]);

impl PacketPoses {
    #[inline(always)]
    pub fn lane(&self, lane: usize) -> LanePose {
        let mut numbers = [0.0; NUMBERS];
        for number in 0..NUMBERS {
            numbers[number] = self.0[number].0[lane];
        }
        LanePose(numbers)
    }

    /// The matrix's product with vectors of the camera.
    #[inline(always)]
    pub fn turned(&self, [x, y, z]: Vectors) -> Vectors {
        let m = &self.0;
        [m[0] * x + m[3] * y + m[6] * z, m[1] * x + m[4] * y + m[7] * z, m[2] * x + m[5] * y + m[8] * z]
    }

    /// The transposed matrix's product: from the frame that a rotation leads to back into that of the camera.
    #[inline(always)]
    pub fn turned_back(&self, [x, y, z]: Vectors) -> Vectors {
        let m = &self.0;
        [m[0] * x + m[1] * y + m[2] * z, m[3] * x + m[4] * y + m[5] * z, m[6] * x + m[7] * y + m[8] * z]
    }

    /// The translations in metres.
    #[inline(always)]
    pub fn translation_m(&self) -> Vectors {
        [self.0[9], self.0[10], self.0[11]]
    }

    /// Rays of the camera's frame in that which the poses lead to.
    #[inline(always)]
    pub fn rays(&self, rays: &Packet) -> Packet {
        let turned = self.turned(rays.origin_m);
        let origin_m = unrolled!(AXIS in 3 => self.translation_m()[AXIS] + turned[AXIS]);
        Packet { origin_m, direction: self.turned(rays.direction), ..*rays }
    }

    /// Rays of the frame that the poses lead to in that of the camera.
    #[inline(always)]
    pub fn rays_back(&self, rays: &Packet) -> Packet {
        let from_m = unrolled!(AXIS in 3 => rays.origin_m[AXIS] - self.translation_m()[AXIS]);
        Packet { origin_m: self.turned_back(from_m), direction: self.turned_back(rays.direction), ..*rays }
    }
}

/// The motion of neighbouring rows over their exposures, in equal pieces of time.
#[derive(Clone, Debug)]
pub struct Timeline {
    /// A power of two of them, up to `PIECES_MAX`; one where nothing moves.
    pub pieces: Vec<Parabolas>,
    /// The first piece of each row.
    first: Vec<Parabola>,
    /// Whether the camera is static over all of it.
    pub is_still: bool,
}

/// Pieces of an exposure where it turns little: one parabola is exact enough.
const PIECES_MIN: u32 = 1;
/// As many as the packets' samples share strata of time.
const PIECES_MAX: u32 = 16;
/// Rotation over a piece above which it is split.
const TURN_MAX_RAD: f64 = 0.05;

impl Timeline {
    /// Pieces that are short enough for the turn over a span.
    pub fn pieces_for(span: Span, world_from_camera: &dyn Fn(f64) -> Pose) -> u32 {
        let mut pieces = PIECES_MIN;
        while pieces < PIECES_MAX && turn_rad(span, world_from_camera) > TURN_MAX_RAD * f64::from(pieces) {
            pieces *= 2;
        }
        pieces
    }

    /// Of the exposures of four rows, lane by lane of a packet. Rows that are exposed together are asked for once.
    pub fn of<const ROWS: usize>(spans: [Span; ROWS], pieces: u32, world_from_camera: &dyn Fn(f64) -> Pose) -> Self {
        let mut known: Vec<Vec<Parabola>> = Vec::with_capacity(ROWS);
        for row in 0..ROWS {
            let before = (row > 0 && spans[row] == spans[row - 1]).then(|| known[row - 1].clone());
            known.push(before.unwrap_or_else(|| parabolas(spans[row], pieces, world_from_camera)));
        }
        let first = known[0][0];
        let is_still = known.iter().flatten().all(|parabola| *parabola == first && parabola.is_still());
        let lanes = |piece: usize| Parabolas::of(&std::array::from_fn(|lane| known[lane / (LANES / ROWS)][piece]));
        let count = if is_still { 1 } else { index(pieces) };
        let first = known.iter().map(|of_row| of_row[0]).collect();
        Self { pieces: (0..count).map(lanes).collect(), first, is_still }
    }

    /// Cuts what is still into as many pieces as what moves beside it, and counts it as moving.
    pub fn cut_alike(&mut self, pieces: u32) {
        if std::mem::take(&mut self.is_still) {
            self.pieces = vec![self.pieces[0].clone(); index(pieces)];
        }
    }

    /// The pose of one lane of the packet at a share of its exposure.
    pub fn pose_at(&self, lane: usize, share: f32) -> LanePose {
        let pieces = f32_from_u32(u32_from(self.pieces.len()));
        // The end of the last piece is its own.
        let piece = u32_truncated_f32(share * pieces).min(u32_from(self.pieces.len() - 1));
        self.pieces[index(piece)].pose_of(lane, share * pieces - f32_from_u32(piece))
    }

    /// How that pose changes there, over the whole exposure.
    pub fn change_at(&self, lane: usize, share: f32) -> LanePose {
        let pieces = f32_from_u32(u32_from(self.pieces.len()));
        let piece = u32_truncated_f32(share * pieces).min(u32_from(self.pieces.len() - 1));
        self.pieces[index(piece)].change_of(lane, share * pieces - f32_from_u32(piece), pieces)
    }

    /// The motion of a row of the group over the first piece: all of it where there is one.
    pub fn first_of_row(&self, row: usize) -> &Parabola {
        &self.first[row]
    }

    /// The motion of one lane of the packet, in each lane over a different piece.
    pub fn gathered(&self, lane: usize, piece_of: &[usize; LANES]) -> Parabolas {
        let mut all = Parabolas { coefficients: [[Floats::splat(0.0); 3]; NUMBERS] };
        for (to, &piece) in piece_of.iter().enumerate() {
            let from = &self.pieces[piece].coefficients;
            for (to_powers, from_powers) in all.coefficients.iter_mut().flatten().zip(from.iter().flatten()) {
                to_powers.0[to] = from_powers.0[lane];
            }
        }
        all
    }
}

/// Turn between the ends of a span: the finest piece's length follows from it.
fn turn_rad(span: Span, world_from_camera: &dyn Fn(f64) -> Pose) -> f64 {
    let [start, middle, end] = [span.start_s, span.middle_s(), span.end_s].map(world_from_camera);
    start.inverse().then(&middle).angle_rad() + middle.inverse().then(&end).angle_rad()
}

fn parabolas(span: Span, pieces: u32, world_from_camera: &dyn Fn(f64) -> Pose) -> Vec<Parabola> {
    let edge_s = |number: u32| span.start_s + span.length_s() * (f64::from(number) / f64::from(pieces));
    let piece =
        |number: u32| Parabola::through(Span { start_s: edge_s(number), end_s: edge_s(number + 1) }, world_from_camera);
    (0..pieces).map(piece).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::{DQuat, DVec3};

    #[test]
    fn the_parabola_keeps_its_stated_bound_for_turns_up_to_a_third_of_a_radian() {
        let mut tried = 0;
        for angle_rad in [0.0, 0.01, 0.1, 0.3] {
            let pose = |t_s: f64| {
                Pose::new(DQuat::from_axis_angle(DVec3::Y, angle_rad * t_s), DVec3::new(t_s, 0.0, t_s * t_s))
            };
            let parabola = Parabolas::of(&[Parabola::through(Span { start_s: 0.0, end_s: 1.0 }, &pose); LANES]);
            for step in 0..=20 {
                let share = f64::from(step) / 20.0;
                let bearing = [Floats::splat(0.6), Floats::splat(0.0), Floats::splat(0.8)];
                let poses = parabola.at(Floats::splat(f32_nearest(share)));
                let (origin, direction) = (poses.translation_m(), poses.turned(bearing));
                let exact = pose(share).direction(DVec3::new(0.6, 0.0, 0.8));
                // Each coordinate sums two entries times 0.6 and 0.8; f32 adds some ten roundings of 2^-24.
                let bound = 1.4 * 0.0081 * angle_rad * angle_rad * angle_rad + 10.0 * 6e-8;
                let error =
                    (f64::from(direction[0].0[0]) - exact.x).abs().max((f64::from(direction[2].0[0]) - exact.z).abs());
                assert!(error < bound, "{angle_rad} rad at {share}: {error:e}");
                assert!((f64::from(origin[2].0[0]) - share * share).abs() < 1e-6);
                tried += 1;
            }
        }
        assert_eq!(tried, 84);
    }
}
