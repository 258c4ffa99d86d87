//! Kickback of comparators onto the ramp that they share. Computes the ramp's shift in nV from the number of flips at each clock.
//!
//! A comparator's regeneration couples charge back into its inputs (Razavi, The StrongARM Latch, IEEE Solid-State Circuits
//! Magazine 2015); on the shared ramp each flip leaves a step that the ramp's driver takes away again. In integers: flips at
//! clock t act from clock t + 1 on, each by the whole step; m clocks later `round(2^24 2^(-m / half life)) / 2^24` of the shift is
//! left, rounded to whole nV, halves up. A clock with flips makes a shift anew from what is left of the one before.

use super::params::AdcParams;
use crate::num::{i64_half_even, index};
use crate::words::DecayShare;

/// The step of one flip and its decay.
#[derive(Clone, Debug, PartialEq)]
pub struct Kickback {
    step_nv: i64,
    /// What is left after m clocks; nothing beyond the end.
    left: Vec<DecayShare>,
}

/// The shift of a ramp during one conversion.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Shift {
    base_nv: i64,
    /// Clock for which the base stands.
    since_clk: u32,
}

impl Kickback {
    /// `None` where a flip moves the ramp by less than half a nanovolt.
    pub fn from_params(params: &AdcParams) -> Option<Self> {
        let step_nv = i64_half_even(1000.0 * params.kickback_uv);
        let rate = -1.0 / f64::from(params.kickback_decay_clk);
        let left = (0..).map(|clocks| DecayShare::saturating_from_num(libm::exp2(rate * f64::from(clocks))));
        (step_nv != 0).then(|| Self { step_nv, left: left.take_while(|left| left.is_positive()).collect() })
    }

    /// The shift at a clock not before the last flips'.
    pub fn shift_nv(&self, shift: Shift, clock: u32) -> i64 {
        const HALF_NV: DecayShare = DecayShare::lit("0.5");
        let left = self.left.get(index(clock - shift.since_clk)).copied().unwrap_or(DecayShare::ZERO);
        // At most 4096 steps of 1e7 nV are in the base: below 2^36, so nothing wraps.
        left.wrapping_mul_int(shift.base_nv).wrapping_add(HALF_NV).wrapping_to_num()
    }

    /// The shift after `flips` comparators flipped at `clock`.
    #[must_use]
    pub fn after_flips(&self, shift: Shift, clock: u32, flips: u32) -> Shift {
        let since_clk = clock + 1;
        Shift { base_nv: self.shift_nv(shift, since_clk) + self.step_nv * i64::from(flips), since_clk }
    }

    /// Whether the ramp stands higher for it at that clock, and will fall back.
    pub fn falls_back(&self, shift: Shift, clock: u32) -> bool {
        self.shift_nv(shift, clock) > 0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::params::tests::paper_adc;
    use crate::num::f64_from_i64;

    #[test]
    fn a_shift_halves_in_every_half_life_and_is_gone_in_the_end() {
        for (kickback_uv, half_life) in [(37.5, 1), (-37.5, 4), (0.5, 100), (1e4, 1024)] {
            let params = AdcParams { kickback_uv, kickback_decay_clk: half_life, ..paper_adc() };
            let kickback = Kickback::from_params(&params).unwrap();
            let shift = kickback.after_flips(Shift::default(), 9, 3);
            for halvings in 0..8 {
                let found = f64_from_i64(kickback.shift_nv(shift, 10 + halvings * half_life));
                let exact = 3000.0 * kickback_uv / f64::from(1 << halvings);
                // Half a nanovolt of rounding, and half of 2^-24 of at most 3e7 nV in the factor.
                assert!((found - exact).abs() <= 1.5, "{found} nV for {exact}");
            }
            assert_eq!(kickback.shift_nv(shift, 10 + 26 * half_life), 0);
        }
        assert_eq!(Kickback::from_params(&AdcParams { kickback_uv: 0.0004, ..paper_adc() }), None);
    }

    #[test]
    fn flips_add_to_what_is_left() {
        let params = AdcParams { kickback_uv: 1.0, kickback_decay_clk: 2, ..paper_adc() };
        let kickback = Kickback::from_params(&params).unwrap();
        let shift = kickback.after_flips(Shift::default(), 5, 1);
        assert_eq!((kickback.shift_nv(shift, 6), kickback.shift_nv(shift, 8)), (1000, 500));
        let shift = kickback.after_flips(shift, 7, 2);
        assert_eq!((kickback.shift_nv(shift, 8), kickback.shift_nv(shift, 10)), (2500, 1250));
    }
}
