//! The one list of effects between photons and codes, in physical order; the planner that selects from it; and the chain that applies the
//! selected effects to rows.

pub mod chain;
pub mod costs;
pub mod plan;
pub mod regions;
pub mod variation;

use crate::adc::{self, AdcParams};
use crate::effect::Effect;
use crate::num::f64_from_u64;
use crate::pixel::{self, PixelParams, SampleTiming};

/// What effects are made from.
#[derive(Clone, Debug)]
pub struct Parameters {
    /// Photodiode to column line.
    pub pixel: PixelParams,
    /// Column converters.
    pub adc: AdcParams,
}

/// A member of the list.
pub struct EffectEntry {
    /// The effect's one name.
    pub name: &'static str,
    /// What it models, in one line; its file has the equation and the source.
    pub summary: &'static str,
    /// The effect, or none where its parameter is zero or the pixel does not have it.
    pub build: fn(&Parameters) -> Option<Box<dyn Effect>>,
}

/// The samples with the time between them: the interval between reset and signal sample is the rest of the reset conversion, if any, plus
/// the settling time of the signal. The ramp is taken to cross both levels at one height, as in a dark pixel; it crosses a bright one up
/// to a ramp later.
pub fn sample_timing(parameters: &Parameters) -> SampleTiming {
    let adc = &parameters.adc;
    let samples = adc.cds.samples();
    if !samples.is_double() {
        return SampleTiming { samples, interval_s: 0.0 };
    }
    let reset_s = f64::from(adc.reset_counts_used()) / f64_from_u64(adc.clock_hz);
    SampleTiming { samples, interval_s: reset_s + 1e-6 * adc.settle_signal_us }
}

const fn entry(
    name: &'static str,
    summary: &'static str,
    build: fn(&Parameters) -> Option<Box<dyn Effect>>,
) -> EffectEntry {
    EffectEntry { name, summary, build }
}

/// All effects in the order in which light and charge meet them.
pub const ALL: &[EffectEntry] = &[
    entry("prnu", "response differs from pixel to pixel, a pattern of the die", |parameters| {
        pixel::Prnu::from_params(&parameters.pixel)
    }),
    entry("parasitic_light", "light on the storage node while a row waits for readout", |parameters| {
        pixel::ParasiticLight::from_params(&parameters.pixel)
    }),
    entry("dead_pixels", "pixels of the die that see no light", |parameters| {
        pixel::DeadPixels::from_params(&parameters.pixel)
    }),
    entry("shot_noise", "photoelectrons are counted: exact Poisson", |parameters| {
        pixel::ShotNoise::from_params(&parameters.pixel)
    }),
    entry("dark_current", "thermal electrons over exposure and storage, with their own Poisson draw", |parameters| {
        pixel::DarkCurrent::from_params(&parameters.pixel)
    }),
    entry("hot_pixels", "pixels of the die with additional dark current", |parameters| {
        pixel::HotPixels::from_params(&parameters.pixel)
    }),
    entry("dsnu", "dark signal differs from pixel to pixel, a pattern of the die", |parameters| {
        pixel::Dsnu::from_params(&parameters.pixel)
    }),
    entry("blooming", "charge beyond the well spills into neighbours", |parameters| {
        pixel::Blooming::from_params(&parameters.pixel)
    }),
    entry("image_lag", "charge stays behind the transfer gate and is read with the next frame", |parameters| {
        pixel::ImageLag::from_params(&parameters.pixel)
    }),
    entry("full_well", "charge beyond the well is lost", |parameters| pixel::FullWell::from_params(&parameters.pixel)),
    entry("storage_leakage", "stored charge leaks away while a row waits for readout", |parameters| {
        pixel::StorageLeakage::from_params(&parameters.pixel)
    }),
    entry("gain_compression", "conversion gain falls as the well fills", |parameters| {
        pixel::GainCompression::from_params(&parameters.pixel)
    }),
    entry("die_gain", "conversion gain differs from die to die", |parameters| {
        pixel::DieGain::from_params(&parameters.pixel)
    }),
    entry("rts_noise", "traps of source followers switch between two states", |parameters| {
        pixel::RtsNoise::from_params(&parameters.pixel, sample_timing(parameters))
    }),
    entry("flicker_noise", "source follower 1/f noise through the sampling", |parameters| {
        pixel::flicker_noise(&parameters.pixel, sample_timing(parameters))
    }),
    entry("ktc_noise", "reset noise that double sampling does not remove", |parameters| {
        pixel::ktc_noise(&parameters.pixel, parameters.adc.cds.samples())
    }),
    entry("read_noise", "source follower and column noise after double sampling", |parameters| {
        pixel::read_noise(&parameters.pixel, parameters.adc.cds.samples())
    }),
    entry("column_settling", "a column line that has not reached its signal when it is sampled", |parameters| {
        adc::ColumnSettling::from_params(&parameters.adc, &parameters.pixel)
    }),
    entry("stuck_pixels", "pixels of the die at the bottom or the top of the range", |parameters| {
        pixel::StuckPixels::from_params(&parameters.pixel)
    }),
    entry("column_gain", "gain differs from column to column, a pattern of the die", |parameters| {
        adc::ColumnGain::from_params(&parameters.adc)
    }),
    entry("die_offset", "black level differs from die to die", |parameters| {
        pixel::DieOffset::from_params(&parameters.pixel)
    }),
    entry("column_offset", "offset differs from column to column, what double sampling leaves of it", |parameters| {
        adc::ColumnOffset::from_params(&parameters.adc)
    }),
    entry("column_noise", "noise that all rows of a column share in a frame", |parameters| {
        adc::column_noise(&parameters.adc)
    }),
    entry("row_noise", "noise that all columns of a row share in a frame", |parameters| {
        adc::row_noise(&parameters.adc)
    }),
    entry("row_offset", "offset differs from row to row, a pattern of the die", |parameters| {
        adc::row_offset(&parameters.adc)
    }),
    entry("comparator_noise", "decision noise of the comparator, a draw per conversion and column", |parameters| {
        adc::comparator_noise(&parameters.adc)
    }),
    entry("ramp_noise", "noise of the ramp, a draw per conversion for all columns", |parameters| {
        adc::ramp_noise(&parameters.adc)
    }),
    entry("ramp_jitter", "jitter of the ramp's clock times the slope at each crossing", |parameters| {
        adc::RampJitter::from_params(&parameters.adc)
    }),
    entry("supply_ripple", "a sine on the supply at the time of each crossing: bands", |parameters| {
        adc::SupplyRipple::from_params(&parameters.adc)
    }),
];

/// Names of all effects, in physical order.
pub fn names() -> Vec<&'static str> {
    ALL.iter().map(|entry| entry.name).collect()
}

/// The effects that these parameters have, in physical order.
pub fn build_all(parameters: &Parameters) -> Vec<Box<dyn Effect>> {
    ALL.iter().filter_map(|entry| (entry.build)(parameters)).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn no_name_of_an_effect_is_listed_twice() {
        let names = names();
        for (index, name) in names.iter().enumerate() {
            assert!(!names[..index].contains(name), "{name} is listed twice");
        }
    }
}
