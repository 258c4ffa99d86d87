//! The host's end of the link. Decodes bytes that may be damaged into frames, and counts the errors.
//!
//! No length is trusted before its header's ECC holds and the bytes are there. After a header that cannot be corrected the
//! next packet is found by the first place whose header holds exactly and whose payload's CRC holds too, or which ends the
//! open frame or starts one after it; a real receiver has the lane's own start of transmission for that.

mod frame;
mod stream;

use crate::compute::Feature;
use crate::link::checks::{HeaderCheck, check_header, crc16};
use crate::link::embedded::{FrameMetadata, FrameShape};
use crate::link::packet::{CRC_BYTES, DataType, HEADER_BYTES, is_long};
use crate::num::u64_from;
use crate::plane::Plane;
use frame::Open;

pub use stream::Decoder;

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
    /// Codes, if rows were sent and the place of each that arrived is known. Damaged and missing rows are zero.
    pub picture: Option<Plane<u16>>,
    /// Rows whose payload failed its CRC, counted from 0; of those whose place is known.
    pub damaged_rows: Vec<u32>,
    /// Rows that were announced and did not arrive, counted from 0; empty where it is not known which they are.
    pub missing_rows: Vec<u32>,
    /// Features of all undamaged packets, in the sensor's order.
    pub features: Vec<Feature>,
    /// The place of each of these in the sensor's own list.
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

/// Decodes packets that stand back to back. Any bytes are taken: damage is counted, never a panic.
pub fn decode(bytes: &[u8]) -> Decoded {
    decoded(bytes, true)
}

/// The same for a host that looks at features only: frames have no picture, and everything else is as `decode` says.
pub fn decode_without_pictures(bytes: &[u8]) -> Decoded {
    decoded(bytes, false)
}

fn decoded(bytes: &[u8], wants_pictures: bool) -> Decoded {
    let mut host = Host::new(wants_pictures, None);
    let mut at = 0;
    while at < bytes.len() {
        at += host.step(&bytes[at..]);
    }
    host.close();
    host.decoded
}

struct Host<'a> {
    decoded: Decoded,
    open: Option<Open<'a>>,
    /// Whether the open frame's start was the last that was read.
    is_fresh: bool,
    wants_pictures: bool,
}

impl<'a> Host<'a> {
    fn new(wants_pictures: bool, open: Option<Open<'a>>) -> Self {
        Self { decoded: Decoded::default(), open, is_fresh: false, wants_pictures }
    }

    /// Takes a packet, or skips to the next one that can be believed. Gives back how many bytes that were, at least one.
    fn step(&mut self, bytes: &'a [u8]) -> usize {
        self.is_fresh = false;
        if let Some(length) = self.packet(bytes) {
            return length;
        }
        let skipped = (1 + self.next_packet(&bytes[1..])).min(bytes.len());
        self.skip(skipped);
        skipped
    }

    /// Takes one packet and gives back its length, or nothing where no packet can be read.
    fn packet(&mut self, bytes: &'a [u8]) -> Option<usize> {
        let Some((&received, after)) = bytes.split_first_chunk::<HEADER_BYTES>() else {
            self.decoded.counts.cut_short += 1;
            return None;
        };
        let header = match check_header(received) {
            HeaderCheck::Right => [received[0], received[1], received[2]],
            HeaderCheck::Corrected(header) => {
                self.decoded.counts.headers_corrected += 1;
                header
            }
            HeaderCheck::Refused => return self.refuse_header(),
        };
        let (channel, field) = (header[0] >> 6, u16::from_le_bytes([header[1], header[2]]));
        let Some(data_type) = DataType::from_number(header[0] & 0x3F) else {
            return self.refuse_header();
        };
        if !is_long(data_type.number()) {
            self.decoded.counts.packets += 1;
            self.short(channel, data_type, field);
            return Some(HEADER_BYTES);
        }
        let Some((payload, holds)) = long_payload(after, field) else {
            self.decoded.counts.cut_short += 1;
            self.damage();
            return None;
        };
        self.decoded.counts.packets += 1;
        self.long(channel, data_type, payload, holds);
        Some(HEADER_BYTES + payload.len() + CRC_BYTES)
    }

