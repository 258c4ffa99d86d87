//! The two checks of CSI-2: the header's error correction code and the payload's CRC.

/// Header bits (bit 0 is the data identifier's lowest) that each parity bit covers, as masks of 24 bits.
///
/// Every bit of a header is in three or five rows, so two flipped bits never look like one.
const PARITY_MASKS: [u32; 6] = [0xF1_2CB7, 0xF2_555B, 0x74_9A6D, 0xB8_E38E, 0xDF_03F0, 0xEF_FC00];

/// What a received header was found to be.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum HeaderCheck {
    /// As it was sent.
    Right,
    /// One bit was flipped and is set right here: data identifier, word count low, word count high.
    Corrected([u8; 3]),
    /// Two or more bits are flipped.
    Refused,
}

/// Error correction code of data identifier and word count: six parity bits, the upper two bits zero.
pub fn ecc(header: [u8; 3]) -> u8 {
    let word = u32::from_le_bytes([header[0], header[1], header[2], 0]);
    PARITY_MASKS
        .iter()
        .enumerate()
        .fold(0, |code, (row, mask)| code | u8::from((word & mask).count_ones() % 2 == 1) << row)
}

/// Checks a received header of four bytes; any one flipped bit, of the code too, is corrected.
pub fn check_header(received: [u8; 4]) -> HeaderCheck {
    let header = [received[0], received[1], received[2]];
    let syndrome = ecc(header) ^ received[3];
    match syndrome.count_ones() {
        0 => return HeaderCheck::Right,
        1 => return HeaderCheck::Corrected(header),
        _ => {}
    }
    let column = |bit: u32| {
        PARITY_MASKS.iter().enumerate().fold(0, |code, (row, mask)| code | u8::from(mask >> bit & 1 == 1) << row)
    };
    match (0..24).find(|&bit| column(bit) == syndrome) {
        Some(bit) => {
            let word = u32::from_le_bytes([header[0], header[1], header[2], 0]) ^ (1 << bit);
            let [a, b, c, _] = word.to_le_bytes();
            HeaderCheck::Corrected([a, b, c])
        }
        None => HeaderCheck::Refused,
    }
}

/// Reflected polynomial x^16 + x^12 + x^5 + 1.
const POLYNOMIAL: u16 = 0x8408;

/// Bytes that go at once: each costs a look-up whichever it is, and what waits for the one before is shared by them all.
const AT_ONCE: usize = 16;

/// Remainders of one byte, and of that byte followed by one to fifteen zero bytes.
static REMAINDERS: [[u16; 256]; AT_ONCE] = remainders();

#[allow(clippy::cast_possible_truncation)] // A byte's number as a remainder: below 256.
const fn remainders() -> [[u16; 256]; AT_ONCE] {
    let mut tables = [[0; 256]; AT_ONCE];
    let mut byte = 0;
    while byte < 256 {
        let mut value = byte as u16;
        let mut bit = 0;
        while bit < 8 {
            value = if value & 1 == 1 { value >> 1 ^ POLYNOMIAL } else { value >> 1 };
            bit += 1;
        }
        tables[0][byte] = value;
        byte += 1;
    }
    let mut later = 1;
    while later < AT_ONCE {
        let mut byte = 0;
        while byte < 256 {
            let before = tables[later - 1][byte];
            tables[later][byte] = before >> 8 ^ tables[0][(before & 0xFF) as usize];
            byte += 1;
        }
        later += 1;
    }
    tables
}

/// CRC-16 of a payload: seed 0xFFFF, least significant bit first, no final inversion. An empty payload has 0xFFFF.
pub fn crc16(payload: &[u8]) -> u16 {
    let mut value = 0xFFFF_u16;
    let (blocks, rest) = payload.as_chunks::<AT_ONCE>();
    for block in blocks {
        let [low, high] = value.to_le_bytes();
        let begun = [block[0] ^ low, block[1] ^ high];
        // All but the first two bytes wait for nothing.
        let later = (2..AT_ONCE).fold(0, |sum, i| sum ^ REMAINDERS[AT_ONCE - 1 - i][usize::from(block[i])]);
        let [first, second] = [0, 1].map(|i| REMAINDERS[AT_ONCE - 1 - i][usize::from(begun[i])]);
        value = later ^ first ^ second;
    }
    for &byte in rest {
        let [low, _] = value.to_le_bytes();
        value = value >> 8 ^ REMAINDERS[0][usize::from(low ^ byte)];
    }
    value
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_standards_examples_hold() {
        let a = [
            0xFF, 0x00, 0x00, 0x02, 0xB9, 0xDC, 0xF3, 0x72, 0xBB, 0xD4, 0xB8, 0x5A, 0xC8, 0x75, 0xC2, 0x7C, 0x81, 0xF8,
            0x05, 0xDF, 0xFF, 0x00, 0x00, 0x01,
        ];
        let b = [
            0xFF, 0x00, 0x00, 0x00, 0x1E, 0xF0, 0x1E, 0xC7, 0x4F, 0x82, 0x78, 0xC5, 0x82, 0xE0, 0x8C, 0x70, 0xD2, 0x3C,
            0x78, 0xE9, 0xFF, 0x00, 0x00, 0x01,
        ];
        assert_eq!((crc16(&a), crc16(&b), crc16(&[])), (0x00F0, 0xE569, 0xFFFF));
        assert_eq!(ecc([0x37, 0xF0, 0x01]), 0x3F);
    }

    #[test]
    fn many_bytes_at_once_are_the_bit_by_bit_definition() {
        let bytes: Vec<u8> =
            (0..100_u64).map(|i| crate::num::low_u8(crate::num::low_u32(crate::draw::mix(i)))).collect();
        for length in 0..=bytes.len() {
            let mut value = 0xFFFF_u16;
            for bit in bytes[..length].iter().flat_map(|byte| (0..8).map(move |bit| u16::from(byte >> bit & 1))) {
                value = if (value ^ bit) & 1 == 1 { value >> 1 ^ POLYNOMIAL } else { value >> 1 };
            }
            assert_eq!(crc16(&bytes[..length]), value, "length {length}");
        }
    }

    #[test]
    fn every_flipped_bit_of_a_header_is_corrected_and_every_pair_is_refused() {
        let (mut single, mut double) = (0, 0);
        for header in [[0x2B, 0x20, 0x03], [0x00, 0x01, 0x00], [0xF0, 0xFF, 0xFF], [0x37, 0xF0, 0x01]] {
            let sent = u32::from_le_bytes([header[0], header[1], header[2], ecc(header)]);
            assert_eq!(check_header(sent.to_le_bytes()), HeaderCheck::Right);
            for a in 0..32 {
                assert_eq!(check_header((sent ^ 1 << a).to_le_bytes()), HeaderCheck::Corrected(header), "bit {a}");
                single += 1;
                for b in (a + 1)..32 {
                    let found = check_header((sent ^ 1 << a ^ 1 << b).to_le_bytes());
                    assert_eq!(found, HeaderCheck::Refused, "bits {a} and {b} of {header:?}");
                    double += 1;
                }
            }
        }
        assert_eq!((single, double), (4 * 32, 4 * 496));
    }
}
