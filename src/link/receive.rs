//! The host's end of the link. Enters: bytes that may be damaged. Leaves: frames, and counts of what was wrong.
//!
//! No length is trusted before its header's ECC holds and the bytes are there. After a header that cannot be corrected the
//! next packet is found by the first place whose header holds exactly and whose payload's CRC holds too, or which ends the
//! open frame or starts one after it; a real receiver has the lane's own start of transmission for that.

use crate::compute::Feature;
use crate::link::RawKind;
use crate::link::checks::{HeaderCheck, check_header, crc16};
use crate::link::embedded::FrameMetadata;
use crate::link::packet::{CRC_BYTES, DataType, HEADER_BYTES, frame_number, is_long};
use crate::link::records;
use crate::num::{index, u64_from};
use crate::plane::Plane;
use crate::units::Size;

/// A frame as the host has it.
#[derive(Clone, Debug, PartialEq)]
pub struct Received {
    /// Number of the camera.
    pub virtual_channel: u8,
    /// Number in the frame-start packet, 1 to 65,535.
    pub frame_number: u16,
    /// Counter, times and shape; nothing if the line of embedded data was damaged.
    pub metadata: Option<FrameMetadata>,
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
    metadata: Option<FrameMetadata>,
    kind: Option<RawKind>,
    /// Nothing for rows whose payload was refused.
    rows: Vec<Option<Vec<u16>>>,
    features: Vec<(u32, Vec<Feature>)>,
    ended: bool,
    damaged: bool,
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
            metadata: None,
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
                let metadata = holds.then(|| FrameMetadata::from_bytes(payload)).flatten();
                let ours = |found: &FrameMetadata| frame_number(found.frame) == self.frame_number;
                self.metadata = metadata.filter(ours);
                self.metadata.is_some()
            }
            DataType::Raw(kind) => {
                let alike = *self.kind.get_or_insert(kind) == kind;
                let row = if holds && alike { kind.unpack(payload) } else { None };
                self.rows.push(row);
                self.rows.last().is_some_and(Option::is_some)
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
        let damaged_rows = (0..).zip(&self.rows).filter(|(_, row)| row.is_none()).map(|(row, _)| row).collect();
        let features: Vec<Feature> = self.features.into_iter().flat_map(|(_, features)| features).collect();
        let announced = self.metadata.is_some_and(|metadata| {
            u64::from(metadata.feature_count()) == u64_from(features.len())
                && (metadata.size().is_none() == picture.is_none())
        });
        Received {
            virtual_channel: self.virtual_channel,
            frame_number: self.frame_number,
            metadata: self.metadata,
            picture,
            damaged_rows,
            features,
            whole: self.ended && !self.damaged && announced,
        }
    }

    /// The rows as a plane, if all that were announced stand in their order and have one width.
    fn picture(&self) -> Option<Plane<u16>> {
        let announced = self.metadata.and_then(|metadata| metadata.size());
        let known = self.rows.iter().flatten().next().map(Vec::len);
        let width = announced.map_or(known, |size| Some(index(size.width_px)))?;
        let height = announced.map_or(self.rows.len(), |size| index(size.height_px));
        // Zero rows for what is missing would give damage a shape that the host asked for, so the rows must be there.
        if self.rows.len() != height || width == 0 || known.is_none() {
            return None;
        }
        let mut values = Vec::with_capacity(known? * height);
        for row in &self.rows {
            match row {
                Some(row) if row.len() == width => values.extend_from_slice(row),
                Some(_) => return None,
                None => values.resize(values.len() + width, 0),
            }
        }
        let size = Size { width_px: u32::try_from(width).ok()?, height_px: u32::try_from(height).ok()? };
        Some(Plane::from_values(size, values))
    }
}
