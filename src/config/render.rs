//! Keys of the render: from `[run]` to its settings, and the sensor's figures in the place of two that are not given.

use super::check::{one_of, within};
use super::scenario::Scenario;
use crate::error::Error;
use crate::fidelity::RenderSettings;
use crate::optics::Rounding;

impl Scenario {
    /// All keys that reach the render. Fails on an unknown name, a number out of range, or rays and a tolerance together.
    pub(super) fn render_settings(&self) -> Result<RenderSettings, Error> {
        let run = &self.run;
        let merges = one_of("run.sampling", &run.sampling, &[("stratified", false), ("subframes", true)])?;
        let subframes = within("run.subframes", run.subframes, 1..=4096, "1 to 4096")?;
        let samples_max = within("run.samples_max", run.samples_max, 16..=65_536, "16 to 65536")?;
        let (samples_per_pixel, tolerance) = self.rays(merges)?;
        let subframes = if merges { subframes } else { 0 };
        let reflections = within("run.reflections", run.reflections, 0..=4, "0 to 4")?;
        let follows_gloss = one_of("run.gloss", &run.gloss, &[("mirrors", false), ("all", true)])?;
        let efficiency = run.render_quantum_efficiency.or_else(|| self.sensor_efficiency()).unwrap_or(1.0);
        let full_well_e = run.render_full_well_e.unwrap_or_else(|| self.sensor_full_well_e());
        Ok(RenderSettings {
            seed: run.render_seed,
            samples_per_pixel,
            samples_max,
            tolerance,
            subframes,
            reflections,
            follows_gloss,
            quantum_efficiency: within("run.render_quantum_efficiency", efficiency, 0.0..=1.0, "0 to 1")?,
            full_well_e: within("run.render_full_well_e", full_well_e, 1.0..=2e9, "1 to 2e9")?,
            rounding_sigma: rounding_sigma(run.photon_rounding)?,
            repeat: 0,
        })
    }

    /// States the sensor's own figures in the render's keys that are not given, where there is a render. What cannot be used is left for
    /// the sensor's own checks to refuse.
    pub(super) fn state_render_keys(&mut self) {
        if self.scene.images.is_none() {
            let efficiency = self.run.render_quantum_efficiency.or_else(|| self.sensor_efficiency());
            let full_well_e = self.run.render_full_well_e.unwrap_or_else(|| self.sensor_full_well_e());
            (self.run.render_quantum_efficiency, self.run.render_full_well_e) = (efficiency, Some(full_well_e));
        }
    }

    /// Electrons of a photon that meets a pixel, at the filters' greatest efficiency.
    fn sensor_efficiency(&self) -> Option<f64> {
        self.mosaic().ok().map(|(_, efficiency)| efficiency * self.sensor.pixel.fill_factor)
    }

    /// Electrons that a pixel holds in its least sensitive reading.
    fn sensor_full_well_e(&self) -> f64 {
        let pixel = &self.sensor.pixel;
        let is_dual = self.sensor.readout.hdr == "dual_gain";
        pixel.full_well_e + if is_dual { pixel.overflow_capacity_e } else { 0.0 }
    }

    /// Rays of every pixel, and the render tolerance in place of them, or 0.
    fn rays(&self, merges: bool) -> Result<(u32, f64), Error> {
        let samples = self.run.samples_per_pixel;
        let samples =
            samples.map(|samples| within("run.samples_per_pixel", samples, 1..=4096, "1 to 4096")).transpose()?;
        let range = "0.001 to 1000, or run.samples_per_pixel = N for N rays in every pixel";
        let tolerance = self.run.render_tolerance;
        let tolerance =
            tolerance.map(|tolerance| within("run.render_tolerance", tolerance, 0.001..=1000.0, range)).transpose()?;
        match (samples, tolerance) {
            (Some(samples), Some(_)) => {
                let reason = "says how many rays where run.render_tolerance says how good; use either one alone";
                Err(Error::key("run.samples_per_pixel", samples, reason))
            }
            (samples, tolerance) => Ok((samples.unwrap_or(1), if merges { 0.0 } else { tolerance.unwrap_or(0.0) })),
        }
    }
}

/// Steps of the mean photons: none, or as many sigmas as `Rounding` takes.
fn rounding_sigma(step: f64) -> Result<f64, Error> {
    let steps = Rounding::STEP_SIGMA_MIN..=Rounding::STEP_SIGMA_MAX;
    if step == 0.0 { Ok(0.0) } else { within("run.photon_rounding", step, steps, "0, or 0.01 to 1 photon sigmas") }
}
