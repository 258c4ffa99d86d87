//! SIMD lanes as plain arrays, which the compiler maps to the registers of the dispatched level. Sixteen lanes, the rays of a
//! packet, are one register of AVX-512, two of AVX2, four of SSE2, NEON or simd128.
//!
//! Lanes are the rays of a packet, the children of a node, or the triangles of a block. Every operation is one IEEE operation a lane,
//! so bits do not depend on the level.

use std::ops::{Add, BitAnd, BitOr, Mul, Sub};

/// An array from an expression of its index, written out. A loop over packets of numbers is vectorised across its turns, by gathers and
/// scatters that take longer than the work itself.
macro_rules! unrolled {
    (@ $i:ident, $e:expr; $($n:literal)*) => { [$({ const $i: usize = $n; $e }),*] };
    ($i:ident in 2 => $e:expr) => { $crate::scene::lanes::unrolled!(@ $i, $e; 0 1) };
    ($i:ident in 3 => $e:expr) => { $crate::scene::lanes::unrolled!(@ $i, $e; 0 1 2) };
    ($i:ident in 4 => $e:expr) => { $crate::scene::lanes::unrolled!(@ $i, $e; 0 1 2 3) };
    ($i:ident in 12 => $e:expr) => { $crate::scene::lanes::unrolled!(@ $i, $e; 0 1 2 3 4 5 6 7 8 9 10 11) };
}
pub(crate) use unrolled;

/// Rays in a packet.
pub const LANES: usize = 16;

macro_rules! lanewise {
    ($type:ident, $count:expr, $trait:ident, $method:ident, $operator:tt, $zero:expr) => {
        impl $trait for $type {
            type Output = Self;
            #[inline(always)]
            fn $method(self, other: Self) -> Self {
                let mut out = [$zero; $count];
                for lane in 0..$count {
                    out[lane] = self.0[lane] $operator other.0[lane];
                }
                Self(out)
            }
        }
    };
}

