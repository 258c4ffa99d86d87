//! The browser's face of sensel: frames of a scenario without files, one pixel's way to its code, and the figures of the run so far.
//! No physics here: every number comes from the library.

mod conversion;
mod figures;
mod grey;
mod host;
mod noise;
mod rows;
mod transfer;
mod window;

use grey::grey;
use host::{Memory, PageStopwatch, Tell};
use sensel::config::Resolved;
use sensel::effects::chain::RowSamples;
use sensel::error::Error;
use sensel::plane::Plane;
use sensel::run::probe::PictureId;
use sensel::run::{Frame, Session as Run, Setup};
use sensel::units::Size;
use wasm_bindgen::prelude::*;

/// A run in progress, with its last frame.
#[wasm_bindgen]
pub struct Session {
    run: Run,
    frame: Option<Frame>,
    /// What the probe reads of the last frame; computed when it is asked for.
    taken: Option<Taken>,
    noise: Option<noise::NoiseParts>,
}

/// The last frame between photons and codes.
struct Taken {
    electrons: Plane<f32>,
    samples: Vec<RowSamples>,
}

fn failed(error: &Error) -> JsError {
    JsError::new(&error.to_string())
}

/// A text for the page, or the core's error as the page's.
fn answered(answer: Result<serde_json::Value, Error>) -> Result<String, JsError> {
    answer.map(|value| value.to_string()).map_err(|error| failed(&error))
}

fn no_frame() -> Error {
    Error::Run("no frame was simulated yet; step first".to_owned())
}

#[wasm_bindgen]
impl Session {
    /// Prepares a scenario, as TOML, that needs no files.
    ///
    /// # Errors
    /// As the native program's, with line, key, value and an accepted value.
    #[wasm_bindgen(constructor)]
    pub fn new(scenario: &str) -> Result<Session, JsError> {
        let resolved = Resolved::from_layers("scenario", scenario, &[]).map_err(|error| failed(&error))?;
        let setup = Setup::new(resolved, &Memory, &Tell).map_err(|error| failed(&error))?;
        let run = Run::new(setup).map_err(|error| failed(&error))?;
        Ok(Self { run, frame: None, taken: None, noise: None })
    }

    /// A run of another scenario. It takes over the scene, its light and the motion if they are the same. The bytes are those of `new`.
    ///
    /// # Errors
    /// As `new`.
    pub fn beside(&self, scenario: &str) -> Result<Session, JsError> {
        let resolved = Resolved::from_layers("scenario", scenario, &[]).map_err(|error| failed(&error))?;
        let setup = self.run.setup().beside(resolved, &Memory, &Tell).map_err(|error| failed(&error))?;
        let run = Run::new(setup).map_err(|error| failed(&error))?;
        Ok(Self { run, frame: None, taken: None, noise: None })
    }

    /// Simulates the next frame.
    ///
    /// # Errors
    /// A motion that ends before this frame.
    pub fn step(&mut self) -> Result<(), JsError> {
        let frame = self.run.step(&PageStopwatch).map_err(|error| failed(&error))?;
        self.frame = Some(frame);
        (self.taken, self.noise) = (None, None);
        Ok(())
    }

    /// Frames of the whole run.
    #[wasm_bindgen(getter)]
    pub fn frames(&self) -> u32 {
        self.run.setup().frames
    }

    /// Columns of the picture.
    #[wasm_bindgen(getter)]
    pub fn width(&self) -> u32 {
        self.run.setup().sensor.size.width_px
    }

    /// Rows of the picture.
    #[wasm_bindgen(getter)]
    pub fn height(&self) -> u32 {
        self.run.setup().sensor.size.height_px
    }

    /// Codes for a person's eye, as red, green, blue and opacity.
    ///
    /// # Errors
    /// Before the first frame.
    pub fn pixels(&self) -> Result<Vec<u8>, JsError> {
        let sensor = &self.run.setup().sensor;
        let codes = self.codes_plane().map_err(|error| failed(&error))?;
        let black_level_dn = sensor.parameters.adc.black_level_dn;
        let picture = sensel::report::display_curve(codes, sensor.bits(), black_level_dn);
        Ok(grey(picture.values()))
    }

