//! Draws features over their picture into a PNG file.
//!
//! A feature is a circle whose radius doubles with each octave, and a line from its centre along its orientation.

use std::path::Path;

use image::{Rgb, RgbImage};
use sensel::compute::{Feature, to_8_bits};
use sensel::error::Error;
use sensel::num::{f64_from_u64, i64_truncated};
use sensel::plane::Plane;

/// Radius of a circle of the first octave.
const RADIUS_PX: u64 = 6;
/// One colour for each octave.
const COLOURS: [[u8; 3]; 4] = [[255, 196, 0], [0, 214, 255], [255, 92, 170], [130, 255, 90]];

/// Draws features over codes of so many bits.
pub fn features(file: &Path, codes: &Plane<u16>, bits: u32, features: &[Feature]) -> Result<(), Error> {
    let size = codes.size();
    let grey = to_8_bits(codes, bits);
    let mut picture = RgbImage::from_fn(size.width_px, size.height_px, |x, y| {
        Rgb([grey.at(sensel::num::index(x), sensel::num::index(y)); 3])
    });
    for feature in features {
        let colour = Rgb(COLOURS[usize::from(feature.octave) % COLOURS.len()]);
        let radius_px = f64_from_u64(RADIUS_PX << feature.octave);
        let mut dot = |along_px: f64, turn: f64| {
            let (sine, cosine) = libm::sincos(turn * std::f64::consts::TAU);
            let coordinate = |middle_px: f64, offset_px: f64| i64_truncated((middle_px + offset_px).round());
            let (x, y) = (coordinate(feature.x_px(), along_px * cosine), coordinate(feature.y_px(), along_px * sine));
            if let (Ok(x), Ok(y)) = (u32::try_from(x), u32::try_from(y))
                && x < size.width_px
                && y < size.height_px
            {
                picture.put_pixel(x, y, colour);
            }
        };
        // Eight dots a pixel of radius leave no gap: a turn is 6.3 pixels a pixel of radius.
        let dots = 8 * (RADIUS_PX << feature.octave);
        for i in 0..dots {
            dot(radius_px, f64_from_u64(i) / f64_from_u64(dots));
            dot(radius_px * f64_from_u64(i) / f64_from_u64(dots), feature.angle.into());
        }
    }
    let mut bytes = Vec::new();
    let written = picture.write_to(&mut std::io::Cursor::new(&mut bytes), image::ImageFormat::Png);
    written.map_err(|error| Error::Run(format!("{}: {error}", file.display())))?;
    super::paths::write_output("--draw", file, &bytes)
}
