//! What a fit says of a parameter.

use serde::Serialize;

/// Standard errors of a 95 % interval.
pub const SIGMAS: f64 = 1.96;

/// A parameter that the frames tell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Fitted {
    /// Key of the sensor file.
    pub key: &'static str,
    /// Best value.
    pub value: f64,
    /// 95 % interval.
    pub interval: [f64; 2],
    /// Figure of EMVA 1288, or other figure of the frames, that it rests on.
    pub rests_on: &'static str,
}

/// A parameter that they do not tell.
#[derive(Clone, Debug, PartialEq, Serialize)]
pub struct Undetermined {
    /// Key of the sensor file.
    pub key: &'static str,
    /// Why.
    pub reason: String,
}

impl Undetermined {
    /// A parameter with the reason.
    pub fn new(key: &'static str, reason: impl Into<String>) -> Self {
        Self { key, reason: reason.into() }
    }
}
