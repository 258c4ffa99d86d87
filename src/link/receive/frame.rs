//! A frame between its start and its end. Collects payloads and the gaps between them, and keeps only the rows whose number is certain.
//!
//! A row is taken only where its number is certain: by the number of the line-start packet in front of it, or, where rows are
//! not numbered, by counting: rows that arrived and rows' lengths that were skipped have to make up the announced height exactly.

use super::super::raw::RawKind;
use super::decoded::Received;
use crate::compute::Feature;
use crate::link::embedded::{self, FrameMetadata, FrameShape};
use crate::link::packet::{CRC_BYTES, DataType, HEADER_BYTES, frame_number};
use crate::link::records::{self, FeatureRecords};
use crate::num::{index, u32_from, u64_from};
use crate::plane::Plane;
use crate::units::Size;

/// A row's packet: its number where it had one, its payload where that is whole groups whose CRC held. Every bit of such a payload is a
/// bit of a code, so that equal payloads are equal codes.
struct ReceivedRow<'a> {
    number: Option<u32>,
    payload_bytes: usize,
    payload: Option<&'a [u8]>,
}

/// Bytes that were skipped after so many rows.
struct Hole {
    after_rows: usize,
    bytes: usize,
}

/// A frame between its start and its end.
pub(super) struct Open<'a> {
    pub(super) virtual_channel: u8,
    pub(super) frame_number: u16,
    embedded: Option<(FrameMetadata, FrameShape)>,
    kind: Option<RawKind>,
    line: Option<u32>,
    rows: Vec<ReceivedRow<'a>>,
    holes: Vec<Hole>,
    records: Vec<FeatureRecords>,
    doubled: u64,
    pub(super) ended: bool,
    pub(super) damaged: bool,
}

/// The packet, if any, of each announced row.
struct RowPackets {
    size: Size,
    kind: RawKind,
    packets: Vec<Option<usize>>,
}

impl<'a> Open<'a> {
    pub(super) fn new(virtual_channel: u8, frame_number: u16) -> Self {
        Self {
            virtual_channel,
            frame_number,
            embedded: None,
            kind: None,
            line: None,
            rows: Vec::new(),
            holes: Vec::new(),
            records: Vec::new(),
            doubled: 0,
            ended: false,
            damaged: false,
        }
    }

    pub(super) fn hole(&mut self, bytes: usize) {
        // What a number stood in front of may be in the hole.
        self.line = None;
        self.holes.push(Hole { after_rows: self.rows.len(), bytes });
    }

    pub(super) fn line_start(&mut self, field: u16) {
        let before = self.line.take();
        self.line = u32::from(field).checked_sub(1);
        self.damaged |= before.is_some() || self.line.is_none();
    }

    /// Whether the payload was understood.
    pub(super) fn take(&mut self, data_type: DataType, payload: &'a [u8], holds: bool) -> bool {
        let number = self.line.take();
        // Only its row may follow a line start.
        self.damaged |= number.is_some() && !matches!(data_type, DataType::Raw(_));
        match data_type {
            DataType::Embedded => self.take_embedded(holds.then_some(payload)),
            DataType::Raw(kind) => {
                let alike = *self.kind.get_or_insert(kind) == kind;
                let understood = holds && alike && kind.pixels_in(payload.len()).is_some();
                let payload_bytes = payload.len();
                self.rows.push(ReceivedRow { number, payload_bytes, payload: understood.then_some(payload) });
                understood
            }
            DataType::Features => match holds.then(|| records::parse(payload)).flatten() {
                Some(found) if frame_number(found.frame) == self.frame_number => {
                    self.take_records(found);
                    true
                }
                _ => false,
            },
            DataType::FrameStart | DataType::FrameEnd | DataType::LineStart => {
                unreachable!("short packets have no payload")
            }
        }
    }

    fn take_embedded(&mut self, payload: Option<&[u8]>) -> bool {
        let found = payload.and_then(embedded::parse);
        let Some(found) = found.filter(|(metadata, _)| frame_number(metadata.frame) == self.frame_number) else {
            return false;
        };
        if self.embedded.is_some() {
            self.doubled += 1;
            self.damaged = true;
        }
        self.embedded.get_or_insert(found);
        true
    }

    /// Keeps records whose indices were not in an earlier packet.
    fn take_records(&mut self, found: FeatureRecords) {
        let span = |records: &FeatureRecords| (records.first, records.first + u32_from(records.features.len()));
        let (start, end) = span(&found);
        let meets = |kept: &FeatureRecords| {
            let (kept_start, kept_end) = span(kept);
            // An empty last packet stands where the list ends; two of them meet too.
            (start < kept_end && kept_start < end) || (found.last && kept.last)
        };
        if self.records.iter().any(meets) {
            self.doubled += 1;
            self.damaged = true;
        } else {
            self.records.push(found);
        }
    }

