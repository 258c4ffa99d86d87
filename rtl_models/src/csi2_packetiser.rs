//! CSI-2 packetiser, twin of `verilog/csi2_packetiser.sv`. Packs the payload's pixels or bytes into words of one byte per lane: header with
//! ECC, payload, CRC. Counts flipped lane bits for the energy model.
//!
//! A word leaves in every clock in which the receiver is ready, where a beat of four pixels holds as many bytes as there are lanes: on
//! one and two lanes always, on four lanes from RAW8 on.

use crate::flips;

/// Run-time parameter of the packetiser.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct PacketiserConfig {
    /// 0, 1, 2: one, two or four lanes; 3 acts as 2.
    pub lanes_log2: u32,
}

impl PacketiserConfig {
    /// Lanes in use.
    pub fn lanes(&self) -> u32 {
        match self.lanes_log2 {
            0 => 1,
            1 => 2,
            _ => 4,
        }
    }
}

/// Pins that enter, as they stand at the rising edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PacketiserIn {
    /// Synchronous reset.
    pub rst: bool,
    /// A packet is asked for; taken when `req_ready` stands.
    pub req_valid: bool,
    /// Virtual channel, 0 to 3.
    pub channel: u8,
    /// Data type, 6 bits; from 0x10 on the packet is long.
    pub data_type: u8,
    /// Payload bytes of a long packet, the data field of a short one.
    pub word_count: u16,
    /// A beat of the payload stands in `in_data`; taken when `in_ready` stands.
    pub in_valid: bool,
    /// Four pixels of 16 bits, the first lowest, or four bytes in the lower half.
    pub in_data: u64,
    /// The word on the pins is taken at this edge.
    pub word_ready: bool,
}

/// Pins that leave, after the rising edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct PacketiserOut {
    /// A request is taken.
    pub req_ready: bool,
    /// A beat is taken.
    pub in_ready: bool,
    /// `word` holds bytes.
    pub word_valid: bool,
    /// The byte of lane l in bits 8 l to 8 l + 7.
    pub word: u32,
    /// Lanes that carry a byte, lane 0 lowest.
    pub word_keep: u8,
    /// First word of its packet.
    pub word_first: bool,
    /// Last word of its packet.
    pub word_last: bool,
}

#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
enum State {
    #[default]
    Idle,
    Head,
    Body,
    Foot,
}

/// The packetiser's registers and what its lanes have flipped.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Packetiser {
    state: State,
    kind: u8,
    header: u32,
    head_left: u32,
    left: u16,
    held: u128,
    nibbles: u32,
    crc: u16,
    word_valid: bool,
    word: u32,
    word_keep: u8,
    word_first: bool,
    word_last: bool,
    toggles: u64,
}

/// Header bits that each parity bit covers: MIPI CSI-2, the table of ECC syndromes.
const PARITY_MASKS: [u32; 6] = [0xF1_2CB7, 0xF2_555B, 0x74_9A6D, 0xB8_E38E, 0xDF_03F0, 0xEF_FC00];

fn ecc_of(header: u32) -> u32 {
    let bit = |(row, mask): (usize, &u32)| ((header & mask).count_ones() & 1) << row;
    PARITY_MASKS.iter().enumerate().map(bit).sum()
}

fn crc_of(crc: u16, byte: u8) -> u16 {
    let mut value = crc ^ u16::from(byte);
    for _ in 0..8 {
        value = if value & 1 == 1 { value >> 1 ^ 0x8408 } else { value >> 1 };
    }
    value
}

fn mask_of(bytes: u32) -> u32 {
    if bytes >= 4 { u32::MAX } else { (1 << (8 * bytes)) - 1 }
}

fn keep_of(bytes: u32) -> u8 {
    [0, 1, 3, 7, 15][usize::try_from(bytes.min(4)).expect("at most 4")]
}

/// The payload's bits of a beat and their number in nibbles.
fn packed(kind: u8, data: u64) -> (u64, u32) {
    let pixel = |index: u32| data >> (16 * index) & 0xFFFF;
    let bits = |index: u32, low: u32, count: u32| pixel(index) >> low & ((1 << count) - 1);
    let four = |low: u32, count: u32| (0..4).fold(0, |word, index| word | bits(index, low, count) << (count * index));
    match kind {
        0x28 => (four(0, 6), 6),
        0x29 => (four(0, 7), 7),
        0x2A => (four(0, 8), 8),
        0x2B => (four(2, 8) | four(0, 2) << 32, 10),
        0x2C => {
            let pair = |index: u32| {
                bits(index, 4, 8) | bits(index + 1, 4, 8) << 8 | bits(index, 0, 4) << 16 | bits(index + 1, 0, 4) << 20
            };
            (pair(0) | pair(2) << 24, 12)
        }
        0x2D => (four(6, 8) | four(0, 6) << 32, 14),
        // The upper byte goes first.
        0x2E => ((0..4).fold(0, |word, index| word | (bits(index, 8, 8) | bits(index, 0, 8) << 8) << (16 * index)), 16),
        _ => (data & 0xFFFF_FFFF, 8),
    }
}

