//! Front half of the extractor, clock by clock, twin of `verilog/fx_front.sv`. Converts pixels of octave 0 in raster order (DN) to
//! corners with score and rank, smoothed pixels and row ends of all octaves. Positions are pixels of their octave.
//!
//! Everything leaves [`FRONT_LATENCY`] enabled clocks after its slot was taken, for one clock. `FrontRows` is the form that
//! takes a row at a time.

pub use crate::fx_config::{DRAIN, FRONT_LATENCY, FxFrontConfig, OCTAVE_SIDE_MIN, line_words};
use crate::fx_fast::FxFast;
use crate::fx_half::FxHalf;
use crate::fx_harris::FxHarris;
use crate::fx_nms::{FxNms, NmsIn};
pub use crate::fx_rows::Request;
use crate::fx_rows::{FxRows, RasterSlot};
use crate::fx_smooth::FxSmooth;
use crate::fx_window::FxWindow;
use crate::{flips, flips_of};

/// The memories, borrowed. Their contents may be anything: nothing is looked at before it is written.
#[derive(Debug)]
pub struct FxFrontMemory<'a> {
    /// Six older pixels a column: `line_words` words.
    pub lines: &'a mut [[u16; 6]],
    /// Two older differences a column: `line_words` words.
    pub scores: &'a mut [[u16; 2]],
    /// The next octave's row: half of `max_width`.
    pub half_row: &'a mut [u16],
    /// Harris ranks: `line_words` words, none without Harris.
    pub ranks: &'a mut [u16],
}

/// Pins that enter, as they stand at the rising edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FxFrontIn {
    /// Synchronous reset.
    pub rst: bool,
    /// A pixel is valid.
    pub in_valid: bool,
    /// Pixel in DN.
    pub in_pixel: u16,
    /// The row that `Request` names may start.
    pub row_ok: bool,
    /// Differences above it are corners, in DN.
    pub threshold: u16,
}

/// Pins that leave, after the rising edge. Positions of the smoothed pixel and the corner wrap at 16 bits where there is none.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FxFrontOut {
    /// A pixel would be taken, with the `row_ok` of the edge that went before.
    pub in_ready: bool,
    /// The row that wants to start.
    pub request: Request,
    /// Octave of what leaves.
    pub octave: u32,
    /// Row of the slot whose results leave; the octave's height for the virtual row.
    pub row: u32,
    /// A smoothed pixel is valid.
    pub sm_valid: bool,
    /// Its column.
    pub sm_x: u32,
    /// Its row.
    pub sm_y: u32,
    /// Smoothed pixel in DN.
    pub sm_pixel: u16,
    /// A corner is valid.
    pub corner_valid: bool,
    /// Its column.
    pub corner_x: u32,
    /// Its row.
    pub corner_y: u32,
    /// Greatest threshold at which it still is a corner, in DN.
    pub corner_score: u16,
    /// Differences of its 3x3 pixels by rows, in DN.
    pub corner_resp: [u16; 9],
    /// Its rank among the corners of a cell: the score, or Harris.
    pub corner_rank: u16,
    /// The row's last slot leaves.
    pub row_end: bool,
    /// The row is virtual.
    pub row_end_virtual: bool,
    /// It is the frame's last one.
    pub frame_end: bool,
}

/// What slots carry along: bit or element s belongs to the slot taken s + 1 enabled clocks ago.
#[derive(Clone, Copy, Debug, Default)]
struct Carried {
    first: u32,
    last: u32,
    column: u32,
    whole: u32,
    peak: u32,
    pixel: bool,
    half_scale: bool,
    half: u32,
    addresses: [u32; 8],
    columns: [u32; 2],
}

/// Bits flipped so far in the registers of each sub-block.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct FrontToggles {
    /// Row arbiter.
    pub rows: u64,
    /// Window.
    pub window: u64,
    /// FAST network.
    pub fast: u64,
    /// Non-maximum suppression.
    pub nms: u64,
    /// Smoothing.
    pub smooth: u64,
    /// Harris.
    pub harris: u64,
    /// What slots carry along, and the columns on the pins.
    pub top: u64,
}

