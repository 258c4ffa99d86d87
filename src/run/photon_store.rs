//! Where photons are kept between runs.

use crate::optics::Exposure;

/// Where exposures are kept. Several processes may share it; a failure costs time, never a photon.
pub trait PhotonStore: Send + Sync {
    /// The exposure under a key, if it is there and whole.
    fn load(&self, key: &str) -> Option<Exposure>;

    /// Keeps an exposure under a key.
    fn keep(&self, key: &str, exposure: &Exposure);
}
