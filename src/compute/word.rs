//! Words of the extractor's pipeline: 8 bits, or up to 16 in a wide one. One kernel is written for both.

use std::fmt::Debug;
use std::ops::{Add, BitOr, Mul, Shr, Sub};

use crate::num::{low_u8, low_u16};

/// A word of the pipeline, with the sums that its kernels need.
pub trait Word: Copy + Ord + Default + Debug + Into<u32> + BitOr<Output = Self> + Send + Sync + 'static {
    /// Holds 256 times a word and a half: the smoothing kernel's sum.
    type Sum: Copy
        + Default
        + From<Self>
        + From<u8>
        + Add<Output = Self::Sum>
        + Mul<Output = Self::Sum>
        + Shr<u32, Output = Self::Sum>;
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
    /// The low bits of a kernel's sum.
    fn low_sum(sum: Self::Sum) -> Self;
    /// The word for a moment.
    fn moment(self) -> Self::Moment;
    /// The word as a number.
    #[inline(always)]
    fn number(self) -> u32 {
        self.into()
    }
}

impl Word for u8 {
    type Sum = u16;
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
    fn low_sum(sum: u16) -> Self {
        low_u8(u32::from(sum))
    }
    #[inline(always)]
    fn moment(self) -> i16 {
        i16::from(self)
    }
}

impl Word for u16 {
    type Sum = u32;
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
    fn low_sum(sum: u32) -> Self {
        low_u16(sum)
    }
    #[inline(always)]
    fn moment(self) -> i32 {
        i32::from(self)
    }
}
