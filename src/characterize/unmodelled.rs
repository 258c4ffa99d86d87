//! Limits of the truth: effects and settings that the model has no closed form for, each with the figures that it affects and the reason.
//! These figures are measured and shown, but have no expected value.

use crate::effects::{self, Parameters};

/// Figures that an effect or setting changes.
#[derive(Clone, Copy, Debug)]
pub enum AffectedFigures {
    All,
    /// Those whose names begin so.
    Named(&'static [&'static str]),
}

impl AffectedFigures {
    /// Whether a figure is among them. A name that ends in a full stop means that figure alone.
    pub fn has(self, name: &str) -> bool {
        let is = |start: &&str| start.strip_suffix('.').map_or(name.starts_with(start), |whole| name == whole);
        match self {
            Self::All => true,
            Self::Named(starts) => starts.iter().any(is),
        }
    }
}

/// Saturation and what is made from it.
const SATURATION: AffectedFigures = AffectedFigures::Named(&["u_e_sat", "u_p_sat", "SNR_max", "DR_dB", "LE_"]);

/// What is measured with light, in units of light, and patterns of the response.
const LIGHT: AffectedFigures = AffectedFigures::Named(&["R.", "QE", "u_p_", "u_e_sat", "SNR_max", "DR_dB", "PRNU"]);

/// Effects without a part in the model.
const EFFECTS: [(&str, AffectedFigures, &str); 9] = [
    ("dead_pixels", LIGHT, "dead pixels are as many as the die has: the configuration gives their chance only"),
    (
        "hot_pixels",
        AffectedFigures::Named(&["u_I_", "DSNU", "PRNU", "x_k3_ratio", "LE_", "sigma_", "u_e_min", "u_p_min", "DR_dB"]),
        "a few hot pixels hold more of the pattern and of the dark charge than all others: the configuration gives their chance only",
    ),
    ("blooming", SATURATION, "near saturation charge comes and goes between neighbours"),
    (
        "image_lag",
        AffectedFigures::All,
        "frames are shot on their own: charge that a frame before would leave is not there",
    ),
    (
        "die_gain",
        AffectedFigures::Named(&["K", "R.", "sigma_", "u_e_", "u_p_", "SNR_max", "DR_dB", "DSNU", "LE_", "x_k3_ratio"]),
        "the die's own gain is a draw: the configuration gives its spread only",
    ),
    (
        "rts_noise",
        AffectedFigures::Named(&["sigma_", "u_e_min", "u_p_min", "DR_dB", "DSNU", "PRNU", "x_k3_ratio", "u_I_var"]),
        "a few pixels with traps hold more of the noise than all others: the configuration gives their chance only",
    ),
    ("column_settling", AffectedFigures::All, "what a column has not settled bends the response"),
    (
        "stuck_pixels",
        AffectedFigures::Named(&["R.", "QE", "sigma_", "u_", "SNR_max", "DR_dB", "DSNU", "PRNU"]),
        "stuck pixels lie a whole range off: a few of them hold all of the pattern",
    ),
    ("supply_ripple", AffectedFigures::All, "ripple bands rows by the time of their readout"),
];

/// Effects that the model covers except for the die's draw, which moves these figures.
const DIE_OFFSET: (&str, AffectedFigures, &str) =
    ("die_offset", SATURATION, "the die's own black level is a draw, and moves the code at which the converter ends");

/// One reason why figures are not expected.
pub struct Unmodelled {
    /// Effect, or key of the setting.
    pub name: &'static str,
    pub affected: AffectedFigures,
    pub reason: &'static str,
}

/// Everything about these parameters that the model does not know.
pub fn unmodelled(parameters: &Parameters) -> Vec<Unmodelled> {
    let (pixel, adc) = (&parameters.pixel, &parameters.adc);
    let built = effects::build_all(parameters);
    let acts = |name: &str| built.iter().any(|effect| effect.name() == name);
    let shared = acts("row_noise") || acts("column_noise") || acts("ramp_noise");
    let settings = [
        (
            !adc.has_equal_steps(),
            "sensor.adc.ramp",
            AffectedFigures::All,
            "steps of the ramp differ: DNL and INL say by how much",
        ),
        (
            adc.comparator_delay_clk > 0 || adc.comparator_delay_sigma_clk > 0.0 || adc.kickback_uv != 0.0,
            "sensor.adc.comparator",
            AffectedFigures::All,
            "late comparators and kickback move codes by whole counts",
        ),
        (
            acts("ramp_noise") && adc.columns_per_adc > 1,
            "sensor.adc.columns_per_adc",
            AffectedFigures::All,
            "every so many columns share a draw of the ramp's noise",
        ),
        (
            shared,
            "sensor.adc.row_noise_uv",
            AffectedFigures::Named(&["x_k3_ratio"]),
            "noise that lines share has as few draws as lines, too few for a third cumulant",
        ),
        (
            acts("gain_compression") || acts("storage_leakage") || acts("parasitic_light"),
            "sensor.pixel",
            AffectedFigures::Named(&["PRNU1288_row"]),
            "what rows lose or gather while they wait is a slope over the frame, not a spread of independent rows",
        ),
        (
            pixel.dcnu > 0.0,
            "sensor.pixel.dcnu",
            AffectedFigures::Named(&["DSNU1288.", "DSNU1288_pixel", "u_I_", "PRNU", "x_k3_ratio"]),
            "dark current over pixels has a long tail: its few brightest hold the spread",
        ),
        (
            pixel.die_dark_sigma > 0.0,
            "sensor.die_dark_sigma",
            AffectedFigures::Named(&["u_I_", "DSNU"]),
            "the die's own dark current is a draw: the configuration gives its spread only",
        ),
    ];
    let of_effects = EFFECTS.iter().chain([&DIE_OFFSET]).filter(|(name, ..)| acts(name));
    let of_settings = settings.into_iter().filter(|(is_so, ..)| *is_so);
    of_effects
        .map(|&(name, affected, reason)| Unmodelled { name, affected, reason })
        .chain(of_settings.map(|(_, name, affected, reason)| Unmodelled { name, affected, reason }))
        .collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Effects whose part in the figures `model` has.
    const MODELLED: [&str; 19] = [
        "prnu",
        "parasitic_light",
        "shot_noise",
        "dark_current",
        "dsnu",
        "full_well",
        "storage_leakage",
        "gain_compression",
        "flicker_noise",
        "ktc_noise",
        "read_noise",
        "column_gain",
        "column_offset",
        "column_noise",
        "row_noise",
        "row_offset",
        "comparator_noise",
        "ramp_noise",
        "ramp_jitter",
    ];

    #[test]
    fn every_effect_has_its_part_in_the_model() {
        let left_out: Vec<&str> = EFFECTS.iter().chain([&DIE_OFFSET]).map(|effect| effect.0).collect();
        for name in effects::names() {
            let mentions = usize::from(MODELLED.contains(&name)) + usize::from(left_out.contains(&name));
            assert_eq!(mentions, 1, "the truth of `characterize` models {name}, or says which figures it affects");
        }
        assert_eq!(MODELLED.len() + left_out.len(), effects::names().len());
    }

    #[test]
    fn names_stand_for_a_figure_or_for_all_that_begin_so() {
        assert!(LIGHT.has("R") && LIGHT.has("PRNU1288_col") && !LIGHT.has("x_rho_row") && !LIGHT.has("K"));
    }
}
