//! Facts about a scene and a sensor that are cheap to know before anything is simulated. The planner decides from these.

/// What is known of one region (or of a whole frame) before it is simulated. Intervals are bounds, not estimates.
#[derive(Clone, Debug, PartialEq)]
pub struct Facts {
    /// Least mean photoelectrons of a pixel of the region.
    pub signal_e_min: f64,
    /// Greatest mean photoelectrons of a pixel of the region, parasitic light included.
    pub signal_e_max: f64,
    /// Whether `signal_e_max` is the most that the planner counts, twice what pixel and converter hold, because the light is brighter:
    /// more light changes no code.
    pub is_capped: bool,
    /// Greatest mean photoelectrons of any pixel of any frame: what neighbours and the frame before can bring.
    pub frame_e_max: f64,
    /// Greatest mean of what a pixel holds beside its own light, in electrons.
    pub dark_mean_e: f64,
    /// Root mean square of what a pixel holds beside its own light, in electrons: dark charge, its pattern, charge of neighbours
    /// and of the frame before, and noise before the column's gain.
    pub dark_rms_e: f64,
    /// Exposure in seconds.
    pub exposure_s: f64,
    /// Longest wait between the end of an exposure and the row's readout, in seconds.
    pub storage_s_max: f64,
    /// Temperature of the die in kelvin.
    pub temperature_k: f64,
    /// How far the run's dies lie from the mean of all dies.
    pub dies: DieSpread,
    /// Conversion gain from electrons to the ADC's input, in microvolts per electron.
    pub conversion_gain_uv_per_e: f64,
    /// Greatest slope of a pixel's charge over what the array gathers: above 1 where charge may spill over.
    pub spill_slope_max: f64,
    /// Greatest slope of the samples over the charge, relative to the conversion gain: above 1 where dies differ in gain.
    pub gain_slope_max: f64,
}

impl Facts {
    /// The greatest signal, for a person.
    pub fn signal_words(&self) -> String {
        let why =
            if self.is_capped { " (twice what pixel and converter hold; more light changes no code)" } else { "" };
        format!("{:.0} e-{why}", self.signal_e_max)
    }
}

/// How far the dies of a rig lie from the mean of all dies. `pixel::die_spread` reads it from the dies' own draws; `pixel::ANY_DIE` holds
/// for every die that a draw can give.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct DieSpread {
    /// Greatest distance of a conversion gain, either way, in sigma.
    pub gain_sigmas: f64,
    /// Greatest distance of a black level, either way, in sigma.
    pub offset_sigmas: f64,
    /// Greatest deviation of the logarithm of a dark current in sigma; negative where all dies are less dark than most.
    pub dark_sigmas: f64,
    /// Dark current of the hottest pixel over the mean of hot pixels; 0 where no pixel is hot.
    pub hottest: f64,
}

/// A quantity of a scenario that is known before anything is simulated: the truth lies between both ends.
#[derive(Clone, Debug, PartialEq)]
pub struct Fact {
    /// The one name, with its unit as suffix: `motion_over_exposure_px`.
    pub name: &'static str,
    /// Least value that any frame of the run can show.
    pub least: f64,
    /// Greatest value; infinite where nothing bounds it.
    pub greatest: f64,
    /// How it was found, for a person: "brightest lit texel times roll-off".
    pub how: String,
}

impl Fact {
    /// Whether a value lies within, its ends included.
    pub fn holds(&self, value: f64) -> bool {
        value >= self.least && value <= self.greatest
    }
}

/// A part of the picture.
#[derive(Clone, Debug, PartialEq)]
pub struct Tile {
    /// First column and the one after the last.
    pub columns: [u32; 2],
    /// First row and the one after the last.
    pub rows: [u32; 2],
    /// Least and greatest mean electrons of any pixel in it, in any frame; so its peak and its mean lie between both.
    pub signal_e: [f64; 2],
}

/// What is known of a scenario.
#[derive(Clone, Debug, Default, PartialEq)]
pub struct ScenarioFacts {
    /// Of all frames and cameras.
    pub facts: Vec<Fact>,
    /// Parts of the picture, row by row.
    pub tiles: Vec<Tile>,
}

impl ScenarioFacts {
    /// The fact of that name.
    pub fn of(&self, name: &str) -> Option<&Fact> {
        self.facts.iter().find(|fact| fact.name == name)
    }
}

/// A number for a person: three digits, plain from a hundred-thousandth to a million, with a power of ten beyond.
pub fn readable(value: f64) -> String {
    let size = value.abs();
    if size == 0.0 || !size.is_finite() {
        return format!("{value}");
    }
    if !(1e-5..1e6).contains(&size) {
        return format!("{value:.2e}");
    }
    let whole = libm::log10(size).floor();
    let mut decimals = 0;
    while f64::from(decimals) + whole < 2.0 {
        decimals += 1;
    }
    let text = format!("{value:.*}", crate::num::index(decimals));
    if text.contains('.') { text.trim_end_matches('0').trim_end_matches('.').to_owned() } else { text }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_readable_number_has_three_digits_and_no_idle_zeros() {
        let cases = [
            (0.000_12, "0.00012"),
            (0.3061, "0.306"),
            (12.0, "12"),
            (12.345, "12.3"),
            (999.6, "1000"),
            (45_678.9, "45679"),
            (1.2e-9, "1.20e-9"),
            (3.0e7, "3.00e7"),
            (0.0, "0"),
            (-0.5, "-0.5"),
            (f64::INFINITY, "inf"),
        ];
        for (value, words) in cases {
            assert_eq!(readable(value), words);
        }
    }
}
