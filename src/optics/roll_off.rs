//! Roll-off and mechanical vignetting. Computes the relative irradiance from the cosine of the angle to the axis, by a law, a measured
//! table, or a clipped pupil. Everything is radially symmetric.

use glam::DVec3;

use super::lens::Lens;
use crate::error::Error;
use crate::num::{f32_nearest, f64_from_usize, greater, index, lesser, u32_truncated_f32};

/// How light falls towards the corners, by law.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum RollOff {
    /// The fourth power of the cosine between the bearing and the axis: a flat pupil seen from aside, and a pixel of a pinhole's plane.
    /// Nothing from 90 degrees on, where a flat pupil is seen from its edge.
    Cos4,
    /// The solid angle that a pixel takes at the bearing over that on the axis: a pupil that turns to face its field, as those of
    /// wide-angle lenses do. `sin a / a` for a lens whose radius is the angle, `cos^3` for a pinhole.
    SolidAngle,
    /// Even.
    None,
}

/// A pixel that a distortion squeezes takes more light than one on the axis; at the rim where a mapping folds the ratio has no bound.
const SHARE_MAX: f64 = 4.0;

/// Stretches of the table over the cosine. Laws are smooth in the cosine, so a line between points is off by less than 1e-6 of the axis'
/// light, and by less than 1e-4 where a pupil begins to be clipped.
const STRETCHES: usize = 4096;

/// The share of light for every bearing.
#[derive(Clone, Debug, PartialEq)]
pub struct Shading {
    law: Law,
    /// Cosine of the angle from which on nothing comes through.
    cos_dark: f64,
}

#[derive(Clone, Debug, PartialEq)]
enum Law {
    Cos4,
    Even,
    /// Shares at equal steps of the cosine from -1 to 1.
    Steps(Vec<f32>),
}

impl Shading {
    /// A law, for a lens.
    pub fn of(roll_off: RollOff, lens: &Lens) -> Self {
        let law = match roll_off {
            RollOff::Cos4 => Law::Cos4,
            RollOff::None => Law::Even,
            RollOff::SolidAngle => {
                let on_axis = lens.solid_angle_per_px2(DVec3::Z).unwrap_or(1.0);
                let share = |cos: f64| {
                    let bearing = DVec3::new((1.0 - cos * cos).sqrt(), 0.0, cos);
                    let share = lens.solid_angle_per_px2(bearing).map_or(0.0, |angle| angle / on_axis);
                    if share > SHARE_MAX { SHARE_MAX } else { share }
                };
                Law::Steps(steps(&share))
            }
        };
        Self { law, cos_dark: -2.0 }
    }

    /// A measured table of (angle off the axis in radians, share of the axis' light), from the axis outwards, with a monotone cubic
    /// between its points where the shares fall, a line where they do not, and the last share beyond. Fails on fewer than two points, a
    /// first one off the axis, angles that do not rise or pass pi, shares outside 0 to 4.
    pub fn measured(points: &[(f64, f64)]) -> Result<Self, Error> {
        let refused = |value: String, reason: &str| Err(Error::key("optics.roll_off_table", value, reason));
        if points.len() < 2 || points[0].0 != 0.0 {
            return refused(format!("{} points", points.len()), "use two or more points from 0 degrees on");
        }
        for pair in points.windows(2) {
            if !(pair[1].0 > pair[0].0 && pair[1].0 <= core::f64::consts::PI) {
                return refused(pair[1].0.to_degrees().to_string(), "use rising angles, to 180 degrees");
            }
        }
        if let Some((_, share)) = points.iter().find(|(_, share)| !(0.0..=SHARE_MAX).contains(share)) {
            return refused(share.to_string(), "use shares from 0 to 4 of the axis' light");
        }
        let between = |cos: f64| interpolated(points, libm::acos(cos));
        Ok(Self { law: Law::Steps(steps(&between)), cos_dark: -2.0 })
    }

