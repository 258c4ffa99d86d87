//! Safety margin for a mean error that was measured on a few frames of a run, from the spread of their squared errors.
//!
//! The frames are a systematic sample: they are evenly spaced, and the view changes slowly. So the error of their mean follows
//! from the differences of neighbours (J. von Neumann et al., "The mean square successive difference", 1941); a common trend
//! adds no variance. A finite-population correction accounts for the frames that were measured.

use super::errors::Squares;
use crate::num::{f64_from_usize, greater, index, lesser, u32_truncated};

/// Quantiles of Student's t at 95 %, one-sided, for 1 to 14 degrees of freedom.
const STUDENT_95: [f64; 14] =
    [6.314, 2.920, 2.353, 2.132, 2.015, 1.943, 1.895, 1.860, 1.833, 1.812, 1.796, 1.782, 1.771, 1.761];

/// What the mean square of all pictures of the run lies above that of these frames in one case of twenty at most. Of a single frame
/// nothing is known.
pub fn hidden(errors: &[Squares], pictures: u64) -> f64 {
    let squares: Vec<f64> = errors.iter().map(|one| one.mean()).collect();
    if squares.len() < 2 {
        return 0.0;
    }
    let count = f64_from_usize(squares.len());
    let steps: f64 = squares.windows(2).map(|pair| (pair[1] - pair[0]) * (pair[1] - pair[0])).sum();
    let variance = steps / (2.0 * (count - 1.0));
    let unseen = greater(1.0 - count / crate::num::f64_from_u64(pictures), 0.0);
    student_95(squares.len()) * (unseen * variance / count).sqrt()
}

/// Of a variance from differences of neighbours, whose own variance is (3n - 4) / (n - 1)^2 sigma^4: so it has 2 (n - 1)^2 / (3n - 4)
/// degrees of freedom. Between whole ones quantiles go as the inverse of their number nearly, to 0.004 from 2 on.
fn student_95(frames: usize) -> f64 {
    let frames = f64_from_usize(frames);
    let freedom = 2.0 * (frames - 1.0) * (frames - 1.0) / (3.0 * frames - 4.0);
    let most = f64_from_usize(STUDENT_95.len());
    let freedom = lesser(greater(freedom, 1.0), most);
    let below = u32_truncated(lesser(freedom, most - 1.0));
    let [from, to] = [below - 1, below].map(|at| STUDENT_95[index(at)]);
    let below = f64::from(below);
    // 1 / below at 0, 1 / (below + 1) at 1.
    let way = (1.0 / below - 1.0 / freedom) * below * (below + 1.0);
    from + (to - from) * way
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::DrawKey;
    use rand::RngExt;

    fn frames(values: &[f64]) -> Vec<Squares> {
        values.iter().map(|&sum| Squares { sum, pixels: 1 }).collect()
    }

    #[test]
    fn quantiles_between_whole_degrees_of_freedom_are_students_own() {
        // Two frames have one degree (2 / 2) and eight 98 / 20 = 4.9, whose quantile is 2.0242 (by numerical integration of the density).
        assert_eq!(student_95(2), 6.314);
        assert!((student_95(8) - 2.0242).abs() < 0.004, "{}", student_95(8));
        assert!((student_95(100) - 1.761).abs() < 1e-9);
        assert!((3..60).all(|frames| student_95(frames) <= student_95(frames - 1)));
    }

    #[test]
    fn pictures_that_were_all_seen_hide_nothing() {
        assert_eq!(hidden(&frames(&[1.0, 2.0, 3.0]), 3), 0.0);
        assert_eq!(hidden(&frames(&[1.0]), 100), 0.0);
        assert_eq!(hidden(&frames(&[2.0, 2.0, 2.0]), 100), 0.0);
        // Two of 4: one degree of freedom, variance (1 - 3)^2 / 2 = 2, half of the run unseen.
        assert!((hidden(&frames(&[1.0, 3.0]), 4) - 6.314 * (0.5_f64 * 2.0 / 2.0).sqrt()).abs() < 1e-12);
    }

    /// 4,000 runs of independent frames, of which one in twenty may lie above: 0.05, and three standard errors, 0.0103. Less than 0.03
    /// would be idle.
    #[test]
    fn one_mean_in_twenty_lies_above_what_is_added() {
        let mut stream = DrawKey::root(5).stream();
        for count in [5, 8, 12] {
            let (mut above, tried) = (0, 4000);
            for _ in 0..tried {
                // A sum of twelve uniforms is nearly normal; its mean is 6.
                let values: Vec<f64> =
                    (0..count).map(|_| (0..12).map(|_| stream.random::<f64>()).sum::<f64>()).collect();
                let mean = values.iter().sum::<f64>() / f64_from_usize(count);
                above += usize::from(6.0 > mean + hidden(&frames(&values), 1_000_000));
            }
            let share = f64_from_usize(above) / f64_from_usize(tried);
            println!("{count} frames: {share}");
            assert!((0.03..=0.0603).contains(&share), "{count} frames: {share}");
        }
    }
}
