//! The order in which rows run through the shared window: rows of raster slots, one slot a clock, from the sizes of the octaves.
//!
//! A row of an octave has one slot more than pixels, and after an octave's last row comes one virtual row, so that every
//! corner and smoothed pixel leaves without a special end. Rows of octave k+1 run as soon as the odd row of octave k that
//! completes them has run.

use crate::units::Size;

/// Clocks in which a slot is taken, from a slot to what it gives: corner, smoothed pixel or end of a row.
pub const FRONT_LATENCY_CLK: u64 = 6;
/// Empty slots after a frame, so that its last row ends before the next frame's first row starts.
pub const DRAIN_CLK: u64 = FRONT_LATENCY_CLK + 1;

/// A row of slots.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct SlotRow {
    /// Its octave.
    pub octave: usize,
    /// Its number; for the virtual row the octave's height.
    pub y: u32,
    /// Whether it is the one after an octave's last.
    pub is_virtual: bool,
}

/// Rows of a frame in the order in which they run.
pub fn order(sizes: &[Size]) -> Vec<SlotRow> {
    let mut rows = Vec::new();
    for y in 0..sizes[0].height_px {
        push(&mut rows, sizes, 0, y);
    }
    rows
}

fn push(rows: &mut Vec<SlotRow>, sizes: &[Size], octave: usize, y: u32) {
    rows.push(SlotRow { octave, y, is_virtual: false });
    let height_px = sizes[octave].height_px;
    if y + 1 == height_px {
        rows.push(SlotRow { octave, y: height_px, is_virtual: true });
    }
    if y % 2 == 1 && octave + 1 < sizes.len() {
        push(rows, sizes, octave + 1, y / 2);
    }
}

/// Clocks of a frame whose pixels are always there and whose rows never wait.
pub fn frame_clk(sizes: &[Size]) -> u64 {
    let slots = |size: &Size| u64::from(size.width_px + 1) * u64::from(size.height_px + 1);
    sizes.iter().map(slots).sum::<u64>() + DRAIN_CLK
}

/// Where pixels come from, clock by clock.
pub trait Pixels {
    /// The first clock from this one on in which the next pixel, in column x of row y, is offered.
    fn offered(&mut self, x: u32, y: u32, clk: u64) -> u64;

    /// The same for pixels `first` to `end` of a row, each taken when it is offered, the first not before `clk`: the last one's clock.
    fn offered_run(&mut self, first: u32, end: u32, y: u32, clk: u64) -> u64 {
        (first..end).fold(clk.wrapping_sub(1), |before, x| self.offered(x, y, before.wrapping_add(1)))
    }
}

/// Every pixel is there when it is needed.
pub struct AtOnce;

impl Pixels for AtOnce {
    fn offered(&mut self, _: u32, _: u32, clk: u64) -> u64 {
        clk
    }

    fn offered_run(&mut self, first: u32, end: u32, _: u32, clk: u64) -> u64 {
        clk + u64::from(end - first) - 1
    }
}

/// Clocks of the extractor from row to row: a fraction, because the readout may have another clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RowSpacing {
    numerator: u64,
    denominator: u64,
}

impl RowSpacing {
    /// Rows whose distance in clocks of one frequency is given, in clocks of another. Panics on a frequency of 0.
    pub fn new(row_clk: u64, row_hz: u64, compute_hz: u64) -> Self {
        assert!(row_hz > 0 && compute_hz > 0, "both clocks run");
        let divisor = gcd(row_hz, compute_hz);
        Self { numerator: row_clk * (compute_hz / divisor), denominator: row_hz / divisor }
    }

    /// The first clock in which a row is whole, after the first row's.
    pub fn start_clk(self, row: u32) -> u64 {
        narrow((u128::from(row) * u128::from(self.numerator)).div_ceil(self.denominator.into()))
    }

    /// The last row that is whole in a clock.
    pub fn row_at(self, clk: u64) -> u64 {
        narrow(u128::from(clk) * u128::from(self.denominator) / u128::from(self.numerator))
    }

    /// Rows that are read until a clock, rounded up.
    pub fn rows_until(self, clk: u64) -> u64 {
        narrow((u128::from(clk) * u128::from(self.denominator)).div_ceil(self.numerator.into()))
    }

