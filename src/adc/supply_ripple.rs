//! Ripple of the supply. Adds a sine of run time, in microvolts, at each pixel's crossing.
//!
//! Model: a regulator's ripple of amplitude `supply_ripple_uv` at the ADC's input (rejection included) moves a sample when its
//! comparator decides: at time of the row's readout, plus the start of its conversion within the line, plus the clocks to its
//! crossing on the undisturbed ramp. Rows sample it at different phases, which shows as banding. It has no draw: the phase is that of
//! run time, and phase 0 is the start of the run.
//!
//! The phase of a row is the fraction of frequency times time, exact for the two floats, so it does not wander after hours: what is left is
//! the rounding of the time itself (2^-53 of it: 4e-7 periods of 1 MHz after an hour). Within a conversion
//! sin(p + w k) = sin p cos w k + cos p sin w k, from a table over the clocks k.

use super::columns::Converter;
use super::params::{AdcParams, Cds};
use super::sample::Sample;
use crate::draw::EffectNumber;
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;
use crate::num::{f32_nearest, f64_from_u64, index};

/// Ripple of the supply, rejection included.
pub struct SupplyRipple {
    converter: Converter,
    amplitude_uv: f64,
    frequency_hz: f64,
    /// Sine and cosine of the phase that the ripple goes through in that many clocks.
    rotations: Vec<[f64; 2]>,
}

impl SupplyRipple {
    /// `None` where the supply is clean.
    pub fn from_params(params: &AdcParams) -> Option<Box<dyn Effect>> {
        let (amplitude_uv, frequency_hz) = (params.supply_ripple_uv, params.supply_ripple_hz);
        if amplitude_uv == 0.0 {
            return None;
        }
        let clock_s = 1.0 / f64_from_u64(params.clock_hz);
        let steps = params.code_max().max(params.reset_counts_used());
        let turn = |clocks: u32| sine_cosine(turns(frequency_hz, f64::from(clocks) * clock_s));
        let rotations = (0..=steps + 1).map(turn).collect();
        Some(Box::new(Self { converter: Converter::new(params), amplitude_uv, frequency_hz, rotations }))
    }

    fn add(&self, sample: Sample, readout_s: f64, samples_uv: &mut [f32]) {
        let params = &self.converter.params;
        let steps = self.converter.steps(sample);
        let starts: Vec<[f64; 2]> = (0..params.columns_per_adc)
            .map(|pass| {
                let within_line = turns(self.frequency_hz, params.conversion_start_s(sample, pass));
                let phase = turns(self.frequency_hz, readout_s) + within_line;
                sine_cosine(phase).map(|part| self.amplitude_uv * part)
            })
            .collect();
        for (sample_uv, [sine_uv, cosine_uv]) in samples_uv.iter_mut().zip(starts.iter().cycle()) {
            let level_nv = self.converter.level_nv(*sample_uv);
            let [sine, cosine] = self.rotations[index(self.converter.ramp_levels.count(level_nv, steps) + 1)];
            *sample_uv += f32_nearest(sine_uv * cosine + cosine_uv * sine);
        }
    }
}

fn sine_cosine(phase_turns: f64) -> [f64; 2] {
    let (sine, cosine) = libm::sincos(core::f64::consts::TAU * phase_turns);
    [sine, cosine]
}

/// The fraction of a frequency times a time, both 0 or more, in [0, 1): the product's 106 bits are exact, and its whole periods fall
/// away before it is rounded.
pub(super) fn turns(frequency_hz: f64, time_s: f64) -> f64 {
    assert!(frequency_hz >= 0.0 && time_s >= 0.0, "phases start with the run");
    let ((a, a_exponent), (b, b_exponent)) = (mantissa(frequency_hz), mantissa(time_s));
    let product = u128::from(a) * u128::from(b);
    let exponent = a_exponent + b_exponent;
    // The product is below 2^106; with a binary point `fraction_bits` bits from the right its fraction is what stands right of it.
    let fraction_bits = u32::try_from(-exponent).unwrap_or(0);
    if fraction_bits == 0 {
        return 0.0;
    }
    if fraction_bits >= 127 {
        // Far below a period: nothing falls away, and the plain product is good to its last bit.
        return frequency_hz * time_s;
    }
    let fraction = product & ((1_u128 << fraction_bits) - 1);
    let scale = libm::exp2(-f64::from(fraction_bits));
    let turns = crate::num::f64_from_u128(fraction) * scale;
    // A fraction within half an ulp of a whole period rounds up to it.
    if turns < 1.0 { turns } else { 0.0 }
}

/// A float that is 0 or more as integer times a power of two.
fn mantissa(value: f64) -> (u64, i32) {
    const FRACTION_BITS: u32 = 52;
    let bits = value.to_bits();
    let field = i32::try_from(bits >> FRACTION_BITS).expect("the sign is plus, so 11 bits are left");
    let fraction = bits & ((1 << FRACTION_BITS) - 1);
    if field == 0 { (fraction, -1074) } else { (fraction | (1 << FRACTION_BITS), field - 1075) }
}

impl Effect for SupplyRipple {
    fn identity(&self) -> Identity {
        Identity { name: "supply_ripple", number: EffectNumber(209), domain: Domain::Microvolts }
    }

    fn cost_case(&self) -> &'static str {
        if self.converter.params.cds == Cds::Digital { "both" } else { "" }
    }

    /// A sine moves a sample by its amplitude at most, two samples apart by twice that. Pixels that cross at other clocks meet it at
    /// other phases: what is bounded by +-B has a variance of at most B^2 (Popoviciu).
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let samples = if self.converter.params.cds == Cds::Digital { 2.0 } else { 1.0 };
        let most_e = samples * self.amplitude_uv / facts.conversion_gain_uv_per_e;
        Some(Omission { bias_e: most_e, variance_e2: most_e * most_e })
    }

    fn reason(&self, facts: &Facts) -> String {
        let amplitude_e = self.amplitude_uv / facts.conversion_gain_uv_per_e;
        format!("{:.1} uV at {:.0} Hz is {amplitude_e:.2} e- in bands", self.amplitude_uv, self.frequency_hz)
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        self.add(Sample::Signal, row.readout_s, row.values);
        self.add(Sample::Reset, row.readout_s, row.reset);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Dyadic numbers have exact products, so the fraction is known.
    #[test]
    fn whole_periods_fall_away_exactly() {
        assert_eq!(turns(1e6, 0.0), 0.0);
        assert_eq!(turns(8.0, 3600.25), 0.0);
        assert_eq!(turns(3.0, 3600.25), 0.75);
        // 2^30 + 2^-20 Hz for 2^13 + 2^-13 s: 2^43 + 2^17 + 2^-7 + 2^-33 periods.
        let (hz, s) = (1_073_741_824.0 + 1.0 / 1_048_576.0, 8192.0 + 1.0 / 8192.0);
        assert_eq!(turns(hz, s), 1.0 / 128.0 + 1.0 / 8_589_934_592.0);
        // The plain product keeps none of the second part: it needs 77 bits.
        assert_ne!((hz * s).fract(), 1.0 / 128.0 + 1.0 / 8_589_934_592.0);
        assert_eq!(turns(1e9, 1e-300), 1e9 * 1e-300);
        assert_eq!(turns(1e-3, 1e-320), 1e-3 * 1e-320);
        assert_eq!(turns(1e9, 1e18), 0.0);
    }
}
