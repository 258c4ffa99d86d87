//! A measured mapping: a radius for each field angle, as lens makers publish it. Between its points it follows the monotone cubic of
//! Fritsch and Butland (1984; "PCHIP"), whose slope is continuous, so the projection's Jacobian is as well.

use super::radial::Radial;
use crate::error::Error;

/// Points of a table beside the axis.
pub const TABLE_POINTS_MAX: usize = 64;

/// Points and slopes; the first is the axis.
const KNOTS_MAX: usize = TABLE_POINTS_MAX + 1;

/// Radius (in any unit, of which the intrinsics say how many pixels it is) against the angle off the axis.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct RadiusTable {
    /// Knots in use, the axis included.
    count: usize,
    angles_rad: [f64; KNOTS_MAX],
    radii: [f64; KNOTS_MAX],
    slopes: [f64; KNOTS_MAX],
}

impl RadiusTable {
    /// From points (angle in radians, radius), both rising from above 0. The axis, 0 at 0, is taken as known and may be the first. Fails
    /// on no or more than [`TABLE_POINTS_MAX`] points; angles or radii that do not rise, or angles beyond pi.
    pub fn new(points: &[(f64, f64)]) -> Result<Self, Error> {
        let refused = |value: String, reason: &str| Err(Error::key("optics.table", value, reason));
        let points = if points.first() == Some(&(0.0, 0.0)) { &points[1..] } else { points };
        if points.is_empty() || points.len() > TABLE_POINTS_MAX {
            return refused(format!("{} points", points.len()), "use 1 to 64 points beside the axis");
        }
        let mut table = Self {
            count: points.len() + 1,
            angles_rad: [0.0; KNOTS_MAX],
            radii: [0.0; KNOTS_MAX],
            slopes: [0.0; KNOTS_MAX],
        };
        for (knot, &(angle_rad, radius)) in points.iter().enumerate() {
            let rises = angle_rad > table.angles_rad[knot] && radius > table.radii[knot];
            if !(rises && angle_rad <= core::f64::consts::PI && radius.is_finite()) {
                let value = format!("[{}, {radius}]", angle_rad.to_degrees());
                return refused(value, "use angles and radii that both rise, to 180 degrees at most");
            }
            (table.angles_rad[knot + 1], table.radii[knot + 1]) = (angle_rad, radius);
        }
        for knot in 0..table.count {
            table.slopes[knot] = table.slope_at(knot);
        }
        Ok(table)
    }

    /// Points beside the axis: angle in radians, radius.
    pub fn points(&self) -> impl Iterator<Item = (f64, f64)> + '_ {
        (1..self.count).map(|knot| (self.angles_rad[knot], self.radii[knot]))
    }

    /// Radius of a radian at the axis.
    pub fn axial_slope(&self) -> f64 {
        self.slopes[0]
    }

    /// Width of a stretch and its mean slope.
    fn stretch(&self, from: usize) -> (f64, f64) {
        let width = self.angles_rad[from + 1] - self.angles_rad[from];
        (width, (self.radii[from + 1] - self.radii[from]) / width)
    }

    /// Slope at a knot: between two stretches their weighted harmonic mean; at the axis, whose other side is its mirror image, that of
    /// the first stretch; at the end the parabola through the last three knots, not below 0 nor above three times the last stretch's.
    fn slope_at(&self, knot: usize) -> f64 {
        if knot == 0 || self.count == 2 {
            return self.stretch(0).1;
        }
        let (before, slope_before) = self.stretch(if knot + 1 == self.count { knot - 2 } else { knot - 1 });
        let (after, slope_after) = self.stretch(if knot + 1 == self.count { knot - 1 } else { knot });
        if knot + 1 == self.count {
            let slope = ((2.0 * after + before) * slope_after - after * slope_before) / (after + before);
            return slope.clamp(0.0, 3.0 * slope_after);
        }
        let (first, second) = (2.0 * after + before, after + 2.0 * before);
        (first + second) / (first / slope_before + second / slope_after)
    }
}

impl Radial for RadiusTable {
    fn angle_max_rad(&self) -> f64 {
        self.angles_rad[self.count - 1]
    }

    fn radius(&self, angle_rad: f64) -> (f64, f64) {
        let knots = &self.angles_rad[1..self.count - 1];
        let from = knots.partition_point(|&knot| knot <= angle_rad);
        let (width, mean) = self.stretch(from);
        let (start, end) = (self.slopes[from], self.slopes[from + 1]);
        let t = (angle_rad - self.angles_rad[from]) / width;
        // Hermite's cubic in powers of t.
        let (square, cube) = (3.0 * mean - 2.0 * start - end, start + end - 2.0 * mean);
        let radius = self.radii[from] + width * t * (start + t * (square + t * cube));
        (radius, start + t * (2.0 * square + t * (3.0 * cube)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cubic_meets_its_points_and_stays_monotone_between_them() {
        let points = [(0.2, 0.3), (0.5, 0.5), (0.6, 2.0), (1.9, 2.1)];
        let table = RadiusTable::new(&points).unwrap();
        for (angle_rad, radius) in points {
            // The last is met from the stretch before it: a few roundings of 2.
            assert!((table.radius(angle_rad).0 - radius).abs() < 2e-15, "{angle_rad}");
        }
        let mut last = -1.0;
        for step in 0..=1900_u32 {
            let (radius, slope) = table.radius(f64::from(step) * 1e-3);
            assert!(radius > last && slope >= 0.0, "{step}");
            last = radius;
        }
        for knot in [0.2_f64, 0.5, 0.6] {
            let (before, after) = (table.radius(knot.next_down()).1, table.radius(knot).1);
            // Second derivatives here are below 1e4, a step of 1e-16 changes the slope by less than rounding of values up to 50.
            assert!((before - after).abs() < 1e-12, "{knot}: {before} {after}");
        }
    }

    #[test]
    fn what_does_not_rise_is_refused() {
        for points in [
            &[][..],
            &[(0.0, 0.0)],
            &[(0.2, 0.3), (0.2, 0.4)],
            &[(0.2, 0.3), (0.3, 0.3)],
            &[(0.2, f64::NAN)],
            &[(3.2, 1.0)],
            &[(-0.1, 1.0)],
        ] {
            assert!(RadiusTable::new(points).is_err(), "{points:?}");
        }
        assert!(RadiusTable::new(&[(0.0, 0.0), (0.5, 1.0)]).is_ok());
    }
}