    /// From a row to the end of a clock, in parts of a clock, and how many parts a clock has. The row is whole by then.
    pub fn since(self, row: u64, clk: u64) -> (u64, u64) {
        let parts = u128::from(clk) * u128::from(self.denominator) - u128::from(row) * u128::from(self.numerator);
        (narrow(parts), self.denominator)
    }
}

/// Whole clocks.
impl From<u64> for RowSpacing {
    fn from(row_clk: u64) -> Self {
        Self { numerator: row_clk, denominator: 1 }
    }
}

fn narrow(clk: u128) -> u64 {
    u64::try_from(clk).expect("a frame is shorter than 2^64 clocks")
}

fn gcd(a: u64, b: u64) -> u64 {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Rows come at equal distances, from a row memory that gives one pixel a clock.
pub struct RowByRow {
    /// Clock of the first row's first pixel.
    pub first_clk: u64,
    /// From row to row.
    pub spacing: RowSpacing,
}

impl Pixels for RowByRow {
    fn offered(&mut self, x: u32, y: u32, clk: u64) -> u64 {
        clk.max(self.first_clk + self.spacing.start_clk(y) + u64::from(x))
    }

    fn offered_run(&mut self, first: u32, end: u32, y: u32, clk: u64) -> u64 {
        self.offered(first, y, clk) + u64::from(end - first) - 1
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_row_runs_once_after_the_two_rows_it_is_made_of() {
        for (width_px, height_px) in [(35, 41), (160, 132), (133, 67)] {
            let mut sizes = vec![Size { width_px, height_px }];
            while sizes.len() < 4 {
                sizes.push(super::super::half::half_size(sizes[sizes.len() - 1]));
            }
            let rows = order(&sizes);
            let total: u32 = sizes.iter().map(|size| size.height_px + 1).sum();
            assert_eq!(rows.len(), usize::try_from(total).unwrap(), "{width_px} x {height_px}");
            let index_of = |octave, y| rows.iter().position(|row| (row.octave, row.y) == (octave, y)).unwrap();
            for row in rows.iter().filter(|row| row.octave > 0 && !row.is_virtual) {
                let made_of = index_of(row.octave - 1, 2 * row.y + 1);
                assert!(made_of < index_of(row.octave, row.y));
                // Nothing of an upper octave runs between, so one row buffer serves all octaves.
                assert!(rows[made_of + 1..index_of(row.octave, row.y)].iter().all(|between| between.is_virtual));
            }
        }
    }

    #[test]
    fn a_run_of_pixels_is_its_pixels_one_by_one() {
        let mut rows = RowByRow { first_clk: 5, spacing: 20.into() };
        for (first, end, y, clk) in [(0, 9, 0, 0), (3, 9, 1, 4), (6, 9, 1, 90)] {
            let (mut next_clk, mut last_clk) = (clk, 0);
            for x in first..end {
                last_clk = rows.offered(x, y, next_clk);
                next_clk = last_clk + 1;
            }
            assert_eq!(rows.offered_run(first, end, y, clk), last_clk);
        }
        assert_eq!(AtOnce.offered_run(2, 5, 0, 7), 9);
    }

    #[test]
    fn rows_of_another_clock_are_whole_when_the_readout_has_read_them() {
        // 100 clocks of 48 MHz are 2,083.3 ns: 62.5 clocks of 30 MHz.
        let spacing = RowSpacing::new(100, 48_000_000, 30_000_000);
        assert_eq!((0..4).map(|row| spacing.start_clk(row)).collect::<Vec<_>>(), [0, 63, 125, 188]);
        for row in 0..1000 {
            let clk = spacing.start_clk(row);
            assert_eq!(spacing.row_at(clk), u64::from(row));
            assert_eq!(spacing.rows_until(clk + 1), u64::from(row) + 1);
            let (parts, of) = spacing.since(row.into(), clk);
            assert!(parts < of, "{parts} of {of}");
        }
        assert_eq!(RowSpacing::new(704, 36_044_800, 36_044_800), 704.into());
    }
}
