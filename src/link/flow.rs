//! When each packet of a frame is on the lanes, row by row, and where the readout has to wait. Computes bursts in `byte_clk`, occupancy of
//! the row FIFO, and stalls.
//!
//! Clock 0 is the start of the frame-start packet's burst. That and the embedded line leave before the first row is read, so that the
//! link is free for it: row i is read at `lead + i rows apart` if nothing stalls. A row takes a slot of the FIFO when it is read and
//! frees it with the last byte of its payload and checksum; a row that finds no free slot stalls the readout and all later
//! rows. Packets are sent in their order, each as soon as it is complete and the lanes are back in LP-11.

use std::collections::VecDeque;

use super::embedded::EMBEDDED_BYTES;
use super::packet::{CRC_BYTES, HEADER_BYTES};
use crate::error::Error;
use crate::link::params::LinkParams;
use crate::link::plan::PlannedPacket;
use crate::link::records::{self, FEATURE_BYTES, FEATURE_HEADER_BYTES, FEATURES_PER_PACKET_MAX};
use crate::num::{index, u32_from, u64_from};
use crate::units::Clocks;

/// Time from one row's readout to the next one's, as a fraction of `byte_clk`.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RowPeriod {
    numerator: u128,
    denominator: u128,
}

impl RowPeriod {
    /// Rows that are so many clocks of a pixel rate apart. Panics on a rate of 0.
    pub fn new(pix_clk: Clocks, pixel_rate_hz: u64, params: &LinkParams) -> Self {
        assert!(pixel_rate_hz > 0, "a readout has a clock");
        // A byte clock is four clocks of the double-data-rate clock.
        let numerator = u128::from(pix_clk.0) * u128::from(params.frequency_hz);
        Self { numerator, denominator: 4 * u128::from(pixel_rate_hz) }
    }

    /// A time of so many parts of a clock, of which a clock of this frequency has `per_clock`. Panics where either is 0.
    pub fn of_parts(parts: u64, per_clock: u64, hz: u64, params: &LinkParams) -> Self {
        assert!(per_clock > 0 && hz > 0, "a clock runs and has parts");
        let numerator = u128::from(parts) * u128::from(params.frequency_hz);
        Self { numerator, denominator: 4 * u128::from(hz) * u128::from(per_clock) }
    }

    /// Clocks of a number of periods, rounded up: a row is there when all of it is.
    pub fn clocks(self, periods: u64) -> Clocks {
        let whole = (u128::from(periods) * self.numerator).div_ceil(self.denominator);
        Clocks(u64::try_from(whole).expect("a frame is shorter than 2^64 clocks"))
    }

    /// Clocks that every period has at least.
    fn least(self) -> u64 {
        u64::try_from(self.numerator / self.denominator).expect("a row is shorter than 2^64 clocks")
    }
}

/// A packet in time, in `byte_clk` from the start of the frame's first burst.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Sent {
    /// What it is.
    pub packet: PlannedPacket,
    /// Header, payload and checksum.
    pub bytes: u64,
    /// The lanes leave LP-11.
    pub start: Clocks,
    /// First byte of the header, after preparation and synchronisation byte.
    pub data: Clocks,
    /// After the last byte.
    pub data_end: Clocks,
    /// After trail and exit: the lanes may leave LP-11 again.
    pub end: Clocks,
}

/// When a feature is whole: so many `byte_clk` after a row is read.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FeatureReady {
    /// Row of the picture.
    pub row: u32,
    /// From the reading of that row.
    pub after: Clocks,
}

/// A frame in time.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Flow {
    /// Its packets in their order.
    pub sent: Vec<Sent>,
    /// From the start of the first burst to the reading of the first row.
    pub lead: Clocks,
    /// When each row is read; empty where no rows are sent.
    pub row_read: Vec<Clocks>,
    /// When the last row is read.
    pub rows_end: Clocks,
    /// How long the readout stalled.
    pub stalled: Clocks,
    /// Rows that stalled it.
    pub rows_stalled: u32,
    /// Most rows in the FIFO at once.
    pub fifo_rows_most: u32,
}

