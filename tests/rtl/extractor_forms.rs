//! All Rust forms of the extractor agree on a case: functions over whole pictures, the twin by rows, the twin by clocks. Compared are
//! features with their clocks, losses, waits and the last threshold.

use super::cases::Random;
use super::extractor_play::{Case, Times, play};
use rtl_models::extractor_core::front_config;
use rtl_models::extractor_rows::{ExtractorHost, ExtractorRows, row_corners};
use rtl_models::fx_back::{CellList, Engine, FxBackMemory, FxBackToggles, FxCounts, Policy, QueuedCorner, Record};
use rtl_models::fx_front_rows::{self, FrontRows, FrontRowsMemory, RowCorner};
use sensel::compute::{
    ExtractorCounts, ExtractorParams, Feature, Overflow, PairPattern, Pixels, Rank, Records, Sequence, Smoothing, Word,
};
use sensel::plane::Plane;
use sensel::units::Size;

/// The functional form's settings of a case.
pub fn params(case: &Case) -> ExtractorParams {
    let (config, settings) = (&case.config, &case.settings);
    let params = ExtractorParams {
        threshold: settings.threshold,
        target_features: settings.target.into(),
        pipeline_bits: config.pix_bits,
        smoothing: Smoothing::Off,
        octaves: config.octaves,
        cell_px: 1 << config.cell_log2,
        per_cell: config.per_cell,
        rank: if config.harris { Rank::Harris } else { Rank::Fast },
        subpixel: config.subpixel,
        angle_bits: settings.angle_bits,
        descriptor_bits: config.desc_bits,
        pattern: if config.symmetric { PairPattern::Symmetric } else { PairPattern::Gaussian },
        engines: config.engines,
        fifo_depth: config.fifo_depth,
        overflow: match settings.policy {
            Policy::Stall => Overflow::Stall,
            Policy::DropNewest => Overflow::DropNewest,
            Policy::DropWeakest => Overflow::DropWeakest,
        },
    };
    assert_eq!(1 << config.ring_log2, params.ring_rows(), "the functional form's ring");
    params.checked().unwrap()
}

struct Clocked(Times);

impl Pixels for Clocked {
    fn offered(&mut self, _: u32, _: u32, clk: u64) -> u64 {
        (clk..).find(|&clk| self.0.offered(clk)).unwrap()
    }
}

impl Records for Clocked {
    fn taken(&mut self, clk: u64) -> u64 {
        (clk..).find(|&clk| self.0.taken(clk)).unwrap()
    }
}

/// What both forms say of a case.
#[derive(Debug, Default, PartialEq)]
pub struct Told {
    /// Features, the parity of their frame, the clock in which they left.
    pub features: Vec<(Feature, bool, u64)>,
    pub corners: u64,
    pub without_patch: u64,
    pub unselected: u64,
    pub dropped: u64,
    pub late: u64,
    pub stalled: u64,
    pub not_ready: u64,
    pub threshold: u16,
}

pub fn functional<W: Word>(case: &Case, pictures: &[Vec<u16>]) -> (Told, u64) {
    let (params, mut pixels, mut records) = (params(case), Clocked(case.times), Clocked(case.times));
    let size = Size { width_px: case.config.width, height_px: case.config.height };
    let mut sequence = Sequence::<W>::new(&params, size, params.threshold);
    let mut end_clk = 0;
    let mut told = Told::default();
    let mut take = |sequence: &mut Sequence<W>| {
        let taken = sequence.take();
        told.features.extend(taken.iter().map(|record| (record.feature, record.frame % 2 == 1, record.out_clk)));
    };
    let mut counts = ExtractorCounts::default();
    for picture in pictures {
        let words = picture.iter().map(|&word| W::low(word.into())).collect();
        end_clk = sequence.frame(Plane::from_values(size, words), &mut pixels, &mut records);
        counts = sequence.counts();
        take(&mut sequence);
    }
    sequence.finish(&mut records);
    take(&mut sequence);
    let ExtractorCounts { dropped, late, .. } = sequence.counts();
    let ExtractorCounts { corners, without_patch, unselected, stalled_clk, not_ready_clk, .. } = counts;
    // The clocked count is of all corners.
    told.corners = corners + without_patch;
    (told.without_patch, told.unselected, told.dropped, told.late) = (without_patch, unselected, dropped, late);
    (told.stalled, told.not_ready) = (stalled_clk, not_ready_clk);
    told.threshold = sequence.threshold();
    (told, end_clk)
}

/// What stands around the form that takes a row at a time.
struct Around {
    clocked: Clocked,
    features: Vec<(Feature, bool, u64)>,
}

fn told(record: Record, clk: u64) -> (Feature, bool, u64) {
    let Record { x_q4, y_q4, score, angle, octave, frame, descriptor } = record;
    (Feature { x: x_q4, y: y_q4, score, angle, octave, descriptor }, frame, clk)
}

