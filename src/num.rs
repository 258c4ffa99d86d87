//! Conversions between number types, each with its rounding and overflow in its name.
//!
//! `as` between widths is refused elsewhere (clippy), so every narrowing of the product goes through here.

/// A `u32` as an index. All supported targets have at least 32-bit addresses.
#[inline(always)]
pub const fn index(value: u32) -> usize {
    value as usize
}

/// A length or index as `u32`. Panics beyond `u32::MAX`: no picture or list of this program is that long.
#[inline]
pub fn u32_from(value: usize) -> u32 {
    u32::try_from(value).expect("lengths stay below 2^32")
}

/// A length as `u64`.
#[inline(always)]
pub const fn u64_from(value: usize) -> u64 {
    value as u64
}

/// A count as `f64`; exact below 2^53, else rounded to the nearest.
#[inline(always)]
pub const fn f64_from_u64(value: u64) -> f64 {
    value as f64
}

/// A sum of counts as `f64`; exact below 2^53, else rounded to the nearest.
#[inline(always)]
pub const fn f64_from_u128(value: u128) -> f64 {
    value as f64
}

/// A length as `f64`; exact below 2^53, else rounded to the nearest.
#[inline(always)]
pub const fn f64_from_usize(value: usize) -> f64 {
    value as f64
}

/// A signed count as `f64`; exact within 2^53, else rounded to the nearest.
#[inline(always)]
pub const fn f64_from_i64(value: i64) -> f64 {
    value as f64
}

/// Narrows to `f32`, rounding to the nearest, ties to even.
#[inline(always)]
#[allow(clippy::cast_possible_truncation)]
pub const fn f32_nearest(value: f64) -> f32 {
    value as f32
}

/// A small integer as `f32`; exact within 2^24, else rounded to the nearest.
#[inline(always)]
pub const fn f32_from_i32(value: i32) -> f32 {
    value as f32
}

/// A small integer as `f32`; exact below 2^24, else rounded to the nearest.
#[inline(always)]
pub const fn f32_from_u32(value: u32) -> f32 {
    value as f32
}

/// Truncates towards zero and saturates at the type's ends; NaN gives 0.
#[inline(always)]
#[allow(clippy::cast_possible_truncation)]
pub const fn i64_truncated(value: f64) -> i64 {
    value as i64
}

/// Truncates towards zero and saturates at the type's ends; NaN gives 0.
#[inline(always)]
#[allow(clippy::cast_possible_truncation)]
pub const fn i32_truncated(value: f64) -> i32 {
    value as i32
}

/// Truncates towards zero and saturates at 0 and the type's end; NaN gives 0.
#[inline(always)]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
pub const fn u64_truncated(value: f64) -> u64 {
    value as u64
}

/// Truncates towards zero and saturates at 0 and the type's end; NaN gives 0.
#[inline(always)]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
pub const fn u32_truncated(value: f64) -> u32 {
    value as u32
}

/// Truncates towards zero and saturates at the type's ends; NaN gives 0.
#[inline(always)]
#[allow(clippy::cast_possible_truncation)]
pub const fn i32_truncated_f32(value: f32) -> i32 {
    value as i32
}

/// Truncates towards zero and saturates at 0 and the type's end; NaN gives 0.
#[inline(always)]
#[allow(clippy::cast_possible_truncation, clippy::cast_sign_loss)]
pub const fn u32_truncated_f32(value: f32) -> u32 {
    value as u32
}

/// Rounds to the nearest integer, ties to even, and saturates at the type's ends.
#[inline]
pub fn i64_half_even(value: f64) -> i64 {
    i64_truncated(value.round_ties_even())
}

/// Rounds to the nearest integer, ties to even, and saturates at 0 and the type's end.
#[inline]
pub fn u64_half_even(value: f64) -> u64 {
    u64_truncated(value.round_ties_even())
}

/// The low 32 bits.
#[inline(always)]
#[allow(clippy::cast_possible_truncation)]
pub const fn low_u32(value: u64) -> u32 {
    value as u32
}

/// The low 16 bits.
#[inline(always)]
#[allow(clippy::cast_possible_truncation)]
pub const fn low_u16(value: u32) -> u16 {
    value as u16
}

/// The low 8 bits.
#[inline(always)]
#[allow(clippy::cast_possible_truncation)]
pub const fn low_u8(value: u32) -> u8 {
    value as u8
}

/// Clips to 0..=255.
#[inline(always)]
pub fn u8_clipped(value: i32) -> u8 {
    u8::try_from(value.clamp(0, 255)).expect("clipped above")
}

/// The value with so many significant digits.
pub fn significant(value: f64, digits: usize) -> f64 {
    format!("{value:.*e}", digits.max(1) - 1).parse().unwrap_or(value)
}

/// The lesser of two numbers that are not NaN; the first on equality, so signed zeros keep their order.
#[inline(always)]
pub fn lesser(a: f64, b: f64) -> f64 {
    if b < a { b } else { a }
}

/// The greater of two numbers that are not NaN; the first on equality.
#[inline(always)]
pub fn greater(a: f64, b: f64) -> f64 {
    if b > a { b } else { a }
}
