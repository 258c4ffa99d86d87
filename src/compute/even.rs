//! When features leave the extractor that stand evenly in the picture: for figures without a picture.

use super::back::AlwaysReady;
use super::cells::{CellLists, CornerCandidate};
use super::fast::Corner;
use super::params::{ExtractorParams, PATCH_MARGIN_PX};
use super::presmooth::DelayedPixels;
use super::rows::Pixels;
use super::stream::Stream;
use crate::num::{index, low_u8, u32_from, u64_from};
use crate::units::Size;

/// Clocks of a frame, from the first in which its first pixel could enter.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct FrameClocks {
    /// The clock in which each feature is taken.
    pub out_clk: Vec<u64>,
    /// The first clock in which the next frame's first pixel could enter.
    pub end_clk: u64,
    /// Candidates that wait for an engine at once, at most.
    pub queue_most: u32,
}

impl FrameClocks {
    /// Clocks until the frame is done with: its rows have run and its last feature has left.
    pub fn required_clk(&self) -> u64 {
        self.out_clk.last().map_or(self.end_clk, |last| self.end_clk.max(last + 1))
    }
}

/// Simulates a frame of codes of `bits` bits whose features are spread evenly over the cells of all octaves; at most
/// `ExtractorParams::features_max` of them.
pub fn even_frame(
    params: &ExtractorParams,
    size: Size,
    (features, bits): (u64, u32),
    pixels: &mut dyn Pixels,
) -> FrameClocks {
    let sizes = params.octave_sizes(size);
    let cells: Vec<(usize, Corner)> =
        sizes.iter().enumerate().flat_map(|(octave, &size)| cells(params, size).map(move |at| (octave, at))).collect();
    let count = u64_from(cells.len());
    let mut candidates = vec![Vec::new(); sizes.len()];
    // Rising numbers meet the cells in order, and each cell as often as any other, give or take one.
    for number in 0..features.min(params.features_max(size)) {
        let (octave, corner) = cells[usize::try_from(number * count / features).expect("a number of a cell")];
        candidates[octave].push(CornerCandidate { corner, rank: 1, octave: low_u8(u32_from(octave)) });
    }
    let per_cell = index(params.per_cell);
    let lists = candidates.iter().zip(&sizes).map(|(all, &size)| CellLists::of(all, size, params.cell_px, per_cell));
    let mut delayed = DelayedPixels { pixels, height_px: index(size.height_px) };
    let pixels: &mut dyn Pixels = if params.smooths(bits) { &mut delayed } else { &mut *delayed.pixels };
    let mut stream = Stream::new(params, size);
    let end_clk = stream.frame(lists.collect(), pixels, &mut AlwaysReady);
    stream.finish(&mut AlwaysReady);
    let out_clk = stream.take_served().iter().map(|served| served.out_clk).collect();
    FrameClocks { out_clk, end_clk, queue_most: stream.queue_most() }
}

/// The first position with a whole patch in each cell that has one, by rows.
fn cells(params: &ExtractorParams, size: Size) -> impl Iterator<Item = Corner> + use<> {
    let (cell_px, margin_px) = (params.cell_px, PATCH_MARGIN_PX);
    let firsts = move |side_px: u32| {
        let last_px = side_px.saturating_sub(margin_px + 1);
        let first = margin_px / cell_px;
        let end = if last_px < margin_px { first } else { last_px / cell_px + 1 };
        (first..end).map(move |cell| (cell * cell_px).max(margin_px))
    };
    firsts(size.height_px).flat_map(move |y_px| firsts(size.width_px).map(move |x_px| Corner { x_px, y_px, score: 1 }))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::compute::AtOnce;

    #[test]
    fn as_many_features_leave_as_were_asked_for_and_the_last_ones_after_all_rows() {
        let size = Size { width_px: 160, height_px: 132 };
        for (octaves, cell_px, features) in [(1, 16, 0), (1, 16, 1), (1, 16, 60), (3, 16, 200), (2, 32, 40)] {
            let params = ExtractorParams { octaves, cell_px, ..ExtractorParams::USUAL };
            let frame = even_frame(&params, size, (features, 8), &mut AtOnce);
            assert_eq!(u64_from(frame.out_clk.len()), features, "{octaves} octaves of cells of {cell_px}");
            assert!(frame.out_clk.windows(2).all(|pair| pair[0] < pair[1]));
            assert!(frame.end_clk >= 161 * 133 && frame.required_clk() >= frame.end_clk);
        }
        let params = ExtractorParams::USUAL;
        let most = params.features_max(size);
        let full = even_frame(&params, size, (most + 100, 8), &mut AtOnce);
        // Two engines of 299 clocks each serve what they can while the rows run; the queue drops the rest, as the sensor does.
        let (served, required_clk) = (u64_from(full.out_clk.len()), full.required_clk());
        assert!(served <= most && required_clk >= served * 299 / 2, "{served} of {most} in {required_clk} clocks");
        assert!(served > most / 2, "{served} of {most} in {required_clk} clocks");
    }
}
