//! Front half of the extractor, one row at a time: same results as `FxFront` without stalls. For each row of each octave, in the
//! arbiter's order, it gives smoothed pixels and corners with the index of the slot that completes them.
//!
//! A slot's number counts enabled clocks, so with stalls the results are the same and only their clocks move. Loops are over
//! fixed blocks of pixels, so that they become vectors; every function is inlined into the caller's instruction set.

use crate::fx_config::{FxFrontConfig, line_words};
use crate::fx_front::DRAIN;
use crate::fx_harris::{positive_part, short_float, sobel, terms};
use crate::fx_window::CIRCLE;
use crate::words::{HalfScaleMean, TriangleMean, rounded};

/// Rows of pixels that are kept: seven for the window and one for the ranks of the row above.
const KEPT_ROWS: usize = 8;
/// Pixels of a block.
const BLOCK_PX: usize = 32;

/// A pixel's word: `u8` where 8 bits do.
pub trait PixelWord: Copy + Default + Ord + Into<u16> + TryFrom<u16> {
    /// The difference, 0 if negative.
    fn less(self, other: Self) -> Self;
}

impl PixelWord for u8 {
    #[inline(always)]
    fn less(self, other: Self) -> Self {
        self.saturating_sub(other)
    }
}

impl PixelWord for u16 {
    #[inline(always)]
    fn less(self, other: Self) -> Self {
        self.saturating_sub(other)
    }
}

/// A corner of a row.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct RowCorner {
    /// Its column in pixels of the octave.
    pub x: u32,
    /// Its row.
    pub y: u32,
    /// Score in DN.
    pub score: u16,
    /// The nine differences around it, by rows, in DN.
    pub resp: [u16; 9],
    /// Score or Harris rank.
    pub rank: u16,
}

/// A row that has run.
#[derive(Clone, Copy, Debug)]
pub struct RowDone<'a, T> {
    /// Its octave.
    pub octave: u32,
    /// Its number; the octave's height for the virtual row.
    pub row: u32,
    /// It is the virtual row.
    pub is_virtual: bool,
    /// It is the frame's last one.
    pub frame_end: bool,
    /// Number of its first slot. Slot `start + x` completes the smoothed pixel (x - 3, row - 3) and the corner (x - 4, row -
    /// 4).
    pub start: u64,
    /// Smoothed pixels from column 3 on; empty where there are none.
    pub smoothed: &'a [T],
}

/// Takes what leaves.
pub trait FrontSink<T> {
    /// A corner of the row that is reported next.
    fn corner(&mut self, corner: &RowCorner);
    /// A row has run.
    fn row(&mut self, row: &RowDone<'_, T>);
}

/// Memory of [`FrontRows`], borrowed; contents may be anything. See `FrontRows::words`.
#[derive(Debug)]
pub struct FrontRowsMemory<'a, T> {
    /// Rows of pixels of all octaves: 8 times `words`.
    pub pixels: &'a mut [T],
    /// Rows of differences of all octaves: 3 times `words`.
    pub differences: &'a mut [T],
    /// A row that is worked on: `max_width`.
    pub scratch: &'a mut [T],
    /// Its column sums: `max_width`.
    pub sums: &'a mut [u32],
}

/// The front's pictures so far.
#[derive(Debug)]
pub struct FrontRows<'a, T> {
    config: FxFrontConfig,
    memory: FrontRowsMemory<'a, T>,
    row_0: u32,
    slots: u64,
}

#[inline(always)]
fn index(value: u32) -> usize {
    value as usize
}

#[inline(always)]
fn number(value: usize) -> u32 {
    u32::try_from(value).expect("a column in a row")
}

#[inline(always)]
fn word<T: PixelWord>(value: u32) -> T {
    let narrow = u16::try_from(value).ok().and_then(|value| T::try_from(value).ok());
    narrow.unwrap_or_default()
}

impl<'a, T: PixelWord> FrontRows<'a, T> {
    /// Words of a row of each octave.
    pub const fn words(config: &FxFrontConfig) -> usize {
        line_words(config.max_width, config.octaves)
    }

    /// A front before a frame. Panics on a config that `check` refuses or memories of other lengths.
    pub fn new(config: FxFrontConfig, memory: FrontRowsMemory<'a, T>) -> Self {
        config.check().expect("the config was checked");
        let words = Self::words(&config);
        assert!(memory.pixels.len() == KEPT_ROWS * words && memory.differences.len() == 3 * words, "rows are kept");
        let max_width = index(config.max_width);
        assert!(memory.scratch.len() == max_width && memory.sums.len() == max_width, "a row is worked on");
        Self { config, memory, row_0: 0, slots: 0 }
    }

