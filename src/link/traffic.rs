//! How much a frame sends and how long that takes. Enters: shape of a frame. Leaves: bits, clocks and utilisation.

use crate::error::Error;
use crate::link::{CRC_BYTES, EMBEDDED_BYTES, HEADER_BYTES, LinkParams, records};
use crate::num::{f64_from_u64, index, u64_from};
use crate::units::{Clocks, Size};

/// What one frame puts on the link.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
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

impl LinkParams {
    /// `byte_clk` clocks of one row's packet with its burst's overhead: the least time from row to row.
    pub fn line_packet_time(&self, width_px: u32, bits: u32) -> Result<Clocks, Error> {
        let kind = self.raw_kind(bits)?;
        kind.check_width(width_px)?;
        Ok(self.long_packet_time(u64_from(kind.payload_bytes(index(width_px)))))
    }

    /// What a frame of this size and so many features puts on the link.
    pub fn traffic(&self, size: Size, bits: u32, features: u64) -> Result<Traffic, Error> {
        let kind = self.raw_kind(bits)?;
        let long = u64_from(HEADER_BYTES + CRC_BYTES);
        let embedded = u64_from(EMBEDDED_BYTES);
        let mut traffic = Traffic {
            net_bits: 0,
            container_bits: 0,
            feature_bits: 0,
            link_bytes: 2 * u64_from(HEADER_BYTES) + embedded + long,
            packets: 3,
            busy: Clocks(2 * self.short_packet_time().0 + self.long_packet_time(embedded).0),
        };
        if self.mode.sends_codes() {
            let rows = u64::from(size.height_px);
            let row_time = self.line_packet_time(size.width_px, bits)?;
            let row_bytes = u64_from(kind.payload_bytes(index(size.width_px)));
            traffic.net_bits = u64_from(size.pixel_count()) * u64::from(bits);
            traffic.container_bits = 8 * rows * row_bytes;
            traffic.link_bytes += rows * (row_bytes + long);
            traffic.packets += rows;
            traffic.busy.0 += rows * row_time.0;
        }
        if self.mode.sends_features() {
            let (bytes, packets) = records::payload_bytes(features);
            traffic.feature_bits = 8 * bytes;
            traffic.link_bytes += bytes + packets * long;
            traffic.packets += packets;
            traffic.busy.0 += self.feature_packets_time(features);
        }
        Ok(traffic)
    }

    /// `byte_clk` clocks from a frame's last row to its last byte: feature packets, full but for the last, and frame end.
    pub fn tail_time(&self, features: u64) -> Clocks {
        let packets = if self.mode.sends_features() { self.feature_packets_time(features) } else { 0 };
        Clocks(packets + self.short_packet_time().0)
    }

    /// Packets are full but for the last.
    fn feature_packets_time(&self, features: u64) -> u64 {
        let most = u64_from(records::FEATURES_PER_PACKET_MAX);
        let time = |features| self.long_packet_time(records::payload_bytes(features).0).0;
        let (full, last) = (features / most, features % most);
        full * time(most) + if last > 0 || full == 0 { time(last) } else { 0 }
    }

    /// Mean utilisation over the frame: container and feature payload bits over the link's capacity in a frame's time.
    pub fn mean_utilisation(&self, traffic: &Traffic, frame_time_s: f64) -> f64 {
        let payload_bits = f64_from_u64(traffic.container_bits + traffic.feature_bits);
        payload_bits / (f64_from_u64(self.capacity_bits_per_s()) * frame_time_s)
    }

    /// Share of a row's time in which its packet, with low-power transitions, holds the link. Above 1 rows do not fit.
    pub fn burst_utilisation(&self, width_px: u32, bits: u32, line_time_s: f64) -> Result<f64, Error> {
        Ok(self.seconds(self.line_packet_time(width_px, bits)?) / line_time_s)
    }
}
