//! The span of the ramp: full scale and gain together.

use super::params::AdcParams;
use crate::error::Error;
use crate::num::{greater, lesser};

/// Greatest and least gain of a ramp.
pub(super) const GAIN_MOST: f64 = 1000.0;
pub(super) const GAIN_LEAST: f64 = 0.001;

/// An end of a range with six significant digits, moved into the range, so that what a message names is accepted.
fn inward(end: f64, is_least: bool) -> f64 {
    let moved = if is_least { end * (1.0 + 1e-5) } else { end * (1.0 - 1e-5) };
    let rounded: f64 = format!("{end:.5e}").parse().unwrap_or(end);
    let is_inside = if is_least { rounded >= end } else { rounded <= end };
    if is_inside { rounded } else { format!("{moved:.5e}").parse().unwrap_or(end) }
}

impl AdcParams {
    /// The ramp's span, full scale over gain, is 100 uV to 10 V. A full scale that holds at gain 1 is not to blame for the gain.
    pub(super) fn check_span(&self) -> Result<(), Error> {
        let spans_uv = [100.0, 1e7];
        let span_uv = self.full_scale_uv / self.gain;
        if (spans_uv[0]..=spans_uv[1]).contains(&span_uv) {
            return Ok(());
        }
        let span = format!("the ramp spans full_scale_uv / gain = {span_uv} uV");
        if (spans_uv[0]..=spans_uv[1]).contains(&self.full_scale_uv) {
            let [most, least] = spans_uv.map(|span_uv| self.full_scale_uv / span_uv);
            let (least, most) = (inward(greater(GAIN_LEAST, least), true), inward(lesser(GAIN_MOST, most), false));
            let reason = format!("{span}; use {least} to {most} with full_scale_uv = {}", self.full_scale_uv);
            return Err(Error::key("sensor.adc.gain", self.gain, reason));
        }
        let [least, most] = spans_uv.map(|span_uv| span_uv * self.gain);
        let (least, most) = (inward(least, true), inward(most, false));
        let reason = format!("{span}; use {least} to {most} with gain = {}", self.gain);
        Err(Error::key("sensor.adc.full_scale_uv", self.full_scale_uv, reason))
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::adc::params::tests::paper_adc;

    #[test]
    fn a_gain_that_the_full_scale_cannot_have_is_blamed_itself_and_what_is_named_is_accepted() {
        let cases = [
            (1000.0, 50_000.0, "sensor.adc.gain"),
            (500.0, 33_333.3, "sensor.adc.gain"),
            (0.001, 110_000.0, "sensor.adc.gain"),
            (0.003, 777_777.7, "sensor.adc.gain"),
            (1.0, 90.0, "sensor.adc.full_scale_uv"),
            (7.0, 60.0, "sensor.adc.full_scale_uv"),
            (1.0, 2e7, "sensor.adc.full_scale_uv"),
        ];
        for (gain, full_scale_uv, blamed) in cases {
            let params = AdcParams { gain, full_scale_uv, ..paper_adc() };
            let Error::Config { key, reason, .. } = params.check().unwrap_err() else { panic!("no key") };
            assert_eq!(key, blamed, "{gain} {full_scale_uv}: {reason}");
            let named = reason.split("; use ").nth(1).unwrap().split(" with ").next().unwrap();
            for end in named.split(" to ").map(|end| end.parse::<f64>().unwrap()) {
                let mended = if blamed == "sensor.adc.gain" {
                    AdcParams { gain: end, ..params.clone() }
                } else {
                    AdcParams { full_scale_uv: end, ..params.clone() }
                };
                mended.check().unwrap_or_else(|error| panic!("{end} is named and refused: {error}"));
            }
        }
    }
}
