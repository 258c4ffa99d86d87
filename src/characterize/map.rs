//! Maps of non-uniformity: draws the deviations of pixels as an inline picture with its caption.

use maud::{Markup, html};

use crate::num::{greater, lesser, low_u8, u32_truncated};
use crate::plane::Plane;
use crate::report::html::png_uri;
use crate::units::Size;

/// Deviations of pixels as grey values, `-limit` black and `limit` white.
pub(super) fn map(values: &[f64], size: Size, limit: f64, caption: &str) -> Markup {
    let grey = |value: &f64| {
        let share = 0.5 + 0.5 * value / limit;
        low_u8(u32_truncated(255.0 * lesser(1.0, greater(0.0, share)) + 0.5))
    };
    let picture = Plane::from_values(size, values.iter().map(grey).collect());
    let (width, height) = (size.width_px, size.height_px);
    html! {
        figure {
            svg viewBox={ "0 0 " (width) " " (height) } role="img" style="display:block;width:100%;height:auto;border-radius:6px" {
                title { (caption) }
                image width=(width) height=(height) style="image-rendering:pixelated" href=(png_uri(&picture)) {}
            }
            figcaption { (caption) }
        }
    }
}
