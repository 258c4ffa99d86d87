//! The fixed-point feature extractor on the sensor. Converts the codes of a frame to features, with their clocks and counted events.
//!
//! Processing of a frame: codes are shifted to the pipeline's words, and smoothed where they have few bits; octaves are halved;
//! FAST-9/16 scores every pixel behind seven
//! rows, strict non-maximum suppression keeps the peaks, and each cell of a grid keeps its best. Rows of cells go through a
//! queue to a few engines, which read a corner's patch of the smoothed picture and compute its sub-pixel position, orientation
//! and rotated BRIEF descriptor. Integers only. Pictures are processed as a whole; `stream` computes the times and the losses.
//! On the rung `clocked` the hardware's twin does the same clock by clock. `docs/extractor.md` is the specification. Its
//! example:
//!
//! ```
//! use sensel::compute::{AlwaysReady, AtOnce, Extractor, ExtractorParams};
//! use sensel::words::{PositionPx, Turns};
//! use sensel::{events::Events, plane::Plane, units::Size};
//!
//! let bright = |i: usize| i % 48 >= 24 && i / 48 >= 24;
//! let flat: Vec<u16> = (0..48 * 48).map(|i| if bright(i) { 200 } else { 50 }).collect();
//! let mut peaked = flat.clone();
//! peaked[24 * 48 + 24] = 210;
//!
//! let extract = |codes: Vec<u16>| {
//!     let codes = Plane::from_values(Size { width_px: 48, height_px: 48 }, codes);
//!     let mut extractor = Extractor::new(&ExtractorParams::USUAL);
//!     extractor.frame(&codes, 8, (1, 1), (&mut AtOnce, &mut AlwaysReady), &mut Events::default())
//! };
//! // Four pixels of equal difference suppress each other.
//! assert!(extract(flat)?.features.is_empty());
//! let found = extract(peaked)?;
//! let feature = found.features[0];
//! assert_eq!((feature.x, feature.y), (PositionPx::lit("24.8125"), PositionPx::lit("24.8125")));
//! assert_eq!((feature.score, feature.angle), (159, Turns::lit("0.125")));
//! assert_eq!((found.out_clk[0], found.end_clk), (2661, 2408));
//! # Ok::<(), sensel::error::Error>(())
//! ```

mod back;
mod brief;
mod cells;
mod clocked;
mod describe;
mod even;
mod fast;
pub mod fate;
mod feature;
mod half;
mod harris;
mod luma;
mod orientation;
mod params;
mod patch;
mod pattern;
mod presmooth;
mod rows;
mod sequence;
mod smooth;
mod start;
mod stream;
mod subpixel;
#[cfg(test)]
mod test_pictures;
mod word;
mod work;

pub use back::{AlwaysReady, Records};
pub use even::{FrameClocks, even_frame};
pub use fast::{Corner, fast9};
pub use orientation::angle_of;
pub use params::{
    ExtractorParams, OCTAVE_SIDE_PX_MIN, Overflow, PATCH_MARGIN_PX, PairPattern, Rank, SIDE_PX_MAX, SIDE_PX_MIN,
    Smoothing,
};
pub use pattern::pattern;
pub use rows::{AtOnce, Pixels, RowByRow, RowSpacing};
pub use sequence::{FeatureRecord, Sequence};
pub use word::Word;

/// The blocks one by one, for tests that compare hardware with them.
pub mod blocks {
    pub use super::back::{ENGINE_FIXED_CLK, START_GAP_CLK};
    pub use super::brief::RotatedPattern;
    pub use super::fast::{BORDER_PX, CIRCLE, arc_difference, arc_difference_at};
    pub use super::half::half_scale;
    pub use super::harris::harris_rank;
    pub use super::orientation::{moments, rounded_angle};
    pub use super::patch::{Patch, RADIUS_PX};
    pub use super::pattern::{sine_of, symmetric_pairs, symmetric_pattern, turned};
    pub use super::rows::{DRAIN_CLK, FRONT_LATENCY_CLK, SlotRow, frame_clk, order};
    pub use super::smooth::smooth;
    pub use super::subpixel::{fitted_shift, responses};
}

use describe::describe_every;

use crate::error::Error;
use crate::events::Events;
use crate::fidelity::Rung;
use crate::num::u64_from;
use crate::plane::Plane;
use crate::rtl_simulator::SharedRtlSimulator;
use crate::units::Size;
pub use feature::{Extracted, ExtractorCounts, Feature};

