//! The host's end of the link. Enters: bytes that may be damaged. Leaves: frames, and counts of what was wrong.
//!
//! No length is trusted before its header's ECC holds and the bytes are there. After a header that cannot be corrected the
//! next packet is found by the first place whose header holds exactly and whose payload's CRC holds too, or which ends the
//! open frame or starts one after it; a real receiver has the lane's own start of transmission for that.

use crate::compute::Feature;
use crate::link::RawKind;
use crate::link::checks::{HeaderCheck, check_header, crc16};
use crate::link::embedded::{self, FrameMetadata, FrameShape};
use crate::link::packet::{CRC_BYTES, DataType, HEADER_BYTES, frame_number, is_long};
use crate::link::records;
use crate::num::u64_from;
use crate::plane::Plane;
use crate::units::Size;

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
    /// Codes, if rows were sent and each arrived or is known to be damaged. Damaged rows are zero.
    pub picture: Option<Plane<u16>>,
    /// Rows whose payload failed its CRC, counted from 0.
    pub damaged_rows: Vec<u32>,
    /// Features of all undamaged packets, in the sensor's order.
    pub features: Vec<Feature>,
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
    let mut host = Host::default();
    let mut at = 0;
    while at < bytes.len() {
        at = match host.packet(&bytes[at..]) {
            Some(length) => at + length,
            None => {
                let skipped = 1 + host.next_packet(&bytes[at + 1..]);
                host.decoded.counts.bytes_skipped += u64_from(skipped);
                at + skipped
            }
        };
    }
    host.close();
    host.decoded
}

#[derive(Default)]
struct Host {
    decoded: Decoded,
    open: Option<Open>,
}

/// A frame between its start and its end.
struct Open {
    virtual_channel: u8,
    frame_number: u16,
    embedded: Option<(FrameMetadata, FrameShape)>,
    kind: Option<RawKind>,
    rows: Vec<Row>,
    features: Vec<(u32, Vec<Feature>)>,
    ended: bool,
    damaged: bool,
}

/// A row's packet: its codes, or nothing where they were refused.
struct Row {
    payload_bytes: usize,
    codes: Option<Vec<u16>>,
}

impl Host {
    /// Takes one packet and gives back its length, or nothing where no packet can be read.
    fn packet(&mut self, bytes: &[u8]) -> Option<usize> {
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
            // An empty payload's CRC is too weak a witness.
            Some(_) => field > 0 && long_payload(after, field).is_some_and(|(_, holds)| holds),
        }
    }

    fn short(&mut self, channel: u8, data_type: DataType, field: u16) {
        if data_type == DataType::FrameStart {
            self.close();
            self.open = Some(Open::new(channel, field));
            return;
        }
        match &mut self.open {
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

    fn long(&mut self, channel: u8, data_type: DataType, payload: &[u8], holds: bool) {
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
            let frame = open.finish();
            self.decoded.counts.frames_damaged += u64::from(!frame.whole);
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

impl Open {
    fn new(virtual_channel: u8, frame_number: u16) -> Self {
        Self {
            virtual_channel,
            frame_number,
            embedded: None,
            kind: None,
            rows: Vec::new(),
            features: Vec::new(),
            ended: false,
            damaged: false,
        }
    }

    /// Whether the payload was understood.
    fn take(&mut self, data_type: DataType, payload: &[u8], holds: bool) -> bool {
        match data_type {
            DataType::Embedded => {
                let found = holds.then(|| embedded::parse(payload)).flatten();
                self.embedded = found.filter(|(metadata, _)| frame_number(metadata.frame) == self.frame_number);
                self.embedded.is_some()
            }
            DataType::Raw(kind) => {
                let alike = *self.kind.get_or_insert(kind) == kind;
                let codes = if holds && alike { kind.unpack(payload) } else { None };
                let understood = codes.is_some();
                self.rows.push(Row { payload_bytes: payload.len(), codes });
                understood
            }
            DataType::Features => match holds.then(|| records::parse(payload)).flatten() {
                Some(records) if frame_number(records.frame) == self.frame_number => {
                    self.features.push((records.first, records.features));
                    true
                }
                _ => false,
            },
            DataType::FrameStart | DataType::FrameEnd => unreachable!("short packets have no payload"),
        }
    }

    fn finish(mut self) -> Received {
        self.features.sort_by_key(|&(first, _)| first);
        let picture = self.picture();
        let damaged_rows = (0..).zip(&self.rows).filter(|(_, row)| row.codes.is_none()).map(|(row, _)| row).collect();
        let features: Vec<Feature> = self.features.into_iter().flat_map(|(_, features)| features).collect();
        let shape = self.embedded.map(|(_, shape)| shape);
        let complete = shape.is_some_and(|shape| {
            u64::from(shape.features) == u64_from(features.len()) && shape.size() == picture.as_ref().map(Plane::size)
        });
        Received {
            virtual_channel: self.virtual_channel,
            frame_number: self.frame_number,
            metadata: self.embedded.map(|(metadata, _)| metadata),
            shape,
            picture,
            damaged_rows,
            features,
            whole: self.ended && !self.damaged && complete,
        }
    }

    /// The rows as a plane, if all that were announced stand in their order, each as long as the first that holds.
    fn picture(&self) -> Option<Plane<u16>> {
        let announced = self.embedded.and_then(|(_, shape)| shape.size());
        let model = self.rows.iter().find(|row| row.codes.is_some())?;
        let width = model.codes.as_ref().map_or(0, Vec::len);
        let size = Size { width_px: u32::try_from(width).ok()?, height_px: u32::try_from(self.rows.len()).ok()? };
        if width == 0 || announced.is_some_and(|announced| announced != size) {
            return None;
        }
        let mut values = Vec::with_capacity(width * self.rows.len());
        for row in &self.rows {
            // A damaged row has to have brought as many bytes as the others, so damage cannot claim memory.
            match &row.codes {
                _ if row.payload_bytes != model.payload_bytes => return None,
                Some(codes) => values.extend_from_slice(codes),
                None => values.resize(values.len() + width, 0),
            }
        }
        Some(Plane::from_values(size, values))
    }
}
