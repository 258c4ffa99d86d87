//! Standard normals of a row: the normal quantiles of uniforms, in f32.
//!
//! With x = 2 U - 1, the quantile is x P(-ln(1 - x^2)), where P is smooth (Giles, "Approximating the erfinv function", GPU
//! Computing Gems, 2011). The outer 0.12 % go to `normal_quantile` in f64, the slow twin of the whole row too.

use super::exact::normal_quantile;
use crate::num::{f32_from_i32, f32_nearest};
use crate::simd::kernel;

/// Columns that one pass of a kernel holds in L1. Passes are short and each runs over the whole block, because a processor finds
/// work for its arithmetic units only among the next hundred operations, and one long formula has most of them wait on
/// each other. Far fewer columns would let the compiler unroll the passes and join them again.
pub(super) const BLOCK: usize = 128;

kernel! {
    /// Writes the standard normal quantile of each uniform. Relative error below 8e-7, and monotone in the
    /// uniform to within that error; u and its complement give values that differ in sign only, beyond rounding in the tails.
    ///
    /// Panics if the slices differ in length.
    pub fn normals<'a>(uniforms: &'a [u32], out: &'a mut [f32]) {
        assert!(uniforms.len() == out.len(), "a draw needs one uniform");
        let (uniforms, rest_uniforms) = uniforms.as_chunks::<BLOCK>();
        let (out, rest_out) = out.as_chunks_mut::<BLOCK>();
        for (uniforms, out) in uniforms.iter().zip(out) {
            block(uniforms, out);
        }
        if rest_out.is_empty() {
            return;
        }
        let mut uniforms = [CENTRE; BLOCK];
        let mut padded = [0.0; BLOCK];
        uniforms[..rest_uniforms.len()].copy_from_slice(rest_uniforms);
        block(&uniforms, &mut padded);
        rest_out.copy_from_slice(&padded[..rest_out.len()]);
    }
}

/// A uniform in the middle, for columns that do not exist.
pub(super) const CENTRE: u32 = 0x8000_0000;

#[inline(always)]
fn block(uniforms: &[u32; BLOCK], out: &mut [f32; BLOCK]) {
    let mut tails = 0_u32;
    for column in 0..BLOCK {
        out[column] = one_less_square(uniforms[column]);
        tails |= if is_tail(uniforms[column]) { u32::MAX } else { 0 };
    }
    for value in out.iter_mut() {
        *value = minus_ln(*value);
    }
    for value in out.iter_mut() {
        *value = smooth(*value);
    }
    for column in 0..BLOCK {
        out[column] *= symmetric(uniforms[column]);
    }
    if tails != 0 {
        mend_tails(uniforms, out);
    }
}

/// Columns that are looked at together for one that needs f64.
pub(super) const GROUP: usize = 16;

#[cold]
#[inline(never)]
fn mend_tails(uniforms: &[u32; BLOCK], out: &mut [f32; BLOCK]) {
    for (uniforms, out) in uniforms.as_chunks::<GROUP>().0.iter().zip(out.as_chunks_mut::<GROUP>().0) {
        let tails = uniforms.iter().fold(false, |tails, &uniform| tails | is_tail(uniform));
        if !tails {
            continue;
        }
        for (&uniform, value) in uniforms.iter().zip(out) {
            if is_tail(uniform) {
                *value = f32_nearest(normal_quantile(uniform));
            }
        }
    }
}

/// Beyond this |x| in units of 2^-31 the polynomial ends: -ln(1 - x^2) is 6 and |z| 3.23 there.
const TAIL: i32 = 2_144_819_850;

const UNIT: f32 = 1.0 / 2_147_483_648.0;

/// A uniform's distance from the middle, both halves counted from 0.
#[inline(always)]
fn magnitude(uniform: u32) -> i32 {
    let signed = (uniform ^ CENTRE).cast_signed();
    signed ^ (signed >> 31)
}

/// Whether a uniform lies in a tail beyond the polynomial.
#[inline(always)]
fn is_tail(uniform: u32) -> bool {
    magnitude(uniform) > TAIL
}

/// x = 2 U - 1, with the same rounding on both sides of the middle.
#[inline(always)]
fn symmetric(uniform: u32) -> f32 {
    let x = (f32_from_i32(magnitude(uniform)) + 0.5) * UNIT;
    f32::from_bits(x.to_bits() | (!uniform & CENTRE))
}

