//! Orientation of a corner by the intensity centroid of a disc, twin of `verilog/fx_orient.sv`. Takes 27 columns of the smoothed patch;
//! the angle, in turns from +x towards +y, follows ten clocks after the last.

use crate::flips;
use crate::fx_ring::{Column, SIDE};
use crate::words::{Slope, SlopeSide, Turns};

/// Bits of `tan((2k + 1) pi / 256)`, rounded: the slopes half-way between neighbouring angles of the first octant.
const SLOPE_BITS: [u32; 32] = [
    804, 2414, 4026, 5644, 7268, 8901, 10545, 12202, 13874, 15564, 17273, 19005, 20762, 22546, 24360, 26208, 28093,
    30018, 31986, 34002, 36071, 38196, 40382, 42636, 44963, 47369, 49863, 52451, 55144, 57950, 60880, 63947,
];
/// Rows of the disc either side of its middle, by the column's distance from it: the floor of `sqrt(169 - d^2)`.
const REACH: [usize; 14] = [13, 12, 12, 12, 12, 12, 11, 10, 10, 9, 8, 6, 5, 0];
/// Rounds of the search for the octant's step.
const ROUNDS: u32 = 6;

/// One column's share of the moments.
#[derive(Clone, Copy, Debug, Default)]
struct Share {
    index: usize,
    sum: i32,
    arm: i32,
}

/// The octant in which the search runs.
#[derive(Clone, Copy, Debug, Default)]
struct Octant {
    long: u32,
    short: u32,
    steep: bool,
    x_below: bool,
    y_below: bool,
    steps: u32,
    round: u32,
}

impl Octant {
    fn of(x: i32, y: i32) -> Self {
        let (x_size, y_size) = (x.unsigned_abs(), y.unsigned_abs());
        let (long, short) = (x_size.max(y_size), x_size.min(y_size));
        Self { long, short, steep: y_size > x_size, x_below: x < 0, y_below: y < 0, steps: 0, round: 0 }
    }

    fn halve(&mut self) {
        let trial = self.steps + (32 >> self.round);
        let slope = Slope::from_bits(SLOPE_BITS[usize::try_from((trial - 1) % 32).expect("below 32")]);
        if trial <= 32 && SlopeSide::from(self.short) >= SlopeSide::from(slope).wrapping_mul_int(self.long.into()) {
            self.steps = trial;
        }
        self.round += 1;
    }

    fn angle(&self, bits: u32) -> Turns {
        let quarter = if self.steep { 64 - self.steps } else { self.steps };
        let turn = match (self.x_below, self.y_below) {
            _ if self.long == 0 => 0,
            (false, false) => quarter,
            (true, false) => 128 - quarter,
            (true, true) => 128 + quarter,
            (false, true) => 256 - quarter,
        };
        let [angle, ..] = turn.to_le_bytes();
        round_angle(Turns::from_bits(angle), bits)
    }
}

/// An angle rounded to its highest `bits`, half up; whole turns fall off. Eight bits or more leave it as it is.
pub const fn round_angle(angle: Turns, bits: u32) -> Turns {
    if bits >= 8 {
        return angle;
    }
    let half_step = Turns::from_bits(0x80 >> bits);
    let below_a_step = (half_step.to_bits() << 1).wrapping_sub(1);
    Turns::from_bits(angle.wrapping_add(half_step).to_bits() & !below_a_step)
}

/// The unit's registers.
#[derive(Debug, Default)]
pub struct FxOrient {
    share: Option<Share>,
    x_moment: i32,
    y_moment: i32,
    whole: bool,
    octant: Option<Octant>,
    angle: Option<Turns>,
    toggles: u64,
}

impl FxOrient {
    /// A unit in reset.
    pub fn new() -> Self {
        Self::default()
    }

    /// Forgets what runs; toggles stay.
    pub fn reset(&mut self) {
        *self = Self { toggles: self.toggles, x_moment: self.x_moment, y_moment: self.y_moment, ..Self::default() };
    }

    /// The angle, in the clock in which it is valid.
    pub fn angle(&self) -> Option<Turns> {
        self.angle
    }

    /// Bits of the two moments' registers that flipped.
    pub fn toggles(&self) -> u64 {
        self.toggles
    }

    /// One rising edge: column `index` of 27 may stand.
    pub fn tick(&mut self, angle_bits: u32, column: Option<(usize, &Column)>) {
        self.angle = None;
        if let Some(mut octant) = self.octant.take() {
            if octant.round == ROUNDS {
                self.angle = Some(octant.angle(angle_bits));
            } else {
                octant.halve();
                self.octant = Some(octant);
            }
        }
        if self.whole {
            self.octant = Some(Octant::of(self.x_moment, self.y_moment));
        }
        self.whole = false;
        if let Some(share) = self.share.take() {
            self.add(share);
            self.whole = share.index == SIDE - 1;
        }
        self.share = column.map(|(index, column)| Share::of(index, column));
    }

    fn add(&mut self, share: Share) {
        let offset = i32::try_from(share.index).expect("below 27") - 13;
        let (x, y) = if share.index == 0 { (0, 0) } else { (self.x_moment, self.y_moment) };
        let (x, y) = (x + share.sum * offset, y + share.arm);
        self.toggles += flips(self.x_moment.cast_unsigned(), x.cast_unsigned());
        self.toggles += flips(self.y_moment.cast_unsigned(), y.cast_unsigned());
        (self.x_moment, self.y_moment) = (x, y);
    }
}

impl Share {
    fn of(index: usize, column: &Column) -> Self {
        let reach = REACH[index.abs_diff(13)];
        let mut share = Self { index, sum: 0, arm: 0 };
        for (&pixel, offset) in column[13 - reach..=13 + reach].iter().zip(-i32::try_from(reach).expect("at most 13")..)
        {
            share.sum += i32::from(pixel);
            share.arm += i32::from(pixel) * offset;
        }
        share
    }
}
