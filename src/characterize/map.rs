//! Maps of non-uniformity: draws the deviations of pixels as an inline picture with its caption.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder as _};

use crate::num::{greater, lesser, low_u8, u32_truncated};
use crate::units::Size;

/// Deviations of pixels as grey values, `-limit` black and `limit` white.
pub(super) fn map(values: &[f64], size: Size, limit: f64, caption: &str) -> String {
    let grey = |value: &f64| {
        let share = 0.5 + 0.5 * value / limit;
        low_u8(u32_truncated(255.0 * lesser(1.0, greater(0.0, share)) + 0.5))
    };
    let bytes: Vec<u8> = values.iter().map(grey).collect();
    let mut png = Vec::new();
    PngEncoder::new(&mut png)
        .write_image(&bytes, size.width_px, size.height_px, ExtendedColorType::L8)
        .expect("a map has as many values as pixels");
    let (width, height) = (size.width_px, size.height_px);
    format!(
        "<figure><svg viewBox=\"0 0 {width} {height}\" role=\"img\" style=\"display:block;width:100%;height:auto;border-radius:6px\">\
         <title>{caption}</title><image width=\"{width}\" height=\"{height}\" style=\"image-rendering:pixelated\" \
         href=\"data:image/png;base64,{}\"/></svg><figcaption>{caption}</figcaption></figure>",
        STANDARD.encode(png)
    )
}
