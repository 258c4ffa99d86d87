//! Smoothing before corner detection, for pictures of few bits: a 7x7 binomial kernel.
//!
//! Codes of two bits are four plateaus: FAST's differences take three values, so a threshold has nothing between all corners and none;
//! single pixels of noise at a plateau's edge are corners, and an edge's position within a pixel is lost. A mean of many pixels
//! brings back levels between the four, and an edge's position with them, because noise and the shape of the edge let neighbours change
//! at different positions. In hardware: six row memories before the extractor's own, shifts and adds. It runs before every form of the
//! extractor and has no hardware twin; nor has the grey of a mosaic.

use super::rows::Pixels;
use super::word::Word;
use crate::events::{Event, Events};
use crate::num::{u32_from, u64_from};
use crate::plane::Plane;
use crate::simd::kernel;
use crate::words::{BinomialColumn, BinomialMean, rounded};

/// Pixels on each side that a smoothed word is made of.
const REACH_PX: u32 = 3;
/// The same for slices.
const REACH: usize = 3;
/// Rows that are held: all but the newest.
const ROWS: u64 = 6;
/// 1 6 15 20 15 6 1: three sums of pairs, three adds for the weights (6 = 4 + 2, 15 = 16 - 1, 20 = 16 + 4) and three for the sum;
/// twice, and the rounding.
const OPS: u64 = 2 * (3 + 3 + 3) + 1;

/// The picture weighted by (1 6 15 20 15 6 1) in both directions over 4096, rounded half up; standard deviation 1.22 px. Beyond an edge
/// the outermost pixels are repeated.
///
/// Counts its work as words of the given width.
pub(super) fn presmooth<W: Word>(picture: &Plane<W>, bits: u32, events: &mut Events) -> Plane<W> {
    let pixels = u64_from(picture.size().pixel_count());
    let words = |count: u64| (count * pixels * u64::from(bits)).div_ceil(8);
    events.add(Event::LineBufferWrite, words(ROWS));
    events.add(Event::LineBufferRead, words(ROWS));
    events.add(Event::ComputeOp, words(OPS));
    binomial(picture)
}

/// What two by two pixels that stand out by so much leave at the highest of their smoothed words, rounded up: weights (15 + 20)^2 of 4096.
pub(super) fn block_of(difference: u32) -> u32 {
    BinomialMean::from_bits(difference * (15 + 20) * (15 + 20)).saturating_ceil().wrapping_to_num()
}

kernel! {
    fn binomial<'a, W: Word>(picture: &'a Plane<W>) -> Plane<W> {
        let (width, height) = (picture.width_px(), picture.height_px());
        let mut smoothed = picture.clone();
        let mut sums = vec![BinomialColumn::ZERO; width + 2 * REACH];
        for y in 0..height {
            let row = |offset: usize| &picture.row((y + offset).saturating_sub(REACH).min(height - 1))[..width];
            let rows = [row(0), row(1), row(2), row(3), row(4), row(5), row(6)];
            let middle = &mut sums[REACH..REACH + width];
            for x in 0..width {
                middle[x] = BinomialColumn::from_bits(weigh(rows.map(|row| row[x].number())));
            }
            let (first, last) = (sums[REACH], sums[REACH + width - 1]);
            sums[..REACH].fill(first);
            sums[REACH + width..].fill(last);
            for (word, seven) in smoothed.row_mut(y).iter_mut().zip(sums.windows(7)) {
                let seven = [seven[0], seven[1], seven[2], seven[3], seven[4], seven[5], seven[6]];
                let mean = BinomialMean::from_bits(weigh(seven.map(BinomialColumn::to_bits)));
                *word = W::low(rounded(mean));
            }
        }
        smoothed
    }
}

/// Seven values under the binomial weights, whose sum is 64.
#[inline(always)]
fn weigh([a, b, c, d, e, f, g]: [u32; 7]) -> u32 {
    (a + g) + 6 * (b + f) + 15 * (c + e) + 20 * d
}