    /// Slots run so far, with those that drain.
    pub fn slots(&self) -> u64 {
        self.slots
    }

    /// The next row of octave 0, and every row that it lets run before the next. Panics on another length than the width.
    #[inline(always)]
    pub fn row<S: FrontSink<T>>(&mut self, pixels: &[T], threshold: T, sink: &mut S) {
        assert!(pixels.len() == index(self.config.width), "a row has as many pixels as the picture is wide");
        self.memory.scratch[..pixels.len()].copy_from_slice(pixels);
        let frame_end = self.row_0 + 1 == self.config.height;
        let (mut octave, mut row) = (0, self.row_0);
        loop {
            let deeper = row & 1 == 1 && self.config.built(octave + 1);
            let last_row = row + 1 == self.config.height_of(octave);
            let over = frame_end && !deeper;
            self.run(octave, row, false, over && !last_row, threshold, sink);
            if last_row {
                self.run(octave, row + 1, true, over, threshold, sink);
            }
            if !deeper {
                break;
            }
            self.halve(octave, row);
            (octave, row) = (octave + 1, row >> 1);
        }
        self.row_0 = if frame_end { 0 } else { self.row_0 + 1 };
        self.slots += if frame_end { u64::from(DRAIN) } else { 0 };
    }

    #[inline(always)]
    fn kept(&self, octave: u32, row: u32) -> &[T] {
        let (width, width_max) = (index(self.config.width_of(octave)), index(self.config.max_width >> octave));
        let start = KEPT_ROWS * index(self.config.base_of(octave)) + index(row) % KEPT_ROWS * width_max;
        &self.memory.pixels[start..start + width]
    }

    #[inline(always)]
    fn difference_range(&self, octave: u32, row: u32) -> core::ops::Range<usize> {
        let (width, width_max) = (index(self.config.width_of(octave)), index(self.config.max_width >> octave));
        let start = 3 * index(self.config.base_of(octave)) + index(row) % 3 * width_max;
        start..start + width
    }

    /// Runs the row in `scratch`, or a virtual one.
    #[inline(always)]
    fn run<S: FrontSink<T>>(&mut self, octave: u32, row: u32, is_virtual: bool, end: bool, threshold: T, sink: &mut S) {
        let width = index(self.config.width_of(octave));
        if !is_virtual {
            let width_max = index(self.config.max_width >> octave);
            let start = KEPT_ROWS * index(self.config.base_of(octave)) + index(row) % KEPT_ROWS * width_max;
            self.memory.pixels[start..start + width].copy_from_slice(&self.memory.scratch[..width]);
        }
        let whole = row >= 6 && !is_virtual;
        self.differ(octave, row, whole);
        if row >= 7 {
            self.suppress(octave, row, threshold, sink);
        }
        if whole {
            self.smooth(octave, row);
        }
        let smoothed = if whole { &self.memory.scratch[..width - 6] } else { &[] };
        sink.row(&RowDone { octave, row, is_virtual, frame_end: end, start: self.slots, smoothed });
        self.slots += u64::from(self.config.width_of(octave)) + 1;
    }

    /// Differences at the centres of the row three above.
    #[inline(always)]
    fn differ(&mut self, octave: u32, row: u32, whole: bool) {
        let (width, width_max) = (index(self.config.width_of(octave)), index(self.config.max_width >> octave));
        let out = self.difference_range(octave, row);
        let base = KEPT_ROWS * index(self.config.base_of(octave));
        let differences = &mut self.memory.differences[out];
        if !whole {
            differences.fill(T::default());
            return;
        }
        let pixels = &*self.memory.pixels;
        let rows: [&[T]; 7] = core::array::from_fn(|offset| {
            let start = base + (index(row) + 2 + offset) % KEPT_ROWS * width_max;
            &pixels[start..start + width]
        });
        difference_row(&rows, differences);
    }

