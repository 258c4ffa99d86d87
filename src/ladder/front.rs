//! Pareto front of points of time and error: keeps those that no other point beats in both, within the resolution of the timings.

use crate::num::lesser;

/// Times that differ by a smaller share are one time: measured again, such settings change order, and the errors, which are the same bits
/// in every run, must say which of them stand on the front.
const APART: f64 = 0.02;

/// Indices of the points on the front, from the fastest to the best: from the best error on, the next that is faster by more than times
/// differ by chance. Of points that are equal in both the first counts.
pub fn front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| points[a].1.total_cmp(&points[b].1));
    let mut kept: Vec<usize> = Vec::new();
    for equal in order.chunk_by(|&a, &b| points[a].1 == points[b].1) {
        let least = equal.iter().fold(f64::INFINITY, |least, &at| lesser(least, points[at].0));
        let first = equal.iter().copied().find(|&at| points[at].0 <= least * (1.0 + APART));
        let slower = kept.last().map_or(f64::INFINITY, |&last| points[last].0);
        kept.extend(first.filter(|&at| points[at].0 < slower * (1.0 - APART)));
    }
    kept.reverse();
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::DrawKey;
    use rand::RngExt;

    /// Whatever is left out has a point on the front that is as good and, within what times differ by twice, as fast; and no two points of
    /// the front are one.
    #[test]
    fn the_front_is_what_no_point_beats() {
        let mut stream = DrawKey::root(7).stream();
        let mut tried = 0;
        for case in 0..200 {
            // Some errors are equal.
            let error = |x: f64| if case % 2 == 0 { x } else { (8.0 * x).floor() };
            let points: Vec<(f64, f64)> =
                (0..30).map(|_| (stream.random::<f64>(), error(stream.random::<f64>()))).collect();
            let found = front(&points);
            for (at, point) in points.iter().enumerate() {
                let as_good = |&other: &usize| {
                    points[other].1 <= point.1 && points[other].0 <= point.0 * (1.0 + APART) / (1.0 - APART)
                };
                assert!(found.iter().any(as_good), "{at} of {points:?}");
                tried += 1;
            }
            let is_step = |pair: &[usize]| {
                let (fast, good) = (points[pair[0]], points[pair[1]]);
                fast.0 < good.0 * (1.0 - APART) && good.1 < fast.1
            };
            assert!(found.windows(2).all(is_step), "{found:?} of {points:?}");
        }
        assert_eq!(tried, 6000);
    }

    /// Renders that differ by a tenth in time, each with four tolerances of effects that differ by a thousandth: times that are measured
    /// again, 0.3 % off, leave the same front.
    #[test]
    fn the_front_does_not_follow_the_noise_of_times() {
        let mut stream = DrawKey::root(8).stream();
        for _ in 0..200 {
            let mut measured = || {
                let point = |number: i32| {
                    let (render, effects) = (f64::from(number / 4), f64::from(number % 4));
                    let time = 100.0 * libm::pow(1.1, render) * (1.0 + 0.001 * effects);
                    let off = 1.0 + 0.003 * (2.0 * stream.random::<f64>() - 1.0);
                    (time * off, libm::pow(0.9, render) * (1.0 + 0.1 * libm::pow(0.1, effects)))
                };
                (0..40).map(point).collect::<Vec<_>>()
            };
            let (once, again) = (measured(), measured());
            assert_eq!(front(&once), front(&again));
            assert_eq!(front(&once).len(), 10, "one of each render");
        }
    }

    #[test]
    fn equal_points_stand_once() {
        assert_eq!(front(&[(1.0, 1.0), (1.0, 1.0), (2.0, 1.0), (1.0, 2.0)]), [0]);
        assert_eq!(front(&[]), [0; 0]);
    }
}
