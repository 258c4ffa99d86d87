//! Short and long packets. Adds header, ECC and CRC to a payload.

use super::raw::RawKind;
use crate::link::checks::{crc16, ecc};
use crate::num::{low_u16, low_u32};
use crate::units::FrameIndex;

/// Data identifier, word count and ECC.
pub const HEADER_BYTES: usize = 4;
/// Checksum after a payload.
pub const CRC_BYTES: usize = 2;

/// The data types that this link sends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum DataType {
    FrameStart,
    FrameEnd,
    LineStart,
    Embedded,
    Raw(RawKind),
    /// The first user-defined byte-based type.
    Features,
}

impl DataType {
    pub(crate) fn number(self) -> u8 {
        match self {
            Self::FrameStart => 0x00,
            Self::FrameEnd => 0x01,
            Self::LineStart => 0x02,
            Self::Embedded => 0x12,
            Self::Raw(kind) => kind.data_type(),
            Self::Features => 0x30,
        }
    }

    /// Whether its packets have no payload: numbers below 0x10.
    pub(crate) fn is_short(self) -> bool {
        self.number() < 0x10
    }

    pub(crate) fn from_number(number: u8) -> Option<Self> {
        let others = [Self::FrameStart, Self::FrameEnd, Self::LineStart, Self::Embedded, Self::Features];
        let all = others.into_iter().chain(RawKind::ALL.map(Self::Raw));
        all.into_iter().find(|data_type| data_type.number() == number)
    }
}

/// The number in frame-start and frame-end packets: 1 to 65,535 and again, because 0 means that frames are not counted.
pub fn frame_number(frame: FrameIndex) -> u16 {
    low_u16(low_u32(u64::from(frame.0) % 65_535 + 1))
}

/// Panics on payloads over 65,535 bytes, which callers refuse.
pub(crate) fn push_long(bytes: &mut Vec<u8>, channel: u8, data_type: DataType, payload: &[u8]) {
    let count = u16::try_from(payload.len()).expect("payloads are checked against the word count");
    push_short(bytes, channel, data_type, count);
    bytes.extend_from_slice(payload);
    bytes.extend_from_slice(&crc16(payload).to_le_bytes());
}

/// A short packet, or the header of a long one.
pub(crate) fn push_short(bytes: &mut Vec<u8>, channel: u8, data_type: DataType, field: u16) {
    assert!(channel < 4, "a link has four virtual channels");
    let [low, high] = field.to_le_bytes();
    let header = [channel << 6 | data_type.number(), low, high];
    bytes.extend_from_slice(&header);
    bytes.push(ecc(header));
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frame_numbers_start_at_one_and_never_are_zero() {
        let numbers = [0, 1, 65_533, 65_534, 65_535, u32::MAX].map(|frame| frame_number(FrameIndex(frame)));
        assert_eq!(numbers, [1, 2, 65_534, 65_535, 1, 1]);
    }
}
