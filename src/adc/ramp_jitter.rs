//! Jitter of the ramp's clock. Adds a normal draw in microvolts, scaled by the ramp's slope at each pixel's crossing.
//!
//! Model: when `adc_clk` comes dt late against the ramp, the ramp stands slope times dt higher (aperture jitter in the sense of IEEE
//! 1241-2010). A column samples the clock once a conversion, at its crossing, so each conversion and column has one draw of sigma
//! slope * `ramp_jitter_ps`. The slope is that of the step before the crossing, in which the clock that counts last lies.

use super::columns::Converter;
use super::params::AdcParams;
use crate::draw::{DrawKey, EffectNumber, fill_uniforms, normals};
use crate::effect::{Domain, Effect, Identity, Omission, RowPass};
use crate::facts::Facts;
use crate::num::{f32_nearest, f64_from_i64, f64_from_u64, index};
use crate::pixel::add_scaled;

/// Jitter of `adc_clk` against the ramp.
pub struct RampJitter {
    converter: Converter,
    /// Sigma in uV of a crossing after that many ramp levels; one entry where all steps are equal.
    sigmas_uv: Vec<f32>,
    sigma_uv_max: f64,
    conversions: f64,
}

impl RampJitter {
    const NUMBER: EffectNumber = EffectNumber(208);

    /// `None` where the clock is exact.
    pub fn from_params(params: &AdcParams) -> Option<Box<dyn Effect>> {
        if params.ramp_jitter_ps == 0.0 {
            return None;
        }
        let converter = Converter::new(params);
        // A step in nV per clock, times clocks a second, times ps, is 1e-12 nV: 1e-15 uV.
        let uv_per_nv = 1e-15 * f64_from_u64(params.clock_hz) * params.ramp_jitter_ps;
        let span_uv = 1000.0 * params.lsb_uv() * uv_per_nv;
        let last = params.code_max();
        let (sigmas_uv, sigma_uv_max) = if converter.ramp_levels.has_equal_steps() {
            (vec![f32_nearest(span_uv)], span_uv)
        } else {
            let step_nv =
                |k: u32| converter.ramp_level_nv((k + 1).min(last)) - converter.ramp_level_nv((k + 1).min(last) - 1);
            let sigmas = (0..=last).map(|k| f32_nearest(uv_per_nv * f64_from_i64(step_nv(k)))).collect();
            (sigmas, uv_per_nv * f64_from_i64(converter.ramp_levels.steps_nv().1))
        };
        let conversions = if params.cds == super::params::Cds::Digital { 2.0 } else { 1.0 };
        Some(Box::new(Self { converter, sigmas_uv, sigma_uv_max, conversions }))
    }

    fn add(&self, key: DrawKey, samples_uv: &mut [f32], uniforms: &mut [u32], draws: &mut [f32]) {
        fill_uniforms(key, uniforms);
        normals(uniforms, draws);
        if let [sigma_uv] = self.sigmas_uv[..] {
            add_scaled(samples_uv, draws, sigma_uv);
            return;
        }
        for (sample_uv, draw) in samples_uv.iter_mut().zip(draws) {
            *sample_uv += self.sigmas_uv[index(self.converter.undisturbed_count(*sample_uv))] * *draw;
        }
    }
}

impl Effect for RampJitter {
    fn identity(&self) -> Identity {
        Identity { name: "ramp_jitter", number: Self::NUMBER, domain: Domain::Microvolts }
    }

    fn cost_case(&self) -> &'static str {
        match (self.sigmas_uv.len() == 1, self.conversions > 1.0) {
            (true, false) => "",
            (true, true) => "both",
            (false, false) => "bent",
            (false, true) => "bent, both",
        }
    }

    /// No pixel crosses where the ramp is steeper than at its steepest.
    fn omission(&self, facts: &Facts) -> Option<Omission> {
        let sigma_e = self.sigma_uv_max / facts.conversion_gain_uv_per_e;
        Some(Omission { bias_e: 0.0, variance_e2: self.conversions * sigma_e * sigma_e })
    }

    fn reason(&self, facts: &Facts) -> String {
        let (most_uv, gain) = (self.sigma_uv_max, facts.conversion_gain_uv_per_e);
        format!("at most {most_uv:.3} uV, {:.4} e-, at each crossing", most_uv / gain)
    }

    fn apply(&self, row: &mut RowPass<'_>) {
        self.add(row.temporal_key(Self::NUMBER), row.values, row.uniforms, row.draws);
        if !row.reset.is_empty() {
            self.add(row.reset_key(Self::NUMBER), row.reset, row.uniforms, row.draws);
        }
    }
}
