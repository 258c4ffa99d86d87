//! The twins' inputs and outputs under the names and widths of the Verilog ports.

use super::judge::{Pin, bit, bus};
use rtl_models::cds::{CdsConfig, CdsIn, CdsOut};
use rtl_models::lane_shift::{LaneConfig, LaneIn, LaneOut};
use rtl_models::ramp_counter::{RampCounterIn, RampCounterOut};
use rtl_models::readout_seq::{SeqConfig, SeqIn, SeqOut};
use rtl_models::sensor_core::{CoreConfig, CoreIn, CoreOut};

pub fn ramp_in(pins: &RampCounterIn) -> [Pin<'static>; 5] {
    let RampCounterIn { rst, stall, start, gray, steps } = *pins;
    [bit("rst", rst), bit("stall", stall), bit("start", start), bit("gray", gray), bus("steps", 17, steps)]
}

pub fn ramp_out(pins: &RampCounterOut) -> [Pin<'static>; 5] {
    let RampCounterOut { ramp_code, count, running, step, done } = *pins;
    let codes = [bus("ramp_code", 17, ramp_code), bus("count", 17, count)];
    let [ramp_code, count] = codes;
    [ramp_code, count, bit("running", running), bit("step", step), bit("done", done)]
}

pub fn cds_in(config: &CdsConfig, pins: &CdsIn) -> [Pin<'static>; 13] {
    let CdsIn { rst, stall, clear, arm, step, done, down, comparator, count } = *pins;
    [
        bit("rst", rst),
        bit("stall", stall),
        bit("latch_mode", config.latch_mode),
        bit("gray", config.gray),
        bus("black", 16, config.black),
        bus("code_max", 16, config.code_max().unsigned_abs()),
        bit("clear", clear),
        bit("arm", arm),
        bit("step", step),
        bit("done", done),
        bit("down", down),
        bit("comparator", comparator),
        bus("count", 17, count),
    ]
}

pub fn cds_out(pins: &CdsOut) -> [Pin<'static>; 4] {
    let CdsOut { value, latched, crossed, code } = *pins;
    let value = value.cast_unsigned() & 0x3_FFFF;
    [bus("value", 18, value), bus("latched", 17, latched), bit("crossed", crossed), bus("code", 16, code)]
}

pub fn seq_in(config: &SeqConfig, pins: &SeqIn) -> [Pin<'static>; 14] {
    let SeqIn { rst, stall, enable } = *pins;
    [
        bit("rst", rst),
        bit("stall", stall),
        bit("enable", enable),
        bit("global_shutter", config.global_shutter),
        bus("hts", 20, config.hts),
        bus("n_settle_reset", 20, config.n_settle_reset),
        bus("n_ramp_reset", 20, config.n_ramp_reset),
        bus("n_settle_signal", 20, config.n_settle_signal),
        bus("n_ramp_signal", 20, config.n_ramp_signal),
        bus("vts", 16, config.vts),
        bus("rows", 16, config.rows),
        bus("first_row", 16, config.first_row),
        bus("row_step", 16, config.row_step),
        bus("exposure_lines", 16, config.exposure_lines),
    ]
}

pub fn seq_out(pins: &SeqOut) -> [Pin<'static>; 17] {
    [
        bit("running", pins.running),
        bus("state", 3, pins.state as u8),
        bus("line", 16, pins.line),
        bus("row", 16, pins.row),
        bit("frame_valid", pins.frame_valid),
        bit("line_valid", pins.line_valid),
        bit("clear", pins.clear),
        bit("fd_reset", pins.fd_reset),
        bit("sample_reset", pins.sample_reset),
        bit("transfer", pins.transfer),
        bit("sample_signal", pins.sample_signal),
        bit("ramp_start", pins.ramp_start),
        bit("ramp_down", pins.ramp_down),
        bit("latch", pins.latch),
        bit("shutter_reset", pins.shutter_reset),
        bus("shutter_row", 16, pins.shutter_row),
        bit("global_transfer", pins.global_transfer),
    ]
}

pub fn lane_in<'a>(config: &LaneConfig, pins: &LaneIn, codes: &'a [u8]) -> [Pin<'a>; 7] {
    [
        bit("rst", pins.rst),
        bit("stall", pins.stall),
        bus("bits", 5, config.bits),
        bus("lanes", 5, config.lanes),
        bus("columns", 16, config.columns),
        bit("latch", pins.latch),
        Pin::Wide("codes", 8 * u32::try_from(codes.len()).unwrap(), codes),
    ]
}

pub fn lane_out(pins: &LaneOut) -> [Pin<'static>; 6] {
    [
        bus("lane", 16, pins.lane),
        bit("valid", pins.valid),
        bit("busy", pins.busy),
        bit("word_start", pins.word_start),
        bit("row_start", pins.row_start),
        bit("overrun", pins.overrun),
    ]
}

/// The comparators of 32 columns.
pub fn core_in(config: &CoreConfig, pins: &CoreIn, comparators: u64) -> Vec<Pin<'static>> {
    let mut all: Vec<Pin<'static>> = seq_in(&config.seq, pins).into();
    all.extend([
        bit("latch_mode", config.cds.latch_mode),
        bit("gray", config.cds.gray),
        bus("black", 16, config.cds.black),
        bus("bits", 5, config.cds.bits),
        bus("lanes", 5, config.lanes),
        bus("columns", 16, config.columns),
        bus("comparators", 32, comparators),
    ]);
    all
}

/// The codes and crossings of 32 columns beside the core's pins.
pub fn core_out<'a>(pins: &CoreOut, crossed: u64, codes: &'a [u8]) -> Vec<Pin<'a>> {
    let mut all: Vec<Pin<'a>> = seq_out(&pins.seq).into();
    let ramp = &pins.ramp;
    all.extend([
        bus("ramp_code", 17, ramp.ramp_code),
        bus("count", 17, ramp.count),
        bit("ramp_running", ramp.running),
        bit("ramp_step", ramp.step),
        bit("ramp_done", ramp.done),
        bus("crossed", 32, crossed),
        Pin::Wide("codes", 8 * u32::try_from(codes.len()).unwrap(), codes),
    ]);
    all.extend(lane_out(&pins.lane));
    all
}
