//! From what is known of a scene's light to the regions that the planner judges: bands of signal, each with its own noise.

use super::Parameters;
use super::plan::Region;
use crate::facts::{DieSpread, Facts};
use crate::num::{greater, lesser};
use crate::pixel::{self, PixelParams, flicker_variance_uv2, ktc_sigmas};

/// Bands of signal between the least and the greatest, equal in ratio: within one band the noise differs by less than a factor of two
/// over four decades of signal.
const BANDS: u32 = 8;

/// Signals below this do not divide into further bands: a tenth of an electron is below every sensor's dark noise.
const SIGNAL_E_FLOOR: f64 = 0.1;

/// Bounds that hold for every pixel of a frame.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LightBounds {
    /// Least mean photons of a pixel.
    pub photons_min: f64,
    /// Greatest mean photons of a pixel.
    pub photons_max: f64,
}

/// Temporal dark noise of a pixel in electrons: read noise, 1/f noise and, where it is not removed, kTC noise.
pub fn dark_sigma_e(parameters: &Parameters) -> f64 {
    let pixel = &parameters.pixel;
    let timing = super::sample_timing(parameters);
    let ktc_uv2 = ktc_sigmas(pixel, timing.samples).variance_uv2();
    let flicker_uv2 = flicker_variance_uv2(pixel, timing);
    (pixel.read_noise_uv * pixel.read_noise_uv + ktc_uv2 + flicker_uv2).sqrt() / pixel.conversion_gain_uv_per_e
}

/// What holds for the whole frame.
struct FrameFacts {
    exposure_s: f64,
    storage_s_max: f64,
    /// Greatest mean photoelectrons of a pixel, parasitic light included.
    e_max: f64,
    spill_slope_max: f64,
    dies: DieSpread,
}

/// Greatest mean, and root mean square, of what a pixel holds beside its own light, in electrons.
fn dark_e(parameters: &Parameters, frame: &FrameFacts) -> [f64; 2] {
    let pixel = &parameters.pixel;
    let (charge_e, charge_e2) = pixel::dark_charge_e(pixel, frame.exposure_s, frame.storage_s_max, frame.dies);
    let gain_uv_per_e = pixel.conversion_gain_uv_per_e;
    let (noise_e, offset_e) = (dark_sigma_e(parameters), pixel.die_offset_uv / gain_uv_per_e);
    // Traps are filled half of the time in the mean over traps (`rts_noise`); their amplitudes have the mean square 2 a^2.
    let trap_e = pixel.rts_amplitude_uv / gain_uv_per_e;
    let traps = 1e-6 * pixel.rts_ppm;
    let trap_e2 = traps * 2.0 * trap_e * trap_e;
    let own_e2 = charge_e2 + pixel.dsnu_e * pixel.dsnu_e + noise_e * noise_e + offset_e * offset_e + trap_e2;
    // Neighbours can fill a pixel to its well; the frame before leaves its share of the brightest charge.
    let spilt_e = if frame.spill_slope_max > 1.0 { pixel.full_well_e } else { 0.0 };
    let lag_e = pixel.image_lag / (1.0 - pixel.image_lag) * lesser(frame.e_max, pixel.full_well_e);
    [charge_e + 0.5 * traps * trap_e + spilt_e + lag_e, own_e2.sqrt() + spilt_e + lag_e]
}

/// One LSB in electrons.
pub fn lsb_e(parameters: &Parameters) -> f64 {
    parameters.adc.lsb_uv() / parameters.pixel.conversion_gain_uv_per_e
}

/// Greatest mean photoelectrons of a pixel that the planner reckons with. Beyond twice what a pixel and its converter hold, more
/// light changes nothing: the slope of everything after is 0, unless the rest spills over.
pub fn most_e(parameters: &Parameters, light_e: f64) -> f64 {
    let pixel = &parameters.pixel;
    if pixel.blooming > 0.0 {
        return light_e;
    }
    let held_e = greater(pixel.full_well_e, f64::from(parameters.adc.code_max()) * lsb_e(parameters));
    lesser(light_e, 2.0 * held_e)
}

/// Edges of the bands between two signals.
fn edges_e(low_e: f64, high_e: f64) -> Vec<f64> {
    let start_e = greater(low_e, SIGNAL_E_FLOOR);
    let ratio = if high_e > start_e { libm::pow(high_e / start_e, 1.0 / f64::from(BANDS)) } else { 1.0 };
    let mut edges_e = vec![low_e];
    let mut edge_e = start_e;
    for _ in 1..BANDS {
        edge_e *= ratio;
        if edge_e > low_e && edge_e < high_e {
            edges_e.push(edge_e);
        }
    }
    edges_e.push(greater(high_e, low_e));
    edges_e
}

/// The regions of a frame: `sigma_t^2 = N_e + sigma_dark^2 + LSB_e^2 / 12`, taken at each band's lower end, where it is least; the
/// light's own noise as far as a compressed gain leaves it.
pub fn regions(
    parameters: &Parameters,
    light: LightBounds,
    exposure_s: f64,
    storage_s_max: f64,
    dies: DieSpread,
) -> Vec<Region> {
    let pixel: &PixelParams = &parameters.pixel;
    let efficiency = pixel.quantum_efficiency * pixel.fill_factor;
    let with_parasitic = 1.0 + pixel::parasitic_share(pixel, exposure_s, storage_s_max);
    let light_e = light.photons_max * efficiency * with_parasitic;
    let high_e = most_e(parameters, light_e);
    let low_e = lesser(light.photons_min * efficiency, high_e);
    let spill_slope_max = pixel::spill_slope_max(pixel, high_e, [exposure_s, storage_s_max], dies);
    let frame = FrameFacts { exposure_s, storage_s_max, e_max: high_e, spill_slope_max, dies };
    let ([dark_mean_e, dark_rms_e], dark_e) = (dark_e(parameters, &frame), dark_sigma_e(parameters));
    // The noise that a pixel has anyway is least where the ramp is finest.
    let step_e = parameters.adc.lsb_uv_min() / parameters.pixel.conversion_gain_uv_per_e;
    edges_e(low_e, high_e)
        .windows(2)
        .map(|band| {
            let slope = pixel::compressed_slope_min(pixel, band[1] + dark_rms_e);
            let facts = Facts {
                signal_e_min: band[0],
                signal_e_max: band[1],
                is_capped: high_e < light_e && band[1] >= high_e,
                frame_e_max: high_e,
                dark_mean_e,
                dark_rms_e,
                exposure_s,
                storage_s_max,
                temperature_k: pixel.temperature_k,
                dies,
                conversion_gain_uv_per_e: pixel.conversion_gain_uv_per_e,
                spill_slope_max,
                gain_slope_max: pixel::die_gain_max(pixel, dies),
            };
            Region { facts, sigma_e: (slope * slope * band[0] + dark_e * dark_e + step_e * step_e / 12.0).sqrt() }
        })
        .collect()
}
