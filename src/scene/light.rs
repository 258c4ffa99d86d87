//! Light sources and their units. Enters: lux of a named illuminant. Leaves: photons per band.
//!
//! Bands are red, green and blue thirds of 400 to 700 nm (600-700, 500-600, 400-500 nm), and near infrared (700-1000 nm). A scene's
//! colours are linear sRGB relative to its illuminant: white light (1, 1, 1, 1) has the illuminant's spectrum, and coloured light
//! scales its bands. What states no near infrared reflects and shines there as it does in red.

use crate::error::Error;

/// Bands of a render: red, green, blue, near infrared.
pub const BANDS: usize = 4;

/// Place of the near infrared among the bands.
pub const INFRARED: usize = 3;

/// One number a band.
pub type Bands = [f32; BANDS];

/// Red, green and blue with a near infrared that is like the red.
pub const fn with_infrared([red, green, blue]: [f32; 3]) -> Bands {
    [red, green, blue, red]
}

/// Weight of each linear sRGB band in luminance (IEC 61966-2-1, row Y of the primaries' matrix). They sum to 1; nobody sees infrared.
pub const LUMINANCE_WEIGHTS: [f64; BANDS] = [0.2126, 0.7152, 0.0722, 0.0];

/// A spectrum that a scene's white light has.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Illuminant {
    /// CIE daylight, 6504 K.
    D65,
    /// CIE incandescent, Planck at 2856 K.
    A,
    /// Equal energy.
    E,
    /// CIE narrow-band fluorescent.
    Fl11,
    /// CIE phosphor-converted white LED.
    LedB3,
}

impl Illuminant {
    /// All that are known.
    pub const ALL: [Self; 5] = [Self::D65, Self::A, Self::E, Self::Fl11, Self::LedB3];

    /// The one name in configs and reports.
    pub fn name(self) -> &'static str {
        match self {
            Self::D65 => "D65",
            Self::A => "A",
            Self::E => "E",
            Self::Fl11 => "FL11",
            Self::LedB3 => "LED-B3",
        }
    }

    /// The illuminant of a name.
    ///
    /// # Errors
    /// A name that is not among `ALL`.
    pub fn from_name(name: &str) -> Result<Self, Error> {
        let known = || Self::ALL.map(Self::name).join(", ");
        let found = Self::ALL.into_iter().find(|illuminant| illuminant.name() == name);
        found.ok_or_else(|| Error::Unknown { what: "illuminant", name: name.to_owned(), known: known() })
    }

    /// Photons of 400 to 700 nm in one lux over one second and one square micrometre (DESIGN: photometry).
    pub fn photons_per_lux_s_um2(self) -> f64 {
        match self {
            Self::D65 => 10_880.0,
            Self::A => 12_032.0,
            Self::E => 11_419.0,
            Self::Fl11 => 7_923.0,
            Self::LedB3 => 8_639.0,
        }
    }

    /// Photons of each band (600-700, 500-600, 400-500, 700-1000 nm) over those of 400 to 700 nm: the first three sum to 1.
    pub fn band_shares(self) -> [f64; BANDS] {
        let power = |nm: f64| self.relative_power(nm);
        let mut photons = [0.0; 3];
        for (band, start_nm) in [600.0, 500.0, 400.0].into_iter().enumerate() {
            // Photons go as power times wavelength; trapezoids of 5 nm, the step of the CIE's own tables.
            for step in 0..=20 {
                let nm = start_nm + 5.0 * f64::from(step);
                let weight = if step == 0 || step == 20 { 0.5 } else { 1.0 };
                photons[band] += weight * power(nm) * nm;
            }
        }
        let total = photons[0] + photons[1] + photons[2];
        let [red, green, blue] = photons.map(|photons| photons / total);
        [red, green, blue, self.infrared_share()]
    }

    /// Photons of 700 to 1000 nm over those of 400 to 700 nm.
    fn infrared_share(self) -> f64 {
        match self {
            // Planck at 2856 K has 57,813 photons of 400 to 1000 nm a lux (CIE 1931, CODATA).
            Self::A => 57_813.0 / 12_032.0 - 1.0,
            // Photons go as wavelength: 850 nm times 300 nm over 550 nm times 300 nm.
            Self::E => 850.0 / 550.0,
            Self::D65 | Self::Fl11 | Self::LedB3 => 0.0,
        }
    }

    /// Spectral power relative to 560 nm. D65: CIE 15 table at 10 nm, linear between; A: Planck's law at 2856 K as CIE 15 defines
    /// it. FL11 and LED-B3 enter the bands as the equal-energy spectrum does: their totals are exact, the split
    /// between bands is not, which a monochrome pixel of flat efficiency does not see.
    fn relative_power(self, nm: f64) -> f64 {
        match self {
            Self::D65 => between(&D65_10_NM, (nm - 400.0) / 10.0) / 100.0,
            Self::A => {
                let planck = |nm: f64| 1.0 / (nm * nm * nm * nm * nm * libm::expm1(1.435e7 / (2848.0 * nm)));
                planck(nm) / planck(560.0)
            }
            Self::E | Self::Fl11 | Self::LedB3 => 1.0,
        }
    }
}

/// CIE 15: D65 from 400 to 700 nm in steps of 10 nm, 100 at 560 nm.
const D65_10_NM: [f64; 31] = [
    82.7549, 91.4860, 93.4318, 86.6823, 104.865, 117.008, 117.812, 114.861, 115.923, 108.811, 109.354, 107.802,
    104.790, 107.689, 104.405, 104.046, 100.000, 96.3342, 95.7880, 88.6856, 90.0062, 89.5991, 87.6987, 83.2886,
    83.6992, 80.0268, 80.2146, 82.2778, 78.2842, 69.7213, 71.6091,
];

/// Linear between the entries of a table; `at` is within it.
fn between(table: &[f64], at: f64) -> f64 {
    let first = crate::num::index(crate::num::u32_truncated(at)).min(table.len() - 2);
    let share = at - crate::num::f64_from_usize(first);
    table[first] + (table[first + 1] - table[first]) * share
}

/// Luminance of linear sRGB, with (1, 1, 1) giving 1; infrared has none.
pub fn luminance([red, green, blue, _]: [f64; BANDS]) -> f64 {
    red * LUMINANCE_WEIGHTS[0] + green * LUMINANCE_WEIGHTS[1] + blue * LUMINANCE_WEIGHTS[2]
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn band_shares_sum_to_one_and_warm_light_is_redder() {
        let mut tried = 0;
        for illuminant in Illuminant::ALL {
            let shares = illuminant.band_shares();
            // Three divisions and two sums of numbers below 1.
            assert!((shares[0] + shares[1] + shares[2] - 1.0).abs() < 1e-15, "{illuminant:?}: {shares:?}");
            assert_eq!(Illuminant::from_name(illuminant.name()).unwrap(), illuminant);
            tried += 1;
        }
        assert_eq!(tried, 5);
        assert!(Illuminant::A.band_shares()[0] > Illuminant::D65.band_shares()[0]);
        // Equal energy: photons go as wavelength, so the shares are 650, 550 and 450 over 1650.
        let equal = Illuminant::E.band_shares();
        assert!((equal[0] - 650.0 / 1650.0).abs() < 1e-12, "{equal:?}");
    }

    #[test]
    fn a_name_that_is_not_known_is_refused_with_those_that_are() {
        let text = Illuminant::from_name("D50").unwrap_err().to_string();
        assert!(text.contains("D50") && text.contains("LED-B3"), "{text}");
    }
}
