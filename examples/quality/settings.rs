//! What is compared: our extractor at several word lengths, and the same method in floating point.

use sensel::compute::{Extractor, ExtractorParams, Feature, PairPattern, Rank};

use super::reference;
use super::score::Features;
use super::views::Codes;

/// A way from codes to features.
pub enum Method {
    /// Ours.
    Fixed(ExtractorParams),
    /// The same method in floating point.
    Float,
}

/// A row of the study.
pub struct Setting {
    pub name: &'static str,
    pub method: Method,
}

/// Scenarios' default, its 500 corners of a VGA frame being 180 of a view's 384 x 288 pixels.
const USUAL: ExtractorParams = ExtractorParams { target_features: 180, ..ExtractorParams::USUAL };

macro_rules! fixed {
    ($($name:literal $(, $field:ident = $value:expr)*;)+) => {
        &[$(Setting { name: $name, method: Method::Fixed(ExtractorParams { $($field: $value,)* ..USUAL }) },)+
          Setting { name: "float reference", method: Method::Float }]
    };
}

/// The study's rows; the first one is the default.
pub const SETTINGS: &[Setting] = fixed! {
    "8-bit words, 256-bit descriptor, 500 corners a VGA frame";
    "1,000 corners", target_features = 360;
    "300 corners", target_features = 108;
    "threshold 20", target_features = 0;
    "threshold 40", threshold = 40, target_features = 0;
    "symmetric pattern", pattern = PairPattern::Symmetric;
    "10-bit words", pipeline_bits = 10, threshold = 80;
    "12-bit words", pipeline_bits = 12, threshold = 320;
    "192-bit descriptor", descriptor_bits = 192;
    "128-bit descriptor", descriptor_bits = 128;
    "64-bit descriptor", descriptor_bits = 64;
    "6-bit angle", angle_bits = 6;
    "5-bit angle", angle_bits = 5;
    "4-bit angle", angle_bits = 4;
    "3-bit angle", angle_bits = 3;
    "symmetric, 128-bit descriptor", pattern = PairPattern::Symmetric, descriptor_bits = 128;
    "Harris rank", rank = Rank::Harris;
    "whole-pixel positions", subpixel = false;
    "1 corner a cell", per_cell = 1;
    "3 octaves", octaves = 3;
};

impl Method {
    /// Features of a picture that stands still, once the threshold has settled.
    pub fn features(&self, codes: &Codes) -> Features {
        match self {
            Self::Fixed(params) => {
                let found = Extractor::new(params).first_frame(&codes.plane, codes.bits);
                found.expect("views are large enough").features.iter().map(keypoint).collect()
            }
            Self::Float => reference::features(codes, &USUAL),
        }
    }
}

fn keypoint(feature: &Feature) -> ([f64; 2], [u64; 4]) {
    ([feature.x_px(), feature.y_px()], words(&feature.descriptor))
}

/// 32 bytes as four words.
pub fn words(bytes: &[u8; 32]) -> [u64; 4] {
    let mut words = [0; 4];
    for (word, bytes) in words.iter_mut().zip(bytes.as_chunks::<8>().0) {
        *word = u64::from_le_bytes(*bytes);
    }
    words
}
