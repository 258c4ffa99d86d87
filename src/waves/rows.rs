//! Runs selected rows through the clocked core: its pins, the ramp, and comparator, counter and latch of the selected columns, on every
//! clock of `adc_clk`.
//!
//! The digital side is `rtl_models::sensor_core`, whose twin in SystemVerilog has the same pins on every clock; the comparators' bits come
//! from the analog side (`Analog`). Nothing is drawn: a pin is shown where its twin has it.

use rtl_models::cds::{Cds as Column, CdsConfig};
use rtl_models::readout_seq::{SeqConfig, SeqIn, SeqState};
use rtl_models::sensor_core::{CoreConfig, CoreOut, SensorCore};

use super::analog::Analog;
use super::plan::WaveRow;
use super::signals::{Recorder, SignalId, SignalKind, Value};
use crate::adc::{AdcParams, Sample};
use crate::error::Error;
use crate::num::{f64_from_u64, index, u32_from, u32_truncated};

/// Clocks after the last line until its latch is over: it stands two clocks after the ramp's last, which may be the line's last.
pub fn tail_clk(seq: &SeqConfig) -> u32 {
    let used = seq.n_settle_reset + seq.n_ramp_reset + seq.n_settle_signal + seq.n_ramp_signal;
    (used + 3).saturating_sub(seq.hts)
}

/// The core's inputs for a line.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LineClocks {
    /// Whole clocks of `adc_clk` in a line.
    pub line_adc_clk: u64,
    /// Array row of the first line, and the distance from line to line.
    pub first_row: u32,
    pub row_step: u32,
    pub rows: u32,
}

/// Times of a line's pulses in seconds, where its settling does not hold them already.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PulseTimes {
    /// Before the reset level settles.
    pub reset_s: f64,
    /// Before the signal settles.
    pub transfer_s: f64,
}

/// Settling times in `adc_clk`, pulses included, so that both together take no more than the line's budget has for them. The core needs
/// two clocks for each; a converter that takes one sample gives the reset level just these.
fn settling_clk(adc: &AdcParams, pulses: PulseTimes) -> (u32, u32) {
    // A millionth of a clock is forgiven, as in the line's budget: settling times are decimal fractions.
    let clocks = |time_s: f64| u32_truncated((time_s * f64_from_u64(adc.clock_hz) - 1e-6).ceil());
    let reset = clocks(1e-6 * adc.settle_reset_used_us() + pulses.reset_s).max(2);
    let both = clocks(adc.settling_s() + pulses.reset_s + pulses.transfer_s);
    (reset, both.saturating_sub(reset).max(2))
}

/// The core's parameters for some rows of a sensor. `columns` are those whose counters are shown. Fails on a line that the hardware's
/// counters do not hold.
pub fn core_config(adc: &AdcParams, line: LineClocks, columns: u32, pulses: PulseTimes) -> Result<CoreConfig, Error> {
    if adc.columns_per_adc > 1 {
        let reason = "converters that columns share have no waves; use 1";
        return Err(Error::key("sensor.adc.columns_per_adc", adc.columns_per_adc, reason));
    }
    let (n_settle_reset, n_settle_signal) = settling_clk(adc, pulses);
    let seq = SeqConfig {
        global_shutter: false,
        hts: u32::try_from(line.line_adc_clk).unwrap_or(u32::MAX),
        vts: line.rows + 1,
        rows: line.rows,
        first_row: line.first_row,
        row_step: line.row_step,
        n_settle_reset,
        n_ramp_reset: adc.reset_counts_used(),
        n_settle_signal,
        n_ramp_signal: adc.code_max(),
        exposure_lines: 1,
    };
    let config = CoreConfig { seq, cds: adc.column(), lanes: 1, columns };
    config.check().map_err(|reason| {
        let value = format!("{} clocks of adc_clk", line.line_adc_clk);
        Error::key("--waves: a line", value, reason)
    })?;
    Ok(config)
}

struct Pin {
    scope: &'static str,
    name: &'static str,
    bits: u32,
    of: fn(&CoreOut) -> u64,
}

const fn pin(scope: &'static str, name: &'static str, bits: u32, of: fn(&CoreOut) -> u64) -> Pin {
    Pin { scope, name, bits, of }
}

