//! Converts the counted work of a row's readout to events for the energy account.

use super::params::{AdcParams, Counter, Counting};
use super::sample::{RowWork, Sample};
use crate::events::{Event, Events};
use crate::num::u64_from;
use crate::pixel::PixelType;

/// Counts the events of reading and converting one row of `columns` columns.
///
/// A counter in a column steps once for each clock before its crossing, in both conversions. Its comparator is active for one clock
/// more, in which it crosses, unless the ramp ends first. A shared counter runs for the whole ramp: it steps once a clock, its lines
/// toggle along all columns (a binary count from 0 to N toggles 2 N - ones(N) times, a Gray count N times), and each column writes a
/// latch as wide as the ramp's last count.
pub fn count_row(params: &AdcParams, pixel_type: PixelType, columns: usize, work: RowWork, events: &mut Events) {
    events.add(Event::RowSelect, 1);
    events.add(Event::PixelReset, u64_from(columns));
    events.add(Event::ChargeTransfer, u64_from(columns) * pixel_type.transfers());
    count_conversion(params, columns, work, events);
}

/// Counts a conversion of a row whose pixels were reset and transferred for an earlier one.
pub fn count_conversion(params: &AdcParams, columns: usize, work: RowWork, events: &mut Events) {
    let columns = u64_from(columns);
    let passes = u64::from(params.columns_per_adc);
    let samples = if params.cds.is_double() { 2 } else { 1 };
    events.add(Event::ColumnSettle, columns * samples);
    events.add(Event::ComparatorClock, work.comparator_clk);
    events.add(Event::ReadoutBit, columns * u64::from(params.bits));

    let steps_of = |sample| match sample {
        Sample::Reset => params.reset_counts_used(),
        Sample::Signal => params.code_max(),
    };
    let step = match params.counter {
        Counter::Binary => Event::CounterStep,
        Counter::Gray => Event::GrayCounterStep,
    };
    for sample in [Sample::Reset, Sample::Signal] {
        let steps = steps_of(sample);
        events.add(Event::RampStep, passes * u64::from(steps));
        if params.counting == Counting::Latch {
            let toggles = match params.counter {
                Counter::Binary => 2 * u64::from(steps) - u64::from(steps.count_ones()),
                Counter::Gray => u64::from(steps),
            };
            events.add(step, passes * u64::from(steps));
            events.add(Event::CountLineToggle, passes * toggles);
            events.add(Event::CountLatchBit, columns * u64::from(u32::BITS - steps.leading_zeros()));
        }
    }
    if params.counting == Counting::UpDown {
        events.add(step, work.counter_steps);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::params::tests::paper_adc;
    use crate::adc::{Cds, Converter};

    /// Events of a row at these levels on the ramp, in LSB from its bottom.
    fn counted(params: &AdcParams, signal_lsb: &[u32], reset_lsb: &[u32]) -> Events {
        let converter = Converter::new(params);
        let sample_uv = |&k: &u32| converter.sample_uv(converter.ramp_level_nv(k) + 9);
        let signal_uv: Vec<f32> = signal_lsb.iter().map(sample_uv).collect();
        let reset_uv: Vec<f32> = reset_lsb.iter().map(sample_uv).collect();
        let mut codes = vec![0; signal_uv.len()];
        let work = converter.convert_row(&signal_uv, &reset_uv, &mut codes);
        let mut events = Events::default();
        count_row(params, PixelType::T4, codes.len(), work, &mut events);
        events
    }

    #[test]
    fn counters_step_only_until_the_crossing() {
        let events = counted(&AdcParams { cds: Cds::None, ..paper_adc() }, &[0, 64, 1022, 1023], &[]);
        assert_eq!(events.count(Event::CounterStep), 64 + 1022 + 1023);
        assert_eq!(events.count(Event::ComparatorClock), 1 + 65 + 1023 + 1023);
        assert_eq!(events.count(Event::RampStep), 1023);
        assert_eq!(events.count(Event::ReadoutBit), 40);
        assert_eq!((events.count(Event::ColumnSettle), events.count(Event::ChargeTransfer)), (4, 4));
        assert_eq!(events.count(Event::CountLatchBit) + events.count(Event::CountLineToggle), 0);
    }

    #[test]
    fn digital_double_sampling_adds_the_clocks_of_its_reset_ramp() {
        let without = counted(&AdcParams { cds: Cds::Analog, ..paper_adc() }, &[5, 6, 7], &[]);
        let with = counted(&paper_adc(), &[5, 6, 7], &[64, 60, 128]);
        assert_eq!(with.count(Event::CounterStep) - without.count(Event::CounterStep), 64 + 60 + 128);
        assert_eq!(with.count(Event::ComparatorClock) - without.count(Event::ComparatorClock), 65 + 61 + 128);
        assert_eq!(with.count(Event::RampStep) - without.count(Event::RampStep), 128);
        assert_eq!(with.count(Event::ColumnSettle), without.count(Event::ColumnSettle));
    }

    #[test]
    fn a_shared_counter_runs_for_the_whole_ramp_and_gray_toggles_half_as_often() {
        let latch = AdcParams { counting: Counting::Latch, columns_per_adc: 2, ..paper_adc() };
        let binary = counted(&latch, &[5, 1000], &[64, 64]);
        assert_eq!(binary.count(Event::CounterStep), 2 * (1023 + 128));
        assert_eq!(binary.count(Event::CountLineToggle), 2 * ((2 * 1023 - 10) + (2 * 128 - 1)));
        assert_eq!(binary.count(Event::CountLatchBit), 2 * (10 + 8));
        let gray = counted(&AdcParams { counter: Counter::Gray, ..latch }, &[5, 1000], &[64, 64]);
        assert_eq!(gray.count(Event::GrayCounterStep), 2 * (1023 + 128));
        assert_eq!((gray.count(Event::CountLineToggle), gray.count(Event::CounterStep)), (2 * (1023 + 128), 0));
    }
}
