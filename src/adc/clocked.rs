//! Conversions clock by clock. Enters: levels in nV, delays. Leaves: on every `adc_clk` the ramp, each comparator's bit, each counter.
//!
//! Two parts with one border, the comparators' bits: `Comparators` is the analog side in integers, `Counters` the digital one. A
//! clock of `Comparators`: the ramp steps; every column that has not been crossed compares; a crossed column's bit goes high its
//! delay later and stays; bits that go high shift the ramp from the next clock on (`Kickback`). A clock of `Counters`: a column
//! counts while its bit is low. Where the ramp stands below every level that waits, no bit can change: such clocks
//! cost the ramp alone, and counters take them together (`Counters::hold`).

use super::convert::columns_of_pass;
use super::kickback::{Kickback, Shift};
use super::ramp::RampEdges;
use super::{Cds, Columns, Converter, Counter, Counting, RowWork, Sample};
use crate::num::{index, u64_from};

/// No clock: nothing was crossed yet.
const NOT_YET: u32 = u32::MAX;

/// The columns under one ramp during one conversion.
#[derive(Clone, Debug)]
pub struct Comparators<'a> {
    edges: &'a RampEdges,
    kickback: Option<&'a Kickback>,
    shift: Shift,
    clock: u32,
    ramp_nv: i64,
    levels_nv: Vec<i64>,
    delays_clk: Vec<u32>,
    /// Clock at which a crossed column's bit goes high.
    due_clk: Vec<u32>,
    high: Vec<bool>,
    /// The lowest level that has not been crossed.
    lowest_nv: i64,
    /// Whether a crossed column still waits for its delay.
    is_any_due: bool,
}

impl<'a> Comparators<'a> {
    /// All bits low, the ramp at its bottom. `chosen` columns of the row, with their levels.
    pub(super) fn new(columns: &Columns<'a>, chosen: &[usize], levels_nv: Vec<i64>) -> Self {
        let converter = columns.converter;
        Self {
            edges: &converter.edges,
            kickback: converter.kickback.as_ref(),
            shift: Shift::default(),
            clock: 0,
            ramp_nv: 0,
            delays_clk: chosen.iter().map(|&column| columns.delay_clk(column)).collect(),
            due_clk: vec![NOT_YET; levels_nv.len()],
            high: vec![false; levels_nv.len()],
            lowest_nv: levels_nv.iter().copied().min().unwrap_or(i64::MAX),
            is_any_due: false,
            levels_nv,
        }
    }

    /// Comparators' bits as they stand.
    pub fn bits(&self) -> &[bool] {
        &self.high
    }

    /// The ramp as the columns saw it at the present clock.
    pub fn ramp_nv(&self) -> i64 {
        self.ramp_nv
    }

    /// One rising edge of `adc_clk`. Says whether any bit changed.
    pub fn tick(&mut self) -> bool {
        self.clock += 1;
        let shift_nv = self.kickback.map_or(0, |kickback| kickback.shift_nv(self.shift, self.clock));
        self.ramp_nv = self.edges.edge_nv(self.clock) + shift_nv;
        if self.ramp_nv <= self.lowest_nv && !self.is_any_due {
            return false;
        }
        let flips = self.compare(self.ramp_nv);
        if let Some(kickback) = self.kickback.filter(|_| flips > 0) {
            self.shift = kickback.after_flips(self.shift, self.clock, flips);
        }
        flips > 0
    }

    /// Compares all columns; gives back how many bits went high.
    fn compare(&mut self, ramp_nv: i64) -> u32 {
        let mut flips = 0;
        (self.lowest_nv, self.is_any_due) = (i64::MAX, false);
        for (column, &level_nv) in self.levels_nv.iter().enumerate() {
            let due_clk = &mut self.due_clk[column];
            if *due_clk == NOT_YET {
                if ramp_nv > level_nv {
                    *due_clk = self.clock + self.delays_clk[column];
                } else {
                    self.lowest_nv = self.lowest_nv.min(level_nv);
                }
            }
            if *due_clk == self.clock {
                self.high[column] = true;
                flips += 1;
            }
            self.is_any_due |= *due_clk != NOT_YET && *due_clk > self.clock;
        }
        flips
    }
}

