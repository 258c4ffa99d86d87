//! Column counter with digital correlated double sampling, twin of `verilog/cds.sv`. Converts comparator bits, clock by clock or as the
//! crossings of a row, to codes in LSB: clip(black - n_reset + n_signal). Counts flipped bits for the energy model.

use crate::ramp_counter::{binary_from_gray, gray_from_binary};
use crate::{bits_set, flips, steps_below};

/// Run-time parameters of a column.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct CdsConfig {
    /// Depth in bits, 1 to 16: codes are clipped to 0 .. 2^bits - 1.
    pub bits: u32,
    /// Black level in LSB, the value from which the counter starts.
    pub black: u16,
    /// The shared count is latched, instead of counting in each column.
    pub latch_mode: bool,
    /// The shared count is in Gray code.
    pub gray: bool,
}

impl CdsConfig {
    /// Greatest code.
    #[inline(always)]
    pub fn code_max(&self) -> i32 {
        (1 << self.bits) - 1
    }
}

/// Pins that enter, as they stand at the rising edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CdsIn {
    /// Synchronous reset.
    pub rst: bool,
    /// Everything holds.
    pub stall: bool,
    /// The counter takes the black level.
    pub clear: bool,
    /// A ramp begins.
    pub arm: bool,
    /// The comparator is looked at.
    pub step: bool,
    /// The ramp is over.
    pub done: bool,
    /// The ramp is the reset ramp.
    pub down: bool,
    /// The ramp stands above the column's level.
    pub comparator: bool,
    /// Shared count, one step behind the ramp.
    pub count: u32,
}

/// Pins that leave, after the rising edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct CdsOut {
    /// Difference so far, 18 bits signed.
    pub value: i32,
    /// Latched count, 17 bits.
    pub latched: u32,
    /// The comparator has risen in this ramp.
    pub crossed: bool,
    /// The difference, clipped.
    pub code: u16,
}

/// One column's registers and what they have flipped.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Cds {
    value: i32,
    latched: u32,
    crossed: bool,
    toggles: u64,
}

const VALUE_BITS: u32 = 0x3_FFFF;

/// The low 18 bits of a difference.
#[inline(always)]
const fn register(value: i32) -> u32 {
    value.cast_unsigned() & VALUE_BITS
}

/// Sign-extends 18 bits, as the counter wraps.
#[inline(always)]
const fn wrapped(value: i32) -> i32 {
    (value << 14) >> 14
}

/// Bits that flip while an 18-bit two's complement counter moves step by step between two values: bit j flips
/// floor(high / 2^j) - floor(low / 2^j) times, and the sum over j of floor(x / 2^j) is 2 x - popcount(x), plus 2 below zero.
#[inline(always)]
fn travel_flips(low: i32, high: i32) -> u32 {
    let sum = |x: i32| 2 * x - bits_set(register(x)).cast_signed() - 2 * (x >> 31);
    (sum(high) - sum(low)).cast_unsigned()
}

#[inline(always)]
fn clipped(value: i32, code_max: i32) -> u16 {
    let code = if value < 0 { 0 } else { value };
    let code = if code > code_max { code_max } else { code };
    let [low, high, ..] = code.to_le_bytes();
    u16::from_le_bytes([low, high])
}

impl Cds {
    /// A column in reset.
    pub fn new() -> Self {
        Self::default()
    }

    /// Pins as they stand.
    #[inline(always)]
    pub fn out(&self, config: &CdsConfig) -> CdsOut {
        let code = clipped(self.value, config.code_max());
        CdsOut { value: self.value, latched: self.latched, crossed: self.crossed, code }
    }

    /// Bits flipped so far in counter and latch.
    pub fn toggles(&self) -> u64 {
        self.toggles
    }

    /// One rising edge.
    pub fn tick(&mut self, config: &CdsConfig, pins: CdsIn) -> CdsOut {
        let before = *self;
        if pins.rst {
            *self = Self { toggles: self.toggles, ..Self::default() };
        } else if !pins.stall {
            let picked = if before.crossed { before.latched } else { pins.count };
            let decoded = if config.gray { binary_from_gray(picked) } else { picked };
            let (amount, moves) = if config.latch_mode {
                (decoded.cast_signed(), pins.done)
            } else {
                (1, pins.step && !before.crossed && !pins.comparator)
            };
            if pins.clear {
                self.value = i32::from(config.black);
            } else if moves {
                self.value = wrapped(before.value + if pins.down { -amount } else { amount });
            }
            if config.latch_mode && !before.crossed && (pins.done || (pins.step && pins.comparator)) {
                self.latched = pins.count;
            }
            self.crossed = !pins.arm && (before.crossed || (pins.step && pins.comparator));
        }
        self.toggles += flips(register(before.value), register(self.value)) + flips(before.latched, self.latched);
        self.out(config)
    }

    /// The same as the tick with `clear`.
    pub fn clear(&mut self, config: &CdsConfig) {
        let black = i32::from(config.black);
        self.toggles += flips(register(self.value), register(black));
        self.value = black;
    }

