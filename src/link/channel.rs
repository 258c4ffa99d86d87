//! Bit errors between sensor and host. Flips bits of a frame at a given rate, and counts them.
//!
//! Errors are independent of each other (a memoryless binary symmetric channel). The bits from one error to the next are
//! geometrically distributed, so the draws are as many as the errors: the number of bits that are spared is floor(ln u / ln(1 - p))
//! for a uniform u in (0, 1]. D-PHY promises a rate below 1e-12; larger rates model a marginal cable or connector.

use crate::draw::{DrawKey, EffectNumber, RowId};
use crate::num::{f64_from_u64, index, u64_from, u64_truncated};

/// The published number of the draws.
pub const NUMBER: EffectNumber = EffectNumber(301);

/// 2^-53: a draw's upper 53 bits and one make a uniform in (0, 1], whose logarithm is finite.
const STEP: f64 = 1.0 / 9_007_199_254_740_992.0;

/// Flips bits of a frame's bytes at this rate, from 0 to below 1, and gives back how many. The k-th error's position follows from seed,
/// camera, frame and k alone. Nothing is drawn at rate 0.
///
/// # Panics
/// On another rate.
pub fn flip_bits(bytes: &mut [u8], rate: f64, row_id: RowId) -> u64 {
    assert!((0.0..1.0).contains(&rate), "a rate is a share below 1");
    if rate == 0.0 {
        return 0;
    }
    let key = DrawKey::of_row(NUMBER, row_id);
    let log_spared = libm::log1p(-rate);
    let (bits, mut at, mut flipped) = (8 * u64_from(bytes.len()), 0_u64, 0);
    loop {
        let uniform = f64_from_u64((key.with(flipped).0 >> 11) + 1) * STEP;
        // Saturates far beyond any frame.
        at = at.saturating_add(u64_truncated(libm::log(uniform) / log_spared));
        if at >= bits {
            return flipped;
        }
        bytes[index(u32::try_from(at / 8).expect("a frame has fewer than 2^32 bytes"))] ^= 1 << (at % 8);
        at += 1;
        flipped += 1;
    }
}
