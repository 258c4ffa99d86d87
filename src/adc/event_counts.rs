//! What a row's readout takes. Enters: the row's codes. Leaves: counted events for the energy account.

use super::AdcParams;
use crate::events::{Event, Events};
use crate::num::u64_from;
use crate::pixel::PixelType;

/// Counts the events of reading and converting one row.
///
/// A counter steps once for each edge at or below the signal: its code. Its comparator is active for one clock more, in which
/// it crosses, unless the ramp ends first. In a reset conversion the reset level lies at the middle of the reset ramp, so a
/// column steps half of `reset_counts`, rounded down.
pub fn count_row(params: &AdcParams, pixel_type: PixelType, codes: &[u16], events: &mut Events) {
    let columns = u64_from(codes.len());
    let ramp_steps = u64::from(params.code_max());
    let (mut counter_steps, mut comparator_clocks) = (0_u64, 0_u64);
    for &code in codes {
        counter_steps += u64::from(code);
        comparator_clocks += (u64::from(code) + 1).min(ramp_steps);
    }
    let reset_counts = u64::from(params.reset_counts_used());
    let reset_steps = reset_counts / 2;
    let reset_clocks = (reset_steps + 1).min(reset_counts);
    let samples = if params.cds.is_double() { 2 } else { 1 };

    events.add(Event::RowSelect, 1);
    events.add(Event::PixelReset, columns);
    events.add(Event::ChargeTransfer, columns * pixel_type.transfers());
    events.add(Event::ColumnSettle, columns * samples);
    events.add(Event::RampStep, reset_counts + ramp_steps);
    events.add(Event::ComparatorClock, comparator_clocks + columns * reset_clocks);
    events.add(Event::CounterStep, counter_steps + columns * reset_steps);
    events.add(Event::ReadoutBit, columns * u64::from(params.bits));
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::Cds;
    use crate::adc::params::tests::paper_adc;

    #[test]
    fn counters_step_only_until_the_crossing() {
        let mut events = Events::default();
        let params = AdcParams { cds: Cds::None, ..paper_adc() };
        count_row(&params, PixelType::T4, &[0, 64, 1022, 1023], &mut events);
        assert_eq!(events.count(Event::CounterStep), 64 + 1022 + 1023);
        assert_eq!(events.count(Event::ComparatorClock), 1 + 65 + 1023 + 1023);
        assert_eq!(events.count(Event::RampStep), 1023);
        assert_eq!(events.count(Event::ReadoutBit), 40);
        assert_eq!((events.count(Event::ColumnSettle), events.count(Event::ChargeTransfer)), (4, 4));
    }

    #[test]
    fn digital_double_sampling_adds_half_a_reset_ramp_a_column() {
        let (mut without, mut with) = (Events::default(), Events::default());
        count_row(&AdcParams { cds: Cds::Analog, ..paper_adc() }, PixelType::T6, &[5, 6], &mut without);
        count_row(&paper_adc(), PixelType::T6, &[5, 6], &mut with);
        assert_eq!(with.count(Event::CounterStep) - without.count(Event::CounterStep), 2 * 64);
        assert_eq!(with.count(Event::ComparatorClock) - without.count(Event::ComparatorClock), 2 * 65);
        assert_eq!(with.count(Event::RampStep) - without.count(Event::RampStep), 128);
        assert_eq!(with.count(Event::ColumnSettle), without.count(Event::ColumnSettle));
    }
}
