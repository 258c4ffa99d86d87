//! Makes second pictures: homographies, blur, noise, bit depth. Codes are as a sensor gives them.

use sensel::num::{f64_from_usize, index, low_u16, low_u32, u64_half_even};
use sensel::plane::Plane;
use sensel::units::Size;

use super::pictures::Picture;

/// Depth of codes where a view says nothing else.
const BITS: u32 = 10;
/// Samples a pixel in each direction: shrunk pictures are averaged, not thinned out.
const SAMPLES: usize = 3;
/// Sides of all views: the middle of a picture.
const SIZE: Size = Size { width_px: 384, height_px: 288 };

/// Codes of a picture.
pub struct Codes {
    pub plane: Plane<u16>,
    pub bits: u32,
}

impl Codes {
    pub fn size(&self) -> Size {
        self.plane.size()
    }
}

/// A second view of a picture.
pub struct View {
    pub name: &'static str,
    pub group: &'static str,
    /// Of the second picture over the first.
    scale: f64,
    rotation_deg: f64,
    /// Change of scale over a pixel to the right and down.
    perspective: [f64; 2],
    blur_px: f64,
    noise_dn: f64,
    bits: u32,
}

impl View {
    /// The first picture.
    pub const SAME: Self = Self {
        name: "same",
        group: "",
        scale: 1.0,
        rotation_deg: 0.0,
        perspective: [0.0; 2],
        blur_px: 0.0,
        noise_dn: 0.0,
        bits: BITS,
    };

    /// Where a position of the first picture is in the second, from the middle of both.
    pub fn map(&self, [x, y]: [f64; 2]) -> [f64; 2] {
        let (sine, cosine) = libm::sincos(self.rotation_deg.to_radians());
        let (u, v) = (self.scale * (cosine * x - sine * y), self.scale * (sine * x + cosine * y));
        let w = 1.0 + self.perspective[0] * x + self.perspective[1] * y;
        [u / w, v / w]
    }

    /// The way back.
    pub fn unmapped(&self, [u, v]: [f64; 2]) -> [f64; 2] {
        let (sine, cosine) = libm::sincos(self.rotation_deg.to_radians());
        // u w = s (c x - n y), v w = s (n x + c y) with w = 1 + p x + q y: two linear equations in x and y.
        let ([p, q], s) = (self.perspective, self.scale);
        let (a, b, c, d) = (s * cosine - u * p, -s * sine - u * q, s * sine - v * p, s * cosine - v * q);
        let determinant = a * d - b * c;
        [(u * d - b * v) / determinant, (a * v - u * c) / determinant]
    }
}

macro_rules! views {
    ($($group:literal { $($name:literal: $($field:ident = $value:expr),+;)+ })+) => {
        &[$($(View { name: $name, group: $group, $($field: $value,)+ ..View::SAME },)+)+]
    };
}

/// All views: what the docs' table has.
pub const VIEWS: &[View] = views! {
    "rotation" {
        "15 deg": rotation_deg = 15.0;
        "45 deg": rotation_deg = 45.0;
        "90 deg": rotation_deg = 90.0;
        "135 deg": rotation_deg = 135.0;
        "180 deg": rotation_deg = 180.0;
    }
    "scale" {
        "x 0.7": scale = 0.7;
        "x 0.85": scale = 0.85;
        "x 1.2": scale = 1.2;
        "x 1.4": scale = 1.4;
    }
    "perspective" {
        "to the right": perspective = [8e-4, 0.0];
        "down and turned": perspective = [0.0, 9e-4], rotation_deg = 20.0;
    }
    "blur" {
        "1 px": blur_px = 1.0;
        "2 px": blur_px = 2.0;
    }
    "noise" {
        "4 DN": noise_dn = 4.0;
        "10 DN": noise_dn = 10.0;
    }
    "depth" {
        "1 bit": bits = 1;
        "2 bits": bits = 2;
        "4 bits": bits = 4;
        "6 bits": bits = 6;
        "8 bits": bits = 8;
    }
};

/// Codes of a view of a picture; black beyond the picture's edge.
pub fn codes(picture: &Picture, view: &View) -> Codes {
    let (width, height) = (index(SIZE.width_px), index(SIZE.height_px));
    let middle = |side: usize| 0.5 * (f64_from_usize(side) - 1.0);
    let step = 1.0 / f64_from_usize(SAMPLES);
    let mut values = Vec::with_capacity(width * height);
    for i in 0..width * height {
        let (x, y) = (f64_from_usize(i % width) - middle(width), f64_from_usize(i / width) - middle(height));
        let mut sum = 0.0;
        for sample in 0..SAMPLES * SAMPLES {
            let offset = |k: usize| step * (f64_from_usize(k) - middle(SAMPLES));
            let [u, v] = view.unmapped([x + offset(sample % SAMPLES), y + offset(sample / SAMPLES)]);
            sum += picture.at(u + middle(picture.width), v + middle(picture.height)).unwrap_or(0.0);
        }
        values.push(sum * step * step);
    }
    if view.blur_px > 0.0 {
        values = blurred(&values, width, view.blur_px);
    }
    let most = f64_from_usize((1 << view.bits) - 1);
    let code = |(i, value): (usize, &f64)| {
        // 256 grey levels are the full range; noise is drawn by the pixel's number.
        let value = value + view.noise_dn * normal(i);
        let steps = (value / 256.0 * (most + 1.0)).floor();
        low_u16(low_u32(u64_half_even(steps.clamp(0.0, most))))
    };
    Codes { plane: Plane::from_values(SIZE, values.iter().enumerate().map(code).collect()), bits: view.bits }
}

/// A Gaussian blur in both directions, edges repeated.
fn blurred(values: &[f64], width: usize, sigma_px: f64) -> Vec<f64> {
    let reach = index(sensel::num::u32_truncated(4.0 * sigma_px));
    let weights: Vec<f64> = (0..=2 * reach)
        .map(|k| {
            let x = f64_from_usize(k) - f64_from_usize(reach);
            libm::exp(-0.5 * x * x / (sigma_px * sigma_px))
        })
        .collect();
    let total: f64 = weights.iter().sum();
    let height = values.len() / width;
    let mut pass = values.to_vec();
    for (across, count) in [(true, width), (false, height)] {
        let before = pass.clone();
        for (i, out) in pass.iter_mut().enumerate() {
            let (x, y) = (i % width, i / width);
            let coordinate = if across { x } else { y };
            let tap = |(k, weight): (usize, &f64)| {
                let at = (coordinate + k).saturating_sub(reach).min(count - 1);
                weight * if across { before[y * width + at] } else { before[at * width + x] }
            };
            *out = weights.iter().enumerate().map(tap).sum::<f64>() / total;
        }
    }
    pass
}

/// A standard normal draw by its number: the sum of twelve uniform ones less six.
fn normal(number: usize) -> f64 {
    let draw = |k: u64| sensel::draw::mix(sensel::draw::mix(sensel::num::u64_from(number)) ^ k) >> 11;
    (0..12).map(|k| sensel::num::f64_from_u64(draw(k)) / sensel::num::f64_from_u64(1 << 53)).sum::<f64>() - 6.0
}
