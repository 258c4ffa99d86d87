//! The fixed-point feature extractor on the sensor. Enters: codes of a frame. Leaves: features and counted events.
//!
//! The way of a frame: codes are shifted to 8 bits, FAST-9/16 scores every pixel behind seven line buffers, strict
//! non-maximum suppression keeps the peaks, a grid spreads the choice over the picture, and each chosen corner gets a
//! sub-pixel place, an orientation and a rotated BRIEF-256 descriptor from the smoothed picture. Integers only.

mod brief;
mod fast;
mod grid;
mod luma;
mod orientation;
mod smooth;
mod subpixel;
#[cfg(test)]
mod test_pictures;
mod work;

pub use brief::pattern;
pub use fast::{Corner, fast9};
pub use orientation::angle_of;
pub use subpixel::STEPS_PER_PX;

use crate::error::Error;
use crate::events::Events;
use crate::num::{index, low_u8};
use crate::plane::Plane;
use crate::units::Size;

/// Rows and columns around a corner that its orientation and descriptor need: 13 for the rotated pattern and 3 for the
/// smoothing kernel. Corners nearer to an edge have no descriptor.
pub const PATCH_MARGIN_PX: u32 = 16;

/// Widest and highest picture: places are 12 bits of pixel and 4 bits of fraction.
pub const SIDE_PX_MAX: u32 = 4096;

/// A corner with its descriptor, as it leaves the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Feature {
    /// Column in the full picture (octave 0 pixels), in sixteenths of a pixel; pixel centres are whole.
    pub x_q4: u16,
    /// Row in the full picture (octave 0 pixels), in sixteenths of a pixel; pixel centres are whole.
    pub y_q4: u16,
    /// FAST score: the largest threshold at which the corner survives, in 8-bit DN.
    pub score: u8,
    /// Orientation in 1/256 of a turn, from +x towards +y (down).
    pub angle: u8,
    /// Half-scale octave, 0 is full size.
    pub octave: u8,
    /// Rotated BRIEF, bit i of the pattern in bit i % 8 of byte i / 8. All zero where the patch leaves the picture.
    pub descriptor: [u8; 32],
}

impl Feature {
    /// Column in the full picture, in pixels.
    pub fn x_px(&self) -> f64 {
        f64::from(self.x_q4) / f64::from(STEPS_PER_PX)
    }

    /// Row in the full picture, in pixels.
    pub fn y_px(&self) -> f64 {
        f64::from(self.y_q4) / f64::from(STEPS_PER_PX)
    }

    /// The pixel (column, row) whose area holds the place. The fit moves a place by half a pixel at most, and a place
    /// on the seam between two pixels belongs to the later one, as the fit never reaches the seam itself from below.
    pub fn pixel(&self) -> (u32, u32) {
        let nearest = |place_q4: u16| (u32::from(place_q4) + u32::from(STEPS_PER_PX) / 2) / u32::from(STEPS_PER_PX);
        (nearest(self.x_q4), nearest(self.y_q4))
    }

    /// Number of descriptor bits in which two features differ.
    pub fn distance(&self, other: &Self) -> u32 {
        self.descriptor.iter().zip(&other.descriptor).map(|(a, b)| (a ^ b).count_ones()).sum()
    }
}

/// What the extractor is set to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ExtractorParams {
    /// Least difference to the arc of nine pixels, in 8-bit DN at every depth; a corner's score is at least this.
    pub threshold: u8,
    /// Most features a frame. `None` lists every corner, with an empty descriptor where the patch leaves the picture;
    /// with a number, corners without a full patch are dropped before the choice.
    pub top_k: Option<u32>,
    /// Side of the grid's square cells, over which `top_k` is spread evenly.
    pub cell_px: u32,
    /// Fit places to sixteenths of a pixel; else places are whole pixels.
    pub subpixel: bool,
}

impl ExtractorParams {
    /// The same, after its ranges are checked.
    pub fn checked(self) -> Result<Self, Error> {
        if self.threshold == 0 {
            return Err(Error::key("compute.threshold", 0, "1 to 255 would do (8-bit DN)"));
        }
        if self.top_k == Some(0) {
            return Err(Error::key("compute.top_k", 0, "1 or more would do; leave it out to list every corner"));
        }
        if !(8..=SIDE_PX_MAX).contains(&self.cell_px) {
            return Err(Error::key("compute.cell_px", self.cell_px, format!("8 to {SIDE_PX_MAX} would do")));
        }
        Ok(self)
    }