/// Pins that are there whatever columns are chosen, as `sensor_core.sv` names them; `phase` is its `state`, and a pin for each phase
/// stands beside it, for viewers without a table of names.
const PINS: &[Pin] = &[
    pin("sequencer", "row", 16, |out| out.seq.row.into()),
    pin("sequencer", "phase", 3, |out| out.seq.state as u64),
    pin("sequencer", "settle_reset", 1, |out| (out.seq.state == SeqState::SettleReset).into()),
    pin("sequencer", "ramp_reset", 1, |out| (out.seq.state == SeqState::RampReset).into()),
    pin("sequencer", "settle_signal", 1, |out| (out.seq.state == SeqState::SettleSignal).into()),
    pin("sequencer", "ramp_signal", 1, |out| (out.seq.state == SeqState::RampSignal).into()),
    pin("sequencer", "blank", 1, |out| (out.seq.state == SeqState::Blank).into()),
    pin("sequencer", "line_valid", 1, |out| out.seq.line_valid.into()),
    pin("sequencer", "clear", 1, |out| out.seq.clear.into()),
    pin("sequencer", "fd_reset", 1, |out| out.seq.fd_reset.into()),
    pin("sequencer", "sample_reset", 1, |out| out.seq.sample_reset.into()),
    pin("sequencer", "transfer", 1, |out| out.seq.transfer.into()),
    pin("sequencer", "sample_signal", 1, |out| out.seq.sample_signal.into()),
    pin("sequencer", "latch", 1, |out| out.seq.latch.into()),
    pin("ramp", "ramp_start", 1, |out| out.seq.ramp_start.into()),
    pin("ramp", "ramp_down", 1, |out| out.seq.ramp_down.into()),
    pin("ramp", "ramp_running", 1, |out| out.ramp.running.into()),
    pin("ramp", "ramp_step", 1, |out| out.ramp.step.into()),
    pin("ramp", "ramp_done", 1, |out| out.ramp.done.into()),
    pin("ramp", "ramp_code", 17, |out| out.ramp.ramp_code.into()),
    pin("ramp", "count", 17, |out| out.ramp.count.into()),
];

#[derive(Debug)]
pub struct CoreSignals {
    pins: Vec<SignalId>,
    ramp_uv: SignalId,
    columns: Vec<ColumnSignals>,
}

#[derive(Debug)]
struct ColumnSignals {
    column: usize,
    input_uv: SignalId,
    comparator: SignalId,
    crossed: SignalId,
    counter: SignalId,
    latched: SignalId,
    code: SignalId,
}

/// Bits of a column's signed counter: three more than the code's, or as many as a longer reset ramp needs.
pub fn counter_bits(adc: &AdcParams) -> u32 {
    let least = i64::from(adc.reset_counts_used());
    let most = i64::from(adc.code_max()) + i64::from(adc.black_level_dn);
    let needed = 65 - (least.max(most)).leading_zeros();
    needed.max(adc.bits + 3)
}

impl CoreSignals {
    /// Adds the core's signals, unknown until a line is shown.
    pub fn add(recorder: &mut Recorder, adc: &AdcParams, columns: &[u32]) -> Self {
        let mut pins = Vec::with_capacity(PINS.len());
        for pin in PINS {
            pins.push(recorder.add(pin.scope, pin.name, SignalKind::Bits(pin.bits), Value::Unknown));
        }
        let ramp_uv = recorder.add("ramp", "ramp_uv", SignalKind::Real, Value::Real(0.0));
        let columns = columns.iter().map(|&column| {
            let scope = format!("column_{column}");
            let mut bits = |name: &str, bits| recorder.add(&scope, name, SignalKind::Bits(bits), Value::Unknown);
            let (comparator, crossed) = (bits("comparator", 1), bits("crossed", 1));
            let (latched, code) = (bits("latched", 17), bits("code", adc.bits));
            let counter = recorder.add(&scope, "counter", SignalKind::Signed(counter_bits(adc)), Value::Unknown);
            let input_uv = recorder.add(&scope, "comparator_input_uv", SignalKind::Real, Value::Real(0.0));
            ColumnSignals { column: index(column), input_uv, comparator, crossed, counter, latched, code }
        });
        Self { pins, ramp_uv, columns: columns.collect() }
    }

    /// All that can be unknown: pins, not the real signals.
    pub fn bits(&self) -> impl Iterator<Item = SignalId> {
        let of = |own: &ColumnSignals| [own.comparator, own.crossed, own.counter, own.latched, own.code];
        self.pins.iter().copied().chain(self.columns.iter().flat_map(of))
    }

