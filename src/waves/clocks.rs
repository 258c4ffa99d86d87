//! Converts clocks of two domains to whole picoseconds, rounded once.
//!
//! Every edge is a line's start, counted in `pix_clk` from the frame's first clock, and half clocks of one more domain, counted from
//! there: converters, lanes and link begin anew with each line. The instant is the exact rational sum; nothing is accumulated.

/// A frequency as a fraction in Hz.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Frequency {
    /// Clocks, 1 to 2^37.
    pub clocks: u64,
    /// In so many seconds, 1 to 8.
    pub seconds: u64,
}

impl Frequency {
    pub fn hz(clocks: u64) -> Self {
        Self { clocks, seconds: 1 }
    }

    /// The first edge of this clock at or after edge `clock` of another, both counted from one instant.
    pub fn first_edge_after(self, clock: u64, other: Self) -> u64 {
        let above = u128::from(clock) * u128::from(other.seconds) * u128::from(self.clocks);
        let edge = above.div_ceil(u128::from(other.clocks) * u128::from(self.seconds));
        u64::try_from(edge).expect("edges of one frame")
    }

    /// Whole clocks in so many of another.
    pub fn clocks_within(self, clocks: u64, other: Self) -> u64 {
        let above = u128::from(clocks) * u128::from(other.seconds) * u128::from(self.clocks);
        u64::try_from(above / (u128::from(other.clocks) * u128::from(self.seconds))).expect("clocks of one frame")
    }
}

/// Picoseconds to an edge: `line_clk` of `pix`, then `halves` half clocks of `domain`; the nearest, halves up.
pub fn instant_ps(pix: Frequency, line_clk: u64, domain: Frequency, halves: u64) -> u64 {
    // line_clk < 2^48, halves < 2^40 and frequencies below 2^37: the sum stays below 2^90.
    let line = u128::from(line_clk) * u128::from(pix.seconds) * 2 * u128::from(domain.clocks);
    let rest = u128::from(halves) * u128::from(domain.seconds) * u128::from(pix.clocks);
    let below = 2 * u128::from(domain.clocks) * u128::from(pix.clocks);
    let mut whole = (line + rest) / below;
    let mut remainder = (line + rest) % below;
    for _ in 0..4 {
        remainder *= 1000;
        whole = whole * 1000 + remainder / below;
        remainder %= below;
    }
    whole += u128::from(2 * remainder >= below);
    u64::try_from(whole).expect("a frame ends within 200 days")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn edges_are_the_nearest_picosecond_and_never_drift() {
        let (pix, adc) = (Frequency::hz(48_000_000), Frequency::hz(480_000_000));
        // 1 / 48 MHz is 20,833.33 ps; 1 / 480 MHz 2083.33.
        assert_eq!(instant_ps(pix, 1, adc, 0), 20_833);
        assert_eq!(instant_ps(pix, 2, adc, 0), 41_667);
        assert_eq!(instant_ps(pix, 0, adc, 2), 2_083);
        assert_eq!(instant_ps(pix, 0, adc, 3), 3_125);
        assert_eq!(instant_ps(pix, 1, adc, 2), 22_917);
        assert_eq!(instant_ps(pix, 48_000_000 * 3600, adc, 960_000_000), 3_601_000_000_000_000);
        // The extremes of what a config allows do not overflow.
        let slow = Frequency { clocks: 1000, seconds: 1 };
        let fast = Frequency { clocks: 2_250_000_000, seconds: 4 };
        assert_eq!(instant_ps(slow, 1 << 30, fast, 0), (1 << 30) * 1_000_000_000);
        assert_eq!(instant_ps(Frequency::hz(100_000_000_000), 1 << 47, fast, 1 << 39), {
            let line_ps = (1_u128 << 47) * 10;
            let rest_ps = ((1_u128 << 39) * 4 * 1_000_000_000_000 + 2_250_000_000) / (2 * 2_250_000_000);
            u64::try_from(line_ps + rest_ps).unwrap()
        });
    }

    #[test]
    fn edges_of_two_domains_are_compared_exactly() {
        let (adc, lane) = (Frequency::hz(480_000_000), Frequency::hz(240_000_000));
        let found = [0, 1, 2, 3, 9280].map(|clock| lane.first_edge_after(clock, adc));
        assert_eq!(found, [0, 1, 1, 2, 4640]);
        assert_eq!(adc.clocks_within(928, Frequency::hz(48_000_000)), 9280);
        assert_eq!(Frequency::hz(3).clocks_within(5, Frequency::hz(7)), 2);
    }
}
