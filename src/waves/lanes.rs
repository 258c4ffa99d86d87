//! Output of a row: lane pins on every lane clock, and the packet on the link.
//!
//! The serial lanes are `rtl_models::lane_shift`, by their own clock: they take the codes at their first edge after the clock in which
//! `latch` is high. The link shows what D-PHY's transmitter is asked for and sends (names as in its PHY-protocol interface): the
//! request, the byte clock, a byte per lane, and the bit on the wire, the least significant of a byte first.

use rtl_models::lane_shift::{LaneConfig, LaneIn, LaneShift};

use super::clocks::Frequency;
use super::signals::{Recorder, SignalId, SignalKind, Value};
use crate::adc::AdcParams;
use crate::error::Error;
use crate::link::{LinkParams, distribute, serial_bits};
use crate::num::{index, u64_from};
use crate::readout::ReadoutParams;

/// Serial lanes from the columns' memory to the output.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Lanes {
    config: LaneConfig,
    /// Bits a second of each.
    pub clock: Frequency,
}

impl Lanes {
    /// So many lanes behind so many columns, none where the readout is parallel; `line_clk` are whole lane clocks of a line. Fails on
    /// more lanes than the shifter has, or a line in which it does not finish a row: it sends whole words, and loads in one clock.
    pub fn new(adc: &AdcParams, columns: u32, readout: &ReadoutParams, line_clk: u64) -> Result<Option<Self>, Error> {
        let lanes = readout.lanes;
        if lanes == 0 {
            return Ok(None);
        }
        let config = LaneConfig { bits: adc.bits, lanes, columns: columns.next_multiple_of(lanes) };
        let refuse = |reason: String| Error::key("sensor.readout.lanes", lanes, format!("for --waves, {reason}"));
        config.check().map_err(|reason| refuse(reason.to_owned()))?;
        if u64::from(config.hts_min()) > line_clk {
            let reason =
                format!("a row takes {} lane clocks and a line has {line_clk}; use more lanes", config.hts_min());
            return Err(refuse(reason));
        }
        Ok(Some(Self { config, clock: Frequency::hz(readout.lane_clock_hz) }))
    }
}

#[derive(Debug)]
pub struct LaneSignals {
    lane_clk: SignalId,
    valid: SignalId,
    row_start: SignalId,
    word_start: SignalId,
    lanes: Vec<SignalId>,
}

impl LaneSignals {
    /// Adds the lanes' signals, unknown until a row is latched.
    pub fn add(recorder: &mut Recorder, lanes: &Lanes) -> Self {
        let mut bit = |name: &str| recorder.add("lanes", name, SignalKind::Bits(1), Value::Unknown);
        Self {
            lane_clk: bit("lane_clk"),
            valid: bit("lane_valid"),
            row_start: bit("row_start"),
            word_start: bit("word_start"),
            lanes: (0..lanes.config.lanes).map(|lane| bit(&format!("lane_{lane}"))).collect(),
        }
    }

    /// Shifts a row out from edge `first` of the lanes' clock on, the one that sees `latch`; `edge_ps` gives the instant of half clocks.
    /// The clock is shown while the lanes carry bits: data change with its rising edge. Gives back when the lanes are idle.
    pub fn shift(
        &self,
        recorder: &mut Recorder,
        lanes: &Lanes,
        codes: &[u16],
        first: u64,
        edge_ps: &dyn Fn(u64) -> u64,
    ) -> u64 {
        let mut padded = codes.to_vec();
        padded.resize(index(lanes.config.columns), 0);
        let mut held = vec![0; padded.len()];
        let mut shifter = LaneShift::new(lanes.config, &mut held);
        let mut edge = first;
        loop {
            let out = shifter.tick(LaneIn { latch: edge == first, ..LaneIn::default() }, &padded);
            let time_ps = edge_ps(2 * edge);
            let mut show = |signal, bit: bool| recorder.set(signal, time_ps, Value::Bits(bit.into()));
            show(self.lane_clk, out.valid);
            show(self.valid, out.valid);
            show(self.row_start, out.row_start);
            show(self.word_start, out.word_start);
            for (lane, &signal) in self.lanes.iter().enumerate() {
                show(signal, out.lane >> lane & 1 == 1);
            }
            if !out.busy {
                return time_ps;
            }
            recorder.set(self.lane_clk, edge_ps(2 * edge + 1), Value::Bits(0));
            edge += 1;
        }
    }

