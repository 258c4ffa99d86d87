//! Descriptor engine, twin of `verilog/fx_engine.sv` with its `fx_brief`. Takes the patch's columns and the other words of the record;
//! the record is complete `desc_bits` + 4 clocks later.

use crate::flips;
use crate::fx_pattern::points;
use crate::fx_ring::{Column, SIDE};
use crate::words::{PositionPx, Sine, TurnedPx, Turns};

/// Bytes of the widest descriptor.
pub const BYTES: usize = 32;

/// Bits of `sin(2 pi k / 256)` of the first quarter turn, rounded.
const SINE_BITS: [i16; 65] = [
    0, 402, 804, 1205, 1606, 2006, 2404, 2801, 3196, 3590, 3981, 4370, 4756, 5139, 5520, 5897, 6270, 6639, 7005, 7366,
    7723, 8076, 8423, 8765, 9102, 9434, 9760, 10080, 10394, 10702, 11003, 11297, 11585, 11866, 12140, 12406, 12665,
    12916, 13160, 13395, 13623, 13842, 14053, 14256, 14449, 14635, 14811, 14978, 15137, 15286, 15426, 15557, 15679,
    15791, 15893, 15986, 16069, 16143, 16207, 16261, 16305, 16340, 16364, 16379, 16384,
];

/// A feature as it leaves; a descriptor of fewer bits ends in zeros.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Record {
    /// Column in octave 0.
    pub x_q4: PositionPx,
    /// Row in octave 0.
    pub y_q4: PositionPx,
    /// FAST score in DN of the pipeline.
    pub score: u16,
    /// Orientation.
    pub angle: Turns,
    /// Octave.
    pub octave: u8,
    /// Parity of the octave's frame.
    pub frame: bool,
    /// Bit i of the pattern in bit i % 8 of byte i / 8.
    pub descriptor: [u8; BYTES],
}

/// What an engine is built as.
#[derive(Clone, Copy, Debug)]
pub struct EngineConfig {
    /// Bits of the descriptor, 64 to 256.
    pub desc_bits: u32,
    /// The rotationally symmetric pattern: no rotator.
    pub symmetric: bool,
}

/// Two points of the patch, as (column, row).
type PatchPoints = [(usize, usize); 2];

/// The engine's registers and patch memory.
#[derive(Clone, Copy, Debug)]
pub struct Engine {
    patch: [Column; SIDE],
    record: Record,
    index: Option<u8>,
    picked: Option<(u8, [(i32, i32); 2])>,
    patch_points: Option<(u8, PatchPoints)>,
    pixels: Option<(u8, [u16; 2])>,
    sine: Sine,
    cosine: Sine,
    done: bool,
    toggles: u64,
}

impl Default for Engine {
    fn default() -> Self {
        Self {
            patch: [[0; SIDE]; SIDE],
            record: Record::default(),
            index: None,
            picked: None,
            patch_points: None,
            pixels: None,
            sine: Sine::ZERO,
            cosine: Sine::ZERO,
            done: false,
            toggles: 0,
        }
    }
}

impl Engine {
    /// Back to nothing; patch memory and toggles stay.
    pub fn reset(&mut self) {
        *self = Self { patch: self.patch, toggles: self.toggles, ..Self::default() };
    }

    /// The record waits.
    pub fn done(&self) -> bool {
        self.done
    }

    /// The record's registers as they stand.
    pub fn record(&self) -> &Record {
        &self.record
    }

    /// Bits of the descriptor's registers that flipped.
    pub fn toggles(&self) -> u64 {
        self.toggles
    }

    /// One rising edge: a column of the patch may stand; `go` brings the record without its descriptor; `taken` ends it.
    pub fn tick(&mut self, config: EngineConfig, column: Option<(usize, &Column)>, go: Option<&Record>, taken: bool) {
        let last = u8::try_from(config.desc_bits - 1).expect("at most 256 bits");
        self.done &= !taken;
        if let Some((index, [first, second])) = self.pixels.take() {
            self.store(index, first < second);
            self.done |= index == last;
        }
        self.pixels =
            self.patch_points.take().map(|(index, patch_points)| (index, patch_points.map(|(x, y)| self.patch[x][y])));
        let (sine, cosine) = (self.sine, self.cosine);
        self.patch_points = self.picked.take().map(|(index, points)| {
            let turned_point = |point| if config.symmetric { point } else { turned(point, sine, cosine) };
            let column = |offset: i32| usize::try_from(offset + 13).expect("a turn keeps the radius");
            (index, points.map(turned_point).map(|(x, y)| (column(x), column(y))))
        });
        self.picked = self.index.map(|index| {
            let turn = if config.symmetric { self.record.angle.to_bits() & 0xF8 } else { 0 };
            (index, points(config.symmetric, index.wrapping_add(turn)))
        });
        self.index = self.index.filter(|&index| index != last).map(|index| index + 1);
        if let Some((index, column)) = column {
            self.patch[index] = *column;
        }
        if let Some(record) = go {
            self.record = Record { descriptor: self.record.descriptor, ..*record };
            const QUARTER: Turns = Turns::from_bits(64);
            (self.sine, self.cosine) = (sine_of(record.angle), sine_of(record.angle.wrapping_add(QUARTER)));
            self.index = Some(0);
        }
    }

    /// Clocks until the record waits; none where no descriptor is under way.
    pub(crate) fn clocks_to_done(&self, config: EngineConfig) -> Option<u32> {
        let (picked, turned, read) = (self.picked.is_some(), self.patch_points.is_some(), self.pixels.is_some());
        let left = |index: u8| config.desc_bits - u32::from(index) + 3;
        let in_flight = || if picked { Some(3) } else { turned.then_some(2).or(read.then_some(1)) };
        self.index.map(left).or_else(in_flight)
    }

    /// So many rising edges without a column, a record or its taking.
    pub(crate) fn advance(&mut self, config: EngineConfig, clocks: u64) {
        let left = self.clocks_to_done(config).map_or(0, u64::from);
        (0..clocks.min(left)).for_each(|_| self.tick(config, None, None, false));
    }

    fn store(&mut self, index: u8, darker: bool) {
        let byte = &mut self.record.descriptor[usize::from(index / 8)];
        let stored = *byte & !(1 << (index % 8)) | u8::from(darker) << (index % 8);
        self.toggles += flips((*byte).into(), stored.into());
        *byte = stored;
    }
}

fn sine_of(angle: Turns) -> Sine {
    let k = angle.to_bits();
    let quarter = |k: u8| Sine::from_bits(SINE_BITS[usize::from(if k <= 64 { k } else { 128 - k })]);
    if k < 128 { quarter(k) } else { quarter(k - 128).wrapping_neg() }
}

/// A point under a turn, rounded half up.
fn turned((x, y): (i32, i32), sine: Sine, cosine: Sine) -> (i32, i32) {
    const HALF: TurnedPx = TurnedPx::lit("0.5");
    let times = |word: Sine, px: i32| TurnedPx::from(word).wrapping_mul_int(px);
    let rounded = |coordinate: TurnedPx| coordinate.wrapping_add(HALF).wrapping_to_num();
    (rounded(times(cosine, x).wrapping_sub(times(sine, y))), rounded(times(sine, x).wrapping_add(times(cosine, y))))
}
