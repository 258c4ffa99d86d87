//! FAST-9/16 score, twin of `verilog/fx_fast.sv`: maximum over all nine-pixel arcs of the arc's minimum difference to the centre, in DN.
//! Latency: three enabled clocks.

use crate::{flips, flips_of_words};

/// The network's registers.
#[derive(Clone, Debug, Default)]
pub(crate) struct FxFast {
    least: [u16; 8],
    greatest: [u16; 8],
    centres: [u16; 2],
    bright: u16,
    dark: u16,
    difference: u16,
    pub(crate) toggles: u64,
}

/// Least pixel of the brightest arc of nine and greatest pixel of the darkest one, for each pair of arcs that share eight.
#[inline(always)]
pub(crate) fn arcs(circle: &[u16; 16]) -> ([u16; 8], [u16; 8]) {
    let (mut low_2, mut high_2, mut low_4, mut high_4) = ([0; 8], [0; 8], [0; 8], [0; 8]);
    for k in 0..8 {
        let (odd, even) = (circle[2 * k + 1], circle[(2 * k + 2) % 16]);
        (low_2[k], high_2[k]) = (odd.min(even), odd.max(even));
    }
    for k in 0..8 {
        (low_4[k], high_4[k]) = (low_2[k].min(low_2[(k + 1) % 8]), high_2[k].max(high_2[(k + 1) % 8]));
    }
    let (mut least, mut greatest) = ([0; 8], [0; 8]);
    for k in 0..8 {
        let (before, after) = (circle[2 * k], circle[(2 * k + 9) % 16]);
        least[k] = low_4[k].min(low_4[(k + 2) % 8]).min(before.max(after));
        greatest[k] = high_4[k].max(high_4[(k + 2) % 8]).max(before.min(after));
    }
    (least, greatest)
}

impl FxFast {
    pub(crate) fn difference(&self) -> u16 {
        self.difference
    }

    /// One enabled clock. `whole` belongs to the slot whose difference comes next.
    pub(crate) fn tick(&mut self, circle: &[u16; 16], centre: u16, whole: bool) {
        let before = (self.least, self.greatest, self.centres, self.bright, self.dark, self.difference);
        let above = self.bright.saturating_sub(self.centres[1]);
        let below = self.centres[1].saturating_sub(self.dark);
        self.difference = if whole { above.max(below) } else { 0 };
        self.bright = self.least.iter().fold(0, |most, &value| most.max(value));
        self.dark = self.greatest.iter().fold(u16::MAX, |least, &value| least.min(value));
        self.centres = [centre, self.centres[0]];
        (self.least, self.greatest) = arcs(circle);
        self.toggles += flips_of_words(&before.0, &self.least) + flips_of_words(&before.1, &self.greatest);
        self.toggles += flips_of_words(&before.2, &self.centres);
        let ends = [(before.3, self.bright), (before.4, self.dark), (before.5, self.difference)];
        self.toggles += ends.iter().map(|&(a, b)| flips(a.into(), b.into())).sum::<u64>();
    }
}
