//! Containers of codes. Packs a row of codes into the payload of its packet, and unpacks it.
//!
//! A code with fewer bits than its container keeps its value: it is carried right-aligned, the container's upper bits zero.

use crate::error::Error;
use crate::num::{low_u8, low_u16, low_u32};

/// RAW data types of CSI-2.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum RawKind {
    /// 4 pixels in 3 bytes, a stream of bits, least significant first.
    Raw6,
    /// 8 pixels in 7 bytes, a stream of bits, least significant first.
    Raw7,
    /// A byte per pixel.
    Raw8,
    /// 4 pixels in 5 bytes: upper bytes, then a byte of the lower two bits.
    Raw10,
    /// 2 pixels in 3 bytes: upper bytes, then a byte of the lower four bits.
    Raw12,
    /// 4 pixels in 7 bytes: upper bytes, then three bytes of the lower six bits.
    Raw14,
    /// 2 bytes per pixel, the upper one first, as in all wider containers of the standard.
    Raw16,
}

impl RawKind {
    /// All kinds, narrow to wide.
    pub const ALL: [Self; 7] = [Self::Raw6, Self::Raw7, Self::Raw8, Self::Raw10, Self::Raw12, Self::Raw14, Self::Raw16];

    /// The narrowest container for codes of this depth.
    pub fn smallest(bits: u32) -> Result<Self, Error> {
        let fits = |kind: &Self| bits > 0 && kind.bits() >= bits;
        Self::ALL.into_iter().find(fits).ok_or_else(|| Error::key("sensor.adc.bits", bits, "use 1 to 16"))
    }

    /// Name in a configuration, bits of a pixel, number in the data identifier, and pixels that share whole bytes with those bytes.
    fn layout(self) -> (&'static str, u32, u8, (usize, usize)) {
        match self {
            Self::Raw6 => ("raw6", 6, 0x28, (4, 3)),
            Self::Raw7 => ("raw7", 7, 0x29, (8, 7)),
            Self::Raw8 => ("raw8", 8, 0x2A, (1, 1)),
            Self::Raw10 => ("raw10", 10, 0x2B, (4, 5)),
            Self::Raw12 => ("raw12", 12, 0x2C, (2, 3)),
            Self::Raw14 => ("raw14", 14, 0x2D, (4, 7)),
            Self::Raw16 => ("raw16", 16, 0x2E, (1, 2)),
        }
    }

    /// The word in a configuration.
    pub fn name(self) -> &'static str {
        self.layout().0
    }

    /// Bits of a pixel on the link.
    pub fn bits(self) -> u32 {
        self.layout().1
    }

    /// Number in the data identifier.
    pub fn data_type(self) -> u8 {
        self.layout().2
    }

    /// Pixels that share whole bytes, and those bytes.
    fn group(self) -> (usize, usize) {
        self.layout().3
    }

    /// Whether a row of this width is a legal payload.
    pub fn check_width(self, width_px: u32) -> Result<(), Error> {
        let (pixels, bytes) = self.group();
        let width = crate::num::index(width_px);
        let name = self.name();
        if !width.is_multiple_of(pixels) {
            let reason =
                format!("{name} carries whole groups of {pixels} pixels; use a multiple, or link.format = \"raw16\"");
            return Err(Error::key("sensor.width", width_px, reason));
        }
        if width / pixels * bytes > usize::from(u16::MAX) {
            let most = usize::from(u16::MAX) / bytes * pixels;
            return Err(Error::key("sensor.width", width_px, format!("a {name} packet carries up to {most} pixels")));
        }
        Ok(())
    }

    /// Bytes of a row of whole groups.
    pub fn payload_bytes(self, width_px: usize) -> usize {
        let (pixels, bytes) = self.group();
        width_px / pixels * bytes
    }

    /// Appends a row. Panics if a code is wider than the container, or if the row is no whole number of groups.
    pub fn pack(self, row: &[u16], payload: &mut Vec<u8>) {
        let largest = row.iter().fold(0, |all, code| all | code);
        assert!(u32::from(largest) >> self.bits() == 0, "codes fit their container");
        assert!(row.len().is_multiple_of(self.group().0), "rows are whole groups");
        let upper = |code: u16, low_bits: u32| low_u8(u32::from(code) >> low_bits);
        match self {
            Self::Raw6 => pack_stream::<4, 6>(row, payload),
            Self::Raw7 => pack_stream::<8, 7>(row, payload),
            Self::Raw8 => payload.extend(row.iter().map(|&code| upper(code, 0))),
            Self::Raw10 => pack_split::<4, 2>(row, payload),
            Self::Raw12 => pack_split::<2, 4>(row, payload),
            Self::Raw14 => pack_split::<4, 6>(row, payload),
            Self::Raw16 => payload.extend(row.iter().flat_map(|code| code.to_be_bytes())),
        }
    }

    /// Codes in a payload of so many bytes, or nothing if it is no whole number of groups.
    pub fn pixels_in(self, payload_bytes: usize) -> Option<usize> {
        let (pixels, bytes) = self.group();
        payload_bytes.is_multiple_of(bytes).then(|| payload_bytes / bytes * pixels)
    }

    /// The codes of a payload, into a row of as many. Panics at a row of other length.
    pub fn unpack_into(self, payload: &[u8], row: &mut [u16]) {
        assert!(self.pixels_in(payload.len()) == Some(row.len()), "a payload fills its row");
        match self {
            Self::Raw6 => unpack_stream::<4, 6>(payload, row),
            Self::Raw7 => unpack_stream::<8, 7>(payload, row),
            Self::Raw8 => row.iter_mut().zip(payload).for_each(|(code, &byte)| *code = u16::from(byte)),
            Self::Raw10 => unpack_split::<4, 2>(payload, row),
            Self::Raw12 => unpack_split::<2, 4>(payload, row),
            Self::Raw14 => unpack_split::<4, 6>(payload, row),
            Self::Raw16 => {
                let pairs = payload.as_chunks::<2>().0;
                row.iter_mut().zip(pairs).for_each(|(code, &pair)| *code = u16::from_be_bytes(pair));
            }
        }
    }
}