    /// Codes of the last frame, row by row.
    ///
    /// # Errors
    /// Before the first frame.
    pub fn codes(&self) -> Result<Vec<u16>, JsError> {
        Ok(self.codes_plane().map_err(|error| failed(&error))?.values().to_vec())
    }

    /// Mean photons of each pixel of the last frame, row by row.
    ///
    /// # Errors
    /// Before the first frame.
    pub fn photons(&self) -> Result<Vec<f32>, JsError> {
        let frame = self.last().map_err(|error| failed(&error))?;
        Ok(frame.cameras[0].photons.values().to_vec())
    }

    /// Electrons of each pixel of the last frame at the sense node, row by row.
    ///
    /// # Errors
    /// Before the first frame.
    pub fn electrons(&mut self) -> Result<Vec<f32>, JsError> {
        let taken = self.taken().map_err(|error| failed(&error))?;
        Ok(taken.electrons.values().to_vec())
    }

    /// Positions and scores of the features in pixels: x, y, score, 1 where the pose rests on it, x, ...
    ///
    /// # Errors
    /// Before the first frame.
    pub fn features(&self) -> Result<Vec<f32>, JsError> {
        let frame = self.last().map_err(|error| failed(&error))?;
        let camera = &frame.cameras[0];
        let of = |(number, feature): (usize, &sensel::compute::Feature)| {
            let used = camera.tracked.get(number).copied().unwrap_or(false);
            let position_px = [feature.x_px(), feature.y_px()].map(sensel::num::f32_nearest);
            [position_px[0], position_px[1], f32::from(feature.score), f32::from(u8::from(used))]
        };
        Ok(camera.features.iter().enumerate().flat_map(of).collect())
    }

    /// Figures of the run so far, as JSON: hashes, energy, timing, bandwidth, tracking, plan.
    ///
    /// # Errors
    /// Before the first frame.
    pub fn summary(&self) -> Result<String, JsError> {
        answered(self.last().and_then(|frame| figures::summary(&self.run, frame)))
    }

    /// The report of the run so far, as the program writes it.
    ///
    /// # Errors
    /// Before the first frame.
    pub fn report(&self) -> Result<String, JsError> {
        let report = self.run.report("page").and_then(|report| report.to_json());
        report.map_err(|error| failed(&error))
    }

    /// True and estimated positions of the run so far: t, truth x y z, estimate x y z, error, ...; aligned as the report aligns them.
    pub fn trajectory(&self) -> Vec<f64> {
        figures::trajectory(&self.run)
    }

    /// True positions of the run so far: t, x, y, z, ...
    pub fn truth(&self) -> Vec<f64> {
        let of = |pose: &sensel::pose::TimedPose| {
            let position_m = pose.world_from_body.translation_m;
            [pose.t_s, position_m.x, position_m.y, position_m.z]
        };
        self.run.truth().iter().flat_map(of).collect()
    }

    /// One pixel from photons to its code, as JSON.
    ///
    /// # Errors
    /// Before the first frame; a pixel outside the picture.
    pub fn probe(&mut self, x_px: u32, y_px: u32) -> Result<String, JsError> {
        answered(self.probed(x_px, y_px))
    }

    /// One pixel's conversion by the clock: rows of `CONVERSION_FIELDS` numbers, one an instant at which anything changes.
    ///
    /// # Errors
    /// As `probe`; a converter without waveforms.
    pub fn conversion(&mut self, x_px: u32, y_px: u32) -> Result<Vec<f64>, JsError> {
        self.converted(x_px, y_px).map_err(|error| failed(&error))
    }

    /// The same as a waveform file that GTKWave and Surfer read: "fst" or "vcd".
    ///
    /// # Errors
    /// As `conversion`.
    pub fn waveform(&mut self, x_px: u32, y_px: u32, format: &str) -> Result<Vec<u8>, JsError> {
        let waves = self.waves(x_px, y_px).map_err(|error| failed(&error))?;
        let bytes = match format {
            "fst" => sensel::waves::encode::fst_bytes(&waves),
            _ => sensel::waves::encode::vcd_bytes(&waves),
        };
        bytes.map_err(|error| JsError::new(&error.to_string()))
    }