impl Packetiser {
    /// A packetiser in reset.
    pub fn new() -> Self {
        Self::default()
    }

    /// Pins as they stand.
    pub fn out(&self) -> PacketiserOut {
        let room = self.nibbles < 16 && 2 * u32::from(self.left) > self.nibbles;
        PacketiserOut {
            req_ready: self.state == State::Idle,
            in_ready: self.state == State::Body && room,
            word_valid: self.word_valid,
            word: self.word,
            word_keep: self.word_keep,
            word_first: self.word_first,
            word_last: self.word_last,
        }
    }

    /// Bits flipped so far on the lanes' bytes.
    pub fn toggles(&self) -> u64 {
        self.toggles
    }

    /// One rising edge.
    pub fn tick(&mut self, config: &PacketiserConfig, pins: PacketiserIn) -> PacketiserOut {
        let (stood, before) = (self.out(), self.word);
        if pins.rst {
            *self = Self { toggles: self.toggles, ..Self::default() };
        } else {
            let kind = self.kind;
            if !self.word_valid || pins.word_ready {
                self.word_valid = self.emit(config.lanes());
            }
            if pins.in_valid && stood.in_ready {
                let (beat, nibbles) = packed(kind, pins.in_data);
                self.held |= u128::from(beat) << (4 * self.nibbles);
                self.nibbles += nibbles;
            }
            if pins.req_valid && stood.req_ready {
                self.request(&pins);
            }
        }
        self.toggles += flips(before, self.word);
        self.out()
    }

    fn request(&mut self, pins: &PacketiserIn) {
        let [low, high] = pins.word_count.to_le_bytes();
        let header = u32::from_le_bytes([pins.channel << 6 | pins.data_type, low, high, 0]);
        self.header = header | ecc_of(header) << 24;
        (self.state, self.kind, self.head_left) = (State::Head, pins.data_type, 4);
        (self.left, self.crc) = (pins.word_count, 0xFFFF);
    }

    /// Puts the next word on the pins, if there is one.
    fn emit(&mut self, lanes: u32) -> bool {
        match self.state {
            State::Idle => false,
            State::Head => {
                let ends = self.head_left == lanes;
                let is_short = self.kind < 0x10;
                (self.word, self.word_keep) = (self.header & mask_of(lanes), keep_of(lanes));
                (self.word_first, self.word_last) = (self.head_left == 4, ends && is_short);
                self.header = self.header.checked_shr(8 * lanes).unwrap_or(0);
                self.head_left -= lanes;
                if ends {
                    self.state = if is_short { State::Idle } else { State::Body };
                }
                true
            }
            State::Body => self.emit_body(lanes),
            State::Foot => {
                (self.word, self.word_keep) = (u32::from(self.crc >> 8), 1);
                (self.word_first, self.word_last) = (false, true);
                self.state = State::Idle;
                true
            }
        }
    }

    /// A word of payload, or one in which the payload ends and the checksum begins.
    fn emit_body(&mut self, lanes: u32) -> bool {
        let left = u32::from(self.left);
        let closes = left < lanes;
        let take = if closes { left } else { lanes };
        if self.nibbles < 2 * take {
            return false;
        }
        let [b0, b1, b2, b3, ..] = self.held.to_le_bytes();
        let payload = u32::from_le_bytes([b0, b1, b2, b3]) & mask_of(take);
        let bytes = payload.to_le_bytes();
        self.crc = (0..take).zip(bytes).fold(self.crc, |crc, (_, byte)| crc_of(crc, byte));
        // A closing word takes fewer bytes than there are lanes, so its checksum starts below bit 32.
        let checksum = if closes { u32::from(self.crc) << (8 * take) } else { 0 };
        let fits = take + 2 <= lanes;
        self.word = (payload | checksum) & mask_of(lanes);
        self.word_keep = keep_of(if closes && fits { take + 2 } else { lanes });
        (self.word_first, self.word_last) = (false, closes && fits);
        self.left -= u16::try_from(take).expect("at most 4");
        if closes {
            (self.held, self.nibbles) = (0, 0);
            self.state = if fits { State::Idle } else { State::Foot };
        } else {
            self.held >>= 8 * take;
            self.nibbles -= 2 * take;
        }
        true
    }
}
