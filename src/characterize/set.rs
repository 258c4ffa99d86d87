//! The list of shots: light, exposure times and frames of the measurement, in order.
//!
//! EMVA 1288 release 4.0, section 6: a photon-transfer series from near dark to past saturation, two bright and two dark frames a
//! point; section 8: stacks of bright and dark frames at half saturation. Light is constant and the exposure time varies (method 1),
//! so that dark current is measured as well.

use super::channel::ColourPlane;
use crate::error::{Error, within};
use crate::num::{f32_nearest, f64_from_u64, greater, lesser, u64_half_even};
use crate::run::SensorSetup;
use crate::units::{FrameIndex, Size};

/// How large the measurement is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct MeasurementSize {
    /// Rows and columns that are measured, of the colour plane where there are several; none: 320 x 240, or all where that is less.
    pub size: Option<Size>,
    /// Points of photon transfer.
    pub points: u32,
    /// Frames of each spatial stack.
    pub stack: u32,
    /// Letter of the filter whose pixels are measured; none: of the filter that passes most.
    pub channel: Option<char>,
}

impl Default for MeasurementSize {
    fn default() -> Self {
        Self { size: None, points: 42, stack: 48, channel: None }
    }
}

/// Region measured by default.
const SIZE: Size = Size { width_px: 320, height_px: 240 };

/// Longest side of a region: the spectrograms' time grows with its cube.
pub const SIDE_MAX: u32 = 1024;

/// Share of saturation that the last point exceeds it by.
const LAST_SHARE: f64 = 1.14;

/// One exposure time of the series, or of the stacks.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SeriesExposure {
    /// Whole nanoseconds.
    pub exposure_ns: u64,
    /// Mean photons on a pixel under light: exactly what the frames are made from.
    pub photons: f64,
}

impl SeriesExposure {
    /// In seconds.
    pub fn exposure_s(&self) -> f64 {
        f64_from_u64(self.exposure_ns) * 1e-9
    }
}

/// The whole measurement.
#[derive(Clone, Debug, PartialEq)]
pub struct Set {
    /// The measured region, of its colour plane.
    pub size: Size,
    /// The colour plane.
    pub channel: ColourPlane,
    /// Electrons per photon before the filter: QE as the standard means it, fill factor included.
    pub efficiency: f64,
    /// Depth of the codes.
    pub bits: u32,
    /// Photon transfer, exposure rising.
    pub points: Vec<SeriesExposure>,
    /// Of both stacks.
    pub half: SeriesExposure,
    /// Frames of each stack.
    pub stack: u32,
    /// Constant light.
    pub photons_per_s: f64,
    /// Charge of a pixel that the converter or the well clips, in e-, dark charge included.
    pub saturation_e: f64,
    /// The sequencer's own longest exposure in s; exposures here may be longer.
    pub exposure_limit_s: f64,
}

/// One frame to shoot.
#[derive(Clone, Debug, PartialEq)]
pub struct PlannedShot {
    /// Counted over the whole measurement: no two frames share their noise.
    pub frame: FrameIndex,
    /// Exposure and light.
    pub exposure: SeriesExposure,
    /// Whether there is light.
    pub is_lit: bool,
    /// Point of the series; none for the stacks.
    pub point: Option<usize>,
    /// Whether this is the first frame of its point or stack.
    pub is_first: bool,
}

impl Set {
    /// Chooses light and exposures for a sensor.
    /// Fails on options out of range, or a sensor that does not respond to light.
    pub fn new(sensor: &SensorSetup, options: &MeasurementSize) -> Result<Self, Error> {
        let channel = ColourPlane::choose(&sensor.mosaic, options.channel)?;
        let size = region(channel.plane_size(sensor.array), options)?;
        within("points", options.points.into(), 40.0, 1000.0)?;
        within("stack", options.stack.into(), 32.0, 2000.0)?;
        let (pixel, adc) = (&sensor.parameters.pixel, &sensor.parameters.adc);
        let efficiency = pixel.quantum_efficiency * pixel.fill_factor * channel.transmission();
        if !(efficiency > 0.0) {
            let reason = "a pixel without response cannot be measured; use above 0";
            return Err(Error::key("sensor.pixel.quantum_efficiency", pixel.quantum_efficiency, reason));
        }
        let range_e = adc.saturation_uv() / pixel.conversion_gain_uv_per_e;
        let saturation_e = lesser(range_e, pixel.full_well_e);
        let exposure_max_s = exposure_max_s(sensor, saturation_e);
        // The exposure at which the mean pixel is full.
        let full_s = exposure_max_s / LAST_SHARE;
        let dark_e = pixel.dark_current_now_e_per_s() * full_s;
        let photons_per_s = greater(saturation_e - dark_e, 0.5 * saturation_e) / (efficiency * full_s);
        let at = |share: f64| exposure(photons_per_s, share * full_s);
        Ok(Self {
            size,
            channel,
            efficiency,
            bits: adc.bits,
            points: shares(options.points).into_iter().map(at).collect(),
            half: at(0.5),
            stack: options.stack,
            photons_per_s,
            saturation_e,
            exposure_limit_s: longest_s(sensor),
        })
    }

