//! Features in user packets. Enters: features of a frame. Leaves: payloads of at most 65,535 bytes, and back.
//!
//! Layout, version 1, little endian. Header: version u8, bytes of a feature u8, features in this packet u16, frame u32, index
//! of its first feature u32: 12 bytes. Each feature: x u16 and y u16 in sixteenths of a pixel, score u8, angle u8 in 1/256
//! of a turn, octave u8, descriptor 32 bytes: 39 bytes.

use crate::compute::Feature;
use crate::num::{low_u8, low_u32, u32_from, u64_from};
use crate::units::FrameIndex;

/// Bytes of a feature on the link.
pub const FEATURE_BYTES: usize = 39;
/// Bytes before the first feature of a packet.
pub(crate) const HEADER_BYTES: usize = 12;
/// Features that fit the longest payload.
pub const FEATURES_PER_PACKET_MAX: usize = (65_535 - HEADER_BYTES) / FEATURE_BYTES;
const VERSION: u8 = 1;

/// Payloads of a frame's features; a frame without features has one packet that says so.
pub(crate) fn payloads(frame: FrameIndex, features: &[Feature]) -> Vec<Vec<u8>> {
    let whole = features.chunks(FEATURES_PER_PACKET_MAX).enumerate();
    let mut payloads: Vec<_> = whole.map(|(i, part)| payload(frame, i * FEATURES_PER_PACKET_MAX, part)).collect();
    if payloads.is_empty() {
        payloads.push(payload(frame, 0, &[]));
    }
    payloads
}

/// Bytes of all payloads of so many features, and their number.
pub(crate) fn payload_bytes(features: u64) -> (u64, u64) {
    let packets = features.div_ceil(u64_from(FEATURES_PER_PACKET_MAX)).max(1);
    (packets * u64_from(HEADER_BYTES) + features * u64_from(FEATURE_BYTES), packets)
}

fn payload(frame: FrameIndex, first: usize, features: &[Feature]) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(HEADER_BYTES + features.len() * FEATURE_BYTES);
    let count = u16::try_from(features.len()).expect("cut to what a packet holds");
    bytes.extend_from_slice(&[VERSION, low_u8(low_u32(u64_from(FEATURE_BYTES)))]);
    bytes.extend_from_slice(&count.to_le_bytes());
    bytes.extend_from_slice(&frame.0.to_le_bytes());
    bytes.extend_from_slice(&u32_from(first).to_le_bytes());
    for feature in features {
        bytes.extend_from_slice(&feature.x_q4.to_le_bytes());
        bytes.extend_from_slice(&feature.y_q4.to_le_bytes());
        let score = u8::try_from(feature.score).unwrap_or(u8::MAX);
        bytes.extend_from_slice(&[score, feature.angle, feature.octave]);
        bytes.extend_from_slice(&feature.descriptor);
    }
    bytes
}

/// Features of one packet.
pub(crate) struct Records {
    pub(crate) frame: FrameIndex,
    /// Index of the first one in its frame.
    pub(crate) first: u32,
    pub(crate) features: Vec<Feature>,
}

/// Nothing, if version, size or count are not this layout's.
pub(crate) fn parse(payload: &[u8]) -> Option<Records> {
    let mut reader = Reader(payload);
    if reader.u8()? != VERSION || usize::from(reader.u8()?) != FEATURE_BYTES {
        return None;
    }
    let count = usize::from(reader.u16()?);
    let (frame, first) = (FrameIndex(reader.u32()?), reader.u32()?);
    if reader.0.len() != count * FEATURE_BYTES {
        return None;
    }
    let one = |_| {
        let (x_q4, y_q4) = (reader.u16()?, reader.u16()?);
        let [score, angle, octave] = reader.take()?;
        Some(Feature { x_q4, y_q4, score: u16::from(score), angle, octave, descriptor: reader.take()? })
    };
    let features = (0..count).map(one).collect::<Option<_>>()?;
    Some(Records { frame, first, features })
}

/// Takes numbers off the front of a payload; nothing where it ends too soon.
pub(crate) struct Reader<'a>(pub(crate) &'a [u8]);

impl Reader<'_> {
    pub(crate) fn take<const N: usize>(&mut self) -> Option<[u8; N]> {
        let (first, rest) = self.0.split_first_chunk::<N>()?;
        self.0 = rest;
        Some(*first)
    }

    pub(crate) fn u8(&mut self) -> Option<u8> {
        self.take::<1>().map(|[byte]| byte)
    }

    pub(crate) fn u16(&mut self) -> Option<u16> {
        self.take().map(u16::from_le_bytes)
    }

    pub(crate) fn u32(&mut self) -> Option<u32> {
        self.take().map(u32::from_le_bytes)
    }
}