    /// Whether pictures of this size can be worked on. Small ones can: they have no corners.
    pub fn check_size(size: Size) -> Result<(), Error> {
        for (key, side_px) in [("sensor.width", size.width_px), ("sensor.height", size.height_px)] {
            if side_px > SIDE_PX_MAX {
                return Err(Error::key(key, side_px, format!("the extractor takes up to {SIDE_PX_MAX} pixels a side")));
            }
        }
        Ok(())
    }
}

/// Shifts codes of 1 to 16 bits to 8 bits, where thresholds live (DESIGN: extractor input).
///
/// Panics on other depths. Codes are below 2^bits; higher bits of a code are cut off.
pub fn to_8_bits(codes: &Plane<u16>, bits: u32) -> Plane<u8> {
    assert!((1..=16).contains(&bits), "codes have 1 to 16 bits");
    if bits >= 8 {
        let shift = bits - 8;
        codes.map(|code| low_u8(u32::from(code) >> shift))
    } else {
        let shift = 8 - bits;
        codes.map(|code| low_u8(u32::from(code) << shift))
    }
}

/// Features of a frame, by rows, then columns. A picture too small for a corner (under 7 pixels a side) has none.
///
/// Panics on depths outside 1 to 16 bits, on cells of zero pixels, and on pictures that `check_size` refuses.
pub fn extract(codes: &Plane<u16>, bits: u32, params: &ExtractorParams, events: &mut Events) -> Vec<Feature> {
    let size = codes.size();
    assert!(ExtractorParams::check_size(size).is_ok(), "the caller checks the size of pictures");
    assert!(params.cell_px > 0, "the caller checks the parameters");
    let picture = to_8_bits(codes, bits);
    let mut corners = fast9(&picture, params.threshold);
    work::count_picture(size, events);
    if let Some(most) = params.top_k {
        corners.retain(|corner| has_patch(size, corner));
        work::count_choice(corners.len(), events);
        corners = grid::spread(&corners, params.cell_px, size, index(most));
    }
    let with_patch = corners.iter().filter(|corner| has_patch(size, corner)).count();
    work::count_corners(corners.len(), with_patch, params.subpixel, events);
    describe(&picture, &corners, params.subpixel)
}

/// Features of a frame behind colour filters whose pattern repeats after `pattern_px` (columns, rows), from its grey.
///
/// Panics as `extract`, and on pictures smaller than the pattern.
pub fn extract_from_mosaic(
    codes: &Plane<u16>,
    bits: u32,
    pattern_px: (usize, usize),
    params: &ExtractorParams,
    events: &mut Events,
) -> Vec<Feature> {
    if pattern_px == (1, 1) {
        return extract(codes, bits, params, events);
    }
    let grey = luma::luma(codes, pattern_px, events);
    let mut features = extract(&grey, bits, params, events);
    luma::place_in_mosaic(&mut features, pattern_px);
    features
}

fn has_patch(size: Size, corner: &Corner) -> bool {
    let inside = |place_px: u32, side_px: u32| place_px >= PATCH_MARGIN_PX && place_px + PATCH_MARGIN_PX < side_px;
    inside(corner.x_px, size.width_px) && inside(corner.y_px, size.height_px)
}

fn describe(picture: &Plane<u8>, corners: &[Corner], subpixel: bool) -> Vec<Feature> {
    let smoothed = smooth::smooth(picture);
    let rotated = brief::rotated_pattern();
    let one = |corner: &Corner| {
        let (x_q4, y_q4) = subpixel::place(picture, corner, subpixel);
        let mut feature =
            Feature { x_q4, y_q4, score: corner.score, angle: 0, octave: 0, descriptor: [0; brief::BYTES] };
        if has_patch(picture.size(), corner) {
            feature.angle = orientation::orientation(picture, corner);
            feature.descriptor = rotated.describe(&smoothed, corner, feature.angle);
        }
        feature
    };
    corners.iter().map(one).collect()
}
