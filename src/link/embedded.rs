//! Encodes and decodes the line of embedded data in front of a frame: counter, times and shape.
//!
//! Layout, version 2, little endian: `SNSL`, version u8, RAW data type u8 (0: no rows), depth u8, flags u8 (bit 0: temperature is
//! measured, bit 1: feature packets follow, bit 2: rows follow line-start packets with their numbers), frame u32, timestamp ns u64,
//! exposure ns u32, row time ns u32, temperature mK u32, width u16, height u16, gain of the ramp in 1/65536 u32: 40 bytes. How many
//! features follow is not known when this line leaves; the last feature packet says so.

use super::raw::RawKind;
use crate::link::records::PayloadReader;
use crate::num::{low_u8, low_u16};
use crate::units::{FrameIndex, Size};
use crate::words::RampGain;

/// Bytes of the payload.
pub const EMBEDDED_BYTES: usize = 40;
const MAGIC: [u8; 4] = *b"SNSL";
const VERSION: u8 = 2;
const TEMPERATURE_IS_MEASURED: u8 = 1;
const FEATURES_FOLLOW: u8 = 2;
const ROWS_ARE_NUMBERED: u8 = 4;

/// What the host learns of a frame beside its picture.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameMetadata {
    /// Frame of the run, counted from 0; unlike the number in short packets it does not wrap.
    pub frame: FrameIndex,
    /// `t_frame`: the middle between the first row's start and the last row's end of exposure.
    pub timestamp_ns: u64,
    /// Effective exposure of a row.
    pub exposure_ns: u32,
    /// Time from row to row; 0 for a global shutter.
    pub row_time_ns: u32,
    /// The die's temperature, where it is measured.
    pub temperature_mk: Option<u32>,
    /// Gain of the ramp in effect.
    pub gain: RampGain,
}

/// What follows in the frame; filled in by `pack_frame`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrameShape {
    /// CSI-2 data type of the rows; 0 where no rows are sent.
    pub data_type: u8,
    /// Depth of the codes.
    pub bits: u8,
    /// Columns; 0 where no rows are sent.
    pub width_px: u16,
    /// Rows; 0 where no rows are sent.
    pub height_px: u16,
    /// Feature packets follow; the last of them says that it is.
    pub features_follow: bool,
    /// Every row's packet follows a line-start packet with its number.
    pub rows_are_numbered: bool,
}

impl FrameShape {
    /// What `pack_frame` sends. Callers have checked width, height and depth.
    pub(crate) fn new(size: Option<Size>, kind: RawKind, bits: u32, features_follow: bool, line_sync: bool) -> Self {
        let (width_px, height_px) = size.map_or((0, 0), |size| (size.width_px, size.height_px));
        let data_type = size.map_or(0, |_| kind.data_type());
        let (width_px, height_px) = (low_u16(width_px), low_u16(height_px));
        let rows_are_numbered = size.is_some() && line_sync;
        Self { data_type, bits: low_u8(bits), width_px, height_px, features_follow, rows_are_numbered }
    }

    /// Width and height of the picture, if rows are sent.
    pub fn size(&self) -> Option<Size> {
        let size = Size { width_px: self.width_px.into(), height_px: self.height_px.into() };
        (self.data_type != 0).then_some(size)
    }
}

pub(crate) fn payload(metadata: &FrameMetadata, shape: &FrameShape) -> Vec<u8> {
    let mut bytes = Vec::with_capacity(EMBEDDED_BYTES);
    bytes.extend_from_slice(&MAGIC);
    let flag = |is_set: bool, mask: u8| if is_set { mask } else { 0 };
    let flags = flag(metadata.temperature_mk.is_some(), TEMPERATURE_IS_MEASURED)
        | flag(shape.features_follow, FEATURES_FOLLOW)
        | flag(shape.rows_are_numbered, ROWS_ARE_NUMBERED);
    bytes.extend_from_slice(&[VERSION, shape.data_type, shape.bits, flags]);
    bytes.extend_from_slice(&metadata.frame.0.to_le_bytes());
    bytes.extend_from_slice(&metadata.timestamp_ns.to_le_bytes());
    bytes.extend_from_slice(&metadata.exposure_ns.to_le_bytes());
    bytes.extend_from_slice(&metadata.row_time_ns.to_le_bytes());
    bytes.extend_from_slice(&metadata.temperature_mk.unwrap_or(0).to_le_bytes());
    bytes.extend_from_slice(&shape.width_px.to_le_bytes());
    bytes.extend_from_slice(&shape.height_px.to_le_bytes());
    bytes.extend_from_slice(&metadata.gain.to_le_bytes());
    assert!(bytes.len() == EMBEDDED_BYTES, "the layout has one length");
    bytes
}

/// Nothing, if length, magic or version are not this layout's.
pub(crate) fn parse(payload: &[u8]) -> Option<(FrameMetadata, FrameShape)> {
    if payload.len() != EMBEDDED_BYTES {
        return None;
    }
    let mut reader = PayloadReader(payload);
    if reader.take::<4>()? != MAGIC || reader.u8()? != VERSION {
        return None;
    }
    let (data_type, bits, flags) = (reader.u8()?, reader.u8()?, reader.u8()?);
    let frame = FrameIndex(reader.u32()?);
    let timestamp_ns = u64::from_le_bytes(reader.take()?);
    let (exposure_ns, row_time_ns, temperature_mk) = (reader.u32()?, reader.u32()?, reader.u32()?);
    let (width_px, height_px) = (reader.u16()?, reader.u16()?);
    let gain = RampGain::from_le_bytes(reader.take()?);
    let temperature_mk = (flags & TEMPERATURE_IS_MEASURED != 0).then_some(temperature_mk);
    let (features_follow, rows_are_numbered) = (flags & FEATURES_FOLLOW != 0, flags & ROWS_ARE_NUMBERED != 0);
    let shape = FrameShape { data_type, bits, width_px, height_px, features_follow, rows_are_numbered };
    Some((FrameMetadata { frame, timestamp_ns, exposure_ns, row_time_ns, temperature_mk, gain }, shape))
}