/// All registers of the front; memories are borrowed.
#[derive(Debug)]
pub struct FxFront<'a> {
    config: FxFrontConfig,
    rows: FxRows,
    window: FxWindow<'a>,
    fast: FxFast,
    nms: FxNms<'a>,
    smooth: FxSmooth,
    half: FxHalf<'a>,
    harris: FxHarris<'a>,
    carried: Carried,
    full_pixel: u16,
    out: Out,
    toggles: u64,
    enabled: u64,
}

/// The top's own output registers.
#[derive(Clone, Copy, Debug, Default)]
struct Out {
    octave: u32,
    row: u32,
    column: u32,
    rank: u16,
    row_end: bool,
    is_virtual: bool,
    frame_end: bool,
}

fn index(address: u32) -> usize {
    usize::try_from(address).expect("memories have fewer than 2^32 words")
}

fn bit(bits: u32, at: u32) -> bool {
    bits >> at & 1 == 1
}

impl<'a> FxFront<'a> {
    /// A front in reset. Panics on a config that `check` refuses or memories of other lengths.
    pub fn new(config: FxFrontConfig, memory: FxFrontMemory<'a>) -> Self {
        config.check().expect("the config was checked");
        let words = line_words(config.max_width, config.octaves);
        let ranks = if config.harris { words } else { 0 };
        assert!(memory.lines.len() == words && memory.scores.len() == words, "a column of each octave has a word");
        assert!(memory.half_row.len() == index(config.max_width / 2), "the row buffer holds half a row");
        assert!(memory.ranks.len() == ranks, "a column has a rank with Harris only");
        Self {
            config,
            rows: FxRows::new(config),
            window: FxWindow::new(memory.lines),
            fast: FxFast::default(),
            nms: FxNms::new(memory.scores),
            smooth: FxSmooth::default(),
            half: FxHalf::new(memory.half_row),
            harris: FxHarris::new(memory.ranks, config.pix_bits),
            carried: Carried::default(),
            full_pixel: 0,
            out: Out::default(),
            toggles: 0,
            enabled: 0,
        }
    }

    /// Parameters.
    pub fn config(&self) -> &FxFrontConfig {
        &self.config
    }

    /// The row that wants to start.
    pub fn request(&self) -> Request {
        self.rows.request()
    }

    /// Whether the coming edge would take a pixel, given what `row_ok` says of the request.
    pub fn in_ready(&self, row_ok: bool) -> bool {
        self.rows.in_ready(row_ok)
    }

    /// Slots taken so far.
    pub fn enabled_clocks(&self) -> u64 {
        self.enabled
    }

    /// Bits flipped so far.
    pub fn toggles(&self) -> FrontToggles {
        FrontToggles {
            rows: self.rows.toggles,
            window: self.window.toggles,
            fast: self.fast.toggles,
            nms: self.nms.toggles,
            smooth: self.smooth.toggles,
            harris: self.harris.toggles,
            top: self.toggles,
        }
    }

    /// Pins as they are, for this `row_ok`.
    pub fn out(&self, row_ok: bool) -> FxFrontOut {
        let (sm_valid, sm_pixel) = self.smooth.pixel();
        let (corner_valid, corner_score, corner_resp) = self.nms.corner();
        let position = |at: u32, back: u32| at.wrapping_sub(back) & 0xFFFF;
        FxFrontOut {
            in_ready: self.in_ready(row_ok),
            request: self.request(),
            octave: self.out.octave,
            row: self.out.row,
            sm_valid,
            sm_x: position(self.out.column, 3),
            sm_y: position(self.out.row, 3),
            sm_pixel,
            corner_valid,
            corner_x: position(self.out.column, 4),
            corner_y: position(self.out.row, 4),
            corner_score,
            corner_resp,
            corner_rank: if self.config.harris { self.out.rank } else { corner_score },
            row_end: self.out.row_end,
            row_end_virtual: self.out.is_virtual,
            frame_end: self.out.frame_end,
        }
    }

    /// One rising edge.
    pub fn tick(&mut self, pins: &FxFrontIn) -> FxFrontOut {
        if pins.rst {
            self.rows.reset();
            self.nms.reset();
            self.smooth.reset();
            (self.carried, self.out) = (Carried::default(), Out::default());
        } else if self.rows.enable(pins.in_valid, pins.row_ok) {
            self.step(pins);
        } else {
            self.nms.idle();
            self.smooth.idle();
            (self.out.row_end, self.out.frame_end) = (false, false);
        }
        self.out(pins.row_ok)
    }

