//! Bits, clocks and utilisation of a frame on the link.

use super::params::LinkParams;
use crate::error::Error;
use crate::link::plan::{FramePlan, PlannedPacket, after_the_rows};
use crate::link::records;
use crate::num::{f64_from_u64, index, u64_from};
use crate::units::{Clocks, Size};

/// What one frame, or several, put on the link.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Traffic {
    /// Bits of the codes themselves: pixels times depth; 0 where no rows are sent.
    pub net_bits: u64,
    /// Bits of the codes in their containers.
    pub container_bits: u64,
    /// Bits of the feature packets' payloads.
    pub feature_bits: u64,
    /// All bytes, with headers, checksums, embedded data, frame start and frame end: as many as `pack_frame` gives.
    pub link_bytes: u64,
    /// Packets, and so bursts on each lane.
    pub packets: u64,
    /// `byte_clk` clocks in which the link is not idle, low-power transitions included.
    pub busy: Clocks,
}

impl Traffic {
    /// Adds another frame's.
    pub fn add(&mut self, other: &Self) {
        self.net_bits += other.net_bits;
        self.container_bits += other.container_bits;
        self.feature_bits += other.feature_bits;
        self.link_bytes += other.link_bytes;
        self.packets += other.packets;
        self.busy.0 += other.busy.0;
    }

    /// That of so many such frames.
    #[must_use]
    pub fn times(&self, frames: u64) -> Self {
        Self {
            net_bits: frames * self.net_bits,
            container_bits: frames * self.container_bits,
            feature_bits: frames * self.feature_bits,
            link_bytes: frames * self.link_bytes,
            packets: frames * self.packets,
            busy: Clocks(frames * self.busy.0),
        }
    }
}

impl LinkParams {
    /// `byte_clk` clocks of one row with its bursts' overhead, line-start packet included: the least time from row to row that a link
    /// keeps up with. Fails on a row that this link cannot carry.
    pub fn line_packet_time(&self, width_px: u32, bits: u32) -> Result<Clocks, Error> {
        let row = self.long_packet_time(self.row_payload_bytes(width_px, bits)?).0;
        Ok(Clocks(row + if self.line_sync { self.short_packet_time().0 } else { 0 }))
    }

    /// Bytes of a row's payload. Fails on a row that this link cannot carry.
    pub fn row_payload_bytes(&self, width_px: u32, bits: u32) -> Result<u64, Error> {
        let kind = self.raw_kind(bits)?;
        kind.check_width(width_px)?;
        Ok(u64_from(kind.payload_bytes(index(width_px))))
    }

    /// What these packets of a frame put on the link. Fails on a row that this link cannot carry.
    pub fn traffic_of(&self, packets: &[PlannedPacket], size: Size, bits: u32) -> Result<Traffic, Error> {
        let sends_rows = packets.iter().any(|packet| matches!(packet, PlannedPacket::Row(_)));
        let row_bytes = if sends_rows { self.row_payload_bytes(size.width_px, bits)? } else { 0 };
        let mut traffic = Traffic { packets: u64_from(packets.len()), ..Traffic::default() };
        for &packet in packets {
            let bytes = self.packet_bytes(packet, row_bytes);
            traffic.link_bytes += bytes;
            traffic.busy.0 += self.burst_time(bytes).0;
            match packet {
                PlannedPacket::Row(_) => {
                    traffic.net_bits += u64::from(size.width_px) * u64::from(bits);
                    traffic.container_bits += 8 * row_bytes;
                }
                PlannedPacket::Features { count, .. } => traffic.feature_bits += 8 * records::payload_bytes(count),
                PlannedPacket::FrameStart
                | PlannedPacket::FrameEnd
                | PlannedPacket::Embedded
                | PlannedPacket::LineStart(_) => {}
            }
        }
        Ok(traffic)
    }

    /// What a frame of this size and so many features puts on the link, with its rows where the mode sends them; its features follow
    /// the rows in full packets, which is the least that they can take. Fails on a row that this link cannot carry, more than 2^32
    /// features.
    pub fn traffic(&self, size: Size, bits: u32, features: u64) -> Result<Traffic, Error> {
        self.traffic_of(&self.plan_after_rows(size.height_px, features, self.mode.sends_codes())?, size, bits)
    }

    fn plan_after_rows(&self, rows: u32, features: u64, sends_codes: bool) -> Result<Vec<PlannedPacket>, Error> {
        let features = u32::try_from(features)
            .map_err(|_| Error::key("compute.target_features", features, "use fewer than 2^32 features per frame"))?;
        let batches = after_the_rows(features);
        let batches = self.mode.sends_features().then_some(batches.as_slice());
        Ok(self.packets(&FramePlan { rows, sends_codes, batches, features_per_gap: 0 }))
    }

    /// Mean utilisation over a time: container and feature payload bits over the link's capacity in it.
    pub fn mean_utilisation(&self, traffic: &Traffic, time_s: f64) -> f64 {
        let payload_bits = f64_from_u64(traffic.container_bits + traffic.feature_bits);
        payload_bits / (f64_from_u64(self.capacity_bits_per_s()) * time_s)
    }

    /// Share of a row's time in which its packet, with low-power transitions, holds the link. Above 1 rows do not fit. Fails on a row
    /// that this link cannot carry.
    pub fn burst_utilisation(&self, width_px: u32, bits: u32, line_time_s: f64) -> Result<f64, Error> {
        Ok(self.seconds(self.line_packet_time(width_px, bits)?) / line_time_s)
    }
}
