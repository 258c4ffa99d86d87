//! Shared ramp step counter, twin of `verilog/ramp_counter.sv`. Drives the ramp code, the count that the columns latch (one step behind
//! the ramp, binary or Gray), and the strobes `step` and `done`. Counts flipped bits for the energy model.

use crate::flips;

/// Pins that enter, as they stand at the rising edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RampCounterIn {
    /// Synchronous reset.
    pub rst: bool,
    /// Everything holds.
    pub stall: bool,
    /// Begins a ramp, unless one is running or making its last step.
    pub start: bool,
    /// The count is distributed in Gray code.
    pub gray: bool,
    /// Steps of the ramp, 1 to 2^16; 0 acts as 1. Looked at in every clock of the ramp.
    pub steps: u32,
}

/// Pins that leave, after the rising edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RampCounterOut {
    /// Step at which the ramp stands.
    pub ramp_code: u32,
    /// The code before `ramp_code` while `step` is high, and all steps when `done` is: binary or Gray.
    pub count: u32,
    /// The ramp steps at the next edge.
    pub running: bool,
    /// `ramp_code` is fresh: comparators are looked at.
    pub step: bool,
    /// One clock after the last step.
    pub done: bool,
}

/// The counter's registers and what they have flipped.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct RampCounter {
    out: RampCounterOut,
    ramp_toggles: u64,
    count_toggles: u64,
}

/// Gray code of a count.
#[inline(always)]
pub const fn gray_from_binary(binary: u32) -> u32 {
    binary ^ (binary >> 1)
}

/// The XOR of all higher bits, as the hardware folds 17 bits.
#[inline(always)]
pub const fn binary_from_gray(gray: u32) -> u32 {
    let by1 = gray ^ (gray >> 1);
    let by2 = by1 ^ (by1 >> 2);
    let by4 = by2 ^ (by2 >> 4);
    let by8 = by4 ^ (by4 >> 8);
    by8 ^ (by8 >> 16)
}

/// Bits that flip while a binary counter counts from 0 to `count`: bit j flips count / 2^j times.
const fn binary_flips(count: u32) -> u64 {
    2 * count as u64 - count.count_ones() as u64
}

impl RampCounter {
    /// A counter in reset.
    pub fn new() -> Self {
        Self::default()
    }

    /// Pins as they stand.
    #[inline(always)]
    pub fn out(&self) -> RampCounterOut {
        self.out
    }

    /// Bits flipped so far in `ramp_code` (the ramp generator's switches).
    pub fn ramp_toggles(&self) -> u64 {
        self.ramp_toggles
    }

    /// Bits flipped so far on the `count` bus (the load of all columns).
    pub fn count_toggles(&self) -> u64 {
        self.count_toggles
    }

    /// One rising edge.
    pub fn tick(&mut self, pins: RampCounterIn) -> RampCounterOut {
        let before = self.out;
        if pins.rst {
            self.out = RampCounterOut::default();
        } else if !pins.stall {
            let after = &mut self.out;
            after.step = before.running;
            after.done = before.step && !before.running;
            if before.running {
                after.ramp_code = before.ramp_code + 1;
                after.running = after.ramp_code < pins.steps;
            }
            if before.running || before.step {
                after.count = if pins.gray { gray_from_binary(before.ramp_code) } else { before.ramp_code };
            }
            if pins.start && !before.running && !before.step {
                *after = RampCounterOut { running: true, ramp_code: 0, count: 0, ..*after };
            }
        }
        self.ramp_toggles += flips(before.ramp_code, self.out.ramp_code);
        self.count_toggles += flips(before.count, self.out.count);
        self.out
    }

    /// The same as `clocks` ticks under constant `gray` and `steps`, without start, stall and reset.
    pub fn advance(&mut self, clocks: u64, gray: bool, steps: u32) -> RampCounterOut {
        let mut clocks = clocks;
        if self.out.running && clocks > 0 {
            let from = self.out.ramp_code;
            let most = steps.max(from + 1) - from;
            let made = u32::try_from(clocks.min(u64::from(most))).expect("at most `most`");
            let encode = |code| if gray { gray_from_binary(code) } else { code };
            let behind = from + made - 1;
            let along = if gray { u64::from(made - 1) } else { binary_flips(behind) - binary_flips(from) };
            self.count_toggles += flips(self.out.count, encode(from)) + along;
            self.ramp_toggles += binary_flips(from + made) - binary_flips(from);
            self.out = RampCounterOut {
                ramp_code: from + made,
                count: encode(behind),
                running: made < most,
                step: true,
                done: false,
            };
            clocks -= u64::from(made);
        }
        // What follows the last step takes two clocks; then nothing changes.
        for _ in 0..clocks.min(2) {
            self.tick(RampCounterIn { gray, steps, ..RampCounterIn::default() });
        }
        self.out
    }
}