/// The columns' counters: they see `adc_clk`, the conversion's name and the comparators' bits.
#[derive(Clone, Debug)]
pub struct Counters {
    counting: Counting,
    counter: Counter,
    sample: Sample,
    /// Of `UpDown`: each column's counter.
    counts: Vec<i64>,
    /// Of `Latch`: the shared counter, the word that each column latched in this conversion, and the latched reset counts.
    shared: u32,
    latched: Vec<u32>,
    reset_counts: Vec<u32>,
    work: RowWork,
}

impl Counters {
    /// Counters at `start` each.
    pub fn new(counting: Counting, counter: Counter, start: u32, columns: usize) -> Self {
        Self {
            counting,
            counter,
            sample: Sample::Signal,
            counts: vec![start.into(); columns],
            shared: 0,
            latched: vec![0; columns],
            reset_counts: vec![0; columns],
            work: RowWork::default(),
        }
    }

    /// A conversion begins: the shared counter starts anew, the columns' counters go on from where they are.
    pub fn begin(&mut self, sample: Sample) {
        if sample == Sample::Signal {
            self.reset_counts = self.latched.iter().map(|&word| self.decoded(word)).collect();
        }
        self.sample = sample;
        self.shared = 0;
        let none = self.encoded(0);
        self.latched.fill(none);
    }

    /// One clock under the bits that the comparators give at it.
    pub fn tick(&mut self, bits_before: &[bool], bits: &[bool]) {
        self.work.comparator_clk += u64_from(bits_before.iter().filter(|bit| !**bit).count());
        self.count(1, bits);
    }

    /// The same as `clocks` clocks at which no bit changes.
    pub fn hold(&mut self, clocks: u32, bits: &[bool]) {
        if clocks > 0 {
            self.work.comparator_clk += u64::from(clocks) * u64_from(bits.iter().filter(|bit| !**bit).count());
            self.count(clocks, bits);
        }
    }

    fn count(&mut self, clocks: u32, bits: &[bool]) {
        let low = u64_from(bits.iter().filter(|bit| !**bit).count());
        self.work.counter_steps += u64::from(clocks) * low;
        self.shared += clocks;
        match self.counting {
            Counting::UpDown => {
                let step = if self.sample == Sample::Reset { -1 } else { 1 };
                for (count, &bit) in self.counts.iter_mut().zip(bits) {
                    *count += if bit { 0 } else { step * i64::from(clocks) };
                }
            }
            Counting::Latch => {
                // A latch is open while its comparator is low, so it holds the count before the clock of the crossing.
                let word = self.encoded(self.shared);
                for (latched, _) in self.latched.iter_mut().zip(bits).filter(|(_, bit)| !**bit) {
                    *latched = word;
                }
            }
        }
    }

    /// What each column's counter reads: of `UpDown` its count, of `Latch` the count that it holds in this conversion.
    pub fn reading(&self, column: usize) -> i64 {
        match self.counting {
            Counting::UpDown => self.counts[column],
            Counting::Latch => self.decoded(self.latched[column]).into(),
        }
    }

    /// Counts of a column, reset less signal, on top of where the counters started.
    fn value(&self, column: usize) -> i64 {
        match self.counting {
            Counting::UpDown => self.counts[column],
            // The start was given to the subtractor as the counters' first value.
            Counting::Latch => self.counts[column] + self.reading(column) - i64::from(self.reset_counts[column]),
        }
    }

    /// Codes, clipped to 0 .. `code_max`.
    pub fn code(&self, column: usize, code_max: u32) -> u16 {
        let clipped = self.value(column).clamp(0, code_max.into());
        crate::num::low_u16(u32::try_from(clipped).expect("clipped above"))
    }

    fn encoded(&self, count: u32) -> u32 {
        match self.counter {
            Counter::Binary => count,
            Counter::Gray => count ^ (count >> 1),
        }
    }

    fn decoded(&self, word: u32) -> u32 {
        match self.counter {
            Counter::Binary => word,
            Counter::Gray => [16, 8, 4, 2, 1].into_iter().fold(word, |word, shift| word ^ (word >> shift)),
        }
    }
}

/// What a row shows at one clock, for waveforms.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ClockView<'a> {
    /// Which conversion.
    pub sample: Sample,
    /// Which of the conversions that shared converters make one after the other.
    pub pass: u32,
    /// Clocks of `adc_clk` since the conversion began; the first is 1.
    pub clock: u32,
    /// The ramp as the columns see it, in nV above its bottom.
    pub ramp_nv: i64,
    /// Comparators' bits of the watched columns of this pass.
    pub bits: &'a [bool],
    /// Counters of the watched columns of this pass.
    pub counters: &'a [i64],
}

