//! What the host's decoder gives.

use super::super::embedded::{FrameMetadata, FrameShape};
use crate::compute::Feature;
use crate::plane::Plane;

/// A frame as the host has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Received {
    /// Number of the camera.
    pub virtual_channel: u8,
    /// Number in the frame-start packet, 1 to 65,535.
    pub frame_number: u16,
    /// Counter, times and temperature; nothing if the line of embedded data was damaged.
    pub metadata: Option<FrameMetadata>,
    /// What the frame announced; nothing if the line of embedded data was damaged.
    pub shape: Option<FrameShape>,
    /// Codes, if rows were sent and the row number of each that arrived is known. Damaged and missing rows are zero.
    pub picture: Option<Plane<u16>>,
    /// Rows whose payload failed its CRC, counted from 0; of those whose number is known.
    pub damaged_rows: Vec<u32>,
    /// Rows that were announced and did not arrive, counted from 0; empty where it is not known which they are.
    pub missing_rows: Vec<u32>,
    /// Features of all undamaged packets, in the sensor's order.
    pub features: Vec<Feature>,
    /// The index of each of these in the sensor's own list.
    pub feature_indices: Vec<u32>,
    /// Whether everything that the frame announced arrived undamaged.
    pub whole: bool,
}

/// What a host counts.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LinkCounts {
    /// Packets with a header that holds, after correction where needed.
    pub packets: u64,
    /// Headers in which one flipped bit was set right.
    pub headers_corrected: u64,
    /// Headers with more flipped bits, or of a data type that this link does not send.
    pub headers_refused: u64,
    /// Payloads that failed their CRC, or whose layout is not known.
    pub payloads_refused: u64,
    /// Packets that the stream's end cuts short.
    pub cut_short: u64,
    /// Bytes skipped on the search for the next header.
    pub bytes_skipped: u64,
    /// Frames given back that are not whole, and packets outside of any frame.
    pub frames_damaged: u64,
    /// Announced rows that did not arrive undamaged.
    pub rows_lost: u64,
    /// Packets that came a second time.
    pub packets_doubled: u64,
}

impl LinkCounts {
    /// Adds the counts of another stream.
    pub fn merge(&mut self, other: &Self) {
        self.packets += other.packets;
        self.headers_corrected += other.headers_corrected;
        self.headers_refused += other.headers_refused;
        self.payloads_refused += other.payloads_refused;
        self.cut_short += other.cut_short;
        self.bytes_skipped += other.bytes_skipped;
        self.frames_damaged += other.frames_damaged;
        self.rows_lost += other.rows_lost;
        self.packets_doubled += other.packets_doubled;
    }

    /// Whether nothing at all was wrong.
    pub fn clean(&self) -> bool {
        *self == Self { packets: self.packets, ..Self::default() }
    }
}

/// A decoded stream.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct Decoded {
    /// Frames in the order of their start.
    pub frames: Vec<Received>,
    /// What was right and what was wrong.
    pub counts: LinkCounts,
}