impl Flow {
    /// When the last burst is over.
    pub fn end(&self) -> Clocks {
        self.sent.last().map_or(Clocks(0), |sent| sent.end)
    }

    /// From the reading of the last row to the last bit of the frame's last packet. Trail and exit of its burst are not in it.
    pub fn last_bit(&self) -> Clocks {
        let last = self.sent.last().map_or(0, |sent| sent.data_end.0);
        Clocks(last.saturating_sub(self.rows_end.0))
    }

    /// From the reading of the last row to the end of the frame's last burst.
    pub fn tail(&self) -> Clocks {
        Clocks(self.end().0.saturating_sub(self.rows_end.0))
    }

    /// From the reading of the last row to the end of its burst, which waits for those of the rows before it; 0 where no rows are sent.
    pub fn rows_tail(&self) -> Clocks {
        let last = self.sent.iter().rfind(|sent| matches!(sent.packet, PlannedPacket::Row(_)));
        Clocks(last.map_or(0, |last| last.end.0.saturating_sub(self.rows_end.0)))
    }

    /// From the reading of the last row to the last feature byte; none where features are not sent.
    pub fn feature_latency(&self) -> Option<Clocks> {
        let last = self.sent.iter().rev().find(|sent| matches!(sent.packet, PlannedPacket::Features { .. }))?;
        Some(Clocks(last.data_end.0.saturating_sub(self.rows_end.0)))
    }

    /// From the reading of the last row to the start of the first burst of features behind it; none where there is none.
    pub fn features_behind_rows(&self) -> Option<Clocks> {
        let is_behind =
            |sent: &&Sent| matches!(sent.packet, PlannedPacket::Features { .. }) && sent.start >= self.rows_end;
        self.sent.iter().find(is_behind).map(|sent| Clocks(sent.start.0 - self.rows_end.0))
    }

    /// How much later than without stalls each row was read; empty where no rows are sent.
    pub fn delays(&self, period: RowPeriod) -> Vec<Clocks> {
        let late = |(row, read): (u64, &Clocks)| Clocks(read.0 - self.lead.0 - period.clocks(row).0);
        (0..).zip(&self.row_read).map(late).collect()
    }
}

impl LinkParams {
    /// Features that pass between the end of one row's packet and the reading of the next row; 0 where rows leave no room. Fails on a row
    /// that this link cannot carry.
    pub fn features_per_gap(&self, width_px: u32, bits: u32, period: RowPeriod) -> Result<u32, Error> {
        let busy = self.line_packet_time(width_px, bits)?.0 + self.burst_overhead().0;
        let bytes = period.least().saturating_sub(busy).saturating_mul(self.lanes.into());
        let room = bytes.saturating_sub(u64_from(HEADER_BYTES + CRC_BYTES + FEATURE_HEADER_BYTES));
        let most = u64_from(FEATURES_PER_PACKET_MAX);
        Ok(u32::try_from((room / u64_from(FEATURE_BYTES)).min(most)).expect("at most a packet's"))
    }

    /// Bytes of a packet with header and checksum, where a row's payload has so many.
    pub fn packet_bytes(&self, packet: PlannedPacket, row_payload_bytes: u64) -> u64 {
        let long = u64_from(HEADER_BYTES + CRC_BYTES);
        match packet {
            PlannedPacket::FrameStart | PlannedPacket::FrameEnd | PlannedPacket::LineStart(_) => u64_from(HEADER_BYTES),
            PlannedPacket::Embedded => u64_from(EMBEDDED_BYTES) + long,
            PlannedPacket::Row(_) => row_payload_bytes + long,
            PlannedPacket::Features { count, .. } => records::payload_bytes(count) + long,
        }
    }

