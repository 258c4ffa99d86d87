//! The sensor that the benches time: the peers' job (peers/sensor_speed.py). VGA, a ramp from 0 to a greatest number of photons, QE 0.6,
//! full well 11,000 e-, PRNU 1 %, DSNU 3 e-, read noise 4 e-, 10 bit; ours adds dark current, column offsets and counted events.

// A bench's sizes are small and whole.
#![allow(clippy::cast_possible_truncation, dead_code)]

use sensel::adc::{AdcParams, Cds, Ramp};
use sensel::effects::chain::{Capture, Chain, RowTimes};
use sensel::effects::{self, Parameters};
use sensel::pixel::{PixelParams, PixelType};
use sensel::plane::Plane;
use sensel::units::{CameraIndex, FrameIndex, Size};

pub const WIDTH: usize = 640;
pub const HEIGHT: u32 = 480;

pub fn pixel_params() -> PixelParams {
    PixelParams {
        pixel_type: PixelType::T6,
        pitch_um: 3.0,
        quantum_efficiency: 0.6,
        fill_factor: 1.0,
        conversion_gain_uv_per_e: 10.0,
        full_well_e: 11_000.0,
        dark_current_e_per_s: 100.0,
        dark_doubling_k: 8.0,
        temperature_k: 300.0,
        read_noise_uv: 40.0,
        ktc_noise_uv: None,
        prnu: 0.01,
        dsnu_e: 3.0,
        double_sampling: true,
    }
}

pub fn adc_params() -> AdcParams {
    AdcParams {
        bits: 10,
        clock_hz: 480_000_000,
        full_scale_uv: 110_000.0 * 1024.0 / 959.0,
        gain: 1.0,
        black_level_dn: 64,
        column_offset_uv: 200.0,
        column_offset_residual_uv: 20.0,
        column_gain_sigma: 0.0,
        reset_counts: 128,
        settle_reset_us: 2.0,
        settle_signal_us: 3.0,
        cds: Cds::Digital,
        ramp: Ramp::Linear,
    }
}

pub struct Sensor {
    chain: Chain,
    photons: Plane<f32>,
    times: Vec<RowTimes>,
}

impl Sensor {
    pub fn new(photons_max: f32) -> Self {
        let parameters = Parameters { pixel: pixel_params(), adc: adc_params() };
        let effects = effects::build_all(&parameters);
        let row = (0..WIDTH).map(|column| photons_max * column as f32 / (WIDTH - 1) as f32);
        let size = Size { width_px: WIDTH as u32, height_px: HEIGHT };
        let photons = Plane::from_values(size, row.cycle().take(size.pixel_count()).collect());
        let times = vec![RowTimes { exposure_s: 0.01, storage_s: 0.001 }; HEIGHT as usize];
        Self { chain: Chain::new(parameters, effects, 1, 2), photons, times }
    }

    pub fn frame(&self, frame: u32) -> u16 {
        let capture = Capture { camera: CameraIndex(0), frame: FrameIndex(frame) };
        let (codes, events) = self.chain.capture(&self.photons, capture, &self.times);
        std::hint::black_box(events);
        codes.at(320, 240)
    }
}
