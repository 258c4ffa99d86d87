//! Kannala and Brandt's model with four terms (Kannala and Brandt 2006; OpenCV's fisheye, Kalibr's "equidistant"): the radius is
//! `a + k1 a^3 + k2 a^5 + k3 a^7 + k4 a^9` of the angle a off the axis. It passes 90 degrees like any other angle.

use super::radial::Radial;

/// The polynomial, and where it stops rising.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Kb4 {
    coefficients: [f64; 4],
    angle_max_rad: f64,
}

impl Kb4 {
    /// From k1, k2, k3, k4. Its domain ends where the polynomial stops rising, or opposite the axis.
    pub fn new(coefficients: [f64; 4]) -> Self {
        let [k1, k2, k3, k4] = coefficients;
        // The slope is a polynomial of the squared angle.
        let slope = [1.0, 3.0 * k1, 5.0 * k2, 7.0 * k3, 9.0 * k4];
        let most = core::f64::consts::PI * core::f64::consts::PI;
        let angle_max_rad = if coefficients.iter().all(|k| k.is_finite()) {
            roots(&slope, most).first().map_or(core::f64::consts::PI, |root| root.sqrt())
        } else {
            0.0
        };
        Self { coefficients, angle_max_rad }
    }

    /// k1, k2, k3, k4.
    pub fn coefficients(&self) -> [f64; 4] {
        self.coefficients
    }
}

impl Radial for Kb4 {
    fn angle_max_rad(&self) -> f64 {
        self.angle_max_rad
    }

    fn radius(&self, angle_rad: f64) -> (f64, f64) {
        let [k1, k2, k3, k4] = self.coefficients;
        let s = angle_rad * angle_rad;
        let radius = angle_rad * (1.0 + s * (k1 + s * (k2 + s * (k3 + s * k4))));
        let slope = 1.0 + s * (3.0 * k1 + s * (5.0 * k2 + s * (7.0 * k3 + s * (9.0 * k4))));
        (radius, slope)
    }
}

/// Arguments between 0 and `most` where a polynomial (lowest power first, finite, not 0 at 0) changes its sign or touches zero at a
/// turning point, rising. Between two roots of its derivative a polynomial is monotone, so each stretch holds one root at most.
fn roots(coefficients: &[f64], most: f64) -> Vec<f64> {
    if coefficients.len() < 2 {
        return Vec::new();
    }
    let derivative: Vec<f64> =
        coefficients.iter().zip(0_u32..).skip(1).map(|(c, power)| c * f64::from(power)).collect();
    let value = |at: f64| coefficients.iter().rev().fold(0.0, |sum, c| sum * at + c);
    let mut found: Vec<f64> = Vec::new();
    let mut start = 0.0;
    for end in roots(&derivative, most).into_iter().chain([most]) {
        if (value(start) > 0.0) != (value(end) > 0.0) {
            found.push(bisected(&value, start, end));
        }
        start = end;
    }
    found
}

/// The last number before a change of sign, to the last bit.
fn bisected(value: &dyn Fn(f64) -> f64, start: f64, end: f64) -> f64 {
    let is_positive = value(start) > 0.0;
    let (mut low, mut high) = (start, end);
    loop {
        let middle = 0.5 * (low + high);
        if middle <= low || middle >= high {
            return low;
        }
        if (value(middle) > 0.0) == is_positive {
            low = middle;
        } else {
            high = middle;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn roots_of_a_quartic_are_all_found() {
        // (s-1)(s-2)(s-3)(s-4): 24 - 50 s + 35 s^2 - 10 s^3 + s^4. Slopes at the roots are 6, 2, 2, 6; terms up to 280 round to 3e-14.
        let found = roots(&[24.0, -50.0, 35.0, -10.0, 1.0], 10.0);
        assert_eq!(found.len(), 4);
        for (root, exact) in found.iter().zip([1.0, 2.0, 3.0, 4.0]) {
            assert!((root - exact).abs() < 1e-12, "{root}");
        }
    }

    #[test]
    fn the_domain_ends_where_the_radius_stops_rising() {
        // a - 0.1 a^3 turns at a = sqrt(1 / 0.3).
        let kb4 = Kb4::new([-0.1, 0.0, 0.0, 0.0]);
        assert!((kb4.angle_max_rad() - (1.0_f64 / 0.3).sqrt()).abs() < 1e-15);
        assert_eq!(Kb4::new([0.0; 4]).angle_max_rad(), core::f64::consts::PI);
        assert_eq!(Kb4::new([f64::NAN, 0.0, 0.0, 0.0]).angle_max_rad(), 0.0);
    }
}