    /// The same lens with its pupil clipped by a stop: light falls from whole at `start_rad` off the axis to none at `end_rad`,
    /// as the part of a disc that a straight edge leaves while it moves across evenly. The edge represents the rim of a stop much
    /// larger than the pupil.
    #[must_use]
    pub fn vignetted(self, start_rad: f64, end_rad: f64) -> Self {
        let clipped = |cos: f64| {
            let across = (2.0 * (libm::acos(cos) - start_rad) / (end_rad - start_rad) - 1.0).clamp(-1.0, 1.0);
            let left = (libm::acos(across) - across * (1.0 - across * across).sqrt()) / core::f64::consts::PI;
            f64::from(self.share_at(f32_nearest(cos))) * left
        };
        Self { law: Law::Steps(steps(&clipped)), cos_dark: libm::cos(end_rad) }
    }

    /// Whether nothing comes through from a cosine.
    pub(super) fn is_dark_at(&self, cos: f64) -> bool {
        cos <= self.cos_dark
    }

    /// Share of light that is left for a cosine to the axis.
    #[inline(always)]
    pub(super) fn share_at(&self, cos: f32) -> f32 {
        match &self.law {
            Law::Cos4 => {
                let cos = if cos > 0.0 { cos } else { 0.0 };
                (cos * cos) * (cos * cos)
            }
            Law::Even => 1.0,
            Law::Steps(shares) => {
                let (from, beyond) = stretch_of(cos);
                shares[from] + (shares[from + 1] - shares[from]) * beyond
            }
        }
    }

    /// Least and greatest share over cosines from `least` to `greatest`.
    pub(super) fn bounds(&self, least: f32, most: f32) -> [f64; 2] {
        let ends = [self.share_at(least), self.share_at(most)].map(f64::from);
        let mut bounds = [lesser(ends[0], ends[1]), greater(ends[0], ends[1])];
        // The laws are monotone; a table is a line between its steps.
        if let Law::Steps(shares) = &self.law {
            for &share in &shares[stretch_of(least).0 + 1..=stretch_of(most).0] {
                bounds = [lesser(bounds[0], share.into()), greater(bounds[1], share.into())];
            }
        }
        bounds
    }
}

/// Stretch of a cosine, and how far into it.
#[inline(always)]
fn stretch_of(cos: f32) -> (usize, f32) {
    let position = (cos + 1.0) * 2048.0;
    let position = if position > 0.0 { position } else { 0.0 };
    let from = index(u32_truncated_f32(position)).min(STRETCHES - 1);
    let beyond = position - crate::num::f32_from_u32(crate::num::u32_from(from));
    (from, if beyond < 1.0 { beyond } else { 1.0 })
}

fn steps(share: &dyn Fn(f64) -> f64) -> Vec<f32> {
    const { assert!(STRETCHES == 2 * 2048) };
    (0..=STRETCHES).map(|step| f32_nearest(share(f64_from_usize(step) / 2048.0 - 1.0))).collect()
}

/// Shares between measured points: even in the angle, so flat at the axis; a cubic from point to point with slopes that keep it within its
/// two points (Fritsch and Butland, as the mapping's table has them).
fn interpolated(points: &[(f64, f64)], angle_rad: f64) -> f64 {
    let last = points.len() - 1;
    let to = points.partition_point(|point| point.0 <= angle_rad);
    if to > last {
        return points[last].1;
    }
    let mean = |from: usize| (points[from + 1].1 - points[from].1) / (points[from + 1].0 - points[from].0);
    let slope = |knot: usize| {
        if knot == 0 || knot == last {
            return if knot == 0 { 0.0 } else { mean(last - 1) };
        }
        let (before, after) = (points[knot].0 - points[knot - 1].0, points[knot + 1].0 - points[knot].0);
        let (first, second) = (2.0 * after + before, after + 2.0 * before);
        let (left, right) = (mean(knot - 1), mean(knot));
        if left * right > 0.0 { (first + second) / (first / left + second / right) } else { 0.0 }
    };
    let (width, mean) = (points[to].0 - points[to - 1].0, mean(to - 1));
    let (start, end) = (slope(to - 1), slope(to));
    let t = (angle_rad - points[to - 1].0) / width;
    points[to - 1].1 + width * t * (start + t * (3.0 * mean - 2.0 * start - end + t * (start + end - 2.0 * mean)))
}