/// The extractor of one camera, frame after frame. Only its threshold lasts from one to the next.
#[derive(Clone, Debug)]
pub struct Extractor {
    params: ExtractorParams,
    /// None before the first frame.
    threshold: Option<u16>,
    rung: Rung,
    verilog: Option<SharedRtlSimulator>,
    /// Candidates in its queue at once, at most; the hardware's twins do not count them.
    queue_most: Option<u32>,
}

impl Extractor {
    /// Ready for the first frame.
    pub fn new(params: &ExtractorParams) -> Self {
        Self { params: *params, threshold: None, rung: Rung::Sampled, verilog: None, queue_most: None }
    }

    /// The same extractor on another rung: as functions over whole pictures, or as the hardware's twin, clock by clock. Both give the
    /// same.
    #[must_use]
    pub fn on_rung(self, rung: Rung) -> Self {
        Self { rung, ..self }
    }

    /// The same extractor in Verilog, where its rung is that.
    #[must_use]
    pub fn in_verilog(self, verilog: Option<SharedRtlSimulator>) -> Self {
        Self { verilog, ..self }
    }

    /// Candidates that waited for an engine at once in the frames so far, at most; none where the hardware's twin ran.
    pub fn queue_most(&self) -> Option<u32> {
        self.queue_most
    }

    /// Features of a frame of codes of `bits` bits behind colour filters whose pattern repeats after `pattern_px` (columns, rows). Fails
    /// on a picture that the window does not fit into or that is too large, codes that have more bits, or a target that the clocked
    /// form's register does not hold.
    pub fn frame(
        &mut self,
        codes: &Plane<u16>,
        bits: u32,
        pattern_px: (usize, usize),
        (pixels, records): (&mut dyn Pixels, &mut dyn Records),
        events: &mut Events,
    ) -> Result<Extracted, Error> {
        ExtractorParams::check_size(codes.size())?;
        check_codes(codes, bits)?;
        let grey = (pattern_px != (1, 1)).then(|| luma::luma(codes, pattern_px, events));
        let codes = grey.as_ref().unwrap_or(codes);
        let (params, smooths) = (self.params.for_codes(bits), self.params.smooths(bits));
        let mut delayed = presmooth::DelayedPixels { pixels, height_px: codes.height_px() };
        let pixels: &mut dyn Pixels = if smooths { &mut delayed } else { &mut *delayed.pixels };
        let io = (pixels, records);
        let mut extracted = if params.pipeline_bits == 8 {
            self.of_words(&params, words::<u8>(codes, bits, &params, events), io, events)?
        } else {
            self.of_words(&params, words::<u16>(codes, bits, &params, events), io, events)?
        };
        luma::move_to_mosaic(&mut extracted.features, pattern_px);
        Ok(extracted)
    }

    /// What a picture gives as the first frame of a run, at the threshold that its own corners ask for: every pixel is there, and records
    /// are taken at once.
    pub fn first_frame(mut self, codes: &Plane<u16>, bits: u32) -> Result<Extracted, Error> {
        self.frame(codes, bits, (1, 1), (&mut AtOnce, &mut AlwaysReady), &mut Events::default())
    }

    fn of_words<W: Word + rtl_models::fx_front_rows::PixelWord>(
        &mut self,
        params: &ExtractorParams,
        picture: Plane<W>,
        io: (&mut dyn Pixels, &mut dyn Records),
        events: &mut Events,
    ) -> Result<Extracted, Error> {
        let size = picture.size();
        // Longer words than those before may ask for less, shorter ones for more.
        let adapted = self.threshold.filter(|_| params.target_features > 0);
        let threshold = adapted.unwrap_or_else(|| start::start_threshold(params, &picture)).max(params.threshold);
        let (extracted, next) = match self.rung {
            Rung::Expected | Rung::Sampled => {
                let (extracted, next, queue_most) = functional(params, threshold, picture, io);
                self.queue_most = self.queue_most.max(Some(queue_most));
                (extracted, next)
            }
            Rung::Clocked => clocked::frame(params, threshold, &picture, io)?,
            Rung::Rtl => {
                let verilog = self.verilog.as_ref().expect("who chose this rung gave the Verilog");
                clocked::frame_in(verilog.rtl_simulator(), params, threshold, &picture, io)?
            }
        };
        self.threshold = Some(next);
        work::count(params, size, &extracted.counts, u64_from(extracted.features.len()), events);
        Ok(extracted)
    }
}

