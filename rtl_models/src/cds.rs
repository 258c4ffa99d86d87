//! Column counter with digital correlated double sampling, twin of `verilog/cds.sv`. Converts comparator bits, clock by clock,
//! to codes in LSB: clip(black - n_reset + n_signal). Counts flipped bits for the energy model.

use crate::flips;
use crate::ramp_counter::binary_from_gray;

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
}
