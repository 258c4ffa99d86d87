//! The line of embedded data in front of a frame. Enters: counter, times and shape. Leaves: its payload, and back.
//!
//! Layout, version 1, little endian: `SNSL`, version u8, RAW data type u8 (0: no rows), depth u8, flags u8 (bit 0:
//! temperature is measured), frame u32, timestamp ns u64, exposure ns u32, row time ns u32, temperature mK u32, width u16,
//! height u16, features u32: 40 bytes.

use crate::link::RawKind;
use crate::link::records::Reader;
use crate::num::low_u8;
use crate::num::low_u16;
use crate::units::{FrameIndex, Size};

/// Bytes of the payload.
pub const EMBEDDED_BYTES: usize = 40;
const MAGIC: [u8; 4] = *b"SNSL";
const VERSION: u8 = 1;
const TEMPERATURE_IS_MEASURED: u8 = 1;

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
    pub(crate) shape: Shape,
}

/// What follows in the frame; filled in by `pack_frame`.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(crate) struct Shape {
    pub(crate) data_type: u8,
    pub(crate) bits: u8,
    pub(crate) width_px: u16,
    pub(crate) height_px: u16,
    pub(crate) features: u32,
}

impl FrameMetadata {
    /// Depth of the codes; 0 in metadata that was not sent.
    pub fn bits(&self) -> u32 {
        self.shape.bits.into()
    }

    /// Width and height of the picture, if rows were sent.
    pub fn size(&self) -> Option<Size> {
        (self.shape.data_type != 0)
            .then(|| Size { width_px: self.shape.width_px.into(), height_px: self.shape.height_px.into() })
    }

    /// Number of features that were sent.
    pub fn feature_count(&self) -> u32 {
        self.shape.features
    }

    /// Fills in what the frame carries. Callers have checked width, height and depth.
    pub(crate) fn describe(&mut self, size: Option<Size>, kind: RawKind, bits: u32, features: u32) {
        let size_or_none = size.unwrap_or(Size { width_px: 0, height_px: 0 });
        self.shape = Shape {
            data_type: size.map_or(0, |_| kind.data_type()),
            bits: low_u8(bits),
            width_px: low_u16(size_or_none.width_px),
            height_px: low_u16(size_or_none.height_px),
            features,
        };
    }

    pub(crate) fn to_bytes(self) -> Vec<u8> {
        let mut bytes = Vec::with_capacity(EMBEDDED_BYTES);
        bytes.extend_from_slice(&MAGIC);
        let flags = self.temperature_mk.map_or(0, |_| TEMPERATURE_IS_MEASURED);
        bytes.extend_from_slice(&[VERSION, self.shape.data_type, self.shape.bits, flags]);
        bytes.extend_from_slice(&self.frame.0.to_le_bytes());
        bytes.extend_from_slice(&self.timestamp_ns.to_le_bytes());
        bytes.extend_from_slice(&self.exposure_ns.to_le_bytes());
        bytes.extend_from_slice(&self.row_time_ns.to_le_bytes());
        bytes.extend_from_slice(&self.temperature_mk.unwrap_or(0).to_le_bytes());
        bytes.extend_from_slice(&self.shape.width_px.to_le_bytes());
        bytes.extend_from_slice(&self.shape.height_px.to_le_bytes());
        bytes.extend_from_slice(&self.shape.features.to_le_bytes());
        assert!(bytes.len() == EMBEDDED_BYTES, "the layout has one length");
        bytes
    }

    /// Nothing, if length, magic or version are not this layout's.
    pub(crate) fn from_bytes(payload: &[u8]) -> Option<Self> {
        if payload.len() != EMBEDDED_BYTES {
            return None;
        }
        let mut reader = Reader(payload);
        if reader.take::<4>()? != MAGIC || reader.u8()? != VERSION {
            return None;
        }
        let (data_type, bits, flags) = (reader.u8()?, reader.u8()?, reader.u8()?);
        let frame = FrameIndex(reader.u32()?);
        let timestamp_ns = u64::from_le_bytes(reader.take()?);
        let (exposure_ns, row_time_ns, temperature_mk) = (reader.u32()?, reader.u32()?, reader.u32()?);
        let (width_px, height_px, features) = (reader.u16()?, reader.u16()?, reader.u32()?);
        let temperature_mk = (flags & TEMPERATURE_IS_MEASURED != 0).then_some(temperature_mk);
        let shape = Shape { data_type, bits, width_px, height_px, features };
        Some(Self { frame, timestamp_ns, exposure_ns, row_time_ns, temperature_mk, shape })
    }
}
