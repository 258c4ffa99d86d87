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
pub fn sampling(parameters: &Parameters) -> SampleTiming {
    let adc = &parameters.adc;
    let samples = adc.cds.samples();
    if !samples.is_double() {
        return SampleTiming { samples, interval_s: 0.0 };
    }
    let reset_s = f64::from(adc.reset_counts_used()) / f64_from_u64(adc.clock_hz);
    SampleTiming { samples, interval_s: reset_s + 1e-6 * adc.settle_signal_us }
}

/// All effects in the order in which light and charge meet them.
pub const ALL: &[EffectEntry] = &[
    EffectEntry {
        name: "prnu",
        summary: "response differs from pixel to pixel, a pattern of the die",
        build: |parameters| pixel::Prnu::from_params(&parameters.pixel),
    },
    EffectEntry {
        name: "parasitic_light",
        summary: "light on the storage node while a row waits for readout",
        build: |parameters| pixel::ParasiticLight::from_params(&parameters.pixel),
    },
    EffectEntry {
        name: "dead_pixels",
        summary: "pixels of the die that see no light",
        build: |parameters| pixel::DeadPixels::from_params(&parameters.pixel),
    },
    EffectEntry {
        name: "shot_noise",
        summary: "photoelectrons are counted: exact Poisson",
        build: |parameters| pixel::ShotNoise::from_params(&parameters.pixel),
    },
    EffectEntry {
        name: "dark_current",
        summary: "thermal electrons over exposure and storage, with their own Poisson draw",
        build: |parameters| pixel::DarkCurrent::from_params(&parameters.pixel),
    },
    EffectEntry {
        name: "hot_pixels",
        summary: "pixels of the die with additional dark current",
        build: |parameters| pixel::HotPixels::from_params(&parameters.pixel),
    },
    EffectEntry {
        name: "dsnu",
        summary: "dark signal differs from pixel to pixel, a pattern of the die",
        build: |parameters| pixel::Dsnu::from_params(&parameters.pixel),
    },
    EffectEntry {
        name: "blooming",
        summary: "charge beyond the well spills into neighbours",
        build: |parameters| pixel::Blooming::from_params(&parameters.pixel),
    },
    EffectEntry {
        name: "image_lag",
        summary: "charge stays behind the transfer gate and is read with the next frame",
        build: |parameters| pixel::ImageLag::from_params(&parameters.pixel),
    },
    EffectEntry {
        name: "full_well",
        summary: "charge beyond the well is lost",
        build: |parameters| pixel::FullWell::from_params(&parameters.pixel),
    },
    EffectEntry {
        name: "storage_leakage",
        summary: "stored charge leaks away while a row waits for readout",
        build: |parameters| pixel::StorageLeakage::from_params(&parameters.pixel),
    },
    EffectEntry {
        name: "gain_compression",
        summary: "conversion gain falls as the well fills",
        build: |parameters| pixel::GainCompression::from_params(&parameters.pixel),
    },
    EffectEntry {
        name: "die_gain",
        summary: "conversion gain differs from die to die",
        build: |parameters| pixel::DieGain::from_params(&parameters.pixel),
    },
    EffectEntry {
        name: "rts_noise",
        summary: "traps of source followers switch between two states",
        build: |parameters| pixel::RtsNoise::from_params(&parameters.pixel, sampling(parameters)),
    },
    EffectEntry {
        name: "flicker_noise",
        summary: "source follower 1/f noise through the sampling",
        build: |parameters| pixel::flicker_noise(&parameters.pixel, sampling(parameters)),
    },
    EffectEntry {
        name: "ktc_noise",
        summary: "reset noise that double sampling does not remove",
        build: |parameters| pixel::ktc_noise(&parameters.pixel, parameters.adc.cds.samples()),
    },
    EffectEntry {
        name: "read_noise",
        summary: "source follower and column noise after double sampling",
        build: |parameters| pixel::read_noise(&parameters.pixel, parameters.adc.cds.samples()),
    },
    EffectEntry {
        name: "column_settling",
        summary: "a column line that has not reached its signal when it is sampled",
        build: |parameters| adc::ColumnSettling::from_params(&parameters.adc, &parameters.pixel),
    },
    EffectEntry {
        name: "stuck_pixels",
        summary: "pixels of the die at the bottom or the top of the range",
        build: |parameters| pixel::StuckPixels::from_params(&parameters.pixel),
    },
    EffectEntry {
        name: "column_gain",
        summary: "gain differs from column to column, a pattern of the die",
        build: |parameters| adc::ColumnGain::from_params(&parameters.adc),
    },
    EffectEntry {
        name: "die_offset",
        summary: "black level differs from die to die",
        build: |parameters| pixel::DieOffset::from_params(&parameters.pixel),
    },
    EffectEntry {
        name: "column_offset",
        summary: "offset differs from column to column, what double sampling leaves of it",
        build: |parameters| adc::ColumnOffset::from_params(&parameters.adc),
    },
    EffectEntry {
        name: "column_noise",
        summary: "noise that all rows of a column share in a frame",
        build: |parameters| adc::column_noise(&parameters.adc),
    },
    EffectEntry {
        name: "row_noise",
        summary: "noise that all columns of a row share in a frame",
        build: |parameters| adc::row_noise(&parameters.adc),
    },
    EffectEntry {
        name: "row_offset",
        summary: "offset differs from row to row, a pattern of the die",
        build: |parameters| adc::row_offset(&parameters.adc),
    },
    EffectEntry {
        name: "comparator_noise",
        summary: "decision noise of the comparator, a draw a conversion and column",
        build: |parameters| adc::comparator_noise(&parameters.adc),
    },
    EffectEntry {
        name: "ramp_noise",
        summary: "noise of the ramp, a draw a conversion for all columns",
        build: |parameters| adc::ramp_noise(&parameters.adc),
    },
    EffectEntry {
        name: "ramp_jitter",
        summary: "jitter of the ramp's clock times the slope at each crossing",
        build: |parameters| adc::RampJitter::from_params(&parameters.adc),
    },
    EffectEntry {
        name: "supply_ripple",
        summary: "a sine on the supply at the time of each crossing: bands",
        build: |parameters| adc::SupplyRipple::from_params(&parameters.adc),
    },
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