    /// Corners in the row four above.
    #[inline(always)]
    fn suppress<S: FrontSink<T>>(&mut self, octave: u32, row: u32, threshold: T, sink: &mut S) {
        let width = index(self.config.width_of(octave));
        let range = |back: u32| self.difference_range(octave, row - back);
        let (above, middle, below) = (range(2), range(1), range(0));
        let all = &*self.memory.differences;
        let (above, middle, below) = (&all[above], &all[middle], &all[below]);
        let mut start = 1;
        while start + 1 < width {
            let end = (start + 16).min(width - 1);
            let top = middle[start..end].iter().fold(T::default(), |top, &value| top.max(value));
            if top > threshold {
                for x in start..end {
                    let value = middle[x];
                    let around = [above[x - 1], above[x], above[x + 1], middle[x - 1], middle[x + 1]];
                    let under = [below[x - 1], below[x], below[x + 1]];
                    if value > threshold && around.iter().chain(&under).all(|&other| value > other) {
                        let resp = [above, middle, below].map(|of| [of[x - 1].into(), of[x].into(), of[x + 1].into()]);
                        self.report(octave, row, x, resp, sink);
                    }
                }
            }
            start = end;
        }
    }

    #[inline(always)]
    fn report<S: FrontSink<T>>(&self, octave: u32, row: u32, x: usize, resp: [[u16; 3]; 3], sink: &mut S) {
        let [[a, b, c], [d, middle, e], [f, g, h]] = resp;
        let score = middle - 1;
        let rank = if self.config.harris { self.rank(octave, row - 4, x) } else { score };
        sink.corner(&RowCorner { x: number(x), y: row - 4, score, resp: [a, b, c, d, middle, e, f, g, h], rank });
    }

    /// The Harris rank at a centre whose window is kept.
    fn rank(&self, octave: u32, y: u32, x: usize) -> u16 {
        let rows: [&[T]; 7] = core::array::from_fn(|offset| self.kept(octave, y + number(offset) - 3));
        let shift = self.config.pix_bits - 8;
        let at = |u: usize, v: usize| i64::from(rows[v][x + u - 3].into() >> shift);
        let mut sums = [0; 3];
        for v in 1..6 {
            for u in 1..6 {
                let column = |u: usize| [at(u, v - 1), at(u, v), at(u, v + 1)];
                let [across, along] = sobel([column(u - 1), column(u), column(u + 1)]);
                sums = [sums[0] + across * across, sums[1] + along * along, sums[2] + across * along];
            }
        }
        short_float(positive_part(terms(sums)))
    }

    /// The row three above under the triangle, into `scratch`.
    #[inline(always)]
    fn smooth(&mut self, octave: u32, row: u32) {
        let (width, width_max) = (index(self.config.width_of(octave)), index(self.config.max_width >> octave));
        let base = KEPT_ROWS * index(self.config.base_of(octave));
        let rows: [&[T]; 7] = core::array::from_fn(|offset| {
            let start = base + (index(row) + 2 + offset) % KEPT_ROWS * width_max;
            &self.memory.pixels[start..start + width]
        });
        smooth_row(&rows, &mut self.memory.sums[..width], &mut self.memory.scratch[..width - 6]);
    }

    /// The next octave's row from this one and the one above, into `scratch`.
    #[inline(always)]
    fn halve(&mut self, octave: u32, row: u32) {
        let width_max = index(self.config.max_width >> octave);
        let width = index(self.config.width_of(octave)) / 2 * 2;
        let base = KEPT_ROWS * index(self.config.base_of(octave));
        let [above, below] = [row - 1, row].map(|row| {
            let start = base + index(row) % KEPT_ROWS * width_max;
            &self.memory.pixels[start..start + width]
        });
        let pairs = above.chunks_exact(2).zip(below.chunks_exact(2));
        for (half, (above, below)) in self.memory.scratch.iter_mut().zip(pairs) {
            let sum = |pair: &[T]| u32::from(pair[0].into()) + u32::from(pair[1].into());
            *half = word(rounded(HalfScaleMean::from_bits(sum(above) + sum(below))));
        }
    }
}

