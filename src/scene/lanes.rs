//! Sixteen numbers at a time, as plain arrays that the compiler turns into whatever registers the dispatched level has: one of
//! AVX-512, two of AVX2, four of SSE2, NEON or simd128.
//!
//! Enters and leaves: lanes of one packet of rays. Every operation is one IEEE operation a lane, so bits do not depend on
//! the level.

#![allow(clippy::needless_range_loop, reason = "lanes, axes and bands of several arrays run in step")]

use std::ops::{Add, BitAnd, BitOr, Mul, Sub};

/// Rays in a packet.
pub const LANES: usize = 16;

/// One `f32` a lane.
#[derive(Clone, Copy, Debug, PartialEq)]
#[repr(C, align(64))]
pub struct Floats(pub [f32; LANES]);

/// One truth a lane: all bits set or none.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(C, align(64))]
pub struct Mask(pub [u32; LANES]);

/// Three coordinates a lane.
pub type Vectors = [Floats; 3];

macro_rules! lanewise {
    ($trait:ident, $method:ident, $operator:tt) => {
        impl $trait for Floats {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let mut out = [0.0; LANES];
                for lane in 0..LANES {
                    out[lane] = self.0[lane] $operator other.0[lane];
                }
                Self(out)
            }
        }
    };
}
lanewise!(Add, add, +);
lanewise!(Sub, sub, -);
lanewise!(Mul, mul, *);

impl Floats {
    /// The same number in every lane.
    #[inline(always)]
    pub fn splat(value: f32) -> Self {
        Self([value; LANES])
    }

    /// The lesser of two numbers; the other one where either is NaN.
    #[inline(always)]
    pub fn lesser(self, other: Self) -> Self {
        let mut out = [0.0; LANES];
        for lane in 0..LANES {
            out[lane] = if self.0[lane] < other.0[lane] { self.0[lane] } else { other.0[lane] };
        }
        Self(out)
    }

    /// The greater of two numbers; the other one where either is NaN.
    #[inline(always)]
    pub fn greater(self, other: Self) -> Self {
        let mut out = [0.0; LANES];
        for lane in 0..LANES {
            out[lane] = if self.0[lane] > other.0[lane] { self.0[lane] } else { other.0[lane] };
        }
        Self(out)
    }

    /// Where this is at most the other.
    #[inline(always)]
    pub fn at_most(self, other: Self) -> Mask {
        let mut out = [0; LANES];
        for lane in 0..LANES {
            out[lane] = if self.0[lane] <= other.0[lane] { u32::MAX } else { 0 };
        }
        Mask(out)
    }

    /// Where this is below the other.
    #[inline(always)]
    pub fn below(self, other: Self) -> Mask {
        let mut out = [0; LANES];
        for lane in 0..LANES {
            out[lane] = if self.0[lane] < other.0[lane] { u32::MAX } else { 0 };
        }
        Mask(out)
    }

    /// Where the two are equal.
    #[inline(always)]
    pub fn equal(self, other: Self) -> Mask {
        let mut out = [0; LANES];
        for lane in 0..LANES {
            out[lane] = if self.0[lane] == other.0[lane] { u32::MAX } else { 0 };
        }
        Mask(out)
    }
}

impl Mask {
    /// Whether any lane is set.
    #[inline(always)]
    pub fn any(self) -> bool {
        let mut all = 0;
        for lane in 0..LANES {
            all |= self.0[lane];
        }
        all != 0
    }

    /// The first where set, else the second.
    #[inline(always)]
    pub fn select(self, set: Floats, clear: Floats) -> Floats {
        let mut out = [0.0; LANES];
        for lane in 0..LANES {
            out[lane] = if self.0[lane] != 0 { set.0[lane] } else { clear.0[lane] };
        }
        Floats(out)
    }

    /// The first where set, else the second.
    #[inline(always)]
    pub fn select_u32(self, set: [u32; LANES], clear: [u32; LANES]) -> [u32; LANES] {
        let mut out = [0; LANES];
        for lane in 0..LANES {
            out[lane] = if self.0[lane] != 0 { set[lane] } else { clear[lane] };
        }
        out
    }
}

impl BitAnd for Mask {
    type Output = Self;
    #[inline(always)]
    fn bitand(self, other: Self) -> Self {
        let mut out = [0; LANES];
        for lane in 0..LANES {
            out[lane] = self.0[lane] & other.0[lane];
        }
        Self(out)
    }
}

impl BitOr for Mask {
    type Output = Self;
    #[inline(always)]
    fn bitor(self, other: Self) -> Self {
        let mut out = [0; LANES];
        for lane in 0..LANES {
            out[lane] = self.0[lane] | other.0[lane];
        }
        Self(out)
    }
}

/// The same point in every lane.
#[inline(always)]
pub fn splat3(value: [f32; 3]) -> Vectors {
    [Floats::splat(value[0]), Floats::splat(value[1]), Floats::splat(value[2])]
}

/// Lane by lane difference.
#[inline(always)]
pub fn sub3(a: Vectors, b: Vectors) -> Vectors {
    [a[0] - b[0], a[1] - b[1], a[2] - b[2]]
}

/// Lane by lane sum.
#[inline(always)]
pub fn add3(a: Vectors, b: Vectors) -> Vectors {
    [a[0] + b[0], a[1] + b[1], a[2] + b[2]]
}

/// Lane by lane scalar product.
#[inline(always)]
pub fn dot3(a: Vectors, b: Vectors) -> Floats {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

/// Lane by lane vector product. Swapping the arguments negates every bit of the result exactly.
#[inline(always)]
pub fn cross3(a: Vectors, b: Vectors) -> Vectors {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}