impl ExtractorHost for Around {
    fn offered_run(&mut self, first: u32, end: u32, y: u32, clk: u64) -> u64 {
        self.clocked.offered_run(first, end, y, clk)
    }

    fn taken(&mut self, clk: u64) -> u64 {
        self.clocked.taken(clk)
    }

    fn leaves(&mut self, record: &Record, clk: u64) {
        self.features.push(told(*record, clk));
    }
}

/// The story of the clocked form that takes a row at a time, and the bits that flipped in its back.
pub fn by_rows<T: fx_front_rows::PixelWord>(case: &Case, pictures: &[Vec<u16>]) -> (Told, FxBackToggles) {
    let (config, front) = (case.config, front_config(&case.config));
    let (words, width) = (FrontRows::<T>::words(&front), usize::try_from(config.max_width).unwrap());
    let (mut kept, mut differences) = (vec![T::default(); 8 * words], vec![T::default(); 3 * words]);
    let (mut scratch, mut sums) = (vec![T::default(); width], vec![0; width]);
    let front =
        FrontRowsMemory { pixels: &mut kept, differences: &mut differences, scratch: &mut scratch, sums: &mut sums };
    let (mut lists, mut ring) = (vec![CellList::default(); config.lists()], vec![0x5A; config.ring_pixels()]);
    let mut queue = vec![QueuedCorner::default(); usize::try_from(config.fifo_depth).unwrap()];
    let mut engines = vec![Engine::default(); usize::try_from(config.engines).unwrap()];
    let back = FxBackMemory { lists: &mut lists, ring: &mut ring, queue: &mut queue, engines: &mut engines };
    let mut corners = vec![RowCorner::default(); row_corners(config.max_width)];
    let memory = (front, back, &mut corners[..]);
    let mut core = ExtractorRows::<T>::new(config, case.settings, case.settings.threshold, memory);
    let mut around = Around { clocked: Clocked(case.times), features: Vec::new() };
    for picture in pictures {
        let words: Vec<T> = picture.iter().map(|&word| T::try_from(word).ok().unwrap()).collect();
        core.frame(&words, &mut around);
    }
    let (stalled, not_ready) = (core.counts().stalled.into(), core.not_ready());
    core.finish(&mut around);
    let FxCounts { corners, without_patch, unselected, dropped, late, features, .. } = *core.counts();
    assert_eq!(usize::try_from(features).unwrap(), around.features.len(), "the count of features");
    let mut told = Told { features: around.features, stalled, not_ready, ..Told::default() };
    (told.corners, told.without_patch, told.unselected) = (corners.into(), without_patch.into(), unselected.into());
    (told.dropped, told.late, told.threshold) = (dropped.into(), late.into(), core.threshold());
    (told, core.toggles())
}

/// The ticked form's story, with waits as they stand in clock `end_clk`, and the bits that flipped in its back.
pub fn clocked(case: &Case, pictures: &[Vec<u16>], end_clk: u64) -> (Told, FxBackToggles) {
    let mut found = Told::default();
    let mut next = pictures.iter();
    let make = |_: &mut Random| next.next().or(pictures.first()).unwrap().clone();
    let (last, toggles) = play(case, &mut Random::new(0), make, |clock| {
        if let Some(record) = clock.left {
            found.features.push(told(record, clock.clk));
        }
        if clock.clk == end_clk {
            (found.stalled, found.not_ready) = (clock.counts.stalled.into(), clock.not_ready.into());
        }
    });
    let FxCounts { corners, without_patch, unselected, dropped, late, features, .. } = last.back.counts;
    assert_eq!(usize::try_from(features).unwrap(), found.features.len(), "the count of features");
    (found.corners, found.without_patch, found.unselected) = (corners.into(), without_patch.into(), unselected.into());
    (found.dropped, found.late, found.threshold) = (dropped.into(), late.into(), last.back.threshold);
    (found, toggles)
}

/// What all three forms say of a case; a panic where they differ.
pub fn compare(case: &Case, pictures: &[Vec<u16>], name: &str) -> Told {
    let eight = case.config.pix_bits == 8;
    let (expected, end_clk) = if eight { functional::<u8>(case, pictures) } else { functional::<u16>(case, pictures) };
    let (found, toggles) = clocked(case, pictures, end_clk);
    for (at, (found, expected)) in found.features.iter().zip(&expected.features).enumerate() {
        assert_eq!(found, expected, "{name}, feature {at}: {case:?}");
    }
    assert_eq!(found, expected, "{name}: {case:?}");
    let (rows, rows_toggles) = if eight { by_rows::<u8>(case, pictures) } else { by_rows::<u16>(case, pictures) };
    assert_eq!(rows, found, "{name}, by rows: {case:?}");
    assert_eq!(rows_toggles, toggles, "{name}, toggles by rows: {case:?}");
    found
}
