//! Sub-pixel place of a corner, twin of `verilog/fx_fit.sv`. Enters: nine arc differences. Leaves, 15 clocks later: the peak of
//! the least-squares quadratic through them, in sixteenths of a pixel, -8 to 7.

/// The unit's registers: slopes (six times), curvatures (three times), mixed curvature (four times), and one divider.
#[derive(Debug, Default)]
pub struct FxFit {
    state: u32,
    gx: i64,
    gy: i64,
    hxx: i64,
    hyy: i64,
    hxy: i64,
    determinant: i64,
    rest: i64,
    quotient: i16,
    offset: (i16, i16),
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

    /// (dx, dy), whole 15 clocks after `go`.
    pub fn offset(&self) -> (i16, i16) {
        self.offset
    }

    /// One rising edge: `go` brings nine values by rows.
    pub fn tick(&mut self, go: Option<[u16; 9]>) {
        match self.state {
            1 => self.determinant = 16 * self.hxx * self.hyy,
            2 => self.determinant -= 9 * self.hxy * self.hxy,
            3 => self.rest = 17 * self.determinant + 192 * self.hxy * self.gy,
            4 => self.rest -= 256 * self.hyy * self.gx,
            9 => self.rest = 17 * self.determinant + 192 * self.hxy * self.gx,
            10 => self.rest -= 256 * self.hxx * self.gy,
            5..=8 => self.divide(9 - self.state),
            11..=14 => self.divide(15 - self.state),
            _ => {}
        }
        match self.state {
            8 => self.offset.0 = self.peak(),
            14 => self.offset.1 = self.peak(),
            _ => {}
        }
        self.state = if (1..14).contains(&self.state) { self.state + 1 } else { 0 };
        if let Some(resp) = go {
            self.begin(resp.map(i64::from));
        }
    }

    fn begin(&mut self, [a, b, c, d, e, f, g, h, i]: [i64; 9]) {
        let (left, middle, right) = (a + d + g, b + e + h, c + f + i);
        let (top, centre, bottom) = (a + b + c, d + e + f, g + h + i);
        (self.gx, self.gy) = (right - left, bottom - top);
        (self.hxx, self.hyy, self.hxy) = (left - 2 * middle + right, top - 2 * centre + bottom, a - c - g + i);
        self.state = 1;
    }

    /// One bit of the quotient, of weight twice the determinant times 2^(shift - 1).
    fn divide(&mut self, shift: u32) {
        let less = self.rest - (self.determinant << shift);
        self.quotient = self.quotient << 1 & 15 | i16::from(less >= 0);
        if less >= 0 {
            self.rest = less;
        }
    }

    fn peak(&self) -> i16 {
        let none = self.hxx >= 0 || self.hyy >= 0 || self.determinant <= 0;
        if none { 0 } else { self.quotient - 8 }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The definition, by a division.
    fn peak(r: [u16; 9]) -> (i64, i64) {
        let r = r.map(i64::from);
        let column = |x: usize| r[x] + r[x + 3] + r[x + 6];
        let row = |y: usize| r[3 * y] + r[3 * y + 1] + r[3 * y + 2];
        let (gx, gy) = (2 * (column(2) - column(0)), 2 * (row(2) - row(0)));
        let (hxx, hyy) = (4 * (column(0) - 2 * column(1) + column(2)), 4 * (row(0) - 2 * row(1) + row(2)));
        let hxy = 3 * (r[0] - r[2] - r[6] + r[8]);
        let determinant = hxx * hyy - hxy * hxy;
        if hxx >= 0 || hyy >= 0 || determinant <= 0 {
            return (0, 0);
        }
        let quotient = |above: i64| (above * 32 + determinant).div_euclid(2 * determinant).clamp(-8, 7);
        (quotient(hxy * gy - hyy * gx), quotient(hxy * gx - hxx * gy))
    }

    #[test]
    fn the_serial_fit_is_the_rounded_and_clipped_division() {
        let (mut state, mut tried, mut inner) = (41_u64, 0, 0);
        for case in 0..200_000_u32 {
            let mut next = || {
                state = state.wrapping_mul(6_364_136_223_846_793_005).wrapping_add(1_442_695_040_888_963_407);
                u16::try_from(state >> 48).expect("sixteen bits")
            };
            let bits = [8, 10, 16][usize::try_from(case % 3).expect("small")];
            let mut resp: [u16; 9] = core::array::from_fn(|_| next() >> (16 - bits));
            // Corners are peaks.
            resp[4] = (0xFFFF >> (16 - bits)) - (next() >> (16 - bits) >> 3);
            let mut fit = FxFit::new();
            fit.tick(Some(resp));
            (0..14).for_each(|_| fit.tick(None));
            let (dx, dy) = fit.offset();
            assert_eq!((i64::from(dx), i64::from(dy)), peak(resp), "{resp:?}");
            tried += 1;
            inner += u32::from(dx != 0 && dx.abs() < 7);
        }
        assert!(tried == 200_000 && inner > 20_000, "{inner} places inside");
    }
}
