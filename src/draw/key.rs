//! The key of a draw: seed, effect, camera, frame, exposure slot and row, mixed in a fixed order.

use crate::units::{CameraIndex, FrameIndex, RowIndex};

/// The published number of an effect: part of every key, never reused, never its index in a list. `tests/effects/numbers.rs` lists all.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub struct EffectNumber(pub u64);

/// Names the array row that draws belong to: of which camera, frame and exposure, under which seed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct RowId {
    /// Seed of the run, or of the die for patterns that stay from frame to frame.
    pub seed: u64,
    /// Camera of the rig.
    pub camera: CameraIndex,
    /// Frame of the run; 0 for patterns of a die.
    pub frame: FrameIndex,
    /// Exposure within a frame (multi-exposure); 0 for single exposures.
    pub slot: u32,
    /// Row of the array.
    pub row: RowIndex,
}

/// The key of a stream of draws.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct DrawKey(pub u64);

impl DrawKey {
    /// The root of all keys of a seed.
    pub fn root(seed: u64) -> Self {
        Self(mix(seed))
    }

    /// The key one field deeper. Fields are always given in the same order.
    #[must_use]
    pub fn with(self, field: u64) -> Self {
        Self(mix(mix(self.0) ^ field))
    }

    /// One number in [0, 1), a multiple of 2^-53: the key's own upper bits, for callers that draw once per key.
    pub fn uniform(self) -> f64 {
        crate::num::f64_from_u64(self.0 >> 11) / 9_007_199_254_740_992.0
    }

    /// The key of one effect's draws in one exposure of one camera, for any row. It is computed once a frame, which saves mixing
    /// steps in every row.
    pub fn of_exposure(effect: EffectNumber, row_id: RowId) -> Self {
        Self::root(row_id.seed)
            .with(effect.0)
            .with(row_id.camera.0.into())
            .with(row_id.frame.0.into())
            .with(row_id.slot.into())
    }

    /// The key of one effect's draws in one row.
    pub fn of_row(effect: EffectNumber, row_id: RowId) -> Self {
        Self::of_exposure(effect, row_id).with(row_id.row.0.into())
    }
}

/// SplitMix64's finaliser (Stafford's variant 13): a bijection in which every input bit moves half of the output bits.
pub const fn mix(value: u64) -> u64 {
    let value = (value ^ (value >> 30)).wrapping_mul(0xBF58_476D_1CE4_E5B9);
    let value = (value ^ (value >> 27)).wrapping_mul(0x94D0_49BB_1331_11EB);
    value ^ (value >> 31)
}
