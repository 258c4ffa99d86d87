//! Parameters of a pixel: checks the values of a config and derives what follows from them.

use crate::error::{Error, within};
use crate::text::named;
use crate::units::{BOLTZMANN_J_PER_K, ELEMENTARY_CHARGE_C};

named! {
    /// How a pixel resets, transfers and stores; the name counts its transistors.
    pub enum PixelType {
        /// No transfer gate: reset and signal levels belong to different resets.
        T3 = "3T",
        /// Transfer gate: reset and signal levels belong to the same reset.
        T4 = "4T",
        /// Global shutter that stores on the floating diffusion: levels belong to different resets.
        T5 = "5T",
        /// Global shutter that stores charge behind a second gate: levels belong to the same reset.
        T6 = "6T",
    }
}

impl PixelType {
    /// Gates that move charge between light and column, each once a frame.
    pub fn transfers(self) -> u64 {
        match self {
            Self::T3 => 0,
            Self::T4 | Self::T5 => 1,
            Self::T6 => 2,
        }
    }

    /// Whether the reset level that double sampling subtracts is the one under the signal.
    pub fn is_correlated(self) -> bool {
        match self {
            Self::T3 | Self::T5 => false,
            Self::T4 | Self::T6 => true,
        }
    }
}

/// What a pixel is. `check` says whether the values are in range.
#[derive(Clone, Debug, PartialEq)]
pub struct PixelParams {
    /// How the pixel resets, transfers and stores.
    pub pixel_type: PixelType,
    /// Distance between pixel centres in um, 0.001 to 100. Datasheet.
    pub pitch_um: f64,
    /// Photoelectrons per photon on the photodiode, 0 to 1. Datasheet; EMVA 1288 gives its product with the fill factor.
    pub quantum_efficiency: f64,
    /// Share of the pixel's light that meets the photodiode, micro-lens included, 1e-6 to 1. Datasheet.
    pub fill_factor: f64,
    /// Conversion gain at the ADC's input in uV/e-, 0.001 to 1000. Datasheet or photon transfer.
    pub conversion_gain_uv_per_e: f64,
    /// Charge at which the pixel clips in e-, 1 to 1e9. EMVA 1288 saturation capacity.
    pub full_well_e: f64,
    /// Dark current at 300 K in e-/s, 0 to 1e9. EMVA 1288 dark current.
    pub dark_current_e_per_s: f64,
    /// Warming in K that doubles the dark current, 0.001 to 100; 8 for silicon near room temperature.
    pub dark_doubling_k: f64,
    /// Temperature of the die in K, 0 to 450. Dark current and kTC noise vanish at 0 K; carriers are not taken to freeze out.
    pub temperature_k: f64,
    /// Sigma of the read noise in uV at the ADC's input, after double sampling, 0 to 1e6. EMVA 1288 temporal dark noise.
    pub read_noise_uv: f64,
    /// Sigma of one reset's kTC noise in uV at the ADC's input, 0 to 1e6; `None`: from the conversion gain.
    pub ktc_noise_uv: Option<f64>,
    /// Sigma of the photo response relative to its mean, 0 to 0.15 (a normal draw of 6.4 sigma stays positive). EMVA 1288.
    pub prnu: f64,
    /// Sigma of the dark signal between pixels in e-, 0 to 1e6. EMVA 1288.
    pub dsnu_e: f64,
    /// Sigma of the dark current over pixels relative to its mean (lognormal), 0 to 2.
    pub dcnu: f64,
    /// Dark current of the storage node at 300 K in e-/s, 0 to 1e9; not written: as the photodiode's.
    pub storage_dark_e_per_s: Option<f64>,
    /// Share of the stored charge that leaks away in a second of waiting, 0 to 100 (global shutter).
    pub storage_leakage_per_s: f64,
    /// Response of the storage node to light relative to the photodiode's (1 / parasitic light sensitivity), 0 to 1.
    pub parasitic_light: f64,
    /// Pixels with random telegraph noise in parts per million, 0 to 1e6.
    pub rts_ppm: f64,
    /// Mean amplitude of their trap in uV at the ADC's input, 0 to 1e6 (exponentially distributed).
    pub rts_amplitude_uv: f64,
    /// Mean rate of capture and of emission of a trap in Hz, 1e-6 to 1e9.
    pub rts_rate_hz: f64,
    /// Source follower's 1/f noise at 1 Hz in uV/sqrt(Hz) at the ADC's input, 0 to 1e6.
    pub flicker_uv_per_rthz: f64,
    /// Bandwidth of source follower and column in Hz, 1e3 to 1e10.
    pub follower_bandwidth_hz: f64,
    /// Share of the conversion gain that is lost at full well, 0 to 0.5: v = g N (1 - c N / full well).
    pub gain_compression: f64,
    /// Share of the charge beyond the full well that spills into the four neighbours instead of the drain, 0 to 1.
    pub blooming: f64,
    /// Share of the charge that stays behind the transfer gate and is read with the next frame, 0 to 0.5.
    pub image_lag: f64,
    /// Hot pixels in parts per million, 0 to 1e5.
    pub hot_ppm: f64,
    /// Mean dark current of hot pixels at 300 K in e-/s, 0 to 1e9 (exponentially distributed).
    pub hot_dark_e_per_s: f64,
    /// Pixels that see no light in parts per million, 0 to 1e5.
    pub dead_ppm: f64,
    /// Pixels stuck at the bottom or the top of the range in parts per million, 0 to 1e5.
    pub stuck_ppm: f64,
    /// Share of defects that take their 2x2 neighbourhood with them, 0 to 1.
    pub defect_cluster_share: f64,
    /// The lower of two conversion gains in uV/e-, 0.001 to the higher one; not written: one gain only.
    pub low_conversion_gain_uv_per_e: Option<f64>,
    /// Capacity of the lateral overflow capacitor in e- beyond the full well, 0 to 1e9; read at the lower gain.
    pub overflow_capacity_e: f64,
    /// Sigma of the conversion gain from die to die relative to its mean, 0 to 0.15.
    pub die_gain_sigma: f64,
    /// Sigma of the black level from die to die in uV, 0 to 1e6.
    pub die_offset_uv: f64,
    /// Sigma of the logarithm of the dark current from die to die, 0 to 3.
    pub die_dark_sigma: f64,
}

