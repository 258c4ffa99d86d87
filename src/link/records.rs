//! Features in user packets. Encodes the features of a frame as payloads of at most 65,535 bytes, and decodes them.
//!
//! Layout, version 2, little endian. Header: version u8, bytes of a feature u8, features in this packet u16, frame u32, index of its
//! first feature u32 of which bit 31 says that no other packet follows: 12 bytes. Each feature: x u16 and y u16 in sixteenths of a
//! pixel, score u16, angle u8 in 1/256 of a turn, octave u8, descriptor 32 bytes: 40 bytes. A frame's list is whole when the indices
//! run from 0 without a hole to the end of the last packet.

use crate::compute::Feature;
use crate::num::{low_u8, low_u32, u64_from};
use crate::units::FrameIndex;
use crate::words::{PositionPx, Turns};

/// Bytes of a feature on the link.
pub const FEATURE_BYTES: usize = 40;
/// Bytes before the first feature of a packet.
pub const FEATURE_HEADER_BYTES: usize = 12;
/// Features that fit the longest payload.
pub const FEATURES_PER_PACKET_MAX: usize = (65_535 - FEATURE_HEADER_BYTES) / FEATURE_BYTES;
const VERSION: u8 = 2;
const IS_LAST: u32 = 1 << 31;

/// Bytes of a payload of so many features.
pub(crate) fn payload_bytes(features: u32) -> u64 {
    u64_from(FEATURE_HEADER_BYTES) + u64::from(features) * u64_from(FEATURE_BYTES)
}

/// The payload of some features of a frame, of which `first` is the index of the first.
pub(crate) fn payload(frame: FrameIndex, first: u32, features: &[Feature], last: bool) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(FEATURE_HEADER_BYTES + features.len() * FEATURE_BYTES);
    let count = u16::try_from(features.len()).expect("cut to what a packet holds");
    assert!(first < IS_LAST, "a frame has fewer than 2^31 features");
    bytes.extend_from_slice(&[VERSION, low_u8(low_u32(u64_from(FEATURE_BYTES)))]);
    bytes.extend_from_slice(&count.to_le_bytes());
    bytes.extend_from_slice(&frame.0.to_le_bytes());
    bytes.extend_from_slice(&(first | if last { IS_LAST } else { 0 }).to_le_bytes());
    for feature in features {
        bytes.extend_from_slice(&feature.x.to_le_bytes());
        bytes.extend_from_slice(&feature.y.to_le_bytes());
        bytes.extend_from_slice(&feature.score.to_le_bytes());
        bytes.extend_from_slice(&[feature.angle.to_bits(), feature.octave]);
        bytes.extend_from_slice(&feature.descriptor);
    }
    bytes
}

/// Features of one packet.
pub(crate) struct FeatureRecords {
    pub(crate) frame: FrameIndex,
    /// Index of the first one in its frame.
    pub(crate) first: u32,
    /// The frame's list ends with this packet.
    pub(crate) last: bool,
    pub(crate) features: Vec<Feature>,
}

/// The records of a payload; `None` if version, record size or count do not fit this layout.
pub(crate) fn parse(payload: &[u8]) -> Option<FeatureRecords> {
    let mut reader = PayloadReader(payload);
    if reader.u8()? != VERSION || usize::from(reader.u8()?) != FEATURE_BYTES {
        return None;
    }
    let count = usize::from(reader.u16()?);
    let (frame, first_and_flag) = (FrameIndex(reader.u32()?), reader.u32()?);
    if reader.0.len() != count * FEATURE_BYTES {
        return None;
    }
    let one = |_| {
        let (x, y) = (PositionPx::from_le_bytes(reader.take()?), PositionPx::from_le_bytes(reader.take()?));
        let score = reader.u16()?;
        let [angle, octave] = reader.take()?;
        Some(Feature { x, y, score, angle: Turns::from_bits(angle), octave, descriptor: reader.take()? })
    };
    let features = (0..count).map(one).collect::<Option<_>>()?;
    Some(FeatureRecords { frame, first: first_and_flag & !IS_LAST, last: first_and_flag & IS_LAST != 0, features })
}

/// Takes numbers off the front of a payload; nothing where it ends too soon.
pub(crate) struct PayloadReader<'a>(pub(crate) &'a [u8]);

impl PayloadReader<'_> {
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
