//! CSI-2 packets, lanes and bandwidth. Enters: codes and features of a frame. Leaves: bytes, and their decoder for the host.
//!
//! A frame is a frame-start packet, one line of embedded data (counter, times, shape), one long packet a row of codes, user
//! packets with features, and a frame-end packet, back to back. The sensor's side is `pack_frame`; the host's side is
//! `decode`, which trusts nothing it was not able to check.

mod checks;
mod dphy;
mod embedded;
mod lanes;
mod packet;
mod raw;
mod receive;
mod records;
mod traffic;

pub use checks::{HeaderCheck, check_header, crc16, ecc};
pub use dphy::{HS_EXIT_NS, HS_PREPARE_ZERO_NS, HS_PREPARE_ZERO_UI, HS_TRAIL_NS, HS_TRAIL_UI, LPX_NS};
pub use embedded::{EMBEDDED_BYTES, FrameMetadata, FrameShape};
pub use lanes::{distribute, merge, serial_bits};
pub use packet::{CRC_BYTES, HEADER_BYTES, frame_number};
pub use raw::RawKind;
pub use receive::{Decoded, LinkCounts, Received, decode};
pub use records::{FEATURE_BYTES, FEATURES_PER_PACKET_MAX};
pub use traffic::Traffic;

use crate::compute::Feature;
use crate::error::Error;
use crate::events::{Event, Events};
use crate::num::{u32_from, u64_from};
use crate::plane::Plane;
use crate::units::Size;
use packet::{DataType, push_long, push_short};

/// What a frame carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Mode {
    /// The codes of all rows.
    Frames,
    /// Feature packets only.
    Features,
    /// Codes and features.
    Both,
}

impl Mode {
    /// The word in a configuration.
    pub fn name(self) -> &'static str {
        match self {
            Self::Frames => "frames",
            Self::Features => "features",
            Self::Both => "both",
        }
    }

    /// The mode of a configuration's word.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        [Self::Frames, Self::Features, Self::Both].into_iter().find(|mode| mode.name() == name).ok_or_else(|| {
            Error::Unknown { what: "link mode", name: name.to_owned(), known: "frames, features, both".to_owned() }
        })
    }

    /// Whether rows of codes are sent.
    pub fn sends_codes(self) -> bool {
        matches!(self, Self::Frames | Self::Both)
    }

    /// Whether feature packets are sent.
    pub fn sends_features(self) -> bool {
        matches!(self, Self::Features | Self::Both)
    }
}

/// What the link is set to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LinkParams {
    /// Data lanes, 1 to 4.
    pub lanes: u32,
    /// Double-data-rate clock: every lane carries two bits a clock.
    pub frequency_hz: u64,
    /// What a frame carries.
    pub mode: Mode,
    /// Container of a code; `None` takes the smallest that holds the codes.
    pub format: Option<RawKind>,
}

/// Slowest clock of D-PHY's high-speed mode: 80 Mbit/s a lane.
const FREQUENCY_HZ_MIN: u64 = 40_000_000;
/// Fastest clock of D-PHY 2.1 over the standard channel: 4.5 Gbit/s a lane.
const FREQUENCY_HZ_MAX: u64 = 2_250_000_000;

impl LinkParams {
    /// The same, after its ranges are checked.
    pub fn checked(self) -> Result<Self, Error> {
        if !(1..=4).contains(&self.lanes) {
            return Err(Error::key("link.lanes", self.lanes, "1 to 4 would do"));
        }
        if !(FREQUENCY_HZ_MIN..=FREQUENCY_HZ_MAX).contains(&self.frequency_hz) {
            let reason = format!("{FREQUENCY_HZ_MIN} to {FREQUENCY_HZ_MAX} would do (D-PHY's double-data-rate clock)");
            return Err(Error::key("link.frequency_hz", self.frequency_hz, reason));
        }
        Ok(self)
    }

    /// The container for codes of this depth, if it holds them.
    pub fn raw_kind(&self, bits: u32) -> Result<RawKind, Error> {
        let smallest = RawKind::smallest(bits)?;
        match self.format {
            Some(kind) if kind.bits() < smallest.bits() => {
                let reason = format!("codes have {bits} bits; {} or wider would do", smallest.name());
                Err(Error::key("link.format", kind.name(), reason))
            }
            Some(kind) => Ok(kind),
            None => Ok(smallest),
        }
    }
}

/// A frame as the sensor hands it to its link.
#[derive(Clone, Copy, Debug)]
pub struct FrameOut<'a> {
    /// Number of the camera on its link, 0 to 3.
    pub virtual_channel: u8,
    /// Counter, times and temperature.
    pub metadata: FrameMetadata,
    /// Codes of all rows, each below 2^bits. Needed where the mode sends frames.
    pub codes: Option<&'a Plane<u16>>,
    /// Depth of the codes, 1 to 16.
    pub bits: u32,
    /// Features of the frame. Needed where the mode sends features.
    pub features: Option<&'a [Feature]>,
}

/// The bytes of one frame, packets back to back, and their events: every byte, and on every lane one burst a packet.
///
/// Refuses what the container cannot carry: a row that is no whole number of its groups (RAW10: 4 pixels, RAW12: 2, ...)
/// or is longer than a packet's 65,535 bytes. Rows are not padded, because a padded picture is another picture.
pub fn pack_frame(frame: &FrameOut, params: &LinkParams, events: &mut Events) -> Result<Vec<u8>, Error> {
    if frame.virtual_channel > 3 {
        return Err(Error::key("virtual_channel", frame.virtual_channel, "0 to 3 would do: one link has four"));
    }
    let codes = given(frame.codes, params.mode.sends_codes(), "codes")?;
    let features = given(frame.features, params.mode.sends_features(), "features")?;
    let kind = params.raw_kind(frame.bits)?;
    if let Some(codes) = codes {
        check_shape(kind, codes.size())?;
    }
    let channel = frame.virtual_channel;
    let number = frame_number(frame.metadata.frame);
    let shape =
        FrameShape::new(codes.map(Plane::size), kind, frame.bits, features.map_or(0, |list| u32_from(list.len())));
    let mut bytes = Vec::new();
    push_short(&mut bytes, channel, DataType::FrameStart, number);
    push_long(&mut bytes, channel, DataType::Embedded, &embedded::payload(&frame.metadata, &shape));
    let mut packets = 3;
    if let Some(codes) = codes {
        let mut payload = Vec::with_capacity(kind.payload_bytes(codes.width_px()));
        for (_, row) in codes.rows() {
            payload.clear();
            kind.pack(row, &mut payload);
            push_long(&mut bytes, channel, DataType::Raw(kind), &payload);
            packets += 1;
        }
    }
    for payload in features.into_iter().flat_map(|list| records::payloads(frame.metadata.frame, list)) {
        push_long(&mut bytes, channel, DataType::Features, &payload);
        packets += 1;
    }
    push_short(&mut bytes, channel, DataType::FrameEnd, number);
    events.add(Event::LinkByte, u64_from(bytes.len()));
    events.add(Event::LinkBurst, packets * u64::from(params.lanes));
    Ok(bytes)
}

/// The bytes of one row's packet, as `pack_frame` has them: header, codes, checksum.
///
/// # Errors
/// A row that the container cannot carry.
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
            return Err(Error::key(key, side_px, "up to 65535 would do on this link"));
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
