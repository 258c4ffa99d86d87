//! Double-double numbers, pairs of f64: a reference of 106 bits for what the product computes in 53 or 24.
//!
//! A number is the unevaluated sum of two f64 that do not overlap (Dekker, "A floating-point technique for extending the available
//! precision", Numerische Mathematik 18, 1971; Hida, Li and Bailey, "Algorithms for quad-double precision floating point arithmetic",
//! 2001). Sums and products are good to 4 * 2^-106 of the result, quotients and roots to 16 * 2^-106, functions to 2^-95.

use std::ops::{Add, Div, Mul, Neg, Sub};

use sensel::num::{f64_from_i64, f64_from_u64, i64_truncated};

/// An unevaluated sum, the greater part first.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Dd {
    pub high: f64,
    pub low: f64,
}

pub const PI: Dd = Dd { high: std::f64::consts::PI, low: 1.224_646_799_147_353_2e-16 };
pub const LN_2: Dd = Dd { high: std::f64::consts::LN_2, low: 2.319_046_813_846_299_6e-17 };

/// Sum and its rounding error, for any two numbers (Knuth).
fn two_sum(a: f64, b: f64) -> Dd {
    let high = a + b;
    let of_b = high - a;
    Dd { high, low: (a - (high - of_b)) + (b - of_b) }
}

/// The same where `a` is not the smaller one (Dekker).
fn quick_sum(a: f64, b: f64) -> Dd {
    let high = a + b;
    Dd { high, low: b - (high - a) }
}

/// Upper and lower half of the digits (Veltkamp); for sizes below 2^996.
fn split(a: f64) -> (f64, f64) {
    let shifted = 134_217_729.0 * a;
    let high = shifted - (shifted - a);
    (high, a - high)
}

/// Product and its rounding error (Dekker).
fn two_product(a: f64, b: f64) -> Dd {
    let high = a * b;
    let ((a1, a2), (b1, b2)) = (split(a), split(b));
    Dd { high, low: ((a1 * b1 - high) + a1 * b2 + a2 * b1) + a2 * b2 }
}

/// A number that f64 holds.
pub fn dd(value: f64) -> Dd {
    Dd { high: value, low: 0.0 }
}

/// An integer, exactly up to 2^106.
pub fn whole(value: i128) -> Dd {
    let part = |shift: u32| i64::try_from((value >> shift) & 0xFFFF_FFFF).expect("32 bits");
    let top = i64::try_from(value >> 96).expect("32 bits");
    let scaled = |value: i64, shift: i32| dd(f64_from_i64(value)) * dd(libm::ldexp(1.0, shift));
    scaled(top, 96) + scaled(part(64), 64) + scaled(part(32), 32) + scaled(part(0), 0)
}

impl Add for Dd {
    type Output = Self;
    fn add(self, other: Self) -> Self {
        let high = two_sum(self.high, other.high);
        let low = two_sum(self.low, other.low);
        let once = quick_sum(high.high, high.low + low.high);
        quick_sum(once.high, once.low + low.low)
    }
}

impl Neg for Dd {
    type Output = Self;
    fn neg(self) -> Self {
        Self { high: -self.high, low: -self.low }
    }
}

impl Sub for Dd {
    type Output = Self;
    fn sub(self, other: Self) -> Self {
        self + -other
    }
}

impl Mul for Dd {
    type Output = Self;
    fn mul(self, other: Self) -> Self {
        let product = two_product(self.high, other.high);
        quick_sum(product.high, product.low + (self.high * other.low + self.low * other.high))
    }
}

impl Div for Dd {
    type Output = Self;
    fn div(self, other: Self) -> Self {
        let first = self.high / other.high;
        let rest = self - other * dd(first);
        let second = rest.high / other.high;
        let rest = rest - other * dd(second);
        let sum = quick_sum(first, second);
        sum + dd(rest.high / other.high)
    }
}

impl Dd {
    /// The nearest f64, as good as.
    pub fn f64(self) -> f64 {
        self.high + self.low
    }

    pub fn abs(self) -> Self {
        if self.high < 0.0 { -self } else { self }
    }

    /// Distance of an f64 from this number.
    pub fn miss(self, found: f64) -> f64 {
        (dd(found) - self).abs().f64()
    }

    pub fn sqrt(self) -> Self {
        if self.high <= 0.0 {
            return dd(0.0);
        }
        // Newton's step doubles the digits of the f64 root; a second one takes away its rounding.
        let mut root = dd(self.high.sqrt());
        for _ in 0..2 {
            root = root + (self - root * root) / (root + root);
        }
        root
    }

