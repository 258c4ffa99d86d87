//! Photodiode, transfer gate and conversion gain. Converts mean photons to microvolts at the column.
//!
//! The two structural steps (`photons_to_mean_electrons`, `electrons_to_microvolts`) always run; everything else is an
//! effect that a scene may or may not call for.

mod blooming;
mod dark_current;
mod dark_rates;
mod dead_pixels;
mod defect_sites;
mod defects;
mod die;
mod die_gain;
mod die_offset;
mod dsnu;
mod flicker_noise;
mod full_well;
mod gain_compression;
mod hot_pixels;
mod image_lag;
mod ktc_noise;
mod parasitic_light;
mod params;
mod pattern;
mod prnu;
mod read_noise;
mod row;
mod row_memory;
mod rts_noise;
mod sample_noise;
mod shot_noise;
mod storage_leakage;
mod stuck_pixels;
mod thinning;
mod well_bias;

pub use blooming::{Blooming, spill_slope_max};
pub use dark_current::DarkCurrent;
pub use dead_pixels::DeadPixels;
pub use defects::{Defect, DefectKind, defects};
pub use die_gain::{DieGain, die_gain_max};
pub use die_offset::DieOffset;
pub use dsnu::Dsnu;
pub use flicker_noise::{flicker_noise, flicker_variance_uv2};
pub use full_well::{FullWell, saturated_from_e};
pub use gain_compression::{GainCompression, compressed_slope_min};
pub use hot_pixels::HotPixels;
pub use image_lag::ImageLag;
pub use ktc_noise::{ktc_noise, ktc_sigmas};
#[cfg(test)]
pub(crate) use params::tests as params_tests;
pub use params::{PixelParams, PixelType};
pub use parasitic_light::{ParasiticLight, parasitic_share};
pub use pattern::Pattern;
pub use prnu::Prnu;
pub use read_noise::read_noise;
pub use row::{add_scaled, add_to_all, scale_all, scale_by_pattern};
pub use rts_noise::RtsNoise;
pub use sample_noise::{SampleNoise, SampleSigmas, SampleTiming, SampledLevels};
pub use shot_noise::ShotNoise;
pub use storage_leakage::StorageLeakage;
pub use stuck_pixels::StuckPixels;

use crate::facts::DieSpread;
use crate::num::{f32_nearest, greater};
use crate::units::{CameraIndex, Size};

/// What holds for every die that a draw can give.
pub const ANY_DIE: DieSpread = DieSpread {
    gain_sigmas: die::NORMAL_MAX,
    offset_sigmas: die::NORMAL_MAX,
    dark_sigmas: die::NORMAL_MAX,
    hottest: die::EXPONENTIAL_MAX,
};

/// How far the dies of a rig of so many cameras lie from the mean of all dies, by their own draws.
pub fn die_spread(params: &PixelParams, die_seed: u64, cameras: u32, array: Size) -> DieSpread {
    let none = DieSpread { gain_sigmas: 0.0, offset_sigmas: 0.0, dark_sigmas: f64::NEG_INFINITY, hottest: 0.0 };
    (0..cameras).fold(none, |spread, camera| {
        let die = die::Die { seed: die_seed, camera: CameraIndex(camera) };
        DieSpread {
            gain_sigmas: greater(spread.gain_sigmas, die.deviation(DieGain::NUMBER).abs()),
            offset_sigmas: greater(spread.offset_sigmas, die.deviation(DieOffset::NUMBER).abs()),
            dark_sigmas: greater(spread.dark_sigmas, die.deviation(die::DARK_NUMBER)),
            hottest: greater(spread.hottest, hot_pixels::hottest(params, die, array)),
        }
    })
}

