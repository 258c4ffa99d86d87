//! From what is known of a scene's light to the regions that the planner judges: bands of signal, each with its own noise.

use super::Parameters;
use super::plan::Region;
use crate::facts::Facts;
use crate::pixel::ktc_sigmas;

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

/// Temporal dark noise of a pixel in electrons: read noise and, where it is not removed, kTC noise.
pub fn dark_sigma_e(parameters: &Parameters) -> f64 {
    let pixel = &parameters.pixel;
    let ktc_uv2 = ktc_sigmas(pixel, parameters.adc.cds.samples()).variance_uv2();
    (pixel.read_noise_uv * pixel.read_noise_uv + ktc_uv2).sqrt() / pixel.conversion_gain_uv_per_e
}

/// Root mean square of what a pixel holds in the dark after that time, in electrons.
fn dark_rms_e(parameters: &Parameters, gathering_s: f64) -> f64 {
    let pixel = &parameters.pixel;
    let charge_e = pixel.dark_current_now_e_per_s() * gathering_s;
    let noise_e = dark_sigma_e(parameters);
    (charge_e * charge_e + charge_e + pixel.dsnu_e * pixel.dsnu_e + noise_e * noise_e).sqrt()
}

/// One LSB in electrons.
pub fn lsb_e(parameters: &Parameters) -> f64 {
    parameters.adc.lsb_uv() / parameters.pixel.conversion_gain_uv_per_e
}

/// The regions of a frame: `sigma_t^2 = N_e + sigma_dark^2 + LSB_e^2 / 12`, taken at each band's lower end, where it is least.
pub fn regions(
    parameters: &Parameters,
    light: LightBounds,
    exposure_s: f64,
    storage_s_max: f64,
    pixels: f64,
) -> Vec<Region> {
    let efficiency = parameters.pixel.quantum_efficiency * parameters.pixel.fill_factor;
    // Beyond twice what a pixel and its converter hold, more light changes nothing: the slope of everything after is 0.
    let held_e =
        crate::num::greater(parameters.pixel.full_well_e, f64::from(parameters.adc.code_max()) * lsb_e(parameters));
    let most_e = crate::num::lesser(light.photons_max * efficiency, 2.0 * held_e);
    let (low_e, high_e) = (crate::num::lesser(light.photons_min * efficiency, most_e), most_e);
    let dark_e = dark_sigma_e(parameters);
    // The noise that a pixel has anyway is least where the ramp is finest.
    let step_e = parameters.adc.lsb_uv_min() / parameters.pixel.conversion_gain_uv_per_e;
    let start_e = crate::num::greater(low_e, SIGNAL_E_FLOOR);
    let ratio = if high_e > start_e { libm::pow(high_e / start_e, 1.0 / f64::from(BANDS)) } else { 1.0 };
    let mut edges_e = vec![low_e];
    let mut edge_e = start_e;
    for _ in 1..BANDS {
        edge_e *= ratio;
        if edge_e > low_e && edge_e < high_e {
            edges_e.push(edge_e);
        }
    }
    edges_e.push(crate::num::greater(high_e, low_e));
    edges_e
        .windows(2)
        .map(|band| Region {
            facts: Facts {
                signal_e_min: band[0],
                signal_e_max: band[1],
                dark_rms_e: dark_rms_e(parameters, exposure_s + storage_s_max),
                exposure_s,
                storage_s_max,
                temperature_k: parameters.pixel.temperature_k,
                pixels,
                conversion_gain_uv_per_e: parameters.pixel.conversion_gain_uv_per_e,
            },
            sigma_e: (band[0] + dark_e * dark_e + step_e * step_e / 12.0).sqrt(),
        })
        .collect()
}
