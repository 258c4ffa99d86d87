//! `--waves` of `run` and `timing`: what is asked for, checked before anything runs, and the file at the end.

use sensel::effects::chain::RowSamples;
use sensel::error::Error;
use sensel::files::waves::WaveFile;
use sensel::run::SensorSetup;
use sensel::waves::{Asked, WavePlan};

use super::args::WaveArguments;

/// Waveforms that were asked for.
pub struct WaveRequest<'a> {
    /// What they show.
    pub plan: WavePlan<'a>,
    file: WaveFile,
}

impl<'a> WaveRequest<'a> {
    /// Checks file, rows, columns and frame; none where no waves were asked for.
    pub fn new(
        arguments: &WaveArguments,
        frame: Option<u32>,
        sensor: &'a SensorSetup,
        frames: u32,
    ) -> Result<Option<Self>, Error> {
        let Some(path) = &arguments.waves else { return Ok(None) };
        let file = WaveFile::new(path)?;
        let (rows, columns) = (arguments.wave_rows.as_deref(), arguments.wave_columns.as_deref());
        let plan = WavePlan::new(sensor, Asked { rows, columns, frame }, frames)?;
        Ok(Some(Self { plan, file }))
    }

    /// Writes the waves of the chosen rows, from their samples.
    pub fn write(&self, rows: &[RowSamples]) -> Result<(), Error> {
        self.file.write(&self.plan.waves(rows)?)
    }
}
