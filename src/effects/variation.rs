//! Process corner and supply of a die. Converts parameters of typical silicon at the nominal supply to this silicon at this supply. Typical
//! at nominal changes no bit.
//!
//! A corner names how fast NMOS and PMOS are: typical, fast or slow each. No foundry publishes its tables, so every factor here is
//! assumed: of the size that public 180 nm to 65 nm models spread over, with the direction that physics gives it. A supply other
//! than the nominal one scales what is referred to it. Temperature is a separate parameter.

use super::Parameters;
use crate::error::Error;
use crate::num::u64_half_even;
use crate::text::named;

named! {
    /// Speed of NMOS and PMOS.
    pub enum ProcessCorner {
        /// Typical, typical.
        Tt = "tt",
        /// Fast, fast.
        Ff = "ff",
        /// Slow, slow.
        Ss = "ss",
        /// Fast NMOS, slow PMOS.
        Fs = "fs",
        /// Slow NMOS, fast PMOS.
        Sf = "sf",
    }
}

impl ProcessCorner {
    /// What the corner does. The pixel's transistors and the column's bias are NMOS; a comparator needs both kinds.
    pub fn factors(self) -> Factors {
        let typical = Factors { gain: 1.0, dark: 1.0, leakage: 1.0, speed: 1.0, bias: 1.0, offset: 1.0, delay: 1.0 };
        let fast = Factors { gain: 1.03, dark: 1.5, leakage: 3.0, speed: 1.15, bias: 1.15, offset: 1.0, delay: 0.8 };
        let slow = Factors { gain: 0.97, dark: 0.7, leakage: 0.4, speed: 0.85, bias: 0.85, offset: 1.0, delay: 1.25 };
        match self {
            Self::Tt => typical,
            Self::Ff => fast,
            Self::Ss => slow,
            Self::Fs => Factors { offset: 1.2, delay: 1.05, ..fast },
            Self::Sf => Factors { offset: 1.2, delay: 1.05, ..slow },
        }
    }
}

/// Factors of a corner on the typical parameters. All are assumed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Factors {
    /// Conversion gains: fast NMOS has shorter gates and less overlap, so the floating diffusion's capacitance is less.
    pub gain: f64,
    /// Dark currents of photodiode and storage node: fast silicon has higher fields at its junctions.
    pub dark: f64,
    /// Storage leakage: sub-threshold current grows tenfold in some 90 mV of threshold; a corner moves it by 40 mV.
    pub leakage: f64,
    /// Bandwidth of the source follower: its transconductance over the column's load.
    pub speed: f64,
    /// Bias current of the columns, mirrored by NMOS.
    pub bias: f64,
    /// Sigma of the columns' offsets: a comparator whose NMOS and PMOS differ leaves its balanced point.
    pub offset: f64,
    /// Delay of the comparator, and its spread: current over load, of both kinds in turn.
    pub delay: f64,
}

/// Supplies farther than this from the nominal one, relative to it, are beyond what the factors claim.
const SUPPLY_SPREAD_MAX: f64 = 0.2;

/// Share of the nominal supply that a pixel's swing does not use: threshold and overdrive of the source follower and what the bias
/// transistor needs. Assumed: 1.1 V of 2.8 V.
const HEADROOM: f64 = 0.4;

/// Silicon and supply of a die.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Variation {
    /// Process corner.
    pub corner: ProcessCorner,
    /// Analog supply in V.
    pub supply_v: f64,
    /// Analog supply in V for which the parameters are given.
    pub supply_nominal_v: f64,
}

impl Variation {
    /// Refuses a supply that the factors say nothing about. Fails on more than a fifth away from the nominal one; the error names the
    /// accepted range.
    pub fn checked(self) -> Result<Self, Error> {
        let ratio = self.supply_v / self.supply_nominal_v;
        // A billionth is forgiven, as decimal fractions are rounded.
        if (ratio - 1.0).abs() <= SUPPLY_SPREAD_MAX + 1e-9 {
            return Ok(self);
        }
        let [least_v, most_v] =
            [1.0 - SUPPLY_SPREAD_MAX, 1.0 + SUPPLY_SPREAD_MAX].map(|ratio| ratio * self.supply_nominal_v);
        // Rounded inwards; a nominal supply has few decimals.
        let (least_v, most_v) = ((1e3 * least_v - 1e-6).ceil() / 1e3, (1e3 * most_v + 1e-6).floor() / 1e3);
        let reason = format!("too far from the nominal supply; use {least_v} to {most_v} or another supply_nominal_v");
        Err(Error::key("sensor.supply_v", self.supply_v, reason))
    }

    /// The parameters on this silicon at this supply. Fails on a parameter that leaves its range so; the error names corner and supply,
    /// and the parameter.
    pub fn of(self, parameters: Parameters) -> Result<Parameters, Error> {
        let ratio = self.supply_v / self.supply_nominal_v;
        let varied = with_supply(with_corner(parameters, self.corner.factors()), ratio);
        let checked = varied.pixel.check().and_then(|()| varied.adc.check());
        checked.map_err(|error| {
            let reason = format!("at a supply of {} times the nominal one, {error}", ratio);
            Error::key("sensor.corner", self.corner.name(), reason)
        })?;
        Ok(varied)
    }
}

