//! The camera's motion over a stratum of time. Enters: a trajectory. Leaves: a rotation matrix and a place that are quadratic
//! in time, for rays by the packet.

use glam::DMat3;

use crate::num::f32_nearest;
use crate::pose::Pose;
use crate::scene::lanes::{Floats, LANES, Vectors};
use crate::units::Span;

/// Numbers of a pose: nine of the rotation matrix by columns, three of the translation in metres.
const NUMBERS: usize = 12;

/// `world_from_camera` over a span, as the parabola through start, middle and end. For a rotation by an angle d over the
/// span the worst entry is off by d^3 sqrt(3) / 216 (0.008 d^3): 8e-6 rad for 0.1 rad, under a hundredth of a pixel at 1,000 px.
#[derive(Clone, Copy, Debug)]
pub struct Parabola {
    coefficients: [[f32; 3]; NUMBERS],
}

fn numbers(pose: &Pose) -> [f64; NUMBERS] {
    let matrix = DMat3::from_quat(pose.rotation).to_cols_array();
    let place = pose.translation_m;
    let mut numbers = [0.0; NUMBERS];
    numbers[..9].copy_from_slice(&matrix);
    numbers[9..].copy_from_slice(&[place.x, place.y, place.z]);
    numbers
}

impl Parabola {
    /// Through the poses at the start, the middle and the end of a span.
    pub fn through(span: Span, world_from_camera: &dyn Fn(f64) -> Pose) -> Self {
        let at = |t_s: f64| numbers(&world_from_camera(t_s));
        let start = at(span.start_s);
        // A still instant asks once.
        let (middle, end) = if span.length_s() > 0.0 { (at(span.middle_s()), at(span.end_s)) } else { (start, start) };
        let coefficients = std::array::from_fn(|number| {
            let (a, b, c) = (start[number], middle[number], end[number]);
            [a, -3.0 * a + 4.0 * b - c, 2.0 * a - 4.0 * b + 2.0 * c].map(f32_nearest)
        });
        Self { coefficients }
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

    #[inline(always)]
    fn at(&self, number: usize, share: Floats) -> Floats {
        let [a, b, c] = self.coefficients[number];
        a + share * (b + share * c)
    }

    /// One coordinate of the turned bearings. A function, because closures are not inlined into dispatched kernels.
    #[inline(always)]
    fn turned(&self, row: usize, bearing: Vectors, share: Floats) -> Floats {
        self.at(row, share) * bearing[0] + self.at(3 + row, share) * bearing[1] + self.at(6 + row, share) * bearing[2]
    }

    /// Origins and directions in the world of a packet's bearings, each at its own share (0..1) of the span.
    #[inline(always)]
    pub fn rays(&self, bearing: Vectors, share: Floats) -> (Vectors, Vectors) {
        let direction =
            [self.turned(0, bearing, share), self.turned(1, bearing, share), self.turned(2, bearing, share)];
        ([self.at(9, share), self.at(10, share), self.at(11, share)], direction)
    }
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
                let (origin, direction) = parabola.rays(bearing, Floats::splat(f32_nearest(share)));
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
