//! Conversions clock by clock. Computes, from levels in nV and delays, the ramp, each comparator's bit and each counter on every `adc_clk`.
//!
//! Two parts with one interface, the comparators' bits: `Comparators` is the analog side in integers, `Counters` the digital one. A
//! clock of `Comparators`: the ramp steps; every column that has not been crossed compares; a crossed column's bit goes high its
//! delay later and stays high; bits that go high shift the ramp from the next clock on (`Kickback`). A clock of `Counters`: a column
//! counts while its bit is low. All columns see one ramp, so waiting columns are kept in the order of their levels: the work of a
//! clock grows with the columns whose bits change, and without changes is that of the ramp alone.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::columns::{Columns, Converter};
use super::crossings::NEVER;
use super::kickback::{Kickback, Shift};
use super::params::{Cds, Counter, Counting};
use super::ramp::RampLevels;
use super::sample::{RowWork, Sample};
use crate::num::{index, u64_from};
use crate::rtl_simulator::RowRequest;

/// The columns under one ramp during one conversion.
#[derive(Clone, Debug)]
pub struct Comparators<'a> {
    ramp_levels: &'a RampLevels,
    kickback: Option<&'a Kickback>,
    shift: Shift,
    clock: u32,
    ramp_nv: i64,
    delays_clk: Vec<u32>,
    /// Level and number among the chosen of columns that have not been crossed, the lowest last.
    waiting: Vec<(i64, usize)>,
    /// Clock at which a crossed column's bit goes high, and its number.
    due: BinaryHeap<Reverse<(u32, usize)>>,
    high: Vec<bool>,
    /// Columns, by their number, whose bits went high at the present clock.
    flipped: Vec<usize>,
}

impl<'a> Comparators<'a> {
    /// All bits low, the ramp at its bottom. `chosen` columns of the row, with their levels.
    fn new(columns: &Columns<'a>, chosen: &[usize], levels_nv: impl Iterator<Item = i64>) -> Self {
        let converter = columns.converter;
        let mut waiting: Vec<_> = levels_nv.enumerate().map(|(number, level_nv)| (level_nv, number)).collect();
        waiting.sort_unstable_by(|a, b| b.cmp(a));
        Self {
            ramp_levels: &converter.ramp_levels,
            kickback: converter.kickback.as_ref(),
            shift: Shift::default(),
            clock: 0,
            ramp_nv: 0,
            delays_clk: chosen.iter().map(|&column| columns.delay_clk(column)).collect(),
            waiting,
            due: BinaryHeap::new(),
            high: vec![false; chosen.len()],
            flipped: Vec::new(),
        }
    }

    /// Comparators' bits as they stand.
    pub fn bits(&self) -> &[bool] {
        &self.high
    }

    /// Columns, by their number among the chosen, whose bits went high at the present clock.
    pub fn flipped(&self) -> &[usize] {
        &self.flipped
    }

    /// The ramp as the columns saw it at the present clock.
    pub fn ramp_nv(&self) -> i64 {
        self.ramp_nv
    }

    /// One rising edge of `adc_clk`.
    pub fn tick(&mut self) {
        self.clock += 1;
        self.flipped.clear();
        let shift_nv = self.kickback.map_or(0, |kickback| kickback.shift_nv(self.shift, self.clock));
        self.ramp_nv = self.ramp_levels.ramp_level_nv(self.clock) + shift_nv;
        while let Some(&(level_nv, number)) = self.waiting.last() {
            if self.ramp_nv <= level_nv {
                break;
            }
            self.waiting.pop();
            match self.delays_clk[number] {
                0 => self.flipped.push(number),
                delay_clk => self.due.push(Reverse((self.clock + delay_clk, number))),
            }
        }
        while let Some(&Reverse((clock, number))) = self.due.peek() {
            if clock > self.clock {
                break;
            }
            self.due.pop();
            self.flipped.push(number);
        }
        for &number in &self.flipped {
            self.high[number] = true;
        }
        if let Some(kickback) = self.kickback.filter(|_| !self.flipped.is_empty()) {
            let flips = crate::num::u32_from(self.flipped.len());
            self.shift = kickback.after_flips(self.shift, self.clock, flips);
        }
    }
}

/// The columns' counters: they see `adc_clk`, the conversion's name and the edges of the comparators' bits.
#[derive(Clone, Debug)]
pub struct Counters {
    counting: Counting,
    counter: Counter,
    sample: Sample,
    /// Each column's value before this conversion.
    values: Vec<i64>,
    /// Clocks of this conversion: what the shared counter shows, or a column's counter has counted while its bit is low.
    elapsed: u32,
    /// Word at which a column stopped.
    held: Vec<u32>,
    /// Columns whose bits are low.
    running: u64,
    work: RowWork,
}