    fn show(&self, recorder: &mut Recorder, time_ps: u64, clock: &Clock<'_>) {
        for (pin, &signal) in PINS.iter().zip(&self.pins) {
            recorder.set(signal, time_ps, Value::Bits((pin.of)(&clock.out)));
        }
        recorder.set(self.ramp_uv, time_ps, Value::Real(clock.analog.ramp_uv()));
        for (at, own) in self.columns.iter().enumerate() {
            let pins = clock.core.columns()[at].out(&clock.cds);
            let comparator = clock.analog.is_high(own.column);
            recorder.set(own.input_uv, time_ps, Value::Real(clock.analog.input_uv(own.column)));
            recorder.set(own.comparator, time_ps, Value::Bits(comparator.into()));
            recorder.set(own.crossed, time_ps, Value::Bits(pins.crossed.into()));
            recorder.set(own.counter, time_ps, Value::Bits(i64::from(pins.value).cast_unsigned()));
            recorder.set(own.latched, time_ps, Value::Bits(pins.latched.into()));
            recorder.set(own.code, time_ps, Value::Bits(pins.code.into()));
        }
    }
}

/// The sensor after one rising edge.
struct Clock<'a> {
    out: CoreOut,
    core: &'a SensorCore<'a>,
    cds: CdsConfig,
    analog: &'a Analog<'a>,
}

/// A row as it goes to the lanes.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Latched {
    /// Line in which `latch` is high, from the first row's on.
    pub line: u32,
    /// Clock of `adc_clk` within it.
    pub clock: u32,
    /// Codes of the chosen columns.
    pub codes: Vec<u16>,
}

/// Runs the core through rows that follow each other, and shows every clock from the first line on. `instant_ps` says when a clock of a
/// line comes. Gives back the latches, row after row.
pub fn run_rows(
    config: CoreConfig,
    mut analog: Analog<'_>,
    rows: &[WaveRow],
    signals: &CoreSignals,
    recorder: &mut Recorder,
    instant_ps: &dyn Fn(u32, u32) -> u64,
) -> Vec<Latched> {
    assert!(u32_from(rows.len()) == config.seq.rows, "every line has its samples");
    let width = index(config.columns);
    let (mut registers, mut codes, mut held) = (vec![Column::new(); width], vec![0; width], vec![0; width]);
    let mut core = SensorCore::new(config, &mut registers, &mut codes, &mut held);
    let mut bits = vec![0_u64; width.div_ceil(64)];
    let enable = SeqIn { enable: true, ..SeqIn::default() };
    let mut latched = Vec::with_capacity(rows.len());
    // The core begins with the line before the first row, as the shutter's pointer is one line ahead.
    while !core.out().seq.frame_valid {
        core.tick(enable, &bits);
    }
    let hts = config.seq.hts;
    let shown = u64::from(hts) * u64::from(config.seq.rows) + u64::from(tail_clk(&config.seq));
    for clock in 0..shown {
        let out = core.out();
        let line = u32::try_from(clock / u64::from(hts)).expect("a line of the frame");
        follow(&mut analog, &out, rows);
        show_bits(&mut bits, &analog, signals);
        let clock = u32::try_from(clock % u64::from(hts)).expect("a clock of the line");
        let time_ps = instant_ps(line, clock);
        signals.show(recorder, time_ps, &Clock { out, core: &core, cds: config.cds, analog: &analog });
        if out.seq.latch {
            latched.push(Latched { line, clock, codes: core.codes().to_vec() });
        }
        core.tick(enable, &bits);
    }
    latched
}

/// The analog side of the clock whose pins are given.
fn follow(analog: &mut Analog<'_>, out: &CoreOut, rows: &[WaveRow]) {
    let sample = if out.seq.state == SeqState::SettleReset { Sample::Reset } else { Sample::Signal };
    if out.seq.sample_reset || out.seq.sample_signal {
        analog.hold(&rows[index(out.seq.line)].samples, sample);
    }
    if out.ramp.step {
        analog.tick();
    } else if out.ramp.running {
        analog.start();
    }
}

fn show_bits(bits: &mut [u64], analog: &Analog<'_>, signals: &CoreSignals) {
    bits.fill(0);
    for (at, own) in signals.columns.iter().enumerate() {
        bits[at / 64] |= u64::from(analog.is_high(own.column)) << (at % 64);
    }
}