/// When smoothed words are there: the last code that one is made of is three rows below and three columns to the right. Beyond the
/// last row the kernel continues without input.
pub(super) struct DelayedPixels<'a> {
    pub pixels: &'a mut dyn Pixels,
    pub height_px: usize,
}

impl DelayedPixels<'_> {
    fn row(&self, y: u32) -> u32 {
        (y + REACH_PX).min(u32_from(self.height_px) - 1)
    }
}

impl Pixels for DelayedPixels<'_> {
    fn offered(&mut self, x: u32, y: u32, clk: u64) -> u64 {
        self.pixels.offered(x + REACH_PX, self.row(y), clk)
    }

    fn offered_run(&mut self, first: u32, end: u32, y: u32, clk: u64) -> u64 {
        self.pixels.offered_run(first + REACH_PX, end + REACH_PX, self.row(y), clk)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compute::rows::RowByRow;
    use crate::compute::test_pictures::{noise, weighted_sum};

    #[test]
    fn it_is_the_weighted_mean_of_the_definition_up_to_the_edges() {
        let mut tried = 0;
        for (seed, width_px, height_px, levels) in [(1, 37, 21, 4), (2, 64, 9, 256), (3, 7, 7, 2), (4, 101, 8, 16)] {
            let picture = noise(width_px, height_px, levels, seed);
            let smoothed = presmooth(&picture, 8, &mut Events::default());
            let wide = presmooth(&picture.map(|word| u16::from(word) << 8), 16, &mut Events::default());
            for y in 0..picture.height_px() {
                for x in 0..picture.width_px() {
                    let sum = weighted_sum(&picture, [1, 6, 15, 20, 15, 6, 1], x, y);
                    assert_eq!(u32::from(smoothed.at(x, y)), (sum + 2048) / 4096, "seed {seed}, ({x}, {y})");
                    assert_eq!(u32::from(wide.at(x, y)), (256 * sum + 2048) / 4096, "seed {seed}, ({x}, {y})");
                    tried += 1;
                }
            }
        }
        assert_eq!(tried, 37 * 21 + 64 * 9 + 7 * 7 + 101 * 8);
    }

    #[test]
    fn flat_words_stay_and_work_is_counted_by_pixel_and_bit() {
        for word in [0, 64, 192, 255] {
            let flat = Plane::filled(crate::units::Size { width_px: 9, height_px: 8 }, word);
            let mut events = Events::default();
            assert_eq!(presmooth::<u8>(&flat, 8, &mut events), flat);
            let counted = [Event::LineBufferWrite, Event::LineBufferRead, Event::ComputeOp].map(|e| events.count(e));
            assert_eq!(counted, [6 * 72, 6 * 72, 19 * 72]);
        }
    }

    #[test]
    fn two_by_two_pixels_are_no_more_than_their_bound() {
        for step in [16_u8, 64, 128] {
            let bright = |i: usize| if [44, 45, 54, 55].contains(&i) { step } else { 0 };
            let size = crate::units::Size { width_px: 10, height_px: 10 };
            let picture = Plane::from_values(size, (0..100).map(bright).collect());
            let most = presmooth(&picture, 8, &mut Events::default()).values().iter().copied().max();
            let bound = block_of(step.into());
            assert!(
                most.is_some_and(|most| u32::from(most) <= bound && u32::from(most) + 1 >= bound),
                "{most:?} {bound}"
            );
        }
    }

    #[test]
    fn a_word_waits_for_the_code_three_rows_and_columns_later() {
        let mut rows = RowByRow { first_clk: 5, spacing: 20.into() };
        let mut delayed = DelayedPixels { pixels: &mut rows, height_px: 9 };
        assert_eq!(delayed.offered(0, 0, 0), 5 + 3 * 20 + 3);
        assert_eq!(delayed.offered(4, 5, 0), 5 + 8 * 20 + 7);
        assert_eq!(delayed.offered_run(0, 9, 2, 0), 5 + 5 * 20 + 3 + 8);
        // Rows below the last are the last once more: they wait for nothing.
        assert_eq!(delayed.offered(4, 7, 500), 500);
    }
}
