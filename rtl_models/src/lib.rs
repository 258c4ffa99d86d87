//! Bit-true twins of the sensor's digital blocks: no floats, no allocator, no `unsafe`.
//!
//! Each block of `verilog/` stands here under the same name, with the same ports, reset and latency: a `tick` is one rising edge of
//! `adc_clk`, and what it returns are the pins after that edge. Beside each `tick` stands a form that skips the clocks in which
//! nothing changes (`advance`, `run_ramp`, `write_row`, `EventCore`), equal to it in every result. Where analog and digital meet, the
//! digital side sees one bit per column, the comparator's; the analog side says when it rises as a *crossing*: the number, from 1, of the
//! first ramp step at which the bit is high, or [`NEVER`].
#![no_std]
#![forbid(unsafe_code)]

pub mod cds;
pub mod csi2_packetiser;
pub mod event_core;
pub mod extractor_core;
pub mod extractor_rows;
pub mod fx_back;
mod fx_back_ports;
mod fx_cells;
mod fx_config;
mod fx_dumps;
mod fx_engine;
mod fx_fast;
mod fx_fifo;
mod fx_fit;
pub mod fx_front;
pub mod fx_front_rows;
mod fx_half;
mod fx_harris;
mod fx_nms;
mod fx_orient;
mod fx_pattern;
mod fx_ring;
mod fx_rows;
mod fx_smooth;
mod fx_window;
pub mod lane_planes;
pub mod lane_shift;
pub mod ramp_counter;
pub mod readout_seq;
pub mod sensor_core;
pub mod verilog;
pub mod words;

/// The crossing of a comparator that stays low through the whole ramp.
pub const NEVER: u32 = u32::MAX;

/// Ramp steps at or below a level whose comparator rises at `crossing` in a ramp of `steps`: the code of that ramp alone.
#[inline(always)]
pub const fn steps_below(crossing: u32, steps: u32) -> u32 {
    let below = crossing.saturating_sub(1);
    if below < steps { below } else { steps }
}

/// Bits set, by the steps that vectorise without a population-count instruction.
#[inline(always)]
const fn bits_set(word: u32) -> u32 {
    let pairs = word - ((word >> 1) & 0x5555_5555);
    let fours = (pairs & 0x3333_3333) + ((pairs >> 2) & 0x3333_3333);
    let eights = (fours + (fours >> 4)) & 0x0F0F_0F0F;
    let sixteens = eights + (eights >> 8);
    (sixteens + (sixteens >> 16)) & 0x3F
}

/// Bits that differ, for toggle counts.
#[inline(always)]
fn flips(before: u32, after: u32) -> u64 {
    u64::from(bits_set(before ^ after))
}

/// The same for a wide word's differing bits.
#[inline(always)]
fn flips_wide(differing: i64) -> u64 {
    let [a, b, c, d, e, f, g, h] = differing.to_le_bytes();
    u64::from(bits_set(u32::from_le_bytes([a, b, c, d])) + bits_set(u32::from_le_bytes([e, f, g, h])))
}

/// The same for registers side by side.
#[inline(always)]
fn flips_of<T: Copy + Into<u32>, const N: usize>(before: &[T; N], after: &[T; N]) -> u64 {
    let mut sum = 0;
    for index in 0..N {
        sum += bits_set(before[index].into() ^ after[index].into());
    }
    sum.into()
}

/// The same for 16-bit registers, in lanes of their width.
#[inline(always)]
fn flips_of_words<const N: usize>(before: &[u16; N], after: &[u16; N]) -> u64 {
    let mut sum = 0;
    for index in 0..N {
        let differing = before[index] ^ after[index];
        let pairs = differing - ((differing >> 1) & 0x5555);
        let fours = (pairs & 0x3333) + ((pairs >> 2) & 0x3333);
        let eights = (fours + (fours >> 4)) & 0x0F0F;
        sum += (eights + (eights >> 8)) & 0x1F;
    }
    sum.into()
}
