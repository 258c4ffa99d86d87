//! Parameters of a pixel. Enters: numbers of a config. Leaves: the same, checked, and what follows from them.

use crate::error::Error;
use crate::units::{BOLTZMANN_J_PER_K, ELEMENTARY_CHARGE_C};

/// How a pixel resets, transfers and stores; the name counts its transistors.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub enum PixelType {
    /// No transfer gate: reset and signal levels belong to different resets.
    T3,
    /// Transfer gate: reset and signal levels belong to the same reset.
    T4,
    /// Global shutter that stores on the floating diffusion: levels belong to different resets.
    T5,
    /// Global shutter that stores charge behind a second gate: levels belong to the same reset.
    T6,
}

impl PixelType {
    /// All types.
    pub const ALL: [Self; 4] = [Self::T3, Self::T4, Self::T5, Self::T6];

    /// The name in configs and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::T3 => "3T",
            Self::T4 => "4T",
            Self::T5 => "5T",
            Self::T6 => "6T",
        }
    }

    /// The type of this name.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        Self::ALL.into_iter().find(|kind| kind.name() == name).ok_or_else(|| Error::Unknown {
            what: "pixel type",
            name: name.to_owned(),
            known: Self::ALL.map(Self::name).join(", "),
        })
    }

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
    /// Distance between pixel centres in um, above 0 to 100. Datasheet.
    pub pitch_um: f64,
    /// Photoelectrons per photon on the photodiode, 0 to 1. Datasheet; EMVA 1288 gives its product with the fill factor.
    pub quantum_efficiency: f64,
    /// Share of the pixel's light that meets the photodiode, micro-lens included, above 0 to 1. Datasheet.
    pub fill_factor: f64,
    /// Conversion gain at the ADC's input in uV/e-, above 0 to 1000. Datasheet or photon transfer.
    pub conversion_gain_uv_per_e: f64,
    /// Charge at which the pixel clips in e-, 1 to 1e9. EMVA 1288 saturation capacity.
    pub full_well_e: f64,
    /// Dark current at 300 K in e-/s, 0 to 1e9. EMVA 1288 dark current.
    pub dark_current_e_per_s: f64,
    /// Warming in K that doubles the dark current, above 0 to 100; 8 for silicon near room temperature.
    pub dark_doubling_k: f64,
    /// Temperature of the die in K, 150 to 450.
    pub temperature_k: f64,
    /// Sigma of the read noise in uV at the ADC's input, after double sampling, 0 to 1e6. EMVA 1288 temporal dark noise.
    pub read_noise_uv: f64,
    /// Sigma of one reset's kTC noise in uV at the ADC's input, 0 to 1e6; `None`: from the conversion gain.
    pub ktc_noise_uv: Option<f64>,
    /// Sigma of the photo response relative to its mean, 0 to 0.15 (a normal draw of 6.4 sigma stays positive). EMVA 1288.
    pub prnu: f64,
    /// Sigma of the dark signal between pixels in e-, 0 to 1e6. EMVA 1288.
    pub dsnu_e: f64,
    /// Whether reset and signal are both sampled and subtracted.
    pub double_sampling: bool,
}

/// Gain of the source follower between floating diffusion and column.
pub const SOURCE_FOLLOWER_GAIN: f64 = 0.85;