/// What a frame gives, the threshold of the next, and how full the queue was.
fn functional<W: Word>(
    params: &ExtractorParams,
    threshold: u16,
    picture: Plane<W>,
    (pixels, records): (&mut dyn Pixels, &mut dyn Records),
) -> (Extracted, u16, u32) {
    let mut sequence = Sequence::new(params, picture.size(), threshold);
    let end_clk = sequence.frame(picture, pixels, records);
    sequence.finish(records);
    let (counts, left) = (sequence.counts(), sequence.take());
    let (features, out_clk) = left.iter().map(|record| (record.feature, record.out_clk)).unzip();
    (Extracted { features, out_clk, counts, threshold, end_clk }, sequence.threshold(), sequence.queue_most())
}

/// Codes of 1 to 16 bits as words of the pipeline's: lower bits are cut off, missing ones are 0. Panics on other depths.
fn to_words<W: Word>(codes: &Plane<u16>, bits: u32, pipeline_bits: u32) -> Plane<W> {
    assert!((1..=16).contains(&bits), "codes have 1 to 16 bits");
    if bits >= pipeline_bits {
        let shift = bits - pipeline_bits;
        codes.map(|code| W::low(u32::from(code) >> shift))
    } else {
        let shift = pipeline_bits - bits;
        codes.map(|code| W::low(u32::from(code) << shift))
    }
}

/// The words that corners are looked for in: shifted codes, smoothed where the parameters ask for that.
fn words<W: Word>(codes: &Plane<u16>, bits: u32, params: &ExtractorParams, events: &mut Events) -> Plane<W> {
    let words = to_words(codes, bits, params.pipeline_bits);
    if params.smooths(bits) { presmooth::presmooth(&words, params.pipeline_bits, events) } else { words }
}

/// Shifts codes of 1 to 16 bits to the words of a pipeline of 8 to 16; bits beyond a code's depth are cut off. Panics on other depths.
pub fn to_bits(codes: &Plane<u16>, bits: u32, pipeline_bits: u32) -> Plane<u16> {
    let mask = crate::num::low_u16((1 << pipeline_bits) - 1);
    to_words::<u16>(codes, bits, pipeline_bits).map(|word| word & mask)
}

/// Shifts codes of 1 to 16 bits to words of 8; bits beyond a code's depth are cut off. Panics on other depths.
pub fn to_8_bits(codes: &Plane<u16>, bits: u32) -> Plane<u8> {
    to_words(codes, bits, 8)
}

/// Whether codes are of this depth, 1 to 16 bits.
fn check_codes(codes: &Plane<u16>, bits: u32) -> Result<(), Error> {
    if !(1..=16).contains(&bits) {
        return Err(Error::Run(format!("codes of {bits} bits cannot be extracted from; use 1 to 16")));
    }
    let all = codes.values().iter().fold(0, |all, &code| all | code);
    if u32::from(all) >> bits == 0 {
        return Ok(());
    }
    let most = codes.values().iter().max().expect("some code has a bit that is set");
    Err(Error::Run(format!("a code of {most} is none of {bits} bits; use {} bits", 16 - most.leading_zeros())))
}

/// Features of one frame whose pixels are all there and whose records are taken at once.
pub fn extract(
    codes: &Plane<u16>,
    bits: u32,
    params: &ExtractorParams,
    events: &mut Events,
) -> Result<Vec<Feature>, Error> {
    let extracted = Extractor::new(params).frame(codes, bits, (1, 1), (&mut AtOnce, &mut AlwaysReady), events)?;
    Ok(extracted.features)
}

/// Every corner of the full picture by rows, then columns, without cells, queue or octaves: what OpenCV lists. Those whose patch
/// leaves the picture have an empty descriptor and angle 0.
pub fn every_corner(codes: &Plane<u16>, bits: u32, params: &ExtractorParams) -> Result<Vec<Feature>, Error> {
    ExtractorParams::check_size(codes.size())?;
    check_codes(codes, bits)?;
    let params = &params.for_codes(bits);
    let threshold = params.threshold;
    let events = &mut Events::default();
    Ok(if params.pipeline_bits == 8 {
        let picture = words::<u8>(codes, bits, params, events);
        describe_every(&picture, &fast9(&picture, u8::low(threshold.into())), params)
    } else {
        let picture = words::<u16>(codes, bits, params, events);
        describe_every(&picture, &fast9(&picture, threshold), params)
    })
}

/// Clocks of a frame whose pixels are always there and whose rows never wait.
pub fn frame_clk(params: &ExtractorParams, size: Size) -> u64 {
    rows::frame_clk(&params.octave_sizes(size))
}
