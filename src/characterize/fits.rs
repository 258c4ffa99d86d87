//! Straight lines by least squares, as EMVA 1288 prescribes for each figure.

/// Slope of the line through the origin.
pub fn through_origin(points: impl Iterator<Item = (f64, f64)>) -> f64 {
    let (xy, xx) = points.fold((0.0, 0.0), |(xy, xx), (x, y)| (xy + x * y, xx + x * x));
    xy / xx
}

/// Slope and offset.
pub fn line(points: &[(f64, f64)]) -> (f64, f64) {
    let count = crate::num::f64_from_usize(points.len());
    let mean = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>() / count;
    let (mean_x, mean_y) = (mean(&|point| point.0), mean(&|point| point.1));
    let xx = points.iter().map(|(x, _)| (x - mean_x) * (x - mean_x)).sum::<f64>();
    let xy = points.iter().map(|(x, y)| (x - mean_x) * (y - mean_y)).sum::<f64>();
    let slope = xy / xx;
    (slope, mean_y - slope * mean_x)
}

/// Standard errors of slope and offset for points of equal standard error 1.
pub fn line_errors(x: impl Iterator<Item = f64> + Clone) -> (f64, f64) {
    let count = crate::num::f64_from_usize(x.clone().count());
    let mean = x.clone().sum::<f64>() / count;
    let xx: f64 = x.map(|x| (x - mean) * (x - mean)).sum();
    (1.0 / xx.sqrt(), (1.0 / count + mean * mean / xx).sqrt())
}

/// Slope and offset of the line of least relative deviation: weights 1 / y^2 (release 4.0, section 6.7, linearity).
pub fn relative_line(points: &[(f64, f64)]) -> (f64, f64) {
    let sum = |of: &dyn Fn(f64, f64) -> f64| points.iter().map(|&(x, y)| of(x, y)).sum::<f64>();
    let xy = sum(&|x, y| x / y);
    let xy2 = sum(&|x, y| x / (y * y));
    let x2y2 = sum(&|x, y| (x / y) * (x / y));
    let (y1, y2) = (sum(&|_, y| 1.0 / y), sum(&|_, y| 1.0 / (y * y)));
    let offset = (xy * xy2 - x2y2 * y1) / (xy2 * xy2 - x2y2 * y2);
    ((xy - offset * xy2) / x2y2, offset)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_is_found_again() {
        let points: Vec<(f64, f64)> = (1..20).map(f64::from).map(|x| (x, 3.0 * x + 2.0)).collect();
        let (slope, offset) = line(&points);
        assert!((slope - 3.0).abs() < 1e-12 && (offset - 2.0).abs() < 1e-11);
        let (slope, offset) = relative_line(&points);
        assert!((slope - 3.0).abs() < 1e-11 && (offset - 2.0).abs() < 1e-10);
        assert!((through_origin(points.iter().map(|&(x, _)| (x, 3.0 * x))) - 3.0).abs() < 1e-12);
    }

    #[test]
    fn errors_of_a_line_are_those_of_the_textbook() {
        // Two points at 0 and 1: slope has variance 2, offset that of the first point.
        let (slope, offset) = line_errors([0.0, 1.0].into_iter());
        assert!((slope - 2.0_f64.sqrt()).abs() < 1e-12 && (offset - 1.0).abs() < 1e-12);
    }
}