    /// The frame, with its picture if one is wanted, announced rows that are lost, and packets that came twice.
    pub(super) fn finish(mut self, wants_picture: bool) -> (Received, u64, u64) {
        self.damaged |= self.line.is_some();
        self.records.sort_by_key(|records| (records.first, records.last));
        let row_packets = self.row_packets();
        let (mut damaged_rows, mut missing_rows) = (Vec::new(), Vec::new());
        for (row, packet) in (0..).zip(row_packets.iter().flat_map(|row_packets| &row_packets.packets)) {
            match packet {
                Some(packet) if self.rows[*packet].payload.is_none() => damaged_rows.push(row),
                Some(_) => {}
                None => missing_rows.push(row),
            }
        }
        let shape = self.embedded.map(|(_, shape)| shape);
        let announced = shape.and_then(|shape| shape.size());
        let rows_lost = match (&row_packets, announced) {
            (Some(_), _) => u64_from(damaged_rows.len() + missing_rows.len()),
            (None, Some(size)) => size.height_px.into(),
            (None, None) => 0,
        };
        let rows_as_announced =
            announced.is_some() == row_packets.is_some() && (announced.is_some() || self.rows.is_empty());
        let picture = row_packets.as_ref().filter(|_| wants_picture).map(|row_packets| self.picture(row_packets));
        let complete = shape.is_some_and(|shape| {
            rows_as_announced && if shape.features_follow { self.list_is_whole() } else { self.records.is_empty() }
        });
        let (feature_indices, features) = self.features();
        let received = Received {
            virtual_channel: self.virtual_channel,
            frame_number: self.frame_number,
            metadata: self.embedded.map(|(metadata, _)| metadata),
            shape,
            picture,
            damaged_rows,
            missing_rows,
            features,
            feature_indices,
            whole: self.ended && !self.damaged && complete && rows_lost == 0,
        };
        (received, rows_lost, self.doubled)
    }

    fn features(&self) -> (Vec<u32>, Vec<Feature>) {
        let all = self.records.iter().flat_map(|records| (records.first..).zip(records.features.iter().copied()));
        all.unzip()
    }

    /// Indices run from 0 without a hole, and the last packet is there.
    fn list_is_whole(&self) -> bool {
        let mut next = 0;
        for records in &self.records {
            if records.first != next {
                return false;
            }
            next += u32_from(records.features.len());
        }
        self.records.last().is_some_and(|records| records.last)
    }

    /// Where the rows belong; nothing where that is in doubt, or no rows were announced.
    fn row_packets(&mut self) -> Option<RowPackets> {
        let (_, shape) = self.embedded?;
        let size = shape.size()?;
        let kind = RawKind::ALL.into_iter().find(|kind| kind.data_type() == shape.data_type)?;
        let payload_bytes = kind.payload_bytes(index(size.width_px));
        // A damaged row must have as many bytes as announced, so damage cannot claim memory.
        let fills = kind.pixels_in(payload_bytes) == Some(index(size.width_px));
        let fits = |row: &ReceivedRow| row.payload_bytes == payload_bytes && (row.payload.is_none() || fills);
        if self.kind.is_some_and(|found| found != kind) || !self.rows.iter().all(fits) {
            return None;
        }
        let packets = if shape.rows_are_numbered {
            self.by_number(index(size.height_px))
        } else {
            self.by_count(index(size.height_px), HEADER_BYTES + payload_bytes + CRC_BYTES)?
        };
        Some(RowPackets { size, kind, packets })
    }

    /// A number is believed where it is greater than all numbers before it and less than all after it: a line-start packet whose many
    /// flipped bits look like one would put its row elsewhere.
    fn by_number(&mut self, height: usize) -> Vec<Option<usize>> {
        let mut packets: Vec<Option<usize>> = vec![None; height];
        let mut numbered = Vec::with_capacity(self.rows.len());
        for (packet, row) in self.rows.iter().enumerate() {
            let number = row.number.map(index).filter(|&number| number < height);
            match number.map(|number| (number, packets[number])) {
                Some((_, Some(first))) if self.rows[first].payload == row.payload => self.doubled += 1,
                Some((number, _)) => {
                    packets[number] = Some(packet);
                    numbered.push((number, packet));
                    continue;
                }
                // A row without a number, or with one beyond the picture, could be any.
                None => {}
            }
            self.damaged = true;
        }
        packets.fill(None);
        let mut after = vec![height; numbered.len() + 1];
        for (at, (number, _)) in numbered.iter().enumerate().rev() {
            after[at] = after[at + 1].min(*number);
        }
        let mut next = 0;
        for (at, (number, packet)) in numbered.into_iter().enumerate() {
            if number >= next && number < after[at + 1] {
                packets[number] = Some(packet);
            }
            next = next.max(number + 1);
        }
        packets
    }

    fn by_count(&self, height: usize, packet_bytes: usize) -> Option<Vec<Option<usize>>> {
        let rows_in = |hole: &Hole| if hole.bytes.is_multiple_of(packet_bytes) { hole.bytes / packet_bytes } else { 0 };
        let skipped: usize = self.holes.iter().map(rows_in).sum();
        if self.rows.len() + skipped != height {
            return None;
        }
        let mut packets = Vec::with_capacity(height);
        for packet in 0..=self.rows.len() {
            let before = self.holes.iter().filter(|hole| hole.after_rows == packet);
            let missing: usize = before.map(rows_in).sum();
            packets.resize(packets.len() + missing, None);
            if packet < self.rows.len() {
                packets.push(Some(packet));
            }
        }
        Some(packets)
    }

    fn picture(&self, row_packets: &RowPackets) -> Plane<u16> {
        let mut picture = Plane::filled(row_packets.size, 0);
        for (row, packet) in row_packets.packets.iter().enumerate() {
            if let Some(payload) = packet.and_then(|packet| self.rows[packet].payload) {
                row_packets.kind.unpack_into(payload, picture.row_mut(row));
            }
        }
        picture
    }
}
