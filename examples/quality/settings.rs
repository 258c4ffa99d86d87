//! What is compared: our extractor at several word lengths, and the same method in floating point.

use sensel::compute::{ExtractorParams, Feature, Pattern, Rank, extract};
use sensel::events::Events;

use crate::reference;
use crate::score::Features;
use crate::views::Codes;

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

/// Scenarios' default but for the threshold: at 20 most cells of these pictures are full, and the grid chooses more than strength does.
const USUAL: ExtractorParams = ExtractorParams { threshold: 40, ..ExtractorParams::USUAL };

macro_rules! fixed {
    ($($name:literal $(, $field:ident = $value:expr)*;)+) => {
        &[$(Setting { name: $name, method: Method::Fixed(ExtractorParams { $($field: $value,)* ..USUAL }) },)+
          Setting { name: "float reference", method: Method::Float }]
    };
}

/// The study's rows; the first one is the default.
pub const SETTINGS: &[Setting] = fixed! {
    "8-bit words, 256-bit descriptor, threshold 40";
    "threshold 20", threshold = 20;
    "symmetric pattern", pattern = Pattern::Symmetric;
    "10-bit words", pipeline_bits = 10, threshold = 160;
    "12-bit words", pipeline_bits = 12, threshold = 640;
    "192-bit descriptor", descriptor_bits = 192;
    "128-bit descriptor", descriptor_bits = 128;
    "64-bit descriptor", descriptor_bits = 64;
    "6-bit angle", angle_bits = 6;
    "5-bit angle", angle_bits = 5;
    "4-bit angle", angle_bits = 4;
    "3-bit angle", angle_bits = 3;
    "symmetric, 128-bit descriptor", pattern = Pattern::Symmetric, descriptor_bits = 128;
    "Harris rank", rank = Rank::Harris;
    "whole-pixel places", subpixel = false;
    "1 corner a cell", per_cell = 1;
    "3 octaves", octaves = 3;
};

impl Method {
    /// The default.
    pub const USUAL: Self = Self::Fixed(USUAL);

    pub fn features(&self, codes: &Codes) -> Features {
        match self {
            Self::Fixed(params) => {
                let found = extract(&codes.plane, codes.bits, params, &mut Events::default());
                found.expect("views are large enough").iter().map(place).collect()
            }
            Self::Float => reference::features(codes, &USUAL),
        }
    }
}

fn place(feature: &Feature) -> ([f64; 2], [u64; 4]) {
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