    /// e to this power, for sizes below 700.
    pub fn exp(self) -> Self {
        let doublings = (self.high / LN_2.high).round_ties_even();
        // 2^9 squarings of a power below 7e-4: 12 terms of the series leave 7e-4^13 / 13! = 1e-51.
        let small = (self - LN_2 * dd(doublings)) * dd(1.0 / 512.0);
        let mut sum = dd(1.0);
        for k in (1..=12_u32).rev() {
            sum = dd(1.0) + sum * small / dd(f64::from(k));
        }
        // expm1 is squared, so that the digits beyond the 1 are kept: (1 + e)^2 - 1 = 2 e + e^2.
        let mut beyond = sum - dd(1.0);
        for _ in 0..9 {
            beyond = beyond + beyond + beyond * beyond;
        }
        let power = i32::try_from(i64_truncated(doublings)).expect("below 2^11");
        let half = dd(libm::ldexp(1.0, power / 2));
        (beyond + dd(1.0)) * half * dd(libm::ldexp(1.0, power - power / 2))
    }

    /// Natural logarithm: Newton on `exp`.
    pub fn ln(self) -> Self {
        let mut value = dd(libm::log(self.high));
        for _ in 0..2 {
            value = value + self * (-value).exp() - dd(1.0);
        }
        value
    }

    /// Sine and cosine, for angles up to some thousand turns.
    pub fn sin_cos(self) -> (Self, Self) {
        let quarters = (self.high / (0.5 * PI.high)).round_ties_even();
        let rest = self - PI * dd(0.5) * dd(quarters);
        let square = rest * rest;
        // At pi / 4 the first dropped terms are 0.785^29 / 29! = 1e-34 and below.
        let (mut sine, mut cosine) = (dd(1.0), dd(1.0));
        for k in (1..=14_u32).rev() {
            let n = f64::from(2 * k);
            sine = dd(1.0) - sine * square / dd(n * (n + 1.0));
            cosine = dd(1.0) - cosine * square / dd(n * (n - 1.0));
        }
        sine = sine * rest;
        match i64_truncated(quarters).rem_euclid(4) {
            0 => (sine, cosine),
            1 => (cosine, -sine),
            2 => (-sine, -cosine),
            _ => (-cosine, sine),
        }
    }

    /// The angle of (x, y): Newton on the sine of the difference.
    pub fn atan2(y: Self, x: Self) -> Self {
        let length = (x * x + y * y).sqrt();
        let mut angle = dd(libm::atan2(y.high, x.high));
        for _ in 0..2 {
            let (sine, cosine) = angle.sin_cos();
            angle = angle + (y * cosine - x * sine) / length;
        }
        angle
    }
}

/// A vector of them.
pub type Vector = [Dd; 3];

pub fn vector(values: [f64; 3]) -> Vector {
    values.map(dd)
}

pub fn minus(a: Vector, b: Vector) -> Vector {
    [0, 1, 2].map(|k| a[k] - b[k])
}

pub fn times(a: Vector, factor: Dd) -> Vector {
    a.map(|x| x * factor)
}

pub fn dot(a: Vector, b: Vector) -> Dd {
    a[0] * b[0] + a[1] * b[1] + a[2] * b[2]
}

pub fn cross(a: Vector, b: Vector) -> Vector {
    [a[1] * b[2] - a[2] * b[1], a[2] * b[0] - a[0] * b[2], a[0] * b[1] - a[1] * b[0]]
}

/// What the reference itself is worth: identities that lose no digits in exact arithmetic, to 1e-29.
#[test]
fn double_double_keeps_its_identities_to_29_digits() {
    let mut tried = 0;
    for k in 1..400_u64 {
        let x = dd(f64_from_u64(k)) / dd(37.0);
        let (sine, cosine) = (x * dd(3.0)).sin_cos();
        for (what, miss) in [
            ("x / 3 * 3", x / dd(3.0) * dd(3.0) - x),
            ("root", x.sqrt() * x.sqrt() - x),
            ("logarithm", x.exp().ln() - x),
            ("square and square", sine * sine + cosine * cosine - dd(1.0)),
            ("angle", Dd::atan2(sine, cosine).sin_cos().0 - sine),
        ] {
            assert!((miss / x).abs().f64() < 1e-28, "{what} of {x:?}: {miss:?}");
            tried += 1;
        }
    }
    // e and ln 10 to 32 digits, from any table: the leading f64 and what it leaves.
    let e = dd(1.0).exp();
    assert_eq!(e.high, std::f64::consts::E);
    assert!((e.low - 1.445_646_891_729_250_2e-16).abs() < 1e-29, "{e:?}");
    let ln_10 = dd(10.0).ln();
    assert!((ln_10.low - -2.170_756_223_382_249_4e-16).abs() < 1e-29, "{ln_10:?}");
    assert_eq!((whole(-(1 << 100)) / whole(1 << 98)).f64(), -4.0);
    assert_eq!(tried, 5 * 399);
}
