//! The prior that unknowns leave behind: it says of the poses what the whole information says once the other unknowns are free.

use nalgebra::{SMatrix, SVector};
use sensel::draw::DrawKey;
use sensel::num::u64_from;
use sensel::tracker::lie::{Twist, se3_exp};
use sensel::tracker::marginal::Prior;

use super::normal;

/// Unknowns of two poses, and others.
const POSES: usize = 12;
const OTHERS: usize = 5;
const ALL: usize = POSES + OTHERS;
const ROWS: usize = 60;

fn numbers<const R: usize, const C: usize>(key: DrawKey) -> SMatrix<f64, R, C> {
    SMatrix::from_fn(|row, column| normal(key.with(u64_from(row)).with(u64_from(column))))
}

#[test]
fn a_prior_says_what_the_schur_complement_says_and_nothing_of_a_direction_without_information() {
    for seed in 1..=20 {
        let key = DrawKey::root(seed);
        let mut jacobian = numbers::<ROWS, ALL>(key.with(1));
        // Nothing measures the third unknown of the second pose.
        jacobian.column_mut(8).fill(0.0);
        let information = jacobian.tr_mul(&jacobian);
        let right: SVector<f64, ALL> = jacobian.tr_mul(&numbers::<ROWS, 1>(key.with(2)));
        let twist =
            |number: u64| Twist::from_array(std::array::from_fn(|k| 0.3 * normal(key.with(number).with(u64_from(k)))));
        let poses = [se3_exp(twist(3)), se3_exp(twist(4))];
        let whole = (information.transpose().as_slice().to_vec(), right.as_slice().to_vec());
        let prior = Prior::of_information(vec![(0, poses[0]), (1, poses[1])], POSES, whole).unwrap();
        let (mut matrix, mut rhs) = ([0.0; POSES * POSES], [0.0; POSES]);
        prior.add_to(&poses, &mut matrix, &mut rhs);

        let coupling = information.fixed_view::<POSES, OTHERS>(0, POSES);
        let gain = coupling * information.fixed_view::<OTHERS, OTHERS>(POSES, POSES).try_inverse().unwrap();
        let left = information.fixed_view::<POSES, POSES>(0, 0) - gain * coupling.transpose();
        let left_side = right.fixed_rows::<POSES>(0) - gain * right.fixed_rows::<OTHERS>(POSES);
        // Sums of 60 products of normal numbers, about 60 each, on a diagonal that stays above 10: some hundred roundings of 2^-53 of 100.
        let off = (SMatrix::<f64, POSES, POSES>::from_row_slice(&matrix) - left).amax();
        let off_side = (SVector::<f64, POSES>::from_row_slice(&rhs) - left_side).amax();
        assert!(off < 1e-10 && off_side < 1e-10, "seed {seed}: {off:e}, {off_side:e}");
        assert!((0..POSES).all(|k| matrix[8 * POSES + k] == 0.0) && rhs[8] == 0.0, "seed {seed}");
        assert!(prior.first_estimate(1) == Some(poses[1]) && prior.first_estimate(2).is_none(), "seed {seed}");
        assert!(prior.cost(&poses) > 0.0, "seed {seed}");
    }
}
