//! Lane pins over many clocks as bit planes, one bit per clock. Writes a whole row's bits at once into borrowed words and counts flipped
//! bits for the energy model.
//!
//! Clock t is bit 63 - t % 64 of word t / 64, so time runs from the most significant bit, as the words on the lanes do.

use crate::lane_shift::LaneConfig;

/// Planes of all lane pins from clock 0 on, all 0 before the first row is written. Clocks beyond a plane's end
/// are left out, so empty planes serve who wants toggles only.
#[derive(Debug)]
pub struct LanePlanes<'a> {
    /// One plane after the other, `lanes` of equal length.
    pub lanes: &'a mut [u64],
    /// `busy`.
    pub busy: &'a mut [u64],
    /// `valid`.
    pub valid: &'a mut [u64],
    /// `word_start`.
    pub word_start: &'a mut [u64],
    /// `row_start`.
    pub row_start: &'a mut [u64],
}

/// The pin at a clock.
#[inline]
pub fn plane_bit(plane: &[u64], clock: u64) -> bool {
    let word = usize::try_from(clock / 64).expect("a clock of the plane");
    plane[word] >> (63 - clock % 64) & 1 == 1
}

/// Sets clocks `from .. to` of a plane, as far as it reaches.
pub fn fill_plane(plane: &mut [u64], from: u64, to: u64) {
    let to = to.min(64 * u64::try_from(plane.len()).expect("a length"));
    let mut clock = from;
    while clock < to {
        let (word, offset) = (usize::try_from(clock / 64).expect("a clock of the plane"), clock % 64);
        let end = (clock - offset + 64).min(to);
        plane[word] |= u64::MAX >> offset & u64::MAX << (63 - (end - 1) % 64);
        clock = end;
    }
}

/// Sets every `period`-th clock of `from .. to`, from the first on; periods go from 1 to 16.
fn mark_plane(plane: &mut [u64], from: u64, to: u64, period: u64) {
    // Marks of period p counted from the top bit; the pattern of a word whose first mark is `phase` clocks in is shifted by that.
    let mut pattern = 0_u64;
    for mark in (0..64).step_by(usize::try_from(period).expect("small")) {
        pattern |= 1 << (63 - mark);
    }
    let mut clock = from;
    while clock < to {
        let (word, offset) = (clock / 64, clock % 64);
        let Some(cell) = usize::try_from(word).ok().and_then(|word| plane.get_mut(word)) else { return };
        let end = to.min(64 * word + 64);
        *cell |= pattern >> offset & u64::MAX << (64 * word + 64 - end);
        clock += (end - clock).div_ceil(period) * period;
    }
}

/// Appends bits to a plane in the order of time, a whole word at once.
struct PlaneWriter<'a> {
    plane: &'a mut [u64],
    word: usize,
    gathered: u64,
    room: u32,
    before: u64,
    toggles: u64,
}

impl<'a> PlaneWriter<'a> {
    fn new(plane: &'a mut [u64], clock: u64) -> Self {
        let word = usize::try_from(clock / 64).expect("a clock of the plane");
        let room = 64 - u32::try_from(clock % 64).expect("below 64");
        Self { plane, word, gathered: 0, room, before: 0, toggles: 0 }
    }

    /// `bits` low bits of `code`, which has no others.
    #[inline(always)]
    fn push(&mut self, code: u64, bits: u32) {
        if bits < self.room {
            self.gathered = self.gathered << bits | code;
            self.room -= bits;
        } else {
            let over = bits - self.room;
            self.store(self.gathered << self.room | code >> over);
            self.gathered = code & ((1 << over) - 1);
            self.room = 64 - over;
        }
    }

    #[inline(always)]
    fn store(&mut self, full: u64) {
        // Neighbours in time differ where the word differs from itself shifted by a clock, the last pin of the word before coming in.
        self.toggles += u64::from((full ^ (full >> 1 | self.before << 63)).count_ones());
        self.before = full;
        if let Some(cell) = self.plane.get_mut(self.word) {
            *cell |= full;
        }
        self.word += 1;
    }

    /// The lane falls to 0 after its last bit.
    fn finish(mut self) -> u64 {
        if self.room < 64 {
            self.store(self.gathered << self.room);
        }
        self.toggles + (self.before & 1)
    }
}

/// Writes a row's pins, its first bits at `clock`. Returns the bits flipped on the lanes, from 0 before the row to 0 after it.
/// Panics on clock 0, another count of columns, or planes of unequal length.
pub fn write_row(config: &LaneConfig, codes: &[u16], clock: u64, planes: &mut LanePlanes<'_>) -> u64 {
    let lanes = usize::try_from(config.lanes).expect("at most 16");
    let words = planes.lanes.len() / lanes;
    assert!(words * lanes == planes.lanes.len(), "all lanes' planes are of one length");
    assert!(u32::try_from(codes.len()) == Ok(config.columns), "a column has one code");
    let end = clock + u64::from(config.row_clocks());
    fill_plane(planes.busy, clock - 1, end);
    fill_plane(planes.valid, clock, end);
    fill_plane(planes.row_start, clock, clock + 1);
    mark_plane(planes.word_start, clock, end, config.bits.into());
    let mut toggles = 0;
    for lane in 0..lanes {
        let plane = &mut planes.lanes[words * lane..words * (lane + 1)];
        toggles += match config.lanes {
            1 => write_lane(plane, clock, config.bits, codes.iter()),
            _ => write_lane(plane, clock, config.bits, codes[lane..].iter().step_by(lanes)),
        };
    }
    toggles
}

#[inline(always)]
fn write_lane<'a>(plane: &mut [u64], clock: u64, bits: u32, codes: impl Iterator<Item = &'a u16>) -> u64 {
    let mut writer = PlaneWriter::new(plane, clock);
    for &code in codes {
        writer.push(code.into(), bits);
    }
    writer.finish()
}
