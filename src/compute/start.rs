//! The threshold of the first frame: chosen from that frame's own corner count, so that a run has no warm-up.
//!
//! It models what a host does at bring-up: one frame is counted and not sent, and the threshold register is written. Nothing of it
//! is in a run's events, packets or clocks. All rungs start from the same register value.

use super::cells::has_patch;
use super::fast::{Corner, fast9};
use super::params::ExtractorParams;
use super::sequence::octaves;
use super::word::Word;
use crate::num::index;
use crate::plane::Plane;

/// The threshold, not below `params.threshold`, at which this picture has the number of corners with patches that is nearest to the
/// target; of equally near ones the lowest. Without a target, `params.threshold`.
///
/// One pass is enough: suppression compares scores alone, so the corners at a higher threshold are those at the lowest whose score
/// reaches it.
pub(super) fn start_threshold<W: Word>(params: &ExtractorParams, picture: &Plane<W>) -> u16 {
    let target = u64::from(params.target_features);
    let most = crate::num::low_u16((1_u32 << params.pipeline_bits) - 2);
    if target == 0 || params.threshold >= most {
        return params.threshold;
    }
    let mut with_score = vec![0_u64; index(u32::from(most) + 2)];
    for octave in octaves(picture.clone(), params) {
        let size = octave.size();
        let corners = fast9(&octave, W::low(params.threshold.into()));
        for Corner { score, .. } in corners.iter().filter(|corner| has_patch(size, corner)) {
            with_score[usize::from(*score)] += 1;
        }
    }
    let mut corners: u64 = with_score[usize::from(params.threshold)..].iter().sum();
    let (mut best, mut threshold) = ((corners.abs_diff(target), params.threshold), params.threshold);
    while threshold < most && corners > target {
        corners -= with_score[usize::from(threshold)];
        threshold += 1;
        best = best.min((corners.abs_diff(target), threshold));
    }
    best.1
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compute::test_pictures::noise;
    use crate::num::u64_from;

    fn corners_at(picture: &Plane<u8>, threshold: u16, params: &ExtractorParams) -> u64 {
        let of = |octave: &Plane<u8>| {
            let corners = fast9(octave, u8::low(threshold.into()));
            u64_from(corners.iter().filter(|corner| has_patch(octave.size(), corner)).count())
        };
        octaves(picture.clone(), params).iter().map(of).sum()
    }

    #[test]
    fn no_other_threshold_brings_the_first_frame_nearer_to_its_target() {
        let mut raised = 0;
        for seed in 1..=6_u64 {
            for (octaves, target, threshold) in [(1, 40, 5), (3, 25, 12), (1, 1, 1), (2, 100_000, 9)] {
                let picture = noise(160, 120, 200, seed).map(|value| value / 2 + 60);
                let usual = ExtractorParams::USUAL;
                let params = ExtractorParams { octaves, target_features: target, threshold, ..usual };
                let started = start_threshold(&params, &picture);
                let miss = |threshold: u16| corners_at(&picture, threshold, &params).abs_diff(target.into());
                let best = (threshold..=254).min_by_key(|&threshold| (miss(threshold), threshold)).unwrap();
                assert_eq!(started, best, "seed {seed}, {octaves} octaves, target {target} from {threshold}");
                raised += u32::from(started > threshold);
            }
        }
        assert!(raised >= 12, "only {raised} cases had to raise their threshold");
    }
}