/// Dark current beyond which no sensor is one: it fills the greatest full well in a millisecond.
const DARK_NOW_E_PER_S_MAX: f64 = 1e12;

/// Gain of the source follower between floating diffusion and column.
pub const SOURCE_FOLLOWER_GAIN: f64 = 0.85;

/// Least conversion gain. Below it noise in electrons leaves all meaning.
const GAIN_UV_PER_E_MIN: f64 = 0.001;

impl PixelParams {
    /// Refuses values out of range, naming key, value and an accepted value.
    pub fn check(&self) -> Result<(), Error> {
        within("sensor.pixel.pitch_um", self.pitch_um, 0.001, 100.0)?;
        within("sensor.pixel.quantum_efficiency", self.quantum_efficiency, 0.0, 1.0)?;
        within("sensor.pixel.fill_factor", self.fill_factor, 1e-6, 1.0)?;
        within("sensor.pixel.conversion_gain_uv_per_e", self.conversion_gain_uv_per_e, GAIN_UV_PER_E_MIN, 1000.0)?;
        within("sensor.pixel.full_well_e", self.full_well_e, 1.0, 1e9)?;
        within("sensor.pixel.dark_current_e_per_s", self.dark_current_e_per_s, 0.0, 1e9)?;
        within("sensor.pixel.dark_doubling_k", self.dark_doubling_k, 0.001, 100.0)?;
        within("sensor.temperature_k", self.temperature_k, 0.0, 450.0)?;
        within("sensor.pixel.read_noise_uv", self.read_noise_uv, 0.0, 1e6)?;
        within("sensor.pixel.ktc_noise_uv", self.ktc_noise_uv.unwrap_or(0.0), 0.0, 1e6)?;
        within("sensor.pixel.prnu", self.prnu, 0.0, 0.15)?;
        within("sensor.pixel.dsnu_e", self.dsnu_e, 0.0, 1e6)?;
        self.check_rarer()
    }

