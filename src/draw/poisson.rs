//! Poisson counts of a row: the exact Poisson quantile of each uniform, for means in electrons.
//!
//! One uniform a draw, no rejection, so a count never falls when its mean grows. Bright columns go by the normal quantile's
//! asymptotic series, dim ones by summing the distribution function. Each reports where its error might change the count;
//! those columns, a few in a thousand, go to `poisson_quantile` in f64, the slow twin. So the bits of the result do not
//! depend on how either is computed, as long as their error bounds hold.

mod each_mean;
mod one_mean;
mod ranges;
mod series;
mod summation;

pub use one_mean::poisson_of_one_mean;

pub use each_mean::poisson;

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::exact::poisson_quantile;
    use crate::draw::normal::CENTRE;
    use crate::draw::{DrawKey, fill_uniforms};
    use crate::num::f32_nearest;

    fn check_scan(means_e: impl Iterator<Item = f32>, uniforms_a_mean: usize) -> (u64, f32) {
        let (mut tried, mut last_e) = (0, 0.0);
        for (case, mean_e) in means_e.enumerate() {
            let mut uniforms = vec![0; uniforms_a_mean];
            fill_uniforms(DrawKey::root(case as u64), &mut uniforms);
            uniforms[..6].copy_from_slice(&[0, 1, u32::MAX, u32::MAX - 1, CENTRE, CENTRE - 1]);
            let mut values_e = vec![mean_e; uniforms.len()];
            poisson(&uniforms, &mut values_e);
            for (&uniform, &value_e) in uniforms.iter().zip(&values_e) {
                let exact_e = poisson_quantile(uniform, mean_e);
                assert_eq!(f64::from(value_e), f64::from(f32_nearest(exact_e)), "mean {mean_e}, uniform {uniform}");
                tried += 1;
            }
            last_e = mean_e;
        }
        (tried, last_e)
    }

    #[test]
    fn the_row_kernel_equals_its_slow_twin_over_all_means() {
        let (tried, last_e) = check_scan((0..600_u16).map(|step| 0.01 * libm::powf(1.036, step.into())), 5000);
        println!("{tried} draws up to mean {last_e}");
        assert!(tried == 3_000_000 && last_e > 1e7);
    }

    #[test]
    fn a_row_of_one_mean_equals_a_row_of_means() {
        for (case, mean_e) in [0.0, -1.0, f32::NAN, 1e-9, 0.02, 0.7, 3.0, 7.999, 8.0, 500.0].into_iter().enumerate() {
            let mut uniforms = vec![0; 20_000];
            fill_uniforms(DrawKey::root(case as u64), &mut uniforms);
            uniforms[..4].copy_from_slice(&[0, 1, u32::MAX, u32::MAX - 1]);
            let (mut values_e, mut out_e) = (vec![mean_e; 20_000], vec![1.0; 20_000]);
            poisson(&uniforms, &mut values_e);
            poisson_of_one_mean(&uniforms, mean_e, &mut out_e);
            assert_eq!(values_e, out_e, "mean {mean_e}");
        }
    }

    #[test]
    fn zero_negative_and_nan_means_give_zero_and_infinity_itself() {
        let mut values_e = [0.0, -0.0, -1.0, f32::NAN, f32::INFINITY, 9.0, 1e-30];
        poisson(&[u32::MAX, 0, 5, u32::MAX, 7, CENTRE, u32::MAX], &mut values_e);
        assert_eq!(values_e, [0.0, 0.0, 0.0, 0.0, f32::INFINITY, 9.0, 0.0]);
    }
}
