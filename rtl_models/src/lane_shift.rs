//! Serialiser from column latches to lanes, bit by bit, twin of `verilog/lane_shift.sv`. Word w of lane l is column w * lanes + l, most
//! significant bit first.

/// Run-time parameters of the shifter.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct LaneConfig {
    /// Bits of a word, 1 to 16.
    pub bits: u32,
    /// Lanes in use, 1 to 16.
    pub lanes: u32,
    /// Columns of a row, padded to a multiple of `lanes`.
    pub columns: u32,
}

impl LaneConfig {
    /// Clocks in which a row's bits stand on the lanes.
    pub fn row_clocks(&self) -> u32 {
        self.columns / self.lanes * self.bits
    }

    /// Shortest line without overrun: one clock loads the first words.
    pub fn hts_min(&self) -> u32 {
        self.row_clocks() + 1
    }

    /// What the hardware needs to work as described.
    pub fn check(&self) -> Result<(), &'static str> {
        let rule = |holds: bool, sentence| if holds { Ok(()) } else { Err(sentence) };
        rule((1..=16).contains(&self.bits), "words have 1 to 16 bits")?;
        rule((1..=16).contains(&self.lanes), "there are 1 to 16 lanes")?;
        let whole = self.columns > 0 && self.columns.is_multiple_of(self.lanes) && self.columns < 1 << 16;
        rule(whole, "columns are a multiple of the lanes, below 2^16")
    }
}

/// Pins that enter, as they stand at the rising edge; the codes stand beside them.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LaneIn {
    /// Synchronous reset.
    pub rst: bool,
    /// Everything holds.
    pub stall: bool,
    /// Takes the codes.
    pub latch: bool,
}

/// Pins that leave, after the rising edge.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct LaneOut {
    /// One bit per lane, lane 0 lowest.
    pub lane: u16,
    /// The lanes carry bits.
    pub valid: bool,
    /// A row is held.
    pub busy: bool,
    /// First bit of a word.
    pub word_start: bool,
    /// First bit of a row.
    pub row_start: bool,
    /// A row was lost since reset: it was latched while the row before still shifted.
    pub overrun: bool,
}

/// The shifter's registers; the held codes are borrowed, one a column.
#[derive(Debug)]
pub struct LaneShift<'a> {
    config: LaneConfig,
    held: &'a mut [u16],
    words: [u16; 16],
    base: u32,
    bits_left: u32,
    out: LaneOut,
}

impl<'a> LaneShift<'a> {
    /// A shifter in reset. Panics on parameters out of range or another count of columns.
    pub fn new(config: LaneConfig, held: &'a mut [u16]) -> Self {
        config.check().expect("the config was checked");
        assert!(u32::try_from(held.len()) == Ok(config.columns), "a column has one latch");
        held.fill(0);
        Self { config, held, words: [0; 16], base: 0, bits_left: 0, out: LaneOut::default() }
    }

    /// Pins as they stand.
    pub fn out(&self) -> LaneOut {
        self.out
    }

    /// Codes of the row that shifts.
    pub fn held(&self) -> &[u16] {
        self.held
    }

    /// One rising edge.
    pub fn tick(&mut self, pins: LaneIn, codes: &[u16]) -> LaneOut {
        if pins.rst {
            self.held.fill(0);
            (self.words, self.base, self.bits_left, self.out) = ([0; 16], 0, 0, LaneOut::default());
        } else if !pins.stall {
            self.step(pins.latch, codes);
        }
        self.out
    }

    fn step(&mut self, latch: bool, codes: &[u16]) {
        let before = self.out;
        let last_bit = before.valid && self.bits_left == 0;
        let row_end = last_bit && self.base >= self.config.columns;
        let load = before.busy && !row_end && (!before.valid || last_bit);
        let accept = latch && (!before.busy || row_end);
        self.out.word_start = load;
        self.out.row_start = load && self.base == 0;
        if load {
            self.load();
        } else {
            self.bits_left = self.bits_left.saturating_sub(1);
            self.words = self.words.map(|word| if row_end { 0 } else { word << 1 });
        }
        self.out.valid = (before.valid || load) && !row_end;
        self.out.busy = (before.busy && !row_end) || accept;
        if accept {
            self.held.copy_from_slice(codes);
            self.base = 0;
        }
        self.out.overrun |= latch && !accept;
        let tops = self.words.iter().enumerate();
        self.out.lane = tops.fold(0, |lane, (index, &word)| lane | (word >> 15) << index);
    }

    fn load(&mut self) {
        let words = self.held.iter().skip(usize::try_from(self.base).expect("a column's number"));
        let lanes = usize::try_from(self.config.lanes).expect("at most 16");
        self.words = [0; 16];
        for (word, &code) in self.words.iter_mut().take(lanes).zip(words) {
            *word = code << (16 - self.config.bits);
        }
        self.base += self.config.lanes;
        self.bits_left = self.config.bits - 1;
    }
}