    /// The same for what most sensors leave at zero.
    fn check_rarer(&self) -> Result<(), Error> {
        within("sensor.pixel.dcnu", self.dcnu, 0.0, 2.0)?;
        within("sensor.pixel.storage_dark_e_per_s", self.storage_dark_e_per_s.unwrap_or(0.0), 0.0, 1000000000.0)?;
        within("sensor.pixel.storage_leakage_per_s", self.storage_leakage_per_s, 0.0, 100.0)?;
        within("sensor.pixel.parasitic_light", self.parasitic_light, 0.0, 1.0)?;
        within("sensor.pixel.rts_ppm", self.rts_ppm, 0.0, 1000000.0)?;
        within("sensor.pixel.rts_amplitude_uv", self.rts_amplitude_uv, 0.0, 1000000.0)?;
        within("sensor.pixel.rts_rate_hz", self.rts_rate_hz, 1e-6, 1000000000.0)?;
        within("sensor.pixel.flicker_uv_per_rthz", self.flicker_uv_per_rthz, 0.0, 1000000.0)?;
        within("sensor.pixel.follower_bandwidth_hz", self.follower_bandwidth_hz, 1000.0, 10000000000.0)?;
        within("sensor.pixel.gain_compression", self.gain_compression, 0.0, 0.5)?;
        within("sensor.pixel.blooming", self.blooming, 0.0, 1.0)?;
        within("sensor.pixel.image_lag", self.image_lag, 0.0, 0.5)?;
        within("sensor.pixel.hot_ppm", self.hot_ppm, 0.0, 100000.0)?;
        within("sensor.pixel.hot_dark_e_per_s", self.hot_dark_e_per_s, 0.0, 1000000000.0)?;
        within("sensor.pixel.dead_ppm", self.dead_ppm, 0.0, 100000.0)?;
        within("sensor.pixel.stuck_ppm", self.stuck_ppm, 0.0, 100000.0)?;
        within("sensor.pixel.defect_cluster_share", self.defect_cluster_share, 0.0, 1.0)?;
        if let Some(low) = self.low_conversion_gain_uv_per_e {
            let key = "sensor.pixel.low_conversion_gain_uv_per_e";
            within(key, low, GAIN_UV_PER_E_MIN, self.conversion_gain_uv_per_e)?;
        }
        within("sensor.pixel.overflow_capacity_e", self.overflow_capacity_e, 0.0, 1000000000.0)?;
        within("sensor.die_gain_sigma", self.die_gain_sigma, 0.0, 0.15)?;
        within("sensor.die_offset_uv", self.die_offset_uv, 0.0, 1e6)?;
        within("sensor.die_dark_sigma", self.die_dark_sigma, 0.0, 3.0)?;
        self.check_dark_now()
    }

    /// Refuses a doubling step so short that the rates at the die's temperature become meaningless.
    fn check_dark_now(&self) -> Result<(), Error> {
        let rates = [self.dark_current_e_per_s, self.storage_dark_e_per_s.unwrap_or(0.0), self.hot_dark_e_per_s];
        if rates.into_iter().all(|rate_e_per_s| self.at_temperature(rate_e_per_s) <= DARK_NOW_E_PER_S_MAX) {
            return Ok(());
        }
        let reason = format!(
            "brings a dark current beyond {DARK_NOW_E_PER_S_MAX:e} e-/s at {} K; use a longer step or less dark current",
            self.temperature_k
        );
        Err(Error::key("sensor.pixel.dark_doubling_k", self.dark_doubling_k, reason))
    }

    /// A rate given at 300 K, at the die's temperature.
    pub fn at_temperature(&self, rate_e_per_s: f64) -> f64 {
        // A rate of 0 stays 0 where the factor overflows.
        if rate_e_per_s == 0.0 {
            return 0.0;
        }
        rate_e_per_s * libm::exp2((self.temperature_k - 300.0) / self.dark_doubling_k)
    }

    /// Dark current of the photodiode at the die's temperature in e-/s.
    pub fn dark_current_now_e_per_s(&self) -> f64 {
        self.at_temperature(self.dark_current_e_per_s)
    }

    /// Sigma of one reset's kTC noise at the ADC's input in uV: as given, else sqrt(A k T g / q).
    pub fn ktc_of_one_reset_uv(&self) -> f64 {
        self.ktc_noise_uv.unwrap_or_else(|| {
            let gain_v_per_e = self.conversion_gain_uv_per_e * 1e-6;
            let heat = BOLTZMANN_J_PER_K * self.temperature_k / ELEMENTARY_CHARGE_C;
            1e6 * (SOURCE_FOLLOWER_GAIN * heat * gain_v_per_e).sqrt()
        })
    }
}

