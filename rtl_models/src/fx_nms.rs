//! Strict 3x3 non-maximum suppression, twin of `verilog/fx_nms.sv`. Keeps two rows of differences in line buffers; outputs a corner's
//! score (DN) and its nine differences. Latency: two enabled clocks.

use crate::{flips, flips_of_words};

/// The window over three rows of differences and the corner on the pins.
#[derive(Debug)]
pub(crate) struct FxNms<'a> {
    scores: &'a mut [[u16; 2]],
    above: [u16; 2],
    rows: [[u16; 3]; 3],
    corner_valid: bool,
    corner_score: u16,
    corner_resp: [u16; 9],
    pub(crate) toggles: u64,
}

/// What enters beside the difference.
#[derive(Clone, Copy, Debug)]
pub(crate) struct NmsIn {
    /// Word to read for the next slot.
    pub(crate) read: Option<usize>,
    /// Word of the slot whose difference is there; none in a virtual column.
    pub(crate) column: Option<usize>,
    pub(crate) difference: u16,
    pub(crate) peak: bool,
    pub(crate) threshold: u16,
}

impl<'a> FxNms<'a> {
    pub(crate) fn new(scores: &'a mut [[u16; 2]]) -> Self {
        let (corner_valid, corner_score, corner_resp) = (false, 0, [0; 9]);
        Self { scores, above: [0; 2], rows: [[0; 3]; 3], corner_valid, corner_score, corner_resp, toggles: 0 }
    }

    pub(crate) fn corner(&self) -> (bool, u16, [u16; 9]) {
        (self.corner_valid, self.corner_score, self.corner_resp)
    }

    pub(crate) fn reset(&mut self) {
        (self.corner_valid, self.corner_score, self.corner_resp) = (false, 0, [0; 9]);
    }

    /// A clock that is not enabled: a corner is valid for one clock only.
    pub(crate) fn idle(&mut self) {
        self.toggles += u64::from(self.corner_valid);
        self.corner_valid = false;
    }

    /// One enabled clock; true if a corner comes.
    pub(crate) fn tick(&mut self, pins: NmsIn) -> bool {
        let [[a, b, c], [d, middle, e], [f, g, h]] = self.rows;
        let found =
            pins.peak && middle > pins.threshold && [a, b, c, d, e, f, g, h].iter().all(|&other| middle > other);
        self.toggles += flips(self.corner_valid.into(), found.into());
        self.corner_valid = found;
        if found {
            let resp = [a, b, c, d, middle, e, f, g, h];
            self.toggles +=
                flips(self.corner_score.into(), u32::from(middle) - 1) + flips_of_words(&self.corner_resp, &resp);
            (self.corner_score, self.corner_resp) = (middle - 1, resp);
        }
        let [older, old] = if pins.column.is_some() { self.above } else { [0; 2] };
        let next = [[b, c, older], [middle, e, old], [g, h, pins.difference]];
        for (row, next) in self.rows.iter_mut().zip(&next) {
            self.toggles += flips_of_words(row, next);
            *row = *next;
        }
        let word = [self.above[1], pins.difference];
        if let Some(address) = pins.read {
            self.above = self.scores[address];
        }
        if let Some(address) = pins.column {
            self.scores[address] = word;
        }
        found
    }
}
