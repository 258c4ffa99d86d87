//! Where bytes come from and go to: the core itself does no input or output.

use std::sync::Arc;

use crate::error::Error;
use crate::optics::{Exposure, Rounding};
use crate::rtl_simulator::RtlSimulator;
use crate::scene::PictureBytes;

/// Files of a scenario, and a store for baked light.
pub trait Assets: Sync {
    /// The bytes of a file named in the scenario, relative to the scenario's folder. Fails where the file is not there, or not in that
    /// folder.
    fn read(&self, name: &str) -> Result<Vec<u8>, Error>;

    /// Names of the files in a folder of the scenario's folder ("" is that folder itself), sorted, without those of folders inside. Fails
    /// on the folder is not there, or not in the scenario's folder.
    fn list(&self, folder: &str) -> Result<Vec<String>, Error> {
        Err(Error::Content {
            file: folder.to_owned(),
            reason: "there are no folders here; use a generated scene".to_owned(),
        })
    }

    /// The same files for reading while a run goes on; none where all must be read before.
    fn during_run(&self) -> Option<Arc<dyn PictureBytes>> {
        None
    }

    /// A simulator of the sensor's Verilog, for the rung `rtl`. Fails where there is none, or it does not work.
    fn rtl_simulator(&self) -> Result<Arc<dyn RtlSimulator>, Error> {
        Err(Error::key("run.rung", "rtl", "there are no programs here to run Verilog; use clocked"))
    }

    /// Bytes stored under a content hash earlier, if any.
    fn load(&self, _key: &str) -> Option<Vec<u8>> {
        None
    }

    /// Stores bytes under a content hash; failing to do so costs time later, nothing else.
    fn store(&self, _key: &str, _bytes: &[u8]) {}
}

/// No files at all: generated scenes and motions only (the browser).
pub struct NoFiles;

impl Assets for NoFiles {
    fn read(&self, name: &str) -> Result<Vec<u8>, Error> {
        Err(Error::Content {
            file: name.to_owned(),
            reason: "there are no files here; use a generated scene".to_owned(),
        })
    }
}

/// Where photons are kept between runs. Several processes may share it; a failure costs time, never a photon.
pub trait PhotonStore: Send + Sync {
    /// The exposure under a key, if it is there and whole.
    fn load(&self, key: &str) -> Option<Exposure>;

    /// Keeps an exposure under a key; its photons are rounded so, if at all.
    fn keep(&self, key: &str, exposure: &Exposure, rounding: Option<Rounding>);
}

/// Measures time for the report; the library reads no clock.
pub trait Stopwatch: Sync {
    /// Seconds since some fixed instant.
    fn now_s(&self) -> f64;
}

/// A stopped clock, for runs whose cost is not measured.
pub struct NoClock;

impl Stopwatch for NoClock {
    fn now_s(&self) -> f64 {
        0.0
    }
}

/// Told how far a long piece of work has come.
pub trait Progress: Sync {
    /// `share` of the work called `what` is done, 0 to 1.
    fn at(&self, what: &'static str, share: f64);
}

/// Discards progress.
pub struct NoProgress;

impl Progress for NoProgress {
    fn at(&self, _: &'static str, _: f64) {}
}