/// 1 - x^2. Taken from the integers, so that it loses no digits where |x| is near 1.
#[inline(always)]
pub(super) fn one_less_square(uniform: u32) -> f32 {
    let v = (f32_from_i32(i32::MAX - magnitude(uniform)) + 0.5) * UNIT;
    v * (2.0 - v)
}

/// P(t), the quantile over x; t up to the tail's seam at 6.
#[inline(always)]
fn smooth(t: f32) -> f32 {
    let t2 = t * t;
    let low = (1.253_313_8 + 0.328_129_7 * t) + t2 * (0.016_268_529 - 0.003_179_551_8 * t);
    let high = (-0.000_294_986_15 + 0.000_123_191_93 * t) + t2 * (-0.000_012_783_773 + 0.000_000_476_243_9 * t);
    low + (t2 * t2) * high
}

/// -ln(w) for 0 < w <= 1, absolute error below 5e-7 up to the tail's seam.
#[inline(always)]
fn minus_ln(w: f32) -> f32 {
    const ROOT_HALF_BITS: i32 = 0x3f35_04f3;
    const LN_2: f32 = std::f32::consts::LN_2;
    let bits = w.to_bits().cast_signed();
    let exponent = (bits - ROOT_HALF_BITS) >> 23;
    let r = f32::from_bits((bits - (exponent << 23)).cast_unsigned()) - 1.0;
    let r2 = r * r;
    let low = (0.999_999_94 - 0.500_003_46 * r) + r2 * (0.333_356_08 - 0.249_715_6 * r);
    let high = (0.198_842_36 - 0.172_124_27 * r) + r2 * (0.163_381_46 - 0.103_787_16 * r);
    -(f32_from_i32(exponent) * LN_2 + r * (low + (r2 * r2) * high))
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every 1009th uniform, the ends, the middle and both sides of the tail's seam.
    fn uniforms() -> Vec<u32> {
        let mut uniforms: Vec<u32> = (0..=u32::MAX).step_by(1009).collect();
        let seam = (0..=CENTRE).step_by(65_536).find(|&uniform| !is_tail(uniform)).unwrap();
        for centre in [1 << 12, seam, CENTRE, !seam, u32::MAX - 4096] {
            uniforms.extend((0..8192).map(|step| (centre - 4096).saturating_add(step)));
        }
        uniforms
    }

    #[test]
    fn normals_stay_within_eight_e_minus_seven_of_the_quantile() {
        let uniforms = uniforms();
        let mut values = vec![0.0; uniforms.len()];
        normals(&uniforms, &mut values);
        let (mut worst, mut tails) = (0.0_f64, 0);
        for (&uniform, &value) in uniforms.iter().zip(&values) {
            let exact = normal_quantile(uniform);
            worst = worst.max((f64::from(value) / exact - 1.0).abs());
            tails += u32::from(is_tail(uniform));
        }
        println!("{} uniforms, {tails} in the tails, worst relative error {worst:.3e}", uniforms.len());
        assert!(tails > 1000, "both sides of the seam must be tried");
        assert!(worst < 8e-7, "worst relative error {worst:e}");
    }

    #[test]
    fn the_quantile_inverts_the_distribution_function() {
        for uniform in [0, 1, 1000, 1 << 20, 1 << 28, (1 << 31) - 1, 1 << 31, 3 << 30, u32::MAX - 1, u32::MAX] {
            let z = normal_quantile(uniform);
            let (below, above) =
                ((f64::from(uniform) + 0.5) / 4_294_967_296.0, (f64::from(!uniform) + 0.5) / 4_294_967_296.0);
            let (found, wanted) = if z < 0.0 {
                (0.5 * libm::erfc(-z * std::f64::consts::FRAC_1_SQRT_2), below)
            } else {
                (0.5 * libm::erfc(z * std::f64::consts::FRAC_1_SQRT_2), above)
            };
            // Relative slope of the tail is at most |z| + 1/|z|, so 1e-14 in z is under 1e-13 here.
            assert!((found / wanted - 1.0).abs() < 1e-13, "uniform {uniform}: {found:e} for {wanted:e}");
        }
    }

    #[test]
    fn complementary_uniforms_give_opposite_normals() {
        let uniforms: Vec<u32> = uniforms().into_iter().step_by(7).collect();
        let complements: Vec<u32> = uniforms.iter().map(|uniform| !uniform).collect();
        let (mut values, mut opposite) = (vec![0.0; uniforms.len()], vec![0.0; uniforms.len()]);
        normals(&uniforms, &mut values);
        normals(&complements, &mut opposite);
        assert!(values.iter().zip(&opposite).all(|(a, b)| *a == -*b));
    }
}