/// Differences of the middle one of seven rows; 0 within three pixels of the ends.
#[inline(always)]
fn difference_row<T: PixelWord>(rows: &[&[T]; 7], out: &mut [T]) {
    let (width, inner) = (out.len(), out.len() - 6);
    out[..3].fill(T::default());
    out[width - 3..].fill(T::default());
    let mut x = 0;
    while x < inner {
        // The last block overlaps the one before, both give the same; a row shorter than a block has none before.
        let start = if inner >= BLOCK_PX { x.min(inner - BLOCK_PX) } else { x };
        if inner >= BLOCK_PX {
            let circle = CIRCLE.map(|(column, row)| block(rows[row], start + column));
            let found = arc_differences(&circle, block(rows[3], start + 3));
            out[start + 3..start + 3 + BLOCK_PX].copy_from_slice(&found);
            x += BLOCK_PX;
        } else {
            let circle = CIRCLE.map(|(column, row)| [rows[row][x + column]; BLOCK_PX]);
            let found = arc_differences(&circle.each_ref(), &[rows[3][x + 3]; BLOCK_PX]);
            out[x + 3] = found[0];
            x += 1;
        }
    }
}

#[inline(always)]
fn block<T>(row: &[T], x: usize) -> &[T; BLOCK_PX] {
    row[x..x + BLOCK_PX].try_into().expect("cut to this length")
}

#[inline(always)]
fn lower<T: PixelWord>(a: &[T; BLOCK_PX], b: &[T; BLOCK_PX]) -> [T; BLOCK_PX] {
    let mut found = [T::default(); BLOCK_PX];
    for i in 0..BLOCK_PX {
        found[i] = a[i].min(b[i]);
    }
    found
}

#[inline(always)]
fn higher<T: PixelWord>(a: &[T; BLOCK_PX], b: &[T; BLOCK_PX]) -> [T; BLOCK_PX] {
    let mut found = [T::default(); BLOCK_PX];
    for i in 0..BLOCK_PX {
        found[i] = a[i].max(b[i]);
    }
    found
}

/// The network of `FxFast` for a block of pixels.
#[inline(always)]
fn arc_differences<T: PixelWord>(circle: &[&[T; BLOCK_PX]; 16], centre: &[T; BLOCK_PX]) -> [T; BLOCK_PX] {
    let nothing = [T::default(); BLOCK_PX];
    let (mut low_2, mut high_2) = ([nothing; 8], [nothing; 8]);
    for k in 0..8 {
        low_2[k] = lower(circle[2 * k + 1], circle[(2 * k + 2) % 16]);
        high_2[k] = higher(circle[2 * k + 1], circle[(2 * k + 2) % 16]);
    }
    let (mut low_4, mut high_4) = ([nothing; 8], [nothing; 8]);
    for k in 0..8 {
        low_4[k] = lower(&low_2[k], &low_2[(k + 1) % 8]);
        high_4[k] = higher(&high_2[k], &high_2[(k + 1) % 8]);
    }
    let (mut bright, mut dark) = (nothing, nothing);
    for k in 0..8 {
        let low_8 = lower(&low_4[k], &low_4[(k + 2) % 8]);
        let high_8 = higher(&high_4[k], &high_4[(k + 2) % 8]);
        let (before, after) = (circle[2 * k], circle[(2 * k + 9) % 16]);
        let (least, greatest) = (lower(&low_8, &higher(before, after)), higher(&high_8, &lower(before, after)));
        bright = if k == 0 { least } else { higher(&bright, &least) };
        dark = if k == 0 { greatest } else { lower(&dark, &greatest) };
    }
    let mut found = nothing;
    for i in 0..BLOCK_PX {
        found[i] = bright[i].less(centre[i]).max(centre[i].less(dark[i]));
    }
    found
}

/// Column sums of seven rows, then the row's weighted means.
#[inline(always)]
fn smooth_row<T: PixelWord>([a, b, c, d, e, f, g]: &[&[T]; 7], sums: &mut [u32], out: &mut [T]) {
    let (width, inner) = (sums.len(), out.len());
    let (a, b, c, d, e, f, g) =
        (&a[..width], &b[..width], &c[..width], &d[..width], &e[..width], &f[..width], &g[..width]);
    let at = |row: &[T], x: usize| -> u32 { row[x].into().into() };
    for x in 0..width {
        let outer = at(a, x) + at(g, x) + 2 * (at(b, x) + at(f, x));
        sums[x] = outer + 3 * (at(c, x) + at(e, x)) + 4 * at(d, x);
    }
    let sums = &sums[..inner + 6];
    for x in 0..inner {
        let outer = sums[x] + sums[x + 6] + 2 * (sums[x + 1] + sums[x + 5]);
        let sum = outer + 3 * (sums[x + 2] + sums[x + 4]) + 4 * sums[x + 3];
        out[x] = word(rounded(TriangleMean::from_bits(sum)));
    }
}
