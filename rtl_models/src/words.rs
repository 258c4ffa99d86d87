//! The extractor's words that have a fraction, each with its binary point: the one place where formats are stated.
//!
//! A format `uI.F` or `iI.F` has I bits before the point (`i`: the sign is one of them) and F behind it. Registers of the Verilog hold
//! the same bits. They may be narrower, where a word's range, which stands with it, leaves upper bits unused. Arithmetic on words is
//! `wrapping_`, `checked_` or `saturating_`, so that no overflow goes unsaid.

use fixed::types::extra::{LeEqU32, U2, U4, U8, U10, U14, U16};
use fixed::{FixedI16, FixedI32, FixedI64, FixedU8, FixedU16, FixedU32, FixedU64};

/// A word's format, as documents show it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Format {
    /// The type's name.
    pub name: &'static str,
    /// Whether the word has a sign.
    pub is_signed: bool,
    /// Bits before the point, with the sign.
    pub int_bits: u32,
    /// Bits behind the point.
    pub frac_bits: u32,
    /// What it holds.
    pub holds: &'static str,
    /// The values that occur.
    pub range: &'static str,
}

/// Declares words and lists their formats, which are read from the types.
#[macro_export]
macro_rules! words {
    ($(#[$list:meta])* $formats:ident: $($name:ident = $type:ty, $holds:literal, $range:literal;)*) => {
        $(#[doc = concat!($holds, ": ", $range, ".")] pub type $name = $type;)*
        $(#[$list])*
        pub const $formats: &[$crate::words::Format] = &[$($crate::words::Format {
            name: stringify!($name),
            is_signed: <$name>::IS_SIGNED,
            int_bits: <$name>::INT_NBITS,
            frac_bits: <$name>::FRAC_NBITS,
            holds: $holds,
            range: $range,
        }),*];
    };
}

words! {
    /// All words of this file.
    FORMATS:
    PositionPx = FixedU16<U4>, "Position of a feature in pixels of octave 0; pixel centres are whole", "0 to 4095 15/16";
    ShiftPx = FixedI16<U4>, "What the fit moves a position by, in pixels of its octave", "-1 to 15/16";
    EdgeDistancePx = FixedU32<U4>, "Distance from the picture's edge, before the low 16 bits are the position", "0 to 4096";
    Turns = FixedU8<U8>, "Orientation in turns, from +x towards +y", "0 to 255/256";
    Slope = FixedU32<U16>, "Tangent of a seam between two angles of the first octant", "804/65536 to 63947/65536";
    SlopeSide = FixedU64<U16>, "The shorter moment, and the longer one times a slope", "0 to below 2^29";
    Sine = FixedI16<U14>, "Sine of the rotator", "-1 to 1";
    TurnedPx = FixedI32<U14>, "Coordinate of a turned point in pixels, before it is rounded", "-13 to 13 and a half";
    TriangleMean = FixedU32<U8>, "Sum under the 7 x 7 triangle, as the mean that it is 256 times of", "0 to 2^P - 1";
    HalfScaleMean = FixedU32<U2>, "Sum of two by two pixels, as their mean", "0 to 2^P - 1";
    TraceShare = FixedI64<U4>, "Square of the trace in Harris' measure, as its sixteenth", "0 to below 2^48";
    Significand = FixedU16<U10>, "A Harris measure over its leading power of two", "1 to 1 1023/1024";
}

/// A mean without its fraction, rounded half up.
#[inline(always)]
pub const fn rounded<F: LeEqU32>(mean: FixedU32<F>) -> u32 {
    (mean.to_bits().wrapping_add((1 << F::U32) >> 1)) >> F::U32
}
