//! `--waves` of `run` and `timing` and the verb `waves`: what is asked for, checked before anything runs, and the file at the end.

use std::path::{Path, PathBuf};

use sensel::config::Resolved;
use sensel::effects::chain::Chain;
use sensel::error::Error;
use sensel::files::waves::WaveFile;
use sensel::run::{Frame, SensorSetup, Session};
use sensel::units::{CameraIndex, RowIndex};
use sensel::waves::{Asked, WavePlan, WaveRow};

use super::args::{CommonOptions, WaveArguments, WavesArguments};
use super::paths;

pub fn main(arguments: &WavesArguments, shared: &CommonOptions) -> Result<(), Error> {
    paths::check_ending("--plot", &arguments.plot, &["svg"], "SVG")?;
    let located = paths::locate_sensor(arguments.sensor.as_deref(), shared)?;
    let sensor = SensorSetup::new(&located.resolved)?;
    let waves = WaveArguments {
        waves: Some(arguments.plot.clone()),
        wave_rows: arguments.row.map(|row| row.to_string()),
        wave_columns: arguments.columns.clone(),
    };
    let request = WaveRequest::new(&waves, None, &sensor, (&located.resolved, &located.name))?;
    let request = request.expect("a file was named");
    request.write_wedge(&sensor, located.resolved.scenario.sensor.die)
}

/// Waveforms that were asked for.
pub struct WaveRequest<'a> {
    plan: WavePlan<'a>,
    file: WaveFile,
    /// The picture's heading.
    name: String,
}

/// The picture of a row's conversions in a result folder.
pub const PICTURE: &str = "waves.svg";

impl<'a> WaveRequest<'a> {
    /// Checks file, rows, columns and frame; none where no waves were asked for.
    pub fn new(
        arguments: &WaveArguments,
        frame: Option<u32>,
        sensor: &'a SensorSetup,
        (resolved, name): (&Resolved, &str),
    ) -> Result<Option<Self>, Error> {
        let Some(path) = &arguments.waves else { return Ok(None) };
        let file = WaveFile::new(path)?;
        let (rows, columns) = (arguments.wave_rows.as_deref(), arguments.wave_columns.as_deref());
        let asked = Asked { rows, columns, frame };
        let plan = WavePlan::new(sensor, asked, resolved.scenario.frames()?).map_err(|error| match &error {
            // Options have their own names; keys have a location in a file.
            Error::Config { key, .. } if key.starts_with("sensor.") => resolved.tree.locate(error),
            _ => error,
        })?;
        paths::refuse_input("--waves", path)?;
        file.check()?;
        Ok(Some(Self { plan, file, name: name.to_owned() }))
    }

    /// The picture that every result folder has: the middle row of the first frame. None where the sensor's rows have no waves.
    pub fn picture(target: &Path, sensor: &'a SensorSetup, (frames, name): (u32, &str)) -> Option<Self> {
        let row = (sensor.schedule.output_size().height_px / 2).to_string();
        let asked = Asked { rows: Some(&row), ..Asked::default() };
        let plan = WavePlan::new(sensor, asked, frames).ok()?;
        Some(Self { plan, file: WaveFile::new(&target.join(PICTURE)).ok()?, name: name.to_owned() })
    }

    /// Makes the session keep what the waves need.
    pub fn probe_rows(&self, session: &mut Session) {
        let selection = self.plan.selection();
        session.probe_rows(selection.frame, &selection.rows);
    }

    /// The chosen rows' codes, where the frame is the chosen one.
    pub fn codes_of(&self, frame: &Frame) -> Option<Vec<Vec<u16>>> {
        let selection = self.plan.selection();
        let row = |row: &RowIndex| frame.cameras[0].codes.row(sensel::num::index(row.0)).to_vec();
        (frame.frame == selection.frame).then(|| selection.rows.iter().map(row).collect())
    }

    /// Where in a result folder the file lies; none where it lies elsewhere.
    pub fn within(&self, target: &Path) -> Option<PathBuf> {
        let file = paths::real(self.file.path());
        file.strip_prefix(paths::real(target)).ok().map(Path::to_owned)
    }

    /// Lets the file be written under another path.
    pub fn redirect(&mut self, path: &Path) -> Result<(), Error> {
        sensel::files::make_folder(path.parent().unwrap_or(path))?;
        self.file = WaveFile::new(path)?;
        Ok(())
    }

    /// Writes the waves of the chosen rows, from what the session kept of them and the frame's codes.
    pub fn write_probed(&self, session: &Session, codes: &[Vec<u16>]) -> Result<(), Error> {
        let kept = session.probed_rows().iter().cloned();
        let rows: Vec<WaveRow> =
            kept.zip(codes).map(|(samples, sent)| WaveRow { samples, sent: Some(sent.clone()) }).collect();
        let setup = session.setup();
        self.write(&setup.chain(setup.sensor.parameters.adc.gain), &rows)
    }

    /// Writes the waves of the test picture under a die's converters.
    pub fn write_wedge(&self, sensor: &SensorSetup, die_seed: u64) -> Result<(), Error> {
        let chain = sensor.chain(sensor.parameters.adc.gain, [&[], &[]], 0, die_seed);
        self.write(&chain, &self.plan.wedge())
    }

    fn write(&self, chain: &Chain, rows: &[WaveRow]) -> Result<(), Error> {
        let width = rows.first().map_or(0, |row| row.samples.signal_uv.len());
        paths::refuse_input("--waves", self.file.path())?;
        self.file.write(&self.plan.waves(&chain.first_columns(CameraIndex(0), width), rows)?, &self.name)
    }
}
