//! From the light's keys to its spectrum and level.

use super::check::{one_of, within};
use super::scenario::Scenario;
use crate::error::Error;
use crate::scene::Illuminant;

impl Scenario {
    /// The light's spectrum and its level in lux.
    ///
    /// # Errors
    /// An unknown name, or a level that is not above 0 and at most 200,000.
    pub fn light(&self) -> Result<(Illuminant, f64), Error> {
        let names = Illuminant::ALL.map(|illuminant| (illuminant.name(), illuminant));
        let illuminant = one_of("scene.illuminant", &self.scene.illuminant, &names)?;
        let would_do = "1e-6 to 200,000 (starlight 0.001, office 500, direct sun 100,000)";
        let lux = within("scene.illuminance_lux", self.scene.illuminance_lux, 1e-6..=200_000.0, would_do)?;
        Ok((illuminant, lux))
    }
}
