//! The noise of a frame taken apart: what each effect adds to each pixel, as the difference between the sensor with all its effects
//! and the sensor without this one, under equal draws.

use super::grey::grey;
use sensel::effects::{self, ALL};
use sensel::error::Error;
use sensel::num::{f64_from_usize, index, u32_truncated};
use sensel::run::probe::PictureId;
use sensel::run::{Frame, Setup};
use serde_json::{Value, json};

/// Bins of a histogram.
const BINS: usize = 61;

/// A part of the noise.
struct NoisePart {
    name: &'static str,
    summary: &'static str,
    /// Input-referred, in e-.
    added_e: Vec<f32>,
    mean_e: f64,
    variance_e2: f64,
    /// Three standard deviations: the edge of histogram and picture.
    reach_e: f64,
}

/// All parts of the noise of a frame.
pub struct NoiseParts(Vec<NoisePart>);

impl NoisePart {
    fn new(name: &'static str, summary: &'static str, added_e: Vec<f32>) -> Self {
        let count = f64_from_usize(added_e.len());
        let mean_e = added_e.iter().map(|&value| f64::from(value)).sum::<f64>() / count;
        let variance_e2 = added_e.iter().map(|&value| square(f64::from(value) - mean_e)).sum::<f64>() / count;
        Self { name, summary, mean_e, variance_e2, reach_e: 3.0 * variance_e2.sqrt(), added_e }
    }

    fn histogram(&self) -> Vec<u32> {
        let mut counts = vec![0; BINS];
        for &value in &self.added_e {
            let share = (f64::from(value) - self.mean_e + self.reach_e) / (2.0 * self.reach_e);
            if (0.0..1.0).contains(&share) {
                counts[index(u32_truncated(share * f64_from_usize(BINS)))] += 1;
            }
        }
        counts
    }
}

impl NoiseParts {
    /// Takes a frame apart. Quantisation stands last: code less sample.
    pub fn of(setup: &Setup, picture: PictureId, frame: &Frame) -> Result<Self, Error> {
        let sensor = &setup.sensor;
        if sensor.second.is_some() || sensor.schedule.slots().len() > 1 {
            let reason = "several readings of a pixel become one code; none shows its noise apart";
            return Err(Error::key("sensor.readout.hdr", "", reason));
        }
        let (camera, scenario) = (&frame.cameras[0], &setup.resolved.scenario);
        let gain_uv_per_e = sensor.parameters.pixel.conversion_gain_uv_per_e;
        let kept: Vec<&'static str> = setup.plan.kept.iter().map(|effect| effect.name).collect();
        let signals_e = |names: &[&str]| -> Vec<f32> {
            let chain = sensor.chain(sensor.parameters.adc.gain, [names, &[]], scenario.seed, scenario.sensor.die);
            let rows = setup.samples_at(&chain, picture, &camera.photons);
            let of_row = |row: &sensel::effects::chain::RowSamples| -> Vec<f32> {
                let reset = row.reset_uv.iter().copied().chain(std::iter::repeat(0.0));
                let signal =
                    row.signal_uv.iter().zip(reset).map(|(&signal, reset)| f64::from(signal) - f64::from(reset));
                signal.map(|uv| sensel::num::f32_nearest(uv / gain_uv_per_e)).collect()
            };
            rows.iter().flat_map(of_row).collect()
        };
        let all_e = signals_e(&kept);
        let mut parts: Vec<NoisePart> = Vec::with_capacity(kept.len() + 1);
        for entry in ALL.iter().filter(|entry| kept.contains(&entry.name)) {
            let others: Vec<&str> = kept.iter().copied().filter(|name| *name != entry.name).collect();
            let without_e = signals_e(&others);
            let added_e = all_e.iter().zip(&without_e).map(|(all, without)| all - without).collect();
            parts.push(NoisePart::new(entry.name, entry.summary, added_e));
        }
        if let Some(added_e) = quantisation_e(setup, &camera.codes, &all_e) {
            parts.push(NoisePart::new("quantisation", "a code stands for a step of the ramp", added_e));
        }
        debug_assert!(kept.iter().all(|name| effects::names().contains(name)));
        Ok(Self(parts))
    }

    fn part(&self, number: usize) -> Result<&NoisePart, Error> {
        let reason = || Error::key("part", number, format!("0 to {}", self.0.len() - 1));
        self.0.get(number).ok_or_else(reason)
    }

    /// Name, mean, variance, share and histogram of each part.
    pub fn record(&self) -> Value {
        let total_e2: f64 = self.0.iter().map(|part| part.variance_e2).sum();
        let of = |part: &NoisePart| {
            json!({
                "name": part.name,
                "summary": part.summary,
                "mean_e": part.mean_e,
                "sigma_e": part.variance_e2.sqrt(),
                "variance_e2": part.variance_e2,
                "share": if total_e2 > 0.0 { part.variance_e2 / total_e2 } else { 0.0 },
                "reach_e": part.reach_e,
                "histogram": part.histogram(),
            })
        };
        json!({ "total_e2": total_e2, "parts": self.0.iter().map(of).collect::<Vec<_>>() })
    }

    /// A part's picture: grey where it adds its mean, white and black three standard deviations away.
    pub fn picture(&self, number: usize) -> Result<Vec<u8>, Error> {
        let part = self.part(number)?;
        let reach_e = if part.reach_e > 0.0 { part.reach_e } else { 1.0 };
        let shade = |&value: &f32| {
            let share = 0.5 + 0.5 * (f64::from(value) - part.mean_e) / reach_e;
            sensel::num::low_u8(u32_truncated(255.0 * share.clamp(0.0, 1.0) + 0.5))
        };
        Ok(grey(&part.added_e.iter().map(shade).collect::<Vec<u8>>()))
    }
}

/// What rounding to codes adds, of ramps with equal steps; pixels at the ends of the range add nothing.
fn quantisation_e(setup: &Setup, codes: &sensel::plane::Plane<u16>, all_e: &[f32]) -> Option<Vec<f32>> {
    let adc = &setup.sensor.parameters.adc;
    if !adc.has_equal_steps() {
        return None;
    }
    let lsb_e = adc.lsb_uv() / setup.sensor.parameters.pixel.conversion_gain_uv_per_e;
    let most = adc.code_max();
    let of = |(&code, &sample_e): (&u16, &f32)| {
        let code = u32::from(code);
        if code == 0 || code == most {
            return 0.0;
        }
        let code_e = (f64::from(code) - f64::from(adc.black_level_dn)) * lsb_e;
        sensel::num::f32_nearest(code_e - f64::from(sample_e))
    };
    Some(codes.values().iter().zip(all_e).map(of).collect())
}

fn square(value: f64) -> f64 {
    value * value
}