impl Columns<'_> {
    /// The conversion of a row clock by clock; the slow twin of its closed form.
    pub(super) fn convert_by_clock(&self, signal_uv: &[f32], reset_uv: &[f32], codes: &mut [u16]) -> RowWork {
        let params = &self.converter.params;
        let mut work = RowWork::default();
        for pass in 0..index(params.columns_per_adc) {
            let chosen: Vec<usize> = columns_of_pass(params, pass, codes.len()).collect();
            let mut counters = self.converter.counters(chosen.len());
            for (sample, samples_uv) in [(Sample::Reset, reset_uv), (Sample::Signal, signal_uv)] {
                if !samples_uv.is_empty() {
                    self.run(sample, &chosen, samples_uv, &mut counters);
                }
            }
            for (place, &column) in chosen.iter().enumerate() {
                codes[column] = counters.code(place, params.code_max());
            }
            work.counter_steps += counters.work.counter_steps;
            work.comparator_clk += counters.work.comparator_clk;
        }
        work
    }

    fn run(&self, sample: Sample, chosen: &[usize], samples_uv: &[f32], counters: &mut Counters) {
        let mut comparators = self.comparators(chosen, samples_uv);
        counters.begin(sample);
        let (mut held, mut before) = (0, comparators.bits().to_vec());
        for _ in 0..self.converter.steps(sample) {
            if !comparators.tick() {
                held += 1;
                continue;
            }
            counters.hold(held, &before);
            counters.tick(&before, comparators.bits());
            before.copy_from_slice(comparators.bits());
            held = 0;
        }
        counters.hold(held, &before);
    }

    /// The comparators of some columns of a row, under the samples of the whole row.
    pub fn comparators(&self, chosen: &[usize], samples_uv: &[f32]) -> Comparators<'_> {
        let levels_nv = chosen.iter().map(|&column| self.converter.level_nv(samples_uv[column])).collect();
        Comparators::new(self, chosen, levels_nv)
    }

    /// Steps through a row's conversions and shows every clock, reset conversions first. All columns take part; those in
    /// `watched` are shown, each during its own pass.
    pub fn watch(&self, signal_uv: &[f32], reset_uv: &[f32], watched: &[usize], see: &mut dyn FnMut(ClockView<'_>)) {
        let params = &self.converter.params;
        let passes: Vec<Vec<usize>> = (0..index(params.columns_per_adc))
            .map(|pass| columns_of_pass(params, pass, signal_uv.len()).collect())
            .collect();
        let mut counters: Vec<_> = passes.iter().map(|chosen| self.converter.counters(chosen.len())).collect();
        for (sample, samples_uv) in [(Sample::Reset, reset_uv), (Sample::Signal, signal_uv)] {
            if samples_uv.is_empty() || self.converter.steps(sample) == 0 {
                continue;
            }
            for (pass, (chosen, counters)) in passes.iter().zip(&mut counters).enumerate() {
                let places: Vec<usize> = (0..chosen.len()).filter(|&place| watched.contains(&chosen[place])).collect();
                let mut comparators = self.comparators(chosen, samples_uv);
                counters.begin(sample);
                for clock in 1..=self.converter.steps(sample) {
                    let before = comparators.bits().to_vec();
                    comparators.tick();
                    counters.tick(&before, comparators.bits());
                    let bits: Vec<bool> = places.iter().map(|&place| comparators.bits()[place]).collect();
                    let readings: Vec<i64> = places.iter().map(|&place| counters.reading(place)).collect();
                    let (pass, ramp_nv) = (crate::num::u32_from(pass), comparators.ramp_nv());
                    see(ClockView { sample, pass, clock, ramp_nv, bits: &bits, counters: &readings });
                }
            }
        }
    }
}

impl Converter {
    fn counters(&self, columns: usize) -> Counters {
        // One conversion has its black level in the pedestal alone.
        let start = if self.params.cds == Cds::Digital { self.params.black_level_dn } else { 0 };
        Counters::new(self.params.counting, self.params.counter, start, columns)
    }
}