#[cfg(test)]
mod tests {
    use super::super::lens::{Kb4, Mapping};
    use super::*;
    use crate::units::Size;

    const SIZE: Size = Size { width_px: 64, height_px: 48 };

    #[test]
    fn a_turning_pupil_leaves_the_pixels_solid_angle() {
        let pinhole = Shading::of(RollOff::SolidAngle, &Lens::pinhole(SIZE, 1.5));
        let fisheye = Lens::spanning(SIZE, Mapping::Kb4(Kb4::new([0.0; 4])), 3.3).unwrap();
        let fisheye = Shading::of(RollOff::SolidAngle, &fisheye);
        let mut tried = 0;
        for step in 1..=100_u32 {
            let angle_rad = 0.018 * f64::from(step);
            let cos = libm::cos(angle_rad);
            // Lines over 1/2048 of the cosine are off by its square over 8 (3e-8) times the second derivative (below 10); f32 adds 1e-7.
            let share = f64::from(fisheye.share_at(f32_nearest(cos)));
            assert!((share - libm::sin(angle_rad) / angle_rad).abs() < 1e-6, "{angle_rad}: {share}");
            let share = f64::from(pinhole.share_at(f32_nearest(cos)));
            let expected = if cos > 0.0 { cos * cos * cos } else { 0.0 };
            assert!((share - expected).abs() < 1e-6, "{angle_rad}: {share}");
            tried += 1;
        }
        assert_eq!(tried, 100);
    }

    #[test]
    fn a_clipped_pupil_is_whole_half_and_gone_where_it_should_be() {
        let shading = Shading::of(RollOff::None, &Lens::pinhole(SIZE, 1.5)).vignetted(0.5, 1.5);
        for (angle_rad, expected) in [(0.0, 1.0), (0.49, 1.0), (1.0, 0.5), (1.51, 0.0)] {
            // The table's own error where clipping begins.
            let share = f64::from(shading.share_at(f32_nearest(libm::cos(angle_rad))));
            assert!((share - expected).abs() < 1e-4, "{angle_rad}: {share}");
        }
        assert!(shading.is_dark_at(libm::cos(1.5001)) && !shading.is_dark_at(libm::cos(1.4999)));
    }

    #[test]
    fn a_table_returns_its_points_and_bounds_what_lies_between() {
        let points = [(0.0, 1.0), (0.5, 0.9), (1.0, 0.95), (1.7, 0.3)];
        let shading = Shading::measured(&points).unwrap();
        for (angle_rad, expected) in points {
            // A kink of the slope at a point (1 per radian at most) is cut over half a step of the cosine, 2.5e-4 / sin(0.5).
            let share = f64::from(shading.share_at(f32_nearest(libm::cos(angle_rad))));
            assert!((share - expected).abs() < 6e-4, "{angle_rad}: {share}");
        }
        let (least, most) = (f32_nearest(libm::cos(1.2)), f32_nearest(libm::cos(0.2)));
        let bounds = shading.bounds(least, most);
        let mut tried = 0;
        for step in 0..=10_000_u16 {
            let cos = least + (most - least) * f32::from(step) / 10_000.0;
            let share = f64::from(shading.share_at(cos));
            // One rounding of f32 between the line and its ends.
            assert!(share >= bounds[0] - 1e-7 && share <= bounds[1] + 1e-7);
            tried += 1;
        }
        assert!(tried > 10_000 && bounds[0] < 0.9);
        for wrong in
            [&[(0.0, 1.0)][..], &[(0.1, 1.0), (0.2, 1.0)], &[(0.0, 1.0), (0.0, 0.5)], &[(0.0, 1.0), (1.0, -0.1)]]
        {
            assert!(Shading::measured(wrong).is_err(), "{wrong:?}");
        }
    }

    #[test]
    fn cos4_ends_at_the_camera_plane() {
        let shading = Shading::of(RollOff::Cos4, &Lens::pinhole(SIZE, 1.5));
        assert_eq!([-0.5, -0.0, 0.0, 1.0].map(|cos| shading.share_at(cos)), [0.0, 0.0, 0.0, 1.0]);
    }
}