/// No word: the column's bit is low.
const RUNNING: u32 = u32::MAX;

impl Counters {
    /// Counters at `start` each.
    pub fn new(counting: Counting, counter: Counter, start: u32, columns: usize) -> Self {
        Self {
            counting,
            counter,
            sample: Sample::Signal,
            values: vec![start.into(); columns],
            elapsed: 0,
            held: vec![RUNNING; columns],
            running: u64_from(columns),
            work: RowWork::default(),
        }
    }

    /// A conversion begins: the shared counter starts anew, the columns' counters go on from where they are.
    pub fn begin(&mut self, sample: Sample) {
        for column in 0..self.values.len() {
            self.values[column] = self.value(column);
        }
        self.sample = sample;
        self.elapsed = 0;
        self.held.fill(RUNNING);
        self.running = u64_from(self.held.len());
    }

    /// One clock, at which the bits of these columns went high. A column's last count is that of the clock before.
    pub fn tick(&mut self, flipped: &[usize]) {
        self.work.comparator_clk += self.running;
        let word = self.encoded(self.elapsed);
        for &column in flipped {
            self.held[column] = word;
        }
        self.running -= u64_from(flipped.len());
        self.work.counter_steps += self.running;
        self.elapsed += 1;
    }

    /// Counts of a column in this conversion.
    fn count(&self, column: usize) -> i64 {
        match self.held[column] {
            RUNNING => self.elapsed.into(),
            word => self.decoded(word).into(),
        }
    }

    /// Where a column's counts stand, reset counts taken off.
    fn value(&self, column: usize) -> i64 {
        match self.sample {
            Sample::Reset => self.values[column] - self.count(column),
            Sample::Signal => self.values[column] + self.count(column),
        }
    }

    /// What a column shows: an up/down counter where it stands, a latch the count that it holds or follows.
    pub fn reading(&self, column: usize) -> i64 {
        match self.counting {
            Counting::UpDown => self.value(column),
            Counting::Latch => self.count(column),
        }
    }