    /// When each row is exposed, read and sent: rows of six numbers in us from the start of the first row's exposure.
    ///
    /// # Errors
    /// Before the first frame; a row that the link cannot carry.
    pub fn rows(&self) -> Result<Vec<f64>, JsError> {
        let rows = self.last().and_then(|frame| rows::rows_us(&self.run.setup().sensor, frame));
        rows.map_err(|error| failed(&error))
    }

    /// Packets of the last frame in time: rows of four numbers: kind, first, start and end in us; kinds as in `rows::kind`.
    ///
    /// # Errors
    /// As `rows`.
    pub fn packets(&self) -> Result<Vec<f64>, JsError> {
        let packets = self.last().and_then(|frame| rows::packets_us(&self.run.setup().sensor, frame));
        packets.map_err(|error| failed(&error))
    }

    /// The window of a feature of the last frame, with the circle of its corner, as JSON.
    ///
    /// # Errors
    /// Before the first frame; a feature that is not there.
    pub fn corner(&self, number: u32) -> Result<String, JsError> {
        let sensor = &self.run.setup().sensor;
        answered(self.last().and_then(|frame| window::corner(sensor, &frame.cameras[0], number)))
    }

    /// The last frame's noise, effect by effect, as JSON.
    ///
    /// # Errors
    /// Before the first frame; more than one exposure a frame.
    pub fn noise(&mut self) -> Result<String, JsError> {
        answered(self.noise_parts().map(noise::NoiseParts::record))
    }

    /// What one part of the noise does to each pixel, as red, green, blue and opacity.
    ///
    /// # Errors
    /// As `noise`; a part that is not there.
    pub fn noise_picture(&mut self, number: usize) -> Result<Vec<u8>, JsError> {
        self.noise_parts().and_then(|parts| parts.picture(number)).map_err(|error| failed(&error))
    }

    /// Photon transfer of this sensor by EMVA 1288, as JSON.
    ///
    /// # Errors
    /// A sensor that does not respond to light.
    pub fn transfer(&self) -> Result<String, JsError> {
        answered(transfer::measured(&self.run.setup().resolved))
    }

    /// The effective scenario as TOML, for as many frames as were simulated.
    pub fn scenario(&self) -> String {
        self.run.setup().resolved.recorded_text()
    }
}

impl Session {
    fn last(&self) -> Result<&Frame, Error> {
        self.frame.as_ref().ok_or_else(no_frame)
    }

    fn codes_plane(&self) -> Result<&Plane<u16>, Error> {
        Ok(&self.last()?.cameras[0].codes)
    }

    fn picture_id(&self) -> Result<PictureId, Error> {
        Ok(PictureId { frame: self.last()?.frame, camera: 0 })
    }

    fn taken(&mut self) -> Result<&Taken, Error> {
        if self.taken.is_none() {
            let (picture, frame, setup) = (self.picture_id()?, self.last()?, self.run.setup());
            let (chain, photons) = (setup.first_chain(), &frame.cameras[0].photons);
            let electrons = setup.electrons_at(&chain, picture, photons);
            self.taken = Some(Taken { electrons, samples: setup.samples_at(&chain, picture, photons) });
        }
        self.taken.as_ref().ok_or_else(no_frame)
    }

    fn noise_parts(&mut self) -> Result<&noise::NoiseParts, Error> {
        if self.noise.is_none() {
            let parts = noise::NoiseParts::of(self.run.setup(), self.picture_id()?, self.last()?)?;
            self.noise = Some(parts);
        }
        self.noise.as_ref().ok_or_else(no_frame)
    }
}

/// Refuses a pixel outside a picture.
fn check_inside(size: Size, x_px: u32, y_px: u32) -> Result<(), Error> {
    if x_px < size.width_px && y_px < size.height_px {
        return Ok(());
    }
    let reason = format!("outside the picture; 0 to {}, 0 to {}", size.width_px - 1, size.height_px - 1);
    Err(Error::key("pixel", format!("{x_px}, {y_px}"), reason))
}
