//! Converts the target keys of `[scene]` to a target request. The target itself checks the values.

use super::scenario::Scene;
use crate::error::Error;
use crate::scene::target::TargetRequest;

impl Scene {
    /// Keys of targets, by name.
    fn target_sizes(&self) -> Vec<(&'static str, Option<f64>)> {
        vec![
            ("target_distance_m", self.target_distance_m),
            ("target_size_m", self.target_size_m),
            ("target_angle_deg", self.target_angle_deg),
            ("target_contrast", self.target_contrast),
            ("target_steps", self.target_steps),
            ("target_square_m", self.target_square_m),
            ("target_point_m", self.target_point_m),
            ("target_point_cd", self.target_point_cd),
        ]
    }

    /// What the user said about the target.
    pub fn target_request(&self) -> TargetRequest {
        let (reflectance, illuminance_lux) = (self.reflectance, self.illuminance_lux);
        TargetRequest { reflectance, illuminance_lux, sizes: self.target_sizes() }
    }

    /// Refuses keys of targets where there is none. Fails with the first such key.
    pub fn check_target_keys(&self) -> Result<(), Error> {
        let given = self.target_sizes().into_iter().find_map(|(key, value)| Some((key, value?)));
        match given.filter(|_| self.target.is_none()) {
            Some((key, value)) => {
                let reason = "has no effect here; use a scene.target, or leave it out";
                Err(Error::key(&format!("scene.{key}"), value, reason))
            }
            None => Ok(()),
        }
    }
}
