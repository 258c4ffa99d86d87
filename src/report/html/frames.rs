//! What the sensor saw: frames as PNG inside the page, with their features drawn over them.

use base64::Engine as _;
use base64::engine::general_purpose::STANDARD;
use image::codecs::png::PngEncoder;
use image::{ExtendedColorType, ImageEncoder as _};
use maud::{Markup, html};

use super::parts::{FramePicture, FramePictures, Mark, section};
use crate::plane::Plane;

/// Colours over a picture do not follow the page: it is the picture that they must stand out from.
const TRACKED: &str = "#56c8ff";
const UNTRACKED: &str = "#ffb000";

pub(super) fn frames(pictures: &FramePictures) -> Markup {
    if pictures.strip.is_empty() {
        return Markup::default();
    }
    let content = html! {
        ul.legend {
            li { (sample(TRACKED, &rings([(16.0, 8.0)].into_iter()))) "feature used by the tracker" }
            li { (sample(UNTRACKED, &ticks([(16.0, 8.0)].into_iter()))) "feature found, not used" }
        }
        div.strip { @for picture in &pictures.strip { (figure(picture)) } }
    };
    let lead = "Frames as they left the converters, with the features that the sensor found in them.";
    section("What the sensor saw", lead, content)
}

fn sample(colour: &str, path: &str) -> Markup {
    html! { svg viewBox="0 0 32 16" aria-hidden="true" { (haloed(path, colour)) } }
}

fn figure(picture: &FramePicture) -> Markup {
    let (width, height) = (picture.values.width_px(), picture.values.height_px());
    let positions = |tracked: bool| {
        let marks = picture.marks.iter().filter(move |mark| mark.tracked == tracked);
        marks.map(|mark: &Mark| (mark.x_px + 0.5, mark.y_px + 0.5))
    };
    let (used, found) = (positions(true).count(), picture.marks.len());
    html! {
        figure {
            svg viewBox={ "0 0 " (width) " " (height) } role="img" {
                title { (picture.caption) ": " (found) " features, " (used) " of them tracked" }
                image width=(width) height=(height) href=(png_uri(&picture.values)) {}
                (haloed(&ticks(positions(false)), UNTRACKED))
                (haloed(&rings(positions(true)), TRACKED))
            }
            figcaption { (picture.caption) ". " (found) " features, " (used) " tracked." }
        }
    }
}

/// A light stroke over a wider dark one is seen on any background.
fn haloed(path: &str, colour: &str) -> Markup {
    html! {
        @if !path.is_empty() {
            g fill="none" {
                path d=(path) stroke="#000" stroke-opacity=".55" stroke-width="4" {}
                path d=(path) stroke=(colour) stroke-width="2" {}
            }
        }
    }
}

/// Circles of radius 6 px.
fn rings(positions: impl Iterator<Item = (f64, f64)>) -> String {
    positions.map(|(x, y)| format!("M{:.1} {y:.1}a6 6 0 1 0 12 0a6 6 0 1 0-12 0", x - 6.0)).collect()
}

/// Crosses of 8 px.
fn ticks(positions: impl Iterator<Item = (f64, f64)>) -> String {
    positions.map(|(x, y)| format!("M{:.1} {:.1}l8 8m0-8l-8 8", x - 4.0, y - 4.0)).collect()
}

/// A data URI of the picture as PNG.
pub(crate) fn png_uri(values: &Plane<u8>) -> String {
    let size = values.size();
    let mut bytes = Vec::new();
    PngEncoder::new(&mut bytes)
        .write_image(values.values(), size.width_px, size.height_px, ExtendedColorType::L8)
        .expect("a plane holds width times height bytes");
    format!("data:image/png;base64,{}", STANDARD.encode(bytes))
}
