//! Properties of one die: the keys of its rows, its deviations from the mean of all dies, and the quantiles that its patterns share.

use crate::draw::{DrawKey, EffectNumber, RowId, normal_quantile, uniform_at};
use crate::effect::RowPass;
use crate::units::{CameraIndex, FrameIndex, RowIndex};

/// No normal quantile of a 32-bit uniform lies further out: its least tail is 2^-33.
pub(super) const NORMAL_MAX: f64 = 6.34;

/// No exponential quantile of a 32-bit uniform is greater: 33 ln 2.
pub(super) const EXPONENTIAL_MAX: f64 = 22.875;

/// One die of the rig.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Die {
    pub(super) seed: u64,
    pub(super) camera: CameraIndex,
}

impl Die {
    pub(super) fn of(row: &RowPass<'_>) -> Self {
        Self { seed: row.die_seed, camera: row.row_id.camera }
    }

    /// Key of an effect's pattern in a row, equal in all frames.
    pub(super) fn key(self, effect: EffectNumber, row: RowIndex) -> DrawKey {
        let row_id = RowId { seed: self.seed, camera: self.camera, frame: FrameIndex(0), slot: 0, row };
        DrawKey::of_row(effect, row_id)
    }

    /// How many sigma this die lies from the mean of all dies, in the property that this number names.
    pub(super) fn deviation(self, what: EffectNumber) -> f64 {
        normal_quantile(uniform_at(self.key(what, RowIndex(0)), 0))
    }
}

/// Number under which a die's dark current deviates; no effect's own.
pub(super) const DARK_NUMBER: EffectNumber = EffectNumber(120);

/// Factor on the dark current of a die: lognormal, median 1.
pub(super) fn dark_factor(sigma: f64, die: Die) -> f64 {
    if sigma > 0.0 { libm::exp(sigma * die.deviation(DARK_NUMBER)) } else { 1.0 }
}

/// The exponential quantile of mean 1 of a uniform.
pub(super) fn exponential(uniform: u32) -> f64 {
    -libm::log((f64::from(uniform) + 0.5) / 4_294_967_296.0)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_quantile_of_a_uniform_passes_its_bound() {
        assert!(normal_quantile(u32::MAX) <= NORMAL_MAX && -normal_quantile(0) <= NORMAL_MAX);
        assert!(exponential(0) <= EXPONENTIAL_MAX && exponential(u32::MAX) > 0.0);
    }

    #[test]
    fn dies_and_cameras_deviate_apart() {
        let deviation = |seed, camera| Die { seed, camera: CameraIndex(camera) }.deviation(EffectNumber(7));
        let all = [deviation(1, 0), deviation(1, 1), deviation(2, 0)];
        assert!(all[0] != all[1] && all[0] != all[2] && all[1] != all[2]);
        assert_eq!(all[0], deviation(1, 0));
    }
}