    fn refuse_header(&mut self) -> Option<usize> {
        self.decoded.counts.headers_refused += 1;
        self.damage();
        None
    }

    /// Bytes in which no packet could be read.
    fn skip(&mut self, bytes: usize) {
        self.decoded.counts.bytes_skipped += u64_from(bytes);
        if let Some(open) = &mut self.open {
            open.hole(bytes);
        }
    }

    /// Something of the open frame is lost.
    fn damage(&mut self) {
        if let Some(open) = &mut self.open {
            open.damaged = true;
        }
    }

    /// Bytes before the next packet that can be believed; all of them if there is none.
    fn next_packet(&self, bytes: &[u8]) -> usize {
        (0..bytes.len()).find(|&at| self.believable(&bytes[at..])).unwrap_or(bytes.len())
    }

    fn believable(&self, bytes: &[u8]) -> bool {
        let Some((&header, after)) = bytes.split_first_chunk::<HEADER_BYTES>() else { return false };
        if check_header(header) != HeaderCheck::Right {
            return false;
        }
        let (channel, field) = (header[0] >> 6, u16::from_le_bytes([header[1], header[2]]));
        let open = self.open.as_ref();
        match DataType::from_number(header[0] & 0x3F) {
            None => false,
            Some(DataType::FrameEnd) => {
                open.is_some_and(|open| (open.virtual_channel, open.frame_number) == (channel, field))
            }
            Some(DataType::FrameStart) => open.is_none_or(|open| field == open.frame_number % u16::MAX + 1),
            // Its number says little, but the row behind it has a CRC.
            Some(DataType::LineStart) => {
                let row = after.first().and_then(|identifier| DataType::from_number(identifier & 0x3F));
                matches!(row, Some(DataType::Raw(_))) && self.believable(after)
            }
            // An empty payload's CRC is too weak a witness.
            Some(_) => field > 0 && long_payload(after, field).is_some_and(|(_, holds)| holds),
        }
    }

    fn short(&mut self, channel: u8, data_type: DataType, field: u16) {
        if data_type == DataType::FrameStart {
            self.close();
            self.open = Some(Open::new(channel, field));
            self.is_fresh = true;
            return;
        }
        match &mut self.open {
            Some(open) if data_type == DataType::LineStart && open.virtual_channel == channel => open.line_start(field),
            Some(open) if (open.virtual_channel, open.frame_number) == (channel, field) => {
                open.ended = true;
                self.close();
            }
            _ => {
                self.decoded.counts.frames_damaged += 1;
                self.damage();
            }
        }
    }

    fn long(&mut self, channel: u8, data_type: DataType, payload: &'a [u8], holds: bool) {
        let understood = match &mut self.open {
            Some(open) if open.virtual_channel == channel => open.take(data_type, payload, holds),
            _ => {
                self.decoded.counts.frames_damaged += 1;
                self.damage();
                holds
            }
        };
        if !understood {
            self.decoded.counts.payloads_refused += 1;
            self.damage();
        }
    }

    fn close(&mut self) {
        if let Some(open) = self.open.take() {
            let (frame, rows_lost, doubled) = open.finish(self.wants_pictures);
            self.decoded.counts.frames_damaged += u64::from(!frame.whole);
            self.decoded.counts.rows_lost += rows_lost;
            self.decoded.counts.packets_doubled += doubled;
            self.decoded.frames.push(frame);
        }
    }
}

/// Payload and whether its CRC holds; nothing if the bytes end before it does.
fn long_payload(after: &[u8], count: u16) -> Option<(&[u8], bool)> {
    let (payload, rest) = after.split_at_checked(usize::from(count))?;
    let check = rest.first_chunk::<CRC_BYTES>()?;
    Some((payload, crc16(payload) == u16::from_le_bytes(*check)))
}
