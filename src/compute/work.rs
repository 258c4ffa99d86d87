//! What the extractor's hardware does for a picture and for a corner. Enters: counts. Leaves: events.
//!
//! The rule follows the streaming form: pixels enter one after another, and line buffers are banks of 8-bit words that turn
//! over by address, so a word is written once and read once for each later row that needs it. Minima, maxima, adds,
//! subtractions and compares of one word are operations; shifts by constants and multiplexers are wires. Logic runs
//! for every pixel, as a pipeline does, whatever the picture shows.

use crate::compute::orientation;
use crate::events::{Event, Events};
use crate::num::u64_from;
use crate::units::Size;

/// Rows above the newest that a seven-row window reads from its line buffers.
const WINDOW_READS: u64 = 6;
/// Rows of scores that suppression reads.
const SCORE_READS: u64 = 2;
/// 16 + 16 minima and maxima of pairs, 16 of fours, 16 of eights (8 + 8 each), 16 + 16 + 16 of the last pixel and the
/// running best, two differences, their maximum, the compare and the decrement: the network of `fast::arc_difference`.
const SCORE_OPS: u64 = 8 * 2 * 6 + 5;
/// Seven maxima of eight neighbours and the compare.
const SUPPRESS_OPS: u64 = 8;
/// Two passes of a triangle kernel: six adds and one more for the weight of three, twice, and the rounding add.
const SMOOTH_OPS: u64 = 2 * (6 + 2) + 1;

/// Rows of the disc.
const DISC_ROWS: u64 = 31;
/// Nine scores from the score buffers.
const SUBPIXEL_READS: u64 = 9;
/// Sums of rows and columns, differences and the rounding of two quotients.
const SUBPIXEL_OPS: u64 = 12 + 2 + 4 + 3 + 4;
/// Six products of the two-by-two system, and two quotients of four steps each.
const SUBPIXEL_MACS: u64 = 6 + 2 * 4;

/// Buffers and logic that run for every pixel: detector, suppression and smoothing.
pub(crate) fn count_picture(size: Size, events: &mut Events) {
    let pixels = u64_from(size.pixel_count());
    // Written: the pixel, its score and its smoothed value. Detector and smoothing share their window of seven rows.
    events.add(Event::LineBufferWrite, 3 * pixels);
    events.add(Event::LineBufferRead, (WINDOW_READS + SCORE_READS) * pixels);
    events.add(Event::ComputeOp, (SCORE_OPS + SUPPRESS_OPS + SMOOTH_OPS) * pixels);
}

/// The choice by cells: a corner is compared with its cell's list by a binary search of eight steps at most.
pub(crate) fn count_choice(corners: usize, events: &mut Events) {
    events.add(Event::ComputeOp, 8 * u64_from(corners));
}

/// What is done for each corner that leaves: the fit, and with a whole patch the orientation and the descriptor.
pub(crate) fn count_corners(corners: usize, with_patch: usize, subpixel: bool, events: &mut Events) {
    let (corners, with_patch) = (u64_from(corners), u64_from(with_patch));
    if subpixel {
        events.add(Event::LineBufferRead, SUBPIXEL_READS * corners);
        events.add(Event::ComputeOp, SUBPIXEL_OPS * corners);
        events.add(Event::ComputeMac, SUBPIXEL_MACS * corners);
    }
    // The disc: one read a pixel, a multiply-accumulate for the column moment and an add for the row's sum; one more
    // multiply-accumulate a row. Its angle: five compares of a binary search, each with a product, and the two signs.
    let disc_pixels = orientation::disc_pixels();
    events.add(Event::LineBufferRead, disc_pixels * with_patch);
    events.add(Event::ComputeMac, (disc_pixels + DISC_ROWS + 5) * with_patch);
    events.add(Event::ComputeOp, (disc_pixels + 5 + 3) * with_patch);
    // The descriptor: 256 pairs, both points turned (four products each), read and compared.
    events.add(Event::ComputeMac, 256 * 2 * 4 * with_patch);
    events.add(Event::LineBufferRead, 256 * 2 * with_patch);
    events.add(Event::ComputeOp, 256 * with_patch);
}