    /// The shots of frames that exist: exposures and light of their points, rising, and of their stacks.
    /// Fails on a sensor that does not respond to light, or sides beyond 16 to 1,024 pixels.
    pub fn of_frames(
        sensor: &SensorSetup,
        size: Size,
        points: Vec<SeriesExposure>,
        half: SeriesExposure,
        stack: u32,
    ) -> Result<Self, Error> {
        let usual = Self::new(sensor, &MeasurementSize { size: Some(size), ..MeasurementSize::default() })?;
        let photons_per_s = half.photons / half.exposure_s();
        Ok(Self { points, half, stack, photons_per_s, ..usual })
    }

    /// Every frame, in the order in which the descriptor names them.
    pub fn shots(&self) -> impl Iterator<Item = PlannedShot> {
        let points = self.points.iter().enumerate().map(|(index, &exposure)| (Some(index), exposure, 2));
        let all = points.chain([(None, self.half, self.stack)]);
        let frames = all.flat_map(|(point, exposure, count)| {
            let lights = [true, false].into_iter();
            lights.flat_map(move |is_lit| (0..count).map(move |index| (point, exposure, is_lit, index == 0)))
        });
        (0..).zip(frames).map(|(number, (point, exposure, is_lit, is_first))| PlannedShot {
            frame: FrameIndex(number),
            exposure,
            is_lit,
            point,
            is_first,
        })
    }

    /// Frames in all.
    pub fn frames(&self) -> u64 {
        4 * crate::num::u64_from(self.points.len()) + 2 * u64::from(self.stack)
    }
}

/// Whole nanoseconds, and photons as the frames' `f32` holds them, so that descriptor and frames agree to the last bit.
fn exposure(photons_per_s: f64, exposure_s: f64) -> SeriesExposure {
    let exposure_ns = u64_half_even(1e9 * exposure_s).max(1);
    let photons = f64::from(f32_nearest(photons_per_s * f64_from_u64(exposure_ns) * 1e-9));
    SeriesExposure { exposure_ns, photons }
}

/// Shares of saturation: three quarters of the points rise evenly to 90 %, the rest bracket saturation in steps of some 2 %, because
/// the standard finds saturation only as finely as the points stand.
fn shares(points: u32) -> Vec<f64> {
    let below = points - points / 4;
    let above = points / 4;
    let rising = (0..below).map(|index| 0.01 + 0.89 * f64::from(index) / f64::from(below - 1));
    let step = (LAST_SHARE - 0.9) / f64::from(above);
    rising.chain((1..=above).map(|index| 0.9 + step * f64::from(index))).collect()
}

/// The sequencer's longest exposure.
fn longest_s(sensor: &SensorSetup) -> f64 {
    f64_from_u64(sensor.schedule.exposure_lines_max()) * sensor.schedule.line_time_s()
}

/// The longest exposure of the set: the sequencer's own where that shows the dark current, else as long as the dark charge's variance
/// needs to reach that of the dark noise, up to a second. It stays short enough that dark charge fills 5 % of saturation.
fn exposure_max_s(sensor: &SensorSetup, saturation_e: f64) -> f64 {
    let pixel = &sensor.parameters.pixel;
    let longest_s = longest_s(sensor);
    let rate_e_per_s = pixel.dark_current_now_e_per_s();
    if !(rate_e_per_s > 0.0) {
        return longest_s;
    }
    let lsb_e = sensor.parameters.adc.lsb_uv() / pixel.conversion_gain_uv_per_e;
    let noise_e = pixel.read_noise_uv / pixel.conversion_gain_uv_per_e;
    let wanted_s = lesser((noise_e * noise_e + lsb_e * lsb_e / 12.0) / rate_e_per_s, 1.0);
    greater(lesser(greater(longest_s, wanted_s), 0.05 * saturation_e / rate_e_per_s), 1e-6)
}

fn region(array: Size, options: &MeasurementSize) -> Result<Size, Error> {
    let Some(asked) = options.size else {
        return Ok(Size {
            width_px: array.width_px.min(SIZE.width_px),
            height_px: array.height_px.min(SIZE.height_px),
        });
    };
    let (width_max, height_max) = (array.width_px.min(SIDE_MAX), array.height_px.min(SIDE_MAX));
    if (16..=width_max).contains(&asked.width_px) && (16..=height_max).contains(&asked.height_px) {
        return Ok(asked);
    }
    let value = format!("{}x{}", asked.width_px, asked.height_px);
    Err(Error::key("size", value, format!("out of range; use 16x16 to {width_max}x{height_max}")))
}
