//! Photodiode, transfer gate and conversion gain. Enters: mean photons. Leaves: microvolts at the column.
//!
//! The two structural steps (`photons_to_mean_electrons`, `electrons_to_microvolts`) always run; everything else is an
//! effect that a scene may or may not call for.

mod dark_current;
mod dsnu;
mod full_well;
mod ktc_noise;
mod params;
mod pattern;
mod prnu;
mod read_noise;
mod row;
mod shot_noise;

pub use dark_current::DarkCurrent;
pub use dsnu::Dsnu;
pub use full_well::FullWell;
pub use ktc_noise::KtcNoise;
pub use params::{PixelParams, PixelType};
pub(crate) use params::{above, within};
pub use pattern::Pattern;
pub use prnu::Prnu;
pub use read_noise::ReadNoise;
pub use row::{add_scaled, add_to_all, scale_all, scale_by_pattern};
pub use shot_noise::ShotNoise;

use crate::effect::Effect;
use crate::num::f32_nearest;

/// The pixel's effects that the parameters leave possible, in physical order.
pub fn effects(params: &PixelParams) -> Vec<Box<dyn Effect>> {
    let all = [
        Prnu::from_params(params),
        ShotNoise::from_params(params),
        DarkCurrent::from_params(params),
        Dsnu::from_params(params),
        FullWell::from_params(params),
        KtcNoise::from_params(params),
        ReadNoise::from_params(params),
    ];
    all.into_iter().flatten().collect()
}

/// Turns mean photons on the pixel into mean photoelectrons, in place: quantum efficiency times fill factor.
pub fn photons_to_mean_electrons(params: &PixelParams, values: &mut [f32]) {
    scale_all(values, f32_nearest(params.quantum_efficiency * params.fill_factor));
}

/// Turns electrons into microvolts at the ADC's input, in place; a brighter pixel is a greater value.
pub fn electrons_to_microvolts(params: &PixelParams, values: &mut [f32]) {
    scale_all(values, f32_nearest(params.conversion_gain_uv_per_e));
}
