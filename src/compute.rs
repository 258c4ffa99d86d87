//! The fixed-point feature extractor on the sensor. Enters: codes of a frame. Leaves: features and counted events.

/// A corner with its descriptor, as it leaves the sensor.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Feature {
    /// Column of the corner in the full picture (octave 0 pixels).
    pub x_px: u16,
    /// Row of the corner in the full picture (octave 0 pixels).
    pub y_px: u16,
    /// FAST score: the largest threshold at which the corner survives, in 8-bit DN.
    pub score: u8,
    /// Orientation in 1/256 of a turn, from +x towards +y (down).
    pub angle: u8,
    /// Half-scale octave, 0 is full size.
    pub octave: u8,
    /// Rotated BRIEF, bit i of the pattern in bit i % 8 of byte i / 8. All zero where the patch leaves the picture.
    pub descriptor: [u8; 32],
}

impl Feature {
    /// Number of descriptor bits in which two features differ.
    pub fn distance(&self, other: &Self) -> u32 {
        self.descriptor.iter().zip(&other.descriptor).map(|(a, b)| (a ^ b).count_ones()).sum()
    }
}
