//! Distributes the bytes of a burst over the data lanes, and merges them again.

use bitvec::order::Lsb0;
use bitvec::vec::BitVec;

/// Byte i goes to lane i mod lanes; the last lanes may be one byte short. Panics without lanes.
pub fn distribute(bytes: &[u8], lanes: usize) -> Vec<Vec<u8>> {
    assert!(lanes > 0, "a link has lanes");
    (0..lanes).map(|lane| bytes.iter().skip(lane).step_by(lanes).copied().collect()).collect()
}

/// Undoes `distribute`. Panics on lanes that cannot come from it.
pub fn merge(lanes: &[Vec<u8>]) -> Vec<u8> {
    let total: usize = lanes.iter().map(Vec::len).sum();
    (0..total).map(|i| lanes[i % lanes.len()][i / lanes.len()]).collect()
}

/// The bits of a lane in the order in which they are on the wire: the least significant of each byte first.
pub fn serial_bits(lane: &[u8]) -> BitVec<u8, Lsb0> {
    BitVec::from_slice(lane)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn lanes_take_turns_by_byte_and_give_all_bytes_back() {
        let bytes: Vec<u8> = (0..=10).collect();
        assert_eq!(distribute(&bytes, 4), [vec![0, 4, 8], vec![1, 5, 9], vec![2, 6, 10], vec![3, 7]]);
        for lanes in 1..=4 {
            assert_eq!(merge(&distribute(&bytes, lanes)), bytes, "{lanes} lanes");
        }
    }

    #[test]
    fn the_synchronisation_byte_is_00011101_on_the_wire() {
        // D-PHY names its start-of-transmission pattern in wire order; as a byte it is 0xB8.
        let wire: Vec<bool> = serial_bits(&[0xB8]).iter().by_vals().collect();
        assert_eq!(wire, [false, false, false, true, true, true, false, true]);
    }
}
