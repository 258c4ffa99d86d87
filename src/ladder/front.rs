//! The Pareto front. Enters: points of time and error. Leaves: those that no other point beats in both.

/// Places of the points on the front, from the fastest to the best. Of points that are equal in both the first counts.
pub fn front(points: &[(f64, f64)]) -> Vec<usize> {
    let mut order: Vec<usize> = (0..points.len()).collect();
    order.sort_by(|&a, &b| points[a].0.total_cmp(&points[b].0).then(points[a].1.total_cmp(&points[b].1)));
    let mut kept: Vec<usize> = Vec::new();
    for place in order {
        if kept.last().is_none_or(|&last| points[place].1 < points[last].1) {
            kept.push(place);
        }
    }
    kept
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::{DrawKey, uniform_f64};

    /// By the definition: a point is on the front when no other is at least as good in both and better in one.
    #[test]
    fn the_front_is_what_no_point_beats() {
        let mut stream = DrawKey::root(7).stream();
        let mut tried = 0;
        for _ in 0..200 {
            let points: Vec<(f64, f64)> =
                (0..30).map(|_| (uniform_f64(&mut stream), uniform_f64(&mut stream))).collect();
            let found = front(&points);
            for (place, point) in points.iter().enumerate() {
                let beaten = points
                    .iter()
                    .any(|other| other.0 <= point.0 && other.1 <= point.1 && (other.0 < point.0 || other.1 < point.1));
                assert_eq!(found.contains(&place), !beaten, "{place} of {points:?}");
                tried += 1;
            }
            assert!(found.windows(2).all(|pair| points[pair[0]].0 < points[pair[1]].0));
        }
        assert_eq!(tried, 6000);
    }

    #[test]
    fn equal_points_stand_once() {
        assert_eq!(front(&[(1.0, 1.0), (1.0, 1.0), (2.0, 1.0), (1.0, 2.0)]), [0]);
        assert_eq!(front(&[]), [0; 0]);
    }
}
