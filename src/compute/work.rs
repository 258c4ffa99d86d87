//! Counts the events of the extractor's hardware in a frame.
//!
//! The rule follows the streaming form: logic of the front runs for every pixel of any picture; the cost of a corner
//! counts once it is served. Minima, maxima, adds, subtractions and compares of one word are operations; shifts by
//! constants and multiplexers are wires. Words of memories and operations are counted as words of 8 bits: a pipeline of 12
//! bits counts one and a half, rounded up over the frame.

use super::feature::ExtractorCounts;
use super::orientation;
use super::params::{ExtractorParams, PairPattern, Rank};
use super::patch::SIDE;
use crate::events::{Event, Events};
use crate::num::u64_from;
use crate::units::Size;

/// Words of a column of the window's memory: six rows above the newest. They are read and written together, one row further.
const WINDOW_WORDS: u64 = 6;
/// Words of a column of the scores' memory.
const SCORE_WORDS: u64 = 2;
/// 16 + 16 minima and maxima of pairs, 16 of fours, 16 of eights (8 + 8 each), 16 + 16 + 16 of the last pixel and the
/// running best, two differences and their maximum: the network of `fast::arc_difference`.
const SCORE_OPS: u64 = 8 * 2 * 6 + 3;
/// The compares with eight neighbours and the threshold, and the decrement.
const SUPPRESS_OPS: u64 = 10;
/// Two passes of a triangle kernel: six adds and one more for the weight of three, twice, and the rounding add.
const SMOOTH_OPS: u64 = 2 * (6 + 2) + 1;
/// Three adds of four pixels and the rounding.
const HALF_OPS: u64 = 4;
/// Two gradients of five adds each; three running sums over five columns and five rows (four adds and a subtraction each way).
const HARRIS_OPS: u64 = 2 * 5 + 3 * (4 + 5) + 4;
/// Three products of gradients; two of sums and the trace's square.
const HARRIS_MACS: u64 = 3 + 3;

/// Weighted sums of three rows and three columns, of all nine, two slopes; two dividends of three adds and two quotients of five steps.
const SUBPIXEL_OPS: u64 = 12 + 2 + 2 + 2 * 3 + 2 * 5;
/// Products that turn both points of a pair.
const ROTATOR_MACS: u64 = 2 * 4;
/// Compares of an angle's slope, each with a product.
const SLOPES: u64 = 32;

/// Counts a frame with the given number of features.
pub(super) fn count(
    params: &ExtractorParams,
    size: Size,
    counts: &ExtractorCounts,
    features: u64,
    events: &mut Events,
) {
    let sizes = params.octave_sizes(size);
    let pixels: u64 = sizes.iter().map(|size| u64_from(size.pixel_count())).sum();
    let halved = pixels - u64_from(size.pixel_count());
    let mut work = ExtractorWork::default();
    picture(params, pixels, halved, &mut work);
    choice(params, counts, &mut work);
    served(params, features, &mut work);
    work.add_to(params, events);
}

impl ExtractorParams {
    /// Counts what so many features add to the frame of a picture without corners, where each is the only corner of its cell.
    pub fn count_features(&self, features: u64, events: &mut Events) {
        let mut work = ExtractorWork::default();
        choice(self, &ExtractorCounts { corners: features, ..ExtractorCounts::default() }, &mut work);
        served(self, features, &mut work);
        work.add_to(self, events);
    }
}

#[derive(Default)]
struct ExtractorWork {
    writes: u64,
    reads: u64,
    ops: u64,
    macs: u64,
}

impl ExtractorWork {
    /// Adds it to the events, in words of 8 bits.
    fn add_to(&self, params: &ExtractorParams, events: &mut Events) {
        let words = |count: u64| (count * u64::from(params.pipeline_bits)).div_ceil(8);
        events.add(Event::LineBufferWrite, words(self.writes));
        events.add(Event::LineBufferRead, words(self.reads));
        events.add(Event::ComputeOp, words(self.ops));
        events.add(Event::ComputeMac, words(self.macs));
    }
}

/// Memories and logic that run for every pixel of every octave.
fn picture(params: &ExtractorParams, pixels: u64, halved: u64, work: &mut ExtractorWork) {
    // Window and scores; and the smoothed pixel into the ring.
    work.writes += (WINDOW_WORDS + SCORE_WORDS + 1) * pixels;
    work.reads += (WINDOW_WORDS + SCORE_WORDS) * pixels;
    work.ops += (SCORE_OPS + SUPPRESS_OPS + SMOOTH_OPS) * pixels;
    // A half-scale pixel goes through the row buffer.
    work.writes += halved;
    work.reads += halved;
    work.ops += HALF_OPS * halved;
    if params.rank == Rank::Harris {
        // One row of ranks of two words.
        work.writes += 2 * pixels;
        work.reads += 2 * pixels;
        work.ops += HARRIS_OPS * pixels;
        work.macs += HARRIS_MACS * pixels;
    }
}

/// A corner with its patch is compared with its cell's list, which is read and written; a list that was kept is read once more.
fn choice(params: &ExtractorParams, counts: &ExtractorCounts, work: &mut ExtractorWork) {
    let entries = u64::from(params.per_cell);
    work.ops += entries * counts.corners;
    work.reads += (entry_words(params) * entries) * counts.corners;
    work.writes += (entry_words(params) * entries) * counts.corners;
    work.reads += entry_words(params) * (counts.corners - counts.unselected);
}

/// Words of an entry of a list: two coordinates and a rank of 16 bits at most, and nine scores where there is a fit.
fn entry_words(params: &ExtractorParams) -> u64 {
    4 + if params.subpixel { 9 } else { 1 }
}

/// What is done for each corner that leaves: the fit, the orientation and the descriptor.
fn served(params: &ExtractorParams, features: u64, work: &mut ExtractorWork) {
    if params.subpixel {
        work.ops += SUBPIXEL_OPS * features;
    }
    // The patch goes from the ring to the engine's memory, and its disc into sums of columns and rows on the way.
    let side = u64_from(SIDE);
    work.reads += side * side * features;
    work.writes += side * side * features;
    work.ops += 2 * orientation::disc_pixels() * features;
    work.macs += (2 * side + SLOPES) * features;
    // The descriptor: both points of a pair turned, their two rows of the patch read, and compared.
    let pairs = u64::from(params.descriptor_bits);
    if params.pattern == PairPattern::Gaussian {
        work.macs += ROTATOR_MACS * pairs * features;
    }
    work.reads += 2 * side * pairs * features;
    work.ops += pairs * features;
}