    pub fn all(&self) -> impl Iterator<Item = SignalId> {
        let pins = [self.lane_clk, self.valid, self.row_start, self.word_start];
        pins.into_iter().chain(self.lanes.iter().copied())
    }
}

#[derive(Debug)]
pub struct LinkSignals {
    request: SignalId,
    byte_clk: SignalId,
    ready: SignalId,
    bytes: Vec<SignalId>,
    bits: Vec<SignalId>,
}

/// The synchronisation byte before a burst.
const SYNC_BYTE: u8 = 0xB8;

/// UI of a byte.
const BYTE_BITS: u64 = 8;

impl LinkSignals {
    /// Adds the link's signals, unknown until a row is sent.
    pub fn add(recorder: &mut Recorder, link: &LinkParams) -> Self {
        let mut bits = |name: &str, bits| recorder.add("link", name, SignalKind::Bits(bits), Value::Unknown);
        Self {
            request: bits("tx_request_hs", 1),
            byte_clk: bits("tx_byte_clk_hs", 1),
            ready: bits("tx_ready_hs", 1),
            bytes: (0..link.lanes).map(|lane| bits(&format!("tx_data_hs_{lane}"), 8)).collect(),
            bits: (0..link.lanes).map(|lane| bits(&format!("lane_{lane}"), 1)).collect(),
        }
    }

    pub fn all(&self) -> impl Iterator<Item = SignalId> {
        [self.request, self.byte_clk, self.ready].into_iter().chain(self.bytes.iter().chain(&self.bits).copied())
    }

    /// A clock of eight bits per lane.
    pub fn byte_clk(link: &LinkParams) -> Frequency {
        Frequency { clocks: link.frequency_hz, seconds: 4 }
    }

    /// Sends a packet as a burst that leaves low power at byte clock 0; `byte_ps` and `bit_ps` give the instants of half byte clocks and of
    /// half unit intervals. A lane's bits are its synchronisation byte and its bytes; outside of them it stands at 0, whether in low
    /// power, preparation or trail. Gives back when the last byte is over.
    pub fn send(
        &self,
        recorder: &mut Recorder,
        link: &LinkParams,
        packet: &[u8],
        byte_ps: &dyn Fn(u64) -> u64,
        bit_ps: &dyn Fn(u64) -> u64,
    ) -> u64 {
        let entry = link.burst_entry().0;
        let lanes = distribute(packet, index(link.lanes));
        let longest = u64_from(lanes.iter().map(Vec::len).max().unwrap_or(0));
        let mut set = |signal, time_ps, value: u64| recorder.set(signal, time_ps, Value::Bits(value));
        for signal in self.all() {
            set(signal, byte_ps(0), 0);
        }
        set(self.request, byte_ps(0), 1);
        set(self.ready, byte_ps(2 * entry), 1);
        for byte in 0..longest {
            set(self.byte_clk, byte_ps(2 * (entry + byte)), 1);
            set(self.byte_clk, byte_ps(2 * (entry + byte) + 1), 0);
        }
        for (lane, bytes) in lanes.iter().enumerate() {
            for (at, &byte) in bytes.iter().enumerate() {
                set(self.bytes[lane], byte_ps(2 * (entry + u64_from(at))), byte.into());
            }
            set(self.bytes[lane], byte_ps(2 * (entry + u64_from(bytes.len()))), 0);
            let wire: Vec<u8> = std::iter::once(SYNC_BYTE).chain(bytes.iter().copied()).collect();
            let first = BYTE_BITS * (entry - 1);
            for (at, bit) in serial_bits(&wire).iter().by_vals().enumerate() {
                set(self.bits[lane], bit_ps(2 * (first + u64_from(at))), bit.into());
            }
            set(self.bits[lane], bit_ps(2 * (first + BYTE_BITS * u64_from(wire.len()))), 0);
        }
        let end_ps = byte_ps(2 * (entry + longest));
        set(self.ready, end_ps, 0);
        set(self.request, end_ps, 0);
        end_ps
    }
}
