//! The sensor that the benches time: the peers' job (peers/sensor_speed.py). VGA, a ramp from 0 to a greatest number of photons, QE 0.6,
//! full well 11,000 e-, PRNU 1 %, DSNU 3 e-, read noise 4 e-, 10 bit; ours adds dark current, column offsets and counted events.

// A bench's sizes are small and whole.
#![allow(clippy::cast_possible_truncation, dead_code)]

use sensel::config::Resolved;
use sensel::effects::chain::{Capture, Chain, RowTimes};
use sensel::effects::{self, Parameters};
use sensel::plane::Plane;
use sensel::units::{CameraIndex, FrameIndex, Size};

pub const WIDTH: usize = 640;
pub const HEIGHT: u32 = 480;

/// The peers' job as a configuration, with dark current and column offsets besides; what is not named is the default sensor's.
pub fn parameters() -> Parameters {
    parameters_with(&[])
}

/// Takes away what the peers do not have: after this both sides do Poisson, PRNU, DSNU, full well, read noise and a 10-bit converter.
pub const PEERS_ALONE: [&str; 2] =
    ["sensor.pixel.dark_current_e_per_s=0.0", "sensor.adc.column_offset_residual_uv=0.0"];

pub fn parameters_with(more: &[&str]) -> Parameters {
    let mut assignments = vec![
        "scene.generator=box",
        "sensor.pixel.fill_factor=1.0",
        "sensor.pixel.full_well_e=11000.0",
        "sensor.pixel.dark_current_e_per_s=100.0",
        "sensor.pixel.read_noise_uv=40.0",
        "sensor.pixel.dsnu_e=3.0",
        "sensor.adc.full_scale_uv=117455.0",
        "sensor.adc.column_gain_sigma=0.0",
        "sensor.adc.cds=analog",
    ];
    assignments.extend(more);
    let assignments: Vec<String> = assignments.into_iter().map(str::to_owned).collect();
    let resolved = Resolved::from_layers("bench", "", &assignments).expect("the keys are known");
    let scenario = &resolved.scenario;
    Parameters { pixel: scenario.pixel().expect("in range"), adc: scenario.adc().expect("in range") }
}

pub struct Sensor {
    chain: Chain,
    photons: Plane<f32>,
    times: Vec<RowTimes>,
}

impl Sensor {
    pub fn new(photons_max: f32) -> Self {
        Self::of(parameters(), photons_max)
    }

    pub fn of(parameters: Parameters, photons_max: f32) -> Self {
        let effects = effects::build_all(&parameters);
        let row = (0..WIDTH).map(|column| photons_max * column as f32 / (WIDTH - 1) as f32);
        let size = Size { width_px: WIDTH as u32, height_px: HEIGHT };
        let photons = Plane::from_values(size, row.cycle().take(size.pixel_count()).collect());
        let times = vec![RowTimes { exposure_s: 0.01, storage_s: 0.001, readout_s: 0.0 }; HEIGHT as usize];
        Self { chain: Chain::new(parameters, effects, 1, 2), photons, times }
    }

    pub fn frame(&self, frame: u32) -> u16 {
        let capture = Capture::single(CameraIndex(0), FrameIndex(frame));
        let captured = self.chain.capture(&self.photons, capture, &self.times);
        std::hint::black_box(captured.events);
        captured.codes.at(320, 240)
    }
}
