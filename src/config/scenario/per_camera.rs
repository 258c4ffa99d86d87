//! A value for all cameras, or one for each.

use crate::error::Error;
use crate::num::f64_from_usize;
use serde::{Deserialize, Serialize};

/// A number for every camera.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[cfg_attr(feature = "cli", derive(schemars::JsonSchema))]
#[serde(untagged, expecting = "expected a number, or a list of numbers with one for each camera")]
pub enum PerCamera {
    /// The step from camera to camera: the first has 0, the second this, the third twice this.
    Step(f64),
    /// One a camera.
    Each(Vec<f64>),
}

impl PerCamera {
    /// The number of each camera. Fails on a list of another length than the rig.
    pub fn numbers(&self, key: &str, cameras: usize) -> Result<Vec<f64>, Error> {
        match self {
            Self::Step(step) => Ok((0..cameras).map(|camera| f64_from_usize(camera) * step).collect()),
            Self::Each(numbers) if numbers.len() == cameras => Ok(numbers.clone()),
            Self::Each(numbers) => {
                let reason = format!("use one for each camera, {cameras} numbers");
                Err(Error::key(key, format!("{numbers:?}"), reason))
            }
        }
    }
}