impl PixelParams {
    /// Refuses values out of range, naming key, value and what would do.
    pub fn check(&self) -> Result<(), Error> {
        above("sensor.pixel.pitch_um", self.pitch_um, 0.0, 100.0)?;
        within("sensor.pixel.quantum_efficiency", self.quantum_efficiency, 0.0, 1.0)?;
        above("sensor.pixel.fill_factor", self.fill_factor, 0.0, 1.0)?;
        above("sensor.pixel.conversion_gain_uv_per_e", self.conversion_gain_uv_per_e, 0.0, 1000.0)?;
        within("sensor.pixel.full_well_e", self.full_well_e, 1.0, 1e9)?;
        within("sensor.pixel.dark_current_e_per_s", self.dark_current_e_per_s, 0.0, 1e9)?;
        above("sensor.pixel.dark_doubling_k", self.dark_doubling_k, 0.0, 100.0)?;
        within("sensor.temperature_k", self.temperature_k, 150.0, 450.0)?;
        within("sensor.pixel.read_noise_uv", self.read_noise_uv, 0.0, 1e6)?;
        within("sensor.pixel.ktc_noise_uv", self.ktc_noise_uv.unwrap_or(0.0), 0.0, 1e6)?;
        within("sensor.pixel.prnu", self.prnu, 0.0, 0.15)?;
        within("sensor.pixel.dsnu_e", self.dsnu_e, 0.0, 1e6)
    }

    /// Dark current at the die's temperature in e-/s.
    pub fn dark_current_now_e_per_s(&self) -> f64 {
        self.dark_current_e_per_s * libm::exp2((self.temperature_k - 300.0) / self.dark_doubling_k)
    }

    /// Sigma of one reset's kTC noise at the ADC's input in uV: as given, else sqrt(A k T g / q).
    pub fn ktc_of_one_reset_uv(&self) -> f64 {
        self.ktc_noise_uv.unwrap_or_else(|| {
            let gain_v_per_e = self.conversion_gain_uv_per_e * 1e-6;
            let heat = BOLTZMANN_J_PER_K * self.temperature_k / ELEMENTARY_CHARGE_C;
            1e6 * (SOURCE_FOLLOWER_GAIN * heat * gain_v_per_e).sqrt()
        })
    }

    /// How many resets' kTC variance the sampled value carries: none where double sampling subtracts the same reset, two
    /// where it subtracts another, one without it.
    pub fn ktc_resets(&self) -> f64 {
        match (self.double_sampling, self.pixel_type.is_correlated()) {
            (true, true) => 0.0,
            (true, false) => 2.0,
            (false, _) => 1.0,
        }
    }
}

/// Refuses a value outside `least..=most`, NaN included.
pub(crate) fn within(key: &str, value: f64, least: f64, most: f64) -> Result<(), Error> {
    if value >= least && value <= most {
        return Ok(());
    }
    Err(Error::key(key, value, format!("out of range; {least} to {most} would do")))
}

/// Refuses a value that is not above `least` and at most `most`, NaN included.
pub(crate) fn above(key: &str, value: f64, least: f64, most: f64) -> Result<(), Error> {
    if value > least && value <= most {
        return Ok(());
    }
    Err(Error::key(key, value, format!("out of range; above {least} to {most} would do")))
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
            double_sampling: true,
        }
    }

    #[test]
    fn ktc_noise_follows_from_gain_and_temperature_as_the_design_says() {
        // DESIGN: 10 uV/e-, 300 K, A 0.85 give 469 uV, rounded to three digits.
        assert!((paper_pixel().ktc_of_one_reset_uv() - 469.0).abs() < 0.5);
        assert_eq!(PixelParams { ktc_noise_uv: Some(7.0), ..paper_pixel() }.ktc_of_one_reset_uv(), 7.0);
    }

    #[test]
    fn double_sampling_removes_ktc_only_where_both_samples_share_a_reset() {
        let resets =
            |pixel_type, double_sampling| PixelParams { pixel_type, double_sampling, ..paper_pixel() }.ktc_resets();
        assert_eq!(PixelType::ALL.map(|kind| resets(kind, true)), [2.0, 0.0, 2.0, 0.0]);
        assert_eq!(PixelType::ALL.map(|kind| resets(kind, false)), [1.0; 4]);
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
            (PixelParams { temperature_k: 77.0, ..paper_pixel() }, "sensor.temperature_k = 77"),
        ];
        for (params, expected) in bad {
            let message = params.check().unwrap_err().to_string();
            assert!(message.contains(expected), "{message}");
        }
        assert!(PixelType::from_name("7T").unwrap_err().to_string().contains("3T, 4T, 5T, 6T"));
    }
}
