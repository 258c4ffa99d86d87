//! The sensor's side of the link. Packs the codes and features of a frame into packets, back to back.

use super::raw::RawKind;
use crate::compute::Feature;
use crate::error::Error;
use crate::events::{Event, Events};
use crate::link::embedded::{self, FrameMetadata, FrameShape};
use crate::link::packet::{DataType, frame_number, push_long, push_short};
use crate::link::params::LinkParams;
use crate::link::plan::{Batch, FramePlan, PlannedPacket};
use crate::link::records;
use crate::num::{index, low_u16, u32_from, u64_from};
use crate::plane::Plane;
use crate::units::Size;

/// A frame as the sensor hands it to its link.
#[derive(Clone, Copy, Debug)]
pub struct FrameOut<'a> {
    /// Number of the camera on its link, 0 to 3.
    pub virtual_channel: u8,
    /// Counter, times, gain and temperature.
    pub metadata: FrameMetadata,
    /// Codes of all rows, each below 2^bits. Needed where this frame carries rows.
    pub codes: Option<&'a Plane<u16>>,
    /// Depth of the codes, 1 to 16.
    pub bits: u32,
    /// Features of the frame. Needed where the mode sends features.
    pub features: Option<&'a [Feature]>,
    /// The rows that complete the features, in the list's order; features beyond those of all batches leave with the last row.
    pub batches: &'a [Batch],
    /// Features that fit between two rows' packets: `LinkParams::features_per_gap`. 0: all of them follow the rows.
    pub features_per_gap: u32,
}

impl FrameOut<'_> {
    /// The packets that `pack_frame` makes of it, for `LinkParams::flow` and `LinkParams::traffic_of`.
    pub fn packets(&self, params: &LinkParams) -> Vec<PlannedPacket> {
        let sends_codes = params.sends_codes_in(self.metadata.frame);
        let of_batches = self.batches.last().map_or(0, |batch| batch.after_row.saturating_add(1));
        let rows = self.codes.map_or(of_batches, |codes| codes.size().height_px);
        let mut batches = self.batches.to_vec();
        let listed: u64 = batches.iter().map(|batch| u64::from(batch.features)).sum();
        let features = self.features.map_or(0, <[Feature]>::len);
        let rest = u64_from(features).checked_sub(listed).expect("batches hold no more features than the frame");
        batches.extend(crate::link::plan::after_the_rows(u32::try_from(rest).expect("a list of features")));
        let batches = params.mode.sends_features().then_some(batches.as_slice());
        params.packets(&FramePlan { rows, sends_codes, batches, features_per_gap: self.features_per_gap })
    }
}

/// The bytes of one frame, packets back to back, and their events: every byte, and on every lane one burst a packet. Fails on what the
/// container cannot carry: a row that is no whole number of its groups (RAW10: 4 pixels, RAW12: 2, ...) or is longer than a packet's
/// 65,535 bytes. Rows are not padded, because a padded picture is another picture.
///
/// # Panics
/// If batches hold more features than the frame.
pub fn pack_frame(frame: &FrameOut, params: &LinkParams, events: &mut Events) -> Result<Vec<u8>, Error> {
    if frame.virtual_channel > 3 {
        return Err(Error::key("virtual_channel", frame.virtual_channel, "use 0 to 3: one link has four"));
    }
    let codes = given(frame.codes, params.sends_codes_in(frame.metadata.frame), "codes")?;
    let features = given(frame.features, params.mode.sends_features(), "features")?;
    let kind = params.raw_kind(frame.bits)?;
    if let Some(codes) = codes {
        check_shape(kind, codes.size())?;
    }
    let packets = frame.packets(params);
    let shape = FrameShape::new(codes.map(Plane::size), kind, frame.bits, features.is_some(), params.line_sync);
    let writer = Writer { frame, kind, number: frame_number(frame.metadata.frame), shape };
    let row_bytes = codes.map_or(0, |codes| kind.payload_bytes(codes.width_px()));
    // A row's number in front of it, its header and its CRC take ten bytes.
    let mut bytes = Vec::with_capacity(codes.map_or(0, Plane::height_px) * (row_bytes + 10));
    let mut payload = Vec::with_capacity(row_bytes);
    for packet in &packets {
        payload.clear();
        writer.push(*packet, &mut payload, &mut bytes);
    }
    events.add(Event::LinkByte, u64_from(bytes.len()));
    events.add(Event::LinkBurst, u64_from(packets.len()) * u64::from(params.lanes));
    Ok(bytes)
}

/// The data of a frame's packets.
struct Writer<'a> {
    frame: &'a FrameOut<'a>,
    kind: RawKind,
    number: u16,
    shape: FrameShape,
}

impl Writer<'_> {
    fn push(&self, packet: PlannedPacket, payload: &mut Vec<u8>, bytes: &mut Vec<u8>) {
        let channel = self.frame.virtual_channel;
        match packet {
            PlannedPacket::FrameStart => push_short(bytes, channel, DataType::FrameStart, self.number),
            PlannedPacket::FrameEnd => push_short(bytes, channel, DataType::FrameEnd, self.number),
            // Heights are checked against 16 bits.
            PlannedPacket::LineStart(row) => push_short(bytes, channel, DataType::LineStart, low_u16(row + 1)),
            PlannedPacket::Embedded => {
                let payload = embedded::payload(&self.frame.metadata, &self.shape);
                push_long(bytes, channel, DataType::Embedded, &payload);
            }
            PlannedPacket::Row(row) => {
                let codes = self.frame.codes.expect("rows are sent of frames with codes");
                self.kind.pack(codes.row(index(row)), payload);
                push_long(bytes, channel, DataType::Raw(self.kind), payload);
            }
            PlannedPacket::Features { first, count, last, .. } => {
                let features = self.frame.features.expect("features are sent of frames with features");
                let part = &features[index(first)..index(first + count)];
                let payload = records::payload(self.frame.metadata.frame, first, part, last);
                push_long(bytes, channel, DataType::Features, &payload);
            }
        }
    }
}

/// The bytes of one row's packet, as `pack_frame` has them: header, codes, checksum. Fails on a row that the container cannot carry.
pub fn pack_row(codes: &[u16], bits: u32, virtual_channel: u8, params: &LinkParams) -> Result<Vec<u8>, Error> {
    let kind = params.raw_kind(bits)?;
    check_shape(kind, Size { width_px: u32_from(codes.len()), height_px: 1 })?;
    let (mut payload, mut bytes) = (Vec::new(), Vec::new());
    kind.pack(codes, &mut payload);
    push_long(&mut bytes, virtual_channel, DataType::Raw(kind), &payload);
    Ok(bytes)
}

/// Sides are 16-bit numbers in the embedded data, and a row is one packet.
fn check_shape(kind: RawKind, size: Size) -> Result<(), Error> {
    for (key, side_px) in [("sensor.width", size.width_px), ("sensor.height", size.height_px)] {
        if u16::try_from(side_px).is_err() {
            return Err(Error::key(key, side_px, "use up to 65535 on this link"));
        }
    }
    kind.check_width(size.width_px)
}

fn given<T>(value: Option<T>, sent: bool, what: &str) -> Result<Option<T>, Error> {
    match (value, sent) {
        (Some(value), true) => Ok(Some(value)),
        (None, true) => Err(Error::Run(format!("the link's mode sends {what}, and the frame has none"))),
        (_, false) => Ok(None),
    }
}
