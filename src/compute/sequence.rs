//! Runs frames of one size through one extractor, one after another, and returns records with their clocks.

use std::collections::VecDeque;

use super::back::{Records, Served};
use super::cells::{CellLists, CornerCandidate, has_patch};
use super::describe::describe;
use super::fast::{Corner, fast9};
use super::feature::{ExtractorCounts, Feature};
use super::half::half_scale;
use super::harris::harris_rank;
use super::params::{ExtractorParams, Rank};
use super::rows::Pixels;
use super::stream::Stream;
use super::word::Word;
use crate::num::{index, u64_from};
use crate::plane::Plane;
use crate::units::Size;

/// Frames whose pictures are kept for candidates that still wait: the ring holds 128 rows, and a frame with a patch has 33.
const KEPT: usize = 5;

/// A feature as it leaves.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct FeatureRecord {
    /// The feature.
    pub feature: Feature,
    /// Its frame, from 0.
    pub frame: u64,
    /// The clock in which it was taken.
    pub out_clk: u64,
}

/// An extractor whose clocks count on from frame to frame.
#[derive(Debug)]
pub struct Sequence<W> {
    params: ExtractorParams,
    threshold: u16,
    stream: Stream,
    frames: u64,
    /// Octaves of the last frames, by frame.
    kept: VecDeque<(u64, Vec<Plane<W>>)>,
    counts: ExtractorCounts,
}

impl<W: Word> Sequence<W> {
    /// At reset, with this threshold.
    pub fn new(params: &ExtractorParams, size: Size, threshold: u16) -> Self {
        let stream = Stream::new(params, size);
        Self {
            params: *params,
            threshold,
            stream,
            frames: 0,
            kept: VecDeque::new(),
            counts: ExtractorCounts::default(),
        }
    }

    /// Lets a frame through; gives back the first clock in which the next one's first pixel could enter. Panics on another size.
    pub fn frame(&mut self, picture: Plane<W>, pixels: &mut dyn Pixels, records: &mut dyn Records) -> u64 {
        let octaves = octaves(picture, &self.params);
        let mut lists = Vec::with_capacity(octaves.len());
        let mut corners_of_frame = 0;
        for (number, octave) in (0_u8..).zip(&octaves) {
            let (all, candidates) = candidates(octave, number, self.threshold, &self.params);
            corners_of_frame += u64_from(candidates.len());
            self.counts.without_patch += u64_from(all - candidates.len());
            let listed = CellLists::of(&candidates, octave.size(), self.params.cell_px, index(self.params.per_cell));
            self.counts.unselected += listed.unselected;
            lists.push(listed);
        }
        self.counts.corners += corners_of_frame;
        let end_clk = self.stream.frame(lists, pixels, records);
        self.threshold = self.params.next_threshold(self.threshold, corners_of_frame);
        if self.kept.len() == KEPT {
            self.kept.pop_front();
        }
        self.kept.push_back((self.frames, octaves));
        self.frames += 1;
        end_clk
    }

    /// Serves everything that waits.
    pub fn finish(&mut self, records: &mut dyn Records) {
        self.stream.finish(records);
    }

    /// Records that left since the last call, in their order.
    pub fn take(&mut self) -> Vec<FeatureRecord> {
        let served = self.stream.take_served();
        let mut taken = Vec::with_capacity(served.len());
        for of_frame in served.chunk_by(|a, b| a.frame == b.frame) {
            let frame = of_frame[0].frame;
            let kept = self.kept.iter().find(|(kept, _)| *kept == frame);
            let (_, octaves) = kept.expect("the ring holds fewer rows than these frames have");
            let features = describe(octaves, of_frame, &self.params);
            let record =
                |(feature, served): (Feature, &Served)| FeatureRecord { feature, frame, out_clk: served.out_clk };
            taken.extend(features.into_iter().zip(of_frame).map(record));
        }
        taken
    }

    /// Candidates that waited for an engine at once, at most.
    pub fn queue_most(&self) -> u32 {
        self.stream.queue_most()
    }

    /// What happened up to now.
    pub fn counts(&self) -> ExtractorCounts {
        let ExtractorCounts { corners, without_patch, unselected, .. } = self.counts;
        ExtractorCounts { corners, without_patch, unselected, ..self.stream.counts() }
    }

    /// The threshold of the next frame.
    pub fn threshold(&self) -> u16 {
        self.threshold
    }
}

/// The picture and its half-scale octaves.
pub(super) fn octaves<W: Word>(picture: Plane<W>, params: &ExtractorParams) -> Vec<Plane<W>> {
    let built = params.octave_sizes(picture.size()).len();
    let mut octaves = vec![picture];
    while octaves.len() < built {
        octaves.push(half_scale(&octaves[octaves.len() - 1]));
    }
    octaves
}

/// How many corners an octave has, and those whose patch lies in it.
pub(super) fn candidates<W: Word>(
    picture: &Plane<W>,
    octave: u8,
    threshold: u16,
    params: &ExtractorParams,
) -> (usize, Vec<CornerCandidate>) {
    let size = picture.size();
    let found = fast9(picture, W::low(threshold.into()));
    let rank = |corner: &Corner| match params.rank {
        Rank::Fast => corner.score,
        Rank::Harris => harris_rank(picture, corner.x_px, corner.y_px, params.pipeline_bits),
    };
    let whole = found.iter().filter(|corner| has_patch(size, corner));
    let candidates = whole.map(|corner| CornerCandidate { corner: *corner, rank: rank(corner), octave }).collect();
    (found.len(), candidates)
}