/// Mean of the dark charge of all pixels, and its mean square, in electrons, on that one of these dies that draws the most.
pub fn dark_charge_e(params: &PixelParams, exposure_s: f64, storage_s: f64, dies: DieSpread) -> (f64, f64) {
    let rates = dark_rates::DarkRates::of(params);
    let mean_e = rates.mean_e(exposure_s, storage_s, dies);
    let spread_e = rates.dcnu * mean_e;
    // An exponential of mean m has the mean square 2 m^2.
    let (hot_share, hot_e) = (1e-6 * params.hot_ppm, rates.hot_mean_e(exposure_s, storage_s, dies));
    (
        mean_e + hot_share * hot_e,
        mean_e * mean_e + spread_e * spread_e + mean_e + hot_share * (hot_e + 2.0 * hot_e * (hot_e + mean_e)),
    )
}

/// Turns mean photons on the pixel into mean photoelectrons, in place: quantum efficiency times fill factor.
pub fn photons_to_mean_electrons(params: &PixelParams, values: &mut [f32]) {
    scale_all(values, f32_nearest(params.quantum_efficiency * params.fill_factor));
}

/// Turns electrons into microvolts at the ADC's input, in place; a brighter pixel is a greater value.
pub fn electrons_to_microvolts(params: &PixelParams, values: &mut [f32]) {
    scale_all(values, f32_nearest(params.conversion_gain_uv_per_e));
}

#[cfg(test)]
mod tests {
    use super::params::tests::paper_pixel;
    use super::well_bias::tests::facts;
    use super::*;
    use crate::draw::RowId;
    use crate::effect::{Effect, KeptKeys, RowPass};
    use crate::facts::Facts;
    use crate::units::{CameraIndex, FrameIndex, RowIndex};

    const WIDTH: usize = 40_000;

    /// The pixel's effects that the parameters leave possible, in physical order.
    fn effects(params: &PixelParams) -> Vec<Box<dyn Effect>> {
        let all = [
            Prnu::from_params(params),
            ShotNoise::from_params(params),
            DarkCurrent::from_params(params),
            Dsnu::from_params(params),
            FullWell::from_params(params),
            ktc_noise(params, SampledLevels::Difference),
            read_noise(params, SampledLevels::Difference),
        ];
        all.into_iter().flatten().collect()
    }

    /// A row of equal values after one effect.
    fn after(effect: &dyn Effect, value: f32, exposure_s: f64, (seed, frame, row): (u64, u32, u32)) -> Vec<f64> {
        let (mut values, mut uniforms, mut draws) = (vec![value; WIDTH], vec![0; WIDTH], vec![0.0; WIDTH]);
        let (camera, frame, row) = (CameraIndex(0), FrameIndex(frame), RowIndex(row));
        effect.apply(&mut RowPass {
            row_id: RowId { seed, camera, frame, slot: 0, row },
            die_seed: 2,
            exposure_s,
            storage_s: 0.0,
            readout_s: 0.0,
            values: &mut values,
            reset: &mut [],
            uniforms: &mut uniforms,
            draws: &mut draws,
            keys: &KeptKeys::default(),
            saturated_from_e: f32::INFINITY,
            idle_px: 0,
        });
        values.into_iter().map(f64::from).collect()
    }

    fn mean_and_variance(values: &[f64]) -> (f64, f64) {
        let mean = values.iter().sum::<f64>() / 4e4;
        (mean, values.iter().map(|value| (value - mean) * (value - mean)).sum::<f64>() / 4e4)
    }

    /// 5 standard errors of the mean (sigma / 200) and of the variance (0.7 %, near normal): a false alarm in 1e6.
    #[test]
    fn each_effect_adds_the_mean_and_variance_of_its_model() {
        let params = PixelParams { pixel_type: PixelType::T3, full_well_e: 1200.0, ..paper_pixel() };
        let ktc_uv2 = 2.0 * params.ktc_of_one_reset_uv() * params.ktc_of_one_reset_uv();
        let expected = [
            ("prnu", 1000.0, 100.0),
            ("shot_noise", 1000.0, 1000.0),
            ("dark_current", 1100.0, 100.0),
            ("dsnu", 1000.0, 1.0),
            ("full_well", 1000.0, 0.0),
            ("ktc_noise", 1000.0, ktc_uv2),
            ("read_noise", 1000.0, 1e4),
        ];
        let effects = effects(&params);
        assert_eq!(effects.len(), expected.len());
        for (effect, (name, mean, variance)) in effects.iter().zip(expected) {
            let found = mean_and_variance(&after(effect.as_ref(), 1000.0, 10.0, (1, 4, 7)));
            assert_eq!(effect.name(), name);
            assert!((found.0 - mean).abs() <= 5.0 * (variance / 4e4_f64).sqrt(), "{name}: mean {} for {mean}", found.0);
            assert!((found.1 - variance).abs() <= 0.036 * variance, "{name}: variance {} for {variance}", found.1);
        }
        assert!(effects.is_sorted_by_key(|effect| effect.domain()), "effects are in physical order");
    }

