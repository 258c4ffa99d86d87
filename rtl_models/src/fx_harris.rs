//! Harris rank, twin of `verilog/fx_harris.sv`: the response r = det - trace^2 / 16 as a 16-bit float with 6 bits of exponent and 10 of
//! mantissa. Takes the window's three newest columns; a line buffer delays the result by one row.

use crate::words::{Significand, TraceShare};
use crate::{flips, flips_wide};

/// Sums of the gradients' products, xx, yy and xy, over some columns.
type Products = [i64; 3];

/// The pipeline's registers and the rank that the line buffer has read.
#[derive(Debug)]
pub(crate) struct FxHarris<'a> {
    ranks: &'a mut [u16],
    shift: u32,
    gradients: [[i64; 2]; 5],
    /// The newest column's products, then one to five columns'.
    sums: [Products; 6],
    terms: [i64; 3],
    positive: i64,
    code: u16,
    rank: u16,
    pub(crate) toggles: u64,
}

/// A positive number as 6 bits of exponent and the 10 bits below its leading one; 0 for 0.
#[inline(always)]
pub(crate) fn short_float(positive: i64) -> u16 {
    if positive == 0 {
        return 0;
    }
    let exponent = 63 - positive.leading_zeros();
    let aligned = if exponent < 10 { positive << (10 - exponent) } else { positive >> (exponent - 10) };
    let significand = Significand::from_bits(u16::try_from(aligned).expect("eleven bits"));
    u16::try_from(exponent << Significand::FRAC_NBITS).expect("r is below 2^50") | significand.frac().to_bits()
}

/// The terms of r: the product of the squares' sums, the square of the mixed sum, the square of the trace.
#[inline(always)]
pub(crate) fn terms([xx, yy, xy]: Products) -> [i64; 3] {
    [xx * yy, xy * xy, (xx + yy) * (xx + yy)]
}

#[inline(always)]
pub(crate) fn positive_part([products, mixed, squared]: [i64; 3]) -> i64 {
    (products - mixed - TraceShare::from_bits(squared).wrapping_to_num::<i64>()).max(0)
}

/// The 3x3 Sobel gradients, across and along, at the middle of three columns of three rows.
#[inline(always)]
pub(crate) fn sobel(columns: [[i64; 3]; 3]) -> [i64; 2] {
    let [[a, b, c], [d, _, e], [f, g, h]] = columns;
    [(f + 2 * g + h) - (a + 2 * b + c), (c + 2 * e + h) - (a + 2 * d + f)]
}

impl<'a> FxHarris<'a> {
    /// Ranks look at the upper 8 of a pixel's bits.
    pub(crate) fn new(ranks: &'a mut [u16], pix_bits: u32) -> Self {
        let (sums, gradients) = ([[0; 3]; 6], [[0; 2]; 5]);
        Self { ranks, shift: pix_bits - 8, gradients, sums, terms: [0; 3], positive: 0, code: 0, rank: 0, toggles: 0 }
    }

    pub(crate) fn rank(&self) -> u16 {
        self.rank
    }

    /// One enabled clock.
    pub(crate) fn tick(&mut self, right: &[[u16; 7]; 3], write: Option<usize>, read: Option<usize>) {
        if let Some(address) = read {
            self.rank = self.ranks[address];
        }
        if let Some(address) = write {
            self.ranks[address] = self.code;
        }
        let (code, positive, terms) = (short_float(self.positive), positive_part(self.terms), terms(self.sums[5]));
        let mut products = [0; 3];
        for [across, along] in self.gradients {
            products = add(products, [across * across, along * along, across * along]);
        }
        let [newest, one, two, three, four, _] = self.sums;
        let more = [one, two, three, four].map(|sum| add(sum, newest));
        let sums = [products, newest, more[0], more[1], more[2], more[3]];
        let column = |index: usize, at: usize| {
            let from = |offset: usize| i64::from(right[index][at + offset] >> self.shift);
            [from(0), from(1), from(2)]
        };
        let gradients = [0, 1, 2, 3, 4].map(|at| sobel([0, 1, 2].map(|index| column(index, at))));
        let wide = |before: &[i64], after: &[i64], bits: u32| -> u64 {
            let mask = (1 << bits) - 1;
            before.iter().zip(after).map(|(a, b)| flips_wide((a ^ b) & mask)).sum()
        };
        self.toggles += flips(self.code.into(), code.into()) + wide(&[self.positive], &[positive], 50);
        self.toggles += wide(&self.terms, &terms, 52);
        self.toggles += self.sums.iter().zip(&sums).map(|(a, b)| wide(a, b, 26)).sum::<u64>();
        self.toggles += self.gradients.iter().zip(&gradients).map(|(a, b)| wide(a, b, 11)).sum::<u64>();
        (self.code, self.positive, self.terms, self.sums, self.gradients) = (code, positive, terms, sums, gradients);
    }
}

#[inline(always)]
fn add([a, b, c]: Products, [d, e, f]: Products) -> Products {
    [a + d, b + e, c + f]
}