#[cfg(test)]
pub(crate) mod tests {
    use super::*;

    /// The pixel of the default sensor.
    pub(crate) fn paper_pixel() -> PixelParams {
        PixelParams {
            pixel_type: PixelType::T6,
            pitch_um: 3.0,
            quantum_efficiency: 0.6,
            fill_factor: 0.9,
            conversion_gain_uv_per_e: 10.0,
            full_well_e: 10_000.0,
            dark_current_e_per_s: 10.0,
            dark_doubling_k: 8.0,
            temperature_k: 300.0,
            read_noise_uv: 100.0,
            ktc_noise_uv: None,
            prnu: 0.01,
            dsnu_e: 1.0,
            dcnu: 0.0,
            storage_dark_e_per_s: None,
            storage_leakage_per_s: 0.0,
            parasitic_light: 0.0,
            rts_ppm: 0.0,
            rts_amplitude_uv: 0.0,
            rts_rate_hz: 10000.0,
            flicker_uv_per_rthz: 0.0,
            follower_bandwidth_hz: 5000000.0,
            gain_compression: 0.0,
            blooming: 0.0,
            image_lag: 0.0,
            hot_ppm: 0.0,
            hot_dark_e_per_s: 0.0,
            dead_ppm: 0.0,
            stuck_ppm: 0.0,
            defect_cluster_share: 0.0,
            low_conversion_gain_uv_per_e: None,
            overflow_capacity_e: 0.0,
            die_gain_sigma: 0.0,
            die_offset_uv: 0.0,
            die_dark_sigma: 0.0,
        }
    }

    #[test]
    fn ktc_noise_follows_from_gain_and_temperature_as_the_design_says() {
        // 10 uV/e-, 300 K, A 0.85 give 469 uV, rounded to three digits.
        assert!((paper_pixel().ktc_of_one_reset_uv() - 469.0).abs() < 0.5);
        assert_eq!(PixelParams { ktc_noise_uv: Some(7.0), ..paper_pixel() }.ktc_of_one_reset_uv(), 7.0);
    }

    #[test]
    fn double_sampling_removes_ktc_only_where_both_samples_share_a_reset() {
        use crate::pixel::{SampledLevels, ktc_sigmas};
        let one_uv2 = paper_pixel().ktc_of_one_reset_uv() * paper_pixel().ktc_of_one_reset_uv();
        let resets = |pixel_type, samples| {
            let variance_uv2 = ktc_sigmas(&PixelParams { pixel_type, ..paper_pixel() }, samples).variance_uv2();
            (variance_uv2 / one_uv2).round()
        };
        for samples in [SampledLevels::Difference, SampledLevels::Both] {
            assert_eq!(PixelType::ALL.map(|kind| resets(kind, samples)), [2.0, 0.0, 2.0, 0.0]);
        }
        assert_eq!(PixelType::ALL.map(|kind| resets(kind, SampledLevels::Signal)), [1.0; 4]);
    }

    #[test]
    fn dark_current_doubles_every_doubling_step() {
        let warm = PixelParams { temperature_k: 316.0, ..paper_pixel() };
        assert_eq!(warm.dark_current_now_e_per_s(), 40.0);
    }

    #[test]
    fn values_out_of_range_are_refused_by_key() {
        assert!(paper_pixel().check().is_ok());
        let bad = [
            (PixelParams { quantum_efficiency: 1.1, ..paper_pixel() }, "sensor.pixel.quantum_efficiency = 1.1"),
            (PixelParams { fill_factor: 0.0, ..paper_pixel() }, "sensor.pixel.fill_factor = 0"),
            (PixelParams { read_noise_uv: f64::NAN, ..paper_pixel() }, "sensor.pixel.read_noise_uv = NaN"),
            (PixelParams { temperature_k: 451.0, ..paper_pixel() }, "sensor.temperature_k = 451"),
            (PixelParams { temperature_k: -1.0, ..paper_pixel() }, "sensor.temperature_k = -1"),
            (
                PixelParams { temperature_k: 450.0, dark_doubling_k: 0.1, ..paper_pixel() },
                "sensor.pixel.dark_doubling_k = 0.1",
            ),
            (PixelParams { die_dark_sigma: 4.0, ..paper_pixel() }, "sensor.die_dark_sigma = 4"),
        ];
        for (params, expected) in bad {
            let message = params.check().unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
    }
}
