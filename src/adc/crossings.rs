//! When comparators go high, in closed form. Computes the first clock at which each comparator is high, from levels in nV and delays.
//!
//! A crossing is that clock, the comparator's delay included. Without kickback a column's crossing follows from its own level. With
//! kickback all columns that share the ramp are one system, solved from event to event: at clock t all columns compare with ramp level t
//! plus the shift; comparators that go high at t shift the ramp from t + 1 on. Between two events a search finds the next level that
//! the ramp passes: all columns see one ramp, so it is always the lowest level that is left. `Comparators` of the clocked rung steps
//! through the same definition.

use std::cmp::Reverse;
use std::collections::BinaryHeap;

use super::columns::Columns;
use super::kickback::{Kickback, Shift};
use super::ramp::RampLevels;
use super::sample::Sample;

/// The comparator stays low for the whole conversion.
pub(super) const NEVER: u32 = u32::MAX;

/// Crossing clocks of a conversion.
pub(super) fn crossings(columns: &Columns<'_>, sample: Sample, samples_uv: &[f32]) -> Vec<u32> {
    let converter = columns.converter;
    let steps = converter.steps(sample);
    let Some(kickback) = &converter.kickback else {
        let mut found = match &converter.kernel {
            Some(kernel) => kernel.counts(sample, samples_uv),
            None => samples_uv.iter().map(|&uv| converter.ramp_levels.count(converter.level_nv(uv), steps)).collect(),
        };
        for (column, crossing) in found.iter_mut().enumerate() {
            *crossing = high_at(*crossing + 1, columns.delay_clk(column), steps);
        }
        return found;
    };
    let levels_nv: Vec<i64> = samples_uv.iter().map(|&uv| converter.level_nv(uv)).collect();
    let mut found = vec![NEVER; levels_nv.len()];
    for pass in 0..crate::num::index(converter.params.columns_per_adc) {
        let mut waiting: Vec<(i64, usize)> =
            columns.of_pass(pass, levels_nv.len()).map(|column| (levels_nv[column], column)).collect();
        waiting.sort_unstable();
        Coupled {
            ramp_levels: &converter.ramp_levels,
            kickback,
            steps,
            clock: 0,
            shift: Shift::default(),
            flips: BinaryHeap::new(),
        }
        .solve(columns, &waiting, &mut found);
    }
    found
}

/// The crossing of a column: the ramp passes its level at clock `passed_clk`, and its comparator goes high `delay_clk` later.
fn high_at(passed_clk: u32, delay_clk: u32, steps: u32) -> u32 {
    let high = passed_clk + delay_clk;
    if high <= steps { high } else { NEVER }
}

/// Columns under one ramp that they disturb.
struct Coupled<'a> {
    ramp_levels: &'a RampLevels,
    kickback: &'a Kickback,
    steps: u32,
    /// Everything up to this clock is done.
    clock: u32,
    shift: Shift,
    /// Crossings to come of columns whose level the ramp has passed.
    flips: BinaryHeap<Reverse<u32>>,
}

impl Coupled<'_> {
    /// `waiting` is in rising order of levels.
    fn solve(mut self, columns: &Columns<'_>, waiting: &[(i64, usize)], found: &mut [u32]) {
        let mut waiting = waiting.iter().peekable();
        loop {
            let next_flip = self.flips.peek().map_or(NEVER, |flip| flip.0);
            let until = next_flip.min(self.steps);
            let crossing = waiting.peek().and_then(|(level_nv, _)| self.first_above(*level_nv, until));
            let Some(clock) = crossing.or((next_flip != NEVER).then_some(next_flip)) else { return };
            self.clock = clock;
            let ramp_nv = self.ramp_nv(clock);
            while let Some(&(_, column)) = waiting.next_if(|(level_nv, _)| *level_nv < ramp_nv) {
                found[column] = high_at(clock, columns.delay_clk(column), self.steps);
                if found[column] != NEVER {
                    self.flips.push(Reverse(found[column]));
                }
            }
            self.flip();
        }
    }

    /// The ramp as the columns see it.
    fn ramp_nv(&self, clock: u32) -> i64 {
        self.ramp_levels.ramp_level_nv(clock) + self.kickback.shift_nv(self.shift, clock)
    }

    /// The first clock after the present one, up to `until`, at which the ramp is above a level if nothing flips before.
    fn first_above(&self, level_nv: i64, until: u32) -> Option<u32> {
        let mut from = self.clock + 1;
        while from <= until {
            if !self.kickback.falls_back(self.shift, from) {
                // Neither ramp levels nor shift fall from here on.
                return self.first_of_rising(level_nv, from, until);
            }
            // A shift that falls back is never greater than here: no clock before this one can lie above the level.
            let highest_shift_nv = self.kickback.shift_nv(self.shift, from);
            let candidate = from.max(self.ramp_levels.count(level_nv - highest_shift_nv, until) + 1);
            if candidate > until {
                return None;
            }
            if self.ramp_nv(candidate) > level_nv {
                return Some(candidate);
            }
            from = candidate + 1;
        }
        None
    }

    fn first_of_rising(&self, level_nv: i64, from: u32, until: u32) -> Option<u32> {
        let (mut low, mut high) = (from, until + 1);
        while low < high {
            let middle = low + (high - low) / 2;
            if self.ramp_nv(middle) > level_nv { high = middle } else { low = middle + 1 }
        }
        (low <= until).then_some(low)
    }

    /// Lets the comparators flip that are due at the present clock.
    fn flip(&mut self) {
        let mut flips = 0;
        while self.flips.peek().is_some_and(|flip| flip.0 == self.clock) {
            self.flips.pop();
            flips += 1;
        }
        if flips > 0 {
            self.shift = self.kickback.after_flips(self.shift, self.clock, flips);
        }
    }
}
