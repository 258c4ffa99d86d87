//! Sub-pixel position of a corner, twin of `verilog/fx_fit.sv`: 2.5 times the centroid of nine arc differences, with weights (1 2 1) in
//! both directions, in pixels from -1 to 15/16. Latency: 13 clocks.

use crate::words::ShiftPx;

/// The unit's registers: weighted right less left and lower less upper, the sum of all, and one divider.
#[derive(Debug, Default)]
pub struct FxFit {
    state: u32,
    gx: i32,
    gy: i32,
    sum: i32,
    rest: i32,
    quotient: i16,
    offset: (ShiftPx, ShiftPx),
}

impl FxFit {
    /// A unit in reset.
    pub fn new() -> Self {
        Self::default()
    }

    /// Forgets what runs.
    pub fn reset(&mut self) {
        self.state = 0;
    }

    /// (dx, dy), whole 13 clocks after `go`.
    pub fn offset(&self) -> (ShiftPx, ShiftPx) {
        self.offset
    }

    /// One rising edge: `go` brings nine values by rows.
    pub fn tick(&mut self, go: Option<[u16; 9]>) {
        match self.state {
            1 => self.rest = 80 * self.gx + 33 * self.sum,
            7 => self.rest = 80 * self.gy + 33 * self.sum,
            2..=6 => self.divide(7 - self.state),
            8..=12 => self.divide(13 - self.state),
            _ => {}
        }
        match self.state {
            6 => self.offset.0 = self.shift(),
            12 => self.offset.1 = self.shift(),
            _ => {}
        }
        self.state = if (1..12).contains(&self.state) { self.state + 1 } else { 0 };
        if let Some(resp) = go {
            self.begin(resp.map(i32::from));
        }
    }

    fn begin(&mut self, [a, b, c, d, e, f, g, h, i]: [i32; 9]) {
        let (left, middle, right) = (a + 2 * d + g, b + 2 * e + h, c + 2 * f + i);
        (self.gx, self.gy) = (right - left, (g + 2 * h + i) - (a + 2 * b + c));
        self.sum = left + 2 * middle + right;
        self.state = 1;
    }

    /// The quotient of five bits stands a pixel above the shift.
    fn shift(&self) -> ShiftPx {
        ShiftPx::from_bits(self.quotient).wrapping_sub(ShiftPx::ONE)
    }

    /// One bit of the quotient, of weight the sum times 2^shift.
    fn divide(&mut self, shift: u32) {
        let less = self.rest - (self.sum << shift);
        self.quotient = self.quotient << 1 & 31 | i16::from(less >= 0);
        if less >= 0 {
            self.rest = less;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand_xoshiro::Xoshiro256PlusPlus;
    use rand_xoshiro::rand_core::{Rng, SeedableRng};

    /// The definition, by a division.
    fn centroid(r: [u16; 9]) -> (i64, i64) {
        let weights = [1, 2, 1, 2, 4, 2, 1, 2, 1_i64];
        let weigh = |of: &dyn Fn(usize) -> i64| (0..9).map(|n| weights[n] * of(n) * i64::from(r[n])).sum::<i64>();
        let across = |n: usize| [-1, 0, 1][n % 3];
        let along = |n: usize| [-1, 0, 1][n / 3];
        let sum = weigh(&|_| 1);
        // 16 * 2.5 = 40, and a half more.
        let quotient = |above: i64| (80 * above + sum).div_euclid(2 * sum).clamp(-16, 15);
        (quotient(weigh(&across)), quotient(weigh(&along)))
    }

    #[test]
    fn the_serial_fit_is_the_rounded_and_clipped_division() {
        let mut random = Xoshiro256PlusPlus::seed_from_u64(41);
        let (mut tried, mut inner, mut clipped) = (0, 0, 0);
        for case in 0..200_000_u32 {
            let mut next = || u16::try_from(random.next_u64() >> 48).expect("sixteen bits");
            let bits = [8, 10, 16][usize::try_from(case % 3).expect("small")];
            let mut resp: [u16; 9] = core::array::from_fn(|_| next() >> (16 - bits));
            // Corners are peaks; every seventh one has equals or nothing around it.
            resp[4] = (0xFFFF >> (16 - bits)) - (next() >> (16 - bits) >> 3);
            if case % 7 == 0 {
                let (full, kept) = (resp[4], next());
                (0..9).filter(|&n| n != 4).for_each(|n| resp[n] = if kept >> n & 1 == 1 { full } else { 0 });
            }
            let mut fit = FxFit::new();
            fit.tick(Some(resp));
            (0..12).for_each(|_| fit.tick(None));
            let (dx, dy) = (fit.offset().0.to_bits(), fit.offset().1.to_bits());
            assert_eq!((i64::from(dx), i64::from(dy)), centroid(resp), "{resp:?}");
            tried += 1;
            inner += u32::from(dx != 0 && dx.abs() < 15);
            clipped += u32::from(dx == -16 || dx == 15);
        }
        assert!(tried == 200_000 && inner > 20_000 && clipped > 1_000, "{inner} points inside, {clipped} clipped");
    }
}