    /// The same as the ticks of a whole ramp, from `arm` through the one with `done`: the column's comparator rises at `crossing`.
    pub fn run_ramp(&mut self, config: &CdsConfig, down: bool, steps: u32, crossing: u32) {
        let steps = steps.max(1);
        let made = steps_below(crossing, steps).cast_signed();
        let before = *self;
        self.value = wrapped(self.value + if down { -made } else { made });
        if config.latch_mode {
            let below = steps_below(crossing, steps);
            self.latched = if config.gray { gray_from_binary(below) } else { below };
            self.toggles += flips(register(before.value), register(self.value)) + flips(before.latched, self.latched);
        } else {
            let (low, high) = if down { (self.value, before.value) } else { (before.value, self.value) };
            self.toggles += u64::from(travel_flips(low, high));
        }
        self.crossed = crossing <= steps;
    }
}

/// The ramps of a row and where each column crosses them.
#[derive(Clone, Copy, Debug)]
pub struct RowCrossings<'a> {
    /// Steps of the reset ramp; 0 where there is none.
    pub reset_steps: u32,
    /// Crossing of each column in the reset ramp; not looked at (and may be empty) where there is none.
    pub reset: &'a [u32],
    /// Steps of the signal ramp.
    pub signal_steps: u32,
    /// Crossing of each column in the signal ramp.
    pub signal: &'a [u32],
}

/// All columns of a row at once: what `Cds::clear` and `Cds::run_ramp` do to each. Buffers are borrowed, one entry a column.
#[derive(Debug)]
pub struct ColumnRow<'a> {
    config: CdsConfig,
    values: &'a mut [i32],
    latched: &'a mut [u32],
}

impl<'a> ColumnRow<'a> {
    /// Columns in reset. Panics on a depth out of range or buffers of different lengths.
    pub fn new(config: CdsConfig, values: &'a mut [i32], latched: &'a mut [u32]) -> Self {
        assert!((1..=16).contains(&config.bits), "depths go from 1 to 16 bits");
        assert!(values.len() == latched.len(), "a column has one counter and one latch");
        values.fill(0);
        latched.fill(0);
        Self { config, values, latched }
    }

    /// Columns of the row.
    pub fn columns(&self) -> usize {
        self.values.len()
    }

    /// Converts a row: preload, reset ramp if there is one, signal ramp. Returns the bits flipped in counters and latches.
    /// Panics if a ramp in use has no crossing for each column.
    pub fn convert(&mut self, row: &RowCrossings<'_>, codes: &mut [u16]) -> u64 {
        let columns = self.values.len();
        assert!(codes.len() == columns && row.signal.len() == columns, "a column has one crossing and one code");
        assert!(row.reset_steps == 0 || row.reset.len() == columns, "a column has one crossing of the reset ramp");
        match (self.config.latch_mode, row.reset_steps > 0) {
            (false, true) => self.count(row, codes, |column| steps_below(row.reset[column], row.reset_steps)),
            (false, false) => self.count(row, codes, |_| 0),
            (true, true) => self.latch::<true>(row, codes),
            (true, false) => self.latch::<false>(row, codes),
        }
    }

    #[inline(always)]
    fn count(&mut self, row: &RowCrossings<'_>, codes: &mut [u16], down: impl Fn(usize) -> u32) -> u64 {
        let (black, code_max, columns) = (i32::from(self.config.black), self.config.code_max(), codes.len());
        let (values, signal) = (&mut self.values[..columns], &row.signal[..columns]);
        // A column flips fewer than 2^20 bits per row: two ramps of 2^16 steps flip under 2^17 each, so 2^12 columns fit 32 bits.
        let mut toggles = 0;
        let mut start = 0;
        while start < columns {
            let end = columns.min(start + 4096);
            let mut part = 0_u32;
            for column in start..end {
                let low = black - down(column).cast_signed();
                let high = low + steps_below(signal[column], row.signal_steps).cast_signed();
                let preload = bits_set(register(values[column] ^ black));
                part += preload + travel_flips(low, black) + travel_flips(low, high);
                values[column] = high;
                codes[column] = clipped(high, code_max);
            }
            toggles += u64::from(part);
            start = end;
        }
        toggles
    }

    /// What `Cds::run_ramp` does in latch mode, as plain arithmetic of all columns.
    #[inline(always)]
    fn latch<const DOUBLE: bool>(&mut self, row: &RowCrossings<'_>, codes: &mut [u16]) -> u64 {
        let (black, code_max, columns) = (i32::from(self.config.black), self.config.code_max(), codes.len());
        let (values, latches) = (&mut self.values[..columns], &mut self.latched[..columns]);
        let (reset, signal) = (if DOUBLE { &row.reset[..columns] } else { &[] }, &row.signal[..columns]);
        let gray_mask = if self.config.gray { u32::MAX } else { 0 };
        let encode = |count: u32| count ^ ((count >> 1) & gray_mask);
        let mut toggles = 0;
        let mut start = 0;
        while start < columns {
            let end = columns.min(start + 4096);
            let mut part = 0_u32;
            for column in start..end {
                let up = steps_below(signal[column], row.signal_steps);
                let down = if DOUBLE { steps_below(reset[column], row.reset_steps) } else { 0 };
                let low = black - down.cast_signed();
                let high = low + up.cast_signed();
                let between = if DOUBLE { encode(down) } else { latches[column] };
                part += bits_set(register(values[column] ^ black)) + bits_set(register(low ^ high));
                part += bits_set(between ^ encode(up));
                if DOUBLE {
                    part += bits_set(register(black ^ low)) + bits_set(latches[column] ^ between);
                }
                (values[column], latches[column]) = (high, encode(up));
                codes[column] = clipped(high, code_max);
            }
            toggles += u64::from(part);
            start = end;
        }
        toggles
    }
}
