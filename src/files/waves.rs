//! Writes signals and their changes as an FST or VCD file for GTKWave and Surfer, or as a picture of one row, by the file's extension.
//!
//! FST and VCD hold the same: one tick is a picosecond, and only changes are written. They contain no date, so the same waves give the
//! same bytes.

use std::path::{Path, PathBuf};

use super::folder::{check_file, replace_file};
use crate::error::Error;
use crate::waves::Waves;
pub use crate::waves::encode::{fst_bytes, vcd_bytes};

/// Kinds of waveform file.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum WaveFormat {
    /// GTKWave's compressed format.
    Fst,
    /// IEEE 1364's text format.
    Vcd,
    /// A picture of the first row's conversions.
    Svg,
}

/// A waveform file to be written.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct WaveFile {
    path: PathBuf,
    format: WaveFormat,
}

impl WaveFile {
    /// A file of the format that its extension says. Fails on another extension, or a folder of this name.
    pub fn new(path: &Path) -> Result<Self, Error> {
        let extension = path.extension().map(|extension| extension.to_string_lossy().to_ascii_lowercase());
        let format = match extension.as_deref() {
            Some("fst") => WaveFormat::Fst,
            Some("vcd") => WaveFormat::Vcd,
            Some("svg") => WaveFormat::Svg,
            _ => {
                let reason = "is no waveform file; use a name ending in .fst, .vcd or .svg";
                return Err(Error::key("--waves", path.display(), reason));
            }
        };
        if path.is_dir() {
            return Err(Error::key("--waves", path.display(), "is a folder; name a file"));
        }
        Ok(Self { path: path.to_owned(), format })
    }

    /// Where it goes.
    pub fn path(&self) -> &Path {
        &self.path
    }

    /// Whether it could be written, before long work is done for it.
    pub fn check(&self) -> Result<(), Error> {
        check_file(&self.path)
    }

    /// Writes the file beside its target and renames it; `name` is the picture's heading. Fails where the disk says no; then what stood
    /// there still stands.
    pub fn write(&self, waves: &Waves, name: &str) -> Result<(), Error> {
        let bytes = match self.format {
            WaveFormat::Fst => fst_bytes(waves),
            WaveFormat::Vcd => vcd_bytes(waves),
            WaveFormat::Svg => Ok(crate::waves::plot::svg(waves, name).into_bytes()),
        };
        replace_file(&self.path, &bytes.map_err(super::errors::io_error(&self.path))?)
    }
}
