//! Packets of `sensel::link` as requests and beats of the packetiser, and its words as bytes.

use sensel::compute::Feature;
use sensel::draw::mix;
use sensel::events::Events;
use sensel::link::{Batch, FrameMetadata, FrameOut, LinkParams, Mode, RawKind, pack_frame};
use sensel::plane::Plane;
use sensel::units::{FrameIndex, Size};
use sensel::words::{PositionPx, Turns};

use rtl_models::csi2_packetiser::{PacketiserIn, PacketiserOut};

/// A packet: what is asked for, the payload in beats, and the bytes that have to come out.
pub struct Case {
    pub channel: u8,
    pub data_type: u8,
    pub word_count: u16,
    pub beats: Vec<u64>,
    pub bytes: Vec<u8>,
}

impl Case {
    /// The pins that ask for it.
    pub fn request(&self) -> PacketiserIn {
        let &Self { channel, data_type, word_count, .. } = self;
        PacketiserIn { channel, data_type, word_count, ..PacketiserIn::default() }
    }
}

/// The packets of a random frame with rows of one container, line-start packets or none, and features in the gaps.
pub fn frame(seed: u64, kind: RawKind) -> Vec<Case> {
    let draw = |field: u64| mix(mix(seed) ^ field);
    let below = |field: u64, bound: u64| u32::try_from(draw(field) % bound).unwrap();
    let group = match kind {
        RawKind::Raw6 | RawKind::Raw10 | RawKind::Raw14 => 4,
        RawKind::Raw7 => 8,
        RawKind::Raw12 => 2,
        RawKind::Raw8 | RawKind::Raw16 => 1,
    };
    let size = Size { width_px: group * (1 + below(1, 40)), height_px: 1 + below(2, 4) };
    let code = |i: usize| u16::try_from(draw(100 + i as u64) & ((1 << kind.bits()) - 1)).unwrap();
    let codes = Plane::from_values(size, (0..size.pixel_count()).map(code).collect());
    let features: Vec<Feature> = (0..below(3, 7)).map(|i| feature(draw(50 + u64::from(i)))).collect();
    let params =
        LinkParams { format: Some(kind), line_sync: below(4, 2) == 0, ..LinkParams::new(1, 240_000_000, Mode::Both) };
    let metadata =
        FrameMetadata { frame: FrameIndex(below(5, 1 << 20)), timestamp_ns: draw(6), ..FrameMetadata::default() };
    let batches = [Batch { features: u32::try_from(features.len()).unwrap(), after_row: 0 }];
    let out = FrameOut {
        virtual_channel: u8::try_from(below(7, 4)).unwrap(),
        metadata,
        codes: Some(&codes),
        bits: kind.bits(),
        features: Some(&features),
        batches: &batches,
        features_per_gap: 1 + below(8, 3),
    };
    split(&pack_frame(&out, &params, &mut Events::default()).unwrap(), &codes)
}

fn feature(draw: u64) -> Feature {
    let [a, b, c, d, score, angle, octave, e] = draw.to_le_bytes();
    let (x, y) = (PositionPx::from_le_bytes([a, b]), PositionPx::from_le_bytes([c, d]));
    Feature {
        x,
        y,
        score: score.into(),
        angle: Turns::from_bits(angle),
        octave,
        descriptor: std::array::from_fn(|i| e.wrapping_mul(sensel::num::low_u8(sensel::num::u32_from(i)) | 1)),
    }
}

/// Packets one by one; rows get the codes as their beats, all others their payload.
fn split(bytes: &[u8], codes: &Plane<u16>) -> Vec<Case> {
    let (mut at, mut row, mut cases) = (0, 0, Vec::new());
    while at < bytes.len() {
        let (channel, data_type) = (bytes[at] >> 6, bytes[at] & 0x3F);
        let word_count = u16::from_le_bytes([bytes[at + 1], bytes[at + 2]]);
        let payload = if data_type < 0x10 { 0 } else { usize::from(word_count) };
        let length = if data_type < 0x10 { 4 } else { payload + 6 };
        let beats = if (0x28..=0x2E).contains(&data_type) {
            row += 1;
            let four = |four: &[u16]| four.iter().rev().fold(0, |beat, &code| beat << 16 | u64::from(code));
            codes.row(row - 1).chunks(4).map(four).collect()
        } else {
            let four = |four: &[u8]| four.iter().rev().fold(0, |beat, &byte| beat << 8 | u64::from(byte));
            bytes[at + 4..at + 4 + payload].chunks(4).map(four).collect()
        };
        cases.push(Case { channel, data_type, word_count, beats, bytes: bytes[at..at + length].to_vec() });
        at += length;
    }
    cases
}

/// Collects the words that were taken, and cuts them into packets.
#[derive(Default)]
pub struct Receiver {
    open: Vec<u8>,
    pub packets: Vec<Vec<u8>>,
}

impl Receiver {
    /// A word as it stood on the pins at an edge at which the receiver was ready.
    pub fn take(&mut self, out: &PacketiserOut, lanes: u32) {
        assert_eq!(out.word_first, self.open.is_empty(), "a packet begins where none is open");
        let count = out.word_keep.count_ones();
        assert_eq!(u32::from(out.word_keep), (1 << count) - 1, "bytes fill the lanes from the first on");
        assert!(count >= 1 && count <= lanes && (count == lanes || out.word_last), "only the last word runs short");
        self.open.extend(&out.word.to_le_bytes()[..count as usize]);
        if out.word_last {
            self.packets.push(std::mem::take(&mut self.open));
        }
    }
}
