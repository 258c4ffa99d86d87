//! CSI-2 packets, lanes and bandwidth. Packs the codes and features of a frame into bytes, and decodes them on the host.
//!
//! A frame is a frame-start packet, one line of embedded data (counter, times, gain, shape), one long packet a row of codes, user
//! packets with features between and after the rows, and a frame-end packet. The sensor's side is `pack_frame`; `LinkParams::flow`
//! says when each packet is on the lanes; the host's side is `decode`, which accepts only what it can check.

mod channel;
mod checks;
mod dphy;
mod embedded;
mod flow;
mod lanes;
mod pack;
mod packet;
mod params;
mod plan;
mod raw;
mod receive;
mod records;
mod traffic;

pub use channel::flip_bits;
pub use checks::{HeaderCheck, check_header, crc16, ecc};
pub use dphy::{HS_EXIT_NS, HS_PREPARE_ZERO_NS, HS_PREPARE_ZERO_UI, HS_TRAIL_NS, HS_TRAIL_UI, LPX_NS};
pub use embedded::{EMBEDDED_BYTES, FrameMetadata, FrameShape};
pub use flow::{FeatureReady, Flow, RowPeriod, Sent};
pub use lanes::{distribute, merge, serial_bits};
pub use pack::{FrameOut, pack_frame, pack_row};
pub use packet::{CRC_BYTES, HEADER_BYTES, frame_number};
pub use params::{LinkParams, Mode, WhenFull};
pub use plan::{Batch, FramePlan, PlannedPacket, after_the_rows, by_cell_row, by_row, evenly};
pub use raw::RawKind;
pub use receive::{Decoded, Decoder, LinkCounts, Received, decode, decode_without_pictures};
pub use records::{FEATURE_BYTES, FEATURE_HEADER_BYTES, FEATURES_PER_PACKET_MAX};
pub use traffic::Traffic;