macro_rules! comparison {
    ($(#[$doc:meta])* $name:ident, $mask:ident, $count:expr, $operator:tt) => {
        $(#[$doc])*
        #[inline(always)]
        pub fn $name(self, other: Self) -> $mask {
            let mut out = [0; $count];
            for lane in 0..$count {
                out[lane] = if self.0[lane] $operator other.0[lane] { u32::MAX } else { 0 };
            }
            $mask(out)
        }
    };
}

macro_rules! lanes {
    ($floats:ident, $mask:ident, $count:expr) => {
        /// One `f32` a lane.
        #[derive(Clone, Copy, Debug, PartialEq)]
        #[repr(C, align(64))]
        pub struct $floats(pub [f32; $count]);

        /// One truth a lane: all bits set or none.
        #[derive(Clone, Copy, Debug, PartialEq, Eq)]
        #[repr(C, align(64))]
        pub struct $mask(pub [u32; $count]);

        lanewise!($floats, $count, Add, add, +, 0.0);
        lanewise!($floats, $count, Sub, sub, -, 0.0);
        lanewise!($floats, $count, Mul, mul, *, 0.0);
        lanewise!($mask, $count, BitAnd, bitand, &, 0);
        lanewise!($mask, $count, BitOr, bitor, |, 0);

        impl $floats {
            /// The same number in every lane.
            #[inline(always)]
            pub fn splat(value: f32) -> Self {
                Self([value; $count])
            }

            /// The lesser of two numbers; the other one where either is NaN.
            #[inline(always)]
            pub fn lesser(self, other: Self) -> Self {
                let mut out = [0.0; $count];
                for lane in 0..$count {
                    out[lane] = if self.0[lane] < other.0[lane] { self.0[lane] } else { other.0[lane] };
                }
                Self(out)
            }

            /// The greater of two numbers; the other one where either is NaN.
            #[inline(always)]
            pub fn greater(self, other: Self) -> Self {
                let mut out = [0.0; $count];
                for lane in 0..$count {
                    out[lane] = if self.0[lane] > other.0[lane] { self.0[lane] } else { other.0[lane] };
                }
                Self(out)
            }

            /// Without their signs.
            #[inline(always)]
            pub fn abs(self) -> Self {
                let mut out = [0.0; $count];
                for lane in 0..$count {
                    out[lane] = self.0[lane].abs();
                }
                Self(out)
            }

            comparison!(
                /// Where this is at most the other.
                at_most, $mask, $count, <=
            );
            comparison!(
                /// Where this is below the other.
                below, $mask, $count, <
            );
            comparison!(
                /// Where the two are equal.
                equal, $mask, $count, ==
            );
        }

        impl $mask {
            /// Whether any lane is set.
            #[inline(always)]
            pub fn any(self) -> bool {
                let mut all = 0;
                for lane in 0..$count {
                    all |= self.0[lane];
                }
                all != 0
            }

            /// The first where set, else the second.
            #[inline(always)]
            pub fn select(self, set: $floats, clear: $floats) -> $floats {
                let mut out = [0.0; $count];
                for lane in 0..$count {
                    let (set, clear) = (set.0[lane].to_bits(), clear.0[lane].to_bits());
                    out[lane] = f32::from_bits(self.0[lane] & set | !self.0[lane] & clear);
                }
                $floats(out)
            }

            /// The first where set, else the second.
            #[inline(always)]
            pub fn select_u32(self, set: [u32; $count], clear: [u32; $count]) -> [u32; $count] {
                let mut out = [0; $count];
                for lane in 0..$count {
                    out[lane] = self.0[lane] & set[lane] | !self.0[lane] & clear[lane];
                }
                out
            }
        }
    };
}

lanes!(Floats, Mask, LANES);
lanes!(Eight, EightMask, 8);

/// Three coordinates a lane.
pub type Vectors = [Floats; 3];

impl Floats {
    /// The least of all lanes.
    #[inline(always)]
    pub fn least(self) -> f32 {
        let mut row = self.0;
        let mut half = LANES / 2;
        while half > 0 {
            for lane in 0..half {
                row[lane] = if row[lane + half] < row[lane] { row[lane + half] } else { row[lane] };
            }
            half /= 2;
        }
        row[0]
    }

    /// The greatest of all lanes.
    #[inline(always)]
    pub fn most(self) -> f32 {
        let mut row = self.0;
        let mut half = LANES / 2;
        while half > 0 {
            for lane in 0..half {
                row[lane] = if row[lane + half] > row[lane] { row[lane + half] } else { row[lane] };
            }
            half /= 2;
        }
        row[0]
    }
}

impl Mask {
    /// A bit for each lane that is set, the first lane's lowest.
    #[inline(always)]
    pub fn bits(self) -> u32 {
        let mut bits = 0_u32;
        for lane in 0..LANES {
            bits |= self.0[lane] & 1 << lane;
        }
        bits
    }

    /// A lane that is set, where others are not.
    #[inline(always)]
    pub fn one_of_some(self) -> Option<usize> {
        let mut all = u32::MAX;
        for lane in 0..LANES {
            all &= self.0[lane];
        }
        if all != 0 { None } else { self.0.iter().position(|&lane| lane != 0) }
    }
}

/// Takes the lowest lane out of the bits of some.
#[inline(always)]
pub fn next_lane(bits: &mut u32) -> usize {
    let lane = bits.trailing_zeros() & 15;
    *bits &= bits.wrapping_sub(1);
    crate::num::index(lane)
}

/// Halves of a packet: eight lanes are what two registers of the baseline or one of AVX2 hold, so that a triangle's test stays within
/// the registers there are.
impl Floats {}

impl EightMask {
    /// A byte per lane, of which all bits or none are set.
    #[inline(always)]
    pub fn bytes(self) -> u64 {
        let mut out = [0_u8; 8];
        for lane in 0..8 {
            out[lane] = if self.0[lane] != 0 { u8::MAX } else { 0 };
        }
        u64::from_le_bytes(out)
    }
}

/// The same point in every lane.
#[inline(always)]
pub fn splat3(value: [f32; 3]) -> Vectors {
    [Floats::splat(value[0]), Floats::splat(value[1]), Floats::splat(value[2])]
}

/// Lane by lane scalar product.
#[inline(always)]
pub fn dot3(a: Vectors, b: Vectors) -> Floats {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}