/// Room for so many groups behind what is there.
#[inline(always)]
fn room(groups: usize, group_bytes: usize, payload: &mut Vec<u8>) -> &mut [u8] {
    let start = payload.len();
    payload.resize(start + groups * group_bytes, 0);
    &mut payload[start..]
}

/// Groups as one word, the first pixel in the lowest bits.
fn pack_stream<const PIXELS: usize, const BITS: usize>(row: &[u16], payload: &mut Vec<u8>) {
    let group_bytes = PIXELS * BITS / 8;
    let groups = room(row.len() / PIXELS, group_bytes, payload).chunks_exact_mut(group_bytes);
    for (codes, group) in row.as_chunks::<PIXELS>().0.iter().zip(groups) {
        let word = codes.iter().rev().fold(0_u64, |word, &code| word << BITS | u64::from(code));
        group.copy_from_slice(&word.to_le_bytes()[..PIXELS * BITS / 8]);
    }
}

fn unpack_stream<const PIXELS: usize, const BITS: usize>(payload: &[u8], row: &mut [u16]) {
    let groups = payload.chunks_exact(PIXELS * BITS / 8);
    for (group, codes) in groups.zip(row.as_chunks_mut::<PIXELS>().0) {
        let word = little_endian(group);
        for (i, code) in codes.iter_mut().enumerate() {
            *code = low_bits(word >> (i * BITS), BITS);
        }
    }
}

/// Groups as the pixels' upper bytes, then their lower bits as one word, the first pixel in the lowest bits.
fn pack_split<const PIXELS: usize, const LOW: usize>(row: &[u16], payload: &mut Vec<u8>) {
    let group_bytes = PIXELS + PIXELS * LOW / 8;
    let groups = room(row.len() / PIXELS, group_bytes, payload).chunks_exact_mut(group_bytes);
    for (codes, group) in row.as_chunks::<PIXELS>().0.iter().zip(groups) {
        let (uppers, lows) = group.split_at_mut(PIXELS);
        for (upper, &code) in uppers.iter_mut().zip(codes) {
            *upper = low_u8(u32::from(code) >> LOW);
        }
        let word = codes.iter().rev().fold(0_u64, |word, &code| word << LOW | u64::from(code) & ((1 << LOW) - 1));
        lows.copy_from_slice(&word.to_le_bytes()[..PIXELS * LOW / 8]);
    }
}

fn unpack_split<const PIXELS: usize, const LOW: usize>(payload: &[u8], row: &mut [u16]) {
    let groups = payload.chunks_exact(PIXELS + PIXELS * LOW / 8);
    for (group, codes) in groups.zip(row.as_chunks_mut::<PIXELS>().0) {
        let (uppers, lows) = group.split_at(PIXELS);
        let lows = little_endian(lows);
        for (i, (code, &upper)) in codes.iter_mut().zip(uppers).enumerate() {
            *code = u16::from(upper) << LOW | low_bits(lows >> (i * LOW), LOW);
        }
    }
}

/// At most eight bytes as a word, the first the lowest.
fn little_endian(bytes: &[u8]) -> u64 {
    bytes.iter().rev().fold(0, |word, &byte| word << 8 | u64::from(byte))
}

fn low_bits(word: u64, bits: usize) -> u16 {
    low_u16(low_u32(word & ((1 << bits) - 1)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::draw::mix;

    #[test]
    fn every_kind_gives_back_what_it_was_given() {
        let mut tried = 0;
        for kind in RawKind::ALL {
            for groups in [1, 2, 3, 17, 160] {
                let width = groups * kind.group().0;
                let row: Vec<u16> =
                    (0..width as u64).map(|i| low_bits(mix(i + groups as u64), kind.bits() as usize)).collect();
                let mut payload = Vec::new();
                kind.pack(&row, &mut payload);
                assert_eq!(payload.len() * 8, width * kind.bits() as usize, "{kind:?} is dense");
                let mut unpacked = vec![0; width];
                kind.unpack_into(&payload, &mut unpacked);
                assert_eq!(unpacked, row, "{kind:?}, {width} pixels");
                tried += 1;
            }
        }
        assert_eq!(tried, 35);
    }

    #[test]
    fn raw10_and_raw12_are_laid_out_as_the_standard_draws_them() {
        let mut payload = Vec::new();
        RawKind::Raw10.pack(&[0x3FF, 0x001, 0x002, 0x200], &mut payload);
        assert_eq!(payload, [0xFF, 0x00, 0x00, 0x80, 0b00_10_01_11]);
        payload.clear();
        RawKind::Raw12.pack(&[0xABC, 0x123], &mut payload);
        assert_eq!(payload, [0xAB, 0x12, 0x3C]);
    }

    #[test]
    fn widths_that_are_no_whole_groups_are_refused_and_named() {
        for (kind, width_px, legal) in [
            (RawKind::Raw10, 641, false),
            (RawKind::Raw10, 644, true),
            (RawKind::Raw16, 641, true),
            (RawKind::Raw16, 40_000, false),
        ] {
            assert_eq!(kind.check_width(width_px).is_ok(), legal, "{kind:?}, {width_px}");
        }
        assert!(RawKind::Raw10.check_width(641).unwrap_err().to_string().contains("groups of 4"));
    }
}
