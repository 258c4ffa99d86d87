//! Energy of the converters by architecture. Bias flows by time; decisions are counted by the bits that leave the columns, or by the clocks
//! of the ramp. Bias and settling of the column lines are not here: `ItemBuilder::pixels` counts them in the block `pixel`. Formulas stand
//! in docs/energy.md.

use super::constant::Constant;
use super::item::{Amount, ItemBuilder, PoweredSensor, Rail};
use super::params::Architecture;
use crate::adc::{Counter, Counting};
use crate::events::{Block, Event};
use crate::num::f64_from_u64;

/// Columns for which the constants of the shared ramp and count are stated.
const NOMINAL_COLUMNS: f64 = 640.0;
/// Supply for which the ramp's constant is stated, in V.
const RAMP_NOMINAL_V: f64 = 2.8;

/// Whether pixels drive column lines.
pub(super) fn has_columns(sensor: &PoweredSensor) -> bool {
    sensor.params.adc_architecture != Architecture::InPixel
}

/// Cycles of an incremental converter of second order for a depth: its resolution grows as N^2 / 2.
pub(super) fn cycles(bits: u32) -> f64 {
    libm::ceil(libm::sqrt(2.0 * libm::exp2(f64::from(bits))))
}

/// Adds the items of the converters.
pub(super) fn items(build: &mut ItemBuilder<'_>) {
    let (sensor, supply_v) = (build.sensor, build.sensor.supply_v);
    let (analog, digital) = ((Block::Adc, Rail::Analog), (Block::Adc, Rail::Digital));
    let bits = f64::from(sensor.adc.bits);
    let bit = Amount::Event(Event::ReadoutBit);
    // Digital double sampling converts the reset level too.
    let samples = if sensor.adc.reset_counts_used() > 0 { 2.0 } else { 1.0 };
    let logic = build.logic_factor();
    if has_columns(sensor) {
        let bias_ua = build.value(Constant::ComparatorBias) * build.bias_class();
        let bias_mw = 1e-3 * bias_ua * supply_v * f64::from(sensor.converters());
        build.mw(analog, Constant::ComparatorBias, build.bias_share(), bias_mw);
    }
    match sensor.params.adc_architecture {
        Architecture::SingleSlope => single_slope(build),
        Architecture::Sar => {
            build.pj(digital, bit, Constant::SarBit, samples * logic * build.value(Constant::SarBit));
            // Monotonic switching moves about half of C V^2 of the whole array in a conversion.
            let array_ff = libm::exp2(bits) * build.value(Constant::SarUnit);
            let array_pj = 0.5e-3 * array_ff * supply_v * supply_v;
            build.pj(analog, bit, Constant::SarUnit, samples * array_pj / bits);
        }
        Architecture::Cyclic => {
            let stage_pj = build.value(Constant::CyclicBit) * supply_v / RAMP_NOMINAL_V;
            build.pj(analog, bit, Constant::CyclicBit, samples * stage_pj);
        }
        Architecture::SigmaDelta => {
            let cycles = cycles(sensor.adc.bits);
            let cycle_pj = build.value(Constant::SigmaDeltaCycle) * supply_v / RAMP_NOMINAL_V;
            build.pj(analog, bit, Constant::SigmaDeltaCycle, samples * cycles * cycle_pj / bits);
            let filter_pj = samples * cycles * logic * build.value(Constant::DecimatorBit);
            build.pj(digital, bit, Constant::DecimatorBit, filter_pj);
        }
        Architecture::InPixel => {
            let bias_mw = 1e-3 * build.value(Constant::PixelComparator) * supply_v * f64_from_u64(sensor.pixels);
            build.mw(analog, Constant::PixelComparator, build.bias_share(), bias_mw);
            build.pj(digital, bit, Constant::PixelMemoryBit, samples * logic * build.value(Constant::PixelMemoryBit));
        }
        Architecture::MultiColumn => {
            let stage_pj = build.value(Constant::SharedBit) * supply_v / RAMP_NOMINAL_V;
            build.pj(analog, bit, Constant::SharedBit, samples * stage_pj);
        }
    }
}

fn single_slope(build: &mut ItemBuilder<'_>) {
    let (sensor, supply_v) = (build.sensor, build.sensor.supply_v);
    let (analog, digital) = ((Block::Adc, Rail::Analog), (Block::Adc, Rail::Digital));
    let (columns, logic) = (f64::from(sensor.columns) / NOMINAL_COLUMNS, build.logic_factor());
    // A comparator's bandwidth is that of its clock, and so is its bias. It flows between ramps too, whatever the picture.
    let charge_fc = build.value(Constant::ComparatorCharge) * build.bias_class();
    let charge_mw = 1e-12 * charge_fc * f64_from_u64(sensor.adc.clock_hz) * supply_v;
    let all_mw = charge_mw * f64::from(sensor.converters());
    build.mw(analog, Constant::ComparatorCharge, build.bias_share(), all_mw);
    let ramp_pj = build.value(Constant::RampStep) * columns * supply_v / RAMP_NOMINAL_V;
    build.pj(analog, Amount::Event(Event::RampStep), Constant::RampStep, ramp_pj);
    let gate_pj = logic * build.value(Constant::ComparatorClock);
    build.pj(digital, Amount::Event(Event::ComparatorClock), Constant::ComparatorClock, gate_pj);
    let (step, of) = match sensor.adc.counter {
        Counter::Binary => (Event::CounterStep, Constant::CounterStep),
        Counter::Gray => (Event::GrayCounterStep, Constant::GrayCounterStep),
    };
    build.pj(digital, Amount::Event(step), of, logic * build.value(of));
    if sensor.adc.counting == Counting::Latch {
        let line_pj = logic * columns * build.value(Constant::CountLineToggle);
        build.pj(digital, Amount::Event(Event::CountLineToggle), Constant::CountLineToggle, line_pj);
        let latch_pj = logic * build.value(Constant::CountLatchBit);
        build.pj(digital, Amount::Event(Event::CountLatchBit), Constant::CountLatchBit, latch_pj);
    }
}