    #[test]
    fn an_effect_without_its_parameter_is_not_built() {
        let quiet =
            PixelParams { prnu: 0.0, dsnu_e: 0.0, dark_current_e_per_s: 0.0, read_noise_uv: 0.0, ..paper_pixel() };
        let names: Vec<_> = effects(&quiet).iter().map(|effect| effect.name()).collect();
        assert_eq!(names, ["shot_noise", "full_well"]);
    }

    #[test]
    fn the_spread_of_a_rigs_dies_is_that_of_their_own_draws() {
        let params = PixelParams { hot_ppm: 1000.0, hot_dark_e_per_s: 100.0, ..paper_pixel() };
        let array = Size { width_px: 320, height_px: 64 };
        let mut hottest = 0.0_f64;
        for seed in 0..20 {
            let [one, two] = [1, 2].map(|cameras| die_spread(&params, seed, cameras, array));
            for (one, two, any) in [
                (one.gain_sigmas, two.gain_sigmas, ANY_DIE.gain_sigmas),
                (one.offset_sigmas, two.offset_sigmas, ANY_DIE.offset_sigmas),
                (one.dark_sigmas, two.dark_sigmas, ANY_DIE.dark_sigmas),
                (one.hottest, two.hottest, ANY_DIE.hottest),
            ] {
                assert!(one <= two && two <= any, "seed {seed}: {one}, {two}, {any}");
            }
            hottest += one.hottest / 20.0;
        }
        // 20.5 hot pixels a die: the greatest of n exponentials has the mean 1 + 1/2 + ... + 1/n, 3.6, and the sigma 1.26; 4.5 of it over
        // 20 dies are 1.3.
        assert!((hottest - 3.6).abs() < 1.3, "{hottest}");
        let large = Size { width_px: 1024, height_px: 1024 };
        assert_eq!(die_spread(&params, 1, 1, large).hottest, ANY_DIE.hottest, "a large array is not searched");
        let none = PixelParams { hot_ppm: 0.0, ..params };
        assert_eq!(die_spread(&none, 1, 1, array).hottest, 0.0);
    }

    #[test]
    fn the_full_well_bound_covers_what_clipping_changes_on_both_sides_of_the_well() {
        let params =
            PixelParams { full_well_e: 1000.0, prnu: 0.0, dsnu_e: 0.0, dark_current_e_per_s: 0.0, ..paper_pixel() };
        let (well, shot) = (FullWell::from_params(&params).unwrap(), ShotNoise::from_params(&params).unwrap());
        for mean_e in [0.0_f32, 500.0, 850.0, 950.0, 1000.0, 1500.0] {
            let charge_e = after(shot.as_ref(), mean_e, 0.0, (9, 0, 0));
            let lost: Vec<f64> = charge_e.iter().map(|value| (value - 1000.0).max(0.0)).collect();
            let (mean, variance) = mean_and_variance(&lost);
            let facts = Facts { signal_e_min: 0.0, ..facts(mean_e.into()) };
            let bound = well.omission(&facts).unwrap();
            assert!(
                mean <= bound.bias_e && variance <= 1.036 * bound.variance_e2,
                "mean {mean_e}: {mean}, {variance}, {bound:?}"
            );
            assert!(mean_e > 600.0 || bound.bias_e < 1e-6, "far from the well nothing is lost: {bound:?}");
        }
    }
}
