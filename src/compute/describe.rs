//! The engines: convert the served candidates to features.

use super::back::Served;
use super::brief::RotatedPattern;
use super::cells::has_patch;
use super::fast::Corner;
use super::feature::Feature;
use super::orientation::{angle_of, moments, rounded_angle};
use super::params::{ExtractorParams, PairPattern};
use super::patch::Patch;
use super::pattern::BYTES;
use super::smooth::smooth;
use super::subpixel;
use super::word::Word;
use crate::num::index;
use crate::plane::Plane;
use crate::simd::{Kernel, dispatch};
use crate::words::Turns;

/// Features of the candidates that were served, in their order. All have patches.
pub(super) fn describe<W: Word>(octaves: &[Plane<W>], served: &[Served], params: &ExtractorParams) -> Vec<Feature> {
    if served.is_empty() {
        return Vec::new();
    }
    let smoothed: Vec<Plane<W>> = octaves.iter().map(smooth).collect();
    let mut features: Vec<Feature> = served
        .iter()
        .map(|served| {
            let (corner, octave) = (&served.candidate.corner, served.candidate.octave);
            placed(&octaves[usize::from(octave)], corner, octave, params)
        })
        .collect();
    let patterns = pattern(params);
    let corners =
        served.iter().map(|served| (&smoothed[usize::from(served.candidate.octave)], served.candidate.corner));
    dispatch(Describe { corners, features: &mut features, params, pattern: patterns });
    features
}

/// Features of all these corners of one picture; without patches they have positions and scores only.
pub(super) fn describe_every<W: Word>(
    picture: &Plane<W>,
    corners: &[Corner],
    params: &ExtractorParams,
) -> Vec<Feature> {
    let smoothed = smooth(picture);
    let mut features = Vec::with_capacity(corners.len());
    for corner in corners {
        let mut feature = [placed(picture, corner, 0, params)];
        if has_patch(picture.size(), corner) {
            let corners = std::iter::once((&smoothed, *corner));
            dispatch(Describe { corners, features: &mut feature, params, pattern: pattern(params) });
        }
        features.extend(feature);
    }
    features
}

fn pattern(params: &ExtractorParams) -> &'static RotatedPattern {
    match params.pattern {
        PairPattern::Gaussian => RotatedPattern::plain(),
        PairPattern::Symmetric => RotatedPattern::symmetric(),
    }
}

/// A feature with its position and score.
fn placed<W: Word>(picture: &Plane<W>, corner: &Corner, octave: u8, params: &ExtractorParams) -> Feature {
    let (x, y) = subpixel::position(picture, corner, octave, params.subpixel);
    Feature { x, y, score: corner.score, angle: Turns::ZERO, octave, descriptor: [0; BYTES] }
}

/// Angle and descriptor of each corner in its smoothed picture.
struct Describe<'a, I> {
    corners: I,
    features: &'a mut [Feature],
    params: &'a ExtractorParams,
    pattern: &'static RotatedPattern,
}

impl<'a, W: Word, I: Iterator<Item = (&'a Plane<W>, Corner)>> Kernel for Describe<'_, I> {
    type Output = ();

    #[inline(always)]
    fn run(self) {
        let bytes = index(self.params.descriptor_bits) / 8;
        for ((smoothed, corner), feature) in self.corners.zip(self.features) {
            let patch = Patch::around(smoothed, &corner);
            let (x_moment, y_moment) = moments(&patch);
            feature.angle = rounded_angle(angle_of(x_moment, y_moment), self.params.angle_bits);
            feature.descriptor = self.pattern.describe(&patch, feature.angle, bytes);
        }
    }
}
