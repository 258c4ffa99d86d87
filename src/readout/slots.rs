//! The exposures of one frame and the lines in which each is read. Computes the slots, and the shortest frame that holds them.
//!
//! The rule is that of Sony's DOL (digital overlap) sensors: an array row is read once a slot, the longest exposure first. With n
//! slots a line out of n belongs to each, so rows follow one another every n lines and a frame's VTS counts the lines of all slots
//! (Sony's FSC, n times VMAX). Slot k of a row is read `offset_k` lines after its slot 0 (RHS), with `offset_k = k (mod n)` so
//! that no two rows need the same line, and its exposure begins no earlier than the end of the line in which the slot before it was
//! read. The next frame's slot 0 begins after the last slot's line.

use super::params::{Hdr, ReadoutParams};
use crate::num::{f64_from_u64, u64_half_even};

/// One exposure of a frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Slot {
    /// Exposure in whole lines.
    pub exposure_lines: u64,
    /// Lines from the read of a row's slot 0 to the read of this one.
    pub offset_lines: u64,
}

/// The slots of a frame whose longest exposure has the given lines.
pub(super) fn slots(exposure_lines: u64, params: &ReadoutParams) -> Vec<Slot> {
    let mut slots = vec![Slot { exposure_lines, offset_lines: 0 }];
    let Hdr::MultiExposure { exposures, ratio } = params.hdr else { return slots };
    let (count, least) = (u64::from(exposures), u64::from(params.exposure_lines_min));
    let mut exact_lines = f64_from_u64(exposure_lines);
    let mut before = 0;
    for slot in 1..count {
        exact_lines /= ratio;
        let exposure_lines = u64_half_even(exact_lines).max(least);
        let earliest = before + 1 + exposure_lines;
        // The first line from there that belongs to this slot.
        let offset_lines = earliest + (count + slot - earliest % count) % count;
        slots.push(Slot { exposure_lines, offset_lines });
        before = offset_lines;
    }
    slots
}

/// What a frame must hold, each in lines.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FrameDemand {
    /// From the line of the first row's first slot to that of the last row's last.
    pub rows: u64,
    /// The longest exposure with the margin, after the last slot's line where there are several.
    pub exposure: u64,
}

impl FrameDemand {
    /// The shortest frame that holds all slots.
    pub fn lines(self) -> u64 {
        self.rows.max(self.exposure)
    }
}

/// The demand of these slots. `reads` lines are read in each, and slot 0 lasts `fine_clk` clocks beyond its whole lines.
pub(super) fn frame_demand(slots: &[Slot], reads: u32, fine_clk: u32, params: &ReadoutParams) -> FrameDemand {
    let (count, last) = (crate::num::u64_from(slots.len()), slots[slots.len() - 1]);
    let margin = u64::from(params.exposure_margin_lines);
    let kept = if count > 1 { last.offset_lines + margin.max(1) } else { margin };
    FrameDemand {
        rows: count * (u64::from(params.black_rows) + u64::from(reads) - 1) + last.offset_lines + 1,
        exposure: slots[0].exposure_lines + u64::from(fine_clk > 0) + kept,
    }
}

/// The longest slot 0 in whole lines, with the given clocks beyond them, that a frame holds; 0 where it holds none.
pub(super) fn longest_exposure(frame_lines: u64, reads: u32, fine_clk: u32, params: &ReadoutParams) -> u64 {
    let fits = |lines| frame_demand(&slots(lines, params), reads, fine_clk, params).lines() <= frame_lines;
    // Demands grow with the exposure, so halving finds the last that fits.
    let (mut low, mut high) = (0, frame_lines + 1);
    while high - low > 1 {
        let middle = low + (high - low) / 2;
        if fits(middle) { low = middle } else { high = middle }
    }
    low
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::readout::{ExposureSetting, Shutter};

    fn params(exposures: u32, ratio: f64) -> ReadoutParams {
        let hdr = Hdr::MultiExposure { exposures, ratio };
        ReadoutParams {
            hdr,
            ..ReadoutParams::plain(Shutter::Rolling, 1000, 4000, 1_000_000, ExposureSetting::Lines(1))
        }
    }

    /// IMX290-like: VMAX 1125, two exposures, FSC 2250; RHS1 is odd, as its data sheet and drivers demand (2 n + 1).
    #[test]
    fn two_exposures_interleave_as_dol_does() {
        let slots = slots(1600, &params(2, 16.0));
        assert_eq!(slots[1], Slot { exposure_lines: 100, offset_lines: 101 });
        let demand = frame_demand(&slots, 1080, 0, &params(2, 16.0));
        assert_eq!(demand, FrameDemand { rows: 2 * 1079 + 102, exposure: 1600 + 101 + 1 });
        // 2270 lines leave an offset of 111, so 110 lines of the short one: 1768 / 16 = 110.5 rounds to them.
        assert_eq!(longest_exposure(2270, 1080, 0, &params(2, 16.0)), 1768);
    }

    #[test]
    fn every_slot_keeps_to_its_own_lines_and_begins_after_the_one_before() {
        let mut tried = 0;
        for count in 2..=4 {
            for ratio in [1.5, 2.0, 7.9, 16.0, 1000.0] {
                for exposure_lines in [1, 2, 3, 50, 777, 3000] {
                    let slots = slots(exposure_lines, &params(count, ratio));
                    for (number, pair) in slots.windows(2).enumerate() {
                        let number = crate::num::u64_from(number) + 1;
                        assert_eq!(pair[1].offset_lines % u64::from(count), number);
                        let begins = pair[1].offset_lines - pair[1].exposure_lines;
                        assert!(begins > pair[0].offset_lines && begins <= pair[0].offset_lines + u64::from(count));
                        tried += 1;
                    }
                }
            }
        }
        assert_eq!(tried, (1 + 2 + 3) * 5 * 6);
    }

    #[test]
    fn the_longest_exposure_is_the_frame_less_the_margin_where_there_is_one() {
        let plain = ReadoutParams::plain(Shutter::Rolling, 1000, 4000, 1_000_000, ExposureSetting::Lines(1));
        let params = ReadoutParams { exposure_margin_lines: 20, ..plain };
        assert_eq!(longest_exposure(1724, 480, 0, &params), 1704);
        assert_eq!(longest_exposure(480, 480, 0, &params), 460);
        assert_eq!(longest_exposure(20, 20, 0, &params), 0);
    }
}
