//! The browser's face of sensel: frames of a scenario without files, their features, figures and hashes. No physics here.

use sensel::config::Resolved;
use sensel::run::{Frame, NoClock, NoFiles, NoProgress, Session as Run, Setup};
use serde_json::json;
use wasm_bindgen::prelude::*;

/// A run in progress.
#[wasm_bindgen]
pub struct Session {
    run: Run,
}

/// The first camera's part of a frame, and figures of the run so far.
#[wasm_bindgen]
pub struct Step {
    frame: Frame,
    bits: u32,
    black_level_dn: u32,
    summary: String,
}

fn failed(error: &sensel::error::Error) -> JsError {
    JsError::new(&error.to_string())
}

#[wasm_bindgen]
impl Session {
    /// Prepares a scenario, as TOML, that needs no files.
    ///
    /// # Errors
    /// As the native program's, with line, key, value and what would do.
    #[wasm_bindgen(constructor)]
    pub fn new(scenario: &str) -> Result<Session, JsError> {
        let resolved = Resolved::from_layers("scenario", scenario, &[]).map_err(|error| failed(&error))?;
        let setup = Setup::new(resolved, &NoFiles, &NoProgress).map_err(|error| failed(&error))?;
        let run = Run::new(setup).map_err(|error| failed(&error))?;
        Ok(Self { run })
    }

    /// Simulates the next frame.
    ///
    /// # Errors
    /// A motion that ends before this frame.
    pub fn step(&mut self) -> Result<Step, JsError> {
        let frame = self.run.step(&NoClock).map_err(|error| failed(&error))?;
        let setup = self.run.setup();
        let account = self.run.energy();
        let cameras = sensel::num::f64_from_usize(setup.cameras.len());
        let [photons, codes, features, energy, poses] = self.run.hashes();
        let tracked = frame.tracked.as_ref();
        let camera = &frame.cameras[0];
        let codes_sum: u64 = camera.codes.values().iter().map(|&code| u64::from(code)).sum();
        let pixels = sensel::num::f64_from_usize(setup.sensor.size.pixel_count());
        let bits = setup.sensor.bits();
        let summary = json!({
            "frame": frame.frame.0,
            "features": camera.features.len(),
            "mean_code_dn": sensel::num::f64_from_u64(codes_sum) / pixels,
            "raw_bits": pixels * f64::from(bits),
            "feature_bits": self.run.feature_bits_of(frame.frame, &camera.features_clk),
            "energy_uj": account.total_pj_per_frame() * 1e-6 / cameras,
            "kept": setup.plan.kept.iter().map(|effect| effect.name).collect::<Vec<_>>(),
            "omitted": setup.plan.omitted.iter().map(|effect| effect.name).collect::<Vec<_>>(),
            "hashes": {"photons": photons, "codes": codes, "features": features, "energy": energy, "poses": poses},
            "has_pose": tracked.is_some_and(|tracked| tracked.world_from_body.is_some()),
            "keyframe": tracked.is_some_and(|tracked| tracked.keyframe),
        });
        let black_level_dn = setup.sensor.parameters.adc.black_level_dn;
        Ok(Step { bits, black_level_dn, summary: summary.to_string(), frame })
    }
}

#[wasm_bindgen]
impl Step {
    /// Columns of the picture.
    #[wasm_bindgen(getter)]
    pub fn width(&self) -> u32 {
        self.frame.cameras[0].codes.size().width_px
    }

    /// Rows of the picture.
    #[wasm_bindgen(getter)]
    pub fn height(&self) -> u32 {
        self.frame.cameras[0].codes.size().height_px
    }

    /// Codes for a person's eye, as red, green, blue and opacity.
    pub fn pixels(&self) -> Vec<u8> {
        let picture = sensel::report::display_curve(&self.frame.cameras[0].codes, self.bits, self.black_level_dn);
        picture.values().iter().flat_map(|&value| [value, value, value, 255]).collect()
    }

    /// Places of the features in pixels: x, y, x, y, ...
    pub fn features(&self) -> Vec<f32> {
        let features = &self.frame.cameras[0].features;
        features.iter().flat_map(|feature| [feature.x_px(), feature.y_px()].map(sensel::num::f32_nearest)).collect()
    }

    /// Figures of this frame and hashes of the run so far, as JSON.
    pub fn summary(&self) -> String {
        self.summary.clone()
    }
}