    /// One enabled clock: every block takes what the registers before it hold.
    fn step(&mut self, pins: &FxFrontIn) {
        let slot = self.rows.slot();
        let carried = self.carried;
        let address = |of: usize, used: bool| used.then(|| index(carried.addresses[of]));
        self.leave(&carried);
        let found = self.nms.tick(NmsIn {
            read: address(3, bit(carried.column, 3)),
            column: address(4, bit(carried.column, 4)),
            difference: self.fast.difference(),
            peak: bit(carried.peak, 5),
            threshold: pins.threshold,
        });
        if found && self.config.harris {
            self.out.rank = self.harris.rank();
        }
        self.smooth.tick(&self.window.middle(), bit(carried.whole, 5));
        self.fast.tick(&self.window.circle(), self.window.centre(), bit(carried.whole, 3));
        if self.config.harris {
            let write = address(7, bit(carried.column, 7));
            self.harris.tick(&self.window.right(), write, address(5, bit(carried.column, 5)));
        }
        let pixel = if carried.half_scale { self.half.pixel() } else { self.full_pixel };
        let newest = self.window.newest();
        self.window.tick(slot.real_pixel.then(|| index(slot.address)), address(0, carried.pixel), pixel);
        if self.config.octaves > 1 {
            let read = slot.real_pixel && slot.half_scale;
            let write = bit(carried.half, 1).then(|| index(carried.columns[1]));
            self.half.tick(read.then(|| index(slot.column)), write, newest);
        }
        if slot.real_pixel && !slot.half_scale {
            self.toggles += flips(self.full_pixel.into(), pins.in_pixel.into());
            self.full_pixel = pins.in_pixel;
        }
        self.carry(&slot);
        self.rows.tick();
        self.enabled += 1;
    }

    /// What the slot at the pipeline's end says on the pins. A row is longer than the pipeline, so the arbiter still stands in
    /// its row.
    fn leave(&mut self, carried: &Carried) {
        let before = self.out;
        let first = bit(carried.first, 5);
        self.out.column = if first { 0 } else { (before.column + 1) & self.column_mask() };
        if first {
            let request = self.rows.request();
            (self.out.octave, self.out.row, self.out.is_virtual) = (request.octave, request.row, request.is_virtual);
        }
        self.out.row_end = bit(carried.last, 5);
        self.out.frame_end = self.out.row_end && self.rows.draining();
        let row = flips(before.row, self.out.row) + flips(before.octave, self.out.octave);
        self.toggles += row + flips(before.column, self.out.column);
    }

    /// The column's register has as many bits as `max_width` needs.
    fn column_mask(&self) -> u32 {
        u32::MAX >> self.config.max_width.leading_zeros()
    }

    fn carry(&mut self, slot: &RasterSlot) {
        let before = self.carried;
        let shift = |bits: u32, bit: bool, count: u32| (bits << 1 | u32::from(bit)) & ((1 << count) - 1);
        let addresses = if self.config.harris { 8 } else { 5 };
        let [a, b, c, d, e, f, g, _] = before.addresses;
        let mut next = Carried {
            first: shift(before.first, slot.first, 6),
            last: shift(before.last, slot.last, 6),
            column: shift(before.column, slot.real_column, 8),
            whole: shift(before.whole, slot.whole, 6),
            peak: shift(before.peak, slot.peak, 6),
            pixel: slot.real_pixel,
            half_scale: slot.half_scale,
            half: shift(before.half, slot.half, 2),
            addresses: [slot.address, a, b, c, d, e, f, g],
            columns: [slot.column >> 1, before.columns[0]],
        };
        next.addresses[addresses..].fill(0);
        self.toggles += flips_of(&before.addresses, &next.addresses) + flips_of(&before.columns, &next.columns);
        let flags = |of: &Carried| [of.first, of.last, of.column, of.whole, of.peak, of.half];
        self.toggles += flips_of(&flags(&before), &flags(&next));
        self.carried = next;
    }
}
