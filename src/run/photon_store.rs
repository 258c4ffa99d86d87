//! Where photons are kept between runs.

use crate::optics::{Exposure, Rounding};

/// Where exposures are kept. Several processes may share it; a failure costs time, never a photon.
pub trait PhotonStore: Send + Sync {
    /// The exposure under a key, if it is there and whole.
    fn load(&self, key: &str) -> Option<Exposure>;

    /// Keeps an exposure under a key; its photons are rounded so, if at all.
    fn keep(&self, key: &str, exposure: &Exposure, rounding: Option<Rounding>);
}
