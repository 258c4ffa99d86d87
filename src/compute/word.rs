//! Words of the extractor's pipeline: 8 bits, or up to 16 in a wide one. One kernel is written for both.

use std::fmt::Debug;
use std::ops::{Add, BitOr, Mul, Sub};

use fixed::FixedU16;
use fixed::traits::FixedUnsigned;
use fixed::types::extra::U8;

use crate::num::{low_u8, low_u16};
use crate::words::{TriangleMean, rounded};

/// A word of the pipeline, with the sums that its kernels need.
pub trait Word: Copy + Ord + Default + Debug + Into<u32> + BitOr<Output = Self> + Send + Sync + 'static {
    /// The smoothing kernel's sum: a mean with eight fraction bits, to which each word adds the given number of its 256ths.
    type Mean: FixedUnsigned;
    /// Holds 91 times a word with either sign: a column's moment about the middle of a patch.
    type Moment: Copy
        + Default
        + From<i8>
        + Into<i32>
        + Add<Output = Self::Moment>
        + Sub<Output = Self::Moment>
        + Mul<Output = Self::Moment>;
    /// The greatest word.
    const MAX: Self;
    /// The difference, or 0 where it would be negative.
    #[must_use]
    fn less(self, other: Self) -> Self;
    /// The low bits of a number.
    fn low(value: u32) -> Self;
    /// The given number of 256ths of the word.
    fn share(self, weight: u8) -> Self::Mean;
    /// A part of a mean times an integer. Whole means fit.
    fn times(part: Self::Mean, weight: u8) -> Self::Mean;
    /// A mean, rounded half up.
    fn rounded(mean: Self::Mean) -> Self;
    /// The word for a moment.
    fn moment(self) -> Self::Moment;
    /// The word as a number.
    #[inline(always)]
    fn number(self) -> u32 {
        self.into()
    }
}

impl Word for u8 {
    type Mean = FixedU16<U8>;
    type Moment = i16;
    const MAX: Self = Self::MAX;
    #[inline(always)]
    fn less(self, other: Self) -> Self {
        self.saturating_sub(other)
    }
    #[inline(always)]
    fn low(value: u32) -> Self {
        low_u8(value)
    }
    #[inline(always)]
    fn share(self, weight: u8) -> Self::Mean {
        FixedU16::from_bits(u16::from(self).wrapping_mul(weight.into()))
    }
    #[inline(always)]
    fn times(part: Self::Mean, weight: u8) -> Self::Mean {
        part.wrapping_mul_int(weight.into())
    }
    #[inline(always)]
    fn rounded(mean: Self::Mean) -> Self {
        const HALF: FixedU16<U8> = FixedU16::lit("0.5");
        let [_, whole] = mean.wrapping_add(HALF).to_bits().to_le_bytes();
        whole
    }
    #[inline(always)]
    fn moment(self) -> i16 {
        i16::from(self)
    }
}

impl Word for u16 {
    type Mean = TriangleMean;
    type Moment = i32;
    const MAX: Self = Self::MAX;
    #[inline(always)]
    fn less(self, other: Self) -> Self {
        self.saturating_sub(other)
    }
    #[inline(always)]
    fn low(value: u32) -> Self {
        low_u16(value)
    }
    #[inline(always)]
    fn share(self, weight: u8) -> Self::Mean {
        TriangleMean::from_bits(u32::from(self).wrapping_mul(weight.into()))
    }
    #[inline(always)]
    fn times(part: Self::Mean, weight: u8) -> Self::Mean {
        part.wrapping_mul_int(weight.into())
    }
    #[inline(always)]
    fn rounded(mean: Self::Mean) -> Self {
        low_u16(rounded(mean))
    }
    #[inline(always)]
    fn moment(self) -> i32 {
        i32::from(self)
    }
}
