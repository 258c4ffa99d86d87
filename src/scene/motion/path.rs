//! The path of a walk on level ground: position and heading as smooth functions of the distance in metres.

use glam::DVec3;

use crate::num;

/// First zero of Bessel's J0: the swing at which a sine-generated curve closes.
const LOOP_SWING_RAD: f64 = 2.404_825_557_695_773;

/// Greatest distance of that curve from its middle, for a way of 2 pi once round.
const LOOP_RADIUS_PER_RADIAN: f64 = 1.177_691_733_196_831_5;

/// Terms of the curve's series; the first left out is J24(2.4) / 24 < 1e-22.
const LOOP_TERMS: usize = 24;

/// The shape of a path.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum PathShape {
    /// Straight ahead, without end.
    Line,
    /// Round a circle to the left, whose middle lies this many metres to the left of the start.
    Circle(f64),
    /// A figure of eight within a circle around its middle.
    Loop(Eight),
}

/// A closed sine-generated curve (Langbein and Leopold 1966, "River meanders - theory of minimum variance"): the heading
/// is a sine of the way, so the path turns left and right alike and its curvature is smooth. With J the Bessel functions,
/// the position is the series of Jacobi and Anger, integrated term by term.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Eight {
    radians_per_m: f64,
    /// `2 J_k / k` for k from 1.
    weights: [f64; LOOP_TERMS],
}

impl PathShape {
    /// The figure of eight that stays within `radius_m` of its middle.
    pub fn eight(radius_m: f64) -> Self {
        let mut weights = [0.0; LOOP_TERMS];
        for (order, weight) in (1_i32..).zip(&mut weights) {
            *weight = 2.0 * libm::jn(order, LOOP_SWING_RAD) / f64::from(order);
        }
        Self::Loop(Eight { radians_per_m: LOOP_RADIUS_PER_RADIAN / radius_m, weights })
    }

    /// Position in metres after a way, and the heading: radians to the left of the start's.
    pub fn at(&self, way_m: f64) -> (DVec3, f64) {
        match self {
            Self::Line => (DVec3::new(0.0, 0.0, -way_m), 0.0),
            Self::Circle(radius_m) => {
                let heading_rad = way_m / radius_m;
                let (sine, cosine) = libm::sincos(heading_rad);
                (DVec3::new(radius_m * (cosine - 1.0), 0.0, -radius_m * sine), heading_rad)
            }
            Self::Loop(eight) => eight.at(way_m),
        }
    }
}

impl Eight {
    /// The middle of the curve, in metres from its start.
    pub fn middle_m(&self) -> DVec3 {
        let odd: f64 = self.weights.iter().step_by(2).fold(0.0, |sum, weight| sum + weight);
        DVec3::new(-odd / self.radians_per_m, 0.0, 0.0)
    }

    fn at(&self, way_m: f64) -> (DVec3, f64) {
        let phase_rad = way_m * self.radians_per_m;
        let (mut ahead, mut left) = (0.0, 0.0);
        for (index, weight) in self.weights.iter().enumerate() {
            let order = num::f64_from_usize(index + 1);
            if index % 2 == 0 {
                left += weight * (1.0 - libm::cos(order * phase_rad));
            } else {
                ahead += weight * libm::sin(order * phase_rad);
            }
        }
        let position_m = DVec3::new(-left, 0.0, -ahead) / self.radians_per_m;
        (position_m, LOOP_SWING_RAD * libm::sin(phase_rad))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_path_moves_by_its_way_along_its_heading_and_stays_where_it_should() {
        let radius_m = 2.0;
        let step_m = 1e-5;
        let mut tried = 0;
        for path in [PathShape::Line, PathShape::Circle(radius_m), PathShape::eight(radius_m)] {
            let (start_m, heading_rad) = path.at(0.0);
            assert!(start_m.length() < 1e-15 && heading_rad == 0.0);
            let mut reach_m = 0.0;
            for k in 0..4_000_u32 {
                let way_m = 0.01 * f64::from(k) + 0.003;
                let (position_m, heading_rad) = path.at(way_m);
                let moved_m = path.at(way_m + step_m).0 - path.at(way_m - step_m).0;
                let ahead = DVec3::new(-libm::sin(heading_rad), 0.0, -libm::cos(heading_rad));
                // Curvature below 3 /m bends the chord by 2e-5^2 * 3^2 / 24 of itself; roundings are 40 * 2^-53 / 2e-5.
                assert!((moved_m / (2.0 * step_m) - ahead).length() < 1e-9, "{path:?} at {way_m}");
                let middle_m = match &path {
                    PathShape::Line => DVec3::ZERO,
                    PathShape::Circle(radius_m) => DVec3::new(-radius_m, 0.0, 0.0),
                    PathShape::Loop(eight) => eight.middle_m(),
                };
                reach_m = num::greater(reach_m, (position_m - middle_m).length());
                tried += 1;
            }
            // The line leads away; the others reach their radius and no further (samples of 1 cm, curvature of 1 /m).
            let is_closed = path != PathShape::Line;
            assert!(!is_closed || (reach_m <= radius_m * (1.0 + 1e-12) && reach_m > radius_m - 1e-3), "{reach_m}");
        }
        assert_eq!(tried, 12_000);
    }
}
