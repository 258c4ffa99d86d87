//! Smoothing by the 7x7 triangle (1 2 3 4 3 2 1)^2 / 256, twin of `verilog/fx_smooth.sv`. Converts columns of seven pixels to smoothed
//! pixels in DN, rounded half up.

use crate::words::{TriangleMean, rounded};
use crate::{flips, flips_of};

/// Column sum, the transposed filter's taps and the pixel on the pins.
#[derive(Clone, Debug, Default)]
pub(crate) struct FxSmooth {
    sum: u32,
    taps: [u32; 6],
    sm_valid: bool,
    sm_pixel: u16,
    pub(crate) toggles: u64,
}

/// The sum of a column under the weights 1 2 3 4 3 2 1.
#[inline(always)]
pub(crate) fn column_sum(column: &[u16; 7]) -> u32 {
    let [a, b, c, d, e, f, g] = column.map(u32::from);
    (a + g) + 2 * (b + f) + 3 * (c + e) + 4 * d
}

impl FxSmooth {
    pub(crate) fn pixel(&self) -> (bool, u16) {
        (self.sm_valid, self.sm_pixel)
    }

    pub(crate) fn reset(&mut self) {
        (self.sm_valid, self.sm_pixel) = (false, 0);
    }

    /// A clock that is not enabled: a pixel is valid for one clock only.
    pub(crate) fn idle(&mut self) {
        self.toggles += u64::from(self.sm_valid);
        self.sm_valid = false;
    }

    /// One enabled clock.
    pub(crate) fn tick(&mut self, middle: &[u16; 7], whole: bool) {
        let (once, [a, b, c, d, e, f]) = (self.sum, self.taps);
        self.toggles += flips(self.sm_valid.into(), whole.into());
        self.sm_valid = whole;
        if whole {
            // Seven whole columns weigh at most 256 (2^16 - 1), so the quotient fits.
            let pixel = u16::try_from(rounded(TriangleMean::from_bits(f + once))).expect("a weighted mean of pixels");
            self.toggles += flips(self.sm_pixel.into(), pixel.into());
            self.sm_pixel = pixel;
        }
        let taps = [once, a + 2 * once, b + 3 * once, c + 4 * once, d + 3 * once, e + 2 * once];
        let sum = column_sum(middle);
        self.toggles += flips(self.sum, sum) + flips_of(&self.taps, &taps);
        (self.sum, self.taps) = (sum, taps);
    }
}
