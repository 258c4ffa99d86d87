//! Decodes packets of one link: frames that are open, and what was decoded.

use super::super::checks::{HeaderCheck, check_header, crc16};
use super::super::packet::{CRC_BYTES, DataType, HEADER_BYTES};
use super::decoded::Decoded;
use super::frame::Open;
use crate::num::u64_from;

pub(super) struct HostDecoder<'a> {
    pub(super) decoded: Decoded,
    pub(super) open: Option<Open<'a>>,
    /// Whether the open frame's start was the last that was read.
    pub(super) is_fresh: bool,
    wants_pictures: bool,
}

impl<'a> HostDecoder<'a> {
    pub(super) fn new(wants_pictures: bool, open: Option<Open<'a>>) -> Self {
        Self { decoded: Decoded::default(), open, is_fresh: false, wants_pictures }
    }

    /// Decodes a stream up to its end.
    pub(super) fn decode_all(mut self, bytes: &'a [u8]) -> Decoded {
        let mut at = 0;
        while at < bytes.len() {
            at += self.step(&bytes[at..]);
        }
        self.close();
        self.decoded
    }

    /// Takes a packet, or skips to the next one that can be believed. Gives back how many bytes that were, at least one.
    pub(super) fn step(&mut self, bytes: &'a [u8]) -> usize {
        self.is_fresh = false;
        if let Some(length) = self.packet(bytes) {
            return length;
        }
        let next = (1..bytes.len()).find(|&at| self.believable(&bytes[at..]));
        let skipped = next.unwrap_or(bytes.len());
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
        if data_type.is_short() {
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
pub(super) fn long_payload(after: &[u8], count: u16) -> Option<(&[u8], bool)> {
    let (payload, rest) = after.split_at_checked(usize::from(count))?;
    let check = rest.first_chunk::<CRC_BYTES>()?;
    Some((payload, crc16(payload) == u16::from_le_bytes(*check)))
}