    /// Code of a column, clipped to 0 .. `code_max`.
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
            let chosen: Vec<usize> = self.of_pass(pass, codes.len()).collect();
            let mut counters = self.converter.counters(chosen.len());
            let [reset_clk, signal_clk] =
                [(Sample::Reset, reset_uv), (Sample::Signal, signal_uv)].map(|(sample, uv)| {
                    if uv.is_empty() { Vec::new() } else { self.run(sample, &chosen, uv, &mut counters) }
                });
            let in_verilog = self.converter.verilog.as_ref().map(|verilog| {
                let (reset_clk, signal_clk) = (&reset_clk[..], &signal_clk[..]);
                let steps = |sample| self.converter.steps(sample);
                let (reset_steps, signal_steps) = (steps(Sample::Reset), steps(Sample::Signal));
                verilog.row(&RowRequest { cds: params.column(), signal_steps, reset_steps, reset_clk, signal_clk })
            });
            for (number, &column) in chosen.iter().enumerate() {
                codes[column] = match &in_verilog {
                    Some(codes) => codes[number],
                    None => counters.code(number, params.code_max()),
                };
            }
            work.counter_steps += counters.work.counter_steps;
            work.comparator_clk += counters.work.comparator_clk;
        }
        work
    }

    /// One conversion of some columns: the first clock at which each comparator is high.
    fn run(&self, sample: Sample, chosen: &[usize], samples_uv: &[f32], counters: &mut Counters) -> Vec<u32> {
        let mut comparators = self.comparators(chosen, samples_uv);
        let mut crossings_clk = vec![NEVER; chosen.len()];
        counters.begin(sample);
        for clock in 1..=self.converter.steps(sample) {
            comparators.tick();
            counters.tick(comparators.flipped());
            for &number in comparators.flipped() {
                crossings_clk[number] = clock;
            }
        }
        crossings_clk
    }

    /// The comparators of some columns of a row, under the samples of the whole row.
    pub fn comparators(&self, chosen: &[usize], samples_uv: &[f32]) -> Comparators<'_> {
        let levels_nv = chosen.iter().map(|&column| self.converter.level_nv(samples_uv[column]));
        Comparators::new(self, chosen, levels_nv)
    }

    /// Steps through a row's conversions and shows every clock, reset conversions first. All columns take part; those in
    /// `watched` are shown, each during its own pass.
    pub fn watch(&self, signal_uv: &[f32], reset_uv: &[f32], watched: &[usize], see: &mut dyn FnMut(ClockView<'_>)) {
        let params = &self.converter.params;
        let passes: Vec<Vec<usize>> =
            (0..index(params.columns_per_adc)).map(|pass| self.of_pass(pass, signal_uv.len()).collect()).collect();
        let mut counters: Vec<_> = passes.iter().map(|chosen| self.converter.counters(chosen.len())).collect();
        for (sample, samples_uv) in [(Sample::Reset, reset_uv), (Sample::Signal, signal_uv)] {
            if samples_uv.is_empty() || self.converter.steps(sample) == 0 {
                continue;
            }
            for (pass, (chosen, counters)) in passes.iter().zip(&mut counters).enumerate() {
                let numbers: Vec<usize> =
                    (0..chosen.len()).filter(|&number| watched.contains(&chosen[number])).collect();
                let mut comparators = self.comparators(chosen, samples_uv);
                counters.begin(sample);
                for clock in 1..=self.converter.steps(sample) {
                    comparators.tick();
                    counters.tick(comparators.flipped());
                    let bits: Vec<bool> = numbers.iter().map(|&number| comparators.bits()[number]).collect();
                    let readings: Vec<i64> = numbers.iter().map(|&number| counters.reading(number)).collect();
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

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::AdcParams;
    use crate::adc::params::tests::paper_adc;
    use crate::draw::DrawKey;
    use crate::num::{f32_nearest, u32_truncated};
    use rand::RngExt;

    /// The definition, column by column and clock by clock: bits of all columns at every clock.
    fn naive_bits(columns: &Columns<'_>, levels_nv: &[i64], steps: u32, see: &mut dyn FnMut(i64, &[bool])) {
        let converter = columns.converter;
        let mut due = vec![None; levels_nv.len()];
        let mut bits = vec![false; levels_nv.len()];
        let mut shift = Shift::default();
        for clock in 1..=steps {
            let shift_nv = converter.kickback.as_ref().map_or(0, |kickback| kickback.shift_nv(shift, clock));
            let ramp_nv = converter.ramp_level_nv(clock) + shift_nv;
            let before = bits.clone();
            for (column, &level_nv) in levels_nv.iter().enumerate() {
                if due[column].is_none() && ramp_nv > level_nv {
                    due[column] = Some(clock + columns.delay_clk(column));
                }
                bits[column] |= due[column] == Some(clock);
            }
            let flips = bits.iter().zip(&before).filter(|(now, before)| now != before).count();
            if let Some(kickback) = converter.kickback.as_ref().filter(|_| flips > 0) {
                shift = kickback.after_flips(shift, clock, crate::num::u32_from(flips));
            }
            see(ramp_nv, &bits);
        }
    }

    #[test]
    fn every_bit_at_every_clock_is_as_defined() {
        let mut stream = DrawKey::root(77).stream();
        let mut draw = |least: f64, most: f64| least + (most - least) * stream.random::<f64>();
        let mut clocks = 0;
        for case in 0..60_u32 {
            let params = AdcParams {
                bits: 3 + case % 7,
                black_level_dn: 0,
                reset_counts: 4,
                comparator_delay_clk: u32_truncated(draw(0.0, 6.0)),
                comparator_delay_sigma_clk: if case % 3 == 0 { 2.0 } else { 0.0 },
                kickback_uv: draw(-1.0, 1.0) * 400.0 * f64::from(case % 4),
                kickback_decay_clk: u32_truncated(draw(1.0, 60.0)),
                ..paper_adc()
            };
            let converter = Converter::new(&params);
            let columns = converter.columns(DrawKey::root(case.into()), 40);
            let samples_uv: Vec<f32> = (0..40).map(|_| f32_nearest(draw(-2e4, 1.3e5))).collect();
            let chosen: Vec<usize> = (0..40).collect();
            let levels_nv: Vec<i64> = samples_uv.iter().map(|&uv| converter.level_nv(uv)).collect();
            let mut comparators = columns.comparators(&chosen, &samples_uv);
            naive_bits(&columns, &levels_nv, converter.steps(Sample::Signal), &mut |ramp_nv, bits| {
                comparators.tick();
                assert_eq!((comparators.ramp_nv(), comparators.bits()), (ramp_nv, bits), "case {case}: {params:?}");
                clocks += 1;
            });
        }
        println!("{clocks} clocks of 40 columns");
        assert!(clocks > 5_000, "{clocks}");
    }
}