    /// A frame's packets in time. `rows` are read one period apart; a row's payload has so many bytes; features are there when the row
    /// behind which they leave is read.
    pub fn flow(&self, packets: &[PlannedPacket], rows: u32, row_payload_bytes: u64, period: RowPeriod) -> Flow {
        self.flow_of_ready(packets, rows, row_payload_bytes, period, &[])
    }

    /// The same where each feature of the frame, by its index, is whole only when `ready` says so: a packet of features starts with the
    /// last of its own at the earliest.
    pub fn flow_of_ready(
        &self,
        packets: &[PlannedPacket],
        rows: u32,
        row_payload_bytes: u64,
        period: RowPeriod,
        ready: &[FeatureReady],
    ) -> Flow {
        let bytes = |packet| self.packet_bytes(packet, row_payload_bytes);
        let in_front =
            packets.iter().take_while(|packet| matches!(packet, PlannedPacket::FrameStart | PlannedPacket::Embedded));
        let lead = in_front.map(|&packet| self.burst_time(bytes(packet)).0).sum();
        let mut readout =
            Readout { lead, period, slots: index(self.fifo_rows), free_at: VecDeque::new(), flow: Flow::default() };
        let mut link_free = 0;
        for &packet in packets {
            let there = match packet {
                PlannedPacket::FrameStart | PlannedPacket::Embedded => 0,
                PlannedPacket::LineStart(row) | PlannedPacket::Row(row) => readout.read(row),
                PlannedPacket::Features { first, count, after_row, .. } => {
                    let own = ready.get(index(first)..index(first + count)).unwrap_or(&[]);
                    let whole = own.iter().map(|feature| readout.read_before(feature.row) + feature.after.0);
                    whole.fold(readout.read_before(after_row), u64::max)
                }
                PlannedPacket::FrameEnd => readout.read_before(rows.saturating_sub(1)),
            };
            let (start, bytes) = (there.max(link_free), bytes(packet));
            let data = start + self.burst_entry().0;
            let data_end = data + bytes.div_ceil(self.lanes.into());
            link_free = data_end + self.burst_exit().0;
            if let PlannedPacket::Row(_) = packet {
                readout.free_at.push_back(data_end);
            }
            let [start, data, data_end, end] = [start, data, data_end, link_free].map(Clocks);
            readout.flow.sent.push(Sent { packet, bytes, start, data, data_end, end });
        }
        let rows_end = readout.read_before(rows.saturating_sub(1));
        Flow { lead: Clocks(lead), rows_end: Clocks(rows_end), ..readout.flow }
    }
}

/// The rows' side of the FIFO.
struct Readout {
    lead: u64,
    period: RowPeriod,
    slots: usize,
    /// When the slots of the rows that were sent become free, in their order; at most one entry a slot.
    free_at: VecDeque<u64>,
    flow: Flow,
}

impl Readout {
    /// When the row is read. Rows come in their order; asking again for the last one gives the same answer.
    fn read(&mut self, row: u32) -> u64 {
        if let Some(read) = self.flow.row_read.get(index(row)) {
            return read.0;
        }
        let due = self.lead + self.period.clocks(row.into()).0 + self.flow.stalled.0;
        // Rows before this one that were in the FIFO and have all been sent by now are as many as there are entries.
        let mut read = due;
        while self.free_at.len() >= self.slots || self.free_at.front().is_some_and(|&free| free <= due) {
            read = read.max(self.free_at.pop_front().expect("checked above"));
        }
        self.flow.stalled.0 += read - due;
        self.flow.rows_stalled += u32::from(read > due);
        self.flow.row_read.push(Clocks(read));
        self.flow.fifo_rows_most = self.flow.fifo_rows_most.max(u32_from(self.free_at.len()) + 1);
        read
    }

    /// When a row is read that the link does not carry, or has carried.
    fn read_before(&self, row: u32) -> u64 {
        match self.flow.row_read.get(index(row)) {
            Some(read) => read.0,
            None => self.lead + self.period.clocks(row.into()).0 + self.flow.stalled.0,
        }
    }
}