fn with_corner(mut parameters: Parameters, factors: Factors) -> Parameters {
    let pixel = &mut parameters.pixel;
    pixel.conversion_gain_uv_per_e *= factors.gain;
    pixel.low_conversion_gain_uv_per_e = pixel.low_conversion_gain_uv_per_e.map(|gain| gain * factors.gain);
    pixel.dark_current_e_per_s *= factors.dark;
    pixel.storage_dark_e_per_s = pixel.storage_dark_e_per_s.map(|rate| rate * factors.dark);
    pixel.hot_dark_e_per_s *= factors.dark;
    pixel.storage_leakage_per_s *= factors.leakage;
    pixel.follower_bandwidth_hz *= factors.speed;
    let adc = &mut parameters.adc;
    adc.column_bias_ua *= factors.bias;
    adc.column_offset_uv *= factors.offset;
    adc.column_offset_residual_uv *= factors.offset;
    adc.comparator_delay_sigma_clk *= factors.delay;
    let delay_clk = u64_half_even(f64::from(adc.comparator_delay_clk) * factors.delay);
    adc.comparator_delay_clk = u32::try_from(delay_clk).expect("a delay has at most 1000 clocks");
    parameters
}

/// Swing and full well grow with the supply less its headroom; the ramp's span is taken from a divider of the supply.
fn with_supply(mut parameters: Parameters, ratio: f64) -> Parameters {
    // Of exactly 1 the quotient below is exactly 1 too: (1 - h) / (1 - h).
    let swing = (ratio - HEADROOM) / (1.0 - HEADROOM);
    parameters.pixel.full_well_e *= swing;
    parameters.adc.full_scale_uv *= ratio;
    for level_uv in &mut parameters.adc.ramp_table_uv {
        *level_uv *= ratio;
    }
    parameters
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::Ramp;
    use crate::adc::params_tests::paper_adc;
    use crate::pixel::params_tests::paper_pixel;

    fn parameters() -> Parameters {
        let mut parameters = Parameters { pixel: paper_pixel(), adc: paper_adc() };
        (parameters.adc.comparator_delay_clk, parameters.adc.column_bias_ua) = (7, 3.0);
        // A table of one bit has one edge.
        (parameters.adc.ramp, parameters.adc.bits, parameters.adc.black_level_dn) = (Ramp::Table, 1, 0);
        (parameters.adc.ramp_table_uv, parameters.adc.reset_counts) = (vec![55_000.0], 1);
        parameters.pixel.storage_leakage_per_s = 0.3;
        parameters
    }

    fn at(corner: ProcessCorner, supply_v: f64) -> Parameters {
        Variation { corner, supply_v, supply_nominal_v: 2.8 }.checked().unwrap().of(parameters()).unwrap()
    }

    #[test]
    fn typical_silicon_at_the_nominal_supply_is_what_the_config_says() {
        let (found, given) = (at(ProcessCorner::Tt, 2.8), parameters());
        assert_eq!((found.pixel, found.adc), (given.pixel, given.adc));
    }

    #[test]
    fn fast_silicon_leaks_and_hurries_and_slow_silicon_does_neither() {
        let [fast, typical, slow] =
            [ProcessCorner::Ff, ProcessCorner::Tt, ProcessCorner::Ss].map(|corner| at(corner, 2.8));
        let rising: [fn(&Parameters) -> f64; 6] = [
            |p| p.pixel.dark_current_e_per_s,
            |p| p.pixel.storage_leakage_per_s,
            |p| p.pixel.conversion_gain_uv_per_e,
            |p| p.pixel.follower_bandwidth_hz,
            |p| p.adc.column_bias_ua,
            |p| -f64::from(p.adc.comparator_delay_clk),
        ];
        for value in rising {
            assert!(value(&fast) > value(&typical) && value(&typical) > value(&slow));
        }
        assert_eq!(at(ProcessCorner::Fs, 2.8).adc.column_offset_uv, 240.0);
    }

    #[test]
    fn less_supply_gives_less_swing_and_a_shorter_ramp() {
        let low = at(ProcessCorner::Tt, 2.52);
        // (0.9 - 0.4) / 0.6 of the well, 0.9 of the ramp; three roundings of 1.1e-16 each.
        assert!((low.pixel.full_well_e / (10_000.0 * 5.0 / 6.0) - 1.0).abs() < 1e-15);
        assert!((low.adc.full_scale_uv / 99_000.0 - 1.0).abs() < 1e-15);
        let far = Variation { corner: ProcessCorner::Tt, supply_v: 1.8, supply_nominal_v: 2.8 };
        let message = far.checked().unwrap_err().to_string();
        assert!(message.contains("sensor.supply_v = 1.8") && message.contains("use 2.24 to 3.36"), "{message}");
    }

    #[test]
    fn a_parameter_that_leaves_its_range_is_refused_with_the_corner() {
        let mut leaky = parameters();
        leaky.pixel.storage_leakage_per_s = 50.0;
        let fast = Variation { corner: ProcessCorner::Ff, supply_v: 2.8, supply_nominal_v: 2.8 };
        let message = fast.of(leaky).unwrap_err().to_string();
        assert!(message.contains("sensor.corner = ff") && message.contains("storage_leakage_per_s = 150"), "{message}");
    }
}
