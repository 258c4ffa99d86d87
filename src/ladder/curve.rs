//! Interpolates a figure along a knob from a few measured points, and finds where it reaches a bound.
//!
//! Errors and times are nearly powers of a tolerance over short ways, so everything is straight in logarithms. Luck of
//! single pixels may turn two neighbours round; they then share their mean.

use crate::num::{f64_from_usize, greater, lesser};

/// Points by growing abscissa; figures grow with it.
pub struct Curve {
    /// Logarithms of abscissa and figure.
    points: Vec<[f64; 2]>,
}

/// Power that is taken for granted where one point alone stands: variance is in proportion to a tolerance.
const POWER: f64 = 1.0;
/// Beyond the points a bound is looked for at most so far away, as a factor.
const REACH: f64 = 4.0;
/// Figures below this are as good as none.
const LEAST: f64 = 1e-12;

impl Curve {
    /// Abscissas and figures, both above 0; in any order.
    pub fn new(points: impl Iterator<Item = (f64, f64)>) -> Self {
        let log = |value: f64| libm::log(greater(value, LEAST));
        let mut points: Vec<[f64; 2]> = points.map(|(abscissa, figure)| [log(abscissa), log(figure)]).collect();
        points.sort_by(|a, b| a[0].total_cmp(&b[0]));
        Self { points }
    }

    /// With figures that never fall as abscissas grow: neighbours that do share their mean (pool adjacent violators, Ayer et al. 1955).
    #[must_use]
    pub fn growing(mut self) -> Self {
        // Sum and number of each block of equal figures.
        let mut blocks: Vec<(f64, usize)> = Vec::new();
        for point in &self.points {
            blocks.push((point[1], 1));
            while let [.., before, last] = blocks[..] {
                if before.0 * f64_from_usize(last.1) <= last.0 * f64_from_usize(before.1) {
                    break;
                }
                blocks.truncate(blocks.len() - 2);
                blocks.push((before.0 + last.0, before.1 + last.1));
            }
        }
        let pooled = blocks.iter().flat_map(|&(sum, count)| std::iter::repeat_n(sum / f64_from_usize(count), count));
        self.points.iter_mut().zip(pooled).for_each(|(point, figure)| point[1] = figure);
        self
    }

    /// The greatest abscissa whose figure keeps a bound: between points as straight as possible, beyond them as far as a power of one
    /// leads, but no farther than a factor of four. None without points.
    pub fn reaches(&self, bound: f64) -> Option<f64> {
        let bound = libm::log(greater(bound, LEAST));
        let (first, last) = (self.points.first()?, self.points.last()?);
        let beyond = |point: &[f64; 2]| {
            let far = libm::log(REACH);
            point[0] + greater(-far, lesser(far, (bound - point[1]) / POWER))
        };
        if bound < first[1] {
            return Some(libm::exp(beyond(first)));
        }
        let below = self.points.iter().rposition(|point| point[1] <= bound)?;
        let Some(next) = self.points.get(below + 1) else { return Some(libm::exp(beyond(last))) };
        let here = self.points[below];
        let share = (bound - here[1]) / (next[1] - here[1]);
        Some(libm::exp(here[0] + share * (next[0] - here[0])))
    }

    /// The figure at an abscissa; beyond the points it is that of the nearest, times this power of the way.
    pub fn at(&self, abscissa: f64, power: f64) -> f64 {
        let abscissa = libm::log(greater(abscissa, LEAST));
        let (Some(first), Some(last)) = (self.points.first(), self.points.last()) else { return f64::INFINITY };
        let beyond = |point: &[f64; 2]| libm::exp(point[1] + power * (abscissa - point[0]));
        if abscissa <= first[0] {
            return beyond(first);
        }
        let Some(next) = self.points.iter().position(|point| point[0] >= abscissa) else { return beyond(last) };
        let (here, next) = (self.points[next - 1], self.points[next]);
        let share = (abscissa - here[0]) / (next[0] - here[0]);
        libm::exp(here[1] + share * (next[1] - here[1]))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Exact for powers, but for roundings of a dozen operations in f64.
    #[test]
    fn a_power_is_met_exactly_within_and_beyond_its_points() {
        let curve = Curve::new([(0.1, 0.3), (0.4, 1.2), (1.6, 4.8)].into_iter());
        for bound in [0.15, 0.3, 0.7, 2.0, 4.8, 9.0] {
            let abscissa = curve.reaches(bound).unwrap();
            assert!((abscissa * 3.0 / bound - 1.0).abs() < 1e-12, "{bound}: {abscissa}");
            assert!((curve.at(abscissa, 1.0) / bound - 1.0).abs() < 1e-12);
        }
        assert!((curve.reaches(1e-9).unwrap() - 0.1 / 4.0).abs() < 1e-12, "no farther than a factor of four");
        assert!((curve.reaches(1e9).unwrap() - 1.6 * 4.0).abs() < 1e-12);
    }

    #[test]
    fn luck_of_one_point_is_shared_with_its_neighbour() {
        let points = [(1.0, 2.0), (2.0, 1.0), (4.0, 8.0)];
        let curve = Curve::new(points.into_iter()).growing();
        // At 1 and 2 the figure counts as their mean in logarithms, sqrt(2), which the bound meets at 2 just so; half of it leads to 0.5.
        assert!((curve.reaches(0.5 * 2.0_f64.sqrt()).unwrap() - 0.5).abs() < 1e-12);
        assert!((curve.reaches(1.000_001 * 2.0_f64.sqrt()).unwrap() - 2.0).abs() < 1e-5);
        assert!((curve.at(4.0, 1.0) - 8.0).abs() < 1e-12, "what grows stays");
        assert!(Curve::new(std::iter::empty()).reaches(1.0).is_none());
    }
}
